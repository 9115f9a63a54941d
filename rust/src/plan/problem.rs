//! A path of postures as one optimisation problem: what is minimised, what has to hold, and how far postures are from it.

use std::sync::Arc;

use rayon::prelude::*;

use super::frames::{outside, spin, spin_frames, tools, turned_about, volume_frames};
use super::graph::Criterion;
use super::joint_weights::JointWeights;
use super::members;
use super::numbers::{mean_size, sum};
use super::path::{Orientation, Path, point_weights};
use super::pins::{Fixed, Held, Pinned, Pins};
use super::settings::{Aim, PlanSettings};
use crate::error::{Error, Result};
use crate::index::Objective;
use crate::inverse::reach_sized;
use crate::kinematics::sized::forward;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, norm, sub};
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, size};
use crate::robot::{AT_LIMIT, Joint, Robot, nearest_turn};
use crate::task::volume::{OrientationVolume, Sides};
use crate::task::{Projector, Target, Task};

/// Error of a point that counts as on the path [rad, m].
pub const ON_PATH: f64 = 1e-9;
/// What a posture may be outside a volume by \[rad\]: rounding.
const MEMBER: f64 = 5e-10;
/// Paths with fewer points are evaluated on one core.
pub(super) const PARALLEL: usize = 32;
/// Points that a core takes at a time.
pub(super) const CHUNK: usize = 16;
/// Error at which the way back onto the path ends [rad, m over the length].
const RESTORED: f64 = 1e-12;
/// Newton steps back onto the path.
const RETURN_ITERATIONS: usize = 12;
/// Weight of the integral of the squared joint speed where none is given, relative to the value: for the worst one, and for the mean.
const GENTLE: (f64, f64) = (1e-7, 1e-5);
/// The same for the slowest joint: nothing else tells the others where to go, and far less leaves the refinement without an optimum to end at.
const PACED: f64 = 5e-4;
/// Rounding of the times of a path must not carry a joint beyond its speed.
const BELOW_SPEED: f64 = 1.0 - 1e-9;

/// A path, or a stretch of it, and what is wanted of it.
#[derive(Debug, Clone)]
pub struct PathProblem {
    /// Robot.
    pub robot: Arc<Robot>,
    /// Task, as far as the robot's tool can move.
    pub task: Task,
    /// The task that was asked for.
    pub asked: Task,
    /// Targets, one a point. In a stretch that closes, the last one, which is the first, is left out.
    pub targets: Arc<[Target]>,
    /// Tool frames at spin 0, one a point.
    pub frames: Arc<[Frame]>,
    /// What is minimised; motion alone if nothing.
    pub objective: Option<Objective>,
    /// Worst value or integral.
    pub criterion: Criterion,
    /// Weight of the integral of the squared joint speed over the path's share; next to nothing beside the values if not given.
    pub smoothness: Option<f64>,
    /// Weights of the joints in the motion.
    pub joint_weights: JointWeights,
    /// Share of the path that each point stands for.
    pub weights: Arc<[f64]>,
    /// Share of the path from each point to the next; one more than gaps in a stretch that closes.
    pub steps: Arc<[f64]>,
    /// Largest motions from each point to the next [rad or m], n a step; infinite where there is none.
    pub bounds: Arc<[f64]>,
    /// How far each joint moves from each point to the next while the tool takes a second for a metre [rad or m], n a step: where the tool's largest
    /// constant speed is sought. Infinite where the step has no length, or the joint no largest speed.
    pub pace: Option<Arc<[f64]>>,
    /// Whether it is the speed of joints that bounds them.
    pub timed: bool,
    /// Whether position limits hold.
    pub limits: bool,
    /// Whether the last point of the whole path is the first.
    pub closed: bool,
    /// In a stretch that closes, the whole turns from the last posture to the first [rad].
    pub turns: Option<Vec<f64>>,
    /// Length that weighs angles against distances in the task [m].
    pub length: f64,
    /// Least and largest spin [rad], at most a turn apart, and its axis in the tool frame.
    pub spin: Option<SpinRange>,
    /// The orientations that are allowed at every point, seen in its frame.
    pub volume: Option<OrientationVolume>,
    /// How far from each of their bounds a refinement starts \[rad\].
    pub(super) room: Arc<[f64]>,
    /// Postures and spins that are held.
    pub pins: Pins,
}

