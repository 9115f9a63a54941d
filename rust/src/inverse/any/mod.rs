//! Every posture of any robot for any task: as part of a chain of six joints.
//!
//! A motion that the task leaves free is one more joint, at the tool: a robot of five joints with a tool that may spin has exactly the postures
//! of six joints with the tool's frame given. Where that leaves fewer than six, joints that stay at 0 are put where they make a closed form; a
//! frame that the robot reaches is one at which they do stay at 0. Six joints are solved by [`Inverse`] if all turn; else by a wrist (Pieper
//! 1968), whatever the three other joints are; or, with three slides, by turning the tool first. What is left is searched by Newton.

mod arm;
mod chain;
mod padding;
pub(super) mod roots;
mod search;
mod six;
mod verified;

use std::sync::Arc;

use super::{Inverse, Solutions, Structure};
use crate::error::{Error, Result};
use crate::linalg::frame::Frame;
use crate::linalg::vector::norm;
use crate::robot::{Joint, RandomPostures, Robot};
use crate::task::Task;
use chain::Chain;
use padding::padded;
use search::search;
use six::Six;
use verified::Verified;

/// Newton steps that polish a candidate.
const POLISH: usize = 8;
/// Newton steps from a posture that is near, and from one that may be anywhere.
const NEAR: usize = 30;
const FAR: usize = 60;

/// Inverse kinematics of a robot for a task that leaves none of its joints to spare: all solutions.
#[derive(Debug, Clone)]
pub struct TaskInverse {
    robot: Arc<Robot>,
    task: Task,
    size: f64,
    way: Way,
}

#[derive(Debug, Clone)]
enum Way {
    /// Six revolute joints and the whole frame.
    Plain(Box<Inverse>),
    /// Parts of chains of six joints, the best first; by search where there is none.
    Parts(Vec<Six>),
}

impl TaskInverse {
    /// For a robot and a task.
    ///
    /// # Errors
    /// [`Error::Value`] if the task leaves joints to spare: it tells which of them can be held.
    pub fn new(robot: Arc<Robot>, task: Task) -> Result<Self> {
        let size = norm(robot.end().origin) + robot.links().iter().map(|link| norm(link.origin)).sum::<f64>();
        let size = if size > 0.0 { size } else { 1.0 };
        if robot.n() == 6 && robot.joints().iter().all(|joint| *joint == Joint::Revolute) && task.kind() == "full" {
            return Ok(Self { way: Way::Plain(Box::new(Inverse::new(robot.clone())?)), robot, task, size });
        }
        check_spare(&robot, &task)?;
        let parts = Chain::of(&robot, &task).map_or(Ok(Vec::new()), |chain| padded(&chain))?;
        Ok(Self { robot, task, size, way: Way::Parts(parts) })
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// What the solution is built on: the structure of the chain of six joints that the robot is part of, `None` for a search.
    pub fn structure(&self) -> Option<Structure> {
        match &self.way {
            Way::Plain(inverse) => Some(inverse.structure()),
            Way::Parts(parts) => parts.first().map(Six::structure),
        }
    }

    /// How hard it is to solve ([`Structure::effort`]); a search is hardest.
    pub fn effort(&self) -> u8 {
        self.structure().map_or(u8::MAX, Structure::effort)
    }

    /// Whether [`Solutions::branch`] names the same branch for every target.
    pub fn has_branches(&self) -> bool {
        matches!(&self.way, Way::Plain(inverse) if inverse.has_branches())
    }

    /// Postures by Newton from given ones, n joints a row and at most 6, and from `random` ones, which are the same every time: what there is to do where
    /// there is no closed form and [`TaskInverse::solve`] would take long, as where the postures of a frame next to `target` are known.
    #[inline(never)]
    pub fn near(&self, target: &Frame, starts: &[f64], random: usize) -> Solutions {
        let n = self.robot.n();
        let mut found = Verified::new(&self.robot, &self.task, self.size);
        for start in starts.chunks_exact(n) {
            let mut q = [0.0; 6];
            q[..n].copy_from_slice(start);
            found.add(&q, target, NEAR, false);
        }
        let mut postures = RandomPostures::new(7);
        for _ in 0..random {
            let mut q = [0.0; 6];
            postures.fill(&self.robot, &mut q[..n]);
            found.add(&q, target, FAR, false);
        }
        found.solutions(false)
    }

    /// Every posture in which the tool is at `target` as far as the task looks at it, n joints and then zeros; as [`Inverse::solve`] for the rest.
    pub fn solve(&self, target: &Frame) -> Solutions {
        let parts = match &self.way {
            Way::Plain(inverse) => return inverse.solve(target),
            Way::Parts(parts) => parts,
        };
        let mut found = Verified::new(&self.robot, &self.task, self.size);
        let mut proven = false;
        for part in parts {
            proven |= part.candidates(target, &mut |q| {
                found.add(q, target, POLISH, false);
            });
            // Where one part finds nothing, rounding may have taken a posture on the edge of its reach; another may have it well inside.
            if proven && !found.is_empty() {
                break;
            }
        }
        if proven {
            return found.solutions(true);
        }
        search(&mut found, target);
        found.solutions(false)
    }
}

/// That a task takes all joints of a robot, up to six.
fn check_spare(robot: &Robot, task: &Task) -> Result<()> {
    let (n, rank) = (robot.n(), task.rank(robot));
    if rank == n {
        return Ok(());
    }
    let kept = |i: &usize| robot.with_fixed(&[(*i, ANYWHERE)]).is_ok_and(|rest| task.rank(&rest) == rank);
    let spare: Vec<String> = (0..n).filter(kept).map(|i| i.to_string()).collect();
    let got = format!("joints {:?}, of which the task takes {rank}", robot.joint_letters());
    let count = if spare.len() > n - rank { format!("{} of the joints", n - rank) } else { "joint".into() };
    let held = format!("{count} {} held (fixed)", spare.join(", "));
    let advice = format!("{held}, an arm_angle, or a task that asks for more");
    Err(Error::value("robot", got, &advice))
}

/// Where a joint is held to look at the rest [rad or m]: any place will do but a multiple of a right angle, where axes of other places happen
/// to meet.
const ANYWHERE: f64 = 0.37;
