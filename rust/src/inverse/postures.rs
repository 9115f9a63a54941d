//! Postures for a frame, of a robot of any number of joints, and what the limits leave of them.

use super::analytic::Solutions;
use super::any::TaskInverse;
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
        Self::first(N, &found)
    }
}

impl Postures {
    /// The first `n` coordinates of solutions.
    fn first<const N: usize>(n: usize, found: &Solutions<N>) -> Self {
        let rows = &found.q[..found.count];
        Self {
            n,
            q: if n == N { rows.as_flattened().to_vec() } else { rows.iter().flat_map(|q| &q[..n]).copied().collect() },
            singular: found.singular[..found.count].to_vec(),
            complete: found.complete,
        }
    }

    /// All of a robot for its task: by branch where branches have names, else in order of the joints.
    pub fn of(inverse: &TaskInverse, target: &Frame) -> Self {
        let found = Self::first(inverse.robot().n(), &inverse.solve(target));
        if inverse.has_branches() { found } else { found.sorted() }
    }

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

    /// Those within the limits of the robot that they are of, put onto limits that they are on; with `turns`, a posture in all whole turns that the limits
    /// let its joints make, except those that are held.
    pub fn within_limits(&self, robot: &Robot, turns: bool, fixed: &[(usize, f64)]) -> Self {
        let mut kept = Self { n: self.n, q: Vec::new(), singular: Vec::new(), complete: self.complete };
        let is_turning = |i: usize| {
            let is_bounded = |(low, high): (f64, f64)| low.is_finite() && high.is_finite();
            turns
                && i < self.n
                && robot.is_periodic(i)
                && is_bounded(robot.limits().range(i))
                && !fixed.iter().any(|(joint, _)| *joint == i)
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
