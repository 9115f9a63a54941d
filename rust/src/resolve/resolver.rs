//! What all solvers have in common: a posture on a target, the best of many, a path from target to target.

use std::sync::Arc;

use super::rate::Memory;
use super::reach_inside::error_inside;
use crate::inverse::reach;
use crate::kinematics::{forward, jacobian};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, halves, scale, sub};
use crate::linalg::{MAX_JOINTS, Row6};
use crate::robot::{RandomPostures, Robot};
use crate::task::{OrientationVolume, Target, Task};

/// Error of a posture that counts as on target [rad, m].
pub const ON_TARGET: f64 = 1e-9;
/// Steps of Newton onto a target.
const LANDING: usize = 60;
/// Relative difference of values that count as the same.
const TIE: f64 = 1e-9;
/// Difference of squared distances from the middle of the ranges that counts as none [rad^2].
const SAME_DISTANCE: f64 = 1e-6;

/// How a step of a control loop came about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum StepStatus {
    /// Task and secondary task as wanted.
    Regular,
    /// Nearly singular: the step is damped.
    Damped,
    /// The objective could not be evaluated or has no derivatives here: task only.
    TaskOnly,
    /// Slowed down, or stopped at a limit.
    Limited,
    /// A joint is beyond a limit of position and comes back; the task is followed as far as that allows.
    Returning,
}

impl StepStatus {
    /// All of them, each at its own number.
    pub const ALL: [Self; 5] = [Self::Regular, Self::Damped, Self::TaskOnly, Self::Limited, Self::Returning];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Regular => "regular",
            Self::Damped => "damped",
            Self::TaskOnly => "task only",
            Self::Limited => "limited",
            Self::Returning => "returning",
        }
    }
}

/// How the search for a posture ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolveStatus {
    /// On the target, at a minimum of the objective.
    Converged,
    /// On the target, at the least value that the limits allow or before the objective settled.
    OnTarget,
    /// Not on the target: unreachable within limits, or singular on the way.
    Unreachable,
}

impl SolveStatus {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::OnTarget => "on target",
            Self::Unreachable => "unreachable",
        }
    }
}

/// A posture on (or nearest found to) a target.
#[derive(Debug, Clone, Copy)]
pub struct Solution {
    /// Joints; the first n count.
    pub q: [f64; MAX_JOINTS],
    /// Objective there, NaN without.
    pub value: f64,
    /// Distance of the tool point to the target \[m\].
    pub position_error: f64,
    /// Angle to the target's orientation or axis \[rad\].
    pub angle_error: f64,
    /// How it ended.
    pub status: SolveStatus,
    /// Steps.
    pub iterations: usize,
}

impl Solution {
    /// What is answered to a start of another number of joints than the robot's.
    pub(super) fn nowhere() -> Self {
        let nan = f64::NAN;
        Self { q: [0.0; MAX_JOINTS], value: nan, position_error: nan, angle_error: nan, status: SolveStatus::Unreachable, iterations: 0 }
    }
}

/// A method that resolves the redundancy of a robot for a task, as far as targets are concerned.
pub trait Resolver: Sync {
    /// The robot.
    fn robot(&self) -> &Arc<Robot>;

    /// The task.
    fn task(&self) -> &Task;

    /// The volume that the tool's orientation, about the target's, has to be in beside the task.
    fn volume(&self) -> Option<&OrientationVolume> {
        None
    }

    /// Whether position limits hold.
    fn keeps_limits(&self) -> bool;

    /// Length of a control tick \[s\].
    fn dt(&self) -> f64;

    /// From `q0` to a target, where `memory` is what earlier targets of the same path left. A `q0` of another number of joints than the robot's
    /// leads nowhere: unreachable, with NaN errors.
    fn solve_next(&self, target: &Target, q0: &[f64], memory: &mut Memory) -> Solution;

    /// Makes a random posture a start for [`Resolver::solve`]; false where nothing starts from it.
    fn prepare(&self, _target: &Target, _q: &mut [f64]) -> bool {
        true
    }

    /// From `q0` to a target.
    fn solve(&self, target: &Target, q0: &[f64]) -> Solution {
        self.solve_next(target, q0, &mut Memory::default())
    }

    /// The small motion [rotation vector; translation] from the tool at `q` to a target, as far as the task looks at it, or into the volume about it [rad, m]; NaN for a `q` of
    /// another number of joints than the robot's.
    fn error(&self, target: &Target, q: &[f64]) -> Row6 {
        forward(self.robot(), q).map_or([f64::NAN; 6], |tool| row(self.left(&tool, target)))
    }

    /// What is left of the way to a target: [`Task::error`], with a volume the shortest rotation into it.
    fn left(&self, tool: &Frame, target: &Target) -> (Vec3, Vec3) {
        match self.volume() {
            Some(volume) => error_inside(volume, tool, target),
            None => self.task().error(tool, target),
        }
    }

