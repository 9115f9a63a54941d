//! Postures in order of their nearness to a given one. What may be chosen in a singular posture stays as the given one has it.

use super::newton::reach_holding;
use super::postures::Postures;
use super::singularity::null_joints;
use crate::linalg::frame::Frame;
use crate::linalg::{MAX_JOINTS, with_capacity};
use crate::robot::{Joint, Robot, nearest_turn};
use crate::task::{Target, Task};

/// Error of a pose below which a posture that was moved counts as a solution: that of the solver.
const VERIFIED: f64 = 1e-10;
/// Error at which a step along the free motion ends [rad, m over the size of the robot].
const EXACT: f64 = 1e-15;
/// Newton steps back to the frame.
const STEPS: usize = 40;
/// Longest step of a joint along the free motion \[rad\]: the next branch is farther.
const STRIDE: f64 = 0.2;
/// Shortest one: where two branches only meet, the tool misses its frame by the square of it.
const LEAST_STRIDE: f64 = 1e-3;
/// Steps along the free motion: half a turn takes a tenth of them.
const MOST_STEPS: usize = 160;
/// How far inside its limits a joint is put \[rad\]: rounding does not take it out again.
const INSIDE: f64 = 1e-9;
/// Postures nearer to each other than this \[rad\] are one.
const SAME: f64 = 1e-7;

/// A joint that may be chosen in singular postures, and those that are held while it moves, one bit a joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stay {
    pub joint: usize,
    pub held: u32,
}

impl Stay {
    /// Any of some joints, the first ones first, while others are held.
    pub fn in_order(joints: impl Iterator<Item = usize>, fixed: &[(usize, f64)]) -> Vec<Self> {
        let held = fixed.iter().fold(0, |bits, (joint, _)| bits | 1 << joint);
        joints.map(|joint| Self { joint, held }).collect()
    }
}

/// A posture that others are to be near to.
pub(super) struct Nearness<'a> {
    pub robot: &'a Robot,
    pub task: &'a Task,
    pub target: &'a Frame,
    pub near: &'a [f64],
    pub stay: &'a [Stay],
    pub fixed: &'a [(usize, f64)],
    /// Whether every posture at the frame is an answer, the held joints being where they are.
    pub anywhere: bool,
}

