//! Every posture of a six-axis robot that takes its tool to a frame.

use std::sync::Arc;

use super::circle::turn_between_values;
use super::parallel::parallel;
use super::regional::{Regional, regional};
use super::solutions::{MAX_SOLUTIONS, Solutions};
use super::structure::{Loop, Structure, Turn, Turned, angle_of, entered, point, third_row, unpoint};
use super::wrist::wrist;
use crate::error::{Error, Result};
use crate::inverse::general::general;
use crate::inverse::newton::reach_sized;
use crate::kinematics::sized::{forward_of, jacobian};
use crate::linalg::frame::Frame;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::real::{Lanes, Real};
use crate::linalg::vector::norm;
use crate::robot::{Joint, Robot};
use crate::task::{Target, Task};

/// Error of a pose [rad, m over the size of the robot] below which nothing is polished: next to a singularity even this moves joints.
pub const CLOSED: f64 = 4e-15;
/// Error below which a candidate is a solution.
pub const VERIFIED: f64 = 1e-10;
/// The same for candidates of the elimination, which puts a third one between two that nearly meet.
const VERIFIED_ROOT: f64 = 1e-12;
/// Shortest over longest orthogonal row of the Jacobian at which two solutions of the elimination are one to its accuracy.
const SINGULAR: f64 = 1e-6;
/// Newton steps of a polish.
pub const POLISH: usize = 8;

/// Inverse kinematics of a robot with six revolute joints: all solutions.
#[derive(Debug, Clone)]
pub struct Inverse {
    robot: Arc<Robot>,
    links: Loop,
    structure: Structure,
    size: f64,
}

