//! Postures of the cells of a grid by Newton, from random ones in some cells and from those of the cells beside: where there is neither a closed form
//! nor an elimination.

use super::lattice::distance;
use crate::inverse::Solutions;

/// Cells whose postures are searched from random ones, and how many of these there are.
const SEEDS: usize = 12;
const RANDOM: usize = 96;
/// A posture of the cell beside this near to one that is known [rad or m] leads there.
const BESIDE: f64 = 0.2;

/// The solutions of all cells, whose `order` is one in which each is beside the one before it: from random postures in some of them, from there to the others,
/// forth and back. `solve` gives those of a cell that come of some starts, `joints` coordinates each, and of so many random ones.
pub(super) fn continued(order: &[usize], joints: usize, solve: &dyn Fn(usize, &[f64], usize) -> Solutions) -> Vec<Solutions> {
    let apart = order.len().div_ceil(SEEDS) | 1;
    let random = |cell: usize| if cell.is_multiple_of(apart) { RANDOM } else { 0 };
    let mut all: Vec<Solutions> = (0..order.len()).map(|cell| solve(cell, &[], random(cell))).collect();
    let mut pass = |from: usize, to: usize| {
        let (own, other) = (all[to], all[from]);
        let known = |q: &[f64; 6]| (0..own.count).any(|k| distance(&own.q[k][..joints], &q[..joints]) < BESIDE);
        let new = other.q[..other.count].iter().filter(|q| !known(q));
        let starts: Vec<f64> = own.q[..own.count].iter().chain(new).flat_map(|q| &q[..joints]).copied().collect();
        if starts.len() > own.count * joints {
            all[to] = solve(to, &starts, 0);
        }
    };
    order.windows(2).for_each(|pair| pass(pair[0], pair[1]));
    order.windows(2).rev().for_each(|pair| pass(pair[1], pair[0]));
    all
}
