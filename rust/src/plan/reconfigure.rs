//! A path without a single way through it, cut into the fewest segments: the tool is lifted off at the end of each and set down again in another posture.

use std::collections::BTreeSet;

use super::failure::FailureCause;
use super::graph::{Criterion, Graph, Search};
use super::hooks::{Hooks, PlanError};
use super::layers::Layers;
use super::numbers::{linspace, sum};
use super::part::Part;
use super::path::point_weights;
use super::problem::PathProblem;
use super::proof::proven_bound;
use super::rivals::best_of;
use super::settings::PlanSettings;
use super::strategy::{lost_points, routes, segment};
use super::transfer::transfer;
use super::verdict::{Plan, assembled};

/// Segments at most: a path that asks for more is none for the robot.
const MOST_SEGMENTS: usize = 64;
/// Layers of a search at most.
const MOST_LAYERS: usize = 1000;
/// Times that layers are added where interpolation between them loses the path.
const ROUNDS: usize = 4;
/// A cell that nothing leads to, or that begins a segment.
const AFRESH: u32 = u32::MAX;

/// A segment of a graph's layers: the first, and the cells from there on.
type Cut = (usize, Vec<usize>);

/// The plan of a path in as few segments as can be found, none if some point has no posture. `parts` are what a search for a whole way has left.
pub(super) fn reconfigured(
    problem: &PathProblem,
    known: &mut Layers,
    parts: &[Part],
    settings: &PlanSettings,
    hooks: &mut Hooks,
) -> Result<Option<Plan>, PlanError> {
    // A path that is cut need not end in the posture that it starts from: the tool is off the work in between.
    let open = PathProblem { closed: false, ..problem.clone() };
    let mut best = joined(&open, parts, hooks)?;
    let mut tried = BTreeSet::new();
    // Coarse layers let joints to spare pass from value to value, fine ones tell where exactly the way ends.
    for layers in [settings.layers, known.layers_to_spare().max(settings.layers), MOST_LAYERS] {
        let layers = layers.min(open.points()).min(MOST_LAYERS);
        if tried.insert(layers)
            && let Some(parts) = segmented(&open, known, layers, settings.max_iterations, hooks)?
            && best.as_ref().is_none_or(|best| rank(&open, &parts) < rank(&open, best))
        {
            best = Some(parts);
        }
    }
    let Some(parts) = best else { return Ok(None) };
    let mut plan = put_together(&open, known, &parts, hooks)?;
    if plan.failure.is_some() {
        return Ok(None);
    }
    for pair in parts.windows(2) {
        plan.transfers.push(transfer(&open, &pair[0], &pair[1], settings, hooks)?);
    }
    if problem.closed
        && let (Some(first), Some(last)) = (parts.first(), parts.last())
    {
        plan.transfers.push(transfer(&open, last, first, settings, hooks)?);
    }
    if settings.is_bounded() {
        plan.bound = proven_bound(&open, known, &plan.q, &plan.value, hooks)?;
    }
    Ok(Some(plan))
}

/// Fewer segments come first, then the lesser cost.
fn rank(problem: &PathProblem, parts: &[Part]) -> (usize, f64) {
    let cost = cost(problem, parts);
    (parts.len(), if cost.is_nan() { f64::INFINITY } else { cost })
}

