//! Routes through a path: over more of its points until they hold, and several of them where one may not be the best.

use std::collections::{BTreeSet, HashMap};

use super::failure::{FailedJoint, FailureCause, PlanFailure};
use super::graph::Criterion;
use super::greedy::or_followed;
use super::hooks::{Hooks, Phase, PlanError};
use super::layers::{Layers, Segment};
use super::part::{Part, best_part, largest_share};
use super::points_of_search::first_points;
use super::problem::PathProblem;
use super::proof::{Better, better_way, least_of_hardest};
use super::rivals::{Way, best_of};
use super::route::FoundRoute;
use super::through::{singular_way, with_singular_ends};
use crate::robot::Joint;

/// Times that points are added to the search.
const ROUNDS: usize = 8;
/// A posture this far from where its neighbours' interpolation put it [rad] is on another route.
const WANDERED: f64 = 0.5;
/// How far in-between postures may be beyond a limit [rad or m]: the refinement brings them back.
const BEYOND: f64 = 0.02;
/// How far they may be outside a volume of orientations \[rad\].
const OUTSIDE: f64 = 0.1;
/// What the worst value of a route may exceed its minimum by: a grid's worst cell can force detours. The smoothest route comes first: if it
/// leads to the bound, no other is better.
const SLACKS: [f64; 3] = [0.1, 0.02, 0.0];
/// By what speed limits are multiplied, where a grid knows no way: its cells are coarser than a path's steps.
const HASTES: [f64; 4] = [1.0, 2.0, 4.0, f64::INFINITY];
/// Points between two of the search that are all added at once.
const SMALL_GAP: usize = 8;

/// A graph with more steps from cell to cell is searched for the best route alone.
const LARGE: usize = 40_000_000;
/// Ways that are refined beside the best route.
const WAYS: usize = 8;
/// The same of the slowest step, where the tool may tilt.
const FEW_WAYS: usize = 3;
/// Spins of every branch at which ways of little motion are looked for.
const SPINS: usize = 12;
/// The same where the tool's speed is sought.
const SPREAD: usize = 4;

/// Routes that start at the same point; each may lead to the best.
pub(super) type Rivals = Vec<Segment>;

/// Ways of the bound that are tried.
const IMPROVED: usize = 3;
/// A way that gains less, relative, ends these trials.
const GAIN: f64 = 1e-4;
/// A worst value this near to its bound, relative, is worth no finer search.
const GAP: f64 = 1e-3;
/// A mean this near to that of the best cells, relative, is worth no finer search.
const MEAN_GAP: f64 = 0.05;

/// What a search finds.
#[derive(Debug, Default)]
pub(super) struct Searched {
    /// The stretches that can be followed, in order, each the best that was found.
    pub parts: Vec<Part>,
    /// The ways through the whole path that were compared.
    pub ways: Vec<Way>,
}

/// Finds routes through the path, over some points of it to begin with and as far as they lead, and refines them.
pub(super) fn searched(problem: &PathProblem, known: &mut Layers, most: usize, hooks: &mut Hooks) -> Result<Searched, PlanError> {
    let mut wanted: BTreeSet<usize> = first_points(problem, known.first_layers()).into_iter().collect();
    wanted.extend(problem.pins.points());
    let mut found: Vec<Rivals> = Vec::new();
    for _ in 0..ROUNDS {
        let points: Vec<usize> = wanted.iter().copied().collect();
        known.add(&points, hooks)?;
        hooks.go_on()?;
        let runs = open_runs(known, &points);
        let whole = runs.len() == 1 && runs[0].len() == runs_length(known, &points);
        found.clear();
        for run in &runs {
            found.extend(routes(problem, known, run, whole, hooks)?);
        }
        let more = where_more_is_needed(problem, known, &points, &found, hooks)?;
        if more.is_empty() {
            break;
        }
        wanted.extend(more);
    }
    hooks.enter(Phase::Refine);
    let mut out = Searched::default();
    for rivals in &found {
        let (mut part, mut ways) = best_of(problem, known, rivals, most, hooks)?;
        if is_too_fast(&part) {
            // On other ways the cells may only be further apart.
            let others = other_ways(problem, known, rivals, hooks)?;
            if !others.is_empty() {
                let (other, beside) = best_of(problem, known, &others, most, hooks)?;
                (part, ways) = (best_part(problem.criterion, vec![part, other]), if ways.is_empty() { beside } else { ways });
            }
        }
        out.ways = ways;
        let part = with_singular_ends(problem, known, part, hooks)?;
        out.parts.push(blocked(problem, rivals, part, hooks));
    }
    if found.is_empty() {
        out.parts.extend(singular_way(problem, known, most, hooks)?);
    }
    if found.len() != 1 {
        out.ways.clear();
    }
    if known.has_spare() && problem.pins.is_empty() && problem.volume.is_none() {
        out.parts = or_followed(problem, known, out.parts, most, hooks)?;
    }
    Ok(out)
}