/// What the tool has to do.
#[derive(Debug, Clone)]
pub struct Goal {
    /// The task; beside a volume that of the volume's axis.
    pub task: Task,
    /// The orientations that are allowed, where the task is that.
    pub volume: Option<OrientationVolume>,
}

impl From<Task> for Goal {
    fn from(task: Task) -> Self {
        Self { task, volume: None }
    }
}

/// The spin that a tool is allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpinRange {
    /// The axis in the tool frame.
    pub axis: Vec3,
    /// Least and largest spin [rad], at most a turn apart.
    pub range: (f64, f64),
}

impl PathProblem {
    /// The problem of a whole path.
    ///
    /// # Errors
    /// [`crate::error::Error`] if the path does not suit the task, or the robot has too few joints for it.
    pub fn new(robot: Arc<Robot>, path: &Path, goal: &Goal, objective: Option<Objective>, settings: &PlanSettings) -> Result<Self> {
        let (aim, motion_alone) = (settings.criterion, settings.criterion == Aim::Motion);
        let mut frames = match &goal.volume {
            Some(volume) => volume_frames(path, volume, settings.closed)?,
            None => spin_frames(path, &goal.task, settings.closed)?,
        };
        let steps = path.shares();
        let asked = goal.task;
        let task = if goal.volume.is_some() { Task::POSITION } else { asked.suited(&robot) };
        if let Some(volume) = &goal.volume {
            check_volume(volume, &asked, &robot, settings)?;
        }
        if task.rank(&robot) < task.dimension() {
            let (n, able) = (robot.n(), asked.rank(&robot));
            let given = format!("{} of {} components for {n} joints, which can do {able} of them", asked.kind(), asked.dimension());
            return Err(Error::value("task", given, "one that asks for no more than the robot can do"));
        }
        if let (Orientation::Axis(axis), Projector::Line(about), true) = (Orientation::of(&asked), task.angular, task != asked) {
            frames = turned_about(about, &tools(&robot, &robot.middle())[0], axis, &frames);
        }
        let whole = |frame: &Frame| Target { position: frame.origin, axis: None, frame: frame.axes };
        let targets = if task == asked { path.targets(&task)? } else { frames.iter().map(whole).collect() };
        let pinned = Pinned { robot: &robot, frames: &frames, targets: &targets, asked: &asked, task: &task, volume: goal.volume.as_ref() };
        Ok(Self {
            pins: Pins::new(&pinned, settings)?,
            task,
            asked,
            targets: targets.into(),
            frames: frames.into(),
            length: objective.as_ref().and_then(Objective::length).unwrap_or(1.0),
            objective: objective.filter(|_| aim.has_objective()),
            criterion: if matches!(aim, Aim::Minimax | Aim::Speed) { Criterion::Minimax } else { Criterion::Integral },
            smoothness: if motion_alone { Some(1.0) } else { settings.smoothness },
            joint_weights: JointWeights::new(robot.n(), settings.joint_weights.as_deref())?,
            weights: point_weights(&steps, settings.closed).into(),
            steps: steps.into(),
            bounds: motion_bounds(&robot, path, settings.limits).into(),
            pace: if aim == Aim::Speed { Some(paces(&robot, path)?.into()) } else { None },
            timed: path.time().is_some(),
            limits: settings.limits,
            closed: settings.closed,
            turns: None,
            room: goal.volume.as_ref().map_or_else(Vec::new, room).into(),
            volume: goal.volume.clone(),
            spin: asked.spin_axis().and_then(|axis| settings.spin_range.map(|range| SpinRange { axis, range })),
            robot,
        })
    }

    /// Number of joints.
    pub fn n(&self) -> usize {
        self.robot.n()
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.targets.len()
    }

    /// Freedoms of a point.
    pub fn freedoms(&self) -> usize {
        self.n() - self.task.dimension()
    }

    /// Freedoms of one of its points.
    pub(super) fn freedoms_at(&self, point: usize) -> usize {
        match self.pins.at(point) {
            None => self.freedoms(),
            Some(Fixed { held: Held::Posture(_), .. }) => 0,
            Some(pin) => self.n() - pin.task.dimension(),
        }
    }

