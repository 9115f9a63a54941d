//! The orthogonal SQP iterated to a pose.

use std::sync::Arc;

use super::pressed::{Bend, pressed};
use super::reduce::Turning;
use super::{Bounds, Known, MAX_STEP_ROWS, NewtonStep, OrthogonalSqp, RADIUS, newton_step};
use crate::index::Order;
use crate::index::sized::Evaluation;
use crate::inverse::reach_holding;
use crate::kinematics::sized::{Jacobian, jacobian};
use crate::linalg::frame::Frame;
use crate::linalg::vector::norm;
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, size};
use crate::qp::DenseRow;
use crate::resolve::direct_update::direct_update_indefinite;
use crate::resolve::inside::{PathFrame, curvature};
use crate::resolve::reach_inside::Sought;
use crate::resolve::{Memory, ON_TARGET, Resolver, Solution, SolveStatus, StepStatus};
use crate::robot::Robot;
use crate::task::volume::{MAX_SIDES, OrientationVolume};
use crate::task::{Target, Task};

/// Trial lengths of one step.
const MAX_HALVINGS: usize = 12;
/// A step of the free motion below this has settled [rad or m].
const SETTLED: f64 = 1e-9;
/// One below this has, if steps shrink by so much that the next would be below [`NEXT`] [rad or m].
const NEARLY_SETTLED: f64 = 1e-6;
/// A step that need not be taken [rad or m].
const NEXT: f64 = 1e-12;
/// Steps of the way to a target from afar.
const REACH_ITERATIONS: usize = 60;
/// Steps of the way back to it after a free motion.
const RETURN_ITERATIONS: usize = 8;
/// Part of the decrease that the slope promises which a step has to bring (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// What rounding alone can add to a value, relative to it and 1.
const ROUNDING: f64 = 1e-13;
/// Multiples of the task's tolerance by which a posture may be off its target, joint by joint.
const OFF_TARGET: f64 = 4.0;
/// What rounding can add beside a singularity, where an index loses digits.
const UNTOLD: f64 = 1e-11;

/// The iterate: everything known at a posture.
struct Iterate<'r, const C: usize> {
    q: [f64; C],
    tool: Frame,
    jacobian: Jacobian<'r, C>,
    objective: Evaluation<C>,
}

impl Resolver for OrthogonalSqp {
    fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    fn task(&self) -> &Task {
        &self.task
    }

    fn volume(&self) -> Option<&OrientationVolume> {
        self.volume.as_deref()
    }

    fn keeps_limits(&self) -> bool {
        self.settings.limits
    }

    fn dt(&self) -> f64 {
        self.settings.dt
    }

    /// From `q0` to the target, then on it to a minimum of the objective: every iterate is on the target, and each is better than the one
    /// before, so that neither can spoil the other. Nothing is remembered.
    fn solve_next(&self, target: &Target, q0: &[f64], _memory: &mut Memory) -> Solution {
        if q0.len() != self.robot.n() {
            return Solution::nowhere();
        }
        with_capacity!(self.robot.n(), solve(self, target, q0, &mut |_| {}))
    }
}

#[inline(never)]
fn solve<const C: usize>(solver: &OrthogonalSqp, target: &Target, q0: &[f64], each: &mut dyn FnMut(&Iteration)) -> Solution {
    solver.solve_from::<C>(target, q0, each)
}

/// A posture on the target on the way to a minimum.
#[derive(Debug, Clone, Copy)]
pub struct Iteration {
    /// Joints; the first n count.
    pub q: [f64; MAX_JOINTS],
    /// Objective there.
    pub value: f64,
    /// Length of its gradient along the free motion that the limits leave.
    pub gradient: f64,
    /// Largest component of the step from there.
    pub step: f64,
    /// Evaluations of the objective up to there.
    pub evaluations: usize,
}

impl OrthogonalSqp {
    /// As [`Resolver::solve`]; `each` is told of every posture on the target.
    pub fn trace(&self, target: &Target, q0: &[f64], each: &mut dyn FnMut(&Iteration)) -> Solution {
        if q0.len() != self.robot.n() {
            return Solution::nowhere();
        }
        with_capacity!(self.robot.n(), solve(self, target, q0, each))
    }

