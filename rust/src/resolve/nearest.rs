//! The motion of a tick that brings the tool nearest to where it should be, where following the task exactly does not: in front of a goal that is
//! out of reach, or behind limits.
//!
//! A tick moves the tool by `J dq + dq'(d2h)dq / 2`. Beside a singularity, rates that solve `J dq = b` promise a motion that the second term takes back: a
//! robot that follows them jumps to and fro over the posture at which it should rest. There the motion minimises the second-order model of what is
//! missing at the end of the tick, `|b - A dq|^2 / 2 - b . d2h(dq, dq) / 2`: Newton's method for the nearest posture, where that of Gauss and Newton
//! leaves the second term out. For a tick that asks for a part of the error its curvature is at least that part of the error's own, so that no
//! step goes farther than the nearest posture.

use crate::kinematics::sized::{Jacobian, bending, jacobian_rate};
use crate::linalg::cholesky::Cholesky;
use crate::linalg::damped::damped_step;
use crate::linalg::symmetric::positive_part;
use crate::linalg::vector::{add, dot, scale};
use crate::linalg::{Row6, Rows6};
use crate::qp::{self, ActiveSet, DenseRow, Problem, Status};
use crate::task::Directions;

/// Curvature that need not count, as a part of what there is without it: steps that leave it out go beyond the minimum by no more than that part. From
/// twice as much on all of it counts.
const LITTLE: f64 = 0.5;
/// Iterations that find the direction of the largest ratio.
const ITERATIONS: usize = 8;
/// Part of a motion that may be missing at the end of a tick for it to count as followed.
const MISSING: f64 = 0.1;
/// Part of the largest joint motion below which a joint stands.
const STANDS: f64 = 1e-6;
/// Part of a motion that takes back the bend of its own way: in a tick.
pub(super) const UNDONE: f64 = 0.1;
/// The same on the whole way to a stop: half of what is taken back at the posture from which the tool turns back.
pub(super) const TURNED: f64 = 0.25;
/// Bend of the tool's way, as a part of what is wanted, below which nothing goes astray.
const STRAIGHT: f64 = 0.03;
/// The same by a bound that is twice and more what it bounds.
const SURELY_STRAIGHT: f64 = 0.25;
/// Damping that is always there, as a part of the squared size of the task's Jacobian.
const LEAST_DAMPING: f64 = 1e-12;

/// What a tick asks of the tool.
#[derive(Debug, Clone, Copy)]
pub(super) struct Asked<'a, const C: usize> {
    /// Jacobian.
    pub jacobian: &'a Jacobian<'a, C>,
    /// The task's directions.
    pub directions: &'a Directions,
    /// The task's Jacobian by rows.
    pub rows: &'a Rows6<C>,
    /// Components of the motion wanted.
    pub wanted: &'a Row6,
    /// The same, weighed as their deviation is.
    pub weighed: &'a Row6,
}

impl<const C: usize> Asked<'_, C> {
    /// The part of the model's curvature that has to count, by what it is along a motion, `-b . d2h(dq, dq)`, beside a slope along it: none where it is little.
    #[inline(always)]
    pub fn part_along(&self, arm: f64, motion: &[f64; C], slope: f64) -> f64 {
        let most = 2.0 * bend(arm + self.directions.length(), motion, 1.0) * square(self.weighed).sqrt();
        if most <= LITTLE * slope { 0.0 } else { self.part_by_curvature(motion, slope) }
    }

    #[inline(never)]
    fn part_by_curvature(&self, motion: &[f64; C], slope: f64) -> f64 {
        let (moment, force) = self.directions.expand(self.weighed);
        let rate = jacobian_rate(self.jacobian, motion);
        let mut curvature = 0.0;
        for i in 0..self.jacobian.n() {
            curvature -= motion[i] * (dot(moment, rate.w[i]) + dot(force, rate.v[i]));
        }
        part(curvature / slope.max(0.0))
    }

    /// Whether a motion leaves much of what is wanted, and what components of the tool's motion it makes.
    #[inline(always)]
    pub fn falls_short(&self, arm: f64, motion: &[f64; C]) -> (bool, Row6) {
        let made = self.made(motion);
        let left: Row6 = std::array::from_fn(|c| self.wanted[c] - made[c]);
        let (most, enough) =
            (square(&left).sqrt() + bend(arm + self.directions.length(), motion, 1.0), MISSING * square(self.wanted).sqrt());
        if most <= enough {
            return (false, made);
        }
        let bent = bent(self.jacobian, self.directions, motion);
        (square(&std::array::from_fn(|c| left[c] - bent[c])).sqrt() > enough, made)
    }

    /// Whether a motion, which may be shorter or longer than wanted, leads elsewhere: by the bounds that hold it, or by the bend of the tool's way, which
    /// to undo would take the part `undone` of that motion, of joints that move with an ease of their own. That part is how much Newton's method
    /// would contract (Deuflhard 2004, section 2.1).
    #[inline(never)]
    pub fn goes_astray(&self, motion: &[f64; C], ease: &[f64; C], undone: f64) -> bool {
        let made = self.made(motion);
        let (whole, along) = (square(self.wanted), made.iter().zip(self.wanted).map(|(a, b)| a * b).sum::<f64>());
        let share = if whole > 0.0 { (along / whole).max(0.0) } else { return false };
        let aside: Row6 = std::array::from_fn(|c| share * self.wanted[c] - made[c]);
        if share == 0.0 || square(&aside) > MISSING * MISSING * share * share * whole {
            return true;
        }
        // Joints that stand, as at a limit, do not take part.
        let largest = motion.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let rows: Rows6<C> =
            self.rows.map(|row| std::array::from_fn(|i| if motion[i].abs() > STANDS * largest { ease[i] * row[i] } else { 0.0 }));
        let size: f64 = rows.iter().flatten().map(|x| x * x).sum();
        let bent = bent(self.jacobian, self.directions, motion);
        let back = damped_step(&rows, &bent, LEAST_DAMPING * size, self.jacobian.n(), self.directions.dimension());
        let length = |x: &[f64; C]| x.iter().map(|x| x * x).sum::<f64>();
        length(&std::array::from_fn(|i| ease[i] * back[i])) > undone * undone * length(motion)
    }

    /// The components of the tool's motion.
    #[inline(always)]
    pub fn made(&self, motion: &[f64; C]) -> Row6 {
        std::array::from_fn(|c| self.rows[c].iter().zip(motion).map(|(a, x)| a * x).sum())
    }

    /// The factor that makes a motion move the tool no farther than wanted, as far as the task looks at it.
    pub fn slower(&self, motion: &[f64; C]) -> f64 {
        (square(self.wanted) / square(&self.made(motion))).sqrt().min(1.0)
    }

    /// The curvature of the model: minus the product of what is wanted with the second derivative of the tool's pose.
    #[inline(never)]
    pub fn curvature(&self) -> [[f64; C]; C] {
        let (moment, force) = self.directions.expand(self.weighed);
        bending(self.jacobian, scale(-1.0, moment), scale(-1.0, force))
    }

    /// The motion within bounds that minimises the model, damped by `damping` times the squared size of the task's Jacobian, and whether bounds hold it.
    #[cold]
    #[inline(never)]
    pub fn nearest(&self, low: &[f64; C], high: &[f64; C], damping: f64) -> Option<([f64; C], bool)> {
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
        let h = with_curvature(&h, self.curvature(), damping, n);
        let found = qp::minimise(&Problem { n, h: &h, g: &g, lower: low, upper: high, rows: &[] as &[DenseRow<C>] }, &ActiveSet::default());
        (found.status == Status::Solved).then_some((found.x, found.active.len() > 0))
    }
}

