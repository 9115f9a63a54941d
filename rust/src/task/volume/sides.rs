//! A volume as one-sided bounds, smooth where the tool's axis stands on the volume's.
//!
//! Bounds of the tilt are linear in the tool's axis z, which has no singularity at tilt 0 as the tilt itself has; those of the spin and of
//! the angles of a product are the angles themselves.

use super::product::{self, Lie};
use super::range::Range;
use super::{Factor, OrientationVolume, Shape};
use crate::error::{Error, Result};
use crate::linalg::frame::Frame;
use crate::linalg::quaternion::Quaternion;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub, unit};
use std::f64::consts::FRAC_PI_2;

/// Most sides of a volume.
pub const MAX_SIDES: usize = 6;

/// A tilt closer to a quarter turn \[rad\] than this is one, and bounds nothing.
const QUARTER: f64 = 1e-9;

/// A tilt below this \[rad\], but not zero, is refused as a task: its bound would be all rounding.
const SMALLEST: f64 = 1e-4;

/// A pyramid with bounded spin is refused as a task this close \[rad\] to a tilt about y of a quarter turn, where its spin is undefined.
const NEAR_GIMBAL: f64 = 0.02;

/// The smallest 1 + cos(tilt) of a twist's rate: half a turn leaves it without.
const REVERSED: f64 = 1e-12;

/// A bound of a volume at an orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// At least 0 inside, in radians to first order near the bound; of an equality the signed error.
    pub slack: f64,
    /// The slack's time derivative is rate . omega, with the tool's angular velocity in the base frame, the volume at rest.
    pub rate: Vec3,
    /// Where the slack is normal . z plus a constant, with z the tool's axis in the base frame: its second derivative over joints k <= l is
    /// normal . (w_k x (w_l x z)). None of a spin or an angle of a product.
    pub normal: Option<Vec3>,
    /// Whether the slack has to be zero.
    pub equality: bool,
}

/// The bounds of a volume at an orientation.
#[derive(Debug, Clone, Copy)]
pub struct Sides {
    sides: [Side; MAX_SIDES],
    count: usize,
}

impl Sides {
    const NONE: Self = Self { sides: [Side { slack: 0.0, rate: [0.0; 3], normal: None, equality: false }; MAX_SIDES], count: 0 };

    /// Them.
    pub fn as_slice(&self) -> &[Side] {
        &self.sides[..self.count]
    }

    fn push(&mut self, side: Side) {
        if let Some(slot) = self.sides.get_mut(self.count) {
            *slot = side;
            self.count += 1;
        }
    }

    /// normal . z + constant, of the tool's axis.
    #[inline(never)]
    fn tilt(&mut self, normal: Vec3, constant: f64, z: Vec3, equality: bool) {
        self.push(Side { slack: dot(normal, z) + constant, rate: cross(z, normal), normal: Some(normal), equality });
    }

    /// An angle within a range, and the angular velocity's part in its rate.
    #[inline(never)]
    fn angle(&mut self, range: &Range, angle: f64, rate: Vec3) {
        let (offset, half) = (range.offset(angle), range.half());
        let side = |sign: f64| Side { slack: half + sign * offset, rate: scale(sign, rate), normal: None, equality: false };
        if range.is_fixed() {
            self.push(Side { equality: true, ..side(1.0) });
        } else if !range.is_free() {
            self.push(side(1.0));
            self.push(side(-1.0));
        }
    }

    /// An error that has to vanish.
    fn error(&mut self, slack: f64, rate: Vec3) {
        self.push(Side { slack, rate, normal: None, equality: true });
    }
}

impl OrientationVolume {
    /// Freedoms of the orientation: 3 minus the equalities among the sides.
    pub fn freedoms(&self) -> usize {
        let spin = usize::from(!self.spin.is_fixed());
        spin + match &self.shape {
            Shape::Cone(tilt) => 2 * usize::from(*tilt > 0.0),
            Shape::Pyramid(tilts) | Shape::Square(tilts) => tilts.iter().filter(|tilt| **tilt > 0.0).count(),
            Shape::Product(factors) => return product_freedoms(factors),
        }
    }

