//! The programme of a tick, and how it ended.

use std::ops::Range;
use std::sync::Arc;

use super::general::{General, combined, twists_of};
use super::index_term::{Derivatives, IndexForm, IndexTerm};
use super::programme::{Constraints, Cost, solve, solve_opened};
use super::settings::{Outcome, QuadraticMemory, QuadraticSettings, QuadraticStatus, Tick};
use crate::error::{Error, Result, check_finite};
use crate::index::Objective;
use crate::kinematics::sized::{Jacobian, jacobian};
use crate::linalg::frame::Frame;
use crate::linalg::vector::halves;
use crate::linalg::with_capacity;
use crate::linalg::{MAX_JOINTS, Row6, Rows6, size};
use crate::qp::{ActiveSet, DenseRow, Minimum, Place, Status};
use crate::resolve::bounds::{coupled_rows, rate_interval};
use crate::resolve::coupled::keep_combinations;
use crate::resolve::inside::{Inside, Step, check_volume};
use crate::robot::{AT_LIMIT, MAX_COMBINATIONS, Robot};
use crate::task::volume::{MAX_SIDES, OrientationVolume};
use crate::task::{Directions, Task};

/// Rows of a programme at most, those of the deviation included.
pub(super) const MAX_ROWS: usize = 78;
/// Rows of a tick's own at most.
pub const MAX_OWN_ROWS: usize = 32;
/// Rows of a programme that asks for no more than the largest deviation and a little: its buffer is small.
const FEW_ROWS: usize = 8;
/// Part of what a component of the deviation is the difference of, below which it is rounding, and counts as nothing.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Deviations below this [m/s] may be rounding: larger ones are not looked at for it.
const TINY: f64 = 1e-9;
/// Components of a twist beyond this [m/s] are cut: no robot is as fast, and squares stay finite.
const FASTEST: f64 = 1e9;
/// Weight of the squared deviation, beside weights of rates of about 1, where its largest value is out of reach.
const STIFFEST: f64 = 1e7;
/// A row fails when it does by more than this, relative to what it is made of.
const FAILS: f64 = 1e-9;

/// A robot, a task and what counts beside it.
#[derive(Debug, Clone)]
pub struct QuadraticSolver {
    pub(super) robot: Arc<Robot>,
    pub(super) task: Task,
    term: Option<IndexTerm>,
    settings: QuadraticSettings,
    /// What is more than one number; apart, as few have it.
    pub(super) general: Option<Box<General>>,
    /// The volume of orientations that is part of the task.
    pub(super) volume: Option<Box<OrientationVolume>>,
}

/// Least and greatest rates.
#[derive(Clone, Copy)]
pub(super) struct RateBounds<const C: usize> {
    pub lower: [f64; C],
    pub upper: [f64; C],
    /// Whether the rates of the tick before bound them: joints need room to brake.
    pub brakes: bool,
    /// Whether a joint is beyond a limit of position, and has to come back.
    pub returning: bool,
    /// Whether limits of jerk count.
    pub jerks: bool,
}

/// The programme of a tick but for its rows.
#[derive(Clone, Copy)]
pub(super) struct Programme<'a, const C: usize> {
    pub tick: &'a Tick<'a>,
    pub n: usize,
    pub cost: Cost<C>,
    pub bounds: &'a RateBounds<C>,
    pub directions: Directions,
    /// The task at the posture.
    pub rows: Rows6<C>,
    pub wanted: Row6,
    /// Whether the index could be evaluated.
    pub conditioned: bool,
    /// The bounds of a volume.
    pub inside: Option<&'a Inside<'a>>,
    pub tool: &'a Frame,
    pub jacobian: &'a Jacobian<'a, C>,
    pub dt: f64,
}

impl QuadraticSolver {
    /// A solver; `index` is minimised with a weight of at least 0.
    pub fn new(
        robot: Arc<Robot>,
        task: Task,
        index: Option<(Objective, f64)>,
        form: IndexForm,
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
        Ok(Self { robot, task, term, settings, general: None, volume: None })
    }

