//! The orthogonal SQP iterated: to a pose, from many starts, along a path.

use super::newton_step::{Bounds, Known, StepStatus, newton_step};
use super::orthogonal_sqp::{OrthogonalSqp, RADIUS};
use crate::index::{Evaluation, Order};
use crate::inverse::{Postures, reach};
use crate::kinematics::{Jacobian, forward, jacobian};
use crate::linalg::frame::Frame;
use crate::linalg::vector::norm;
use crate::linalg::{MAX_JOINTS, size};
use crate::task::Target;

/// Trial lengths of one step.
const MAX_HALVINGS: usize = 12;
/// A step whose largest free component is below this has converged: Newton's next one would be its square.
const SETTLED: f64 = 1e-7;
/// Steps of the search for a start.
const REACH_ITERATIONS: usize = 60;

/// How a solution ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// On the target, at a minimum of the objective.
    Converged,
    /// On the target, at the least value that the limits allow or before the objective settled.
    OnTarget,
    /// Not on the target: unreachable within limits, or singular on the way.
    Unreachable,
}

/// A posture on (or nearest found to) a target.
#[derive(Debug, Clone, Copy)]
pub struct Solution {
    /// Joints; the first n count.
    pub q: [f64; MAX_JOINTS],
    /// Objective there.
    pub value: f64,
    /// Distance of the tool point to the target [m].
    pub position_error: f64,
    /// Angle to the target's orientation or axis [rad].
    pub angle_error: f64,
    /// How it ended.
    pub status: SolveStatus,
    /// Steps.
    pub iterations: usize,
}

/// One point of a followed path.
pub type PathPoint = Solution;

/// The iterate: everything known at a posture.
struct Iterate<const C: usize> {
    q: [f64; C],
    tool: Frame,
    jacobian: Jacobian<C>,
    objective: Evaluation<C>,
    error: f64,
}

impl OrthogonalSqp {
    #[inline(always)]
    fn iterate<const C: usize>(&self, q: [f64; C], target: &Target, order: Order) -> Iterate<C> {
        let n = size::<C>(self.robot.n());
        let (tool, columns) = jacobian::<C>(&self.robot, &q[..n]);
        let objective = self.objective.evaluate_at(&self.robot, &q[..n], &columns, order, false);
        let (w, v) = self.task.error(&tool, target);
        Iterate { q, tool, jacobian: columns, objective, error: norm(w).hypot(norm(v) / self.settings.length) }
    }

    /// From `q0` to the target, and on it to a minimum of the objective.
    pub fn solve<const C: usize>(&self, target: &Target, q0: &[f64]) -> Solution {
        let n = size::<C>(self.robot.n());
        let mut q = [0.0; C];
        q[..n].copy_from_slice(&q0[..n]);
        // Far from the target the objective has no say yet.
        let near = 0.2;
        let (w, v) = self.task.error(&forward::<C>(&self.robot, &q[..n]), target);
        let mut iterations = 0;
        if norm(w).hypot(norm(v) / self.settings.length) > near {
            iterations += reach::<C>(&self.robot, &self.task, target, self.settings.length, &mut q[..n], 1e-6, REACH_ITERATIONS).iterations;
        }
        let order = if self.settings.exact_hessian { Order::Hessian } else { Order::Gradient };
        let mut now = self.iterate(q, target, Order::Hessian);
        let mut settled = false;
        let mut limited = false;
        let mut penalty = 0.0f64;
        while iterations < self.settings.max_iterations && !settled {
            iterations += 1;
            let directions = self.task.directions(&now.tool, self.settings.length);
            let (w, v) = self.task.error(&now.tool, target);
            let known =
                Known { jacobian: &now.jacobian, objective: &now.objective, directions: &directions, wanted: directions.reduce(w, v) };
            let (low, high) = self.box_around::<C>(&now.q[..n]);
            let step = newton_step(&known, &Bounds { low, high, radius: RADIUS, gain: 1.0 });
            limited = step.status != StepStatus::Regular;
            penalty = penalty.max(2.0 * step.price * self.settings.length * (directions.dimension() as f64).sqrt());
            let largest = step.dq[..n].iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let Some(next) = self.accept(&now, target, &step.dq, step.slope, penalty, order) else { break };
            settled = largest <= SETTLED && next.error <= self.settings.tolerance.max(1e-12);
            let previous = now;
            now = next;
            if !self.settings.exact_hessian {
                update_hessian(&previous, &mut now, n);
            }
        }
        self.finish(&now, target, iterations, settled && !limited)
    }

