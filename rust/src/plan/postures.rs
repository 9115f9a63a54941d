//! Postures at a point of the path by Newton from several starts: what a grid of held joints may miss.

use super::problem::{ON_PATH, PathProblem};
use crate::inverse::reach;
use crate::linalg::MAX_JOINTS;
use crate::robot::{AT_LIMIT, RandomPostures, Robot};
use crate::task::{Target, Task};

/// Random postures from which Newton starts.
const STARTS: usize = 48;
/// Newton steps from each.
const STEPS: usize = 60;
/// Error at which they end [rad, m over the length].
const REACHED: f64 = 1e-12;
/// Postures whose joints are all nearer to each other than this [rad or m] are one.
const APART: f64 = 1e-3;

/// Postures at a point of the path, n joints a row, within the limits where these hold, each once: from random starts, the same ones every time.
/// None proves nothing, but any is one.
pub(super) fn postures_by_newton(problem: &PathProblem, point: usize) -> Vec<f64> {
    let n = problem.n();
    let mut found: Vec<f64> = Vec::new();
    let mut starts = RandomPostures::new(3);
    let mut q = [0.0; MAX_JOINTS];
    for _ in 0..STARTS {
        starts.fill(&problem.robot, &mut q[..n]);
        let q = &mut q[..n];
        if lands(&problem.robot, &problem.asked, &problem.targets[point], problem.length, problem.limits, q) {
            let is_known = |row: &[f64]| row.iter().zip(&*q).all(|(a, b)| (a - b).abs() < APART);
            if problem.allows_turn(point, q) && !found.chunks_exact(n).any(is_known) {
                found.extend_from_slice(q);
            }
        }
    }
    found
}

/// Whether Newton finds any posture at a target, from random starts, within the limits if so asked.
pub(super) fn is_reached(robot: &Robot, task: &Task, target: &Target, length: f64, limits: bool) -> bool {
    let mut starts = RandomPostures::new(3);
    let mut q = vec![0.0; robot.n()];
    (0..STARTS).any(|_| {
        starts.fill(robot, &mut q);
        lands(robot, task, target, length, limits, &mut q)
    })
}

/// Brings a posture onto a target, within the limits if so asked; whether it gets there.
#[inline(never)]
pub(super) fn lands(robot: &Robot, task: &Task, target: &Target, length: f64, limits: bool, q: &mut [f64]) -> bool {
    let within = limits.then(|| robot.limits());
    reach(robot, within, task, target, length, q, REACHED, STEPS).error <= ON_PATH && within.is_none_or(|limits| limits.settle(q))
}

impl PathProblem {
    /// Whether the orientation of a posture is within the volume that is asked for, and its spin within its range.
    pub(super) fn allows_turn(&self, point: usize, q: &[f64]) -> bool {
        self.is_member(point, q) && self.allows_spin(point, q)
    }

    /// Whether the spin of a posture is within its range.
    pub(super) fn allows_spin(&self, point: usize, q: &[f64]) -> bool {
        self.spin.is_none_or(|_| {
            let (spin, (low, high)) = self.spin_of(point, q);
            spin >= low - AT_LIMIT && spin <= high + AT_LIMIT
        })
    }
}