    /// The same with a volume that the tool's orientation, about the path's, has to be in; the task is the position.
    pub fn within_volume(mut self, volume: OrientationVolume) -> Result<Self> {
        check_volume(&volume, &self.task)?;
        self.volume = Some(Box::new(volume));
        Ok(self)
    }

    /// The settings.
    pub fn settings(&self) -> &QuadraticSettings {
        &self.settings
    }

    /// The objective.
    pub fn objective(&self) -> Option<&Objective> {
        self.term.as_ref().map(|term| &term.objective)
    }

    /// Joint rates of one tick: always finite and within the limits of joints. The deviation from the task gives way before rows do. No allocation.
    /// To arrays of another size than the robot the answer is to stand still, as infeasible.
    pub fn step(&self, tick: &Tick<'_>, memory: &mut QuadraticMemory, rates: &mut [f64]) -> Outcome {
        if tick.q.len() != self.robot.n() || rates.len() != tick.q.len() {
            rates.fill(0.0);
            return Outcome { status: QuadraticStatus::Infeasible, ..Outcome::default() };
        }
        with_capacity!(self.robot.n(), step(self, tick, memory, rates))
    }

    fn bounds<const C: usize>(&self, q: &[f64], memory: &QuadraticMemory) -> RateBounds<C> {
        let mut out =
            RateBounds { lower: [f64::NEG_INFINITY; C], upper: [f64::INFINITY; C], returning: false, brakes: false, jerks: false };
        if self.settings.limits {
            let (limits, before) = (self.robot.limits(), memory.rates.as_ref());
            for i in 0..q.len() {
                let (low, high, back) = rate_interval(limits, i, q[i], self.settings.dt, before.map(|rates| rates[i]));
                (out.lower[i], out.upper[i]) = (low, high);
                out.returning |= back;
            }
            out.returning |= limits.coupled.iter().any(|it| it.margin(q) < -AT_LIMIT);
            out.jerks = memory.rates.is_some() && self.general.as_ref().is_some_and(|general| general.limits_jerk());
        }
        out.brakes = self.settings.limits && memory.rates.is_some() && self.robot.limits().qdd_max.iter().any(|a| a.is_finite());
        out
    }

    /// As [`QuadraticSolver::step`], of a tick of length `dt` within bounds that are given.
    #[inline(never)]
    pub(super) fn within<const C: usize>(
        &self,
        tick: &Tick<'_>,
        dt: f64,
        bounds: &RateBounds<C>,
        memory: &mut QuadraticMemory,
        rates: &mut [f64],
    ) -> Outcome {
        let n = size::<C>(self.robot.n()).min(rates.len());
        let (tool, columns) = jacobian::<C>(&self.robot, tick.q);
        let directions = self.task.directions(&tool, self.settings.length);
        let (w, v) = halves(&tick.twist);
        let rows = directions.rows(&columns);
        let wanted = directions.reduce(w, v).map(|x| x.clamp(-FASTEST, FASTEST));
        let mut cost = self.cost_of_rates::<C>(n);
        let conditioned = self.term.as_ref().is_none_or(|term| term.add(&self.robot, tick.q, &columns, dt, &mut memory.index, &mut cost));
        self.add_tasks(&mut cost, tick, dt, &directions, &rows, &wanted);
        let inside = match (&self.volume, &tick.frame) {
            (Some(volume), Some(frame)) => {
                let mut inside = Inside::new(volume, frame, &tool, dt);
                if bounds.brakes {
                    inside.brake(&tool, &columns.w[..n], self.robot.limits(), dt);
                }
                Some(inside)
            }
            _ => None,
        };
        let inside = inside.as_ref();
        let programme =
            Programme { tick, n, cost, bounds, directions, rows, wanted, conditioned, inside, tool: &tool, jacobian: &columns, dt };
        let (angular, linear) = self.settings.largest_deviation;
        let bounded = match &self.general {
            Some(general) if general.bounds.is_some() => 6,
            _ if angular.is_finite() || linear.is_finite() => directions.dimension(),
            _ => 0,
        };
        match tick.rows.len() + bounded + self.combinations() + inside.map_or(0, |inside| inside.count) {
            0 => self.answer(&programme, &mut [], memory, rates),
            1..=FEW_ROWS => self.answer(&programme, &mut [DenseRow::OPEN; FEW_ROWS], memory, rates),
            _ => self.answer_many(&programme, memory, rates),
        }
    }

