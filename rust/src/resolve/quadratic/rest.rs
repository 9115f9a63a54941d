//! How a tick comes to rest in front of a goal that is out of reach.

use super::bounds::fastest;
use super::programme::{Constraints, Cost, solve};
use super::solver::{Programme, QuadraticSolver};
use crate::qp::{ActiveSet, Minimum, Status};
use crate::resolve::nearest::{Asked, with_curvature};

impl QuadraticSolver {
    /// Rates that lead where they promise to over the tick: those found, or those of the second-order model.
    #[inline(always)]
    pub(super) fn nearest<const C: usize>(&self, programme: &Programme<'_, C>, at: &Constraints<'_, C>, found: Minimum<C>) -> Minimum<C> {
        let dt = programme.dt;
        let wanted = programme.wanted.map(|x| dt * x);
        let asked = Asked { jacobian: programme.jacobian, directions: &programme.directions, rows: &programme.rows, wanted: &wanted };
        if asked.falls_short(&found.x.map(|x| dt * x)) { self.curved(programme, at, found, &asked) } else { found }
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
        let (n, stiffness) = (programme.n, programme.tick.stiffness);
        let brakes = programme.bounds.brakes;
        if brakes && !self.strays_without_inertia(programme, asked) {
            return found;
        }
        let least = self.settings().rate_weights[..n].iter().fold(f64::INFINITY, |least, weight| least.min(*weight));
        let curvature = asked.curvature().map(|row| row.map(|x| stiffness * x));
        let cost = Cost { h: with_curvature(&programme.cost.h, curvature, least, n), g: programme.cost.g };
        let again = if brakes { self.braking(programme, at, &cost) } else { solve(&cost, at, n, &found.active) };
        if again.status == Status::Solved { again } else { found }
    }

    /// Whether the tick could not do what it is asked for even if rates could change at once: then the goal is out of reach, and not only a tick away.
    fn strays_without_inertia<const C: usize>(&self, programme: &Programme<'_, C>, asked: &Asked<'_, C>) -> bool {
        let (n, dt, limits) = (programme.n, programme.dt, self.robot.limits());
        let (mut lower, mut upper) = ([f64::NEG_INFINITY; C], [f64::INFINITY; C]);
        for i in 0..n {
            lower[i] = ((limits.q_min[i] - programme.tick.q[i]) / dt).min(0.0);
            upper[i] = ((limits.q_max[i] - programme.tick.q[i]) / dt).max(0.0);
        }
        let free = solve(&programme.cost, &Constraints { lower: &lower, upper: &upper, rows: &[] }, n, &ActiveSet::default());
        let slower = (0..n).fold(1.0f64, |least, i| least.min(limits.qd_max[i] / free.x[i].abs()));
        free.status != Status::Solved || asked.goes_astray(&free.x.map(|x| dt * slower * x))
    }

    /// The rates from which every joint comes to rest at the minimum of the cost, read as one of motions: a joint of rate x goes on for
    /// `x dt + x |x| / 2a` until it stands.
    fn braking<const C: usize>(&self, programme: &Programme<'_, C>, at: &Constraints<'_, C>, cost: &Cost<C>) -> Minimum<C> {
        let (n, dt, slowing) = (programme.n, programme.dt, &self.robot.limits().qdd_max);
        let until_rest = |i: usize, x: f64| if i < n { x + x * x.abs() / (2.0 * dt * slowing[i]) } else { x };
        let (lower, upper) = (std::array::from_fn(|i| until_rest(i, at.lower[i])), std::array::from_fn(|i| until_rest(i, at.upper[i])));
        let mut out = solve(cost, &Constraints { lower: &lower, upper: &upper, rows: &[] }, n, &ActiveSet::default());
        for i in 0..n {
            out.x[i] = fastest(dt * out.x[i].abs(), slowing[i], dt).copysign(out.x[i]).clamp(at.lower[i], at.upper[i]);
        }
        if at.rows.is_empty() || out.status != Status::Solved {
            return out;
        }
        // The nearest that rows allow.
        let mut near = Cost::of_rates(&[1.0; C][..n]);
        near.g = out.x.map(|x| -x);
        solve(&near, at, n, &ActiveSet::default())
    }
}
