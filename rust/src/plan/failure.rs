//! Why a plan is not whole.

use std::f64::consts::TAU;
use std::fmt;

use super::numbers::three_digits;
use crate::robot::{Joint, Robot};

/// What is in the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FailureCause {
    /// No posture reaches the point.
    Unreachable,
    /// A joint, or a combination of joints, would be beyond its position limit.
    JointLimit,
    /// The objective is not finite there.
    Singular,
    /// The user's own reason.
    Predicate,
    /// A joint would have to move faster than it can.
    SpeedLimit,
    /// A joint would have to move further from point to point than it may.
    StepLimit,
    /// The caller's own cost forbids every step there.
    EdgeCost,
    /// The tool would have to spin beyond its range.
    SpinRange,
    /// The tool would have to leave the volume of its orientations.
    Volume,
    /// The point has postures, but no branch leads there from the points before.
    NoWay,
    /// The last posture is not the first one.
    NotClosed,
}

impl FailureCause {
    /// All of them.
    pub const ALL: [Self; 11] = [
        Self::Unreachable,
        Self::JointLimit,
        Self::Singular,
        Self::Predicate,
        Self::SpeedLimit,
        Self::StepLimit,
        Self::EdgeCost,
        Self::SpinRange,
        Self::Volume,
        Self::NoWay,
        Self::NotClosed,
    ];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unreachable => "unreachable",
            Self::JointLimit => "joint limit",
            Self::Singular => "singular",
            Self::Predicate => "predicate",
            Self::SpeedLimit => "speed limit",
            Self::StepLimit => "step limit",
            Self::EdgeCost => "edge cost",
            Self::SpinRange => "spin range",
            Self::Volume => "orientation volume",
            Self::NoWay => "no way",
            Self::NotClosed => "not closed",
        }
    }

    /// Whether it is the motion from the point before that is in the way.
    fn is_between_points(self) -> bool {
        matches!(self, Self::SpeedLimit | Self::StepLimit)
    }

    /// What its name leaves open, where nothing else is known.
    fn detail(self) -> &'static str {
        match self {
            Self::NoWay => "; it has postures, but no branch leads there from the points before",
            Self::EdgeCost => "; it is infinite for every step there from the point before",
            Self::Volume => "; no orientation within it leads along the path there",
            Self::SpinRange => "; no spin within it leads along the path there",
            Self::NotClosed => "; its posture is not that of the first point",
            _ => "",
        }
    }
}

/// Why a plan is not whole; shown in the units that people read.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanFailure {
    /// First point that is not reached as it should be, counted from 0.
    pub point: usize,
    /// What is in the way.
    pub cause: FailureCause,
    /// The joint in the way, for limits of joints.
    pub joint: Option<FailedJoint>,
    /// What is known beside, and what would help, in words.
    pub hint: Option<String>,
    /// The point itself if something is held there, else the next points on either side at which something is.
    pub pins: Vec<usize>,
}

/// The joint, or the combination of joints, that keeps a plan from being whole.
#[derive(Debug, Clone, PartialEq)]
pub struct FailedJoint {
    /// Its number, counted from 0; of a combination the first.
    pub number: usize,
    /// Whether it slides.
    pub slides: bool,
    /// How far beyond its limit it would have to go [rad or m], or how many times its speed or step limit it would need.
    pub excess: f64,
    /// The combination in words, if it is one: "joint 2 + joint 3".
    pub combination: Option<String>,
}

/// What has a position limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limited {
    /// A joint.
    Joint(usize),
    /// A combination, by its number among those of the robot.
    Combination(usize),
}

impl Limited {
    /// Its failure, by the distance of the joints beyond it.
    pub(super) fn failed(self, robot: &Robot, beyond: f64) -> Option<FailedJoint> {
        let slides = |joint: usize| robot.joints()[joint] == Joint::Prismatic;
        let k = match self {
            Self::Joint(number) => return Some(FailedJoint { number, slides: slides(number), excess: beyond, combination: None }),
            Self::Combination(k) => k,
        };
        let combination = robot.limits().coupled.get(k)?;
        let joints = || (0..robot.n()).filter(|&i| combination.row[i] != 0.0);
        let number = joints().next()?;
        // Angles and distances have no unit in common.
        let alike = joints().all(|i| slides(i) == slides(number));
        let excess = if alike { beyond * combination.norm() } else { f64::NAN };
        Some(FailedJoint { number, slides: slides(number), excess, combination: Some(combination.to_string()) })
    }
}