    /// How many combinations of joints have limits that hold.
    #[inline(always)]
    fn combinations(&self) -> usize {
        if self.settings.limits { self.robot.limits().coupled.len() } else { 0 }
    }

    /// Their rows: the last of those that have to hold.
    #[inline(always)]
    fn combinations_in(&self, hard: usize) -> Range<usize> {
        hard - self.combinations()..hard
    }

    #[inline(always)]
    fn cost_of_rates<const C: usize>(&self, n: usize) -> Cost<C> {
        let mut cost = Cost::of_rates(&self.settings.rate_weights[..n]);
        if let Some(general) = &self.general {
            general.set_rates(&mut cost, n);
        }
        cost
    }

    /// The deviation from the task, and what counts beside it.
    #[inline(always)]
    fn add_tasks<const C: usize>(&self, cost: &mut Cost<C>, tick: &Tick<'_>, dt: f64, at: &Directions, rows: &Rows6<C>, wanted: &Row6) {
        match &self.general {
            None => cost.add_deviation(tick.stiffness, rows, wanted, at.dimension()),
            Some(general) => self.add_general(general, tick, dt, at, rows, wanted, cost),
        }
    }

    /// Apart, so that other ticks have no large buffer on their stack.
    #[inline(never)]
    fn answer_many<const C: usize>(&self, programme: &Programme<'_, C>, memory: &mut QuadraticMemory, rates: &mut [f64]) -> Outcome {
        self.answer(programme, &mut [DenseRow::OPEN; MAX_ROWS], memory, rates)
    }

