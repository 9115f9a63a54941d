//! Postures that have been checked against the robot and its task.

use crate::inverse::Solutions;
use crate::inverse::newton::reach;
use crate::kinematics::jacobian_at;
use crate::linalg::frame::Frame;
use crate::linalg::svd::Svd;
use crate::robot::{Joint, Robot, nearest_turn};
use crate::task::{Target, Task};

/// Error [rad, m over the size of the robot] below which nothing is polished.
const CLOSED: f64 = 4e-15;
/// Error below which a candidate is a solution.
const VERIFIED: f64 = 1e-10;
/// The same for a robot of fewer joints than the task asks for: how far a frame may be off what the robot can reach.
const REACHABLE: f64 = 1e-8;
/// Two postures this near to each other [rad, m over the size of the robot] are one.
const SAME: f64 = 1e-7;
/// The same where branches meet, which rounding splits.
const SAME_SINGULAR: f64 = 1e-6;
/// Least over largest singular value of the task's Jacobian at which branches meet.
const SINGULAR: f64 = 1e-7;

/// Postures of a robot of up to six joints for one target, without repetition.
pub struct Verified<'a> {
    robot: &'a Robot,
    task: &'a Task,
    size: f64,
    found: Solutions,
}

impl<'a> Verified<'a> {
    /// None yet; `size` is the length that tells what is small \[m\].
    pub fn new(robot: &'a Robot, task: &'a Task, size: f64) -> Self {
        Self { robot, task, size, found: Solutions::NONE }
    }

    pub fn robot(&self) -> &Robot {
        self.robot
    }

    pub fn is_empty(&self) -> bool {
        self.found.count == 0
    }

    /// What was found.
    pub fn solutions(self, complete: bool) -> Solutions {
        Solutions { complete: complete && self.found.complete, ..self.found }
    }

    /// Adds a posture, polished by at most `steps` of Newton, if it does the task, is new and has room; whether it did. With `regular` not where
    /// branches meet.
    pub fn add(&mut self, q: &[f64; 6], target: &Frame, steps: usize, regular: bool) -> bool {
        let (robot, n, count) = (self.robot, self.robot.n(), self.found.count);
        let mut q = *q;
        let wanted = Target { position: target.origin, axis: None, frame: target.axes };
        let error = reach(robot, None, self.task, &wanted, self.size, &mut q[..n], CLOSED, steps).error;
        let bar = if n < self.task.dimension() { REACHABLE } else { VERIFIED };
        if error.is_nan() || error > bar {
            return false;
        }
        robot.turn(&mut q[..n]);
        let singular = self.is_singular(&q[..n]);
        let is_known = (0..count).any(|i| self.is_same(&self.found.q[i], &q, singular || self.found.singular[i]));
        if is_known || (regular && singular) {
            return false;
        }
        self.found.push(q, count as u8, singular);
        self.found.count > count
    }

    fn is_same(&self, a: &[f64; 6], b: &[f64; 6], singular: bool) -> bool {
        let same = if singular { SAME_SINGULAR } else { SAME };
        (0..self.robot.n()).all(|k| match self.robot.joints()[k] {
            Joint::Revolute => nearest_turn(a[k] - b[k], 0.0).abs() <= same,
            Joint::Prismatic => (a[k] - b[k]).abs() <= same * self.size,
        })
    }

    /// Whether the task's Jacobian loses rank: coordinates over the size of the robot where they are lengths.
    fn is_singular(&self, q: &[f64]) -> bool {
        let (n, robot) = (self.robot.n(), self.robot);
        let (tool, columns) = jacobian_at(robot, q);
        let rows = self.task.directions(&tool, self.size).rows(&columns);
        // By joints, since there may be fewer of them than rows.
        let mut by_joint = [[0.0; 6]; 6];
        for (i, column) in by_joint.iter_mut().enumerate().take(n) {
            let unit = if robot.joints()[i] == Joint::Prismatic { self.size } else { 1.0 };
            (0..6).for_each(|r| column[r] = unit * rows[r][i]);
        }
        let sigma = Svd::<6>::new(&by_joint, 6, n).sigma;
        sigma[n - 1] <= SINGULAR * sigma[0]
    }
}