/// The segments found over some layers, refined; none where some point has no posture or a segment cannot be followed.
#[inline(never)]
fn segmented(
    problem: &PathProblem,
    known: &mut Layers,
    layers: usize,
    most: usize,
    hooks: &mut Hooks,
) -> Result<Option<Vec<Part>>, PlanError> {
    let n = problem.points();
    let mut wanted: BTreeSet<usize> = linspace(0.0, (n - 1) as f64, n.min(layers)).iter().map(|x| x.round_ties_even() as usize).collect();
    wanted.extend(problem.pins.points());
    let (mut cuts, mut points) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        points = wanted.iter().copied().collect();
        known.add(&points, hooks)?;
        hooks.go_on()?;
        if !points.iter().all(|point| known.is_open(*point)) {
            return Ok(None);
        }
        let (graph, search) = known.searched(&points, 1.0, &|_, _| true);
        let Some(found) = fewest(&graph, &search) else { return Ok(None) };
        cuts = found;
        let mut more = BTreeSet::new();
        for (first, cells) in cuts.iter().filter(|(_, cells)| cells.len() > 1) {
            let between = known.finder(&points[*first..first + cells.len()], false, 1.0, hooks)?.find(0.0);
            more.extend(lost_points(problem, &segment(&points[*first..], between, 0), hooks)?);
        }
        // Where nothing leads on, what lies between two layers would be left out.
        for pair in cuts.windows(2) {
            more.extend(points[pair[0].0 + pair[0].1.len() - 1] + 1..points[pair[1].0]);
        }
        more.retain(|point| !wanted.contains(point));
        if more.is_empty() {
            break;
        }
        wanted.extend(more);
    }
    let mut parts = Vec::new();
    for (first, cells) in cuts {
        if !followed(problem, known, &points[first..first + cells.len()], most, &mut parts, hooks)? {
            return Ok(None);
        }
    }
    let skips = parts.windows(2).any(|pair| pair[1].first > pair[0].first + pair[0].len());
    Ok((!skips).then_some(parts))
}

/// Refines the best way through some layers; in two where whole turns do not fit, or where it cannot be followed. Whether there is one.
#[inline(never)]
fn followed(
    problem: &PathProblem,
    known: &mut Layers,
    layers: &[usize],
    most: usize,
    parts: &mut Vec<Part>,
    hooks: &mut Hooks,
) -> Result<bool, PlanError> {
    if parts.len() >= MOST_SEGMENTS {
        return Ok(false);
    }
    let mut rivals = routes(problem, known, layers, false, hooks)?.swap_remove(0);
    let reached = rivals[0].points.len();
    // A rival by another way may lead less far.
    rivals.retain(|rival| rival.points.len() == reached);
    let (part, _) = best_of(problem, known, &rivals, most, hooks)?;
    let last = part.first + part.len() - 1;
    // What ends a route at its last point is what the next segment is for.
    let failed = part.failure.as_ref().map(|failure| failure.point).filter(|point| *point <= last);
    let end = match failed {
        None => {
            parts.push(Part { failure: None, ..part });
            reached - 1
        }
        Some(_) if reached < 3 => return Ok(false),
        Some(point) => {
            let before = layers[..reached].iter().rposition(|layer| *layer < point).unwrap_or(0).clamp(1, reached - 2);
            if !followed(problem, known, &layers[..=before], most, parts, hooks)? {
                return Ok(false);
            }
            before
        }
    };
    // The next one begins where this one ends, unless nothing leads on from there.
    let start = if end == 0 { 1 } else { end };
    if end + 1 >= layers.len() { Ok(true) } else { followed(problem, known, &layers[start..], most, parts, hooks) }
}

/// The parts that a search has left of a path, if all of it is in them and each can be followed; each from the end of the one before, where Newton leads
/// back there.
#[inline(never)]
fn joined(problem: &PathProblem, parts: &[Part], hooks: &mut Hooks) -> Result<Option<Vec<Part>>, PlanError> {
    let n = problem.n();
    let mut out: Vec<Part> = Vec::new();
    for part in parts {
        let next = out.last().map_or(0, |before: &Part| before.first + before.len());
        let last = part.first + part.len() - 1;
        if part.first != next || part.failure.as_ref().is_some_and(|failure| failure.point <= last) || out.len() >= MOST_SEGMENTS {
            return Ok(None);
        }
        let mut part = Part { failure: None, ..part.clone() };
        if next > 0 && problem.pins.posture(next - 1).is_none() {
            let mut back = part.q[..n].to_vec();
            let reached = problem.restored(next - 1, &mut back)[0];
            let bounds = &problem.bounds[(next - 1) * n..next * n];
            let near = back.iter().zip(&part.q).zip(bounds).all(|((a, b), bound)| (a - b).abs() <= *bound);
            let value = problem.values(&back)[0];
            let within = !problem.limits || problem.robot.limits().contain(&back);
            if reached && near && within && value.is_finite() && hooks.all_allowed(&back, n)? {
                back.extend(&part.q);
                part = Part { first: next - 1, value: [&[value], &part.value[..]].concat(), q: back, ..part };
                part.motion = problem.motion_integral(part.first, &part.q);
            }
        }
        out.push(part);
    }
    let all = out.last().is_some_and(|part| part.first + part.len() == problem.points());
    Ok(all.then_some(out))
}