/// The second-order motion of the tool is no more than this along rates that are followed for a time, by the longest arm, a length among it.
#[inline(always)]
fn bend<const C: usize>(arm: f64, rates: &[f64; C], time: f64) -> f64 {
    let turn: f64 = rates.iter().map(|rate| rate.abs()).sum();
    0.5 * time * time * turn * turn * arm
}

/// Components of the tool's motion of second order.
#[inline(never)]
fn bent<const C: usize>(jacobian: &Jacobian<C>, directions: &Directions, motion: &[f64; C]) -> Row6 {
    let rate = jacobian_rate(jacobian, motion);
    let (mut w, mut v) = ([0.0; 3], [0.0; 3]);
    for i in 0..jacobian.n() {
        w = add(w, scale(0.5 * motion[i], rate.w[i]));
        v = add(v, scale(0.5 * motion[i], rate.v[i]));
    }
    directions.reduce(w, v)
}

/// Whether the tool's way bends by little of the twist that is wanted along rates that are followed for a time. A bound that costs little tells nearly
/// always.
#[inline(always)]
pub(super) fn bends_little<const C: usize>(
    arm: f64,
    jacobian: &Jacobian<C>,
    directions: &Directions,
    rates: &[f64; C],
    time: f64,
    wanted: &Row6,
) -> bool {
    let whole = time * square(wanted).sqrt();
    bend(arm + directions.length(), rates, time) <= SURELY_STRAIGHT * whole
        || square(&bent(jacobian, directions, &rates.map(|x| time * x))) <= (STRAIGHT * whole).powi(2)
}

/// The part of a curvature without negative eigenvalues that has to count beside a positive definite matrix: by their largest ratio in any direction, as
/// power iterations find it.
#[cold]
#[inline(never)]
pub(super) fn part_that_counts<const C: usize>(h: &[[f64; C]; C], curvature: &[[f64; C]; C], n: usize) -> f64 {
    let Some(factor) = Cholesky::<C>::new(h, n) else { return 1.0 };
    let mut x = [0.0; C];
    for (i, x) in x.iter_mut().enumerate().take(n) {
        // Not along any one of them.
        *x = 1.0 + 0.1 * i as f64;
    }
    let mut ratio = 0.0;
    for _ in 0..ITERATIONS {
        let y = factor.solve(&std::array::from_fn(|i| curvature[i].iter().zip(&x).map(|(a, b)| a * b).sum()));
        let size = y[..n].iter().fold(0.0f64, |most, y| most.max(y.abs()));
        if size == 0.0 {
            return 0.0;
        }
        let (top, bottom): (f64, f64) = (0..n).fold((0.0, 0.0), |(top, bottom), i| (top + x[i] * y[i], bottom + x[i] * x[i]));
        ratio = top / bottom;
        x = y.map(|y| y / size);
    }
    part(ratio)
}

/// The part of a curvature that has to count, by its ratio to what there is without it.
fn part(ratio: f64) -> f64 {
    if ratio > LITTLE { (ratio / LITTLE - 1.0).min(1.0) } else { 0.0 }
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

/// The sum of squares.
pub(super) fn square(x: &Row6) -> f64 {
    x.iter().map(|x| x * x).sum()
}
