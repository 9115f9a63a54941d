//! The methods of the rate level as objects: one control tick, a pose, a path (Huo 2009, algorithm 3.1).

use std::sync::Arc;

use super::methods::{Method, Posed};
use super::secondary::{Memory, Secondary};
use crate::error::{Error, Result, check_finite, check_positive};
use crate::inverse::reach;
use crate::kinematics::sized::{Jacobian, forward, jacobian, jacobian_apart};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{halves, norm};
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, Row6, size};
use crate::resolve::bounds::speed_bounds;
use crate::resolve::coupled::keep_combinations;
use crate::resolve::inside::check_volume;
use crate::resolve::keep_inside::{Asking, keep_inside};
use crate::resolve::nearest::{Asked, UNDONE, bends_little};
use crate::resolve::reach_inside::Sought;
use crate::resolve::{ON_TARGET, PathFrame, Resolver, Solution, SolveStatus, StepStatus};
use crate::robot::{Limits, Robot};
use crate::task::{Directions, OrientationVolume, Target, Task};

/// Largest motion of a joint in one iteration towards a target [rad or m].
const LARGEST_MOTION: f64 = 0.5;
/// Iterations that bring the tool back onto its target at most, before a damped Newton from the start takes over.
const CORRECTIONS: usize = 40;
/// Iterations of that, and of the way to a target from a random posture.
const REACH_ITERATIONS: usize = 60;
/// How far a range counts where the weights of Chan and Dubey would grow without bound, as a part of its half.
const END_OF_RANGE: f64 = 0.999_999;
/// Multiples of the free motion that are looked at on the way into the limits.
const FURTHEST: f64 = 1e3;

/// Settings of [`RateSolver`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateSettings {
    /// Length that weighs angles against distances \[m\].
    pub length: f64,
    /// What multiplies the secondary motion in a tick [1/s].
    pub gain: f64,
    /// What multiplies it in an iteration towards a target.
    pub relaxation: f64,
    /// Below this ratio of the shortest to the longest orthogonal row systems are solved with damping.
    pub damping: f64,
    /// Length of a control tick \[s\].
    pub dt: f64,
    /// Whether a tick keeps position and speed limits.
    pub limits: bool,
    /// Iterations a target with the secondary task, at most.
    pub iterations: usize,
    /// Norm of the joint motion below which these iterations end, and that motion is not made \[rad or m\]; 0 for all of them.
    pub stop: f64,
    /// Whether iterations of the task alone follow until its error is below the tolerance.
    pub correct: bool,
    /// That tolerance: rad, and m over the length.
    pub tolerance: f64,
}

impl Default for RateSettings {
    fn default() -> Self {
        Self {
            length: 1.0,
            gain: 1.0,
            relaxation: 1.0,
            damping: 1e-3,
            dt: 1e-3,
            limits: true,
            iterations: 20,
            stop: 0.0,
            correct: true,
            tolerance: 1e-12,
        }
    }
}

impl RateSettings {
    fn check(&self) -> Result<()> {
        for (name, value) in [("length", self.length), ("dt", self.dt), ("tolerance", self.tolerance)] {
            check_positive(name, value)?;
        }
        for (name, value) in [("gain", self.gain), ("relaxation", self.relaxation), ("stop", self.stop)] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Error::value(name, value, "a finite number of at least 0"));
            }
        }
        if !(self.damping > 0.0 && self.damping < 1.0) {
            return Err(Error::value("damping", self.damping, "a number between 0 and 1"));
        }
        if self.iterations == 0 {
            return Err(Error::value("iterations", 0, "at least 1"));
        }
        Ok(())
    }
}

/// A method with its robot, task and secondary task.
#[derive(Debug, Clone)]
pub struct RateSolver {
    robot: Arc<Robot>,
    task: Task,
    method: Method,
    secondary: Secondary,
    weights: Option<[f64; MAX_JOINTS]>,
    settings: RateSettings,
    volume: Option<Box<OrientationVolume>>,
}

/// Rates within position and speed limits.
struct RateBounds<'a, const C: usize> {
    low: [f64; C],
    high: [f64; C],
    /// Limits of speed.
    speed: &'a [f64],
    /// Whether a joint is beyond a limit of position, and has to come back.
    returning: bool,
}

