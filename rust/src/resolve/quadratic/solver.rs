//! The programme of a tick, and how it ended.

use std::sync::Arc;

use super::bounds::rate_interval;
use super::index_term::{Derivatives, Form, IndexMemory, IndexTerm};
use super::programme::{self, Constraints, solve, solve_opened};
use crate::error::{Error, Result, check_finite, check_positive};
use crate::index::Objective;
use crate::kinematics::sized::jacobian;
use crate::linalg::vector::halves;
use crate::linalg::{MAX_JOINTS, Row6, Rows6, size};
use crate::optimize::qp::{ActiveSet, Constraint, Place, Row, Status};
use crate::robot::Robot;
use crate::task::Task;

/// Rows of a programme at most, those of the deviation included.
pub const MAX_ROWS: usize = 64;
/// Rows of a tick's own at most.
pub const MAX_OWN_ROWS: usize = 32;
/// Components of a twist beyond this [m/s] are cut: no robot is as fast, and squares stay finite.
const FASTEST: f64 = 1e9;
/// Weight of the squared deviation, beside weights of rates of about 1, where its largest value is out of reach.
const STIFFEST: f64 = 1e7;
/// A row fails when it does by more than this, relative to what it is made of.
const FAILS: f64 = 1e-9;
/// Rates this near to a bound, relative, are at it.
const AT_BOUND: f64 = 1e-9;

/// Settings of [`QuadraticSolver`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticSettings {
    /// Length that weighs angular deviations against linear ones [m].
    pub length: f64,
    /// Length of a tick [s].
    pub dt: f64,
    /// Weight of each joint's squared rate (Q).
    pub rate_weights: [f64; MAX_JOINTS],
    /// Weight of the squared deviation (Q_delta) where a tick does not say.
    pub stiffness: f64,
    /// Largest angular [rad/s] and linear [m/s] deviation, a component; infinite for none.
    pub largest_deviation: (f64, f64),
    /// Whether limits of position, speed and acceleration hold.
    pub limits: bool,
    /// Deviation, as a part of the twist, up to which the task counts as kept.
    pub tolerance: f64,
}

impl QuadraticSettings {
    fn check(&self, n: usize) -> Result<()> {
        for (name, value) in [("length", self.length), ("dt", self.dt), ("stiffness", self.stiffness), ("tolerance", self.tolerance)] {
            check_positive(name, value)?;
        }
        for weight in &self.rate_weights[..n] {
            check_positive("rate_weights", *weight)?;
        }
        for value in [self.largest_deviation.0, self.largest_deviation.1] {
            if value.is_nan() || value < 0.0 {
                return Err(Error::value("largest_deviation", value, "a number of at least 0"));
            }
        }
        Ok(())
    }
}

/// How a tick ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuadraticStatus {
    /// The task is kept.
    Solved,
    /// The task gives way to rows or to the worth of the index; the deviation says by how much.
    Relaxed,
    /// The task gives way to limits of joints.
    Limited,
    /// Rows exclude each other or the limits: all of them give way by as little as can be, and the largest deviation does not count.
    Infeasible,
    /// The printed form is not convex: the index is left out.
    NotConvex,
}

/// What a tick asks for.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a, const C: usize> {
    /// Posture.
    pub q: &'a [f64],
    /// Twist of the tool [omega; v].
    pub twist: Row6,
    /// Weight of the squared deviation.
    pub stiffness: f64,
    /// `lower <= a'qd <= upper`.
    pub rows: &'a [Row<C>],
}

/// What came of a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub status: QuadraticStatus,
    /// The part of the twist that is not followed [omega; v].
    pub deviation: Row6,
    /// Rows that fail, one bit a row.
    pub failed: u64,
    /// Whether the largest deviation is exceeded, by little.
    pub beyond_deviation: bool,
    /// Whether the index could be evaluated, with numbers that the programme can hold.
    pub conditioned: bool,
    /// Constraints that the programme added or dropped.
    pub changes: usize,
}

/// What is remembered from tick to tick.
#[derive(Debug, Clone, Copy)]
pub struct QuadraticMemory {
    /// Rates of the tick before, if there was one.
    pub rates: Option<[f64; MAX_JOINTS]>,
    index: IndexMemory,
    active: ([Constraint; MAX_JOINTS], usize),
}

impl Default for QuadraticMemory {
    fn default() -> Self {
        let none = Constraint { place: Place::Bound(0), side: crate::optimize::qp::Side::Lower };
        Self { rates: None, index: IndexMemory::default(), active: ([none; MAX_JOINTS], 0) }
    }
}

impl QuadraticMemory {
    fn start<const C: usize>(&self) -> ActiveSet<C> {
        let mut out = ActiveSet::default();
        for item in &self.active.0[..self.active.1] {
            out.push(*item);
        }
        out
    }

