//! One step of the orthogonal SQP: `dq = dv + Z du`, dv for the task, du for the objective in its null space (Leger 2014, eq. 3.58 to 3.64, 4.5 to 4.18).
//!
//! The task is two points of the tool a length apart (4.5): its Jacobian is that of the tool point and of the axis, the latter times the length
//! (4.11). For a square regular Jacobian its null direction is that of (4.12); taken from the task's own Jacobian it exists for any number of
//! joints and at singularities that the free motion can leave. The reduced Hessian is that of the Lagrangian, `B = Z'(H - sum lambda d2h) Z`: with the
//! objective's Hessian alone, as in (3.63), convergence is linear only.
//!
//! `du = -B^-1 (gain Z'g + drift)`: the distance to the minimum falls by the gain, and the drift, by which the motion of the task changes the slope
//! Z'g, is made up for in full, so that the step keeps up with a minimum that moves. It is `Z'H dv - lambda . (dJ/dt along Z) dv`. A distance of
//! second order in dv, as a tick of constant rates leaves it, is closed at once whatever the gain: the lag is of second order in the tick.

use super::MAX_STEP_ROWS;
use super::reduce::{Curvature, Turning};
use crate::index::sized::Evaluation;
use crate::kinematics::sized::Jacobian;
use crate::linalg::damped::damped_step;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::symmetric::diagonalise;
use crate::linalg::{MAX_JOINTS, Row6, Rows6, size};
use crate::qp::{self, ActiveSet, DenseRow, Place, Problem, Side, Status};
use crate::resolve::StepStatus;
use crate::task::Constraint;

/// Below this ratio of the shortest to the longest orthogonal row, the task's Jacobian is inverted with damping.
const NEARLY_SINGULAR: f64 = 1e-4;
/// A slope along the free motion below this part of the whole gradient is rounding: the objective does not feel that motion.
const FLAT: f64 = 1e-12;
/// Eigenvalues of the reduced Hessian are kept above this multiple of the largest.
const LEAST_CURVATURE: f64 = 1e-8;
/// Part of the free motion that keeps up with a moving minimum at most, as a multiple of the largest joint motion for the task: where the curvature
/// vanishes minima move infinitely fast.
const KEEPS_UP: f64 = 10.0;
/// Distance to the minimum that is closed at once, as a multiple of the squared motion for the task \[1/rad\].
const AT_ONCE: f64 = 10.0;
/// A joint that a unit of the free motion moves by less than this is not moved by it: no limit of it counts.
const UNMOVED: f64 = 1e-12;
/// A step beyond a bound by no more than this part of the task's own motion is within it: less than a twist can tell.
const AT_BOUND: f64 = 1e-12;
/// A joint this near to a limit that a step takes it to stands at it [rad or m].
const NEARLY_AT: f64 = 1e-3;

/// What is known at a posture.
#[derive(Debug, Clone, Copy)]
pub(in crate::resolve) struct Known<'a, const C: usize> {
    /// Jacobian.
    pub jacobian: &'a Jacobian<'a, C>,
    /// Objective with gradient and Hessian (exact or approximate).
    pub objective: &'a Evaluation<C>,
    /// The task.
    pub constraint: &'a Constraint,
    /// The target, where the constraint's directions turn with the free motion.
    pub turning: Option<Turning<'a>>,
    /// The components of the motion wanted.
    pub wanted: Row6,
}

/// The box a step has to stay in.
#[derive(Debug, Clone, Copy)]
pub(in crate::resolve) struct Bounds<'a, const C: usize> {
    /// Lower bounds of dq.
    pub low: [f64; C],
    /// Upper bounds of dq.
    pub high: [f64; C],
    /// Combinations of dq that have bounds.
    pub rows: &'a [DenseRow<C>],
    /// Largest component of the free motion Z du.
    pub radius: f64,
    /// Fraction of the way to the objective's minimum to go.
    pub gain: f64,
}

/// A step and what it promises.
#[derive(Debug, Clone, Copy)]
pub(in crate::resolve) struct NewtonStep<const C: usize> {
    /// The step.
    pub dq: [f64; C],
    /// Its part for the task alone, without regard to limits.
    pub task: [f64; C],
    /// First-order change of the objective along the free motion: zero or below.
    pub slope: f64,
    /// Length of the objective's gradient along the free motion.
    pub gradient: f64,
    /// Largest component of the free part of the step.
    pub free: f64,
    /// Joints that stand at a limit which the free motion would cross, or come to it, one bit a joint.
    pub held: u32,
    /// How it came about.
    pub status: StepStatus,
}