/// The fewest segments of a graph, and of those with as few the cheapest: one sweep for every number of segments, each of which may begin afresh at any
/// layer that the one before has reached. A segment begins in the layer in which the one before ends; in the next one only where no posture leads on.
fn fewest(graph: &Graph, search: &Search) -> Option<Vec<Cut>> {
    let (cuts, cost) = swept(graph, search, f64::INFINITY)?;
    if search.criterion == Criterion::Integral {
        return Some(cuts);
    }
    let (under, ceiling) = search.under_cost(cost);
    swept(graph, &under, ceiling).map(|(cuts, _)| cuts).or(Some(cuts))
}

/// What is kept of a sweep: where every cell was reached from, and the cheapest cell of every layer with its cost.
struct Level {
    from: Vec<Vec<u32>>,
    best: Vec<(f64, usize)>,
    /// The last layer that was reached.
    reach: usize,
}

#[inline(never)]
fn swept(graph: &Graph, search: &Search, ceiling: f64) -> Option<(Vec<Cut>, f64)> {
    let last = graph.layers() - 1;
    let mut entries = vec![f64::INFINITY; last + 1];
    entries[0] = if search.criterion == Criterion::Minimax { f64::NEG_INFINITY } else { 0.0 };
    let mut gaps = vec![false; last + 1];
    let mut levels: Vec<Level> = Vec::new();
    while levels.last().is_none_or(|level| level.reach < last) {
        if levels.len() >= MOST_SEGMENTS {
            return None;
        }
        if let Some(before) = levels.last() {
            entries = entered(before, &gaps);
        }
        let mut level = sweep(graph, search, ceiling, &entries)?;
        if let Some(before) = levels.last()
            && before.reach == level.reach
        {
            // All postures of that layer began a segment, and none leads on.
            gaps[level.reach + 1] = true;
            level = sweep(graph, search, ceiling, &entered(before, &gaps))?;
            if level.reach == before.reach {
                return None;
            }
        }
        levels.push(level);
    }
    let cost = levels.last()?.best[last].0;
    Some((traced(&levels, &gaps, last), cost))
}

/// What it costs at least to begin another segment at every layer.
fn entered(before: &Level, gaps: &[bool]) -> Vec<f64> {
    (0..gaps.len()).map(|layer| before.best[layer - usize::from(gaps[layer])].0).collect()
}

/// The segments, from the end.
fn traced(levels: &[Level], gaps: &[bool], last: usize) -> Vec<Cut> {
    let (mut out, mut layer, mut number) = (Vec::new(), last, levels.len() - 1);
    loop {
        let level = &levels[number];
        let mut cells = vec![level.best[layer].1];
        while level.from[layer][cells[cells.len() - 1]] != AFRESH {
            cells.push(level.from[layer][cells[cells.len() - 1]] as usize);
            layer -= 1;
        }
        cells.reverse();
        out.push((layer, cells));
        if number == 0 {
            break;
        }
        (layer, number) = (layer - usize::from(gaps[layer]), number - 1);
    }
    out.reverse();
    out
}

