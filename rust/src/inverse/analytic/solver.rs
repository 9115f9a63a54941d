//! Every posture of a six-axis robot that takes its tool to a frame.

use std::sync::Arc;

use super::calibrated::{Carried, as_meant, carried_over};
use super::circle::{Blind, Watch, turn_between_values};
use super::parallel::parallel;
use super::regional::{Regional, regional};
use super::solutions::{MAX_SOLUTIONS, Solutions};
use super::structure::{Loop, Structure, Turn, Turned, angle_of, entered, point, third_row, unpoint};
use super::wrist::wrist;
use crate::error::{Error, Result};
use crate::inverse::general::{beside, cannot_close, general};
use crate::inverse::newton::reach_sized;
use crate::inverse::search::search;
use crate::kinematics::sized::{forward_of, jacobian};
use crate::linalg::Mat6;
use crate::linalg::frame::Frame;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::real::{Lanes, Real};
use crate::linalg::svd::Svd;
use crate::linalg::vector::norm;
use crate::robot::{Joint, RandomPostures, Robot};
use crate::task::{Target, Task};

/// Error of a pose [rad, m over the size of the robot] below which nothing is polished: next to a singularity even this moves joints.
pub const CLOSED: f64 = 4e-15;
/// Error below which a candidate is a solution.
pub const VERIFIED: f64 = 1e-10;
/// The same for candidates of the elimination, which puts a third one between two that nearly meet.
const VERIFIED_ROOT: f64 = 1e-12;
/// Smallest singular value of the Jacobian [rad, m] at which two solutions of the elimination are one to its accuracy.
const SINGULAR: f64 = 1e-6;
/// How many times what the arm is off the gaps between solutions have to be, so that none comes or goes.
const CLEARANCE: f64 = 8.0;
/// A posture that goes farther on the way to the arm as it is [rad] is near others that may come.
const ASTRAY: f64 = 0.05;
/// How many times what the arm is off postures that nearly meet have to be from singular.
const REGULAR: f64 = 3.0;
/// Below this they have met.
const MET: f64 = 1e-8;
/// Random postures that have to be singular for an arm to count as singular everywhere.
const SAMPLED: usize = 6;
/// Newton steps of a polish.
pub const POLISH: usize = 8;

