//! Serial chains out of URDF files, read by `urdf-rs`.

use std::collections::HashMap;
use std::path::Path;

use urdf_rs::{JointType, Pose};

use super::{Joint, Mimic, MovingJoint, Robot};
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, perpendicular, unit};

/// The frame of a pose: position, and roll, pitch, yaw about fixed axes.
pub(crate) fn frame_of(pose: &Pose) -> Frame {
    let [roll, pitch, yaw] = pose.rpy.0;
    let turn = |axis: Vec3, angle: f64| Frame::rotation(axis, angle);
    let rotation = turn([0.0, 0.0, 1.0], yaw).compose(&turn([0.0, 1.0, 0.0], pitch)).compose(&turn([1.0, 0.0, 0.0], roll));
    Frame { origin: pose.xyz.0, ..rotation }
}

/// A rotation whose z axis is the unit vector `axis`; which one does not matter, since it is undone after the joint.
pub(crate) fn with_z(axis: Vec3) -> Frame {
    let (x, y) = perpendicular(axis);
    Frame { axes: [x, y, axis], origin: [0.0; 3] }
}

/// The joints from `base` to `tip`, first to last.
pub(crate) fn chain<'a>(urdf: &'a urdf_rs::Robot, base: Option<&str>, tip: Option<&str>) -> Result<Vec<&'a urdf_rs::Joint>> {
    let parent_joint: HashMap<&str, &urdf_rs::Joint> = urdf.joints.iter().map(|j| (j.child.link.as_str(), j)).collect();
    let links = || urdf.links.iter().map(|l| l.name.as_str()).collect::<Vec<_>>().join(", ");
    let known = |name: &str| urdf.links.iter().any(|l| l.name == name);
    for (label, link) in [("base", base), ("tip", tip)] {
        if let Some(name) = link.filter(|name| !known(name)) {
            return Err(Error::value(label, format!("{name:?}"), &format!("one of the links: {}", links())));
        }
    }
    let tip = match tip {
        Some(name) => name,
        None => {
            let leaves: Vec<&str> =
                urdf.links.iter().map(|l| l.name.as_str()).filter(|name| urdf.joints.iter().all(|j| j.parent.link != *name)).collect();
            match leaves.as_slice() {
                [only] => *only,
                _ => return Err(Error::Model(format!("the URDF has {} end links ({}): name one as tip", leaves.len(), leaves.join(", ")))),
            }
        }
    };
    let mut joints = Vec::new();
    let mut link = tip;
    while Some(link) != base {
        match parent_joint.get(link) {
            Some(joint) if joints.len() <= urdf.joints.len() => {
                joints.push(*joint);
                link = joint.parent.link.as_str();
            }
            Some(_) => return Err(Error::Model("the joints of the URDF form a loop".into())),
            None => match base {
                Some(name) => {
                    return Err(Error::value("base", format!("{name:?}"), &format!("a link on the way from the root to {tip:?}")));
                }
                None => break,
            },
        }
    }
    joints.reverse();
    Ok(joints)
}

impl Robot {
    /// From a URDF file: the chain between two links (root and the only end link unless named).
    pub fn from_urdf_file(path: &Path, base: Option<&str>, tip: Option<&str>) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| Error::Model(format!("{}: {e}", path.display())))?;
        Self::from_urdf_str(&text, base, tip).map_err(|e| match e {
            Error::Model(why) => Error::Model(format!("{}: {why}", path.display())),
            other => other,
        })
    }

    /// As [`Robot::from_urdf_file`], from the text itself.
    pub fn from_urdf_str(text: &str, base: Option<&str>, tip: Option<&str>) -> Result<Self> {
        let urdf = urdf_rs::read_from_string(text).map_err(|e| Error::Model(format!("not a URDF: {e}")))?;
        let mut joints = Vec::new();
        let mut links = Vec::new();
        let mut pending = Frame::IDENTITY;
        for joint in chain(&urdf, base, tip)? {
            for (part, numbers) in [("xyz", &joint.origin.xyz.0), ("rpy", &joint.origin.rpy.0)] {
                check_finite(&format!("{part} of the origin of joint {:?}", joint.name), numbers)?;
            }
            pending = pending.compose(&frame_of(&joint.origin));
            if joint.joint_type == JointType::Fixed {
                continue;
            }
            let kind = kind_of(&joint.joint_type).ok_or_else(|| {
                let (name, kind) = (&joint.name, &joint.joint_type);
                Error::Model(format!(
                    "joint {name:?} is {kind:?}: only revolute, continuous, prismatic and fixed joints form a serial robot"
                ))
            })?;
            let axis = joint.axis.xyz.0;
            let axis = unit(axis).ok_or_else(|| {
                Error::value(&format!("axis of joint {:?}", joint.name), format!("{axis:?}"), "a finite vector that is not zero")
            })?;
            let align = with_z(axis);
            links.push(pending.compose(&align));
            pending = align.inverse();
            joints.push(moving(joint, kind));
        }
        // What the chain follows may be beside it.
        let beside = urdf.joints.iter().filter(|other| joints.iter().all(|joint: &MovingJoint| joint.name != other.name));
        let driving: Vec<MovingJoint> = beside.filter_map(|joint| Some(moving(joint, kind_of(&joint.joint_type)?))).collect();
        joints.extend(driving);
        Self::new_coupled(&urdf.name, &joints, &links, pending)
    }
}

/// How a joint moves; `None` where it does not, or not with one coordinate.
fn kind_of(kind: &JointType) -> Option<Joint> {
    match kind {
        JointType::Revolute | JointType::Continuous => Some(Joint::Revolute),
        JointType::Prismatic => Some(Joint::Prismatic),
        _ => None,
    }
}

/// A joint with its limits, and the one that it follows.
fn moving(joint: &urdf_rs::Joint, kind: Joint) -> MovingJoint {
    let bounded = joint.joint_type != JointType::Continuous;
    let position = if bounded { (joint.limit.lower, joint.limit.upper) } else { (f64::NEG_INFINITY, f64::INFINITY) };
    let speed = if joint.limit.velocity > 0.0 { joint.limit.velocity } else { f64::INFINITY };
    let follows = |mimic: &urdf_rs::Mimic| Mimic {
        driver: mimic.joint.clone(),
        factor: mimic.multiplier.unwrap_or(1.0),
        offset: mimic.offset.unwrap_or(0.0),
    };
    MovingJoint {
        name: joint.name.clone(),
        kind,
        limits: [position.0, position.1, speed, f64::INFINITY],
        mimic: joint.mimic.as_ref().map(follows),
    }
}