/// One step; never longer than the bounds, never NaN for finite input.
#[inline(never)]
pub(in crate::resolve) fn newton_step<const C: usize>(known: &Known<'_, C>, bounds: &Bounds<'_, C>) -> NewtonStep<C> {
    let n = known.jacobian.n();
    let m = known.constraint.dimension();
    let rows = known.constraint.jacobian(known.jacobian);
    let mut out = NewtonStep { dq: [0.0; C], task: [0.0; C], slope: 0.0, gradient: 0.0, free: 0.0, held: 0, status: StepStatus::Regular };
    let factors = Orthogonal::new(&rows, n, m);
    if m > n || factors.spread() < NEARLY_SINGULAR {
        let scale: f64 = rows.iter().flatten().map(|x| x * x).sum();
        let damping = scale * NEARLY_SINGULAR * NEARLY_SINGULAR;
        out.dq = damped_step(&rows, &known.wanted, damping, n, m);
        out.status = StepStatus::Damped;
        out.task = out.dq;
        out.clip(bounds, n);
        return out;
    }
    let p = factors.pseudo_inverse();
    let mut dv = [0.0; C];
    for i in 0..n {
        dv[i] = (0..m).map(|r| p[r][i] * known.wanted[r]).sum();
    }
    (out.dq, out.task) = (dv, dv);
    let objective = known.objective;
    let usable = objective.value.is_finite()
        && (0..n).all(|k| objective.gradient[k].is_finite() && objective.hessian[k][..n].iter().all(|h| h.is_finite()));
    if n > m && usable {
        let reduced = reduce(known, &factors.null_space(), &p, &dv, n, m);
        free_motion(&reduced, &dv, bounds, &mut out, n, n - m);
    } else if !usable {
        out.status = StepStatus::TaskOnly;
    }
    out.clip(bounds, n);
    out
}

/// The quadratic model of the objective in the free motion.
struct Reduced<const C: usize> {
    basis: [[f64; C]; C],
    hessian: [[f64; C]; C],
    /// Of the objective, at the posture.
    slopes: [f64; C],
    /// Change of the slopes by the motion of the task.
    drift: [f64; C],
}

#[inline(always)]
fn reduce<const C: usize>(known: &Known<'_, C>, basis: &[[f64; C]; C], p: &Rows6<C>, dv: &[f64; C], n: usize, m: usize) -> Reduced<C> {
    let r = size::<C>(n) - m;
    let objective = known.objective;
    let curvature = Curvature::new(known.jacobian, known.constraint, known.turning, p, &objective.gradient);
    let inner = |a: &[f64; C], b: &[f64; C]| (0..n).map(|i| a[i] * b[i]).sum::<f64>();
    let mut hdv = [0.0; C];
    for k in 0..n {
        hdv[k] = inner(&objective.hessian[k], dv);
    }
    let (steepness, sharpness) = sizes(objective, n);
    let (hessian, bent) = curvature.reduced_hessian(&objective.hessian, basis, r);
    let mut out = Reduced { basis: *basis, hessian, slopes: [0.0; C], drift: [0.0; C] };
    for a in 0..r {
        let z = &basis[a];
        out.slopes[a] = inner(z, &objective.gradient);
        out.drift[a] = inner(z, &hdv) - inner(&bent[a], dv);
    }
    // A motion that the objective does not feel is not taken; the curvature put in its place keeps the model convex.
    for a in 0..r {
        if out.slopes[a].abs() <= FLAT * steepness {
            out.slopes[a] = 0.0;
        }
        if out.drift[a].abs() <= FLAT * sharpness * largest(dv) {
            out.drift[a] = 0.0;
        }
        if out.hessian[a][a].abs() <= FLAT * sharpness {
            out.hessian[a][a] = LEAST_CURVATURE * sharpness;
        }
    }
    out
}

/// The largest entry.
#[inline(always)]
fn largest(row: &[f64]) -> f64 {
    row.iter().fold(0.0f64, |m, x| m.max(x.abs()))
}

/// The largest entries of gradient and Hessian.
#[inline(always)]
fn sizes<const C: usize>(objective: &Evaluation<C>, n: usize) -> (f64, f64) {
    (largest(&objective.gradient[..n]), objective.hessian[..n].iter().fold(0.0f64, |m, row| m.max(largest(&row[..n]))))
}

