//! Serial chains out of URDF files. Kinematics alone is read: the tree of links and joints, and of the joints on the chain that is asked for
//! where they are, how they move, their limits and which joint they mimic. No other element can refuse a file.

mod chain;
mod document;
mod joint;
mod names;
mod xml;

use std::path::Path;

use super::Robot;
use crate::error::Result;

pub(crate) use chain::{Chain, chain};
pub(crate) use document::Document;
pub(crate) use joint::{attribute, origin};
pub(crate) use xml::{Element, decoded, fault, read_bytes};

/// Which chain of a URDF is a robot, and limits that the file has not or has wrong.
#[derive(Debug, Clone, Copy, Default)]
pub struct UrdfChain<'a> {
    /// First link; the root unless named.
    pub base: Option<&'a str>,
    /// Last link; the only one at an end unless named.
    pub tip: Option<&'a str>,
    /// In place of those of the file, by names of joints.
    pub limits: &'a [JointLimits],
}

/// Limits of a joint in place of those of a file, which hold where none is given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointLimits {
    /// Name of the joint.
    pub joint: String,
    /// Lower limit [rad or m].
    pub low: Option<f64>,
    /// Upper limit [rad or m]; a joint whose limits are equal is fixed there.
    pub high: Option<f64>,
    /// Limit of speed [rad/s or m/s].
    pub velocity: Option<f64>,
}

impl Robot {
    /// From a URDF file: the chain between two links.
    pub fn from_urdf_file(path: &Path, asked: &UrdfChain) -> Result<Self> {
        Self::from_urdf(&document_of(path)?, asked)
    }

    /// As [`Robot::from_urdf_file`], from the text itself.
    pub fn from_urdf_str(text: &str, asked: &UrdfChain) -> Result<Self> {
        Self::from_urdf(&Document::read("URDF", text)?, asked)
    }

    fn from_urdf(document: &Document, asked: &UrdfChain) -> Result<Self> {
        let Chain { joints, links, flange, .. } = chain(document, asked)?;
        let robot = Self::new_coupled(&document.name, &joints, &links, flange)?;
        // Those of the chain that follow no other, and behind the chain, in the order of those that follow them, the others that drive.
        let mut beside = joints[links.len()..].iter();
        let names: Vec<String> = match robot.coupling() {
            None => joints.iter().map(|joint| joint.name.clone()).collect(),
            Some(it) => it
                .own()
                .iter()
                .filter_map(|own| own.map_or_else(|| beside.next(), |i| joints.get(i)))
                .map(|joint| joint.name.clone())
                .collect(),
        };
        robot.with_joint_names(&names)
    }
}

/// The tree of links in a file.
pub(crate) fn document_of(path: &Path) -> Result<Document> {
    Document::read(&path.display().to_string(), &decoded(&read_bytes(path)?))
}