    /// The pairs of neighbours.
    pub fn edges(&self) -> usize {
        self.points() - usize::from(self.turns.is_none())
    }

    /// What is asked of the tool.
    pub(super) fn goal(&self) -> Goal {
        Goal { task: self.asked, volume: self.volume.clone() }
    }

    /// Whether the largest of something is minimised.
    pub(super) fn has_ceiling(&self) -> bool {
        self.pace.is_some() || (self.criterion == Criterion::Minimax && self.objective.is_some())
    }

    /// Whether anything bounds the motion from point to point.
    pub(super) fn is_bounded(&self) -> bool {
        self.bounds.iter().any(|bound| bound.is_finite())
    }

    /// Whether what bounds the motion from point to point is a largest step, not the speed of joints.
    pub(super) fn steps_only(&self) -> bool {
        !self.timed && self.is_bounded()
    }

    /// The weight of the motion: as given, or next to nothing beside the values.
    pub(super) fn weight_of_motion(&self, values: impl Iterator<Item = f64>) -> f64 {
        let gentle = match self.criterion {
            _ if self.pace.is_some() => PACED,
            Criterion::Minimax => GENTLE.0,
            Criterion::Integral => GENTLE.1,
        };
        self.smoothness.unwrap_or_else(|| gentle * mean_size(values))
    }

    /// The weight of the motion in a problem that has one.
    pub(super) fn smoothness(&self) -> f64 {
        self.smoothness.unwrap_or(0.0)
    }

    /// The integral of the weighted squared joint speed over the share of the path from point `first` on, along postures.
    pub(super) fn motion_integral(&self, first: usize, q: &[f64]) -> f64 {
        let n = self.n();
        let steps = &self.steps[first..first + q.len() / n - 1];
        let total = sum(steps);
        let square = |i: usize| self.joint_weights.squares(|k| q[(i + 1) * n + k] - q[i * n + k]);
        steps.iter().enumerate().map(|(i, step)| square(i) * (total / step)).sum()
    }

    /// The largest motion of a turning joint from point to point \[rad\], evenly between points whose postures are given.
    pub(super) fn largest_turn(&self, kept: &[usize], q: &[f64]) -> f64 {
        let (n, joints) = (self.n(), self.robot.joints());
        let turn = |(i, (from, to)): (usize, (&f64, &f64))| {
            let span = kept[i / n + 1] - kept[i / n];
            if joints[i % n] == Joint::Revolute { (to - from).abs() / span as f64 } else { 0.0 }
        };
        q.iter().zip(&q[n..]).enumerate().map(turn).fold(0.0, f64::max)
    }

    /// Values of the objective at postures; 0 without one.
    #[inline(never)]
    pub(super) fn values(&self, q: &[f64]) -> Vec<f64> {
        let n = self.n();
        let mut values = vec![0.0; q.len() / n];
        if let Some(objective) = &self.objective {
            let one = |(q, values): (&[f64], &mut [f64])| objective.values_of(&self.robot, q, values);
            if values.len() < PARALLEL {
                one((q, &mut values));
            } else {
                q.par_chunks(CHUNK * n).zip(values.par_chunks_mut(CHUNK)).for_each(one);
            }
        }
        values
    }

    /// What postures of the points from `first` on are worth: their values; where the tool's speed is sought the time that it takes for a metre [s], by the joint
    /// that is slowest on the steps to and from each point.
    pub(super) fn worth(&self, first: usize, q: &[f64]) -> Vec<f64> {
        let Some(pace) = &self.pace else { return self.values(q) };
        let (n, mut worth) = (self.n(), vec![0.0f64; q.len() / self.n()]);
        for (i, ((from, to), pace)) in q.iter().zip(&q[n..]).zip(&pace[first * n..]).enumerate() {
            let share = (to - from).abs() / pace;
            let edge = i / n;
            (worth[edge], worth[edge + 1]) = (worth[edge].max(share), worth[edge + 1].max(share));
        }
        worth
    }

    /// The largest of these; 0 where the tool's speed is not sought.
    pub(super) fn slowest<const C: usize>(&self, q: &[[f64; C]]) -> f64 {
        let (n, pace) = (self.n(), self.pace.as_deref().unwrap_or(&[]));
        pace.iter().enumerate().map(|(i, pace)| self.motion(q, i / n, i % n).abs() / pace).fold(0.0, f64::max)
    }

