//! The objective of a programme, and the answer where its rows contradict each other.

use crate::linalg::Row6;
use crate::linalg::{MAX_JOINTS, Rows6};
use crate::optimize::qp::{self, ActiveSet, Problem, Row, Solution, Status};

/// Variables of the programme that looks for the least violation: the rates and one violation for all rows.
const WIDE: usize = MAX_JOINTS + 1;
/// What the rates count beside the violation there.
const RATES_COUNT: f64 = 1e-8;
/// By how much rows are opened beyond the least violation, relative and absolute.
const OPENING: (f64, f64) = (1e-10, 1e-9);

/// `x'Hx/2 + g'x`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form<const C: usize> {
    pub h: [[f64; C]; C],
    pub g: [f64; C],
}

impl<const C: usize> Form<C> {
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
    pub rows: &'a [Row<C>],
}

/// Solves a programme of `n` variables.
pub(super) fn solve<const C: usize>(form: &Form<C>, at: &Constraints<'_, C>, n: usize, start: &ActiveSet<C>) -> Solution<C> {
    let problem = Problem { n, h: &form.h, g: &form.g, lower: at.lower, upper: at.upper, rows: at.rows };
    qp::solve(&problem, start)
}

/// The best within the bounds where rows exclude each other or the bounds: first the least violation that all rows have to share, then the form
/// under rows opened by it. Always within the bounds; `None` only for numbers that overflow.
pub(super) fn solve_opened<const C: usize>(form: &Form<C>, at: &Constraints<'_, C>, n: usize) -> Option<[f64; C]> {
    let (nearest, violation) = least_violation(at, n)?;
    let opening = violation * (1.0 + OPENING.0) + OPENING.1;
    let mut rows = [Row { a: [0.0; C], lower: f64::NEG_INFINITY, upper: f64::INFINITY }; super::MAX_ROWS];
    let rows = &mut rows[..at.rows.len()];
    for (opened, row) in rows.iter_mut().zip(at.rows) {
        *opened = Row { lower: row.lower - opening, upper: row.upper + opening, ..*row };
    }
    let opened = solve(form, &Constraints { rows, ..*at }, n, &ActiveSet::default());
    Some(if opened.status == Status::Solved { opened.x } else { nearest })
}

/// The rates, within their bounds, whose worst violation of a row is least, and that violation.
fn least_violation<const C: usize>(at: &Constraints<'_, C>, n: usize) -> Option<([f64; C], f64)> {
    let mut form = Form::<WIDE>::of_rates(&[RATES_COUNT; WIDE][..n]);
    form.h[n][n] = 1.0;
    let (mut lower, mut upper) = ([0.0; WIDE], [f64::INFINITY; WIDE]);
    lower[..n].copy_from_slice(&at.lower[..n]);
    upper[..n].copy_from_slice(&at.upper[..n]);
    let mut rows = [Row { a: [0.0; WIDE], lower: f64::NEG_INFINITY, upper: f64::INFINITY }; 2 * super::MAX_ROWS];
    let mut count = 0;
    for row in at.rows {
        for (sign, limit) in [(1.0, row.lower), (-1.0, -row.upper)] {
            if limit.is_finite() {
                let a = &mut rows[count].a;
                for i in 0..n {
                    a[i] = sign * row.a[i];
                }
                a[n] = 1.0;
                rows[count].lower = limit;
                count += 1;
            }
        }
    }
    let found = solve(&form, &Constraints { lower: &lower, upper: &upper, rows: &rows[..count] }, n + 1, &ActiveSet::default());
    let mut out = [0.0; C];
    out[..n].copy_from_slice(&found.x[..n]);
    (found.status == Status::Solved).then_some((out, found.x[n]))
}
