//! Rival routes, refined: all at a few points of the path, the best of them at every one.

use std::collections::BTreeSet;

use super::corridor::weighed;
use super::failure::{FailureCause, PlanFailure};
use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::layers::{Layers, Segment};
use super::numbers::interpolated;
use super::part::{Part, best_part, calmed_part, first_part, next_part, refined_part};
use super::problem::PathProblem;
use super::proof::is_proven_at;

/// A path with more than twice as many points is refined at some of them first.
const FEW: usize = 96;
/// Refined routes that are carried over to the whole path before the best of these has to do.
const CARRIED: usize = 2;
/// Values and motions this near to each other, relative, are those of one way.
const SAME: f64 = 1e-6;
/// How many times as many points follow each time that a part is carried over to more.
const GROWTH: usize = 4;

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
    /// Which of the rivals it is.
    rival: usize,
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
    let mut tried: Vec<Tried> = Vec::new();
    let mut proven = false;
    for (rival, segment) in rivals.iter().enumerate() {
        // Once one is proven to be the best, one of every other way is looked at.
        if proven && tried.iter().any(|other| other.way == segment.way) {
            continue;
        }
        let route = segment.at(&kept, n);
        let part = weighed(&thin, first_part(&thin, 0, &route, most, hooks)?, &route, hooks)?;
        proven = proven || (rivals.len() > 1 && is_proven_at(problem, known, &kept, &part, hooks)?);
        tried.push(Tried { part, way: segment.way, rival });
    }
    if !tried.iter().any(|tried| tried.part.failure.is_none()) && too_large(&tried) {
        for (rival, segment) in rivals.iter().enumerate() {
            let part = calmed_part(&thin, 0, &segment.at(&kept, n), most, hooks)?;
            tried.push(Tried { part, way: segment.way, rival });
        }
    }
    let ways = ways(problem, &kept, &tried);
    let mut carried: Vec<Part> = Vec::new();
    let all: Vec<usize> = (first..=last).collect();
    while !tried.is_empty() && carried.len() < CARRIED {
        let Tried { part: best, rival, .. } = tried.swap_remove(best_of_tried(problem, &tried));
        let route = at(&kept, &best.q, &all, n);
        let mut part = weighed(problem, carried_over(problem, &kept, best, most, hooks)?, &route, hooks)?;
        if part.failure.is_some() && kept.len() < all.len() {
            // At some points alone a way may be on limits that leave none at the others: the route itself is a start that is not on them.
            let route = rivals[rival].at(&all, n);
            let again = weighed(problem, refined_part(problem, first, &route, most, hooks)?, &route, hooks)?;
            part = best_part(problem.criterion, vec![part, again]);
            if part.failure.is_some() {
                let again = weighed(problem, calmed_part(problem, first, &route, most, hooks)?, &route, hooks)?;
                part = best_part(problem.criterion, vec![part, again]);
            }
        }
        let done = part.is_optimum();
        carried.push(part);
        if done {
            break;
        }
    }
    Ok((best_part(problem.criterion, carried), ways))
}

/// Whether steps are too large in all.
fn too_large(tried: &[Tried]) -> bool {
    let of_motion = |failure: &PlanFailure| matches!(failure.cause, FailureCause::SpeedLimit | FailureCause::StepLimit);
    tried.iter().all(|tried| tried.part.failure.as_ref().is_some_and(of_motion))
}

/// Which of some is the best.
fn best_of_tried(problem: &PathProblem, tried: &[Tried]) -> usize {
    let best = best_part(problem.criterion, tried.iter().map(|tried| tried.part.clone()).collect());
    tried.iter().position(|tried| tried.part.q == best.q).unwrap_or(0)
}

/// A part at some points of a stretch, carried over to all of them: to more and more, each time from near its optimum.
fn carried_over(problem: &PathProblem, kept: &[usize], part: Part, most: usize, hooks: &mut Hooks) -> Result<Part, PlanError> {
    let n = problem.n();
    let (first, last) = (kept[0], kept[kept.len() - 1]);
    let count = last + 1 - first;
    if kept.len() == count {
        return if part.is_optimum() { Ok(Part { first, ..part }) } else { refined_part(problem, first, &part.q, most, hooks) };
    }
    let (mut kept, mut part) = (kept.to_vec(), part);
    while 2 * GROWTH * kept.len() < count {
        let more = denser(&kept);
        let q = at(&kept, &part.q, &more, n);
        part = next_part(&problem.thinned(&more), 0, &q, most, hooks)?;
        kept = more;
    }
    let all: Vec<usize> = (first..=last).collect();
    next_part(problem, first, &at(&kept, &part.q, &all, n), most, hooks)
}

/// The same points and as many between each two as make `GROWTH` times as many.
fn denser(kept: &[usize]) -> Vec<usize> {
    let between = |pair: &[usize]| (0..GROWTH).map(|k| pair[0] + (pair[1] - pair[0]) * k / GROWTH).collect::<Vec<_>>();
    let mut more: Vec<usize> = kept.windows(2).flat_map(between).chain([kept[kept.len() - 1]]).collect();
    more.dedup();
    more
}

/// The points of a stretch at which rivals are refined: those of the search, and others evenly where there are few.
fn some_points(first: usize, last: usize, points: &[usize]) -> Vec<usize> {
    let count = last + 1 - first;
    let mut kept: BTreeSet<usize> = points.iter().copied().collect();
    if count <= 2 * FEW.max(points.len()) {
        return (first..=last).collect();
    }
    let stride = count.div_ceil(FEW);
    kept.extend((first..=last).step_by(stride));
    kept.into_iter().collect()
}

/// Postures at points of a stretch, from those at some of them.
fn at(kept: &[usize], q: &[f64], points: &[usize], n: usize) -> Vec<f64> {
    let places: Vec<f64> = kept.iter().map(|&point| point as f64).collect();
    interpolated(points.iter().map(|&point| point as f64), &places, q, n)
}

/// The best of every way, the best first.
fn ways(problem: &PathProblem, kept: &[usize], tried: &[Tried]) -> Vec<Way> {
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
        let largest_step = problem.largest_turn(kept, &best.q);
        all.push(Way { value: value(&best), motion: best.motion, largest_step, refined: best.refined });
    }
    all.sort_by(|a, b| a.value.total_cmp(&b.value));
    // Rivals of several ways may lead to one optimum.
    let near = |a: f64, b: f64| (a - b).abs() <= SAME * a.abs();
    all.dedup_by(|b, a| near(a.value, b.value) && near(a.motion, b.motion));
    all
}