impl Nearness<'_> {
    /// The postures of an answer, the nearest first; `inside` the limits if it is so wanted, each once or in all `turns`.
    #[inline(never)]
    pub fn order(&self, mut found: Postures, inside: bool, turns: bool) -> Postures {
        if found.singular.contains(&true) {
            found = self.chosen(found, inside);
        }
        for i in 0..found.len() {
            self.turn(found.row_mut(i), inside);
        }
        if turns {
            found = found.within_limits(self.robot, true, self.fixed);
        } else if inside {
            found = self.nearest_copies(&found);
        }
        let distance: Vec<f64> = found.rows().map(|row| self.distance(row)).collect();
        let mut order: Vec<usize> = (0..found.len()).collect();
        order.sort_by(|&a, &b| distance[a].total_cmp(&distance[b]));
        found.ordered(&order)
    }

    /// The length of the difference of the joints [rad and m].
    fn distance(&self, q: &[f64]) -> f64 {
        q.iter().zip(self.near).map(|(x, near)| (x - near).powi(2)).sum::<f64>().sqrt()
    }

    /// Takes joints to the whole turn nearest to the given posture, of those that their limits allow if `inside`.
    fn turn(&self, q: &mut [f64], inside: bool) {
        for (i, x) in q.iter_mut().enumerate() {
            let held = self.fixed.iter().any(|(joint, _)| *joint == i);
            if self.robot.joints()[i] == Joint::Revolute && !held {
                *x = nearest_turn(*x, self.near[i]);
                if inside {
                    *x = self.robot.limits().brought_back(i, *x);
                }
            }
        }
    }

    /// Of each posture the nearest copy within the limits, if there is one: the one whose joints are so each for itself, unless limits on several joints
    /// refuse it.
    fn nearest_copies(&self, found: &Postures) -> Postures {
        let mut kept = Postures::none(found.n(), found.complete);
        for i in 0..found.len() {
            let turns = !self.robot.limits().contain(found.row(i));
            let copies = found.ordered(&[i]).within_limits(self.robot, turns, self.fixed);
            if let Some(nearest) = copies.rows().min_by(|a, b| self.distance(a).total_cmp(&self.distance(b))) {
                kept.push(nearest.iter().copied(), found.singular[i]);
            }
        }
        kept
    }

    /// Singular postures with what may be chosen as near as can be to the given one, and the one of them that is found from there: another part of the
    /// continuum may be nearer. Those that are one come once.
    fn chosen(&self, mut found: Postures, inside: bool) -> Postures {
        let mut tried = Vec::new();
        for i in 0..found.len() {
            let chosen = if found.singular[i] { choose(self, found.row_mut(i)) } else { 0 };
            if chosen != 0 && inside {
                self.pull_inside(found.row_mut(i));
            }
            if chosen != 0 && self.anywhere && !tried.contains(&chosen) {
                tried.push(chosen);
                let mut q = self.near.to_vec();
                self.fixed.iter().for_each(|(joint, value)| q[*joint] = *value);
                let held = self.stay.iter().fold(chosen, |bits, stay| bits | stay.held);
                if reaches(self, &mut q, held) {
                    found.push(q, true);
                }
            }
        }
        let mut order: Vec<usize> = Vec::with_capacity(found.len());
        for i in 0..found.len() {
            if !found.singular[i] || !order.iter().any(|&j| found.singular[j] && self.same(found.row(i), found.row(j))) {
                order.push(i);
            }
        }
        found.ordered(&order)
    }

    /// Takes joints that may be chosen, or make up for such a one, and are beyond their limits onto them, as far as may be; the others go with them.
    pub fn pull_inside(&self, q: &mut [f64]) {
        let limits = self.robot.limits();
        for joint in 0..q.len() {
            let mut copy = q.to_vec();
            self.turn(&mut copy, true);
            let (low, high) = (limits.q_min[joint], limits.q_max[joint]);
            let Some(stay) = self.stay.iter().find(|stay| stay.held >> joint & 1 == 0) else { continue };
            if (copy[joint] < low || copy[joint] > high) && null_joints(self.robot, self.task, q, stay.held) >> joint & 1 == 1 {
                let edges = [low + INSIDE, high - INSIDE].map(|edge| nearest_turn(edge, q[joint]));
                let nearest = if (edges[0] - q[joint]).abs() < (edges[1] - q[joint]).abs() { edges[0] } else { edges[1] };
                slide(self, q, joint, stay.held | 1 << joint, nearest);
            }
        }
        self.turn(q, true);
    }

    /// Whether two postures are the same up to whole turns.
    fn same(&self, a: &[f64], b: &[f64]) -> bool {
        a.iter().zip(b).zip(self.robot.joints()).all(|((a, b), joint)| match joint {
            Joint::Revolute => nearest_turn(a - b, 0.0).abs() <= SAME,
            Joint::Prismatic => (a - b).abs() <= SAME,
        })
    }
}

/// Takes one joint after the other to where the given posture has it, or as far as the tool can stay in its frame; which these are, one bit a joint.
fn choose(to: &Nearness, q: &mut [f64]) -> u32 {
    let mut chosen = 0;
    for stay in to.stay {
        let (joint, held) = (stay.joint, stay.held | chosen);
        if null_joints(to.robot, to.task, q, held) >> joint & 1 == 1 {
            slide(to, q, joint, held | 1 << joint, nearest_turn(to.near[joint], q[joint]));
            chosen |= 1 << joint;
        }
    }
    chosen
}

/// Moves a joint towards a goal, the others but the held ones making up for it.
fn slide(to: &Nearness, q: &mut [f64], joint: usize, held: u32, goal: f64) {
    let mut stride = STRIDE;
    for _ in 0..MOST_STEPS {
        if q[joint] == goal || stride < LEAST_STRIDE {
            return;
        }
        let left = goal - q[joint];
        let mut buffer = [0.0; MAX_JOINTS];
        let trial = &mut buffer[..q.len()];
        trial.copy_from_slice(q);
        trial[joint] = if left.abs() <= stride { goal } else { q[joint] + stride.copysign(left) };
        if reaches(to, trial, held) {
            q.copy_from_slice(trial);
        } else {
            stride = 0.5 * stride.min(left.abs());
        }
    }
}

/// Takes the tool to its frame, some joints held; whether it gets there.
fn reaches(to: &Nearness, q: &mut [f64], held: u32) -> bool {
    let target = Target { position: to.target.origin, axis: None, frame: to.target.axes };
    let size = to.robot.size();
    let got = with_capacity!(q.len(), reach_holding(to.robot, None, to.task, &target, size, q, held, EXACT, STEPS));
    got.error <= VERIFIED
}
