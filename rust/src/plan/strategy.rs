//! Routes through a path: over more of its points until they hold, and several of them where one may not be the best.

use std::collections::{BTreeSet, HashMap};

use super::failure::{FailedJoint, FailureCause, PlanFailure};
use super::graph::Criterion;
use super::greedy::or_followed;
use super::hooks::{Hooks, PlanError};
use super::layers::{Layers, Segment};
use super::numbers::linspace;
use super::part::{Part, best_part, refined_part, tried_part};
use super::problem::PathProblem;
use super::proof::is_proven;
use super::route::FoundRoute;
use crate::robot::Joint;

/// Times that points are added to the search.
const ROUNDS: usize = 8;
/// A posture this far from where its neighbours' interpolation put it [rad] is on another route.
const WANDERED: f64 = 0.5;
/// How far in-between postures may be beyond a limit [rad or m]: the refinement brings them back.
const BEYOND: f64 = 0.02;
/// What the worst value of a route may exceed its minimum by: a grid's worst cell can force detours. The smoothest route comes first: if it
/// leads to the bound, no other is better.
const SLACKS: [f64; 3] = [0.1, 0.02, 0.0];
/// By what speed limits are multiplied, where a grid knows no way: its cells are coarser than a path's steps.
const HASTES: [f64; 4] = [1.0, 2.0, 4.0, f64::INFINITY];
/// Points between two of the search that are all added at once.
const SMALL_GAP: usize = 8;

/// Routes that start at the same point; each may lead to the best.
pub(super) type Rivals = Vec<Segment>;

/// Finds routes through the path, over `layers` points of it to begin with and as far as they lead, and refines them with `most` Newton steps:
/// the stretches that can be followed, in order, each the best that was found.
pub(super) fn searched_parts(
    problem: &PathProblem,
    known: &mut Layers,
    layers: usize,
    most: usize,
    hooks: &mut Hooks,
) -> Result<Vec<Part>, PlanError> {
    let n = problem.points();
    let mut wanted: BTreeSet<usize> = linspace(0.0, (n - 1) as f64, n.min(layers)).iter().map(|x| x.round_ties_even() as usize).collect();
    wanted.extend(problem.pins.points());
    let mut found: Vec<Rivals> = Vec::new();
    for _ in 0..ROUNDS {
        let points: Vec<usize> = wanted.iter().copied().collect();
        known.add(&points, hooks)?;
        hooks.go_on()?;
        let runs = open_runs(known, &points);
        let whole = runs.len() == 1 && runs[0].len() == points.len();
        found = runs.iter().flat_map(|run| routes(problem, known, run, whole)).collect();
        let more = where_more_is_needed(problem, known, &points, &found, hooks)?;
        if more.is_empty() {
            break;
        }
        wanted.extend(more);
    }
    let parts = found.iter().map(|rivals| best_of(problem, known, rivals, most, hooks)).collect::<Result<Vec<_>, _>>()?;
    let greedy = known.has_spare() && problem.objective.is_some() && problem.pins.is_empty();
    if greedy { or_followed(problem, parts, most, hooks) } else { Ok(parts) }
}

/// The runs of points that have postures.
fn open_runs(known: &Layers, points: &[usize]) -> Vec<Vec<usize>> {
    let runs = points.split(|point| !known.is_open(*point));
    runs.filter(|run| !run.is_empty()).map(<[usize]>::to_vec).collect()
}