    fn keep<const C: usize>(&mut self, active: &ActiveSet<C>) {
        let items = active.as_slice();
        self.active.0[..items.len()].copy_from_slice(items);
        self.active.1 = items.len();
    }
}

/// A robot, a task and what counts beside it.
#[derive(Debug, Clone)]
pub struct QuadraticSolver {
    robot: Arc<Robot>,
    task: Task,
    term: Option<IndexTerm>,
    settings: QuadraticSettings,
}

/// The task at a posture.
struct TaskRows<const C: usize> {
    rows: Rows6<C>,
    wanted: Row6,
    dimension: usize,
    angular: usize,
}

impl QuadraticSolver {
    /// A solver; `index` is minimised with a weight of at least 0.
    pub fn new(
        robot: Arc<Robot>,
        task: Task,
        index: Option<(Objective, f64)>,
        form: Form,
        derivatives: Derivatives,
        settings: QuadraticSettings,
    ) -> Result<Self> {
        settings.check(robot.n())?;
        derivatives.check()?;
        if let Some((objective, weight)) = &index {
            objective.check(&robot)?;
            check_finite("weight", &[*weight])?;
            if *weight < 0.0 {
                return Err(Error::value("weight", weight, "a number of at least 0"));
            }
        }
        let term = index.map(|(objective, weight)| IndexTerm { objective, weight, form, derivatives });
        Ok(Self { robot, task, term, settings })
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// The task.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The settings.
    pub fn settings(&self) -> &QuadraticSettings {
        &self.settings
    }

    /// The objective.
    pub fn objective(&self) -> Option<&Objective> {
        self.term.as_ref().map(|term| &term.objective)
    }

    /// The same programme with other limits and settings.
    pub(super) fn for_motions(&self, robot: Robot, settings: QuadraticSettings) -> Result<Self> {
        settings.check(robot.n())?;
        Ok(Self { robot: Arc::new(robot), settings, ..self.clone() })
    }

    /// Joint rates of one tick: always finite and within the limits of joints. The deviation from the task gives way before rows do.
    #[inline(never)]
    pub fn step<const C: usize>(&self, tick: &Tick<'_, C>, memory: &mut QuadraticMemory, rates: &mut [f64]) -> Outcome {
        let n = size::<C>(self.robot.n()).min(rates.len());
        let (tool, columns) = jacobian::<C>(&self.robot, tick.q);
        let directions = self.task.directions(&tool, self.settings.length);
        let (w, v) = halves(&tick.twist);
        let task = TaskRows {
            rows: directions.rows(&columns),
            wanted: directions.reduce(w, v).map(|x| x.clamp(-FASTEST, FASTEST)),
            dimension: directions.dimension(),
            angular: self.task.angular.dimension(),
        };
        let mut plain = programme::Form::<C>::of_rates(&self.settings.rate_weights[..n]);
        let (mut form, dt) = (plain, self.settings.dt);
        let conditioned = self.term.as_ref().is_none_or(|term| term.add(&self.robot, tick.q, &columns, dt, &mut memory.index, &mut form));
        for form in [&mut form, &mut plain] {
            form.add_deviation(tick.stiffness, &task.rows, &task.wanted, task.dimension);
        }
        let (lower, upper) = self.bounds::<C>(tick.q, memory.rates.as_ref());
        let mut buffer = [Row { a: [0.0; C], lower: f64::NEG_INFINITY, upper: f64::INFINITY }; MAX_ROWS];
        let (hard, all) = self.gather(tick, &task, &mut buffer);
        let answer = answer(&[form, plain], &Constraints { lower: &lower, upper: &upper, rows: &buffer[..all] }, hard, &task, n, memory);
        for i in 0..n {
            // Numbers near the largest there are can overflow on the way: such a joint stands still if it may.
            rates[i] = if answer.x[i].is_finite() { answer.x[i] } else { 0.0 }.clamp(lower[i], upper[i]);
        }
        memory.rates = Some(std::array::from_fn(|i| rates.get(i).copied().unwrap_or(0.0)));
        let printed = self.term.as_ref().is_some_and(|term| term.form == Form::Printed);
        let held = (0..n).any(|i| near(rates[i], lower[i]) || near(rates[i], upper[i]));
        let (deviation, kept) = self.deviation(&task, &rates[..n]);
        let (w, v) = directions.motion_of(&deviation);
        Outcome {
            status: match (kept, held) {
                _ if answer.infeasible => QuadraticStatus::Infeasible,
                _ if printed && answer.without_index == Some(Status::NotConvex) => QuadraticStatus::NotConvex,
                (true, _) => QuadraticStatus::Solved,
                (false, true) => QuadraticStatus::Limited,
                (false, false) => QuadraticStatus::Relaxed,
            },
            deviation: [w[0], w[1], w[2], v[0], v[1], v[2]],
            failed: failed(&buffer[..hard], rates),
            beyond_deviation: answer.beyond_deviation,
            // Beside a singularity an index can outweigh all else, or its squares overflow, whatever its form.
            conditioned: conditioned && (printed || answer.without_index.is_none()),
            changes: answer.changes,
        }
    }

    fn bounds<const C: usize>(&self, q: &[f64], before: Option<&[f64; MAX_JOINTS]>) -> ([f64; C], [f64; C]) {
        let (mut lower, mut upper) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C]);
        if self.settings.limits {
            for i in 0..q.len().min(C) {
                (lower[i], upper[i]) = rate_interval(self.robot.limits(), i, q[i], self.settings.dt, before.map(|rates| rates[i]));
            }
        }
        (lower, upper)
    }

    /// The rows of the tick, then those of the largest deviation; how many are of the tick, and how many there are.
    fn gather<const C: usize>(&self, tick: &Tick<'_, C>, task: &TaskRows<C>, buffer: &mut [Row<C>; MAX_ROWS]) -> (usize, usize) {
        let hard = tick.rows.len().min(MAX_ROWS - 6);
        buffer[..hard].copy_from_slice(&tick.rows[..hard]);
        let mut all = hard;
        for r in 0..task.dimension {
            let (angular, linear) = self.settings.largest_deviation;
            let most = if r < task.angular { self.settings.length * angular } else { linear };
            if most.is_finite() {
                buffer[all] = Row { a: task.rows[r], lower: task.wanted[r] - most, upper: task.wanted[r] + most };
                all += 1;
            }
        }
        (hard, all)
    }

    /// What is left of the twist, component by component (angular ones in rad/s), and whether that is little.
    fn deviation<const C: usize>(&self, task: &TaskRows<C>, rates: &[f64]) -> (Row6, bool) {
        let (mut out, mut left, mut whole) = ([0.0; 6], 0.0, 0.0);
        for r in 0..task.dimension {
            let followed: f64 = task.rows[r].iter().zip(rates).map(|(a, x)| a * x).sum();
            out[r] = task.wanted[r] - followed;
            left += out[r] * out[r];
            whole += task.wanted[r] * task.wanted[r];
            if r < task.angular {
                out[r] /= self.settings.length;
            }
        }
        (out, left.sqrt() <= self.settings.tolerance * whole.sqrt().max(self.settings.tolerance))
    }
}