    /// Solves a programme, with room for its rows in `buffer`.
    #[inline(never)]
    fn answer<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        buffer: &mut [DenseRow<C>],
        memory: &mut QuadraticMemory,
        rates: &mut [f64],
    ) -> Outcome {
        let n = programme.n;
        let (own, hard, all) = self.gather(programme, buffer);
        if let Some(inside) = programme.inside {
            inside.predict(
                &self.robot,
                programme.tick.q,
                (programme.tool, programme.jacobian),
                memory.rates.as_ref(),
                programme.dt,
                &mut buffer[own..],
            );
        }
        let narrowed = programme.bounds.jerks.then(|| self.within_jerk(programme, &buffer[..all], memory));
        let bounds = narrowed.as_ref().unwrap_or(programme.bounds);
        let closing = memory.closing;
        let (mut round, mut settling) = (0, None);
        let answer = loop {
            let at = Constraints { lower: &bounds.lower, upper: &bounds.upper, rows: &buffer[..all] };
            let answer = match settling.filter(|_| Step::of(round) != Step::Whole) {
                None => self.solve_relaxing(programme, &at, hard, memory),
                Some(before) => settle(programme, &at, before, round, memory),
            };
            for i in 0..n {
                // Numbers near the largest there are can overflow on the way: such a joint stands still if it may.
                rates[i] = if answer.x[i].is_finite() { answer.x[i] } else { 0.0 }.clamp(bounds.lower[i], bounds.upper[i]);
            }
            let next = programme.inside.and_then(|inside| self.tighten(inside, programme, &answer, round, &mut buffer[own..], rates));
            let Some(next) = next else { break answer };
            round = next;
            if Step::of(round) == Step::Whole {
                memory.closing = closing;
            }
            settling = Some(answer);
        };
        if answer.infeasible && self.combinations() > 0 {
            // Rows that exclude each other, or accelerations, give way to limits of position.
            keep_combinations(&self.robot, &self.task, self.settings.length, programme.tick.q, programme.dt, &mut rates[..n]);
        }
        if self.general.is_some() {
            memory.earlier = memory.rates;
        }
        memory.rates = Some(std::array::from_fn(|i| rates.get(i).copied().unwrap_or(0.0)));
        let printed = self.term.as_ref().is_some_and(|term| term.form == IndexForm::Printed);
        let (deviation, kept) = self.deviation(programme, &rates[..n]);
        let (w, v) = programme.directions.motion_of(&deviation);
        Outcome {
            status: match (kept, answer.held) {
                _ if answer.infeasible => QuadraticStatus::Infeasible,
                _ if printed && answer.without_index == Some(Status::NotConvex) => QuadraticStatus::NotConvex,
                _ if bounds.returning || programme.inside.is_some_and(|inside| inside.outside) => QuadraticStatus::Returning,
                (true, _) => QuadraticStatus::Solved,
                (false, true) => QuadraticStatus::Limited,
                (false, false) => QuadraticStatus::Relaxed,
            },
            deviation: [w[0], w[1], w[2], v[0], v[1], v[2]],
            failed: failed(&buffer[..own], rates),
            beyond_deviation: answer.beyond_deviation,
            outside: programme
                .inside
                .is_some_and(|inside| inside.falls_short::<C>(&self.robot, programme.tick.q, &rates[..n], programme.dt)),
            // Beside a singularity an index can outweigh all else, or its squares overflow, whatever its form.
            conditioned: programme.conditioned && (printed || answer.without_index.is_none()),
            changes: answer.changes,
        }
    }

    /// Bounds that limits of jerk leave, on the way to the rates that there would be without.
    #[cold]
    #[inline(never)]
    fn within_jerk<const C: usize>(&self, programme: &Programme<'_, C>, rows: &[DenseRow<C>], memory: &QuadraticMemory) -> RateBounds<C> {
        let mut out = *programme.bounds;
        let at = Constraints { lower: &programme.bounds.lower, upper: &programme.bounds.upper, rows };
        let found = solve(&programme.cost, &at, programme.n, &memory.start());
        if let Some(general) = &self.general {
            let (limits, tick) = (self.robot.limits(), (programme.tick.q, programme.dt));
            general.limit_jerk(limits, tick, memory, &found.x, &mut out.lower, &mut out.upper);
        }
        out
    }

    /// Writes the bounds of a volume anew, about where rates lead, where these leave one short: the round that it is for. Rates that no row keeps inside are
    /// shortened.
    #[inline(always)]
    fn tighten<const C: usize>(
        &self,
        inside: &Inside<'_>,
        programme: &Programme<'_, C>,
        answer: &Answer<C>,
        round: usize,
        rows: &mut [DenseRow<C>],
        rates: &mut [f64],
    ) -> Option<usize> {
        let (robot, q, dt) = (&*self.robot, programme.tick.q, programme.dt);
        let rates = &mut rates[..programme.n];
        if !answer.infeasible && !inside.falls_short::<C>(robot, q, rates, dt) {
            return None;
        }
        let next = match (answer.infeasible, round) {
            (false, _) => round + 1,
            // Rows about where rates led may exclude what those about the posture allow.
            (true, 0) => 1,
            (true, _) => Step::after_excluding(round)?,
        };
        if !Step::exists(next) {
            // Bounds of rates that leave out standing still leave out what is shorter.
            if !programme.bounds.brakes && !programme.bounds.returning {
                inside.shorten(robot, q, dt, rates);
            }
            return None;
        }
        let anew = answer.infeasible || Step::of(next) == Step::Rest;
        inside.write_about(robot, q, if anew { &[0.0; MAX_JOINTS][..programme.n] } else { &*rates }, dt, rows);
        Some(next)
    }

    /// Writes the rows of the tick, leaves room for those of a volume, then writes those of combinations of joints, then those of the largest deviation; how many are of the tick, how many have to
    /// hold, and how many there are.
    fn gather<const C: usize>(&self, programme: &Programme<'_, C>, buffer: &mut [DenseRow<C>]) -> (usize, usize, usize) {
        let n = programme.n;
        let own = programme.tick.rows.len().min(MAX_ROWS - 6 - MAX_COMBINATIONS - MAX_SIDES);
        for (dense, row) in buffer.iter_mut().zip(&programme.tick.rows[..own]) {
            for (entry, given) in dense.a[..n].iter_mut().zip(row.a) {
                *entry = *given;
            }
            (dense.lower, dense.upper) = (row.lower, row.upper);
        }
        let mut hard = own + programme.inside.map_or(0, |inside| inside.count);
        if self.combinations() > 0 {
            let RateBounds { lower, upper, .. } = programme.bounds;
            hard += coupled_rows(self.robot.limits(), programme.tick.q, programme.dt, lower, upper, &mut buffer[hard..]).0;
        }
        let mut all = hard;
        if let Some((lower, upper)) = self.general.as_ref().and_then(|general| general.bounds.as_ref()) {
            let (rows, wanted) = combined(&twists_of(&programme.directions), &programme.rows, &programme.wanted);
            for k in 0..6 {
                buffer[all] = DenseRow { a: rows[k], lower: wanted[k] - upper[k], upper: wanted[k] - lower[k] };
                all += 1;
            }
            return (own, hard, all);
        }
        for r in 0..programme.directions.dimension() {
            let (angular, linear) = self.settings.largest_deviation;
            let most = if r < self.task.angular.dimension() { self.settings.length * angular } else { linear };
            if most.is_finite() {
                let wanted = programme.wanted[r];
                buffer[all] = DenseRow { a: programme.rows[r], lower: wanted - most, upper: wanted + most };
                all += 1;
            }
        }
        (own, hard, all)
    }

    /// The rates. The index gives way first, where the programme is not convex with it, then the rows from `hard` on, then all of them.
    #[inline(always)]
    fn solve_relaxing<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        at: &Constraints<'_, C>,
        hard: usize,
        memory: &mut QuadraticMemory,
    ) -> Answer<C> {
        let found = solve(&programme.cost, at, programme.n, &memory.start());
        if found.status != Status::Solved {
            return self.relax(programme, at, hard, found, memory);
        }
        let found = self.nearest(programme, at, found, &mut memory.closing);
        memory.keep(&found.active);
        Answer {
            x: found.x,
            held: held(&found, self.combinations_in(hard)),
            infeasible: false,
            beyond_deviation: false,
            without_index: None,
            changes: found.changes,
        }
    }

    #[cold]
    #[inline(never)]
    fn relax<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        at: &Constraints<'_, C>,
        hard: usize,
        mut found: Minimum<C>,
        memory: &mut QuadraticMemory,
    ) -> Answer<C> {
        let n = programme.n;
        let without_index = matches!(found.status, Status::NotConvex | Status::Undefined).then_some(found.status);
        let mut cost = programme.cost;
        if without_index.is_some() {
            cost = self.cost_of_rates(n);
            self.add_tasks(&mut cost, programme.tick, programme.dt, &programme.directions, &programme.rows, &programme.wanted);
            found = solve(&cost, at, n, &ActiveSet::default());
            if found.status == Status::Solved {
                found = self.nearest(&Programme { cost, conditioned: false, ..*programme }, at, found, &mut memory.closing);
            }
        }
        let mut beyond_deviation = false;
        let own = Constraints { rows: &at.rows[..hard], ..*at };
        if found.status != Status::Solved && at.rows.len() > hard {
            // The largest deviation is out of reach: what counts now is to exceed it by little.
            cost.add_deviation(STIFFEST, &programme.rows, &programme.wanted, programme.directions.dimension());
            found = solve(&cost, &own, n, &ActiveSet::default());
            beyond_deviation = found.status == Status::Solved;
        }
        let infeasible = found.status != Status::Solved;
        if infeasible {
            found.x = solve_opened(&cost, &own, n).unwrap_or([0.0; C]);
        } else {
            memory.keep(&found.active);
        }
        Answer {
            x: found.x,
            held: held(&found, self.combinations_in(hard)),
            infeasible,
            beyond_deviation,
            without_index,
            changes: found.changes,
        }
    }

    /// What is left of the twist, component by component (angular ones in rad/s), and whether that is little.
    fn deviation<const C: usize>(&self, programme: &Programme<'_, C>, rates: &[f64]) -> (Row6, bool) {
        let (mut out, mut left, mut whole) = ([0.0; 6], 0.0, 0.0);
        for r in 0..programme.directions.dimension() {
            let wanted = programme.wanted[r];
            let followed: f64 = programme.rows[r].iter().zip(rates).map(|(a, x)| a * x).sum();
            out[r] = wanted - followed;
            if out[r].abs() < TINY && is_rounding(out[r], wanted, &programme.rows[r], rates) {
                out[r] = 0.0;
            }
            left += out[r] * out[r];
            whole += wanted * wanted;
            if r < self.task.angular.dimension() {
                out[r] /= self.settings.length;
            }
        }
        (out, left.sqrt() <= self.settings.tolerance * whole.sqrt())
    }
}

