//! What is asked of the inverse kinematics, for one frame of the tool or for many.

use std::sync::Arc;

use rayon::prelude::*;

use super::analytic::{ArmAngle, Structure};
use super::any::TaskInverse;
use super::nearby::{Nearness, Stay};
use super::postures::Postures;
use super::sweep;
use crate::error::{Result, check_finite, check_vector};
use crate::linalg::frame::Frame;
use crate::robot::Robot;
use crate::task::Task;

/// Frames that a thread takes at a time.
const TOGETHER: usize = 16;

/// Which postures are wanted.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// What of the frames matters.
    pub task: Task,
    /// Joints that are held, and where [rad or m]; the last coordinate counts where a joint is given twice.
    pub fixed: &'a [(usize, f64)],
    /// Only those within the limits.
    pub limits: bool,
    /// In every whole turn that the limits allow.
    pub turns: bool,
}

/// The inverse kinematics of a robot with joints held, none of the others being to spare.
#[derive(Debug, Clone)]
struct Held {
    fixed: Vec<(usize, f64)>,
    inverse: TaskInverse,
}

impl Held {
    #[inline(never)]
    fn new(robot: &Robot, task: Task, fixed: Vec<(usize, f64)>) -> Result<Self> {
        Ok(Self { inverse: TaskInverse::new(Arc::new(robot.with_fixed(&fixed)?), task)?, fixed })
    }

    fn at(&self, joint: usize) -> Option<f64> {
        self.fixed.iter().rev().find(|(held, _)| *held == joint).map(|(_, value)| *value)
    }

    /// What may be chosen in a singular posture.
    fn stay(&self, n: usize) -> Vec<Stay> {
        let moving: Vec<usize> = (0..n).filter(|joint| self.at(*joint).is_none()).collect();
        Stay::in_order(order(&self.inverse).iter().map(|k| moving[*k]), &self.fixed)
    }

    fn solve(&self, n: usize, target: &Frame) -> Postures {
        let found = Postures::of(&self.inverse, target);
        let mut out = Postures::none(n, found.complete);
        for (row, singular) in found.rows().zip(&found.singular) {
            let mut moving = row.iter();
            out.push((0..n).map(|joint| self.at(joint).or_else(|| moving.next().copied()).unwrap_or(f64::NAN)), *singular);
        }
        out
    }
}

/// How the postures are found.
enum Way<'a> {
    Whole(&'a TaskInverse),
    Plane(Box<ArmAngle>, f64),
    Held(Box<Held>),
    Swept { joint: usize, grid: Vec<Held> },
}

/// The inverse kinematics of a robot, made once for what is asked and then given frames.
pub struct Request<'a> {
    robot: &'a Robot,
    wanted: Wanted<'a>,
    way: Way<'a>,
}

impl<'a> Request<'a> {
    /// Of whole frames.
    pub fn whole(inverse: &'a TaskInverse, wanted: Wanted<'a>) -> Self {
        Self { robot: inverse.robot(), wanted, way: Way::Whole(inverse) }
    }

    /// With the joints held that are wanted so, none that is left being to spare.
    pub fn held(robot: &'a Robot, wanted: Wanted<'a>) -> Result<Self> {
        Ok(Self { robot, wanted, way: Way::Held(Box::new(Held::new(robot, wanted.task, wanted.fixed.to_vec())?)) })
    }

    /// With the plane of a seven-axis arm at an angle \[rad\].
    pub fn with_arm_angle(robot: &'a Robot, angle: f64, wanted: Wanted<'a>) -> Result<Self> {
        check_finite("arm_angle", &[angle])?;
        let arm = Box::new(ArmAngle::new(robot)?);
        Ok(Self { robot, wanted, way: Way::Plane(arm, angle) })
    }

    /// With one joint more than the task takes, which is held at so many values over its range in turn ([`sweep`]).
    pub fn swept(robot: &'a Robot, samples: usize, wanted: Wanted<'a>) -> Result<Self> {
        let (joint, values) = sweep::grid(robot, &wanted.task, wanted.fixed, samples)?;
        let held = |value: &f64| Held::new(robot, wanted.task, [wanted.fixed, &[(joint, *value)]].concat());
        let grid = values.iter().map(held).collect::<Result<Vec<_>>>()?;
        Ok(Self { robot, wanted, way: Way::Swept { joint, grid } })
    }

    /// Whether a frame may take long, so that others should not wait for it.
    pub fn is_slow(&self) -> bool {
        match &self.way {
            Way::Whole(inverse) => is_slow(inverse),
            Way::Held(held) => is_slow(&held.inverse),
            Way::Swept { .. } => true,
            Way::Plane(..) => false,
        }
    }

    /// All postures for a frame; in order of their nearness to the posture `near` if there is one, with what may be chosen as it has it.
    pub fn solve(&self, target: &Frame, near: Option<&[f64]>) -> Result<Postures> {
        near.map_or(Ok(()), |near| check_vector("near", near, self.robot.n()))?;
        Ok(self.answer(target, near))
    }

    fn answer(&self, target: &Frame, near: Option<&[f64]>) -> Postures {
        let found = match &self.way {
            Way::Whole(inverse) => Postures::of(inverse, target),
            _ => self.found(target, near),
        };
        if near.is_none() && !self.wanted.limits && !self.wanted.turns { found } else { self.among(found, target, near) }
    }

