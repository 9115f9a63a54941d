//! A robot of which some joints are held.

use super::{Joint, Limits, Robot};
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::{Frame, exact_sin_cos};

impl Robot {
    /// The same robot with joints held at coordinates [rad or m]: the others are its joints, in the same order. At least one has to be left. Joints that
    /// follow a held one stand still, too. The map to the controller's joints is that of the same numbers, none where these do not tell them.
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
        let (mut links, mut pending) = (Vec::new(), Frame::IDENTITY);
        for (i, joint) in self.chain().iter().enumerate() {
            let (coordinate, factor, offset) =
                self.coupling().map_or((i, 1.0, 0.0), |it| (it.follows()[i].coordinate, it.follows()[i].factor, it.follows()[i].offset));
            pending = pending.compose(&self.bare_links[i]);
            match held[coordinate] {
                Some(value) => pending = pending.compose(&motion(*joint, factor * value + offset)),
                None => links.push(std::mem::replace(&mut pending, Frame::IDENTITY)),
            }
        }
        let joints: Vec<Joint> = (0..n).filter(|i| held[*i].is_none()).map(|i| self.joints[i]).collect();
        let kept = |values: &[f64]| (0..n).filter(|&i| held[i].is_none()).map(|i| values[i]).collect();
        let limits = Limits {
            q_min: kept(&self.limits.q_min),
            q_max: kept(&self.limits.q_max),
            qd_max: kept(&self.limits.qd_max),
            qdd_max: kept(&self.limits.qdd_max),
            coupled: self.limits.coupled.iter().filter_map(|it| it.with_held(&held)).collect(),
        };
        let names: Vec<String> = (0..n).filter(|&i| held[i].is_none()).map(|i| self.joint_names[i].clone()).collect();
        let coupling = self.coupling().and_then(|it| it.without(&held));
        let robot = Self::assemble(&self.name, &joints, &links, pending.compose(&self.flange), coupling)?.with_joint_names(&names)?;
        robot.with_base(self.base).with_tool(self.tool).with_limits(limits)?.with_controller(self.controller_without(&held))
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
