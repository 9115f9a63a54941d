//! Random members: as often in one part of the volume as in another of the same size (Haar measure).

use std::f64::consts::{FRAC_PI_2, TAU};

use super::product::{self, Lie};
use super::range::Range;
use super::{Factor, OrientationVolume, Shape};
use crate::linalg::quaternion::Quaternion;
use crate::linalg::random::Uniform;
use crate::linalg::vector::Vec3;

impl Range {
    fn draw(&self, stream: &mut Uniform) -> f64 {
        let width = if self.is_free() { TAU } else { self.high - self.low };
        self.low + width * stream.draw()
    }
}

impl OrientationVolume {
    /// Random members, the same for the same seed.
    ///
    /// Of what has an interior they are uniform: a region is met as often as its share of all rotations. On lines and products of fewer freedoms they
    /// are uniform along the line or over the surface. Those of four rotations and more are uniform in the angles alone.
    pub fn samples(&self, count: usize, seed: u64) -> Vec<Quaternion> {
        let mut stream = Uniform::new(seed);
        (0..count).map(|_| self.reference.product(&self.sample(&mut stream))).collect()
    }

    fn sample(&self, stream: &mut Uniform) -> Quaternion {
        let direction = match &self.shape {
            Shape::Cone(tilt) => cone(*tilt, stream),
            // A line: even in its angle.
            Shape::Pyramid(tilts) if tilts.contains(&0.0) => return angles(&self.rotations(tilts), stream),
            Shape::Square([x, y]) if *x == 0.0 || *y == 0.0 => rectangle(Range::within(*x).draw(stream), Range::within(*y).draw(stream)),
            Shape::Pyramid([x, y]) if *y <= FRAC_PI_2 => {
                // Even in the height along x, by which areas on the sphere go.
                let b = (y.sin() * (2.0 * stream.draw() - 1.0)).asin();
                rectangle(Range::within(*x).draw(stream), b)
            }
            Shape::Pyramid(tilts) => return triple(&self.rotations(tilts), stream),
            Shape::Square(tilts) => square(*tilts, stream),
            Shape::Product(factors) if factors.len() == 3 => match <&[Factor; 3]>::try_from(&factors[..]) {
                Ok(factors) => return triple(factors, stream),
                Err(_) => return angles(factors, stream),
            },
            Shape::Product(factors) => return angles(factors, stream),
        };
        self.member(direction, self.spin.draw(stream))
    }
}

fn cone(tilt: f64, stream: &mut Uniform) -> Vec3 {
    let half = (stream.draw().sqrt() * (0.5 * tilt).sin()).asin();
    let ((s, c), (sh, ch)) = ((2.0 * half).sin_cos(), (TAU * stream.draw()).sin_cos());
    [s * ch, s * sh, c]
}

/// Rx(a) Ry(b) z.
fn rectangle(a: f64, b: f64) -> Vec3 {
    let ((sa, ca), (sb, cb)) = (a.sin_cos(), b.sin_cos());
    [sb, -sa * cb, ca * cb]
}

fn square([x, y]: [f64; 2], stream: &mut Uniform) -> Vec3 {
    // Even in the height along x and the angle about it, over a rectangle around the square.
    let (sx, cy) = (x.sin(), y.cos());
    let around = Range::within(if sx < cy { (sx / cy).asin() } else { FRAC_PI_2 });
    loop {
        let direction = rectangle(around.draw(stream), (y.sin() * (2.0 * stream.draw() - 1.0)).asin());
        if direction[1].abs() <= sx {
            return direction;
        }
    }
}

fn angles(factors: &[Factor], stream: &mut Uniform) -> Quaternion {
    factors.iter().fold(Quaternion::IDENTITY, |q, factor| q.product(&Quaternion::about(factor.axis, factor.range.draw(stream))))
}

/// The middle angle as often as its axes turn the tool, and what two triples of angles make half as often from each.
fn triple(factors: &[Factor; 3], stream: &mut Uniform) -> Quaternion {
    let [a, b, c] = factors;
    let (lie, all) = (Lie::of([a, b, c]), [a, b, c]);
    if lie.is_flat() || factors.iter().any(|factor| factor.range.is_fixed()) {
        return angles(factors, stream);
    }
    loop {
        let x = b.range.draw(stream);
        if stream.draw() * lie.most_dense(&b.range) > lie.density(x) {
            continue;
        }
        let drawn = [a.range.draw(stream), x, c.range.draw(stream)];
        let q = all.iter().zip(drawn).fold(Quaternion::IDENTITY, |q, (factor, x)| q.product(&Quaternion::about(factor.axis, x)));
        let other = product::other(all, x, &q);
        let twice = all.iter().zip(other).all(|(factor, x)| factor.range.contains(x));
        if !twice || stream.draw() < 0.5 {
            return q;
        }
    }
}
