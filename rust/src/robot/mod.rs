//! The frozen model of a serial robot: joints, fixed transforms between them, limits.

mod combination;
mod controller;
mod coupling;
mod dh;
mod fixed;
mod limits;
mod random;
mod turns;
pub(crate) mod urdf;

pub use combination::{Combination, MAX_COMBINATIONS};
pub use controller::Controller;
pub use coupling::{Coupling, Follows, Mimic, MovingJoint};
pub use dh::{Convention, DhTable};
pub use limits::{AT_LIMIT, Limits, nearest_turn};
pub use random::RandomPostures;
pub use urdf::{JointLimits, UrdfChain};

use std::sync::Arc;

use crate::error::{Error, Result};
use crate::linalg::vector::norm;
use crate::linalg::{MAX_JOINTS, frame::Frame};

/// Longer links are refused \[m\]: a number beyond this is a mistake, and far beyond it products overflow.
pub const LARGEST_LENGTH: f64 = 1e6;

/// Checks that no length is beyond [`LARGEST_LENGTH`].
pub fn check_lengths(name: &str, lengths: &[f64]) -> Result<()> {
    match lengths.iter().position(|x| x.abs() > LARGEST_LENGTH) {
        Some(i) => Err(Error::value(&format!("{name}[{i}]"), format!("{:e}", lengths[i]), &format!("at most {LARGEST_LENGTH:e} m"))),
        None => Ok(()),
    }
}

/// How a joint moves along or about the z axis of its frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joint {
    /// Turns about its axis; coordinate in rad.
    Revolute,
    /// Slides along its axis; coordinate in m.
    Prismatic,
}

/// A serial robot. Every convention (standard and modified DH, URDF) is folded at construction into one product,
/// `T(q) = link[0] Z(q_1) link[1] Z(q_2) ... link[n-1] Z(q_n) end`, where Z moves about or along z.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    name: String,
    joints: Vec<Joint>,
    joint_names: Arc<[String]>,
    /// Fixed transform ahead of each joint, without the base.
    bare_links: Vec<Frame>,
    /// Fixed transform from the last moved frame to the flange.
    flange: Frame,
    base: Frame,
    tool: Frame,
    limits: Limits,
    dh: Option<DhTable>,
    /// The same with the base folded into the first one.
    links: Vec<Frame>,
    /// flange and tool in one.
    end: Frame,
    arm: f64,
    /// How joints of the chain follow others.
    coupling: Option<Coupling>,
    /// Its joints as its controller has them; the same where there is none.
    controller: Option<Controller>,
}

impl Robot {
    /// Whether another robot has the same base, joints and links, whatever its tool and limits.
    pub fn is_same_chain(&self, other: &Self) -> bool {
        self.joints == other.joints && self.base == other.base && self.links == other.links && self.coupling == other.coupling
    }

    /// From the fixed transforms ahead of each joint (the joint then moves about or along z) and the one after the last joint.
    pub fn new(name: &str, joints: &[Joint], links: &[Frame], flange: Frame) -> Result<Self> {
        if links.len() != joints.len() {
            check_chain(joints.len())?;
            return Err(Error::length("links", links.len(), joints.len()));
        }
        Self::assemble(name, joints, links, flange, None)
    }

    /// From the kinds of the coordinates and how the joints behind the links follow them.
    fn assemble(name: &str, joints: &[Joint], links: &[Frame], flange: Frame, coupling: Option<Coupling>) -> Result<Self> {
        check_chain(links.len())?;
        for (i, link) in links.iter().enumerate() {
            check_lengths(&format!("translation of links[{i}]"), &link.origin)?;
        }
        check_lengths("translation of flange", &flange.origin)?;
        Ok(Self {
            name: name.into(),
            joints: joints.to_vec(),
            joint_names: (0..joints.len()).map(default_name).collect(),
            bare_links: links.to_vec(),
            flange,
            base: Frame::IDENTITY,
            tool: Frame::IDENTITY,
            limits: Limits::none(joints.len()),
            dh: None,
            links: links.to_vec(),
            end: flange,
            arm: 0.0,
            coupling,
            controller: None,
        }
        .refold())
    }

    fn refold(mut self) -> Self {
        self.links[0] = self.base.compose(&self.bare_links[0]);
        self.end = self.flange.compose(&self.tool);
        let unbounded = self.coupling.is_some() || self.joints.contains(&Joint::Prismatic);
        self.arm = if unbounded { f64::INFINITY } else { self.stretched() };
        self
    }

    /// The same robot with another tool: its frame in the flange frame.
    pub fn with_tool(&self, tool: Frame) -> Self {
        Self { tool, ..self.clone() }.refold()
    }

    /// The same robot on another base: the frame of its first link in the world.
    pub fn with_base(&self, base: Frame) -> Self {
        Self { base, ..self.clone() }.refold()
    }