impl Inverse {
    /// For a robot with six revolute joints.
    pub fn new(robot: Arc<Robot>) -> Result<Self> {
        robot.check_free()?;
        if robot.n() != 6 || robot.joints().iter().any(|joint| *joint != Joint::Revolute) {
            let got = format!("joints {:?}", robot.joint_letters());
            return Err(Error::value("robot", got, "six revolute joints, the others held (fixed), or an arm_angle"));
        }
        let mut links: Loop = std::array::from_fn(|i| robot.links()[(i + 1) % 6]);
        links[5] = Frame::IDENTITY;
        let structure = Structure::of(&links);
        let size = links.iter().map(|link| norm(link.origin)).sum::<f64>() + norm(robot.end().origin);
        Ok(Self { robot, links, structure, size: if size > 0.0 { size } else { 1.0 } })
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// What the closed form is built on.
    pub fn structure(&self) -> Structure {
        self.structure
    }

    /// Whether [`Solutions::branch`] names the same branch for every target.
    pub fn has_branches(&self) -> bool {
        match self.structure {
            Structure::Wrist { first, .. } => {
                let l2 = &self.links[(1 + first) % 6];
                l2.axes[2][0].hypot(l2.axes[2][1]) < 1e-9
            }
            Structure::Parallel { .. } => true,
            Structure::General => false,
        }
    }

    /// Every posture that takes the tool to `target`, each joint within half a turn of the middle of its range (of 0 without limits);
    /// whether within the limits is left to the caller.
    pub fn solve(&self, target: &Frame) -> Solutions {
        let mut found = Solutions::NONE;
        let mut links = self.links;
        links[5] = self.robot.end().compose(&target.inverse()).compose(&self.robot.links()[0]);
        match self.structure {
            Structure::Wrist { first, before, after } => decoupled(&entered(&links, first), before, after, &mut found),
            Structure::Parallel { first } => parallel(&entered(&links, first), &mut found),
            Structure::General => general_loop(&links, &mut found),
        }
        let first = match self.structure {
            Structure::Wrist { first, .. } | Structure::Parallel { first } => first,
            Structure::General => 0,
        };
        if first > 0 {
            for q in &mut found.q[..found.count] {
                q.rotate_right(first);
            }
        }
        self.verify(target, &mut found);
        found.merge_twins();
        found
    }

    /// Leaves what takes the tool to the target, polished where rounding shows.
    fn verify(&self, target: &Frame, found: &mut Solutions) {
        let errors = pose_errors(&self.robot, target, self.size, &found.q, found.count);
        let wanted = Target { position: target.origin, axis: None, frame: target.axes };
        let mut i = 0;
        found.retain(|q, singular| {
            let error = errors[i];
            i += 1;
            let error = if error <= CLOSED {
                error
            } else {
                reach_sized::<6>(&self.robot, None, &Task::FULL, &wanted, self.size, q, CLOSED, POLISH).error
            };
            self.centre(q);
            if self.structure == Structure::General {
                *singular = self.is_singular(q);
                return error <= VERIFIED_ROOT;
            }
            error <= VERIFIED
        });
    }

    /// Whether branches meet in a posture, to the accuracy of a double root.
    fn is_singular(&self, q: &[f64; 6]) -> bool {
        let (_, columns) = jacobian::<6>(&self.robot, q);
        let mut rows = [[0.0; 6]; 6];
        for i in 0..6 {
            for r in 0..3 {
                (rows[r][i], rows[r + 3][i]) = (self.size * columns.w[i][r], columns.v[i][r]);
            }
        }
        Orthogonal::new(&rows, 6, 6).spread() < SINGULAR
    }

    /// Takes whole turns off, as [`Inverse::solve`] says.
    #[inline(always)]
    fn centre(&self, q: &mut [f64; 6]) {
        for (i, x) in q.iter_mut().enumerate() {
            *x = self.robot.limits().turned(i, *x);
        }
    }
}

/// How far each posture misses the target: components of the axes, and of the origin over `size`, added.
fn pose_errors(robot: &Robot, target: &Frame, size: f64, q: &[[f64; 6]; MAX_SOLUTIONS], count: usize) -> [f64; MAX_SOLUTIONS] {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: the machine has been asked.
        return unsafe { pose_errors_avx2(robot, target, size, q, count) };
    }
    side_by_side(robot, target, size, q, count)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn pose_errors_avx2(robot: &Robot, target: &Frame, size: f64, q: &[[f64; 6]; MAX_SOLUTIONS], count: usize) -> [f64; MAX_SOLUTIONS] {
    side_by_side(robot, target, size, q, count)
}

#[inline(always)]
fn side_by_side(robot: &Robot, target: &Frame, size: f64, q: &[[f64; 6]; MAX_SOLUTIONS], count: usize) -> [f64; MAX_SOLUTIONS] {
    let mut errors = [0.0f64; MAX_SOLUTIONS];
    for first in (0..count).step_by(Lanes::LANES) {
        let joints: [Lanes; 6] = std::array::from_fn(|k| Lanes::from_lanes(|lane| q[(first + lane) % MAX_SOLUTIONS][k]));
        let tool = forward_of::<6, Lanes>(robot, &joints);
        for lane in 0..Lanes::LANES.min(count - first) {
            // Sums, so that what is not a number stays none.
            let miss = |got: [Lanes; 3], wanted: [f64; 3]| (0..3).map(|r| (got[r].lane(lane) - wanted[r]).abs()).sum::<f64>();
            let turn: f64 = (0..3).map(|k| miss(tool.axes[k], target.axes[k])).sum();
            errors[first + lane] = turn + miss(tool.origin, target.origin) / size;
        }
    }
    errors
}

/// A wrist of joints 4, 5 and 6: the others place its centre, it does the rest.
fn decoupled(l: &Loop, before: f64, after: f64, found: &mut Solutions) {
    let centre = point(&l[2], [0.0, 0.0, before]);
    let place = unpoint(&l[5], [0.0, 0.0, after]);
    let hand = l[5].inverse();
    let turn = |mut r: Regional| {
        if let Some(joint) = r.free {
            r.turns[joint] = chosen(l, &hand, &r.turns, joint);
        }
        let arm = chained(Frame::IDENTITY, l, &r.turns, 0..3);
        let [q1, q2, q3] = r.turns.map(angle_of);
        let wanted = Frame { axes: hand.axes.map(|axis| arm.unrotate(axis)), origin: [0.0; 3] };
        wrist(&l[3], &l[4], &wanted, |w| {
            let [q4, q5, q6] = w.q;
            found.push([q1, q2, q3, q4, q5, q6], 2 * r.side + w.side, r.singular || w.singular);
            found.complete &= r.free.is_none() && !w.free;
        });
    };
    if !regional(&l[0], &l[1], centre, place, turn) {
        found.complete = false;
    }
}

/// `start` followed by some of the joints and their links.
fn chained(start: Frame, l: &Loop, turns: &[Turn; 3], joints: std::ops::Range<usize>) -> Frame {
    joints.fold(start, |arm, k| arm.turn_z(turns[k].0, turns[k].1).compose(&l[k]))
}

/// A turn of a joint that does not move the wrist's centre, at which the wrist can do the rest.
fn chosen(l: &Loop, hand: &Frame, turns: &[Turn; 3], joint: usize) -> Turn {
    let before = chained(Frame::IDENTITY, l, turns, 0..joint);
    let after = chained(l[joint], l, turns, joint + 1..3);
    // Cosine of the angle between the outer axes of the wrist: what the joint makes of it, and what the wrist can.
    let made = Turned::new(before.unrotate(hand.axes[2]), after.axes[2]);
    let wrist = Turned::new(third_row(&l[3]), l[4].axes[2]);
    let r = wrist.cosine.hypot(wrist.sine);
    turn_between_values(&made, wrist.constant - r, wrist.constant + r)
}

/// No closed form: by elimination, whose solutions may come more than once.
fn general_loop(links: &Loop, found: &mut Solutions) {
    let complete = general(links, &mut |q| found.push_new(*q));
    found.complete &= complete;
}