    /// What the limits leave of an answer, in order of nearness.
    #[inline(never)]
    fn among(&self, mut found: Postures, target: &Frame, near: Option<&[f64]>) -> Postures {
        let Wanted { task, fixed, limits, turns } = self.wanted;
        let inside = limits || turns;
        let (stay, anywhere) = (self.stay(), !matches!(self.way, Way::Plane(..)));
        let nearness = Nearness { robot: self.robot, task: &task, target, near: near.unwrap_or_default(), stay: &stay, fixed, anywhere };
        if near.is_some() {
            return nearness.order(found, inside, turns);
        }
        for i in (0..found.len()).filter(|i| found.singular[*i]).collect::<Vec<_>>() {
            let given = found.row(i).to_vec();
            Nearness { near: &given, ..nearness }.pull_inside(found.row_mut(i));
        }
        found.within_limits(self.robot, turns, fixed)
    }

    /// What may be chosen in a singular posture, in the order in which it is.
    fn stay(&self) -> Vec<Stay> {
        match &self.way {
            Way::Whole(inverse) => Stay::in_order(order(inverse).into_iter(), &[]),
            // Shoulder and wrist by themselves: neither turns the plane.
            Way::Plane(..) => vec![Stay { joint: 0, held: 0b111_1000 }, Stay { joint: 4, held: 0b000_1111 }],
            Way::Held(held) => held.stay(self.robot.n()),
            Way::Swept { grid, .. } => grid.first().map_or(Vec::new(), |held| held.stay(self.robot.n())),
        }
    }

    #[inline(never)]
    fn found(&self, target: &Frame, near: Option<&[f64]>) -> Postures {
        let n = self.robot.n();
        match &self.way {
            Way::Whole(inverse) => Postures::of(inverse, target),
            Way::Plane(arm, angle) => arm.solve(target, *angle).into(),
            Way::Held(held) => held.solve(n, target),
            Way::Swept { joint, grid } => {
                let mut all = Postures::none(n, false);
                // The value that `near` has is one more of the grid.
                let its = near.map(|near| near[*joint]).filter(|value| self.robot.limits().admit(*joint, *value));
                if let Some(Ok(held)) =
                    its.map(|value| Held::new(self.robot, self.wanted.task, [self.wanted.fixed, &[(*joint, value)]].concat()))
                {
                    all.append(&held.solve(n, target));
                }
                all.append(&on_every_core(n, grid.len(), &|i| grid[i].solve(n, target)).postures);
                all
            }
        }
    }

    /// The same of many frames, on every core; `near` holds one posture for all of them or one for each.
    pub fn solve_many(&self, targets: &[Frame], near: Option<&[f64]>) -> Result<Batch> {
        let n = self.robot.n();
        if let Some(near) = near {
            let each = if near.len() == n { n } else { n * targets.len() };
            check_vector("near", near, each)?;
        }
        let near_of = |i: usize| near.map(|near| if near.len() == n { near } else { &near[i * n..(i + 1) * n] });
        Ok(on_every_core(n, targets.len(), &|i| self.answer(&targets[i], near_of(i))))
    }
}

/// Postures of many frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch {
    /// Those of the first frame, then those of the second, and so on.
    pub postures: Postures,
    /// The frame of each posture, counted from 0.
    pub frame: Vec<i64>,
    /// Of each frame, whether there are no others.
    pub complete: Vec<bool>,
}

impl Batch {
    fn none(n: usize) -> Self {
        Self { postures: Postures::none(n, true), frame: Vec::new(), complete: Vec::new() }
    }
}

/// So many answers for a robot of `n` joints, in their order whichever core gave them.
fn on_every_core(n: usize, count: usize, one: &(dyn Fn(usize) -> Postures + Sync)) -> Batch {
    let part = |k: usize| {
        let mut part = Batch::none(n);
        for i in TOGETHER * k..count.min(TOGETHER * (k + 1)) {
            let found = one(i);
            part.frame.extend(std::iter::repeat_n(i as i64, found.len()));
            part.complete.push(found.complete);
            part.postures.append(&found);
        }
        part
    };
    let parts: Vec<Batch> = (0..count.div_ceil(TOGETHER)).into_par_iter().map(part).collect();
    let (mut whole, postures) = (Batch::none(n), parts.iter().map(|part| part.frame.len()).sum());
    whole.postures.reserve(postures);
    whole.frame.reserve(postures);
    whole.complete.reserve(count);
    for part in &parts {
        whole.postures.append(&part.postures);
        whole.frame.extend_from_slice(&part.frame);
        whole.complete.extend_from_slice(&part.complete);
    }
    whole
}

/// Whether a frame may take hundreds of microseconds.
fn is_slow(inverse: &TaskInverse) -> bool {
    inverse.structure().is_none_or(|structure| structure == Structure::General)
}

/// The joints in the order in which they stay where they are, if they can: as the closed form chooses.
fn order(inverse: &TaskInverse) -> Vec<usize> {
    let n = inverse.robot().n();
    let start = match inverse.structure() {
        Some(Structure::Wrist { first, .. }) if n == 6 => first,
        // Joint 6 of the loop, which may be parallel to the three.
        Some(Structure::Parallel { first }) if n == 6 => first + 5,
        _ => 0,
    };
    (0..n).map(|k| (start + k) % n).collect()
}
