//! How a tick comes to rest in front of a goal that is out of reach.

use super::programme::{Constraints, Cost, solve};
use super::solver::{Programme, QuadraticSolver};
use crate::linalg::Row6;
use crate::linalg::damped::damped_step;
use crate::linalg::symmetric::positive_part;
use crate::qp::{ActiveSet, Minimum, Status};
use crate::resolve::bounds::fastest;
use crate::resolve::nearest::{Asked, TURNED, part_that_counts, square, with_curvature};

/// Least part of an error that a tick is thought to ask for.
const LEAST_SHARE: f64 = 1e-4;
/// Part of what a tick leaves that it makes of it where that is out of reach.
const STUCK: f64 = 0.05;
/// What a tick leaves of the twist, squared and relative to it, up to which the task leads and not the index.
const TASK_LEADS: f64 = 1.2;
/// A motion of the tool below this [rad or m] does not tell what part of the error was asked for.
const TELLING: f64 = 1e-9;

/// What is left in a tick of a larger part that was told before.
const FORGETS: f64 = 0.9;

/// What two ticks tell of the part of the error that each asks for: how the motion that is asked for changes with the motion that was made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Closing {
    wanted: Row6,
    made: Row6,
    share: f64,
}

impl Default for Closing {
    fn default() -> Self {
        Self { wanted: [0.0; 6], made: [0.0; 6], share: 1.0 }
    }
}

impl Closing {
    /// The part of the error that this tick asks for, the larger one where angles (the first components) and positions have gains of their own: all
    /// of it until two ticks have told. A larger one is believed at once, a smaller one by and by: braking early does no harm.
    fn share(&mut self, wanted: &Row6, angular: usize) -> f64 {
        let told = |from: usize, to: usize| {
            let square: f64 = self.made[from..to].iter().map(|x| x * x).sum();
            let change: f64 = (from..to).map(|c| (self.wanted[c] - wanted[c]) * self.made[c]).sum();
            if square > TELLING * TELLING && change > 0.0 { change / square } else { 0.0 }
        };
        let share = told(0, angular).max(told(angular, 6));
        if share > 0.0 {
            self.share = share.max(FORGETS * self.share).clamp(LEAST_SHARE, 1.0);
        }
        self.share
    }

    /// After a tick.
    fn remember(&mut self, wanted: &Row6, made: &Row6) {
        (self.wanted, self.made) = (*wanted, *made);
    }
}

/// Whether a tick hardly makes any of what it leaves, as before a goal out of reach, and not for want of stiffness: then it would make more of it.
fn is_stuck(made: &Row6, wanted: &Row6, weigh: impl Fn(Row6) -> Row6) -> bool {
    let left: Row6 = std::array::from_fn(|c| wanted[c] - made[c]);
    let weighed = weigh(left);
    let with = |x: &Row6| -> f64 { x.iter().zip(&weighed).map(|(a, b)| a * b).sum() };
    with(made) <= STUCK * with(&left)
}

