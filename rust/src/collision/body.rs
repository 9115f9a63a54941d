//! Shapes on the robot and in the world.

use super::shape::Shape;
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, add, cross, dot, halves, sub};
use crate::linalg::{MAX_JOINTS, Row6};
use crate::robot::Robot;

/// What a body is fixed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mount {
    /// The base: no joint moves it.
    Base,
    /// Link `k`, which moves with joints 0 to k; its frame is that of joint k after its motion.
    Link(usize),
    /// The tool frame, which moves with every joint.
    Tool,
}

impl Mount {
    /// How many joints of the chain move it, the first ones.
    #[inline]
    pub fn joints(self, robot: &Robot) -> usize {
        match self {
            Self::Base => 0,
            Self::Link(k) => k + 1,
            Self::Tool => robot.chain().len(),
        }
    }

    /// Its frame, from the frames of the links.
    #[inline]
    pub(super) fn frame(self, robot: &Robot, links: &[Frame; MAX_JOINTS]) -> Frame {
        match self {
            Self::Base => *robot.base(),
            Self::Link(k) => links[k],
            Self::Tool => links[robot.chain().len() - 1].compose(robot.end()),
        }
    }
}

/// A shape that is part of the robot.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name, for messages and drawings.
    pub name: String,
    /// What it is fixed to.
    pub mount: Mount,
    /// Its pose in the frame of the mount.
    pub pose: Frame,
    /// The shape.
    pub shape: Shape,
}

impl Body {
    pub(super) fn check(&self, robot: &Robot) -> Result<()> {
        check_pose(&format!("pose of body {:?}", self.name), &self.pose)?;
        match self.mount {
            Mount::Link(k) if k >= robot.chain().len() => {
                Err(Error::value(&format!("link of body {:?}", self.name), k, &format!("links from 0 to {}", robot.chain().len() - 1)))
            }
            _ => Ok(()),
        }
    }
}

/// A shape in the world, at rest or moving.
#[derive(Debug, Clone)]
pub struct Obstacle {
    /// Name, for messages and drawings.
    pub name: String,
    /// The shape.
    pub shape: Shape,
    pub(super) pose: Frame,
    pub(super) twist: Row6,
}

impl Obstacle {
    /// At rest at a pose.
    pub fn new(name: &str, shape: Shape, pose: Frame) -> Result<Self> {
        let mut obstacle = Self { name: name.into(), shape, pose, twist: [0.0; 6] };
        obstacle.place(pose, [0.0; 6])?;
        Ok(obstacle)
    }

    /// Moves it: its pose, and its velocity [omega; v] at the origin of the pose, in the frame in which the robot's base is given.
    pub fn place(&mut self, pose: Frame, twist: Row6) -> Result<()> {
        // The messages are made only where there is something to say: a tick asks for no memory.
        if !is_finite(&pose) || check_finite("", &twist).is_err() {
            check_pose(&format!("pose of obstacle {:?}", self.name), &pose)?;
            check_finite(&format!("velocity of obstacle {:?}", self.name), &twist)?;
        }
        (self.pose, self.twist) = (pose, twist);
        Ok(())
    }

    /// Its pose.
    pub fn pose(&self) -> &Frame {
        &self.pose
    }

    /// Its velocity [omega; v] at the origin of its pose.
    pub fn twist(&self) -> &Row6 {
        &self.twist
    }

    /// How fast its material point at `p` moves along `n`.
    #[inline]
    pub(super) fn speed(&self, p: Vec3, n: Vec3) -> f64 {
        let (omega, v) = halves(&self.twist);
        dot(n, add(v, cross(omega, sub(p, self.pose.origin))))
    }
}

fn is_finite(pose: &Frame) -> bool {
    pose.axes.as_flattened().iter().chain(&pose.origin).all(|x| x.is_finite())
}

fn check_pose(name: &str, pose: &Frame) -> Result<()> {
    check_finite(name, pose.axes.as_flattened())?;
    check_finite(name, &pose.origin)
}
