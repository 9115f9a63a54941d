//! The directions of the tool's axis that a volume allows, by the arcs of circles that bound them.

use std::f64::consts::{FRAC_PI_2, PI};

use super::Shape;
use super::range::Range;
use crate::linalg::vector::{Vec3, add, dot, scale};

/// A tilt closer to a quarter turn \[rad\] than this has no band along it.
const QUARTER: f64 = 1e-12;

/// A direction this close to the axis of a circle is as far from all of it.
const POLE: f64 = 1e-12;

const X: Vec3 = [1.0, 0.0, 0.0];
const Y: Vec3 = [0.0, 1.0, 0.0];
const Z: Vec3 = [0.0, 0.0, 1.0];

/// An arc of a circle on the sphere: height axis + radius (cos a first + sin a second).
#[derive(Debug, Clone, Copy)]
pub(super) struct Arc {
    axis: Vec3,
    height: f64,
    radius: f64,
    first: Vec3,
    second: Vec3,
    pub(super) range: Range,
}

impl Arc {
    pub(super) fn at(&self, angle: f64) -> Vec3 {
        let (s, c) = angle.sin_cos();
        add(scale(self.height, self.axis), scale(self.radius, add(scale(c, self.first), scale(s, self.second))))
    }

    /// How the point moves with the angle.
    pub(super) fn rate(&self, angle: f64) -> Vec3 {
        let (s, c) = angle.sin_cos();
        scale(self.radius, add(scale(-s, self.first), scale(c, self.second)))
    }

    /// The point nearest to a direction, both ends where they are as near, and several where the whole arc may be.
    pub(super) fn nearest(&self, z: Vec3, push: &mut dyn FnMut(Vec3)) {
        let (c, s) = (self.radius * dot(z, self.first), self.radius * dot(z, self.second));
        let angle = s.atan2(c);
        if self.range.contains(angle) {
            push(self.at(angle));
        }
        if !self.range.contains(angle) || c.hypot(s) < POLE {
            push(self.at(self.range.low));
            push(self.at(self.range.high));
            push(self.at(self.range.middle()));
        }
    }
}

/// Circles around x: b of a pyramid, or the shadow's bounds along x.
fn around_x(sine: f64, cosine: f64, range: Range) -> Arc {
    Arc { axis: X, height: sine, radius: cosine, first: Z, second: scale(-1.0, Y), range }
}

/// Circles around y: the shadow's bounds along y.
fn around_y(sine: f64, cosine: f64, range: Range) -> Arc {
    Arc { axis: Y, height: sine, radius: cosine, first: Z, second: X, range }
}

/// The great circle Rx(a) Ry(b) z of one a.
fn meridian(a: f64, range: Range) -> Arc {
    let (s, c) = a.sin_cos();
    Arc { axis: [0.0, c, s], height: 0.0, radius: 1.0, first: [0.0, -s, c], second: X, range }
}

/// The arcs that bound the directions of a pyramid or of a square.
pub(super) fn bounds(shape: &Shape, push: &mut dyn FnMut(Arc)) {
    match shape {
        Shape::Pyramid([x, y]) => {
            if *x < PI {
                push(meridian(*x, Range::within(*y)));
                push(meridian(-x, Range::within(*y)));
            }
            if (y - FRAC_PI_2).abs() > QUARTER && *y < PI {
                for b in [*y, -y] {
                    push(around_x(b.sin(), b.cos(), Range::within(*x)));
                }
            }
        }
        Shape::Square([x, y]) => square_bounds(*x, *y, push),
        Shape::Cone(_) | Shape::Product(_) => {}
    }
}

fn square_bounds(x: f64, y: f64, push: &mut dyn FnMut(Arc)) {
    // How far along a bound the other one, or the horizon, lets go.
    let stretch = |sine: f64, cosine: f64| if sine < cosine { (sine / cosine).asin() } else { FRAC_PI_2 };
    let ((sx, cx), (sy, cy)) = (x.sin_cos(), y.sin_cos());
    for sign in [1.0, -1.0] {
        if y < FRAC_PI_2 - QUARTER {
            push(around_x(sign * sy, cy, Range::within(stretch(sx, cy))));
        }
        if x < FRAC_PI_2 - QUARTER {
            push(around_y(sign * sx, cx, Range::within(stretch(sy, cx))));
        }
    }
    // Four stretches of the horizon, one a quadrant.
    let (low, high) = (FRAC_PI_2 - y, x);
    if low <= high {
        let horizon = |low, high| Arc { axis: Z, height: 0.0, radius: 1.0, first: X, second: Y, range: Range { low, high } };
        for turn in [0.0, PI] {
            push(horizon(low + turn, high + turn));
            push(horizon(PI - high + turn, PI - low + turn));
        }
    }
}

/// Whether a direction is one of a pyramid or of a square.
pub(super) fn allows(shape: &Shape, [x, y, z]: Vec3) -> bool {
    match shape {
        Shape::Pyramid([about_x, about_y]) => {
            let (a, b) = ((-y).atan2(z), x.atan2(y.hypot(z)).abs());
            let (near, far) = (Range::within(*about_x), Range::within(*about_y));
            (near.contains(a) && far.contains(b)) || (near.contains(a + PI) && far.contains(PI - b))
        }
        Shape::Square([about_x, about_y]) => x.abs() <= about_y.sin() && y.abs() <= about_x.sin() && z >= 0.0,
        Shape::Cone(tilt) => x.hypot(y).atan2(z) <= *tilt,
        Shape::Product(_) => true,
    }
}

/// The directions that may be the nearest to one beyond the bounds, or the nearest bounds of one within.
pub(super) fn nearest(shape: &Shape, z: Vec3, push: &mut dyn FnMut(Vec3)) {
    if let Shape::Cone(tilt) = shape {
        let heading = z[1].atan2(z[0]);
        // The far side too: from the opposite of the cone's axis it is as near.
        for heading in [heading, heading + PI] {
            let ((s, c), (sh, ch)) = (tilt.sin_cos(), heading.sin_cos());
            push([s * ch, s * sh, c]);
        }
        return;
    }
    bounds(shape, &mut |arc| arc.nearest(z, push));
}