    /// Whether solvers take the volume as a task.
    ///
    /// # Errors
    /// Says why not: the bounds have to be smooth functions of the orientation, as many as [`MAX_SIDES`].
    pub fn check_as_task(&self) -> Result<()> {
        let refuse = |what: &str, expected: &str| Err(Error::value("volume", what, expected));
        let tiny = |tilt: &f64| *tilt > 0.0 && *tilt < SMALLEST;
        match &self.shape {
            Shape::Cone(tilt) if tiny(tilt) => refuse("a cone with a tilt below 1e-4", "a tilt of 0 or of 1e-4 rad and more as a task"),
            Shape::Pyramid(tilts) | Shape::Square(tilts) if tilts.iter().any(tiny) => {
                refuse("a volume with a tilt below 1e-4", "tilts of 0 or of 1e-4 rad and more as a task")
            }
            Shape::Pyramid([x, y]) if x.max(*y) > FRAC_PI_2 => {
                refuse("a pyramid or line with a tilt beyond a quarter turn", "tilts of pi/2 at most as a task")
            }
            Shape::Pyramid([_, y]) if !self.spin.is_free() && *y > FRAC_PI_2 - NEAR_GIMBAL => refuse(
                "a pyramid with bounded spin whose tilt about y reaches a quarter turn",
                "a tilt below pi/2 - 0.02 as a task, where the spin is defined",
            ),
            Shape::Square([x, y]) if x + y > FRAC_PI_2 => {
                refuse("a square whose corners reach the horizon", "tilts of pi/2 together at most as a task")
            }
            Shape::Product(factors) => check_product(factors),
            _ => Ok(()),
        }
    }

    /// The sides of the tool's axes, relative to those of the path's frame, both in the base frame.
    #[inline(never)]
    pub fn sides(&self, frame: &[Vec3; 3], tool: &[Vec3; 3]) -> Sides {
        let frame = Frame { axes: *frame, origin: [0.0; 3] };
        let volume = self.reference.axes().map(|axis| frame.rotate(axis));
        let mut out = Sides::NONE;
        match &self.shape {
            Shape::Cone(tilt) => cone_sides((*tilt, self.sine, self.cosine), &volume, tool, &mut out),
            Shape::Pyramid(tilts) => pyramid_sides(*tilts, &volume, tool, &mut out),
            Shape::Square(tilts) => square_sides(*tilts, &volume, tool, &mut out),
            Shape::Product(factors) => product_sides(factors, &volume, tool, &mut out),
        }
        match &self.shape {
            _ if self.spin.is_free() => {}
            Shape::Product(_) => {}
            Shape::Pyramid(_) => {
                let (angle, rate) = last_angle(&volume, tool);
                out.angle(&self.spin, angle, rate);
            }
            Shape::Cone(_) | Shape::Square(_) => {
                let (angle, rate) = twist(&volume, tool);
                out.angle(&self.spin, angle, rate);
            }
        }
        out
    }
}

/// The twist about z and its rate, w . (z + z') / (1 + z . z').
fn twist(volume: &[Vec3; 3], tool: &[Vec3; 3]) -> (f64, Vec3) {
    let angle = (dot(volume[1], tool[0]) - dot(volume[0], tool[1])).atan2(dot(volume[0], tool[0]) + dot(volume[1], tool[1]));
    let (z, axis) = (tool[2], volume[2]);
    (angle, scale(1.0 / (1.0 + dot(z, axis)).max(REVERSED), add(z, axis)))
}

