//! The orthogonal SQP iterated: to a pose, from many starts, along a path.

use super::newton_step::{Bounds, Known, StepStatus, newton_step};
use super::orthogonal_sqp::{OrthogonalSqp, RADIUS};
use crate::index::Order;
use crate::index::sized::Evaluation;
use crate::inverse::reach_sized;
use crate::kinematics::sized::{Jacobian, jacobian};
use crate::linalg::frame::Frame;
use crate::linalg::vector::norm;
use crate::linalg::{MAX_JOINTS, size};
use crate::robot::RandomPostures;
use crate::task::Target;

/// Trial lengths of one step.
const MAX_HALVINGS: usize = 12;
/// A Newton step of the free motion below this has settled: the next would be its square [rad or m].
const SETTLED: f64 = 1e-6;
/// Steps of the way to a target from afar.
const REACH_ITERATIONS: usize = 60;
/// Steps of the way back to it after a free motion.
const RETURN_ITERATIONS: usize = 8;
/// Error of a posture that counts as on target [rad, m].
const ON_TARGET: f64 = 1e-9;

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
}

impl OrthogonalSqp {
    #[inline(always)]
    fn iterate<const C: usize>(&self, q: [f64; C], order: Order) -> Iterate<C> {
        let n = size::<C>(self.robot.n());
        let (tool, columns) = jacobian::<C>(&self.robot, &q[..n]);
        let objective = self.objective.evaluate_at(&self.robot, &q[..n], &columns, order, false);
        Iterate { q, tool, jacobian: columns, objective }
    }

    /// Moves `q` onto the target; whether it got there.
    #[inline(always)]
    fn restore<const C: usize>(&self, target: &Target, q: &mut [f64; C], iterations: usize) -> (bool, usize) {
        let n = size::<C>(self.robot.n());
        let limits = self.settings.limits.then(|| self.robot.limits());
        let tolerance = self.settings.tolerance;
        let found = reach_sized::<C>(&self.robot, limits, &self.task, target, self.settings.length, &mut q[..n], tolerance, iterations);
        (found.error <= tolerance.max(0.5 * ON_TARGET), found.iterations)
    }

    /// From `q0` to the target, then on it to a minimum of the objective: every iterate is on the target, and each is better than the one
    /// before, so that neither can spoil the other.
    pub fn solve<const C: usize>(&self, target: &Target, q0: &[f64]) -> Solution {
        let n = size::<C>(self.robot.n());
        let mut q = [0.0; C];
        q[..n].copy_from_slice(&q0[..n]);
        let (reached, mut iterations) = self.restore(target, &mut q, REACH_ITERATIONS.min(self.settings.max_iterations));
        let free = n > self.task.dimension();
        let mut now = self.iterate(q, if free { Order::Hessian } else { Order::Value });
        let mut settled = reached && !free;
        let order = if self.settings.exact_hessian { Order::Hessian } else { Order::Gradient };
        while reached && !settled && iterations < self.settings.max_iterations {
            iterations += 1;
            let directions = self.task.directions(&now.tool, self.settings.length);
            let known = Known { jacobian: &now.jacobian, objective: &now.objective, directions: &directions, wanted: [0.0; 6] };
            let (low, high) = self.box_around::<C>(&now.q[..n]);
            let step = newton_step(&known, &Bounds { low, high, radius: RADIUS, gain: 1.0 });
            let last = step.free <= SETTLED;
            if step.free == 0.0 {
                settled = step.status == StepStatus::Regular;
                break;
            }
            let Some(next) = self.descend(&now, target, &step.dq, step.slope, order) else {
                // No descent along a descent direction: rounding has the last word, unless a limit had it.
                settled = last;
                break;
            };
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

    /// The longest of the step, its half, its quarter ... whose end, brought back onto the target, is better.
    #[inline(always)]
    fn descend<const C: usize>(&self, now: &Iterate<C>, target: &Target, dq: &[f64; C], slope: f64, order: Order) -> Option<Iterate<C>> {
        // What rounding alone can add.
        let slack = 1e-13 * (now.objective.value.abs() + 1.0);
        let mut alpha = 1.0;
        for _ in 0..MAX_HALVINGS {
            let mut q = now.q;
            for i in 0..C {
                q[i] += alpha * dq[i];
            }
            if self.restore(target, &mut q, RETURN_ITERATIONS).0 {
                let next = self.iterate(q, order);
                if next.objective.value <= now.objective.value + 1e-4 * alpha * slope + slack {
                    return Some(next);
                }
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
        let on_target = norm(w) <= ON_TARGET && norm(v) <= ON_TARGET;
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
        let mut postures = RandomPostures::new(seed);
        let mut best: Option<Solution> = None;
        for _ in 0..starts {
            let mut q = [0.0; MAX_JOINTS];
            postures.fill(&self.robot, &mut q[..n]);
            let mut solution = self.solve::<C>(target, &q[..n]);
            self.robot.turn(&mut solution.q[..n]);
            if solution.status != SolveStatus::Unreachable && best.as_ref().is_none_or(|b| self.prefers(&solution, b)) {
                best = Some(solution);
            }
        }
        best
    }

    /// Whether solution `a` beats `b`: by value, and among equals (mirrored postures, whole turns) by distance from the middle of the ranges.
    fn prefers(&self, a: &Solution, b: &Solution) -> bool {
        let distance = |s: &Solution| self.robot.distance_from_middle(&s.q[..self.robot.n()]);
        let tie = 1e-9 * b.value.abs();
        a.value < b.value - tie || (a.value <= b.value + tie && distance(a) < distance(b) - 1e-6)
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
