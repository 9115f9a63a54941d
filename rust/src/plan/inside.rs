//! Postures drawn away from the bounds of a volume of orientations: a barrier that starts at its wall stays there.

use super::frames::tools;
use super::problem::{ON_PATH, PathProblem};
use crate::inverse::reach;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, dot, norm, scale};
use crate::task::{Target, Task};

/// Times that the bounds are looked at: what leads away from one may lead to another.
const ROUNDS: usize = 3;
/// Error at which Newton ends [rad, m over the length], and its steps at most.
const REACHED: f64 = 1e-12;
const STEPS: usize = 20;
/// Largest turn \[rad\]: postures further out are on another way.
const LARGEST: f64 = 0.5;

impl PathProblem {
    /// Turns the tools of postures of the points from `first` on, where they are, until they have some room to all bounds of the volume; those that do not
    /// get there, within limits, stay.
    pub(super) fn draw_inside(&self, first: usize, q: &mut [f64]) {
        if self.volume.is_none() {
            return;
        }
        for (i, row) in q.chunks_exact_mut(self.n()).enumerate() {
            if self.pins.posture(first + i).is_none()
                && let Some(there) = self.drawn_inside(first + i, row)
            {
                row.copy_from_slice(&there);
            }
        }
    }

    /// `None` where there is room, or it is not reached.
    fn drawn_inside(&self, point: usize, q: &[f64]) -> Option<Vec<f64>> {
        let now = tools(&self.robot, q)[0];
        let (mut tool, mut turned) = (now, 0.0);
        for _ in 0..ROUNDS {
            let turn = self.turn_inside(point, &tool)?;
            let angle = norm(turn);
            if angle == 0.0 {
                break;
            }
            turned += angle;
            let about = Frame::rotation(scale(1.0 / angle, turn), angle);
            tool.axes = tool.axes.map(|axis| about.rotate(axis));
        }
        if turned == 0.0 || turned > LARGEST {
            return None;
        }
        let target = Target { position: self.targets[point].position, axis: None, frame: tool.axes };
        let (mut there, limits) = (q.to_vec(), self.limits.then(|| self.robot.limits()));
        let task = Task::FULL.suited(&self.robot);
        let error = reach(&self.robot, None, &task, &target, self.length, &mut there, REACHED, STEPS).error;
        let near = there.iter().zip(q).all(|(a, b)| (a - b).abs() <= LARGEST);
        (error <= ON_PATH && near && limits.is_none_or(|limits| limits.contain(&there) || !limits.contain(q))).then_some(there)
    }

    /// The turn that leads a tool away from the bounds that it has no room to.
    fn turn_inside(&self, point: usize, tool: &Frame) -> Option<Vec3> {
        let sides = self.sides_of(point, tool)?;
        let missing = sides.as_slice().iter().zip(&self.room[..]).filter(|(side, room)| side.slack < **room);
        Some(missing.fold([0.0; 3], |turn, (side, room)| {
            let square = dot(side.rate, side.rate);
            if square > 0.0 { add(turn, scale((room - side.slack) / square, side.rate)) } else { turn }
        }))
    }
}