#[inline(never)]
fn step<const C: usize>(solver: &QuadraticSolver, tick: &Tick<'_>, memory: &mut QuadraticMemory, rates: &mut [f64]) -> Outcome {
    let bounds = solver.bounds::<C>(tick.q, memory);
    solver.within(tick, solver.settings.dt, &bounds, memory, rates)
}

/// The rates that are nearest to those before and hold the rows, which have changed by little since. Those before where there are none.
#[cold]
#[inline(never)]
fn settle<const C: usize>(
    programme: &Programme<'_, C>,
    at: &Constraints<'_, C>,
    before: Answer<C>,
    round: usize,
    memory: &QuadraticMemory,
) -> Answer<C> {
    let (n, m) = (programme.n, programme.directions.dimension());
    let from = if Step::of(round) == Step::Rest { [0.0; C] } else { before.x };
    let mut made = [0.0; 6];
    let mut size = f64::MIN_POSITIVE;
    for (made, row) in made.iter_mut().zip(&programme.rows).take(m) {
        *made = row.iter().zip(&from).map(|(a, x)| a * x).sum();
        size += row.iter().map(|a| a * a).sum::<f64>();
    }
    let mut cost = Cost::<C>::of_rates(&[1.0; MAX_JOINTS][..n]);
    for i in 0..n {
        cost.g[i] = -from[i];
    }
    if Step::of(round) == Step::Task {
        cost.add_deviation(STIFFEST / size, &programme.rows, &made, m);
    }
    let found = solve(&cost, at, n, &memory.start());
    if found.status == Status::Solved { Answer { x: found.x, infeasible: false, ..before } } else { before }
}