/// The angle c of Qx(a) Qy(b) Qz(c) and its rate: w about the tool's axis, less what a changes of it.
fn last_angle(volume: &[Vec3; 3], tool: &[Vec3; 3]) -> (f64, Vec3) {
    let x = tool.map(|axis| dot(volume[0], axis));
    let c = (-x[1]).atan2(x[0]);
    let cosine = x[0].hypot(x[1]).max(REVERSED);
    // The axis of b before the spin is cos c y + sin c x of the tool; that of x less its part along z is the other.
    let across = scale(1.0 / cosine, sub(volume[0], scale(x[2], tool[2])));
    (c, sub(tool[2], scale(x[2] / cosine, across)))
}

fn cone_sides((tilt, sine, cosine): (f64, f64, f64), [x, y, axis]: &[Vec3; 3], tool: &[Vec3; 3], out: &mut Sides) {
    let z = tool[2];
    if tilt == 0.0 {
        out.tilt(*x, 0.0, z, true);
        out.tilt(*y, 0.0, z, true);
        out.tilt(*axis, 0.0, z, false);
    } else if tilt < std::f64::consts::PI {
        out.tilt(scale(1.0 / sine, *axis), -cosine / sine, z, false);
    }
}

/// |z . axis| <= sin(tilt).
fn band(tilt: f64, axis: Vec3, z: Vec3, out: &mut Sides) {
    if tilt == 0.0 {
        return out.tilt(axis, 0.0, z, true);
    }
    if tilt < FRAC_PI_2 - QUARTER {
        let (sine, cosine) = tilt.sin_cos();
        out.tilt(scale(-1.0 / cosine, axis), sine / cosine, z, false);
        out.tilt(scale(1.0 / cosine, axis), sine / cosine, z, false);
    }
}

fn pyramid_sides([about_x, about_y]: [f64; 2], [x, y, axis]: &[Vec3; 3], tool: &[Vec3; 3], out: &mut Sides) {
    let (z, (sine, cosine)) = (tool[2], about_x.sin_cos());
    if about_x == 0.0 {
        out.tilt(*y, 0.0, z, true);
        out.tilt(*axis, 0.0, z, false);
    } else if about_x < FRAC_PI_2 - QUARTER {
        for side in [cosine, -cosine] {
            out.tilt(add(scale(sine, *axis), scale(side, *y)), 0.0, z, false);
        }
    } else {
        out.tilt(*axis, 0.0, z, false);
    }
    band(about_y, *x, z, out);
}

fn square_sides([about_x, about_y]: [f64; 2], [x, y, axis]: &[Vec3; 3], tool: &[Vec3; 3], out: &mut Sides) {
    // The shadow says nothing of which way up: the axis has to be brought above the horizon first.
    if dot(*axis, tool[2]) < 0.0 {
        return out.tilt(*axis, 0.0, tool[2], false);
    }
    band(about_y, *x, tool[2], out);
    band(about_x, *y, tool[2], out);
}

/// The freedoms of a product: the rank of its axes as they lie in general.
fn product_freedoms(factors: &[Factor]) -> usize {
    // Angles that have nothing in common.
    let angles = factors
        .iter()
        .enumerate()
        .map(|(i, factor)| (factor, if factor.range.is_fixed() { factor.range.low } else { 1.0 + 0.7 * i as f64 }));
    let mut turned = Quaternion::IDENTITY;
    let mut basis: Vec<Vec3> = Vec::new();
    for (factor, angle) in angles {
        let axis = turned.rotate(factor.axis);
        turned = turned.product(&Quaternion::about(factor.axis, angle));
        let rest = basis.iter().fold(axis, |rest, e| sub(rest, scale(dot(rest, *e), *e)));
        if !factor.range.is_fixed() && norm(rest) > 1e-9 {
            basis.extend(unit(rest));
        }
    }
    basis.len()
}