/// One pass through the layers; a cell may begin at what `entries` says of its layer. None where nothing is reached.
#[inline(never)]
fn sweep(graph: &Graph, search: &Search, ceiling: f64, entries: &[f64]) -> Option<Level> {
    let mut level = Level { from: Vec::new(), best: Vec::new(), reach: 0 };
    let mut before: Vec<f64> = Vec::new();
    for (layer, &entry) in entries.iter().enumerate() {
        let found = graph.reached(search, layer, &before, entry, ceiling);
        let (cost, from): (Vec<f64>, Vec<u32>) = found.into_iter().unzip();
        let best = (0..cost.len()).fold((f64::INFINITY, 0), |best, cell| if cost[cell] < best.0 { (cost[cell], cell) } else { best });
        if best.0 < f64::INFINITY {
            level.reach = layer;
        }
        level.best.push(best);
        level.from.push(from);
        before = cost;
    }
    (level.best[0].0 < f64::INFINITY || level.reach > 0).then_some(level)
}

impl Graph {
    /// The cheapest way to every cell of a layer, with where it comes from: from the layer before, or afresh.
    fn reached(&self, search: &Search, layer: usize, before: &[f64], entry: f64, ceiling: f64) -> Vec<(f64, u32)> {
        let bounded = ceiling.is_finite();
        let best = |cell: usize| {
            if !self.open(layer, cell) || self.value_of(layer, cell) > ceiling {
                return (f64::INFINITY, AFRESH);
            }
            let own = match search.criterion {
                Criterion::Minimax => self.value_of(layer, cell),
                Criterion::Integral if bounded => 0.0,
                Criterion::Integral => self.weights[layer] * self.value_of(layer, cell),
            };
            let afresh = if search.criterion == Criterion::Minimax { entry.max(own) } else { entry + own };
            let led = if layer == 0 { (f64::INFINITY, AFRESH) } else { self.best_step(search, layer, cell, before, own) };
            if led.0 <= afresh && led.0 < f64::INFINITY { led } else { (afresh, AFRESH) }
        };
        self.of_every_cell(search, &best)
    }
}

/// What was minimised, over all segments.
#[inline(never)]
fn cost(problem: &PathProblem, parts: &[Part]) -> f64 {
    let worst = parts.iter().map(Part::worst).fold(f64::NEG_INFINITY, f64::max);
    if problem.criterion == Criterion::Minimax { worst } else { mean(problem, parts) + parts[0].smoothness * motion(problem, parts) }
}

/// The mean value.
fn mean(problem: &PathProblem, parts: &[Part]) -> f64 {
    let weights = point_weights(&problem.steps, false);
    apart(parts).iter().flat_map(|part| part.value.iter().zip(&weights[part.first..])).map(|(value, weight)| value * weight).sum()
}

/// The integral of the squared joint speed along the segments, over the share of the whole path.
fn motion(problem: &PathProblem, parts: &[Part]) -> f64 {
    let share = |part: &Part| sum(&problem.steps[part.first..part.first + part.len() - 1]);
    parts.iter().filter(|part| part.len() > 1).map(|part| part.motion / share(part)).sum()
}

/// The parts without what an earlier one has of their points.
fn apart(parts: &[Part]) -> Vec<Part> {
    let mut next = 0;
    let mut out = Vec::new();
    for part in parts {
        let skip = next - part.first.min(next);
        next = part.first + part.len();
        if skip < part.len() {
            let n = part.q.len() / part.len();
            let (first, q, value) = (part.first + skip, part.q[skip * n..].to_vec(), part.value[skip..].to_vec());
            out.push(Part { first, q, value, ..part.clone() });
        }
    }
    out
}

/// The plan of the segments; that they are several is no failure.
fn put_together(problem: &PathProblem, known: &mut Layers, parts: &[Part], hooks: &mut Hooks) -> Result<Plan, PlanError> {
    let mut plan = assembled(problem, known, &apart(parts), hooks)?;
    let starts = |point: usize| parts.iter().any(|part| part.first == point || part.first + 1 == point);
    plan.failure = plan.failure.filter(|failure| failure.cause != FailureCause::NoWay || !starts(failure.point));
    plan.refined = parts.iter().all(|part| part.refined);
    plan.segments = parts.iter().map(|part| (part.first, part.first + part.len() - 1)).collect();
    (plan.cost, plan.motion) = (cost(problem, parts), motion(problem, parts));
    Ok(plan)
}
