//! Joints that follow others: `<mimic>` of URDF, fingers of a gripper, linkages and belts with a ratio of their own.
//!
//! A chain of m joints then has n coordinates, and joint i stands at `factor_i q[coordinate_i] + offset_i`. Joints are those of the chain, coordinates
//! what moves them: the free joints, and joints off the chain that some of it follow.

use super::{Joint, Limits, Robot, check_chain};
use crate::error::{Error, Result, check_finite};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;

/// A joint as a file has it.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingJoint {
    /// Name, for messages and for those that follow it.
    pub name: String,
    /// How it moves.
    pub kind: Joint,
    /// Its own limits: lower, upper, of speed and of acceleration.
    pub limits: [f64; 4],
    /// The joint that it follows, if it does.
    pub mimic: Option<Mimic>,
}

/// What a joint does that follows another: `factor driver + offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Mimic {
    /// Name of the other joint, which may follow a third one.
    pub driver: String,
    /// Factor.
    pub factor: f64,
    /// Offset [rad or m].
    pub offset: f64,
}

/// Where a joint of the chain stands: `factor q[coordinate] + offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follows {
    /// The coordinate.
    pub coordinate: usize,
    /// Factor.
    pub factor: f64,
    /// Offset [rad or m].
    pub offset: f64,
}

/// How the joints of a chain follow the coordinates of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Coupling {
    joints: Vec<Joint>,
    follows: Vec<Follows>,
    /// The joint of the chain that each coordinate is, if it is one.
    own: Vec<Option<usize>>,
}

impl Coupling {
    /// Kind of every joint of the chain.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// Which coordinate every joint of the chain follows, and how.
    #[inline]
    pub fn follows(&self) -> &[Follows] {
        &self.follows
    }

    /// The joint of the chain that each coordinate is; none for a joint off the chain.
    pub fn own(&self) -> &[Option<usize>] {
        &self.own
    }

    /// Where the joints of the chain stand.
    pub fn joints_at(&self, q: &[f64]) -> [f64; MAX_JOINTS] {
        let mut joints = [0.0; MAX_JOINTS];
        for (joint, follows) in joints.iter_mut().zip(&self.follows) {
            *joint = follows.factor * q[follows.coordinate] + follows.offset;
        }
        joints
    }

    /// Whether a whole turn of a coordinate turns every joint that follows it by whole turns.
    fn is_periodic(&self, coordinate: usize) -> bool {
        self.follows
            .iter()
            .zip(&self.joints)
            .filter(|(follows, _)| follows.coordinate == coordinate)
            .all(|(follows, joint)| follows.factor == 0.0 || (*joint == Joint::Revolute && follows.factor.fract() == 0.0))
    }

    /// With some coordinates held; `number` counts those that are left. `None` where no joint that is left follows another.
    pub(super) fn without(&self, held: &[Option<f64>]) -> Option<Self> {
        let left = |coordinate: usize| held[coordinate].is_none();
        let number = |coordinate: usize| (0..coordinate).filter(|k| left(*k)).count();
        let kept: Vec<usize> = (0..self.joints.len()).filter(|i| left(self.follows[*i].coordinate)).collect();
        let follows = kept.iter().map(|i| Follows { coordinate: number(self.follows[*i].coordinate), ..self.follows[*i] }).collect();
        let place = |joint: usize| kept.iter().position(|i| *i == joint);
        let own = (0..held.len()).filter(|k| left(*k)).map(|k| self.own[k].and_then(place)).collect();
        let coupling = Self { joints: kept.iter().map(|i| self.joints[*i]).collect(), follows, own };
        (!coupling.is_identity()).then_some(coupling)
    }

    fn is_identity(&self) -> bool {
        self.own.iter().enumerate().all(|(k, own)| *own == Some(k)) && self.own.len() == self.joints.len()
    }
}

impl Robot {
    /// From joints of which some follow others: those of the chain, first to last, then joints off it that only drive some of them; those that
    /// drive none are not looked at. The limits of a joint tighten those of the one that it follows, unless that leaves it no range.
    ///
    /// `links` are the fixed transforms ahead of the joints of the chain, `flange` the one after the last, as for [`Robot::new`].
    pub fn new_coupled(name: &str, joints: &[MovingJoint], links: &[Frame], flange: Frame) -> Result<Self> {
        let m = links.len();
        check_chain(m)?;
        if joints.len() < m {
            return Err(Error::length("joints", joints.len(), m));
        }
        let driven = joints[..m].iter().map(|joint| driver(joints, joint)).collect::<Result<Vec<_>>>()?;
        let mut coordinates: Vec<usize> = Vec::new();
        for (i, (driver, _, _)) in driven.iter().enumerate() {
            // A joint of the chain has its own place, one off it that of the first joint that follows it.
            if (*driver == i || *driver >= m) && !coordinates.contains(driver) {
                coordinates.push(*driver);
            }
        }
        let n = coordinates.len();
        let mut follows = Vec::with_capacity(m);
        for (driver, factor, offset) in &driven {
            let coordinate = coordinates.iter().position(|joint| joint == driver).unwrap_or(n);
            follows.push(Follows { coordinate, factor: *factor, offset: *offset });
        }
        let own = coordinates.iter().map(|joint| (*joint < m).then_some(*joint)).collect();
        let coupling = Coupling { joints: joints[..m].iter().map(|joint| joint.kind).collect(), follows, own };
        let kinds: Vec<Joint> = coordinates.iter().map(|joint| joints[*joint].kind).collect();
        let limits = tightened(joints, &coordinates, &coupling);
        Self::assemble(name, &kinds, links, flange, (!coupling.is_identity()).then_some(coupling))?.with_limits(limits)
    }