impl<const C: usize> RateBounds<'_, C> {
    #[inline(always)]
    fn hold(&self, rates: &[f64]) -> bool {
        (0..rates.len()).all(|i| rates[i] >= self.low[i] && rates[i] <= self.high[i])
    }

    /// On the line through `alone`, the motion of the task, and `rates`, which add a free motion to it: the point within the limits nearest to
    /// `rates`. Where there is none, all joints slow down together until the fastest keeps its speed, and each stops at its position
    /// limits.
    fn keep(&self, alone: &[f64], rates: &mut [f64]) {
        let (mut least, mut most) = (-FURTHEST, FURTHEST);
        for i in 0..rates.len() {
            let (low, high) = (self.low[i], self.high[i]);
            let more = rates[i] - alone[i];
            let (a, b) = ((low - alone[i]) / more, (high - alone[i]) / more);
            if more != 0.0 && !a.is_nan() && !b.is_nan() {
                (least, most) = (least.max(a.min(b)), most.min(a.max(b)));
            }
        }
        let share = if least <= most { 1f64.clamp(least, most) } else { 0.0 };
        let mut slower = 1.0f64;
        for i in 0..rates.len() {
            rates[i] = alone[i] + share * (rates[i] - alone[i]);
            if rates[i].abs() > self.speed[i] {
                slower = slower.min(self.speed[i] / rates[i].abs());
            }
        }
        for i in 0..rates.len() {
            let (low, high) = (self.low[i], self.high[i]);
            // Numbers near the largest there are can overflow on the way: such a joint stands still.
            let wanted = slower * rates[i];
            rates[i] = if wanted.is_finite() { wanted } else { 0.0 }.clamp(low, high);
        }
    }
}