/// Rates, whether the rows or the index had to be left out, and how often the programme changed its mind.
struct Answer<const C: usize> {
    x: [f64; C],
    infeasible: bool,
    beyond_deviation: bool,
    without_index: Option<Status>,
    changes: usize,
}

/// Solves the first form, or the second where that is not convex. The rows from `hard` on give way first, then all of them.
fn answer<const C: usize>(
    forms: &[programme::Form<C>; 2],
    at: &Constraints<'_, C>,
    hard: usize,
    task: &TaskRows<C>,
    n: usize,
    memory: &mut QuadraticMemory,
) -> Answer<C> {
    let [mut form, plain] = *forms;
    let mut found = solve(&form, at, n, &memory.start());
    let without_index = matches!(found.status, Status::NotConvex | Status::Undefined).then_some(found.status);
    if without_index.is_some() {
        form = plain;
        found = solve(&form, at, n, &ActiveSet::default());
    }
    let mut beyond_deviation = false;
    let own = Constraints { rows: &at.rows[..hard], ..*at };
    if found.status != Status::Solved && at.rows.len() > hard {
        // The largest deviation is out of reach: what counts now is to exceed it by little.
        form.add_deviation(STIFFEST, &task.rows, &task.wanted, task.dimension);
        found = solve(&form, &own, n, &ActiveSet::default());
        beyond_deviation = found.status == Status::Solved;
    }
    let infeasible = found.status != Status::Solved;
    if infeasible {
        found.x = solve_opened(&form, &own, n).unwrap_or([0.0; C]);
    } else {
        memory.keep(&found.active);
    }
    Answer { x: found.x, infeasible, beyond_deviation, without_index, changes: found.changes }
}

fn near(x: f64, bound: f64) -> bool {
    bound.is_finite() && (x - bound).abs() <= AT_BOUND * bound.abs().max(AT_BOUND)
}

/// The rows that do not hold.
fn failed<const C: usize>(rows: &[Row<C>], rates: &[f64]) -> u64 {
    let mut out = 0;
    for (k, row) in rows.iter().enumerate() {
        let (mut value, mut size) = (0.0, 0.0);
        for (a, x) in row.a.iter().zip(rates) {
            value += a * x;
            size += (a * x).abs();
        }
        if value < row.lower - FAILS * (size + row.lower.abs()) || value > row.upper + FAILS * (size + row.upper.abs()) {
            out |= 1 << k;
        }
    }
    out
}
