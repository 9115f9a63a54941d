//! A task without the directions in which a robot's tool cannot move.

use super::redundancy::POSTURES;
use super::{Projector, Reference, Task};
use crate::kinematics::jacobian_at;
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, cross, dot, norm, scale, unit};
use crate::robot::{RandomPostures, Robot};

/// Velocities this near to zero, parallel or in a plane, over the largest, count as such.
const NEGLIGIBLE: f64 = 1e-9;

impl Task {
    /// The same for a robot whose tool turns about one direction alone, or not at all, such as a SCARA or a planar arm: of the directions of a tool
    /// task, those of the base in which the tool can move. Any other task or robot has it unchanged.
    pub fn suited(&self, robot: &Robot) -> Self {
        if self.reference != Reference::Tool || self.linear != Projector::All || self.rank(robot) == self.dimension() {
            return *self;
        }
        let n = robot.n();
        let (mut angular, mut linear, mut tool) = (Vec::new(), Vec::new(), Frame::IDENTITY);
        let (mut postures, mut q) = (RandomPostures::new(1), [0.0; MAX_JOINTS]);
        for _ in 0..POSTURES {
            postures.fill(robot, &mut q[..n]);
            let (frame, columns) = jacobian_at(robot, &q[..n]);
            angular.extend_from_slice(&columns.w[..n]);
            linear.extend_from_slice(&columns.v[..n]);
            tool = frame;
        }
        let angular = match (span(&angular), self.angular) {
            (Projector::None, _) => Projector::None,
            // A turn about the axis that may spin.
            (Projector::Line(u), Projector::Plane(axis)) if norm(cross(tool.rotate(axis), u)) <= NEGLIGIBLE => Projector::None,
            (Projector::Line(u), Projector::All | Projector::Plane(_)) => Projector::Line(u),
            _ => return *self,
        };
        Self { angular, linear: span(&linear), reference: Reference::Base }
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
