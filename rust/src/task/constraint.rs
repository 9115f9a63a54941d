//! The task as an equality constraint h(q) = 0 on the way to a target, and its derivative.

use super::error::{about_part, rotation_vector};
use super::{Directions, Projector, Reference, Target, Task};
use crate::kinematics::sized::Jacobian;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub};
use crate::linalg::{Row6, Rows6};

/// Below this angle \[rad\] a series replaces the quotient of the derivative of a rotation vector, which would lose its digits.
const SMALL_ANGLE: f64 = 1e-3;

/// Rows that act on twists [w; v] of the tool point: minus the derivative of the components h of [`Task::error`], angular ones times the length.
///
/// Where the error is zero the derivative is exact; away from there that of the rotation of a tool's axis is its limit, as in (4.11) of Leger 2014.
#[derive(Debug, Clone, Copy)]
pub struct Constraint {
    rows: [(Vec3, Vec3); 6],
    count: usize,
}

impl Constraint {
    /// The rows of a twist projector at a posture: those of a target there.
    #[inline(always)]
    pub fn of(directions: &Directions) -> Self {
        let (angular, linear) = directions.counts;
        let mut rows = [([0.0; 3], [0.0; 3]); 6];
        for (row, e) in rows.iter_mut().zip(&directions.angular[..angular]) {
            row.0 = scale(directions.length, *e);
        }
        for (row, e) in rows[angular..].iter_mut().zip(&directions.linear[..linear]) {
            *row = (cross(directions.arm, *e), *e);
        }
        Self { rows, count: angular + linear }
    }

    /// Number of components.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        self.count
    }

    /// The components of a twist of the tool point.
    #[inline(always)]
    pub fn reduce(&self, w: Vec3, v: Vec3) -> Row6 {
        self.rows.map(|(a, l)| dot(a, w) + dot(l, v))
    }

    /// The transpose of [`Constraint::reduce`]: the wrench [moment; force] at the tool point of forces along the components.
    #[inline(always)]
    pub fn expand(&self, forces: &Row6) -> (Vec3, Vec3) {
        let (mut moment, mut force) = ([0.0; 3], [0.0; 3]);
        for ((a, l), x) in self.rows.iter().zip(forces) {
            moment = add(moment, scale(*x, *a));
            force = add(force, scale(*x, *l));
        }
        (moment, force)
    }

    /// The constraint's Jacobian, -dh/dq, by rows.
    #[inline(always)]
    pub fn jacobian<const C: usize>(&self, jacobian: &Jacobian<C>) -> Rows6<C> {
        let mut out = [[0.0; C]; 6];
        for i in 0..jacobian.n() {
            let column = self.reduce(jacobian.w[i], jacobian.v[i]);
            for r in 0..6 {
                out[r][i] = column[r];
            }
        }
        out
    }
}

impl Task {
    /// The constraint that a target is: minus the derivative of the components of [`Task::error`], which are `directions.reduce(error)`.
    #[inline(never)]
    pub fn constraint(&self, tool: &Frame, target: &Target, length: f64) -> Constraint {
        let directions = self.directions(tool, length);
        let mut out = Constraint::of(&directions);
        let (angular, linear) = directions.counts;
        if let Projector::Line(_) = self.angular {
            let e = directions.angular[0];
            let turned = self.turned_component(e, tool, target);
            out.rows[0].0 = scale(length, turned);
            // The part's origin moves with that component of the turn alone.
            for (a, l) in &mut out.rows[angular..angular + linear] {
                *a = scale(dot(*l, cross(e, directions.arm)), turned);
            }
        }
        let translation = sub(target.position, tool.origin);
        for (a, l) in &mut out.rows[angular..angular + linear] {
            match self.reference {
                // Free to turn in any way, a tool is not told about which point.
                Reference::Part(_) if self.angular == Projector::None => *a = [0.0; 3],
                // The target turns about the part with the tool.
                Reference::Part(part) => {
                    if let (Projector::Plane(axis), false) = (self.angular, self.linear == Projector::All) {
                        let (axis, (_, position)) = (part.rotate(axis), about_part(&part, axis, tool, target));
                        *a = add(*a, scale(dot(*l, cross(axis, sub(tool.origin, position))), axis));
                    }
                }
                // Directions that turn with the tool.
                Reference::Tool if self.linear != Projector::All => *a = add(*a, cross(translation, *l)),
                _ => {}
            }
        }
        out
    }

    /// Whether the constraint's directions turn or move along the free motion, so that its second derivative is more than that of the tool's pose.
    pub(crate) fn turns_with_free_motion(&self) -> bool {
        match (self.angular, self.reference) {
            (Projector::All, _) => false,
            (Projector::Line(_), _) | (Projector::Plane(_), Reference::Part(_)) => true,
            (_, Reference::Tool) => self.linear != Projector::All,
            (_, Reference::Base) | (Projector::None, Reference::Part(_)) => false,
        }
    }

    /// The angular velocity that changes the component along `e` of the rotation vector to the target, minus its derivative: `e` turns with the tool,
    /// or stands still.
    fn turned_component(&self, e: Vec3, tool: &Frame, target: &Target) -> Vec3 {
        let phi = rotation_vector(&tool.axes, &target.frame);
        let half = scale(if self.reference == Reference::Tool { 0.5 } else { -0.5 }, cross(phi, e));
        let angle = norm(phi);
        // (1 - (a/2) cot(a/2)) / a^2 of the inverse of the derivative of the exponential map.
        let factor = if angle < SMALL_ANGLE {
            1.0 / 12.0 + angle * angle / 720.0
        } else {
            (1.0 - 0.5 * angle / (0.5 * angle).tan()) / (angle * angle)
        };
        add(add(e, half), scale(factor, cross(phi, cross(phi, e))))
    }
}