    /// How the joints of the chain follow the coordinates; `None` where each is one of its own.
    #[inline(always)]
    pub fn coupling(&self) -> Option<&Coupling> {
        self.coupling.as_ref()
    }

    /// Kind of every joint of the chain, those that follow others among them.
    pub fn chain(&self) -> &[Joint] {
        self.coupling().map_or(self.joints(), Coupling::joints)
    }

    /// The coordinate that a joint of the chain follows, and the factor.
    #[inline]
    pub fn moved_by(&self, joint: usize) -> (usize, f64) {
        self.coupling().map_or((joint, 1.0), |it| (it.follows[joint].coordinate, it.follows[joint].factor))
    }

    /// Whether a whole turn of a joint takes the robot to where it was: of revolute ones, if none follows them by a part of a turn.
    pub fn is_periodic(&self, joint: usize) -> bool {
        self.joints()[joint] == Joint::Revolute && self.coupling().is_none_or(|coupling| coupling.is_periodic(joint))
    }

    /// Whether joints of the chain beside its own follow a coordinate.
    pub fn drives(&self, joint: usize) -> bool {
        self.coupling().is_some_and(|it| it.follows.iter().enumerate().any(|(i, f)| f.coordinate == joint && it.own[joint] != Some(i)))
    }

    /// Six free revolute joints are what closed forms are made for.
    pub(crate) fn check_free(&self) -> Result<()> {
        match self.coupling() {
            None => Ok(()),
            Some(coupling) => Err(Error::value(
                "robot",
                format!("{} joints that follow {} coordinates", coupling.joints.len(), self.n()),
                "six free joints, none that follows another: closed forms know no others; a solver with an objective reaches a pose from a posture",
            )),
        }
    }
}

/// The joint that moves another, which may be itself, and factor and offset from there.
fn driver(joints: &[MovingJoint], joint: &MovingJoint) -> Result<(usize, f64, f64)> {
    let (mut at, mut factor, mut offset) = (joint, 1.0, 0.0);
    // As many steps as there are joints lead round in a circle.
    for _ in 0..=joints.len() {
        let Some(mimic) = &at.mimic else {
            let place = joints.iter().position(|other| std::ptr::eq(other, at)).unwrap_or(joints.len());
            return Ok((place, factor, offset));
        };
        check_finite(&format!("multiplier and offset of joint {:?}", at.name), &[mimic.factor, mimic.offset])?;
        (factor, offset) = (factor * mimic.factor, factor * mimic.offset + offset);
        at = joints.iter().find(|other| other.name == mimic.driver).ok_or_else(|| {
            let known = joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>().join(", ");
            Error::Model(format!("joint {:?} mimics {:?}, expected one of the joints {known}", at.name, mimic.driver))
        })?;
    }
    Err(Error::Model(format!("joint {:?} mimics itself, by way of those that it follows", joint.name)))
}

/// The limits of the coordinates: their own, and within them those of the joints of the chain that follow them. Limits that leave no range contradict
/// each other, as those of many a gripper do whose finger closes the other way: the joint that drives knows its own.
fn tightened(joints: &[MovingJoint], coordinates: &[usize], coupling: &Coupling) -> Limits {
    let of = |entry: usize| coordinates.iter().map(|joint| joints[*joint].limits[entry]).collect::<Vec<f64>>();
    let mut limits = Limits { q_min: of(0), q_max: of(1), qd_max: of(2), qdd_max: of(3), coupled: Vec::new() };
    for (i, Follows { coordinate: k, factor, offset }) in coupling.follows.iter().copied().enumerate() {
        if coupling.own[k] == Some(i) || factor == 0.0 {
            continue;
        }
        let [low, high, speed, acceleration] = joints[i].limits;
        let (a, b) = ((low - offset) / factor, (high - offset) / factor);
        let (low, high) = (limits.q_min[k].max(a.min(b)), limits.q_max[k].min(a.max(b)));
        if low < high {
            (limits.q_min[k], limits.q_max[k]) = (low, high);
        }
        limits.qd_max[k] = limits.qd_max[k].min(speed / factor.abs());
        limits.qdd_max[k] = limits.qdd_max[k].min(acceleration / factor.abs());
    }
    limits
}