    /// Brings postures of the points from `first` on onto the path by Newton; tells of each whether it got there.
    #[inline(never)]
    pub(super) fn restored(&self, first: usize, q: &mut [f64]) -> Vec<bool> {
        fn one<const C: usize>(problem: &PathProblem, point: usize, q: &mut [f64]) -> bool {
            problem.reach::<C>(point, q)
        }
        let n = self.n();
        let restore = |(i, q): (usize, &mut [f64])| with_capacity!(n, one(self, first + i, q));
        if q.len() < PARALLEL * n {
            q.chunks_exact_mut(n).enumerate().map(restore).collect()
        } else {
            q.par_chunks_exact_mut(n).enumerate().with_min_len(CHUNK).map(restore).collect()
        }
    }

    /// Puts postures of the points from `first` on onto limits that they are on, as far as they stay on the path.
    pub(super) fn settle(&self, first: usize, q: &mut [f64]) {
        let (n, limits) = (self.n(), self.robot.limits());
        for (i, row) in q.chunks_exact_mut(n).enumerate() {
            let mut there = [0.0; MAX_JOINTS];
            let there = &mut there[..n];
            there.copy_from_slice(row);
            if self.limits && self.pins.posture(first + i).is_none() && limits.settle(there) && *there != *row {
                let (w, v) = self.task.error(&forward::<MAX_JOINTS>(&self.robot, there), &self.targets[first + i]);
                if norm(w).max(norm(v)) <= ON_PATH && self.is_member(first + i, there) {
                    row.copy_from_slice(there);
                }
            }
        }
    }

    /// Whether a posture of a point is within limits and the range of the spin.
    pub(super) fn is_within(&self, point: usize, q: &[f64]) -> bool {
        let in_range = |range: (f64, f64)| {
            let mut row = [0.0; MAX_JOINTS];
            row[..q.len()].copy_from_slice(q);
            let spin = self.spin(point, &row);
            spin >= range.0 - AT_LIMIT && spin <= range.1 + AT_LIMIT
        };
        (!self.limits || self.robot.limits().contain(q)) && self.is_member(point, q) && self.spin.is_none_or(|spin| in_range(spin.range))
    }

    /// Whether postures of the points from `first` on are within all bounds.
    pub(super) fn holds(&self, first: usize, q: &[f64]) -> bool {
        let n = self.n();
        let steps = q.iter().zip(&q[n..]).zip(&self.bounds[first * n..]);
        q.chunks_exact(n).enumerate().all(|(i, row)| self.is_within(first + i, row))
            && steps.into_iter().all(|((from, to), bound)| (to - from).abs() <= *bound)
    }

    /// Brings a posture onto a target, or to what is held there; whether it got there.
    pub(super) fn reach<const C: usize>(&self, point: usize, q: &mut [f64]) -> bool {
        if let Some(held) = self.pins.posture(point) {
            q.copy_from_slice(held);
            return true;
        }
        let (task, target) = self.wanted(point);
        reach_sized::<C>(&self.robot, None, task, target, self.length, q, RESTORED, RETURN_ITERATIONS).error <= ON_PATH
    }

    /// What is asked of the tool at a point.
    #[inline]
    pub(super) fn wanted(&self, point: usize) -> (&Task, &Target) {
        self.pins.at(point).map_or((&self.task, &self.targets[point]), |pin| (&pin.task, &pin.target))
    }

    /// The spin at a point, within half a turn of the middle of its range; 0 where it has none.
    pub(super) fn spin<const C: usize>(&self, point: usize, q: &[f64; C]) -> f64 {
        let n = size::<C>(self.n());
        self.spin.map_or(0.0, |spin| spin.of(&self.frames[point], &forward::<C>(&self.robot, &q[..n])))
    }

    /// The same of a posture, with the range.
    pub(super) fn spin_of(&self, point: usize, q: &[f64]) -> (f64, (f64, f64)) {
        let turn = |spin: SpinRange| (spin.of(&self.frames[point], &forward::<MAX_JOINTS>(&self.robot, q)), spin.range);
        self.spin.map_or((0.0, (0.0, 0.0)), turn)
    }