/// Minimises the convexified model within the bounds and adds the free motion to the step.
#[inline(always)]
fn free_motion<const C: usize>(reduced: &Reduced<C>, dv: &[f64; C], bounds: &Bounds<'_, C>, out: &mut NewtonStep<C>, n: usize, r: usize) {
    out.gradient = reduced.slopes[..r].iter().map(|x| x * x).sum::<f64>().sqrt();
    let radius = bounds.radius + KEEPS_UP * largest(&dv[..n]);
    let bounds = &Bounds { radius, ..*bounds };
    let u = match r {
        1 => one_freedom(reduced, dv, bounds, n),
        _ if C <= 8 => many_freedoms::<C, 8>(reduced, dv, bounds, n, r),
        _ => many_freedoms::<C, C>(reduced, dv, bounds, n, r),
    };
    let Some((u, limited, held)) = u else {
        out.status = StepStatus::Limited;
        return;
    };
    out.held = held;
    if limited {
        out.status = StepStatus::Limited;
    }
    for i in 0..n {
        let move_i: f64 = (0..r).map(|a| reduced.basis[a][i] * u[a]).sum();
        out.free = out.free.max(move_i.abs());
        out.dq[i] += move_i;
    }
    out.slope = (0..r).map(|a| reduced.slopes[a] * u[a]).sum();
}

/// Motion along a free direction, by slope, drift and curvature there; `task` is the largest joint motion for the task.
#[inline(always)]
fn wanted(slope: f64, drift: f64, curvature: f64, gain: f64, task: f64) -> f64 {
    let distance = (slope / curvature).abs();
    let closed = (gain * distance).max(distance.min(AT_ONCE * task * task));
    // A maximum that moves is not followed.
    if curvature > 0.0 { -drift / curvature - closed.copysign(slope) } else { -closed.copysign(slope) }
}

/// The product of two vectors.
#[inline(always)]
fn product(a: &[f64], b: &[f64], n: usize) -> f64 {
    (0..n).map(|i| a[i] * b[i]).sum()
}

/// One freedom: the Newton step cut to an interval, and whether a limit cut it; `None` when the interval is empty.
#[inline(always)]
fn one_freedom<const C: usize>(reduced: &Reduced<C>, dv: &[f64; C], bounds: &Bounds<'_, C>, n: usize) -> Option<([f64; C], bool, u32)> {
    let z = &reduced.basis[0];
    let (mut low, mut high) = (f64::NEG_INFINITY, f64::INFINITY);
    for i in 0..n {
        if z[i].abs() < UNMOVED {
            continue;
        }
        let (a, b) = ((bounds.low[i] - dv[i]) / z[i], (bounds.high[i] - dv[i]) / z[i]);
        low = low.max(a.min(b));
        high = high.min(a.max(b));
    }
    for row in bounds.rows {
        let (along, there) = (product(&row.a, z, n), product(&row.a, dv, n));
        if along.abs() >= UNMOVED {
            let (a, b) = ((row.lower - there) / along, (row.upper - there) / along);
            low = low.max(a.min(b));
            high = high.min(a.max(b));
        }
    }
    if low > high {
        return None;
    }
    let curvature = reduced.hessian[0][0];
    let newton =
        if curvature == 0.0 { 0.0 } else { wanted(reduced.slopes[0], reduced.drift[0], curvature, bounds.gain, largest(&dv[..n])) };
    let radius = bounds.radius / largest(&z[..n]);
    let mut u = [0.0; C];
    let wanted = newton.clamp(-radius, radius);
    u[0] = wanted.clamp(low, high);
    Some((u, u[0] != wanted, 0))
}