    /// The same robot with other limits.
    pub fn with_limits(&self, limits: Limits) -> Result<Self> {
        limits.check(self.n())?;
        Ok(Self { limits, ..self.clone() })
    }

    /// The same robot under another name.
    pub fn with_name(&self, name: &str) -> Self {
        Self { name: name.into(), ..self.clone() }
    }

    /// The same robot with other names of its joints: one each, no two the same, none empty.
    pub fn with_joint_names(&self, names: &[String]) -> Result<Self> {
        if names.len() != self.n() {
            return Err(Error::length("joint_names", names.len(), self.n()));
        }
        for (i, name) in names.iter().enumerate() {
            if name.trim().is_empty() || names[..i].contains(name) {
                return Err(Error::value(&format!("joint_names[{i}]"), format!("{name:?}"), "a name of its own for every joint"));
            }
        }
        Ok(Self { joint_names: names.into(), ..self.clone() })
    }

    /// No tool point is farther from a joint's axis than this \[m\]: the links in line. Infinite for a robot that slides, or of which joints
    /// follow others: rates of coordinates say little of theirs.
    #[inline(always)]
    pub fn arm(&self) -> f64 {
        self.arm
    }

    /// The links in line, as sliding joints are at 0 \[m\].
    fn stretched(&self) -> f64 {
        self.links[1..].iter().chain([&self.end]).map(|link| norm(link.origin)).sum()
    }

    /// What lengths are compared with \[m\]: the links in line, sliding joints at 0; 1 for a robot without any length.
    pub fn size(&self) -> f64 {
        let stretched = self.stretched();
        if stretched > 0.0 { stretched } else { 1.0 }
    }

    /// Number of coordinates: of joints, less those that follow others.
    #[inline(always)]
    pub fn n(&self) -> usize {
        self.joints.len()
    }

    /// Name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Kind of every coordinate, which is that of every joint where none follows another.
    #[inline(always)]
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Name of every joint: "joint 1", "joint 2" and so on unless it has another.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Joint `i` as people count it, with its name where it has one of its own: "joint 3", "joint 3 (elbow)".
    pub fn joint_label(&self, i: usize) -> String {
        let number = default_name(i);
        match self.joint_names.get(i) {
            Some(name) if *name != number => format!("{number} ({name})"),
            _ => number,
        }
    }

    /// One letter a joint, R or P.
    pub fn joint_letters(&self) -> String {
        self.joints.iter().map(|j| if *j == Joint::Revolute { 'R' } else { 'P' }).collect()
    }

    /// Fixed transforms ahead of each joint of the chain, base folded in.
    #[inline(always)]
    pub fn links(&self) -> &[Frame] {
        &self.links
    }

    /// Fixed transforms ahead of each joint of the chain, without the base.
    pub fn bare_links(&self) -> &[Frame] {
        &self.bare_links
    }

    /// Fixed transform from the last moved frame to the tool point.
    #[inline(always)]
    pub fn end(&self) -> &Frame {
        &self.end
    }

    /// Fixed transform from the last moved frame to the flange.
    pub fn flange(&self) -> &Frame {
        &self.flange
    }

    /// Base frame in the world.
    pub fn base(&self) -> &Frame {
        &self.base
    }

    /// Tool frame in the flange frame.
    pub fn tool(&self) -> &Frame {
        &self.tool
    }

    /// Limits.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The middle posture: each joint in the middle of its range ([`Limits::middle`]).
    pub fn middle(&self) -> Vec<f64> {
        (0..self.n()).map(|i| self.limits.middle(i)).collect()
    }

    /// The squared distance of a posture from the middle one: what decides among postures that are equal in all else.
    pub fn distance_from_middle(&self, q: &[f64]) -> f64 {
        q.iter().enumerate().map(|(i, x)| (x - self.limits.middle(i)).powi(2)).sum()
    }

    /// The DH table it was made from, if it was.
    pub fn dh(&self) -> Option<&DhTable> {
        self.dh.as_ref()
    }
}

/// What joint `i` is called that has no name.
fn default_name(i: usize) -> String {
    format!("joint {}", i + 1)
}

/// Whether there is room for a chain of `m` joints, those that follow others among them.
fn check_chain(m: usize) -> Result<()> {
    if m == 0 || m > MAX_JOINTS {
        return Err(Error::value("number of joints", m, &format!("1 to {MAX_JOINTS}, those that mimic others included")));
    }
    Ok(())
}

/// Parses "RRPRRR".
pub fn parse_joints(letters: &str) -> Result<Vec<Joint>> {
    letters
        .chars()
        .map(|c| match c {
            'R' | 'r' => Ok(Joint::Revolute),
            'P' | 'p' => Ok(Joint::Prismatic),
            _ => Err(Error::value("joints", letters, "letters R (revolute) and P (prismatic) only")),
        })
        .collect()
}