    /// The bounds of the volume that is asked for at a posture; none without one.
    pub(super) fn sides_of(&self, point: usize, tool: &Frame) -> Option<Sides> {
        self.volume.as_ref().map(|volume| volume.sides(&self.frames[point].axes, &tool.axes))
    }

    /// Whether a posture is a member of the volume that is asked for.
    pub(super) fn is_member(&self, point: usize, q: &[f64]) -> bool {
        self.outside(point, q) <= MEMBER
    }

    /// How far the tool of a posture is outside that volume \[rad\].
    pub(super) fn outside(&self, point: usize, q: &[f64]) -> f64 {
        let tool = || forward::<MAX_JOINTS>(&self.robot, q);
        self.volume.as_ref().map_or(0.0, |volume| outside(volume, &self.frames[point], &tool()))
    }

    /// Distances [m] and angles [rad] of postures of the points from 0 on to the path.
    #[inline(never)]
    pub(super) fn errors(&self, q: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let error = |(tool, frame): (&Frame, &Frame)| {
            let (w, v) = self.asked.error(tool, &Target { position: frame.origin, axis: None, frame: frame.axes });
            (norm(v), self.volume.as_ref().map_or_else(|| norm(w), |volume| outside(volume, frame, tool)))
        };
        tools(&self.robot, q).iter().zip(&self.frames[..]).map(error).unzip()
    }
}

impl SpinRange {
    /// The spin of a tool against a frame, within half a turn of the middle of the range.
    fn of(&self, frame: &Frame, tool: &Frame) -> f64 {
        nearest_turn(spin(frame, tool, self.axis), 0.5 * (self.range.0 + self.range.1))
    }
}

/// The largest joint motions from each point to the next, n a step: infinite without times.
fn motion_bounds(robot: &Robot, path: &Path, limits: bool) -> Vec<f64> {
    match path.time().filter(|_| limits) {
        None => vec![f64::INFINITY; (path.len() - 1) * robot.n()],
        Some(time) => {
            let speeds = &robot.limits().qd_max;
            time.windows(2).flat_map(|pair| speeds.iter().map(move |speed| BELOW_SPEED * (pair[1] - pair[0]) * speed)).collect()
        }
    }
}

/// How far joints move from each point to the next while the tool takes a second for a metre [rad or m], n a step.
fn paces(robot: &Robot, path: &Path) -> Result<Vec<f64>> {
    let speeds = &robot.limits().qd_max;
    if speeds.iter().all(|speed| speed.is_infinite()) {
        return Err(Error::value("criterion", "'speed' for a robot without speed limits", "limits qd_max of some joints"));
    }
    let position = path.position();
    let lengths: Vec<f64> = position.windows(2).map(|pair| norm(sub(pair[1], pair[0]))).collect();
    if lengths.iter().all(|length| *length <= 0.0) {
        return Err(Error::value("criterion", "'speed' for a path without length", "one whose points are not all at one place"));
    }
    // A tool that stands has all the time that it takes.
    let pace = |length: f64, speed: f64| if length > 0.0 { length * speed } else { f64::INFINITY };
    Ok(lengths.iter().flat_map(|length| speeds.iter().map(move |speed| pace(*length, *speed))).collect())
}

/// Whether a volume can be planned for.
fn check_volume(volume: &OrientationVolume, axial: &Task, robot: &Robot, settings: &PlanSettings) -> Result<()> {
    members::check(volume)?;
    if settings.spin_range.is_some() {
        return Err(Error::value("spin_range", "given beside an orientation volume", "the volume's own spin"));
    }
    if axial.suited(robot) != *axial || axial.rank(robot) < axial.dimension() {
        let given = format!("an orientation volume for the joints '{}'", robot.joint_letters());
        return Err(Error::value("task", given, "joints that point the tool where it is told"));
    }
    Ok(())
}

/// Part of the way from the bounds of a volume to its middle that a refinement starts from.
const INSIDE: f64 = 0.1;

/// That part of the way for each bound.
fn room(volume: &OrientationVolume) -> Vec<f64> {
    let sides = volume.sides(&Frame::IDENTITY.axes, &members::middle(volume).axes());
    sides.as_slice().iter().map(|side| INSIDE * side.slack).collect()
}
