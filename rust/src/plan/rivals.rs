//! Rival routes, refined: all at a few points of the path, the best of them at every one.

use std::collections::BTreeSet;

use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::layers::{Layers, Segment};
use super::numbers::interpolated;
use super::part::{Part, best_part, refined_near, refined_part, tried_part};
use super::problem::PathProblem;
use super::proof::is_proven_at;

/// A path with more points is refined at some of them first.
const FEW: usize = 96;
/// Refined routes that are carried over to the whole path before the best of these has to do.
const CARRIED: usize = 2;

/// A way through the whole path, as far as it was compared.
#[derive(Debug, Clone, Copy)]
pub struct Way {
    /// Worst value, or mean; at some points of the path for those that were not chosen.
    pub value: f64,
    /// Integral of the squared joint speed over the path's share.
    pub motion: f64,
    /// Largest motion of a turning joint from point to point \[rad\].
    pub largest_step: f64,
    /// Whether it is an optimum.
    pub refined: bool,
}

/// A rival that is refined at some points.
struct Tried {
    part: Part,
    way: usize,
}

/// The best of rival routes of a stretch, refined, and the ways that were compared.
pub(super) fn best_of(
    problem: &PathProblem,
    known: &mut Layers,
    rivals: &[Segment],
    most: usize,
    hooks: &mut Hooks,
) -> Result<(Part, Vec<Way>), PlanError> {
    let n = problem.n();
    let (first, last) = (rivals[0].points[0], rivals[0].points[rivals[0].points.len() - 1]);
    let kept = some_points(first, last, &rivals[0].points);
    let thin = problem.thinned(&kept);
    let whole = last + 1 - first == kept.len();
    let mut tried: Vec<Tried> = Vec::new();
    let mut proven = false;
    for segment in rivals {
        // Of the same way a rival is tried only while another may be better.
        if proven && (segment.way == 0 || tried.iter().any(|other| other.way == segment.way)) {
            continue;
        }
        let q = segment.at(&kept, n);
        let part = tried_part(&thin, 0, &q, most, hooks)?;
        proven = proven || (rivals.len() > 1 && is_proven_at(problem, known, &kept, &part, hooks)?);
        tried.push(Tried { part, way: segment.way });
    }
    let ways = ways(problem, &kept, &tried);
    let mut parts: Vec<Part> = tried.into_iter().map(|tried| tried.part).collect();
    let mut carried: Vec<Part> = Vec::new();
    while !parts.is_empty() && carried.len() < CARRIED {
        let best = best_part(problem.criterion, parts.clone());
        parts.retain(|part| part.q != best.q);
        let part = if whole && best.is_optimum() {
            Part { first, ..best }
        } else {
            let q = spread(&kept, &best.q, n);
            if best.is_optimum() { refined_near(problem, first, &q, most, hooks)? } else { refined_part(problem, first, &q, most, hooks)? }
        };
        let done = part.is_optimum();
        carried.push(part);
        if done {
            break;
        }
    }
    Ok((best_part(problem.criterion, carried), ways))
}

/// The points of a stretch at which rivals are refined: those of the search, and others evenly where there are few.
fn some_points(first: usize, last: usize, points: &[usize]) -> Vec<usize> {
    let count = last + 1 - first;
    let mut kept: BTreeSet<usize> = points.iter().copied().collect();
    if count <= FEW.max(2 * points.len()) {
        return (first..=last).collect();
    }
    let stride = count.div_ceil(FEW);
    kept.extend((first..=last).step_by(stride));
    kept.into_iter().collect()
}

/// Postures at all points of a stretch, from those at some of them.
fn spread(kept: &[usize], q: &[f64], n: usize) -> Vec<f64> {
    let places: Vec<f64> = kept.iter().map(|&point| point as f64).collect();
    interpolated((kept[0]..=kept[kept.len() - 1]).map(|point| point as f64), &places, q, n)
}

/// The best of every way, the best first.
fn ways(problem: &PathProblem, kept: &[usize], tried: &[Tried]) -> Vec<Way> {
    let n = problem.n();
    let value = |part: &Part| if problem.criterion == Criterion::Minimax { part.worst() } else { part.cost };
    let mut numbers: Vec<usize> = tried.iter().map(|tried| tried.way).collect();
    numbers.dedup();
    let mut all: Vec<Way> = Vec::new();
    for number in numbers {
        let own: Vec<Part> = tried.iter().filter(|tried| tried.way == number).map(|tried| tried.part.clone()).collect();
        let best = best_part(problem.criterion, own);
        if best.failure.is_some() {
            continue;
        }
        let mut q = spread(kept, &best.q, n);
        problem.restored(kept[0], &mut q);
        let motion = problem.motion_integral(kept[0], &q);
        all.push(Way { value: value(&best), motion, largest_step: problem.largest_turn(&q), refined: best.refined });
    }
    all.sort_by(|a, b| a.value.total_cmp(&b.value));
    all
}