impl QuadraticSolver {
    /// Rates that lead where they promise to over the tick: those found, or those of the second-order model.
    #[inline(always)]
    pub(super) fn nearest<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        at: &Constraints<'_, C>,
        found: Minimum<C>,
        closing: &mut Closing,
    ) -> Minimum<C> {
        let dt = programme.dt;
        let wanted = programme.wanted.map(|x| dt * x);
        let weigh = |x: Row6| self.general.as_ref().and_then(|general| general.weighed(&programme.directions, &x)).unwrap_or(x);
        let weighed = weigh(wanted);
        let asked = Asked {
            jacobian: programme.jacobian,
            directions: &programme.directions,
            rows: &programme.rows,
            wanted: &wanted,
            weighed: &weighed,
        };
        if programme.bounds.brakes {
            return self.braked(programme, at, found, &asked, closing);
        }
        let motion = found.x.map(|x| dt * x);
        if !self.has_worth(programme) {
            let (short, made) = asked.falls_short(self.robot.arm(), &motion);
            let stuck = short && is_stuck(&made, &wanted, weigh);
            return if stuck { self.curved(programme, at, found, &asked) } else { found };
        }
        // Where the task gives way to the worth of an index, a tick falls short as a rule: what counts is what it leaves.
        let made = asked.made(&motion);
        let left: Row6 = std::array::from_fn(|c| wanted[c] - made[c]);
        let asked = Asked { weighed: &weigh(left), ..asked };
        // An index that drives the tool farther than the task does is followed as it is printed.
        let task_leads = square(&left) <= TASK_LEADS * square(&wanted);
        if task_leads && self.part_along(programme, &asked, &found, &motion) > 0.0 {
            return self.curved(programme, at, found, &asked);
        }
        found
    }

    /// Whether an index counts beside the task.
    #[inline(always)]
    fn has_worth<const C: usize>(&self, programme: &Programme<'_, C>) -> bool {
        programme.conditioned && self.objective().is_some()
    }

    #[cold]
    #[inline(never)]
    fn curved<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        at: &Constraints<'_, C>,
        found: Minimum<C>,
        asked: &Asked<'_, C>,
    ) -> Minimum<C> {
        let (n, dt) = (programme.n, programme.dt);
        let part = if self.has_worth(programme) {
            self.part_along(programme, asked, &found, &found.x.map(|x| dt * x))
        } else {
            part_that_counts(&programme.cost.h, &positive_part(self.curvature(programme, asked, 1.0), n), n)
        };
        if part == 0.0 {
            return found;
        }
        let again = solve(&self.second_order(programme, asked, part, 1.0), at, n, &found.active);
        if again.status == Status::Solved { again } else { found }
    }

    /// The part of the curvature that has to count along the rates found: beside the slope of the whole cost, or beside its curvature where rows drive
    /// rates up that slope.
    fn part_along<const C: usize>(&self, programme: &Programme<'_, C>, asked: &Asked<'_, C>, found: &Minimum<C>, motion: &[f64; C]) -> f64 {
        let x = &found.x;
        let along = |row: &[f64; C]| row.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        let scale = programme.dt * programme.dt / programme.tick.stiffness;
        let part = asked.part_along(self.robot.arm(), motion, -scale * along(&programme.cost.g));
        if part == 0.0 {
            return 0.0;
        }
        let own: f64 = programme.cost.h.iter().zip(x).map(|(row, x)| x * along(row)).sum();
        part.min(asked.part_along(self.robot.arm(), motion, scale * own))
    }

    /// The curvature of the model of the deviation in a tick that asks for the whole error, of which `share` is wanted now.
    fn curvature<const C: usize>(&self, programme: &Programme<'_, C>, asked: &Asked<'_, C>, share: f64) -> [[f64; C]; C] {
        asked.curvature().map(|row| row.map(|x| programme.tick.stiffness / share * x))
    }

    /// The second-order model of the cost, with a part of its curvature, of a tick that asks for the whole error, of which `share` is wanted now.
    fn second_order<const C: usize>(&self, programme: &Programme<'_, C>, asked: &Asked<'_, C>, part: f64, share: f64) -> Cost<C> {
        let (n, least) = (programme.n, self.least_weight());
        let curvature = self.curvature(programme, asked, share).map(|row| row.map(|x| part * x));
        Cost { h: with_curvature(&programme.cost.h, curvature, least, n), g: programme.cost.g.map(|x| x / share) }
    }

    /// The same for joints that need time to brake: where they would stray on the way to a stop, rates from which each comes to rest at the minimum of
    /// the model, which is then one of motions until it stands.
    #[inline(never)]
    fn braked<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        at: &Constraints<'_, C>,
        mut found: Minimum<C>,
        asked: &Asked<'_, C>,
        closing: &mut Closing,
    ) -> Minimum<C> {
        let share = closing.share(asked.wanted, self.task.angular.dimension());
        let motion = |found: &Minimum<C>| found.x.map(|x| programme.dt * x);
        let (short, mut made) = asked.falls_short(self.robot.arm(), &motion(&found));
        if short && self.strays(programme, asked, share) {
            let again = self.to_a_stop(programme, at, asked, share);
            if again.status == Status::Solved {
                (made, found) = (asked.made(&motion(&again)), again);
            }
        }
        closing.remember(asked.wanted, &made);
        found
    }

    /// Whether the tick could not do what it is asked for even if rates could change at once: then the goal is out of reach, and not only a tick away.
    fn strays<const C: usize>(&self, programme: &Programme<'_, C>, asked: &Asked<'_, C>, share: f64) -> bool {
        let (n, dt, limits) = (programme.n, programme.dt, self.robot.limits());
        let whole = asked.wanted.map(|x| x / share);
        let turns_back = |x: &[f64; C]| {
            let slower = (0..n).fold(1.0f64, |least, i| least.min(limits.qd_max[i] / x[i].abs()));
            // On the way that the joint that brakes longest leaves to all of them.
            let time = (0..n).fold(dt, |most, i| most.max(dt + slower * x[i].abs() / (2.0 * limits.qdd_max[i])));
            Asked { wanted: &whole, ..*asked }.goes_astray(&x.map(|x| time * slower * x), &[1.0; C], TURNED)
        };
        let (mut lower, mut upper) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C]);
        for i in 0..n {
            lower[i] = ((limits.q_min[i] - programme.tick.q[i]) / dt).min(0.0);
            upper[i] = ((limits.q_max[i] - programme.tick.q[i]) / dt).max(0.0);
        }
        // The shortest rates, where limits of position have room for them: nearly always, and sooner than a programme.
        let shortest =
            damped_step(asked.rows, &programme.wanted, self.least_weight() / programme.tick.stiffness, n, programme.directions.dimension());
        if (0..n).all(|i| lower[i] <= shortest[i] && shortest[i] <= upper[i]) && !turns_back(&shortest) {
            return false;
        }
        let mut cost = Cost::<C>::of_rates(&self.settings().rate_weights[..n]);
        cost.add_deviation(programme.tick.stiffness, asked.rows, &programme.wanted, programme.directions.dimension());
        let free = solve(&cost, &Constraints { lower: &lower, upper: &upper, rows: &[] }, n, &ActiveSet::default());
        free.status != Status::Solved || turns_back(&free.x)
    }

    /// The least weight of a rate.
    fn least_weight(&self) -> f64 {
        self.settings().rate_weights[..self.robot.n()].iter().fold(f64::INFINITY, |least, weight| least.min(*weight))
    }

    /// How far joint `i` goes on from a rate until it stands, the tick included [rad or m].
    fn until_rest(&self, i: usize, dt: f64, rate: f64) -> f64 {
        let slowing = self.robot.limits().qdd_max.get(i).copied().unwrap_or(f64::INFINITY);
        dt * rate + rate * rate.abs() / (2.0 * slowing)
    }

    fn to_a_stop<const C: usize>(
        &self,
        programme: &Programme<'_, C>,
        at: &Constraints<'_, C>,
        asked: &Asked<'_, C>,
        share: f64,
    ) -> Minimum<C> {
        let (n, dt, slowing) = (programme.n, programme.dt, &self.robot.limits().qdd_max);
        let cost = self.second_order(programme, asked, 1.0, share);
        let lower = std::array::from_fn(|i| self.until_rest(i, dt, at.lower[i]) / dt);
        let upper = std::array::from_fn(|i| self.until_rest(i, dt, at.upper[i]) / dt);
        let mut out = solve(&cost, &Constraints { lower: &lower, upper: &upper, rows: &[] }, n, &ActiveSet::default());
        for i in 0..n {
            out.x[i] = fastest(dt * out.x[i].abs(), slowing[i], dt).copysign(out.x[i]);
        }
        // No faster than asked.
        let slower = asked.slower(&out.x.map(|x| dt * x));
        for i in 0..n {
            out.x[i] = (slower * out.x[i]).clamp(at.lower[i], at.upper[i]);
        }
        if at.rows.is_empty() || out.status != Status::Solved {
            return out;
        }
        // The nearest that rows allow, as the model measures it.
        let near = Cost { h: cost.h, g: cost.h.map(|row| -row.iter().zip(&out.x).map(|(h, x)| h * x).sum::<f64>()) };
        solve(&near, at, n, &ActiveSet::default())
    }
}