/// What is farthest beyond its position limit in a posture, and by how far [rad or m]; negative where nothing is.
pub(super) fn farthest_beyond(robot: &Robot, q: &[f64]) -> Option<(Limited, f64)> {
    let limits = robot.limits();
    let alone = q.iter().enumerate().map(|(j, x)| (Limited::Joint(j), (limits.q_min[j] - x).max(x - limits.q_max[j])));
    let together = limits.coupled.iter().enumerate().map(|(k, it)| (Limited::Combination(k), -it.margin(q)));
    alone.chain(together).reduce(|a, b| if b.1 > a.1 { b } else { a })
}

impl PlanFailure {
    /// One, with the joint in the way if there is one.
    pub fn new(point: usize, cause: FailureCause, joint: Option<FailedJoint>) -> Self {
        Self { point, cause, joint, hint: None, pins: Vec::new() }
    }

    /// One without a joint in the way.
    pub(super) fn at(point: usize, cause: FailureCause) -> Self {
        Self::new(point, cause, None)
    }

    /// In words, with the name of the joint as the robot has it.
    pub fn told(&self, robot: &Robot) -> String {
        let mut words = String::new();
        // Writing to a string does not fail.
        let _ = self.tell(&mut words, |joint| robot.joint_label(joint));
        words
    }

    fn tell(&self, f: &mut dyn fmt::Write, label: impl Fn(usize) -> String) -> fmt::Result {
        self.tell_cause(f, label)?;
        self.hint.as_ref().map_or(Ok(()), |hint| write!(f, "; {hint}"))
    }

    fn tell_cause(&self, f: &mut dyn fmt::Write, label: impl Fn(usize) -> String) -> fmt::Result {
        match self.pins[..] {
            [pin] if pin == self.point && pin > 0 && self.cause.is_between_points() => {
                write!(f, "pin at point {pin}: it cannot be reached from point {} within the {}", pin - 1, self.cause.name())?;
            }
            [pin] if pin == self.point => write!(f, "pin at point {pin}: {}", self.cause.name())?,
            _ => write!(f, "point {}: {}", self.point, self.cause.name())?,
        }
        self.tell_joint(f, label)?;
        match self.pins[..] {
            [before, after] => write!(f, "; between the pins at points {before} and {after}"),
            [pin] if pin < self.point => write!(f, "; from the pin at point {pin}"),
            [pin] if pin > self.point => write!(f, "; on the way to the pin at point {pin}"),
            _ => Ok(()),
        }
    }

    fn tell_joint(&self, f: &mut dyn fmt::Write, label: impl Fn(usize) -> String) -> fmt::Result {
        let Some(joint) = &self.joint else { return f.write_str(if self.hint.is_some() { "" } else { self.cause.detail() }) };
        match &joint.combination {
            Some(combination) => write!(f, " of {combination}")?,
            None => write!(f, " of {}", label(joint.number))?,
        }
        if !joint.excess.is_finite() {
            return Ok(());
        }
        match self.cause {
            FailureCause::SpeedLimit | FailureCause::StepLimit => {
                write!(f, ", {} times it would be needed", three_digits(joint.excess))
            }
            _ if joint.slides => write!(f, ", which would have to go about {} mm beyond it", three_digits(1000.0 * joint.excess)),
            _ => write!(f, ", which would have to go about {} beyond it", degrees(joint.excess)),
        }
    }
}

impl fmt::Display for PlanFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.tell(f, |joint| format!("joint {}", joint + 1))
    }
}

/// Names that are listed one by one, at most.
const LISTED: usize = 3;

/// The first of some names, and how many more there are.
pub(super) fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] if names.len() <= LISTED => format!("{} and {last}", first.join(", ")),
        _ => format!("{} and {} more", names[..LISTED].join(", "), names.len() - LISTED),
    }
}

/// An angle as people read it.
pub(super) fn degrees(angle: f64) -> String {
    format!("{} deg", three_digits(angle.to_degrees()))
}

/// A number of whole turns as people read it.
pub(super) fn turns(angle: f64) -> String {
    let count = three_digits(angle / TAU);
    format!("{count} {}", if count == "1" { "turn" } else { "turns" })
}
