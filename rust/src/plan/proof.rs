//! How good a plan can be at best.

use super::floors::Place;
use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::layers::Layers;
use super::part::Part;
use super::problem::PathProblem;

/// Points of the search at which the lower bound of a worst value is looked for.
const POINTS: usize = 3;
/// A bound this near to the worst value, relative, is near enough.
const NEAR: f64 = 1e-4;
/// Sweeps of the bound over connected ways at most, and intervals that are sharpened between two of them.
const SWEEPS: usize = 80;
const SHARPENED: usize = 6;

/// Whether the worst value of a whole path is at its lower bound, so that no search finds a better one. `kept` are the points of the part.
pub(super) fn is_proven_at(
    problem: &PathProblem,
    known: &mut Layers,
    kept: &[usize],
    part: &Part,
    hooks: &mut Hooks,
) -> Result<bool, PlanError> {
    let ends = kept[0] == 0 && kept[kept.len() - 1] + 1 == problem.points();
    let bounded = problem.criterion == Criterion::Minimax && problem.objective.is_some() && ends && part.is_optimum();
    let Some(worst) = first_largest(&part.value).filter(|_| bounded) else { return Ok(false) };
    let n = problem.n();
    let mut bound = known.least_beside(kept[worst], &part.q[worst * n..(worst + 1) * n], hooks)?;
    bound = bound.max(least_of_hardest(known, hooks)?);
    Ok(part.is_at(bound))
}

/// The largest of the least values at those points of the search whose best cell is worst.
pub(super) fn least_of_hardest(known: &mut Layers, hooks: &mut Hooks) -> Result<f64, PlanError> {
    let mut bound = f64::NEG_INFINITY;
    for point in known.hardest(POINTS) {
        bound = bound.max(known.least(point, hooks)?);
    }
    Ok(bound)
}

/// What no path can do better than, for a plan with postures `q` and their values: for the worst value the least value at the worst point of the
/// plan and at those points of the search whose best cell is worst, and the least bottleneck over connected ways; for an integral that of the least values
/// of all points. NaN where there is no value.
pub(super) fn proven_bound(
    problem: &PathProblem,
    known: &mut Layers,
    q: &[f64],
    value: &[f64],
    hooks: &mut Hooks,
) -> Result<f64, PlanError> {
    let n = problem.n();
    let Some(worst) = first_largest(value).filter(|_| problem.objective.is_some()) else { return Ok(f64::NAN) };
    if problem.criterion == Criterion::Integral {
        let least = known.least_of_all(q, hooks)?;
        return Ok(problem.weights.iter().zip(&least).map(|(weight, least)| weight * least).sum());
    }
    let mut bound = known.connected;
    let hardest = known.hardest(POINTS).into_iter().filter(|point| *point != worst && value[*point].is_finite());
    for point in hardest.chain([worst]) {
        bound = bound.max(known.least_beside(point, &q[point * n..(point + 1) * n], hooks)?);
    }
    // The plan itself is a way.
    Ok(bound.min(value[worst]))
}

/// What is known of ways better than a plan.
#[derive(Debug)]
pub(super) enum Better {
    /// There is none, or none that counts.
    None,
    /// There may be one along these intervals of the spin (point, interval).
    Maybe(Vec<(usize, usize)>),
}

/// Sharpens the bound over connected ways until it is near the worst value of a whole path, or until a way is left that may be better.
pub(super) fn better_way(problem: &PathProblem, known: &mut Layers, part: &Part, hooks: &mut Hooks) -> Result<Better, PlanError> {
    let minimax = problem.criterion == Criterion::Minimax && problem.objective.is_some();
    if !minimax || part.len() != problem.points() || !known.has_floors() {
        return Ok(Better::None);
    }
    let worst = part.worst();
    let target = worst - NEAR * worst.abs();
    // What makes the plan as bad as it is counts first.
    let hardest = worst_points(part, target);
    known.add(&hardest, hooks)?;
    for _ in 0..SWEEPS {
        hooks.go_on()?;
        let Some(found) = known.bottleneck() else { return Ok(Better::None) };
        known.connected = known.connected.max(found.value);
        if found.value >= target {
            return Ok(Better::None);
        }
        let blunt = known.sharpen(&found.way, target, SHARPENED);
        let between = match found.place {
            Place::Ridge(a, b) if b - a > 1 => Some((a + b) / 2),
            _ => None,
        };
        match between {
            Some(point) => known.add(&[point], hooks)?,
            None if blunt => {}
            None => return Ok(Better::Maybe(found.way)),
        }
    }
    Ok(Better::None)
}

/// The points of a plan that are above a target and worse than their neighbours.
fn worst_points(part: &Part, target: f64) -> Vec<usize> {
    let at = |i: usize| part.value[i];
    let last = part.len() - 1;
    let peak = |&i: &usize| at(i) > target && (i == 0 || at(i - 1) <= at(i)) && (i == last || at(i + 1) < at(i));
    (0..=last).filter(peak).map(|i| part.first + i).collect()
}

/// The first of the largest numbers.
fn first_largest(x: &[f64]) -> Option<usize> {
    let known = (0..x.len()).filter(|&i| !x[i].is_nan());
    known.fold(None, |best: Option<usize>, i| if best.is_none_or(|best| x[i] > x[best]) { Some(i) } else { best })
}