    #[inline(never)]
    fn iterate<const C: usize>(&self, q: [f64; C], order: Order) -> Iterate<'_, C> {
        let n = size::<C>(self.robot.n());
        let (tool, columns) = jacobian::<C>(&self.robot, &q[..n]);
        let objective = self.objective.evaluate_at(&self.robot, &q[..n], &columns, order, false);
        Iterate { q, tool, jacobian: columns, objective }
    }

    /// Moves `q` onto the target, but for the joints that are held, one bit a joint; whether it got there.
    #[inline(always)]
    fn restore<const C: usize>(&self, target: &Target, q: &mut [f64; C], held: u32, iterations: usize) -> (bool, usize) {
        let n = size::<C>(self.robot.n());
        let limits = self.settings.limits.then(|| self.robot.limits());
        let tolerance = self.settings.tolerance;
        let (robot, length, q) = (&*self.robot, self.settings.length, &mut q[..n]);
        let found = match &self.volume {
            None => reach_holding::<C>(robot, limits, &self.task, target, length, q, held, tolerance, iterations),
            Some(volume) => Sought { robot, volume, target, length, limits, held }.reach(q, tolerance, iterations),
        };
        (found.error <= tolerance.max(0.5 * ON_TARGET), found.iterations)
    }

    #[inline(always)]
    fn solve_from<const C: usize>(&self, target: &Target, q0: &[f64], each: &mut dyn FnMut(&Iteration)) -> Solution {
        let n = size::<C>(self.robot.n());
        let mut q = [0.0; C];
        q[..n].copy_from_slice(&q0[..n]);
        let (reached, mut iterations) = self.restore(target, &mut q, 0, REACH_ITERATIONS.min(self.settings.max_iterations));
        let free = n > self.task.dimension();
        let mut now = self.iterate(q, if free { Order::Hessian } else { Order::Value });
        let mut settled = reached && !free;
        let order = if self.settings.exact_hessian { Order::Hessian } else { Order::Gradient };
        let (mut before, mut held, mut evaluations) = (f64::INFINITY, 0, 1);
        while reached && !settled && iterations < self.settings.max_iterations {
            iterations += 1;
            let step = self.free_step(&now, target);
            let q = std::array::from_fn(|i| now.q.get(i).copied().unwrap_or(0.0));
            each(&Iteration { q, value: now.objective.value, gradient: step.gradient, step: step.free, evaluations });
            if step.free == 0.0 {
                settled = step.status == StepStatus::Regular;
                break;
            }
            // A step that a limit cuts short may be as small as it likes: the next one holds that joint.
            let last = settles(step.free, before) && step.held == held;
            (before, held) = (step.free, step.held);
            let Some(next) = self.descend(&now, target, &step, order, &mut evaluations) else { break };
            let previous = now;
            now = next;
            settled = last && step.status == StepStatus::Regular;
            if last {
                break;
            }
            if !self.settings.exact_hessian {
                update_hessian(&previous, &mut now, n);
            }
        }
        self.finish(&now, target, iterations, settled)
    }

    /// The step of the free motion from an iterate on the target.
    #[inline(always)]
    fn free_step<const C: usize>(&self, now: &Iterate<C>, target: &Target) -> NewtonStep<C> {
        let (robot, task, length) = (&*self.robot, &self.task, self.settings.length);
        let q = &now.q[..size::<C>(robot.n())];
        let constraint = task.constraint(&now.tool, target, length);
        let turning = task.turns_with_free_motion().then_some(Turning { robot, task, target, length, q, held: 0 });
        let known = Known { jacobian: &now.jacobian, objective: &now.objective, constraint: &constraint, turning, wanted: [0.0; 6] };
        let (low, high) = self.box_around::<C>(q);
        let (mut room, mut straight, mut count) = (None, 0, 0);
        if self.settings.limits && !robot.limits().coupled.is_empty() {
            straight = self.rows_around(q, room.get_or_insert([DenseRow::OPEN; MAX_STEP_ROWS]));
            count = straight;
        }
        if self.volume.is_some() {
            let (room, frame) = (room.get_or_insert([DenseRow::OPEN; MAX_STEP_ROWS]), PathFrame { start: None, end: target.frame });
            count += self.side_rows(&frame, (&now.tool, &now.jacobian), 1.0, &mut room[count..]);
        }
        let rows = room.as_ref().map_or(&[][..], |room| &room[..count]);
        let bounds = Bounds { low, high, rows, radius: RADIUS, gain: 1.0 };
        let step = newton_step(&known, &bounds);
        let hold = |known: &Known<'_, C>, bounds: &Bounds<'_, C>, step: NewtonStep<C>| {
            if step.held == 0 { step } else { holding(known, bounds, step) }
        };
        if rows.is_empty() {
            return hold(&known, &bounds, step);
        }
        let sides = |weights: &[f64; MAX_SIDES]| {
            self.volume.as_ref().map_or([[0.0; MAX_JOINTS]; MAX_JOINTS], |volume| curvature(volume, robot, &target.frame, q, weights))
        };
        let bend: Option<Bend<'_>> = self.volume.is_some().then_some((straight, &sides));
        pressed(&known, &bounds, step, bend, |known, bounds| hold(known, bounds, newton_step(known, bounds)))
    }

    /// The longest of the step, its half, its quarter ... whose end, brought back onto the target, is better.
    #[inline(always)]
    fn descend<'r, const C: usize>(
        &'r self,
        now: &Iterate<C>,
        target: &Target,
        step: &NewtonStep<C>,
        order: Order,
        evaluations: &mut usize,
    ) -> Option<Iterate<'r, C>> {
        // What rounding can add, and the task's tolerance. A step that promises less than values can tell is taken at its word.
        let size = now.objective.value.abs() + 1.0;
        let steepness = now.objective.gradient.iter().map(|g| g * g).sum::<f64>().sqrt();
        let noise = ROUNDING * size + OFF_TARGET * self.settings.tolerance * steepness;
        let untold = (UNTOLD * size).max(UNTOLD / ROUNDING * noise);
        let slack = if step.slope.abs() <= untold { untold } else { noise };
        let mut alpha = 1.0;
        for _ in 0..MAX_HALVINGS {
            let mut q = now.q;
            for i in 0..C {
                q[i] += alpha * step.dq[i];
            }
            if self.restore(target, &mut q, step.held, RETURN_ITERATIONS).0 {
                *evaluations += 1;
                let next = self.iterate(q, order);
                if next.objective.value <= now.objective.value + SUFFICIENT * alpha * step.slope + slack {
                    return Some(next);
                }
            }
            alpha *= 0.5;
        }
        None
    }

    #[inline(always)]
    fn finish<const C: usize>(&self, now: &Iterate<C>, target: &Target, iterations: usize, settled: bool) -> Solution {
        let (w, v) = self.left(&now.tool, target);
        let n = size::<C>(self.robot.n());
        let mut q = [0.0; MAX_JOINTS];
        q[..n].copy_from_slice(&now.q[..n]);
        let on_target = norm(w) <= ON_TARGET && norm(v) <= ON_TARGET;
        let status = match (on_target, settled) {
            (true, true) => SolveStatus::Converged,
            (true, false) => SolveStatus::OnTarget,
            (false, _) => SolveStatus::Unreachable,
        };
        Solution { q, value: now.objective.value, position_error: norm(v), angle_error: norm(w), status, iterations }
    }
}