    /// The longest of the step, its half, its quarter ... that decreases the objective plus the price of the error.
    #[inline(always)]
    fn accept<const C: usize>(
        &self,
        now: &Iterate<C>,
        target: &Target,
        dq: &[f64; C],
        slope: f64,
        penalty: f64,
        order: Order,
    ) -> Option<Iterate<C>> {
        let merit = |it: &Iterate<C>| it.objective.value + penalty * it.error;
        let start = merit(now);
        // What rounding alone can add.
        let slack = 1e-11 * (now.objective.value.abs() + 1.0);
        let mut alpha = 1.0;
        for _ in 0..MAX_HALVINGS {
            let mut q = now.q;
            for i in 0..C {
                q[i] += alpha * dq[i];
            }
            let next = self.iterate(q, target, order);
            let promised = alpha * (1e-4 * slope - 0.1 * penalty * now.error);
            let better = if start.is_finite() { merit(&next) <= start + promised + slack } else { next.error <= now.error };
            // On the way to the target a full step that halves the error is always worth it: the merit's kink must not block it.
            let restoring = alpha == 1.0
                && next.objective.value.is_finite()
                && now.error > 1e-9
                && next.error <= 0.5 * now.error
                && merit(&next) <= start + 0.1 * start.abs();
            if better || restoring {
                return Some(next);
            }
            alpha *= 0.5;
        }
        None
    }

    #[inline(always)]
    fn finish<const C: usize>(&self, now: &Iterate<C>, target: &Target, iterations: usize, settled: bool) -> Solution {
        let (w, v) = self.task.error(&now.tool, target);
        let n = size::<C>(self.robot.n());
        let mut q = [0.0; MAX_JOINTS];
        q[..n].copy_from_slice(&now.q[..n]);
        let on_target = norm(w) <= 1e-9 && norm(v) <= 1e-9;
        let status = match (on_target, settled) {
            (true, true) => SolveStatus::Converged,
            (true, false) => SolveStatus::OnTarget,
            (false, _) => SolveStatus::Unreachable,
        };
        Solution { q, value: now.objective.value, position_error: norm(v), angle_error: norm(w), status, iterations }
    }

    /// The best solution from `starts` random postures within the limits; `None` if the target was never reached.
    pub fn solve_best<const C: usize>(&self, target: &Target, starts: usize, seed: u64) -> Option<Solution> {
        let n = self.robot.n();
        let mut postures = Postures::new(seed);
        let mut best: Option<Solution> = None;
        for _ in 0..starts {
            let mut q = [0.0; MAX_JOINTS];
            postures.fill(&self.robot, &mut q[..n]);
            let reached = reach::<C>(&self.robot, &self.task, target, self.settings.length, &mut q[..n], 1e-4, REACH_ITERATIONS);
            if reached.error > 1e-4 {
                continue;
            }
            let solution = self.solve::<C>(target, &q[..n]);
            if solution.status != SolveStatus::Unreachable && best.as_ref().is_none_or(|b| solution.value < b.value) {
                best = Some(solution);
            }
        }
        best
    }

    /// Along the targets, each from the posture of the one before.
    pub fn follow<const C: usize>(&self, targets: &[Target], q0: &[f64], mut each: impl FnMut(usize, &PathPoint)) {
        let n = self.robot.n();
        let mut q = [0.0; MAX_JOINTS];
        q[..n].copy_from_slice(&q0[..n]);
        for (i, target) in targets.iter().enumerate() {
            let point = self.solve::<C>(target, &q[..n]);
            q = point.q;
            each(i, &point);
        }
    }
}

/// The direct BFGS update (3.51a) of the Hessian carried from the previous iterate.
fn update_hessian<const C: usize>(previous: &Iterate<C>, now: &mut Iterate<C>, n: usize) {
    let mut b = previous.objective.hessian;
    let (mut s, mut y, mut bs) = ([0.0; C], [0.0; C], [0.0; C]);
    for i in 0..n {
        s[i] = now.q[i] - previous.q[i];
        y[i] = now.objective.gradient[i] - previous.objective.gradient[i];
    }
    for i in 0..n {
        bs[i] = (0..n).map(|j| b[i][j] * s[j]).sum();
    }
    let sbs: f64 = (0..n).map(|i| s[i] * bs[i]).sum();
    let sy: f64 = (0..n).map(|i| s[i] * y[i]).sum();
    let size = (0..n).map(|i| s[i] * s[i]).sum::<f64>();
    // The update would divide by nothing: keep what there is.
    if sbs.abs() > 1e-12 * size && sy.abs() > 1e-12 * size {
        for i in 0..n {
            for j in 0..n {
                b[i][j] += y[i] * y[j] / sy - bs[i] * bs[j] / sbs;
            }
        }
    }
    now.objective.hessian = b;
}
