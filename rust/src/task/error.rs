//! The small motion that takes the tool to its target.

use super::projector::Projector;
use super::{Reference, Target, Task};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, perpendicular, scale, sub};

/// Axes this close to opposite \[rad\] have no usable direction to turn in: any perpendicular will do.
const OPPOSITE: f64 = 1e-8;

/// A rotation whose angle has a sine below this \[rad\], beyond a quarter turn, is close to half a turn: the sum of cross products that gives
/// its axis elsewhere loses the digits.
const NEAR_HALF_TURN: f64 = 1e-6;

impl Task {
    /// The small motion [w; v] that takes the tool to its target: a rotation vector and a translation (Leger 2014, eq. 4.34, from the
    /// actual to the desired pose), without what the task leaves free. Opposite axes are turned about any perpendicular.
    #[inline(never)] // eight kilobytes of machine code, called from everywhere
    pub fn error(&self, tool: &Frame, target: &Target) -> (Vec3, Vec3) {
        let v = sub(target.position, tool.origin);
        match (self.angular, self.reference) {
            (Projector::Plane(axis), Reference::Tool) => (turn(tool.rotate(axis), target.axis_of(axis)), self.linear_part(tool, v)),
            (Projector::Plane(axis), Reference::Base) => (about_fixed(axis, tool, target).0, self.linear_part(tool, v)),
            (Projector::Plane(axis), Reference::Part(part)) => {
                let (w, position) = about_part(&part, axis, tool, target);
                let (_, v) = self.directions(tool, 1.0).linear_at(w, sub(position, tool.origin));
                (w, v)
            }
            (Projector::None, _) => ([0.0; 3], self.linear_part(tool, v)),
            (Projector::Line(_) | Projector::All, _) => {
                let directions = self.directions(tool, 1.0);
                let (w, _) = directions.project(rotation_vector(&tool.axes, &target.frame), [0.0; 3]);
                directions.linear_at(w, v)
            }
        }
    }

    /// The part of a translation that matters, for tasks that speak of the tool point.
    #[inline(never)]
    fn linear_part(&self, tool: &Frame, v: Vec3) -> Vec3 {
        if self.linear == Projector::All { v } else { self.directions(tool, 1.0).project([0.0; 3], v).1 }
    }
}

impl super::Directions {
    /// The rotation `w`, and the translation `v` without what the task leaves free at the point that it speaks of.
    #[inline(always)]
    fn linear_at(&self, w: Vec3, v: Vec3) -> (Vec3, Vec3) {
        let at = add(v, cross(w, self.arm));
        let mut kept = [0.0; 3];
        for e in self.linear.iter().take(self.counts.1) {
            kept = add(kept, scale(dot(*e, at), *e));
        }
        (w, sub(kept, cross(w, self.arm)))
    }
}

impl Target {
    /// Where the tool's `axis` has to point.
    #[inline(always)]
    fn axis_of(&self, axis: Vec3) -> Vec3 {
        self.axis.unwrap_or_else(|| self.rotate(axis))
    }

    /// A vector of the wanted tool frame in the base frame.
    fn rotate(&self, a: Vec3) -> Vec3 {
        Frame { axes: self.frame, origin: [0.0; 3] }.rotate(a)
    }
}

/// The shortest rotation to the target when a turn about `axis` of a part is free, and the target's position, turned about that axis to where it is
/// nearest.
pub(super) fn about_part(part: &Frame, axis: Vec3, tool: &Frame, target: &Target) -> (Vec3, Vec3) {
    let axis = part.rotate(axis);
    let (w, spin) = about_fixed(axis, tool, target);
    let about = Frame::rotation(axis, -spin);
    (w, add(part.origin, about.rotate(sub(target.position, part.origin))))
}

/// The shortest rotation to the wanted orientation when a further turn about the base frame's unit vector `axis` is free, and the angle of
/// that free turn.
fn about_fixed(axis: Vec3, tool: &Frame, target: &Target) -> (Vec3, f64) {
    // The vector of the tool that the wanted orientation takes to the axis.
    let wanted = Frame { axes: target.frame, origin: [0.0; 3] };
    let body = wanted.unrotate(axis);
    let w = turn(tool.rotate(body), axis);
    let angle = norm(w);
    let swing = Frame::rotation(if angle > 0.0 { scale(1.0 / angle, w) } else { axis }, angle);
    let reached = tool.axes.map(|e| swing.rotate(e));
    let rest = rotation_vector(&reached, &target.frame);
    (w, dot(rest, axis))
}

/// The rotation vector that turns unit vector `from` onto `to` along the shortest way.
#[inline(always)]
fn turn(from: Vec3, to: Vec3) -> Vec3 {
    let normal = cross(from, to);
    let sine = norm(normal);
    let cosine = dot(from, to);
    if cosine >= 0.0 || sine > OPPOSITE {
        scale(if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 }, normal)
    } else {
        scale(std::f64::consts::PI, perpendicular(from).0)
    }
}

/// The rotation vector that turns the axes `from` onto the axes `to`.
pub(crate) fn rotation_vector(from: &[Vec3; 3], to: &[Vec3; 3]) -> Vec3 {
    // Twice the sine times the axis is the sum of cross products of corresponding axes.
    let double = add(add(cross(from[0], to[0]), cross(from[1], to[1])), cross(from[2], to[2]));
    let sine = 0.5 * norm(double);
    let cosine = 0.5 * (dot(from[0], to[0]) + dot(from[1], to[1]) + dot(from[2], to[2]) - 1.0);
    if sine > NEAR_HALF_TURN || cosine > 0.0 {
        let factor = if sine > 0.0 { sine.atan2(cosine) / sine } else { 1.0 };
        return scale(0.5 * factor, double);
    }
    // Half a turn: its axis is the sum of a from axis and its image, for the pair that differs least.
    let mut axis = [0.0; 3];
    for i in 0..3 {
        let sum = add(from[i], to[i]);
        if norm(sum) > norm(axis) {
            axis = sum;
        }
    }
    scale(std::f64::consts::PI / norm(axis), axis)
}
