//! A robot as part of a chain of six joints: its own, those that its task leaves free, and those that may not move.

use crate::error::Result;
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, cross, perpendicular};
use crate::robot::{Joint, Robot};
use crate::task::{Projector, Reference, Task};

/// Directions this near to parallel [rad] count as such; the answers are polished on the true geometry.
const PARALLEL: f64 = 1e-9;
/// Orders of a chain's joints at most.
const MOST_ORDERS: usize = 24;

/// What moves a joint of the chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// The robot: its joint of this number.
    Own(usize),
    /// Nobody: the task does not look at this motion of the tool.
    Free,
    /// Nothing: the joint stays at 0, and is there to make six.
    Still,
}

/// Joints about or along z, the fixed transforms ahead of each, and the one to the tool.
#[derive(Debug, Clone)]
pub struct Chain {
    pub joints: Vec<Joint>,
    pub roles: Vec<Role>,
    pub links: Vec<Frame>,
    pub end: Frame,
}

/// A frame whose z axis is a unit vector.
pub fn along(axis: Vec3) -> Frame {
    let (x, _) = perpendicular(axis);
    Frame { axes: [x, cross(axis, x), axis], origin: [0.0; 3] }
}

impl Chain {
    /// The robot's joints and, at the tool, one for each motion that the task leaves free; `None` where those motions are no joints' at the tool.
    pub fn of(robot: &Robot, task: &Task) -> Option<Self> {
        let own = (0..robot.n()).map(Role::Own).collect();
        let mut chain = Self { joints: robot.joints().to_vec(), roles: own, links: robot.links().to_vec(), end: *robot.end() };
        let turns_everywhere =
            matches!(task.angular, Projector::All | Projector::None) && matches!(task.linear, Projector::All | Projector::None);
        // Joints that follow others are in no chain.
        if (task.reference != Reference::Tool && !turns_everywhere) || robot.coupling().is_some() {
            return None;
        }
        for axis in free_axes(task.linear) {
            chain.append(Joint::Prismatic, Role::Free, axis);
        }
        match task.angular {
            Projector::All => {}
            Projector::Plane(axis) => chain.append(Joint::Revolute, Role::Free, axis),
            Projector::None => chain.append_ball(Role::Free),
            Projector::Line(_) => return None,
        }
        Some(chain)
    }

    /// Three revolute joints whose axes meet in the tool point at right angles.
    pub fn append_ball(&mut self, role: Role) {
        for axis in Frame::IDENTITY.axes {
            self.append(Joint::Revolute, role, axis);
        }
    }

    /// A joint at the tool point, about or along a unit vector of the tool frame.
    pub fn append(&mut self, joint: Joint, role: Role, axis: Vec3) {
        self.insert(self.joints.len(), joint, role, self.end.compose(&along(axis)));
    }

    /// A joint ahead of joint `at`, or after the last; `place` is its frame in that of the joint before, once it has moved. Nothing else moves.
    pub fn insert(&mut self, at: usize, joint: Joint, role: Role, place: Frame) {
        let after = self.links.get_mut(at).unwrap_or(&mut self.end);
        *after = place.inverse().compose(after);
        self.joints.insert(at, joint);
        self.roles.insert(at, role);
        self.links.insert(at, place);
    }

    /// The same motions with neighbours exchanged where one slides along the axis about which the other turns; this chain first.
    pub fn orders(&self) -> Vec<Self> {
        let mut all = vec![self.clone()];
        let mut next = 0;
        while next < all.len() && all.len() < MOST_ORDERS {
            for i in 0..self.joints.len() - 1 {
                if let Some(other) = all[next].exchanged(i)
                    && !all.iter().any(|known| known.roles == other.roles && known.joints == other.joints)
                {
                    all.push(other);
                }
            }
            next += 1;
        }
        all
    }

    /// The same motions with joint `i` after the next one, if they are as [`Chain::orders`] says.
    fn exchanged(&self, i: usize) -> Option<Self> {
        let link = self.links[i + 1];
        if self.joints[i] == self.joints[i + 1] || link.axes[2][0].hypot(link.axes[2][1]) > PARALLEL {
            return None;
        }
        // The slide's direction in the frame of the turn.
        let slide = if link.axes[2][2] > 0.0 { Frame::IDENTITY } else { along([0.0, 0.0, -1.0]) };
        let mut out = self.clone();
        out.joints.swap(i, i + 1);
        out.roles.swap(i, i + 1);
        if self.joints[i] == Joint::Prismatic {
            out.links[i] = self.links[i].compose(&link);
            out.links[i + 1] = slide;
        } else {
            out.links[i] = self.links[i].compose(&slide);
            out.links[i + 1] = slide.inverse();
        }
        let after = out.links.get_mut(i + 2).unwrap_or(&mut out.end);
        *after = if self.joints[i] == Joint::Prismatic { slide.inverse().compose(after) } else { link.compose(after) };
        Some(out)
    }

    /// As a robot without limits.
    pub fn robot(&self) -> Result<Robot> {
        Robot::new("", &self.joints, &self.links, self.end)
    }
}

/// Directions in which a motion is free.
fn free_axes(projector: Projector) -> Vec<Vec3> {
    match projector {
        Projector::All => Vec::new(),
        Projector::Plane(axis) => vec![axis],
        Projector::Line(axis) => {
            let (x, y) = perpendicular(axis);
            vec![x, y]
        }
        Projector::None => Frame::IDENTITY.axes.to_vec(),
    }
}
