//! Singularities of a robot on the way along a path.

use super::problem::PathProblem;
use crate::kinematics::jacobian_at;
use crate::linalg::lu::Lu;
use crate::linalg::svd::Svd;
use crate::linalg::{MAX_JOINTS, Row6};
use crate::robot::Robot;
use crate::task::Task;

/// A singular value below this part of the largest is none: a condition number above its inverse has no digit left that tells it from infinity
/// by much.
const NEGLIGIBLE: f64 = 1e-12;
/// A singularity is near where they are this far apart: joints move fast there.
const CLOSE: f64 = 0.02;
/// A joint that moves further than this from a point to the next [rad or m] jumps: it passes through nothing.
const JUMP: f64 = 0.5;
/// A motion of the joints [rad or m] that leads out of a singularity.
const ASIDE: f64 = 1e-6;
/// How much a value that is infinite in a singularity falls on that way, at least.
const FALL: f64 = 100.0;

/// Tells postures in which a robot has less freedom than elsewhere.
pub(super) struct Singularities<'a> {
    robot: &'a Robot,
    /// Directions in which the tool can move at most postures.
    rank: usize,
    /// What angles are weighed by against distances [m].
    length: f64,
}

impl<'a> Singularities<'a> {
    /// Of a robot.
    pub fn of(robot: &'a Robot) -> Self {
        Self { robot, rank: Task::FULL.rank(robot), length: robot.size() }
    }

    /// Whether a posture is singular.
    pub fn has(&self, q: &[f64]) -> bool {
        self.distance(q) <= NEGLIGIBLE
    }

    /// Whether a posture is near a singularity.
    pub fn near(&self, q: &[f64]) -> bool {
        self.distance(q) <= CLOSE
    }

    /// The least singular value over the largest.
    fn distance(&self, q: &[f64]) -> f64 {
        let (tool, columns) = jacobian_at(self.robot, q);
        let rows = Task::FULL.directions(&tool, self.length).rows(&columns);
        let sigma: Row6 = Svd::<MAX_JOINTS>::new(&rows, self.robot.n(), 6).sigma;
        if self.rank > 0 { sigma[self.rank - 1] / sigma[0] } else { 1.0 }
    }

    /// On which side of a singularity a posture is: the sign of the determinant, for a robot that has one.
    fn side(&self, q: &[f64]) -> Option<bool> {
        if self.robot.n() != 6 || self.rank != 6 {
            return None;
        }
        let columns = jacobian_at(self.robot, q).1;
        Some(Lu::<6>::new(std::array::from_fn(|i| columns.column(i))).determinant() > 0.0)
    }

    /// The points whose postures are singular, and those after which the way crosses a singularity on the way to the next; of the points from 0
    /// on, `followed` telling which are.
    pub fn on(&self, q: &[f64], followed: &[bool]) -> (Vec<usize>, Vec<usize>) {
        let (mut at, mut after) = (Vec::new(), Vec::new());
        let mut before: Option<(usize, bool, &[f64])> = None;
        for (point, row) in q.chunks_exact(self.robot.n()).enumerate().filter(|(point, _)| followed[*point]) {
            if self.has(row) {
                at.push(point);
                before = None;
                continue;
            }
            let side = self.side(row);
            if let (Some((last, old, from)), Some(new)) = (before, side)
                && last + 1 == point
                && old != new
                && from.iter().zip(row).all(|(a, b)| (a - b).abs() <= JUMP)
            {
                after.push(last);
            }
            before = side.map(|side| (point, side, row));
        }
        (at, after)
    }
}

impl PathProblem {
    /// Whether the objective has no finite value at a singular posture: what rounding makes of it there falls at once beside it.
    pub(super) fn is_infinite(&self, q: &[f64], value: f64) -> bool {
        if self.objective.is_none() || !value.is_finite() {
            return self.objective.is_some();
        }
        // Not along one joint: some change nothing.
        let aside: Vec<f64> = q.iter().enumerate().map(|(i, x)| x + ASIDE * (1.0 + 0.1 * i as f64)).collect();
        value.abs() >= FALL * self.values(&aside)[0].abs()
    }
}
