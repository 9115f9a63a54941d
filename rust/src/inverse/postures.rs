//! Postures for a frame, of a robot of any number of joints, and what the limits leave of them.

use super::analytic::Solutions;
use crate::linalg::MAX_JOINTS;
use crate::robot::{Joint, Limits, Robot};
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
    /// None yet, of a robot of `n` joints.
    pub fn none(n: usize, complete: bool) -> Self {
        Self { n, q: Vec::new(), singular: Vec::new(), complete }
    }

    /// One more, whether it is singular beside it.
    pub fn push(&mut self, q: impl IntoIterator<Item = f64>, singular: bool) {
        self.q.extend(q);
        self.singular.push(singular);
    }

    /// Makes room for so many more.
    pub(super) fn reserve(&mut self, count: usize) {
        self.q.reserve(count * self.n);
        self.singular.reserve(count);
    }

    /// All numbers, and of each posture whether it is singular.
    pub fn into_parts(self) -> (Vec<f64>, Vec<bool>) {
        (self.q, self.singular)
    }

    /// Those of another answer behind its own.
    pub fn append(&mut self, other: &Self) {
        self.q.extend_from_slice(&other.q);
        self.singular.extend_from_slice(&other.singular);
        self.complete &= other.complete;
    }

    /// Those whose numbers are given, in that order.
    pub(super) fn ordered(&self, order: &[usize]) -> Self {
        let mut out = Self::none(self.n, self.complete);
        for &i in order {
            out.push(self.row(i).iter().copied(), self.singular[i]);
        }
        out
    }

    /// In the order of the first joint, where it is the same of the second, and so on.
    pub(super) fn sorted(&self) -> Self {
        let by_joint = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a.total_cmp(b)).find(|order| order.is_ne());
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.sort_by(|&a, &b| by_joint(self.row(a), self.row(b)).unwrap_or(std::cmp::Ordering::Equal));
        self.ordered(&order)
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

    /// The joints of one.
    pub(super) fn row(&self, i: usize) -> &[f64] {
        &self.q[i * self.n..(i + 1) * self.n]
    }

    /// The joints of one, to be changed.
    pub(super) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.q[i * self.n..(i + 1) * self.n]
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
                turns && !held && robot.joints()[i] == Joint::Revolute && robot.limits().is_bounded(i)
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
