//! Every posture of a six-axis robot that takes its tool to a frame.

use std::f64::consts::TAU;
use std::sync::Arc;

use super::parallel::parallel;
use super::regional::{Regional, regional};
use super::solutions::Solutions;
use super::structure::{Loop, Structure, entered, point, unpoint};
use super::wrist::wrist;
use crate::error::{Error, Result};
use crate::inverse::general::general;
use crate::inverse::newton::reach;
use crate::kinematics::jacobian;
use crate::linalg::frame::Frame;
use crate::linalg::orthogonal::Orthogonal;
use crate::linalg::vector::norm;
use crate::robot::{Joint, Limits, Robot};
use crate::task::{Target, Task};

/// Error of the loop [rad, m over the size of the robot] below which nothing is polished.
const CLOSED: f64 = 1e-13;
/// Error below which a candidate is a solution.
const VERIFIED: f64 = 1e-9;
/// Shortest over longest orthogonal row of the Jacobian at which two solutions of the elimination are one to its accuracy.
const SINGULAR: f64 = 1e-6;
/// Newton steps of a polish.
const POLISH: usize = 6;

/// Inverse kinematics of a robot with six revolute joints: all solutions.
#[derive(Debug, Clone)]
pub struct Inverse {
    robot: Arc<Robot>,
    /// Without limits, for polishing.
    unlimited: Robot,
    links: Loop,
    structure: Structure,
    size: f64,
}

impl Inverse {
    /// For a robot with six revolute joints.
    pub fn new(robot: Arc<Robot>) -> Result<Self> {
        if robot.n() != 6 || robot.joints().iter().any(|joint| *joint != Joint::Revolute) {
            let got = format!("joints {:?}", robot.joint_letters());
            return Err(Error::value("robot", got, "six revolute joints that are not fixed"));
        }
        let unlimited = robot.with_limits(Limits::none(6))?;
        let mut links: Loop = std::array::from_fn(|i| robot.links()[(i + 1) % 6]);
        links[5] = Frame::IDENTITY;
        let structure = Structure::of(&links);
        let size = links.iter().map(|link| norm(link.origin)).sum::<f64>() + norm(robot.end().origin);
        Ok(Self { robot, unlimited, links, structure, size: if size > 0.0 { size } else { 1.0 } })
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
        let wanted = Target { position: target.origin, axis: None, frame: target.axes };
        found.retain(|q, singular| {
            let entered = *q;
            for k in 0..6 {
                q[(k + first) % 6] = entered[k];
            }
            let got = reach::<6>(&self.unlimited, &Task::FULL, &wanted, self.size, q, CLOSED, POLISH);
            self.centre(q);
            if self.structure == Structure::General {
                *singular = self.is_singular(q);
            }
            got.error <= VERIFIED
        });
        found.merge_twins();
        found
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
            let middle = self.robot.limits().middle_and_half(i).map_or(0.0, |(middle, _)| middle);
            *x -= TAU * ((*x - middle) / TAU).round();
        }
    }
}

/// A wrist of joints 4, 5 and 6: the others place its centre, it does the rest.
fn decoupled(l: &Loop, before: f64, after: f64, found: &mut Solutions) {
    let centre = point(&l[2], [0.0, 0.0, before]);
    let place = unpoint(&l[5], [0.0, 0.0, after]);
    let hand = l[5].inverse();
    let mut turn = |r: Regional| {
        let mut arm = Frame::IDENTITY;
        for (q, link) in r.q.iter().zip(l) {
            let (s, c) = q.sin_cos();
            arm = arm.turn_z(c, s).compose(link);
        }
        let wanted = Frame { axes: hand.axes.map(|axis| arm.unrotate(axis)), origin: [0.0; 3] };
        wrist(&l[3], &l[4], &wanted, |q4, q5, q6, flip, in_line| {
            found.push([r.q[0], r.q[1], r.q[2], q4, q5, q6], 2 * r.side + flip, r.singular || in_line);
        });
    };
    let complete = regional(&l[0], &l[1], centre, place, &mut turn);
    found.complete &= complete;
}

/// No closed form: by elimination, whose solutions may come more than once.
fn general_loop(links: &Loop, found: &mut Solutions) {
    let complete = general(links, &mut |q| found.push_new(*q));
    found.complete &= complete;
}
