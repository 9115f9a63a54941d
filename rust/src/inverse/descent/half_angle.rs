//! The cost of one revolute joint with the quaternion metric of orientation (From and Gravdahl 2007, eq. 26 to 35).

use std::f64::consts::TAU;

use super::cosine::{Cosine, in_range};
use crate::inverse::any::roots::real_roots;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, dot};

/// Newton steps after the roots.
const POLISH: usize = 3;
/// Largest of these \[rad\]: a root that it would leave was not one.
const NEAR: f64 = 0.1;
/// Half turns as tangents of a quarter of the angle, with room for rounding.
const HALF_TURN: f64 = 1.0 + 1e-9;
/// Rounding of a sum of a few terms, relative to their size.
const ROUNDING: f64 = 2e-15;

/// `g(x) = K + a cos x + b sin x + w (2 - 2 |c cos(x/2) + d sin(x/2)|)`. The printed (35) has the half-angle terms of the derivative twice as large.
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfAngle {
    /// All but the orientation.
    pub rest: Cosine,
    weight: f64,
    c: f64,
    d: f64,
}

impl HalfAngle {
    /// With the rotation that is left and the joint's axis.
    pub fn new(rest: Cosine, u: Vec3, left: &Quaternion, weight: f64) -> Self {
        Self { rest, weight, c: left.0[0], d: dot(u, left.vector()) }
    }

    /// The slope at the present value.
    pub fn slope(&self) -> f64 {
        self.rest.b - self.weight * self.d * 1f64.copysign(self.c)
    }

    /// The decrease of the cost by a change.
    pub fn decrease(&self, x: f64) -> f64 {
        let (half, quarter) = ((0.5 * x).sin(), (0.25 * x).sin());
        let gained = self.d * half - 2.0 * self.c * quarter * quarter;
        let there = self.c + gained;
        // The same sign as now: without the difference of two that are nearly the same.
        let more = if (there < 0.0) == (self.c < 0.0) { gained * 1f64.copysign(self.c) } else { there.abs() - self.c.abs() };
        self.rest.decrease(x) + 2.0 * self.weight * more
    }

    /// Calls `each` with every change in [-pi, pi] at which the derivative vanishes.
    fn stationary(&self, each: &mut dyn FnMut(f64)) {
        let turn = 2.0 * self.d.atan2(self.c);
        let turn = if turn.abs() > 0.5 * TAU { turn - TAU.copysign(turn) } else { turn };
        match self.rest.minimum() {
            // Orientation alone.
            None => each(turn),
            Some(minimum) if self.c.hypot(self.d) * self.weight.abs() <= ROUNDING * self.rest.a.hypot(self.rest.b) => each(minimum),
            // Both signs of the quaternion, each where it is the nearer one or not: no root is farther than a half turn.
            Some(_) => [1.0, -1.0].into_iter().for_each(|sign| self.quartic(sign, each)),
        }
    }

    /// The roots of (35), a quartic in tan(x/4), with one sign of the quaternion.
    fn quartic(&self, sign: f64, each: &mut dyn FnMut(f64)) {
        let (a, b) = (self.rest.a, self.rest.b);
        let (c, d) = (-2.0 * sign * self.weight * self.c, -2.0 * sign * self.weight * self.d);
        let size = 4.0 * a.abs() + 6.0 * b.abs() + c.abs() + d.abs();
        let quartic = [b + 0.5 * d, -(4.0 * a + c), -6.0 * b, 4.0 * a - c, b - 0.5 * d];
        real_roots(&quartic, size, &mut |t| {
            if t.abs() <= HALF_TURN {
                let mut x = 4.0 * t.atan();
                for _ in 0..POLISH {
                    let ((s, k), (sh, kh)) = (x.sin_cos(), (0.5 * x).sin_cos());
                    let slope = b * k - a * s + 0.5 * (d * kh - c * sh);
                    let step = slope / (a * k + b * s + 0.25 * (c * kh + d * sh));
                    if step.abs() <= NEAR {
                        x += step;
                    }
                }
                each(x.clamp(-0.5 * TAU, 0.5 * TAU));
            }
        });
    }

    /// What rounding leaves uncertain of the decrease by a change.
    fn doubt(&self, x: f64) -> f64 {
        let half = (0.5 * x).sin();
        ROUNDING * (self.rest.a.abs() * half * half + (self.rest.b * x.sin()).abs() + (self.weight * half).abs())
    }

    /// The best change within a range; of several the nearest to zero.
    pub fn best(&self, low: f64, high: f64) -> f64 {
        let (mut best, mut most) = (0f64.max(low).min(high), f64::NEG_INFINITY);
        let mut look = |x: f64| {
            let (decrease, doubt) = (self.decrease(x), self.doubt(x).max(self.doubt(best)));
            if decrease > most + doubt || (decrease >= most - doubt && x.abs() < best.abs()) {
                (best, most) = (x, decrease.max(most));
            }
        };
        look(0f64.max(low).min(high));
        [low, high].into_iter().filter(|x| x.is_finite()).for_each(&mut look);
        self.stationary(&mut |x| {
            if let Some(x) = in_range(x, low, high) {
                look(x);
            }
        });
        best
    }

    /// The best change that is downhill all the way: the next place without a slope, or the end of the range before it.
    pub fn downhill(&self, low: f64, high: f64) -> f64 {
        let slope = self.slope();
        if slope == 0.0 {
            return 0.0;
        }
        let way = -slope.signum();
        // Orientation alone has its maximum, where the other sign becomes the nearer one, a half turn from the minimum: beyond it, whichever way.
        let mut ahead = 0.5 * TAU;
        self.stationary(&mut |x| ahead = ahead.min(if x * way > 0.0 { x.abs() } else { TAU - x.abs() }));
        (way * ahead).max(low).min(high)
    }
}
