//! The orthogonal SQP as an object: its settings and its closed-loop rate step.

mod constraint;
mod pressed;
pub(crate) mod reduce;
mod solve;
mod step;

use std::sync::Arc;

use super::StepStatus;
use super::bounds::{coupled_rows, speed_bounds};
use super::coupled::keep_combinations;
use super::inside::{Inside, PathFrame, check_volume};
use super::keep_inside::{Asking, keep_inside};
use crate::error::{Error, Result, check_positive};
use crate::index::{Objective, Order};
use crate::kinematics::sized::{Jacobian, jacobian, jacobian_apart};
use crate::linalg::frame::Frame;
use crate::linalg::vector::halves;
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, Row6};
use crate::qp::DenseRow;
use crate::resolve::nearest::{Asked, UNDONE, bends_little};
use crate::robot::{Limits, MAX_COMBINATIONS, Robot};
use crate::task::volume::{MAX_SIDES, OrientationVolume};
use crate::task::{Constraint, Task};
pub use constraint::ConstraintAt;
pub use solve::Iteration;
pub(super) use step::{Bounds, Known, NewtonStep, newton_step};

/// Largest free motion of a joint in one step [rad or m].
pub(super) const RADIUS: f64 = 0.3;

/// Damping of a tick that cannot follow its task, as a part of the squared size of the task's Jacobian.
const DAMPING: f64 = 1e-8;

/// Rows of a step at most: of combinations of joints, and the bounds of a volume.
pub(super) const MAX_STEP_ROWS: usize = MAX_COMBINATIONS + MAX_SIDES;

/// Settings of [`OrthogonalSqp`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SqpSettings {
    /// Distance of the two points of the tool, which weighs angles against distances \[m\].
    pub length: f64,
    /// Whether the exact Hessian of the objective is used, or BFGS updates of it (3.51a) from the exact one at the start.
    pub exact_hessian: bool,
    /// Rate at which `step` closes the distance to the objective's minimum [1/s].
    pub gain: f64,
    /// Length of a control tick \[s\].
    pub dt: f64,
    /// Whether joint limits (and in `step`, speed limits) hold.
    pub limits: bool,
    /// Error at which a target counts as reached: rad, and m over the length.
    pub tolerance: f64,
    /// Iterations of one solution.
    pub max_iterations: usize,
}

impl Default for SqpSettings {
    fn default() -> Self {
        Self { length: 1.0, exact_hessian: true, gain: 10.0, dt: 1e-3, limits: true, tolerance: 1e-12, max_iterations: 100 }
    }
}

impl SqpSettings {
    /// Checks every setting.
    pub fn check(&self) -> Result<()> {
        for (name, value) in [("length", self.length), ("dt", self.dt), ("tolerance", self.tolerance)] {
            check_positive(name, value)?;
        }
        if !(self.gain >= 0.0 && self.gain.is_finite()) {
            return Err(Error::value("gain", self.gain, "a finite number of at least 0"));
        }
        if self.max_iterations == 0 {
            return Err(Error::value("max_iterations", 0, "at least 1"));
        }
        Ok(())
    }
}

/// Resolves the redundancy of a robot for a task by sequential quadratic programming in the null space of the task.
#[derive(Debug, Clone)]
pub struct OrthogonalSqp {
    pub(super) robot: Arc<Robot>,
    pub(super) task: Task,
    pub(super) objective: Objective,
    pub(super) settings: SqpSettings,
    pub(super) volume: Option<Box<OrientationVolume>>,
}

impl OrthogonalSqp {
    /// A solver; the robot needs as many joints as the task has dimensions.
    pub fn new(robot: Arc<Robot>, task: Task, objective: Objective, settings: SqpSettings) -> Result<Self> {
        settings.check()?;
        objective.check(&robot)?;
        if robot.n() < task.dimension() {
            return Err(Error::value(
                "robot",
                format!("a robot of {} joints", robot.n()),
                &format!("at least {} joints, the dimension of the task", task.dimension()),
            ));
        }
        Ok(Self { robot, task, objective, settings, volume: None })
    }

