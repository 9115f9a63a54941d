//! A robot of which some joints are held.

use super::{Joint, Limits, Robot};
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::{Frame, exact_sin_cos};

impl Robot {
    /// The same robot with joints held at coordinates [rad or m]: the others are its joints, in the same order. At least one has to be left.
    pub fn with_fixed(&self, fixed: &[(usize, f64)]) -> Result<Self> {
        let n = self.n();
        let mut held = vec![None; n];
        for &(joint, value) in fixed {
            check_finite("fixed", &[value])?;
            match held.get_mut(joint) {
                Some(slot) => *slot = Some(value),
                None => return Err(Error::value("fixed", joint, &format!("joints from 0 to {}", n - 1))),
            }
        }
        let (mut joints, mut links, mut pending) = (Vec::new(), Vec::new(), Frame::IDENTITY);
        for i in 0..n {
            pending = pending.compose(&self.bare_links[i]);
            match held[i] {
                Some(value) => pending = pending.compose(&motion(self.joints[i], value)),
                None => {
                    joints.push(self.joints[i]);
                    links.push(std::mem::replace(&mut pending, Frame::IDENTITY));
                }
            }
        }
        let kept = |values: &[f64]| (0..n).filter(|&i| held[i].is_none()).map(|i| values[i]).collect();
        let limits = Limits {
            q_min: kept(&self.limits.q_min),
            q_max: kept(&self.limits.q_max),
            qd_max: kept(&self.limits.qd_max),
            qdd_max: kept(&self.limits.qdd_max),
        };
        let names: Vec<String> = (0..n).filter(|&i| held[i].is_none()).map(|i| self.joint_names[i].clone()).collect();
        let robot = Self::new(&self.name, &joints, &links, pending.compose(&self.flange))?.with_joint_names(&names)?;
        robot.with_base(self.base).with_tool(self.tool).with_limits(limits)
    }
}

/// What a joint does at a coordinate.
pub(super) fn motion(joint: Joint, q: f64) -> Frame {
    match joint {
        Joint::Revolute => {
            let (s, c) = exact_sin_cos(q);
            Frame::IDENTITY.turn_z(c, s)
        }
        Joint::Prismatic => Frame::translation([0.0, 0.0, q]),
    }
}
