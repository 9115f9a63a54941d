//! The objective of a programme, and the answer where its rows contradict each other.

use crate::linalg::Row6;
use crate::linalg::{MAX_JOINTS, Rows6};
use crate::qp::{self, ActiveSet, DenseRow, MAX_VARIABLES, Minimum, Problem, Status};

/// The programme that looks for the least violation has one violation for all rows beside the rates.
const _: () = assert!(MAX_JOINTS < MAX_VARIABLES);
/// What the rates count beside the violation there.
const RATES_COUNT: f64 = 1e-8;
/// By how much rows are opened beyond the least violation, relative and absolute.
const OPENING: (f64, f64) = (1e-10, 1e-9);

/// `x'Hx/2 + g'x`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cost<const C: usize> {
    pub h: [[f64; C]; C],
    pub g: [f64; C],
}

impl<const C: usize> Cost<C> {
    /// The cost of the rates: one weight a joint.
    pub fn of_rates(weights: &[f64]) -> Self {
        let mut out = Self { h: [[0.0; C]; C], g: [0.0; C] };
        for (i, weight) in weights.iter().enumerate() {
            out.h[i][i] = *weight;
        }
        out
    }

    /// Adds the cost `stiffness |t - J qd|^2 / 2` of the deviation.
    pub fn add_deviation(&mut self, stiffness: f64, task: &Rows6<C>, wanted: &Row6, dimension: usize) {
        for r in 0..dimension {
            self.add_square(stiffness, &task[r], -wanted[r]);
        }
    }

    /// Adds `weight (a'x + b)^2 / 2`.
    pub fn add_square(&mut self, weight: f64, a: &[f64; C], b: f64) {
        for i in 0..C {
            let scaled = weight * a[i];
            for j in 0..C {
                self.h[i][j] += scaled * a[j];
            }
            self.g[i] += scaled * b;
        }
    }
}

/// Bounds and rows of a programme.
#[derive(Debug, Clone, Copy)]
pub(super) struct Constraints<'a, const C: usize> {
    pub lower: &'a [f64; C],
    pub upper: &'a [f64; C],
    pub rows: &'a [DenseRow<C>],
}

/// Solves a programme of `n` variables.
pub(super) fn solve<const C: usize>(cost: &Cost<C>, at: &Constraints<'_, C>, n: usize, start: &ActiveSet<C>) -> Minimum<C> {
    let problem = Problem { n, h: &cost.h, g: &cost.g, lower: at.lower, upper: at.upper, rows: at.rows };
    qp::minimise(&problem, start)
}

/// The best within the bounds where rows exclude each other or the bounds: first the least violation that all rows have to share, then the cost
/// under rows opened by it. Always within the bounds; `None` only for numbers that overflow.
#[cold]
#[inline(never)]
pub(super) fn solve_opened<const C: usize>(cost: &Cost<C>, at: &Constraints<'_, C>, n: usize) -> Option<[f64; C]> {
    let mut sides = [DenseRow::<MAX_VARIABLES>::OPEN; super::MAX_ROWS];
    for (wide, row) in sides.iter_mut().zip(at.rows) {
        wide.a[..n].copy_from_slice(&row.a[..n]);
        (wide.lower, wide.upper) = (row.lower, row.upper);
    }
    let (found, violation) = least_violation(&at.lower[..n], &at.upper[..n], &sides[..at.rows.len()])?;
    let mut nearest = [0.0; C];
    nearest[..n].copy_from_slice(&found[..n]);
    let opening = violation * (1.0 + OPENING.0) + OPENING.1;
    let mut rows = [DenseRow::OPEN; super::MAX_ROWS];
    let rows = &mut rows[..at.rows.len()];
    for (opened, row) in rows.iter_mut().zip(at.rows) {
        *opened = DenseRow { lower: row.lower - opening, upper: row.upper + opening, ..*row };
    }
    let opened = solve(cost, &Constraints { rows, ..*at }, n, &ActiveSet::default());
    Some(if opened.status == Status::Solved { opened.x } else { nearest })
}

/// The rates, within their bounds, whose worst violation of a row is least, and that violation; in one capacity for all.
#[inline(never)]
fn least_violation(least: &[f64], most: &[f64], sides: &[DenseRow<MAX_VARIABLES>]) -> Option<([f64; MAX_VARIABLES], f64)> {
    let n = least.len();
    let mut cost = Cost::<MAX_VARIABLES>::of_rates(&[RATES_COUNT; MAX_VARIABLES][..n]);
    cost.h[n][n] = 1.0;
    let (mut lower, mut upper) = ([0.0; MAX_VARIABLES], [f64::INFINITY; MAX_VARIABLES]);
    lower[..n].copy_from_slice(least);
    upper[..n].copy_from_slice(most);
    let mut rows = [DenseRow::OPEN; 2 * super::MAX_ROWS];
    let mut count = 0;
    for row in sides {
        for (sign, limit) in [(1.0, row.lower), (-1.0, -row.upper)] {
            if limit.is_finite() {
                let out: &mut DenseRow<MAX_VARIABLES> = &mut rows[count];
                out.a = row.a.map(|a| sign * a);
                out.a[n] = 1.0;
                out.lower = limit;
                count += 1;
            }
        }
    }
    let found = solve(&cost, &Constraints { lower: &lower, upper: &upper, rows: &rows[..count] }, n + 1, &ActiveSet::default());
    (found.status == Status::Solved).then_some((found.x, found.x[n]))
}
