//! All postures for a frame, of a robot of any number of joints: what is held, and what the limits leave.

use std::sync::Arc;

use super::analytic::{ArmAngle, Inverse, Solutions};
use crate::error::{Result, check_finite};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::robot::Robot;

/// Postures of a robot, one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Postures {
    n: usize,
    q: Vec<f64>,
    /// Of each, whether branches meet in it, or a joint of it may be chosen.
    pub singular: Vec<bool>,
    /// Whether there are no others.
    pub complete: bool,
}

impl<const N: usize> From<Solutions<N>> for Postures {
    fn from(found: Solutions<N>) -> Self {
        Self {
            n: N,
            q: found.q[..found.count].as_flattened().to_vec(),
            singular: found.singular[..found.count].to_vec(),
            complete: found.complete,
        }
    }
}

impl Postures {
    /// With joints held at coordinates [rad or m], six revolute ones being left; the last coordinate counts where a joint is given twice.
    pub fn with_fixed(robot: &Robot, target: &Frame, fixed: &[(usize, f64)]) -> Result<Self> {
        let found = Self::from(Inverse::new(Arc::new(robot.with_fixed(fixed)?))?.solve(target));
        let mut q = Vec::with_capacity(found.len() * robot.n());
        for row in found.rows() {
            let mut moving = row.iter();
            for joint in 0..robot.n() {
                let held = fixed.iter().rev().find(|(held, _)| *held == joint).map(|(_, value)| *value);
                q.push(held.or_else(|| moving.next().copied()).unwrap_or(f64::NAN));
            }
        }
        Ok(Self { n: robot.n(), q, ..found })
    }

    /// With the plane of a seven-axis arm at an angle \[rad\].
    pub fn with_arm_angle(robot: &Robot, target: &Frame, angle: f64) -> Result<Self> {
        check_finite("arm_angle", &[angle])?;
        Ok(ArmAngle::new(robot)?.solve(target, angle).into())
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.singular.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.singular.is_empty()
    }

    /// Joints of each.
    pub fn n(&self) -> usize {
        self.n
    }

    /// All numbers, posture by posture.
    pub fn as_slice(&self) -> &[f64] {
        &self.q
    }

    /// One after the other.
    pub fn rows(&self) -> std::slice::ChunksExact<'_, f64> {
        self.q.chunks_exact(self.n)
    }

    /// Those within the limits of the robot that they are of, put onto limits that they are on; with `turns`, a posture in all whole turns that the limits
    /// let its joints make, except those that are held.
    pub fn within_limits(&self, robot: &Robot, turns: bool, fixed: &[(usize, f64)]) -> Self {
        let mut kept = Self { n: self.n, q: Vec::new(), singular: Vec::new(), complete: self.complete };
        let is_turning = |i: usize| {
            let is_bounded = |(low, high): (f64, f64)| low.is_finite() && high.is_finite();
            turns && i < self.n && is_bounded(robot.limits().range(i)) && !fixed.iter().any(|(joint, _)| *joint == i)
        };
        let turning: [bool; MAX_JOINTS] = std::array::from_fn(is_turning);
        for (row, flag) in self.rows().zip(&self.singular) {
            let mut buffer = [0.0; MAX_JOINTS];
            let copy = &mut buffer[..self.n];
            copy.copy_from_slice(row);
            robot.turn_together(copy, fixed);
            robot.each_turn(copy, &turning, &mut |row| {
                kept.q.extend_from_slice(row);
                kept.singular.push(*flag);
            });
        }
        kept
    }
}
