//! The least value of an objective at one point of a path, over all spins, spare joints and branches: no path can do better there.

use rayon::prelude::*;

use super::problem::PathProblem;
use super::refine::{RefineStatus, refine};

/// Postures that are tried from the grid, best first.
const STARTS: usize = 24;
/// A posture this near to one that was tried [rad or m] would lead to the same minimum.
const APART: f64 = 0.5;
/// Newton steps from each of them.
const MAX_ITERATIONS: usize = 60;

/// The best of some postures, `most` at most, without those next to a better one.
pub(super) fn distinct<'q>(postures: &'q [f64], values: &[f64], n: usize, most: usize) -> Vec<&'q [f64]> {
    let mut order: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut kept: Vec<&[f64]> = Vec::new();
    for i in order {
        let q = &postures[i * n..(i + 1) * n];
        if kept.len() < most && !kept.iter().any(|other| q.iter().zip(*other).all(|(a, b)| (a - b).abs() < APART)) {
            kept.push(q);
        }
    }
    kept
}

/// The least value at a point, from postures on a grid (n joints a row, with their values), each brought to the minimum next to it. `alone` is
/// the problem of that point.
pub(super) fn least_value(alone: &PathProblem, postures: &[f64], values: &[f64]) -> f64 {
    let n = alone.n();
    let starts = distinct(postures, values, n, STARTS);
    let minimum = |start: &&[f64]| {
        let found = refine(alone, start, MAX_ITERATIONS, &mut || false);
        if matches!(found.status, RefineStatus::Converged | RefineStatus::Stopped) { found.values[0] } else { f64::INFINITY }
    };
    let grid = values.iter().copied().filter(|value| value.is_finite()).fold(f64::INFINITY, f64::min);
    starts.par_iter().map(minimum).reduce(|| grid, f64::min)
}
