//! Which pairs are looked at.

use super::body::Body;
use super::separation::separation;
use crate::error::{Result, check_finite, check_vector};
use crate::kinematics::sized::joint_frames;
use crate::robot::Robot;

/// Two shapes whose distance matters. The first is a body of the robot, and normals lead away from it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Pair {
    /// A body and an obstacle, by their indices.
    Obstacle {
        /// The body.
        body: usize,
        /// The obstacle.
        obstacle: usize,
    },
    /// Two bodies, by their indices.
    Bodies {
        /// The first.
        first: usize,
        /// The second.
        second: usize,
    },
}

/// Pairs of bodies that may collide: all whose mounts are at least two joints apart, less those that are nearer than `clearance` \[m\] at the
/// posture `reference`, as neighbours of neighbours about a wrist always are.
pub fn self_pairs(robot: &Robot, bodies: &[Body], reference: &[f64], clearance: f64) -> Result<Vec<[usize; 2]>> {
    check_vector("reference", reference, robot.n())?;
    check_finite("clearance", &[clearance])?;
    for body in bodies {
        body.check(robot)?;
    }
    let links = joint_frames(robot, reference);
    let poses: Vec<_> = bodies.iter().map(|body| body.mount.frame(robot, &links).compose(&body.pose)).collect();
    let joints = |i: usize| bodies[i].mount.joints(robot);
    let mut pairs = Vec::new();
    for i in 0..bodies.len() {
        for k in i + 1..bodies.len() {
            let free = joints(i).abs_diff(joints(k)) > 1;
            if free && separation(&bodies[i].shape, &poses[i], &bodies[k].shape, &poses[k]).distance > clearance {
                pairs.push([i, k]);
            }
        }
    }
    Ok(pairs)
}