/// Rates, whether bounds hold them, whether the rows or the index had to be left out, and how often the programme changed its mind.
#[derive(Clone, Copy)]
struct Answer<const C: usize> {
    x: [f64; C],
    held: bool,
    infeasible: bool,
    beyond_deviation: bool,
    without_index: Option<Status>,
    changes: usize,
}

/// Whether a bound, or one of some rows, takes something from the rates: what merely touches one would go no further without it.
fn held<const C: usize>(found: &Minimum<C>, rows: Range<usize>) -> bool {
    let counts = |place: &Place| match place {
        Place::Bound(_) => true,
        Place::Row(k) => rows.contains(k),
    };
    found.active.as_slice().iter().zip(&found.multipliers).any(|(item, force)| counts(&item.place) && *force != 0.0)
}

/// Whether what is left of a component is rounding of the sum that it is left from.
#[cold]
#[inline(never)]
fn is_rounding(left: f64, wanted: f64, row: &[f64], rates: &[f64]) -> bool {
    let size = row.iter().zip(rates).fold(wanted.abs(), |sum, (a, x)| sum + (a * x).abs());
    left.abs() <= ROUNDING * size
}

/// The rows that do not hold.
fn failed<const C: usize>(rows: &[DenseRow<C>], rates: &[f64]) -> u64 {
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