/// The rival routes of a run of points, or of its parts where there is no way from one to the next.
#[inline(never)]
pub(super) fn routes(problem: &PathProblem, known: &Layers, points: &[usize], whole: bool) -> Vec<Rivals> {
    let closed = problem.closed && whole;
    let bounded = problem.is_bounded();
    let slacks = if problem.criterion == Criterion::Minimax { &SLACKS[..] } else { &[0.0] };
    for haste in HASTES.into_iter().take(if bounded { HASTES.len() } else { 1 }) {
        let mut finder = known.finder(points, closed, haste);
        let first = finder.find(slacks[0]);
        if first.cells.len() < points.len() {
            continue;
        }
        let mut rivals = vec![first];
        rivals.extend(slacks[1..].iter().map(|slack| finder.find(*slack)));
        if bounded && haste.is_finite() {
            // Cells are coarse beside what a joint may move: the refinement can slow down what a grid cannot.
            rivals.push(known.finder(points, closed, f64::INFINITY).find(slacks[0]));
        }
        let mut kept: Vec<FoundRoute> = Vec::new();
        for rival in rivals {
            if kept.iter().all(|other| other.q != rival.q) {
                kept.push(rival);
            }
        }
        return vec![kept.into_iter().map(|route| segment(points, route)).collect()];
    }
    let (mut parts, mut rest) = (Vec::new(), points);
    while !rest.is_empty() {
        let part = segment(rest, known.finder(rest, false, 1.0).find(0.0));
        if part.points.is_empty() {
            break;
        }
        rest = &rest[part.points.len()..];
        parts.push(vec![part]);
    }
    parts
}

pub(super) fn segment(points: &[usize], route: FoundRoute) -> Segment {
    Segment { points: points[..route.cells.len()].to_vec(), q: route.q, blocked: route.blockage }
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
    for ((kept, start), end) in kept.iter_mut().zip(q.chunks_exact(n)).zip(restored.chunks_exact(n)) {
        *kept &= end.iter().all(|x| x.is_finite());
        *kept &= start.iter().zip(end).all(|(a, b)| (a - b).abs() <= WANDERED);
        *kept &= !problem.limits || limits.margin(end) >= -BEYOND;
    }
    if hooks.feasible.is_some() {
        let asked: Vec<f64> = restored.chunks_exact(n).zip(&kept).filter(|(_, kept)| **kept).flat_map(|(row, _)| row).copied().collect();
        if let Some(allowed) = hooks.allowed(&asked, n)? {
            kept.iter_mut().filter(|kept| **kept).zip(allowed).for_each(|(kept, allowed)| *kept = allowed);
        }
    }
    Ok((0..kept.len()).filter(|&i| !kept[i]).map(|i| first + i).collect())
}

/// The best of rival routes, refined.
#[inline(never)]
pub(super) fn best_of(
    problem: &PathProblem,
    known: &mut Layers,
    rivals: &[Segment],
    most: usize,
    hooks: &mut Hooks,
) -> Result<Part, PlanError> {
    let n = problem.n();
    let mut parts: Vec<Part> = Vec::new();
    for segment in rivals {
        let (first, q) = segment.spread(n);
        let part = tried_part(problem, first, &q, most, hooks)?;
        let proven = rivals.len() > 1 && is_proven(problem, known, std::slice::from_ref(&part), hooks)?;
        parts.push(part);
        if proven {
            break;
        }
    }
    let mut part = best_part(problem.criterion, parts);
    if !part.refined && part.failure.is_none() {
        part = refined_part(problem, part.first, &part.q, most, hooks)?;
    }
    let ended = rivals[0].points[rivals[0].points.len() - 1];
    if let Some(blockage) = rivals[0].blocked.filter(|_| ended + 1 < problem.points()) {
        let slow = problem.bounds[ended * n + blockage.joint].is_finite() && blockage.excess > 1.0;
        let slides = problem.robot.joints()[blockage.joint] == Joint::Prismatic;
        let joint = FailedJoint { number: blockage.joint, slides, excess: blockage.excess, combination: None };
        let cause = if problem.timed { FailureCause::SpeedLimit } else { FailureCause::StepLimit };
        part.failure = Some(if slow {
            PlanFailure { point: ended + 1, cause, joint: Some(joint), pins: Vec::new() }
        } else {
            PlanFailure::at(ended + 1, FailureCause::NoWay)
        });
    }
    Ok(part)
}