/// Inverse kinematics of a robot with six revolute joints: all solutions.
#[derive(Debug, Clone)]
pub struct Inverse {
    robot: Arc<Robot>,
    links: Loop,
    structure: Structure,
    /// The arm that this one was meant to be, if that has a closed form: its loop, what makes it, and how far this one is from it.
    meant: Option<(Loop, Structure, f64)>,
    /// Whether the tool lacks a direction in every posture.
    deficient: bool,
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
        let (meant, off) = as_meant(&links);
        let meant =
            Some((meant, Structure::of(&meant), off)).filter(|(_, closed, _)| structure == Structure::General && *closed != structure);
        let size = links.iter().map(|link| norm(link.origin)).sum::<f64>() + norm(robot.end().origin);
        let mut out = Self { robot, links, structure, meant, deficient: false, size: if size > 0.0 { size } else { 1.0 } };
        let mut postures = RandomPostures::new(0);
        out.deficient = (0..SAMPLED).all(|_| {
            let mut q = [0.0; 6];
            postures.fill(&out.robot, &mut q);
            out.spread(&q) < SINGULAR
        });
        Ok(out)
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
            Structure::General | Structure::Sliding => false,
        }
    }

    /// Every posture that takes the tool to `target`, each joint within half a turn of the middle of its range (of 0 without limits);
    /// whether within the limits is left to the caller.
    pub fn solve(&self, target: &Frame) -> Solutions {
        let mut found = Solutions::NONE;
        let mut links = self.links;
        links[5] = self.robot.end().compose(&target.inverse()).compose(&self.robot.links()[0]);
        if self.deficient {
            found.complete = false;
            return self.some(&links, target, found);
        }
        if let Some((meant, closed, off)) = &self.meant {
            let mut meant = *meant;
            meant[5] = links[5];
            let (carried, sure) = self.carried(&meant, *closed, *off, &links, target);
            if sure {
                return carried;
            }
            general_loop(&links, Some(&carried.q[..carried.count]), &mut found);
        } else {
            closed_form(self.structure, &links, &mut Blind, &mut found);
        }
        self.verify(target, &mut found);
        found.merge_twins();
        if self.structure == Structure::General {
            self.even_out(&mut found);
        }
        if found.count == 0 && !found.complete { self.some(&links, target, found) } else { found }
    }

    /// From the postures of the arm that this one was meant to be; whether none can come on the way from there to here, so that these are all.
    fn carried(&self, meant: &Loop, closed: Structure, off: f64, links: &Loop, target: &Frame) -> (Solutions, bool) {
        let (mut start, mut gap) = (Solutions::NONE, f64::INFINITY);
        closed_form(closed, meant, &mut gap, &mut start);
        let mut found = start;
        let carried = carried_over(&self.robot, target, self.size, &mut found);
        let off = carried.filter(|_| start.count > 0).map_or(off, |carried| carried.error);
        let sure = start.complete && gap >= CLEARANCE * off;
        self.settle(&mut found);
        if let Some(Carried { way, .. }) = carried
            && found.count == start.count
        {
            return (found, sure && way <= ASTRAY);
        }
        // Two are about to meet, or have met and are gone.
        let Some(all) = beside(links, &start.q[..start.count]) else { return (Solutions::NONE, false) };
        let mut spread = 1.0f64;
        found.count = 0;
        for q in all.solutions() {
            spread = spread.min(self.spread(q));
            found.push(*q, 0, false);
        }
        self.settle(&mut found);
        (found, sure && spread >= REGULAR * off)
    }

    /// Whole turns and twins taken off.
    fn settle(&self, found: &mut Solutions) {
        for q in &mut found.q[..found.count] {
            self.centre(q);
        }
        found.merge_twins();
    }

    /// Some postures where there may be a continuum of them and none is known.
    #[cold]
    fn some(&self, links: &Loop, target: &Frame, mut found: Solutions) -> Solutions {
        if cannot_close(links) {
            found.complete = true;
            return found;
        }
        search(&self.robot, target, self.size, VERIFIED, |q| {
            let mut q = *q;
            self.centre(&mut q);
            found.push(q, 0, self.is_singular(&q));
        });
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
        self.smallest(q) < SINGULAR
    }

    /// The smallest singular value of the Jacobian \[rad, m\].
    fn smallest(&self, q: &[f64; 6]) -> f64 {
        Svd::<6>::new(&self.rows(q, 1.0), 6, 6).sigma[5]
    }

    /// Shortest over longest orthogonal row of the Jacobian, lengths over the size of the robot.
    fn spread(&self, q: &[f64; 6]) -> f64 {
        Orthogonal::new(&self.rows(q, self.size), 6, 6).spread()
    }

    /// The Jacobian by rows, lengths over one.
    fn rows(&self, q: &[f64; 6], length: f64) -> Mat6 {
        let (_, columns) = jacobian::<6>(&self.robot, q);
        let mut rows = [[0.0; 6]; 6];
        for i in 0..6 {
            for r in 0..3 {
                (rows[r][i], rows[r + 3][i]) = (columns.w[i][r], columns.v[i][r] / length);
            }
        }
        rows
    }

    /// Regular solutions come in pairs: where one of a pair that nearly meets is called singular and the other is not, neither is.
    fn even_out(&self, found: &mut Solutions) {
        let (q, singular) = (&found.q[..found.count], &mut found.singular[..found.count]);
        if singular.iter().filter(|flag| !**flag).count().is_multiple_of(2) {
            return;
        }
        let most_regular = (0..q.len()).filter(|i| singular[*i]).max_by(|a, b| self.smallest(&q[*a]).total_cmp(&self.smallest(&q[*b])));
        if let Some(i) = most_regular.filter(|i| self.smallest(&q[*i]) > MET) {
            singular[i] = false;
        }
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

/// All solutions of a loop, in closed form where its structure makes one; candidates, not verified.
fn closed_form<W: Watch>(structure: Structure, links: &Loop, watch: &mut W, found: &mut Solutions) {
    let first = match structure {
        Structure::Wrist { first, before, after } => {
            decoupled(&entered(links, first), before, after, watch, found);
            first
        }
        Structure::Parallel { first } => {
            parallel(&entered(links, first), watch, found);
            first
        }
        Structure::General | Structure::Sliding => {
            general_loop(links, None, found);
            0
        }
    };
    if first > 0 {
        for q in &mut found.q[..found.count] {
            q.rotate_right(first);
        }
    }
}

/// A wrist of joints 4, 5 and 6: the others place its centre, it does the rest.
fn decoupled<W: Watch>(l: &Loop, before: f64, after: f64, watch: &mut W, found: &mut Solutions) {
    let centre = point(&l[2], [0.0, 0.0, before]);
    let place = unpoint(&l[5], [0.0, 0.0, after]);
    let hand = l[5].inverse();
    let mut place_watch = W::new();
    let turn = |mut r: Regional| {
        if let Some(joint) = r.free {
            r.turns[joint] = chosen(l, &hand, &r.turns, joint);
        }
        let arm = chained(Frame::IDENTITY, l, &r.turns, 0..3);
        let [q1, q2, q3] = r.turns.map(angle_of);
        let wanted = Frame { axes: hand.axes.map(|axis| arm.unrotate(axis)), origin: [0.0; 3] };
        wrist(&l[3], &l[4], &wanted, watch, |w| {
            let [q4, q5, q6] = w.q;
            found.push([q1, q2, q3, q4, q5, q6], 2 * r.side + w.side, r.singular || w.singular);
            found.complete &= r.free.is_none() && !w.free;
        });
    };
    if !regional(&l[0], &l[1], centre, place, &mut place_watch, turn) {
        found.complete = false;
    }
    watch.join(place_watch);
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

/// No closed form, though some solutions may be known.
fn general_loop(links: &Loop, known: Option<&[[f64; 6]]>, found: &mut Solutions) {
    let (all, complete) = general(links, known);
    for q in all.solutions() {
        found.push(*q, found.count as u8, false);
    }
    found.complete &= complete;
}
