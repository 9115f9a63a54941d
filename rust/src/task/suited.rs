//! A task without the directions in which a robot's tool cannot move.

use super::redundancy::POSTURES;
use super::{Projector, Reference, Task};
use crate::kinematics::jacobian_at;
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, norm, scale, sub, unit};
use crate::robot::{RandomPostures, Robot};

/// Velocities this near to zero, parallel or in a plane, over the largest, count as such.
const NEGLIGIBLE: f64 = 1e-9;

impl Task {
    /// The same without directions in which a robot's tool cannot move, where these stay the same: those of the base where a tool turns about one direction
    /// alone, or not at all, such as that of a SCARA or a planar arm. Any other task or robot has it unchanged.
    pub fn suited(&self, robot: &Robot) -> Self {
        if self.rank(robot) == self.dimension() {
            return *self;
        }
        let n = robot.n();
        let (mut angular, mut linear, mut tool) = (Vec::new(), Vec::new(), Frame::IDENTITY);
        let (mut postures, mut q) = (RandomPostures::new(1), [0.0; MAX_JOINTS]);
        for _ in 0..POSTURES {
            postures.fill(robot, &mut q[..n]);
            let (frame, columns) = jacobian_at(robot, &q[..n]);
            let arm = if let Reference::Part(part) = self.reference { sub(part.origin, frame.origin) } else { [0.0; 3] };
            angular.extend_from_slice(&columns.w[..n]);
            linear.extend(columns.w.iter().zip(&columns.v).take(n).map(|(w, v)| add(*v, cross(*w, arm))));
            tool = frame;
        }
        let (turns, moves) = (span(&angular), span(&linear));
        // The directions of the task in the base, if they stay where they are: those of a tool turn with it.
        let fixed = |projector: Projector| match (self.reference, turns, projector) {
            (Reference::Base, ..) | (_, _, Projector::All | Projector::None) => Some(projector),
            (Reference::Part(part), ..) => Some(turned(projector, &part)),
            (Reference::Tool, Projector::None, _) => Some(turned(projector, &tool)),
            (Reference::Tool, Projector::Line(u), Projector::Line(e) | Projector::Plane(e)) => {
                (norm(cross(tool.rotate(e), u)) <= NEGLIGIBLE).then(|| turned(projector, &tool))
            }
            _ => None,
        };
        let angular = match (fixed(self.angular), turns, self.angular) {
            (Some(projector), ..) => left_of(projector, turns),
            // About an axis that leans against the one that may spin.
            (None, Projector::Line(u), Projector::Plane(_)) => Projector::Line(u),
            _ => return *self,
        };
        let Some(linear) = fixed(self.linear).map(|projector| left_of(projector, moves)) else { return *self };
        match self.reference {
            // Everything is told in the base, at the point that the task speaks of.
            Reference::Tool | Reference::Base => Self { angular, linear, reference: Reference::Base },
            Reference::Part(part) => {
                let there = Frame { axes: Frame::IDENTITY.axes, origin: part.origin };
                Self { angular, linear, reference: Reference::Part(there) }
            }
        }
    }
}

/// A projector with its vector in the frame that a frame is given in.
fn turned(projector: Projector, frame: &Frame) -> Projector {
    match projector {
        Projector::Line(e) => Projector::Line(frame.rotate(e)),
        Projector::Plane(e) => Projector::Plane(frame.rotate(e)),
        isotropic => isotropic,
    }
}

/// What a projector sees of motions that are no others than these.
fn left_of(projector: Projector, motions: Projector) -> Projector {
    let line = |v: Vec3| if norm(v) > NEGLIGIBLE { unit(v).map_or(Projector::None, Projector::Line) } else { Projector::None };
    match (projector, motions) {
        (Projector::All, seen) | (seen, Projector::All) => seen,
        (Projector::None, _) | (_, Projector::None) => Projector::None,
        (Projector::Line(e), Projector::Line(d)) => {
            if dot(e, d).abs() > NEGLIGIBLE {
                projector
            } else {
                Projector::None
            }
        }
        (Projector::Line(e), Projector::Plane(m)) => {
            if norm(cross(e, m)) > NEGLIGIBLE {
                projector
            } else {
                Projector::None
            }
        }
        (Projector::Plane(n), Projector::Line(d)) => line(sub(d, scale(dot(n, d), n))),
        // A plane across the other is seen as a line.
        (Projector::Plane(n), Projector::Plane(m)) => {
            if dot(n, m).abs() > NEGLIGIBLE {
                projector
            } else {
                line(cross(n, m))
            }
        }
    }
}

/// The directions that vectors have.
fn span(vectors: &[Vec3]) -> Projector {
    let longest = |vectors: &mut dyn Iterator<Item = Vec3>| vectors.fold([0.0; 3], |best, v| if norm(v) > norm(best) { v } else { best });
    let first = longest(&mut vectors.iter().copied());
    let Some(e) = unit(first) else { return Projector::None };
    let unity = vectors.iter().map(|v| scale(1.0 / norm(first), *v));
    let across = longest(&mut unity.clone().map(|v| cross(e, v)));
    let Some(normal) = unit(across).filter(|_| norm(across) > NEGLIGIBLE) else { return Projector::Line(e) };
    if unity.fold(0.0f64, |most, v| most.max(dot(normal, v).abs())) <= NEGLIGIBLE { Projector::Plane(normal) } else { Projector::All }
}
