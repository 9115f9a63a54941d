//! How good a plan can be at best.

use super::graph::Criterion;
use super::hooks::{Hooks, PlanError};
use super::layers::Layers;
use super::part::Part;
use super::problem::PathProblem;

/// Points of the search at which the lower bound of a worst value is looked for.
const POINTS: usize = 3;

/// Whether the worst value of a whole path is at its lower bound, so that no search finds a better one.
pub(super) fn is_proven(problem: &PathProblem, known: &mut Layers, parts: &[Part], hooks: &mut Hooks) -> Result<bool, PlanError> {
    match parts {
        [part] if problem.criterion == Criterion::Minimax && problem.objective.is_some() && part.len() == problem.points() => {
            Ok(part.is_at(lower_bound(problem, known, part, hooks)?))
        }
        _ => Ok(false),
    }
}

/// What no path's worst value is below: the least value at the worst points of the search and of a plan.
fn lower_bound(problem: &PathProblem, known: &mut Layers, part: &Part, hooks: &mut Hooks) -> Result<f64, PlanError> {
    let n = problem.n();
    let Some(worst) = first_largest(&part.value) else { return Ok(f64::NEG_INFINITY) };
    let mut bound = known.least_beside(part.first + worst, &part.q[worst * n..(worst + 1) * n], hooks)?;
    for point in known.hardest(POINTS) {
        bound = bound.max(known.least(point, hooks)?);
    }
    Ok(bound)
}

/// What no path can do better than, for a plan with postures `q` and their values: for the worst value the least value at the worst point of the
/// plan and at those points of the search whose best cell is worst; for an integral that of the least values of all points. NaN where there is
/// no value.
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
    let mut bound = f64::NEG_INFINITY;
    let hardest = known.hardest(POINTS).into_iter().filter(|point| *point != worst && value[*point].is_finite());
    for point in hardest.chain([worst]) {
        bound = bound.max(known.least_beside(point, &q[point * n..(point + 1) * n], hooks)?);
    }
    Ok(bound)
}

/// The first of the largest finite numbers.
fn first_largest(x: &[f64]) -> Option<usize> {
    let finite = (0..x.len()).filter(|&i| x[i].is_finite());
    finite.fold(None, |best: Option<usize>, i| if best.is_none_or(|best| x[i] > x[best]) { Some(i) } else { best })
}