/// Whether a step is the last, by its size and that of the one before: of the next, those of Newton being squared, the ratio is squared.
fn settles(step: f64, before: f64) -> bool {
    step <= SETTLED || (step <= NEARLY_SETTLED && step * (step / before).powi(2) <= NEXT && before.is_finite())
}

/// The step with its joints at limits held: only then is the curvature that of the motion which is left, and convergence quadratic. The step as it is
/// where nothing is left to move.
#[inline(never)]
fn holding<const C: usize>(known: &Known<'_, C>, bounds: &Bounds<'_, C>, step: NewtonStep<C>) -> NewtonStep<C> {
    let (mut jacobian, mut objective, mut bounds) = (*known.jacobian, *known.objective, *bounds);
    let (mut rest, mut wanted) = ([0.0; C], [0.0; 6]);
    for i in (0..jacobian.n()).filter(|i| step.held >> i & 1 == 1) {
        // The rest of the way to the limit, for which the others make up.
        rest[i] = if bounds.high[i] - step.dq[i] < step.dq[i] - bounds.low[i] { bounds.high[i] } else { bounds.low[i] };
        let column = known.constraint.reduce(jacobian.w[i], jacobian.v[i]);
        wanted = std::array::from_fn(|c| wanted[c] - rest[i] * column[c]);
        jacobian.hold(i);
        (bounds.low[i], bounds.high[i], objective.gradient[i]) = (0.0, 0.0, 0.0);
        for k in 0..jacobian.n() {
            (objective.hessian[i][k], objective.hessian[k][i]) = (0.0, 0.0);
        }
    }
    let turning = known.turning.map(|turning| Turning { held: step.held, ..turning });
    let mut out = newton_step(&Known { jacobian: &jacobian, objective: &objective, turning, wanted, ..*known }, &bounds);
    if !(out.free > 0.0 && out.slope < 0.0) {
        return step;
    }
    out.dq = std::array::from_fn(|i| out.dq[i] + rest[i]);
    NewtonStep { status: StepStatus::Limited, held: step.held, ..out }
}

/// The direct BFGS update (3.51a) of the Hessian carried from the previous iterate.
fn update_hessian<const C: usize>(previous: &Iterate<C>, now: &mut Iterate<C>, n: usize) {
    let (mut s, mut y) = ([0.0; C], [0.0; C]);
    for i in 0..n {
        s[i] = now.q[i] - previous.q[i];
        y[i] = now.objective.gradient[i] - previous.objective.gradient[i];
    }
    now.objective.hessian = previous.objective.hessian;
    direct_update_indefinite(&mut now.objective.hessian, &s, &y, n);
}