    /// The same with a volume that the tool's orientation, about the target's, has to be in; the task is the position.
    pub fn within_volume(mut self, volume: OrientationVolume) -> Result<Self> {
        check_volume(&volume, &self.task)?;
        self.volume = Some(Box::new(volume));
        Ok(self)
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// The task.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The objective.
    pub fn objective(&self) -> &Objective {
        &self.objective
    }

    /// The settings.
    pub fn settings(&self) -> &SqpSettings {
        &self.settings
    }

    /// Joint rates for a desired twist of the tool (4.20): the components that matter are followed exactly, the objective falls in the free
    /// motion, position and speed limits hold. Feedback, if any, is part of the twist. Never NaN, never beyond the limits; no allocation.
    /// To arrays of another size than the robot the answer is to stand still, as at a limit.
    pub fn step(&self, q: &[f64], twist: &Row6, rates: &mut [f64]) -> StepStatus {
        self.step_about(q, twist, None, rates)
    }

    /// The same with the tool kept in the volume about the path's frame, the position first; the objective falls as far as the bounds let it.
    pub fn step_about(&self, q: &[f64], twist: &Row6, frame: Option<&PathFrame>, rates: &mut [f64]) -> StepStatus {
        if q.len() != self.robot.n() || rates.len() != q.len() {
            rates.fill(0.0);
            return StepStatus::Limited;
        }
        with_capacity!(self.robot.n(), step(self, q, twist, frame, rates))
    }

    /// Writes the bounds of the volume as rows of motions in a tick of length `dt`; how many there are.
    #[cold]
    #[inline(never)]
    pub(super) fn side_rows<const C: usize>(
        &self,
        frame: &PathFrame,
        at: (&Frame, &Jacobian<C>),
        dt: f64,
        rows: &mut [DenseRow<C>],
    ) -> usize {
        let Some(volume) = &self.volume else { return 0 };
        let inside = Inside::new(volume, frame, at.0, dt);
        inside.write(at, &[0.0; C], dt, rows);
        for row in rows.iter_mut().take(inside.count) {
            (row.lower, row.upper) = (dt * row.lower, dt * row.upper);
        }
        inside.count
    }

    /// The motion that brings the tool nearest, and whether limits hold it, where a step leads elsewhere, as in front of a goal out of reach. The free
    /// motion alone may lead the tool aside by little, which the next tick makes up for: what counts is the part for the task. In the room for the
    /// largest robots, so that no size has machine code of its own.
    #[cold]
    #[inline(never)]
    fn rest(
        &self,
        q: &[f64],
        wanted: &Row6,
        low: &[f64; MAX_JOINTS],
        high: &[f64; MAX_JOINTS],
        step: &[f64; MAX_JOINTS],
        task: &[f64; MAX_JOINTS],
    ) -> Option<([f64; MAX_JOINTS], bool)> {
        let (tool, jacobian) = jacobian_apart::<MAX_JOINTS>(&self.robot, q);
        let directions = self.task.directions(&tool, self.settings.length);
        let rows = directions.rows(&jacobian);
        let asked = Asked { jacobian: &jacobian, directions: &directions, rows: &rows, wanted, weighed: wanted };
        if asked.goes_astray(step, &[1.0; MAX_JOINTS], UNDONE) && asked.goes_astray(task, &[1.0; MAX_JOINTS], UNDONE) {
            asked.nearest(low, high, DAMPING)
        } else {
            None
        }
    }

    /// Writes the rows of combinations in motions from `q`, the room to their limits; how many there are.
    #[cold]
    #[inline(never)]
    pub(super) fn rows_around<const C: usize>(&self, q: &[f64], rows: &mut [DenseRow<C>]) -> usize {
        let coupled = &self.robot.limits().coupled;
        for (row, it) in rows.iter_mut().zip(coupled) {
            row.a[..q.len()].copy_from_slice(&it.row);
            (row.lower, row.upper) = it.room(q);
        }
        coupled.len()
    }

    /// The room to the position limits around `q`; a joint outside may only come back.
    #[inline(always)]
    pub(super) fn box_around<const C: usize>(&self, q: &[f64]) -> ([f64; C], [f64; C]) {
        let (mut low, mut high) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C]);
        if self.settings.limits {
            let limits = self.robot.limits();
            for i in 0..q.len() {
                low[i] = (limits.q_min[i] - q[i]).min(0.0);
                high[i] = (limits.q_max[i] - q[i]).max(0.0);
            }
        }
        (low, high)
    }
}