/// Several freedoms, fewer than joints: a convex QP in the free motion, in the capacity `W`, whether a limit holds it, and the joints that stand at one.
#[inline(never)]
fn many_freedoms<const C: usize, const W: usize>(
    reduced: &Reduced<C>,
    dv: &[f64; C],
    bounds: &Bounds<'_, C>,
    n: usize,
    r: usize,
) -> Option<([f64; C], bool, u32)> {
    let (mut values, mut vectors) = (reduced.hessian, [[0.0; C]; C]);
    diagonalise(&mut values, &mut vectors, r);
    let sharpest = (0..r).fold(f64::MIN_POSITIVE, |m, i| m.max(values[i][i].abs()));
    let mut h = [[0.0; W]; W];
    let mut g = [0.0; W];
    for i in 0..r {
        let (curvature, along) =
            (values[i][i].abs().max(LEAST_CURVATURE * sharpest), |x: &[f64; C]| (0..r).map(|a| vectors[a][i] * x[a]).sum::<f64>());
        let move_i =
            wanted(along(&reduced.slopes), along(&reduced.drift), curvature.copysign(values[i][i]), bounds.gain, largest(&dv[..n]));
        for a in 0..r {
            g[a] -= curvature * move_i * vectors[a][i];
            for b in 0..r {
                h[a][b] += curvature * vectors[a][i] * vectors[b][i];
            }
        }
    }
    let (mut few, mut many) = ([DenseRow::OPEN; W], None);
    let rows = if bounds.rows.is_empty() {
        &mut few[..n]
    } else {
        &mut many.insert([DenseRow::OPEN; MAX_JOINTS + MAX_STEP_ROWS])[..n + bounds.rows.len()]
    };
    for i in 0..n {
        for b in 0..r {
            rows[i].a[b] = reduced.basis[b][i];
        }
        // The box of the whole step and the radius of the free part, whichever is tighter; the radius yields where both exclude each other.
        let (low, high) = (bounds.low[i] - dv[i], bounds.high[i] - dv[i]);
        rows[i].lower = low.max((-bounds.radius).min(high));
        rows[i].upper = high.min(bounds.radius.max(low));
    }
    for (row, given) in rows[n..].iter_mut().zip(bounds.rows) {
        for b in 0..r {
            row.a[b] = product(&given.a, &reduced.basis[b], n);
        }
        let there = product(&given.a, dv, n);
        (row.lower, row.upper) = (given.lower - there, given.upper - there);
    }
    let (lower, upper) = ([f64::NEG_INFINITY; W], [f64::INFINITY; W]);
    let problem = Problem { n: r, h: &h, g: &g, lower: &lower, upper: &upper, rows };
    let solution = qp::minimise(&problem, &ActiveSet::default());
    if solution.status != Status::Solved {
        return None;
    }
    let mut u = [0.0; C];
    u[..r].copy_from_slice(&solution.x[..r]);
    let active = solution.active.as_slice();
    // A row that the radius bounds is none of the box.
    let limited = active.iter().any(|item| match (item.place, item.side) {
        (Place::Row(i), _) if i >= n => true,
        (Place::Row(i), Side::Lower) => rows[i].lower == bounds.low[i] - dv[i],
        (Place::Row(i), Side::Upper) => rows[i].upper == bounds.high[i] - dv[i],
        (Place::Bound(_), _) => false,
    });
    let stands = |i: usize, side: Side| if side == Side::Lower { bounds.low[i] >= -NEARLY_AT } else { bounds.high[i] <= NEARLY_AT };
    let held = active.iter().fold(0, |held, item| match item.place {
        Place::Row(i) if i < n && stands(i, item.side) => held | 1 << i,
        _ => held,
    });
    Some((u, limited, held))
}

impl<const C: usize> NewtonStep<C> {
    /// Cuts the step to its box; a cut that matters beside the task's own motion is reported.
    #[inline(never)]
    pub fn clip(&mut self, bounds: &Bounds<'_, C>, n: usize) {
        let little = AT_BOUND * self.task[..n].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        // One factor for all joints keeps the direction of the tool's motion; a joint that may not move at all is held alone.
        let mut factor = 1.0f64;
        for i in 0..n {
            let room = if self.dq[i] > 0.0 { bounds.high[i] } else { -bounds.low[i] };
            let needed = self.dq[i].abs();
            if needed > room + little && room > little {
                factor = factor.min(room / needed);
            }
        }
        for row in bounds.rows {
            let needed = product(&row.a, &self.dq, n);
            let room = if needed > 0.0 { row.upper } else { row.lower };
            // Where there is none, the tick as a whole sees to it.
            if room * needed > 0.0 && room.abs() < needed.abs() {
                factor = factor.min(room / needed);
            }
        }
        let mut cut = factor < 1.0;
        for i in 0..n {
            let wanted = factor * self.dq[i];
            let clamped = if wanted.is_nan() { 0.0 } else { wanted }.max(bounds.low[i]).min(bounds.high[i]);
            cut |= (wanted - clamped).abs() > little;
            self.dq[i] = if clamped.is_finite() { clamped } else { 0.0 };
        }
        if cut {
            self.status = StepStatus::Limited;
        }
    }

    /// The part for the task alone, within its box.
    pub fn task_within(&self, bounds: &Bounds<'_, C>, n: usize) -> [f64; C] {
        let mut alone = Self { dq: self.task, ..*self };
        alone.clip(bounds, n);
        alone.dq
    }
}