fn check_product(factors: &[Factor]) -> Result<()> {
    let refuse = |what: String, expected: &str| Err(Error::value("volume", what, expected));
    if factors.len() > 3 {
        return refuse(format!("a product of {} rotations", factors.len()), "three rotations at most as a task");
    }
    if let Some(i) = factors.iter().position(|factor| factor.range.is_fixed()) {
        return refuse(format!("a product whose rotation {i} is fixed"), "ranges wider than 0 as a task");
    }
    if product_freedoms(factors) < factors.len() {
        return refuse("a product with rotations about the same axis one after another".into(), "as many freedoms as rotations as a task");
    }
    match factors {
        [a, b, c] if Lie::of([a, b, c]).is_singular_within(&b.range) => {
            refuse("a product whose three axes come to lie in a plane".into(), "a middle range without that as a task")
        }
        _ => Ok(()),
    }
}

#[inline(never)]
fn product_sides(factors: &[Factor], volume: &[Vec3; 3], tool: &[Vec3; 3], out: &mut Sides) {
    let seen = tool.map(|axis| volume.map(|v| dot(v, axis)));
    let q = Quaternion::from_axes(&seen);
    let base = Frame { axes: *volume, origin: [0.0; 3] };
    let axis_after = |turns: &[(&Factor, f64)], axis: Vec3| {
        let turned = turns.iter().fold(Quaternion::IDENTITY, |p, (factor, x)| p.product(&Quaternion::about(factor.axis, *x)));
        base.rotate(turned.rotate(axis))
    };
    match factors {
        [one] => {
            let x = 2.0 * dot(q.vector(), one.axis).atan2(q.0[0]);
            let axis = base.rotate(one.axis);
            for e in <[Vec3; 2]>::from(crate::linalg::vector::perpendicular(axis)) {
                let (error, rate) = error_along(e, &q.product(&Quaternion::about(one.axis, -x)), &base);
                out.error(error, rate);
            }
            out.angle(&one.range, x, axis);
        }
        [a, b] => {
            let [x, y] = product::solution_of_pair(a, b, &q);
            let (first, second) = (base.rotate(a.axis), axis_after(&[(a, x)], b.axis));
            let normal = unit(cross(first, second)).unwrap_or(first);
            let reached = Quaternion::about(a.axis, x).product(&Quaternion::about(b.axis, y));
            let (error, rate) = error_along(normal, &q.product(&reached.conjugate()), &base);
            out.error(error, rate);
            let [along_first, along_second] = rates_of_two(first, second);
            out.angle(&a.range, x, along_first);
            out.angle(&b.range, y, along_second);
        }
        [a, b, c] => {
            let of = |angles: &[f64; 3]| {
                factors.iter().zip(angles).map(|(f, x)| f.range.half() - f.range.offset(*x).abs()).fold(f64::INFINITY, f64::min)
            };
            let [one, two] = product::solutions([a, b, c], &q);
            let angles = if of(&two) > of(&one) { two } else { one };
            let axes = [base.rotate(a.axis), axis_after(&[(a, angles[0])], b.axis), axis_after(&[(a, angles[0]), (b, angles[1])], c.axis)];
            for i in 0..3 {
                let (next, last) = (axes[(i + 1) % 3], axes[(i + 2) % 3]);
                let normal = cross(next, last);
                let volume = dot(axes[i], normal);
                let rate = scale(1.0 / REVERSED.max(volume.abs()).copysign(volume), normal);
                out.angle(&factors[i].range, angles[i], rate);
            }
        }
        _ => {}
    }
}

/// The part along `e` (base frame) of the rotation from a product's nearest member, and its rate where that rotation is small.
fn error_along(e: Vec3, error: &Quaternion, base: &Frame) -> (f64, Vec3) {
    let (axis, angle) = error.axis_angle();
    (angle * dot(base.rotate(axis), e), e)
}

/// The rates of two angles for an angular velocity in the plane of their axes.
fn rates_of_two(first: Vec3, second: Vec3) -> [Vec3; 2] {
    let cosine = dot(first, second);
    let over = 1.0 / (1.0 - cosine * cosine).max(REVERSED);
    [scale(over, sub(first, scale(cosine, second))), scale(over, sub(second, scale(cosine, first)))]
}
