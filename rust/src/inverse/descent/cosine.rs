//! The cost of one revolute joint in closed form (From and Gravdahl 2007, eq. 14 to 25 and 36 to 42), for any axis.

use std::f64::consts::TAU;

use crate::linalg::vector::{Vec3, cross, dot, norm, scale, sub};

/// Rounding of a sum of a few products, relative to their size.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// `g(x) = K + a cos x + b sin x` with x the change of the joint. K is not kept: values come from residuals, because `K - hypot(a, b)` loses half the digits
/// next to a goal.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cosine {
    /// The present value is K + a; the second derivative is -a.
    pub a: f64,
    /// The slope at the present value.
    pub b: f64,
    /// What rounding leaves uncertain of both.
    doubt: f64,
}

impl Cosine {
    /// Adds `weight |turned r - s|^2`, r and s from a point on the axis `u`. Position, points and the three axes of an orientation are all of this kind: the
    /// Frobenius norm is the sum over these.
    #[inline]
    pub fn pull(&mut self, u: Vec3, r: Vec3, s: Vec3, weight: f64) {
        let (r_across, s_across) = (sub(r, scale(dot(u, r), u)), sub(s, scale(dot(u, s), u)));
        self.a -= 2.0 * weight * dot(r_across, s_across);
        // The difference first: next to a goal both are nearly the same.
        self.b -= 2.0 * weight * dot(u, cross(r_across, sub(s_across, r_across)));
        self.doubt += ROUNDING * weight.abs() * (norm(r) * norm(s_across) + norm(s) * norm(r_across));
    }

    /// Adds `weight (1 - cos(joint - middle))`.
    pub fn centre(&mut self, from_middle: f64, weight: f64) {
        let (sine, cosine) = from_middle.sin_cos();
        self.a -= weight * cosine;
        self.b += weight * sine;
    }

    /// The change to the minimum, in (-pi, pi]; `None` where the cost is flat. The printed (25), atan2(b/a), is the maximum.
    #[inline]
    pub fn minimum(&self) -> Option<f64> {
        // 0 - b, not -b: at a maximum the half turn is the positive one.
        (self.a.hypot(self.b) > self.doubt).then(|| (0.0 - self.b).atan2(-self.a))
    }

    /// The decrease of the cost by a change, without cancellation.
    #[inline]
    pub fn decrease(&self, x: f64) -> f64 {
        let half = (0.5 * x).sin();
        2.0 * self.a * half * half - self.b * x.sin()
    }

    /// The best change within a range, which may be wider than a turn: the cost grows with the circular distance from its minimum.
    #[inline]
    pub fn best(&self, low: f64, high: f64) -> f64 {
        let Some(minimum) = self.minimum() else { return 0f64.max(low).min(high) };
        in_range(minimum, low, high).unwrap_or_else(|| if (low - minimum).cos() >= (high - minimum).cos() { low } else { high })
    }

    /// The best change that is downhill all the way.
    #[inline]
    pub fn downhill(&self, low: f64, high: f64) -> f64 {
        self.minimum().unwrap_or(0.0).max(low).min(high)
    }
}

/// Of the copies of an angle by whole turns the one in a range that is nearest to zero; the angle is in [-pi, pi].
#[inline]
pub(super) fn in_range(x: f64, low: f64, high: f64) -> Option<f64> {
    let copy = if x < low {
        x + TAU * ((low - x) / TAU).ceil()
    } else if x > high {
        x - TAU * ((x - high) / TAU).ceil()
    } else {
        x
    };
    (copy >= low && copy <= high).then_some(copy)
}