/// What a motion is for.
enum Goal<'a> {
    Twist(&'a Row6),
    Target(&'a Target),
}

/// One motion and how it came about.
struct Motion<const C: usize> {
    dq: [f64; C],
    /// Whether it follows a twist for a tick to second order too, for certain.
    follows: bool,
    damped: bool,
    complete: bool,
}

impl RateSolver {
    /// A solver; `weights` are those of [`Method::WeightedInverse`], one positive number a joint, from the distance to the limits if not given.
    pub fn new(
        robot: Arc<Robot>,
        task: Task,
        method: Method,
        secondary: Secondary,
        weights: Option<&[f64]>,
        settings: RateSettings,
    ) -> Result<Self> {
        settings.check()?;
        let n = robot.n();
        // Without resolution every component of the twist is followed.
        let task = if method == Method::ResolvedRate { Task::FULL } else { task };
        let columns = n + method.extra_columns(&task);
        if columns > MAX_JOINTS {
            return Err(Error::value("robot", format!("{n} joints and {} virtual ones", columns - n), &format!("at most {MAX_JOINTS}")));
        }
        if let Secondary::Objective(objective, _) = &secondary {
            objective.check(&robot)?;
        }
        let weights = match weights {
            None => None,
            Some(values) if values.len() != n => return Err(Error::length("weights", values.len(), n)),
            Some(values) => {
                check_finite("weights", values)?;
                for value in values {
                    check_positive("weights", *value)?;
                }
                Some(std::array::from_fn(|i| values.get(i).copied().unwrap_or(1.0)))
            }
        };
        Ok(Self { robot, task, method, secondary, weights, settings, volume: None })
    }

    /// The same with a volume that the tool's orientation, about the path's, has to be in; the task is the position.
    pub fn within_volume(mut self, volume: OrientationVolume) -> Result<Self> {
        if !self.method.takes_volumes() {
            return Err(Error::value(
                "task",
                "within a volume",
                "a task without, as the method follows or shares free components of the twist",
            ));
        }
        check_volume(&volume, &self.task)?;
        self.volume = Some(Box::new(volume));
        Ok(self)
    }

    /// The settings.
    pub fn settings(&self) -> &RateSettings {
        &self.settings
    }

    /// The columns that its kernels need room for.
    fn columns(&self) -> usize {
        self.method.columns(self.robot.n(), &self.task)
    }

    /// The same with another secondary task.
    pub fn with_secondary(&self, secondary: Secondary) -> Result<Self> {
        if let Secondary::Objective(objective, _) = &secondary {
            objective.check(&self.robot)?;
        }
        Ok(Self { secondary, ..self.clone() })
    }

    /// The weights of Chan and Dubey (1995): 1 in the middle of a range, without bound towards its ends.
    #[inline(always)]
    fn weights_at<const C: usize>(&self, q: &[f64]) -> [f64; C] {
        let mut out = [1.0; C];
        if self.method != Method::WeightedInverse {
            return out;
        }
        for i in 0..q.len() {
            out[i] = match (&self.weights, self.robot.limits().middle_and_half(i)) {
                (Some(weights), _) => weights[i],
                (None, Some((middle, half))) => {
                    let x = ((q[i] - middle) / half).clamp(-END_OF_RANGE, END_OF_RANGE);
                    1.0 + (x / (1.0 - x * x).powi(2)).abs() / half
                }
                (None, None) => 1.0,
            };
        }
        out
    }

    /// The motion at a posture, with `gain` times the secondary motion.
    #[inline(never)]
    fn motion<const C: usize>(&self, q: &[f64], goal: &Goal<'_>, gain: f64, memory: &mut Memory) -> Motion<C> {
        let (tool, columns) = jacobian_apart::<C>(&self.robot, q);
        self.motion_from((&tool, &columns), q, goal, gain, memory)
    }

    /// The same with the tool there and its Jacobian.
    #[inline(never)]
    fn motion_from<const C: usize>(
        &self,
        (tool, columns): (&Frame, &Jacobian<'_, C>),
        q: &[f64],
        goal: &Goal<'_>,
        gain: f64,
        memory: &mut Memory,
    ) -> Motion<C> {
        let weights = self.weights_at::<C>(q);
        let (length, damping) = (self.settings.length, self.settings.damping);
        let all = self.method == Method::ResolvedRate;
        let directions = if all { Directions::all(length) } else { self.task.directions(tool, length) };
        let at = Posed { task: &self.task, tool, jacobian: columns, directions: &directions, length, damping, weights: &weights };
        let (mut h, mut complete) = ([0.0; C], true);
        if gain > 0.0 && !all {
            (h, complete) = self.secondary.motion(&self.robot, q, &at, memory);
            h = h.map(|x| gain * x);
        }
        let error;
        let twist = match goal {
            Goal::Twist(twist) => twist,
            Goal::Target(target) => {
                let ([a, b, c], [x, y, z]) = self.task.error(tool, target);
                error = [a, b, c, x, y, z];
                &error
            }
        };
        let (dq, damped) = self.method.motion_at(&at, twist, &h);
        let follows = match goal {
            Goal::Twist(_) if !damped => {
                let (w, v) = halves(twist);
                bends_little(self.robot.arm(), columns, &directions, &dq, self.settings.dt, &directions.reduce(w, v))
            }
            _ => false,
        };
        Motion { dq, follows, damped, complete }
    }

    /// Joint rates of one control tick: the components of the twist that matter are followed, the rest of the motion is that of the secondary
    /// task. Never NaN; with limits, never faster than they allow nor across one within the tick. No allocation. To arrays of
    /// another size than the robot the answer is to stand still, as at a limit.
    pub fn step(&self, q: &[f64], twist: &Row6, memory: &mut Memory, rates: &mut [f64]) -> StepStatus {
        if q.len() != self.robot.n() || rates.len() != q.len() {
            rates.fill(0.0);
            return StepStatus::Limited;
        }
        with_capacity!(self.columns(), step(self, q, twist, None, memory, rates))
    }

    /// The same with the tool kept in the volume about the path's frame: where the method's motion would leave it, the nearest that does not, the position
    /// first. For methods that project orthogonally this is their own motion for a task with the bounds that hold it.
    pub fn step_about(&self, q: &[f64], twist: &Row6, frame: &PathFrame, memory: &mut Memory, rates: &mut [f64]) -> StepStatus {
        if q.len() != self.robot.n() || rates.len() != q.len() {
            rates.fill(0.0);
            return StepStatus::Limited;
        }
        with_capacity!(self.columns(), step(self, q, twist, Some(frame), memory, rates))
    }

    /// Takes from the free motion, then from all, what limits have no room for.
    #[cold]
    #[inline(never)]
    fn slow_down<const C: usize>(&self, q: &[f64], twist: &Row6, memory: &mut Memory, bounds: &RateBounds<'_, C>, rates: &mut [f64]) {
        // The task comes first: another share of the free motion before anything is taken from it.
        let alone = self.motion::<C>(q, &Goal::Twist(twist), 0.0, memory).dq;
        bounds.keep(&alone[..rates.len()], rates);
    }

    /// Replaces rates that lead elsewhere, as in front of a goal out of reach, by those that bring the tool nearest; whether limits hold
    /// these. In the room for the largest robots, so that no size has machine code of its own.
    #[cold]
    #[inline(never)]
    fn rest(&self, q: &[f64], twist: &Row6, bounds: &RateBounds<'_, MAX_JOINTS>, rates: &mut [f64]) -> Option<bool> {
        let dt = self.settings.dt;
        let (tool, jacobian) = jacobian_apart::<MAX_JOINTS>(&self.robot, q);
        let directions = self.task.directions(&tool, self.settings.length);
        let rows = directions.rows(&jacobian);
        let (w, v) = halves(twist);
        let wanted = directions.reduce(w, v).map(|x| dt * x);
        let asked = Asked { jacobian: &jacobian, directions: &directions, rows: &rows, wanted: &wanted, weighed: &wanted };
        let ease = self.weights_at::<MAX_JOINTS>(q).map(|weight| 1.0 / weight.sqrt());
        let astray = |rates: &[f64]| asked.goes_astray(&std::array::from_fn(|i| rates.get(i).map_or(0.0, |x| dt * x)), &ease, UNDONE);
        if !astray(rates) {
            return None;
        }
        if !matches!(self.secondary, Secondary::None) {
            // A secondary motion may lead the tool aside by little: the next tick makes up for that. What counts is the task alone.
            let alone = self.motion::<MAX_JOINTS>(q, &Goal::Twist(twist), 0.0, &mut Memory::default()).dq;
            let mut kept = alone;
            bounds.keep(&alone[..q.len()], &mut kept[..q.len()]);
            if !astray(&kept[..q.len()]) {
                return None;
            }
        }
        let (low, high) = (bounds.low.map(|x| dt * x), bounds.high.map(|x| dt * x));
        let (dq, held) = asked.nearest(&low, &high, self.settings.damping * self.settings.damping)?;
        for (i, rate) in rates.iter_mut().enumerate() {
            *rate = (dq[i] / dt).clamp(bounds.low[i], bounds.high[i]);
        }
        Some(held)
    }

    /// What position and speed limits leave room for within a tick.
    #[inline(always)]
    fn bounds<const C: usize>(&self, q: &[f64]) -> RateBounds<'_, C> {
        let (limits, dt) = (self.robot.limits(), self.settings.dt);
        let mut out = RateBounds { low: [f64::NEG_INFINITY; C], high: [f64::INFINITY; C], speed: &limits.qd_max, returning: false };
        out.returning = self.settings.limits && speed_bounds(limits, q, dt, &mut out.low, &mut out.high);
        out
    }

    #[inline(always)]
    fn error_size<const C: usize>(&self, target: &Target, q: &[f64]) -> f64 {
        let (w, v) = self.left(&forward::<C>(&self.robot, q), target);
        norm(w).max(norm(v) / self.settings.length)
    }

    /// One iteration towards a target, or none where its motion is shorter than `stop`: whether it was long enough.
    #[inline(always)]
    fn iterate<const C: usize>(&self, target: &Target, q: &mut [f64], gain: f64, stop: f64, memory: &mut Memory) -> bool {
        let (tool, columns) = jacobian_apart::<C>(&self.robot, q);
        let mut motion = self.motion_from((&tool, &columns), q, &Goal::Target(target), gain, memory);
        if let Some(volume) = &self.volume {
            // A motion is what rates make in a tick of length 1.
            let asking = Asking { robot: &self.robot, q, dt: 1.0, limits: false, before: &[] };
            keep_inside(&asking, volume, &PathFrame { start: None, end: target.frame }, (&tool, &columns), &mut motion.dq[..q.len()]);
        }
        if motion.dq[..q.len()].iter().map(|x| x * x).sum::<f64>().sqrt() < stop {
            return false;
        }
        let largest = motion.dq[..q.len()].iter().fold(0.0f64, |m, x| m.max(x.abs()));
        if !largest.is_finite() {
            return true;
        }
        let shorter = if largest > LARGEST_MOTION { LARGEST_MOTION / largest } else { 1.0 };
        for (x, dx) in q.iter_mut().zip(&motion.dq) {
            *x += shorter * dx;
        }
        true
    }

    /// Newton onto a target within limits, if any: whether it came there, and its steps.
    fn restore(&self, limits: Option<&Limits>, target: &Target, q: &mut [f64]) -> (bool, usize) {
        let (length, tolerance) = (self.settings.length, self.settings.tolerance);
        let robot = &*self.robot;
        let found = match &self.volume {
            None => reach(robot, limits, &self.task, target, length, q, tolerance, REACH_ITERATIONS),
            Some(volume) => Sought { robot, volume, target, length, limits, held: 0 }.reach(q, tolerance, REACH_ITERATIONS),
        };
        (found.error <= tolerance.max(0.5 * ON_TARGET), found.iterations)
    }
}

impl Resolver for RateSolver {
    fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// The task that is followed.
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

    /// From `q0` to a target by algorithm 3.1: iterations with the secondary task, then of the task alone until it is fulfilled. Where these lose
    /// their way at a singularity, a damped Newton from `q0` finds the target if it can be reached.
    fn solve_next(&self, target: &Target, q0: &[f64], memory: &mut Memory) -> Solution {
        if q0.len() != self.robot.n() {
            return Solution::nowhere();
        }
        with_capacity!(self.columns(), solve(self, target, q0, memory))
    }

    /// Onto the target by Newton, within the limits where these hold.
    fn prepare(&self, target: &Target, q: &mut [f64]) -> bool {
        self.restore(self.settings.limits.then(|| self.robot.limits()), target, q).0
    }
}

/// A tick within all limits, and within the volume about the path's frame.
#[inline(never)]
fn step<const C: usize>(
    solver: &RateSolver,
    q: &[f64],
    twist: &Row6,
    frame: Option<&PathFrame>,
    memory: &mut Memory,
    rates: &mut [f64],
) -> StepStatus {
    let (robot, RateSettings { length, dt, limits, .. }) = (&*solver.robot, solver.settings);
    let (tool, columns) = jacobian::<C>(robot, q);
    let at = (&tool, &columns);
    let mut status = tick(solver, at, q, twist, memory, rates);
    if limits && !robot.limits().coupled.is_empty() {
        status = keep_combinations(robot, &solver.task, length, q, dt, rates).over(status);
    }
    match (&solver.volume, frame) {
        (Some(volume), Some(frame)) => {
            let kept = keep_inside(&Asking { robot, q, dt, limits, before: &memory.rates[..q.len()] }, volume, frame, at, rates);
            memory.rates[..q.len()].copy_from_slice(rates);
            kept.over(status)
        }
        _ => status,
    }
}

/// A tick within the limits of single joints.
#[inline(always)]
fn tick<const C: usize>(
    solver: &RateSolver,
    at: (&Frame, &Jacobian<'_, C>),
    q: &[f64],
    twist: &Row6,
    memory: &mut Memory,
    rates: &mut [f64],
) -> StepStatus {
    let n = size::<C>(solver.robot.n()).min(rates.len());
    let motion = solver.motion_from(at, q, &Goal::Twist(twist), solver.settings.gain, memory);
    if !motion.dq[..n].iter().all(|x| x.is_finite()) {
        rates[..n].fill(0.0);
        return StepStatus::Damped;
    }
    rates[..n].copy_from_slice(&motion.dq[..n]);
    let bounds = solver.bounds::<C>(q);
    let limited = !bounds.hold(&rates[..n]);
    if limited {
        solver.slow_down(q, twist, memory, &bounds, &mut rates[..n]);
    }
    let rests = if motion.follows && !limited { None } else { solver.rest(q, twist, &solver.bounds(q), &mut rates[..n]) };
    match (rests.unwrap_or(limited), motion.damped || rests.is_some(), motion.complete) {
        _ if bounds.returning => StepStatus::Returning,
        (true, ..) => StepStatus::Limited,
        (_, true, _) => StepStatus::Damped,
        (_, _, false) => StepStatus::TaskOnly,
        _ => StepStatus::Regular,
    }
}

#[inline(never)]
fn solve<const C: usize>(solver: &RateSolver, target: &Target, q0: &[f64], memory: &mut Memory) -> Solution {
    let (n, settings) = (q0.len(), &solver.settings);
    let mut q = [0.0; MAX_JOINTS];
    q[..n].copy_from_slice(q0);
    let mut done = 0;
    for _ in 0..settings.iterations {
        done += 1;
        if !solver.iterate::<C>(target, &mut q[..n], settings.relaxation, settings.stop, memory) {
            break;
        }
    }
    while settings.correct && done < settings.iterations + CORRECTIONS && solver.error_size::<C>(target, &q[..n]) > settings.tolerance {
        done += 1;
        solver.iterate::<C>(target, &mut q[..n], 0.0, 0.0, memory);
    }
    if settings.correct && solver.error_size::<C>(target, &q[..n]) > settings.tolerance.max(0.5 * ON_TARGET) {
        let mut direct = [0.0; MAX_JOINTS];
        direct[..n].copy_from_slice(q0);
        let (reached, iterations) = solver.restore(None, target, &mut direct[..n]);
        done += iterations;
        if reached {
            q = direct;
        }
    }
    let (w, v) = solver.left(&forward::<C>(&solver.robot, &q[..n]), target);
    let on_target = norm(w) <= ON_TARGET && norm(v) <= ON_TARGET;
    Solution {
        q,
        value: solver.secondary.value::<C>(&solver.robot, &q[..n]),
        position_error: norm(v),
        angle_error: norm(w),
        status: if on_target { SolveStatus::OnTarget } else { SolveStatus::Unreachable },
        iterations: done,
    }
}
