//! How much of all rotations a volume is.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::product::{self, Lie};
use super::range::{Range, wrap};
use super::{Factor, OrientationVolume, Shape};
use crate::linalg::quaternion::Quaternion;

/// Middle angles of a product over which its size is added up.
const POINTS: usize = 4096;

impl OrientationVolume {
    /// The part of all rotations that are members, 0 to 1: that a random rotation is one. In closed form, but to 1e-6 of products of three rotations
    /// and of pyramids beyond a quarter turn about y; NaN of products of four and more.
    pub fn share(&self) -> f64 {
        if self.freedoms() < 3 {
            return 0.0;
        }
        let spin = self.spin.share();
        match &self.shape {
            Shape::Cone(tilt) => (0.5 * tilt).sin().powi(2) * spin,
            Shape::Pyramid([x, y]) if *y <= FRAC_PI_2 => x / PI * y.sin() * spin,
            Shape::Pyramid(tilts) => triple(&self.rotations(tilts)),
            Shape::Square(tilts) => square(*tilts) * spin,
            Shape::Product(factors) => <&[Factor; 3]>::try_from(&factors[..]).map_or(f64::NAN, triple),
        }
    }
}

/// The part of the sphere whose shadow is in a rectangle.
fn square([x, y]: [f64; 2]) -> f64 {
    let ((sx, cx), (sy, cy)) = (x.sin_cos(), y.sin_cos());
    if sx >= cy {
        // The hemisphere without four halves of caps.
        return 0.5 * (sx + sy - 1.0);
    }
    let (across, along) = (sx / cy, sy / cx);
    (sy * across.asin() + sx * along.asin() - (across * along).asin()) / PI
}

/// By what the middle angle's axes turn, the two triples that make an orientation counted once.
fn triple(factors: &[Factor; 3]) -> f64 {
    let [a, b, c] = factors;
    let (lie, width) = (Lie::of([a, b, c]), 2.0 * b.range.half());
    let at = |i: usize| {
        let x = b.range.low + width * (i as f64 + 0.5) / POINTS as f64;
        let other = product::other([a, b, c], x, &Quaternion::about(b.axis, x));
        let both = if b.range.contains(other[1]) { common(&a.range, other[0]) * common(&c.range, other[2]) } else { 0.0 };
        lie.density(x) * (4.0 * a.range.half() * c.range.half() - 0.5 * both)
    };
    let sum: f64 = (0..POINTS).map(at).sum();
    sum * width / POINTS as f64 / (8.0 * PI * PI)
}

/// How much of a range is in it after a shift, too.
fn common(range: &Range, shift: f64) -> f64 {
    let (width, apart) = (2.0 * range.half(), wrap(shift).abs());
    (width - apart).max(0.0) + (width + apart - TAU).max(0.0)
}
