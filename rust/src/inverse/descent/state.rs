//! A posture with its frames and its cost.

use super::cost::{Cost, Places};
use super::form::Form;
use crate::error::{Error, Result};
use crate::kinematics::sized::joint_frames;
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add};
use crate::robot::{Joint, Limits, Robot};
use crate::task::OrientationVolume;

/// A posture with its frames and its cost.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    /// Joint coordinates; zero beyond them.
    pub q: [f64; MAX_JOINTS],
    /// The frame of every joint after its motion.
    pub frames: [Frame; MAX_JOINTS],
    pub places: Places,
    pub cost: f64,
}

/// What is descended: a cost, of a robot whose joints are all free.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub robot: &'a Robot,
    pub cost: &'a Cost,
    /// Orientations that are as good as each other.
    pub volume: Option<&'a OrientationVolume>,
    /// Limits to keep, if any.
    pub limits: Option<&'a Limits>,
}

impl<'a> Problem<'a> {
    /// Checks that the joints are free, and that points, weights and values are what they have to be.
    pub fn new(robot: &'a Robot, cost: &'a Cost, limits: Option<&'a Limits>) -> Result<Self> {
        if let Some(coupling) = robot.coupling() {
            return Err(Error::value(
                "robot",
                format!("{} joints that follow {} coordinates", coupling.joints().len(), robot.n()),
                "free joints, none that follows another: the closed form is that of one joint alone",
            ));
        }
        cost.check(robot.n())?;
        let problem = Self { robot, cost, volume: None, limits };
        for (i, joint) in robot.joints().iter().enumerate() {
            let (low, high) = limits.map_or((f64::NEG_INFINITY, f64::INFINITY), |it| (it.q_min[i], it.q_max[i]));
            if *joint == Joint::Prismatic && !(low.is_finite() && high.is_finite()) {
                cost.check_slide(i)?;
            }
        }
        Ok(problem)
    }

    /// The frames and the cost of a posture, in one pass over the joints.
    #[inline(never)]
    pub fn at(&self, q: &[f64]) -> State {
        let (frames, n) = (joint_frames(self.robot, q), q.len());
        let mut places = self.cost.places(frames[n - 1].compose(self.robot.end()), self.volume);
        for (point, at) in self.cost.points.iter().zip(&mut places.points) {
            let frame = &frames[point.joints - 1];
            *at = add(frame.origin, frame.rotate(point.at));
        }
        let mut all = [0.0; MAX_JOINTS];
        all[..n].copy_from_slice(q);
        State { q: all, frames, places, cost: self.cost.value(&places, q, self.robot.joints()) }
    }

    /// What joint `i` may change by, the others where they are.
    #[inline]
    pub fn room(&self, q: &[f64], i: usize) -> (f64, f64) {
        let Some(limits) = self.limits else { return (f64::NEG_INFINITY, f64::INFINITY) };
        let (mut low, mut high) = (limits.q_min[i] - q[i], limits.q_max[i] - q[i]);
        for it in limits.coupled.iter().filter(|it| it.row[i] != 0.0) {
            let (below, above) = it.room(q);
            let ends = (below / it.row[i], above / it.row[i]);
            (low, high) = (low.max(ends.0.min(ends.1)), high.min(ends.0.max(ends.1)));
        }
        (low.min(high), high)
    }

    /// Joint `i` at a new place, on its limit rather than beyond it by rounding.
    #[inline]
    pub fn moved(&self, q: f64, i: usize, x: f64) -> f64 {
        self.limits.map_or(q + x, |limits| (q + x).max(limits.q_min[i]).min(limits.q_max[i]))
    }

    /// The cost as a function of the change of joint `i` alone.
    #[inline]
    pub fn form(&self, state: &State, i: usize) -> Form {
        self.cost.form(&state.places, i, self.robot.joints()[i], axis_of(&state.frames[i]), state.q[i])
    }
}

/// The axis of a joint, from its frame before or after its motion: the direction and a point on it.
#[inline]
pub(super) fn axis_of(frame: &Frame) -> (Vec3, Vec3) {
    (frame.axes[2], frame.origin)
}