/// Whether a part is whole but for a step that is too large.
fn is_too_fast(part: &Part) -> bool {
    part.failure.as_ref().is_some_and(|failure| matches!(failure.cause, FailureCause::SpeedLimit | FailureCause::StepLimit))
}

/// Routes of little motion through the points of rival routes, the calmest first.
fn other_ways(problem: &PathProblem, known: &mut Layers, rivals: &[Segment], hooks: &mut Hooks) -> Result<Rivals, PlanError> {
    let points = &rivals[0].points;
    let closed = problem.closed && points[0] == 0 && points[points.len() - 1] + 1 == problem.points();
    let finder = known.finder(points, closed, f64::INFINITY, hooks)?;
    let routes = if finder.steps() > LARGE { Vec::new() } else { finder.calm(SPINS) };
    let mut found: Vec<(f64, Segment)> = Vec::new();
    for (route, way) in routes.into_iter().zip(0..) {
        let segment = segment(points, route, way);
        if found.iter().all(|(_, other)| other.q != segment.q) {
            let (first, q) = segment.spread(problem.n());
            found.push((largest_share(problem, first, &q), segment));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(WAYS);
    Ok(found.into_iter().map(|(_, segment)| segment).collect())
}

/// Better parts, along ways that the bound over connected ways leaves open.
pub(super) fn improved(
    problem: &PathProblem,
    known: &mut Layers,
    parts: Vec<Part>,
    most: usize,
    hooks: &mut Hooks,
) -> Result<Vec<Part>, PlanError> {
    let [part] = &parts[..] else { return Ok(parts) };
    let mut part = part.clone();
    for _ in 0..IMPROVED {
        let Better::Maybe(way) = better_way(problem, known, &part, hooks)? else { break };
        let points: Vec<usize> = way.iter().map(|(point, _)| *point).collect();
        let route = known.finder_along(&way, hooks)?.find(0.0);
        if route.cells.len() < points.len() {
            break;
        }
        let (other, _) = best_of(problem, known, &[segment(&points, route, 0)], most, hooks)?;
        let before = part.worst();
        part = best_part(problem.criterion, vec![part, other]);
        if part.worst() >= before - GAIN * before.abs() {
            break;
        }
    }
    Ok(vec![part])
}

/// Whether a finer search may find a better path. What no connected way is better than does not tell: a way may be narrower than a cell.
pub(super) fn is_worth_more(problem: &PathProblem, known: &mut Layers, parts: &[Part], hooks: &mut Hooks) -> Result<bool, PlanError> {
    let [part] = parts else { return Ok(true) };
    if part.len() < problem.points() || !part.is_optimum() {
        return Ok(true);
    }
    match problem.criterion {
        Criterion::Minimax if problem.objective.is_none() => Ok(false),
        Criterion::Minimax => Ok(!part.is_within(least_of_hardest(known, hooks)?, GAP)),
        Criterion::Integral => {
            Ok(problem.objective.is_some() && part.cost - known.mean_of_best(&problem.weights) > MEAN_GAP * part.cost.abs())
        }
    }
}

/// The runs of points that have postures. A way passes through a singular point on the way from others.
fn open_runs(known: &Layers, points: &[usize]) -> Vec<Vec<usize>> {
    let passed: Vec<usize> = points.iter().copied().filter(|point| !known.is_singular(*point)).collect();
    let runs = passed.split(|point| !known.is_open(*point));
    runs.filter(|run| !run.is_empty()).map(<[usize]>::to_vec).collect()
}

/// How long the only run is where all points can be passed.
fn runs_length(known: &Layers, points: &[usize]) -> usize {
    points.iter().filter(|point| !known.is_singular(**point)).count()
}

/// The rival routes of a run of points, or of its parts where there is no way from one to the next.
#[inline(never)]
pub(super) fn routes(
    problem: &PathProblem,
    known: &mut Layers,
    points: &[usize],
    whole: bool,
    hooks: &mut Hooks,
) -> Result<Vec<Rivals>, PlanError> {
    let closed = problem.closed && whole;
    let bounded = problem.is_bounded();
    let slacks = if problem.criterion == Criterion::Minimax { &SLACKS[..] } else { &[0.0] };
    for haste in HASTES.into_iter().take(if bounded { HASTES.len() } else { 1 }) {
        let mut finder = known.finder(points, closed, haste, hooks)?;
        let slacks = if finder.steps() > LARGE { &slacks[slacks.len() - 1..] } else { slacks };
        let first = finder.find(slacks[0]);
        if first.cells.len() < points.len() {
            continue;
        }
        let mut rivals = vec![first];
        rivals.extend(slacks[1..].iter().map(|slack| finder.find(*slack)));
        let ways = if finder.steps() > LARGE { Vec::new() } else { finder.ways(WAYS) };
        if problem.timed && bounded && haste.is_finite() {
            // Cells are coarse beside what a joint may move: the refinement can slow down what a grid cannot.
            rivals.push(known.finder(points, closed, f64::INFINITY, hooks)?.find(slacks[0]));
        }
        let mut ways = ways;
        if let Some(mut finder) = known.finder_of_speed(problem, points, closed, haste) {
            rivals.extend(slacks.iter().map(|slack| finder.find(*slack)).filter(|route| route.cells.len() == points.len()));
            if finder.steps() <= LARGE {
                // Tilts make as many ways again, which cost more each.
                let tilts = problem.volume.is_some();
                ways.extend(finder.ways(if tilts { FEW_WAYS } else { WAYS }));
                ways.extend(if tilts { Vec::new() } else { finder.spread(SPREAD) });
            }
            let mut seen: Vec<FoundRoute> = Vec::new();
            ways.retain(|way| {
                seen.iter().all(|other| other.q != way.q) && {
                    seen.push(way.clone());
                    true
                }
            });
        }
        if hooks.edge_cost.is_some() {
            // The way that is best but for the caller's costs: a plan with them is to be no worse than one without.
            rivals.push(known.finder(points, closed, haste, &mut Hooks::default())?.find(slacks[0]));
        }
        let mut kept: Vec<FoundRoute> = Vec::new();
        for rival in rivals {
            if kept.iter().all(|other| other.q != rival.q) {
                kept.push(rival);
            }
        }
        let mut segments: Rivals = kept.into_iter().map(|route| segment(points, route, 0)).collect();
        // The routes so far are the first way.
        segments.extend(ways.into_iter().skip(1).zip(1..).map(|(route, way)| segment(points, route, way)));
        return Ok(vec![segments]);
    }
    let (mut parts, mut rest) = (Vec::new(), points);
    while !rest.is_empty() {
        let part = segment(rest, known.finder(rest, false, 1.0, hooks)?.find(0.0), 0);
        if part.points.is_empty() {
            break;
        }
        rest = &rest[part.points.len()..];
        parts.push(vec![part]);
    }
    Ok(parts)
}

pub(super) fn segment(points: &[usize], route: FoundRoute, way: usize) -> Segment {
    Segment { points: points[..route.cells.len()].to_vec(), q: route.q, blocked: route.blockage, way }
}

/// Points whose cells should be known: where routes end early and where interpolation loses the path.
fn where_more_is_needed(
    problem: &PathProblem,
    known: &Layers,
    wanted: &[usize],
    found: &[Rivals],
    hooks: &mut Hooks,
) -> Result<BTreeSet<usize>, PlanError> {
    let mut more = BTreeSet::new();
    let part_of: HashMap<usize, usize> =
        found.iter().enumerate().flat_map(|(part, rivals)| rivals[0].points.iter().map(move |point| (*point, part))).collect();
    for pair in wanted.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let joined = part_of.contains_key(&a) && part_of.get(&a) == part_of.get(&b);
        if b - a > 1 && !joined && (known.is_open(a) || known.is_open(b)) {
            // Halving finds the edge.
            if b - a > SMALL_GAP {
                more.insert((a + b) / 2);
            } else {
                more.extend(a + 1..b);
            }
        }
    }
    for rivals in found.iter().filter(|rivals| rivals[0].points.len() > 1) {
        let lost = lost_points(problem, &rivals[0], hooks)?;
        // Of many neighbours every other one will do: the next round sees whether it did.
        more.extend(lost.iter().step_by(if lost.len() > 2 * SMALL_GAP { 2 } else { 1 }));
    }
    more.retain(|point| !known.is_known(*point));
    Ok(more)
}

/// The points of a segment at which interpolation loses the path, its limits or what the caller allows.
#[inline(never)]
pub(super) fn lost_points(problem: &PathProblem, segment: &Segment, hooks: &mut Hooks) -> Result<Vec<usize>, PlanError> {
    let n = problem.n();
    let (first, q) = segment.spread(n);
    let mut restored = q.clone();
    let mut kept = problem.restored(first, &mut restored);
    let limits = problem.robot.limits();
    for (i, ((kept, start), end)) in kept.iter_mut().zip(q.chunks_exact(n)).zip(restored.chunks_exact(n)).enumerate() {
        *kept &= end.iter().all(|x| x.is_finite());
        *kept &= start.iter().zip(end).all(|(a, b)| (a - b).abs() <= WANDERED);
        *kept &= !problem.limits || limits.margin(end) >= -BEYOND;
        *kept &= problem.outside(first + i, end) <= OUTSIDE;
    }
    if hooks.feasible.is_some() {
        let asked: Vec<f64> = restored.chunks_exact(n).zip(&kept).filter(|(_, kept)| **kept).flat_map(|(row, _)| row).copied().collect();
        if let Some(allowed) = hooks.allowed(&asked, n)? {
            kept.iter_mut().filter(|kept| **kept).zip(allowed).for_each(|(kept, allowed)| *kept = allowed);
        }
    }
    Ok((0..kept.len()).filter(|&i| !kept[i]).map(|i| first + i).collect())
}

/// A part with the reason why its route ends before the path does.
fn blocked(problem: &PathProblem, rivals: &[Segment], mut part: Part, hooks: &Hooks) -> Part {
    let n = problem.n();
    let ended = rivals[0].points[rivals[0].points.len() - 1];
    if let Some(blockage) = rivals[0].blocked.filter(|_| ended + 1 < problem.points()) {
        let bounded = problem.bounds[ended * n + blockage.joint].is_finite() && blockage.excess > 1.0;
        let slides = problem.robot.joints()[blockage.joint] == Joint::Prismatic;
        let joint = FailedJoint { number: blockage.joint, slides, excess: blockage.excess, combination: None };
        let cause = if problem.timed { FailureCause::SpeedLimit } else { FailureCause::StepLimit };
        part.failure = Some(if bounded {
            PlanFailure::new(ended + 1, cause, Some(joint))
        } else if blockage.excess <= 1.0 && hooks.edge_cost.is_some() {
            PlanFailure::at(ended + 1, FailureCause::EdgeCost)
        } else {
            PlanFailure::at(ended + 1, FailureCause::NoWay)
        });
    }
    part
}
