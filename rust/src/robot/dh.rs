//! Denavit-Hartenberg tables, standard (distal) and modified (proximal).

use super::{Joint, MovingJoint, Robot, check_lengths, parse_joints};
use crate::error::{Error, Result, check_vector};
use crate::linalg::frame::{Frame, exact_sin_cos};

/// Which of the two DH conventions a table follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Convention {
    /// Distal: `T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)`.
    Standard,
    /// Proximal: `T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d)`.
    Modified,
}

impl Convention {
    /// "standard" or "modified".
    pub fn parse(name: &str) -> Result<Self> {
        match name {
            "standard" => Ok(Self::Standard),
            "modified" => Ok(Self::Modified),
            _ => Err(Error::value("convention", format!("{name:?}"), "\"standard\" or \"modified\"")),
        }
    }

    /// "standard" or "modified".
    pub fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::Modified => "modified",
        }
    }
}

/// A DH table: lengths in m, angles in rad; the joint coordinate is added to theta (revolute) or d (prismatic).
#[derive(Debug, Clone, PartialEq)]
pub struct DhTable {
    /// Convention of the table.
    pub convention: Convention,
    /// Link lengths \[m\].
    pub a: Vec<f64>,
    /// Offsets along z \[m\].
    pub d: Vec<f64>,
    /// Twist angles \[rad\].
    pub alpha: Vec<f64>,
    /// Angles about z \[rad\].
    pub theta: Vec<f64>,
}

/// `Rz(theta) Tz(d)`, what the joint's coordinate adds to.
fn about_z(theta: f64, d: f64) -> Frame {
    let (s, c) = exact_sin_cos(theta);
    Frame { axes: [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]], origin: [0.0, 0.0, d] }
}

/// `Tx(a) Rx(alpha)`.
fn about_x(alpha: f64, a: f64) -> Frame {
    let (s, c) = exact_sin_cos(alpha);
    Frame { axes: [[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]], origin: [a, 0.0, 0.0] }
}

impl Robot {
    /// From a DH table and one letter a joint ("RRPRRR").
    pub fn from_dh(name: &str, table: DhTable, joints: &str) -> Result<Self> {
        let joints: Vec<Joint> = parse_joints(joints)?;
        let n = table.a.len();
        let (links, flange) = table.links()?;
        if joints.len() != n {
            return Err(Error::Shape {
                name: "joints".into(),
                got: format!("{} letters", joints.len()),
                expected: format!("{n} letters, one for each row of the DH table"),
            });
        }
        Ok(Self::new(name, &joints, &links, flange)?.with_dh(table))
    }

    /// From a DH table of joints of which some follow others, as [`Robot::new_coupled`].
    pub fn from_dh_coupled(name: &str, table: DhTable, joints: &[MovingJoint]) -> Result<Self> {
        let (links, flange) = table.links()?;
        Ok(Self::new_coupled(name, joints, &links, flange)?.with_dh(table))
    }

    fn with_dh(mut self, table: DhTable) -> Self {
        self.dh = Some(table);
        self
    }
}

impl DhTable {
    /// The fixed transforms ahead of each joint, and the one after the last.
    fn links(&self) -> Result<(Vec<Frame>, Frame)> {
        let n = self.a.len();
        for (label, column) in [("a", &self.a), ("d", &self.d), ("alpha", &self.alpha), ("theta", &self.theta)] {
            check_vector(label, column, n)?;
        }
        check_lengths("a", &self.a)?;
        check_lengths("d", &self.d)?;
        let z = |i: usize| about_z(self.theta[i], self.d[i]);
        let x = |i: usize| about_x(self.alpha[i], self.a[i]);
        // Z(q) commutes with Rz(theta) Tz(d), so the joint may be taken to move first.
        Ok(match self.convention {
            Convention::Standard => {
                let mut ahead = vec![Frame::IDENTITY];
                ahead.extend((0..n).map(|i| z(i).compose(&x(i))));
                let flange = ahead.pop().unwrap_or(Frame::IDENTITY);
                (ahead, flange)
            }
            Convention::Modified => ((0..n).map(|i| x(i).compose(&z(i))).collect(), Frame::IDENTITY),
        })
    }
}
