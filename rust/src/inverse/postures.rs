//! All postures for a frame, of a robot of any number of joints: what is held, and what the limits leave.

use std::sync::Arc;

use super::analytic::{ArmAngle, Inverse, Solutions};
use crate::error::{Result, check_finite};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::robot::{Limits, Robot};
use std::f64::consts::TAU;

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

    /// Those within the limits of the robot that they are of; with `turns`, a posture in all whole turns that the limits let its joints make,
    /// except those that are held.
    pub fn within_limits(&self, robot: &Robot, turns: bool, fixed: &[(usize, f64)]) -> Self {
        let mut kept = Self { n: self.n, q: Vec::new(), singular: Vec::new(), complete: self.complete };
        let turning: Vec<bool> = (0..self.n)
            .map(|i| {
                let held = fixed.iter().any(|(joint, _)| *joint == i);
                turns && !held && robot.is_periodic(i) && robot.limits().is_bounded(i)
            })
            .collect();
        for (row, flag) in self.rows().zip(&self.singular) {
            let mut buffer = [0.0; MAX_JOINTS];
            buffer[..self.n].copy_from_slice(row);
            each_turn(robot.limits(), &turning, &mut buffer[..self.n], 0, &mut |row| {
                kept.q.extend_from_slice(row);
                kept.singular.push(*flag);
            });
        }
        kept
    }
}

/// Calls `each` with the posture if it is within the limits; joints from `joint` on that are `turning` in every whole turn.
fn each_turn(limits: &Limits, turning: &[bool], row: &mut [f64], joint: usize, each: &mut impl FnMut(&[f64])) {
    if joint == row.len() {
        return each(row);
    }
    let (low, high) = (limits.q_min[joint], limits.q_max[joint]);
    let given = row[joint];
    let first = if turning[joint] { given + TAU * ((low - given) / TAU).ceil() } else { given };
    let copies = if turning[joint] { ((high - first) / TAU).floor() + 1.0 } else { 1.0 };
    for copy in 0..copies.max(0.0) as usize {
        row[joint] = first + TAU * copy as f64;
        if row[joint] >= low && row[joint] <= high {
            each_turn(limits, turning, row, joint + 1, each);
        }
    }
    row[joint] = given;
}
