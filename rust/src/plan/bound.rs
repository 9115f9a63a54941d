//! The least value of an objective at one point of a path, over all spins, spare joints and branches: no path can do better there.

use super::graph::Criterion;
use super::problem::PathProblem;
use super::refine::{RefineStatus, refine};

/// Postures that are tried from the grid, best first.
const STARTS: usize = 24;
/// A posture this near to one that was tried [rad or m] would lead to the same minimum.
const APART: f64 = 0.5;

/// From postures on a grid (rows of n, with their values), each brought to the minimum next to it: the least of them. `problem` is that of the
/// one point.
pub fn least_value<const C: usize>(problem: &PathProblem<'_>, postures: &[f64], values: &[f64]) -> f64 {
    let n = problem.n();
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut best = order.first().map_or(f64::INFINITY, |&i| values[i]);
    let alone = PathProblem {
        criterion: Criterion::Integral,
        smoothness: 0.0,
        weights: &[1.0],
        steps: &[],
        bounds: &[],
        closed: None,
        ..problem.clone()
    };
    let mut tried: Vec<&[f64]> = Vec::new();
    for &i in &order {
        let start = &postures[i * n..(i + 1) * n];
        if tried.iter().any(|other| start.iter().zip(*other).all(|(a, b)| (a - b).abs() < APART)) {
            continue;
        }
        tried.push(start);
        if tried.len() > STARTS {
            break;
        }
        let mut q = [0.0; C];
        q[..n].copy_from_slice(start);
        let found = refine::<C>(&alone, vec![q], 60);
        if matches!(found.status, RefineStatus::Converged | RefineStatus::Stopped) && found.values[0] < best {
            best = found.values[0];
        }
    }
    best
}
