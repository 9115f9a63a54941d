//! Whole turns of the joints of a posture: copies of it that the limits tell apart.

use std::f64::consts::TAU;

use super::{AT_LIMIT, Robot};
use crate::linalg::MAX_JOINTS;

/// Turns to each side of the middle that are looked at where limits on combinations are to hold and a joint turns without end.
const AROUND: f64 = 1.5;

impl Robot {
    /// Takes revolute joints by whole turns to where their limits want them ([`super::Limits::turned`]): the same posture. Where a limit on a combination does not
    /// hold there, to the copy within all limits that is nearest to the middle, if there is one. Coordinates that are on a limit are put onto it.
    pub fn turn(&self, q: &mut [f64]) {
        for i in 0..self.joints.len().min(q.len()) {
            if self.is_periodic(i) {
                q[i] = self.limits.turned(i, q[i]);
            }
        }
        self.turn_together(q, &[]);
        self.limits.settle(q);
    }

    /// The second part of [`Robot::turn`], but for joints that are held.
    #[inline]
    pub fn turn_together(&self, q: &mut [f64], held: &[(usize, f64)]) {
        if !self.limits.coupled.is_empty() && !self.limits.contain(q) {
            self.to_nearest_within(q, held);
        }
    }

    #[cold]
    #[inline(never)]
    fn to_nearest_within(&self, q: &mut [f64], held: &[(usize, f64)]) {
        let is_free = |i: usize| held.iter().all(|(joint, _)| *joint != i);
        let is_coupled = |i: usize| self.limits.coupled.iter().any(|combination| combination.row[i] != 0.0);
        let turning: [bool; MAX_JOINTS] = std::array::from_fn(|i| i < q.len() && is_free(i) && is_coupled(i));
        let (mut best, mut least) = ([0.0; MAX_JOINTS], f64::INFINITY);
        self.each_turn(q, &turning, &mut |copy| {
            let distance = self.distance_from_middle(copy);
            if distance < least {
                least = distance;
                best[..copy.len()].copy_from_slice(copy);
            }
        });
        if least.is_finite() {
            q.copy_from_slice(&best[..q.len()]);
        }
    }

    /// The coordinates that a joint is looked at in: what all limits leave it, no more than a few turns where that has no end.
    pub fn span(&self, i: usize) -> (f64, f64) {
        let (low, high) = self.limits.range(i);
        if low.is_finite() && high.is_finite() {
            return (low, high);
        }
        let middle = 0f64.max(low).min(high);
        (low.max(middle - AROUND * TAU), high.min(middle + AROUND * TAU))
    }

    /// Calls `each` with every copy of a posture within the limits, put onto those that it is on; revolute joints that are `turning` are tried in every whole
    /// turn, the others stay.
    pub fn each_turn(&self, q: &mut [f64], turning: &[bool], each: &mut dyn FnMut(&[f64])) {
        self.turns_from(0, q, turning, each);
    }

    fn turns_from(&self, joint: usize, q: &mut [f64], turning: &[bool], each: &mut dyn FnMut(&[f64])) {
        if joint == q.len() {
            let mut row = [0.0; MAX_JOINTS];
            row[..joint].copy_from_slice(q);
            if self.limits.settle(&mut row[..joint]) {
                each(&row[..joint]);
            }
            return;
        }
        let given = q[joint];
        if !turning[joint] || !self.is_periodic(joint) {
            if self.limits.admit(joint, given) {
                self.turns_from(joint + 1, q, turning, each);
            }
            return;
        }
        let (low, high) = self.span(joint);
        let first = ((low - AT_LIMIT - given) / TAU).ceil();
        let last = ((high + AT_LIMIT - given) / TAU).floor();
        let mut turn = first;
        while turn <= last {
            q[joint] = given + TAU * turn;
            self.turns_from(joint + 1, q, turning, each);
            turn += 1.0;
        }
        q[joint] = given;
    }
}
