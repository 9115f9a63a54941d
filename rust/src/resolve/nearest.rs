//! The motion of a tick that brings the tool nearest to where it should be, where following the task exactly does not: in front of a goal that is
//! out of reach, or behind limits.
//!
//! A tick moves the tool by `J dq + dq'(d2h)dq / 2`. Beside a singularity, rates that solve `J dq = b` promise a motion that the second term takes back: a
//! robot that follows them jumps to and fro over the posture at which it should rest. There the motion minimises the second-order model of the
//! remainder, `|b - A dq|^2 / 2 - rho . d2h(dq, dq) / 2`, with rho the remainder that the promise leaves: Newton's method for the nearest posture,
//! where Gauss and Newton's leaves the second term out.

use crate::kinematics::sized::{Jacobian, bending, jacobian_rate};
use crate::linalg::cholesky::Cholesky;
use crate::linalg::symmetric::positive_part;
use crate::linalg::vector::{add, scale};
use crate::linalg::{Row6, Rows6};
use crate::qp::{self, ActiveSet, DenseRow, Problem, Status};
use crate::task::Directions;

/// Part of a motion that may be missing at the end of a tick for it to count as followed.
const MISSING: f64 = 0.1;
/// Damping that is always there, as a part of the squared size of the task's Jacobian.
const LEAST_DAMPING: f64 = 1e-12;

/// What a tick asks of the tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked<'a, const C: usize> {
    /// Jacobian.
    pub jacobian: &'a Jacobian<C>,
    /// The task's directions.
    pub directions: &'a Directions,
    /// The task's Jacobian by rows.
    pub rows: &'a Rows6<C>,
    /// Components of the motion wanted.
    pub wanted: &'a Row6,
}

impl<const C: usize> Asked<'_, C> {
    /// What is missing after a motion, to second order, when `share` of what is wanted is asked for.
    #[inline(always)]
    fn missing(&self, motion: &[f64; C], share: f64) -> Row6 {
        let rate = jacobian_rate(self.jacobian, motion);
        let (mut w, mut v) = ([0.0; 3], [0.0; 3]);
        for i in 0..self.jacobian.n() {
            let half = 0.5 * motion[i];
            w = add(w, add(scale(motion[i], self.jacobian.w[i]), scale(half, rate.w[i])));
            v = add(v, add(scale(motion[i], self.jacobian.v[i]), scale(half, rate.v[i])));
        }
        let done = self.directions.reduce(w, v);
        std::array::from_fn(|c| share * self.wanted[c] - done[c])
    }

    /// The remainder after a motion, if it is much of what is wanted: the motion does not keep its promise.
    #[inline(never)]
    pub fn broken_promise(&self, motion: &[f64; C]) -> Option<Row6> {
        let left = self.missing(motion, 1.0);
        (length(&left) > MISSING * length(self.wanted)).then_some(left)
    }

    /// The same of a motion that may be slower than wanted: as far as it goes in that direction.
    #[inline(never)]
    pub fn broken_promise_of_slower(&self, motion: &[f64; C]) -> Option<Row6> {
        let whole: f64 = self.wanted.iter().map(|x| x * x).sum();
        let mut along = 0.0;
        for (row, x) in self.rows.iter().zip(self.wanted) {
            along += x * (0..C).map(|i| row[i] * motion[i]).sum::<f64>();
        }
        let share = if whole > 0.0 { (along / whole).clamp(0.0, 1.0) } else { return None };
        let left = self.missing(motion, share);
        let broken = share == 0.0 || length(&left) > MISSING * share * whole.sqrt();
        broken.then(|| std::array::from_fn(|c| left[c] + (1.0 - share) * self.wanted[c]))
    }

    /// The curvature of the model of the remainder `left`: minus its product with the second derivative of the tool's pose.
    #[inline(never)]
    pub fn curvature(&self, left: &Row6) -> [[f64; C]; C] {
        let (moment, force) = self.directions.expand(left);
        bending(self.jacobian, scale(-1.0, moment), scale(-1.0, force))
    }

    /// The motion within bounds that minimises the model of the remainder `left`, damped by `damping` times the squared size of the task's Jacobian.
    #[cold]
    #[inline(never)]
    pub fn nearest(&self, left: &Row6, low: &[f64; C], high: &[f64; C], damping: f64) -> Option<[f64; C]> {
        let n = self.jacobian.n();
        let (mut h, mut g) = ([[0.0; C]; C], [0.0; C]);
        let mut size = 0.0;
        for (row, wanted) in self.rows.iter().zip(self.wanted) {
            for i in 0..n {
                g[i] -= row[i] * wanted;
                size += row[i] * row[i];
                for j in 0..n {
                    h[i][j] += row[i] * row[j];
                }
            }
        }
        let damping = damping.max(LEAST_DAMPING) * size;
        for (i, row) in h.iter_mut().enumerate().take(n) {
            row[i] += damping;
        }
        let h = with_curvature(&h, self.curvature(left), damping, n);
        let found = qp::minimise(&Problem { n, h: &h, g: &g, lower: low, upper: high, rows: &[] as &[DenseRow<C>] }, &ActiveSet::default());
        (found.status == Status::Solved).then_some(found.x)
    }
}

/// A matrix, whose eigenvalues are at least `least`, with a curvature added: all of it where half of `least` is left, else its positive part.
#[inline(never)]
pub(super) fn with_curvature<const C: usize>(h: &[[f64; C]; C], curvature: [[f64; C]; C], least: f64, n: usize) -> [[f64; C]; C] {
    let sum = |extra: &[[f64; C]; C]| std::array::from_fn::<_, C, _>(|i| std::array::from_fn::<_, C, _>(|j| h[i][j] + extra[i][j]));
    let whole = sum(&curvature);
    let mut left = whole;
    for (i, row) in left.iter_mut().enumerate() {
        row[i] -= 0.5 * least;
    }
    if Cholesky::<C>::new(&left, n).is_some() { whole } else { sum(&positive_part(curvature, n)) }
}

fn length(x: &Row6) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}