    /// The twist of a tick along a path: from the tool at `q` to where it has to be at the end of the tick, `next`, but for the part `1 - share` of
    /// its distance from where it should be already, `now`. With a share of 1 that is eq. 1 of Dufour and Suleiman (2020). NaN as for
    /// [`Resolver::error`].
    fn twist_along(&self, now: &Target, next: &Target, share: f64, q: &[f64]) -> Row6 {
        let Ok(tool) = forward(self.robot(), q) else { return [f64::NAN; 6] };
        let mut out = row(self.task().error(&tool, next));
        if share != 1.0 {
            let late = row(self.task().error(&tool, now));
            out = std::array::from_fn(|i| out[i] - (1.0 - share) * late[i]);
        }
        out.map(|x| x / self.dt())
    }

    /// The part of a twist that rates do not follow, as far as the task looks at it [omega; v]; NaN as for [`Resolver::error`].
    fn deviation(&self, q: &[f64], twist: &Row6, rates: &[f64]) -> Row6 {
        let Ok((tool, columns)) = jacobian(self.robot(), q) else { return [f64::NAN; 6] };
        let (mut w, mut v) = halves(twist);
        for (i, rate) in rates.iter().enumerate().take(columns.n()) {
            (w, v) = (sub(w, scale(*rate, columns.w[i])), sub(v, scale(*rate, columns.v[i])));
        }
        row(self.task().directions(&tool, 1.0).project(w, v))
    }

    /// Along the targets, each from the posture of the one before; `each` is told of every solution.
    fn follow(&self, targets: &[Target], q0: &[f64], memory: &mut Memory, each: &mut dyn FnMut(&Solution)) {
        let n = q0.len().min(MAX_JOINTS);
        let mut q = [0.0; MAX_JOINTS];
        q[..n].copy_from_slice(&q0[..n]);
        for target in targets {
            let solution = self.solve_next(target, &q[..n], memory);
            q = solution.q;
            each(&solution);
        }
    }

    /// The best solution from `starts` random postures within the limits, without whole turns; `None` if the target was never reached, or never
    /// within the limits where these hold.
    fn solve_best(&self, target: &Target, starts: usize, seed: u64) -> Option<Solution> {
        let robot = self.robot();
        let n = robot.n();
        let mut postures = RandomPostures::new(seed);
        let mut best: Option<Solution> = None;
        for _ in 0..starts {
            let mut q = [0.0; MAX_JOINTS];
            postures.fill(robot, &mut q[..n]);
            if self.keeps_limits() && !robot.limits().coupled.is_empty() {
                land(robot, self.task(), target, &mut q[..n]);
            }
            if !self.prepare(target, &mut q[..n]) {
                continue;
            }
            let mut solution = self.solve(target, &q[..n]);
            robot.turn(&mut solution.q[..n]);
            let inside = !self.keeps_limits() || robot.limits().settle(&mut solution.q[..n]);
            let good = solution.status != SolveStatus::Unreachable && inside;
            if good && best.as_ref().is_none_or(|best| prefers(robot, &solution, best)) {
                best = Some(solution);
            }
        }
        best
    }
}

/// Takes a posture onto a target where a copy by whole turns of what Newton finds without limits is within them: on the way, combinations of joints tell copies
/// of one posture apart, which the target does not.
#[cold]
#[inline(never)]
fn land(robot: &Robot, task: &Task, target: &Target, q: &mut [f64]) {
    let (n, mut there) = (q.len(), [0.0; MAX_JOINTS]);
    there[..n].copy_from_slice(q);
    let found = reach(robot, None, task, target, 1.0, &mut there[..n], 0.1 * ON_TARGET, LANDING);
    robot.turn(&mut there[..n]);
    if found.error <= ON_TARGET && robot.limits().contain(&there[..n]) {
        q.copy_from_slice(&there[..n]);
    }
}

fn row(([a, b, c], [x, y, z]): (Vec3, Vec3)) -> Row6 {
    [a, b, c, x, y, z]
}

/// Whether solution `a` is better than `b`: by value, and among equals (mirrored postures, or nothing to value them by) by distance from the
/// middle of the ranges.
fn prefers(robot: &Robot, a: &Solution, b: &Solution) -> bool {
    let defined = |s: &Solution| !s.value.is_nan();
    let same = a.value == b.value || (a.value - b.value).abs() <= TIE * b.value.abs();
    if defined(a) != defined(b) {
        return defined(a);
    }
    if defined(a) && !same {
        return a.value < b.value;
    }
    let distance = |s: &Solution| robot.distance_from_middle(&s.q[..robot.n()]);
    distance(a) < distance(b) - SAME_DISTANCE
}