/// A tick within all limits, and within the volume about the path's frame.
#[inline(never)]
fn step<const C: usize>(solver: &OrthogonalSqp, q: &[f64], twist: &Row6, frame: Option<&PathFrame>, rates: &mut [f64]) -> StepStatus {
    let (robot, SqpSettings { length, dt, limits, .. }) = (&*solver.robot, solver.settings);
    let (tool, columns) = jacobian::<C>(robot, q);
    let at = (&tool, &columns);
    let mut status = tick(solver, at, q, twist, frame, rates);
    if limits && !robot.limits().coupled.is_empty() {
        status = keep_combinations(robot, &solver.task, length, q, dt, rates).over(status);
    }
    match (&solver.volume, frame) {
        (Some(volume), Some(frame)) => keep_inside(&Asking { robot, q, dt, limits, before: &[] }, volume, frame, at, rates).over(status),
        _ => status,
    }
}

/// A tick with the bounds of the volume linear about its start.
#[inline(always)]
fn tick<const C: usize>(
    solver: &OrthogonalSqp,
    (tool, columns): (&Frame, &Jacobian<'_, C>),
    q: &[f64],
    twist: &Row6,
    frame: Option<&PathFrame>,
    rates: &mut [f64],
) -> StepStatus {
    let n = solver.robot.n();
    let SqpSettings { length, dt, gain, limits, .. } = solver.settings;
    let directions = solver.task.directions(tool, length);
    let (w, v) = halves(twist);
    let wanted = directions.reduce(w, v).map(|x| dt * x);
    let objective = solver.objective.evaluate_at(&solver.robot, q, columns, Order::Hessian, false);
    let known = Known { jacobian: columns, objective: &objective, constraint: &Constraint::of(&directions), turning: None, wanted };
    let (mut low, mut high, mut returning) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C], false);
    let (mut room, mut count) = (None, 0);
    if limits {
        returning = speed_bounds(solver.robot.limits(), q, dt, &mut low, &mut high);
        if !solver.robot.limits().coupled.is_empty() {
            count = coupled_steps(solver.robot.limits(), q, dt, (&low, &high), room.get_or_insert([DenseRow::OPEN; MAX_STEP_ROWS]));
        }
        (low, high) = (low.map(|x| dt * x), high.map(|x| dt * x));
    }
    if let (Some(frame), true) = (frame, solver.volume.is_some()) {
        let room = room.get_or_insert([DenseRow::OPEN; MAX_STEP_ROWS]);
        count += solver.side_rows(frame, (tool, columns), dt, &mut room[count..]);
    }
    let rows = room.as_ref().map_or(&[][..], |room| &room[..count]);
    let fraction = (gain * dt).min(1.0);
    let bounds = Bounds { low, high, rows, radius: RADIUS * fraction, gain: fraction };
    let mut step = newton_step(&known, &bounds);
    if step.status == StepStatus::Regular && bends_little(solver.robot.arm(), columns, &directions, &step.dq, 1.0, &wanted) {
        return write(&step, returning, dt, rates);
    }
    let (low, high) = (wide(&low, f64::NEG_INFINITY), wide(&high, f64::INFINITY));
    if let Some((dq, held)) = solver.rest(q, &wanted, &low, &high, &wide(&step.dq, 0.0), &wide(&step.task_within(&bounds, n), 0.0)) {
        step.dq = std::array::from_fn(|i| dq.get(i).copied().unwrap_or(0.0));
        step.status = if held { StepStatus::Limited } else { StepStatus::Damped };
    }
    write(&step, returning, dt, rates)
}

/// Writes the rows of combinations in motions of a tick, by bounds of the rates of joints; how many there are.
#[cold]
#[inline(never)]
fn coupled_steps<const C: usize>(
    limits: &Limits,
    q: &[f64],
    dt: f64,
    (low, high): (&[f64; C], &[f64; C]),
    rows: &mut [DenseRow<C>],
) -> usize {
    let (count, _) = coupled_rows(limits, q, dt, low, high, rows);
    for row in &mut rows[..count] {
        (row.lower, row.upper) = (dt * row.lower, dt * row.upper);
    }
    count
}

/// Numbers of the joints in the room for the largest robots, with `rest` beyond them.
fn wide<const C: usize>(numbers: &[f64; C], rest: f64) -> [f64; MAX_JOINTS] {
    std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(rest))
}

/// Writes a step as rates, and says how it came about.
#[inline(always)]
fn write<const C: usize>(step: &NewtonStep<C>, returning: bool, dt: f64, rates: &mut [f64]) -> StepStatus {
    for (rate, dq) in rates.iter_mut().zip(&step.dq) {
        *rate = (dq / dt).clamp(f64::MIN, f64::MAX);
    }
    if returning { StepStatus::Returning } else { step.status }
}
