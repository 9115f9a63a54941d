//! What a joint of a URDF says: where it is, how it moves, within which limits, and which other joint it follows.

use super::JointLimits;
use super::document::{Document, JointElement};
use super::names::instead;
use super::xml::{Element, fault, shown};
use crate::error::{Error, Result};
use crate::linalg::frame::Frame;
use crate::linalg::vector::{Vec3, perpendicular, unit};
use crate::robot::{Joint, LARGEST_LENGTH, Mimic, MovingJoint, fixed::motion};

/// How a joint moves.
pub(crate) enum Motion {
    /// Not at all: the frame of its child in that of its parent.
    Fixed(Frame),
    /// About or along the z axis of a frame in that of its parent. Where the joint is at zero its child has the parent's frame moved by `origin`.
    Moving { joint: MovingJoint, origin: Frame, align: Frame },
}

/// A rotation whose z axis is the unit vector `axis`; which one does not matter, since it is undone after the joint.
fn with_z(axis: Vec3) -> Frame {
    let (x, y) = perpendicular(axis);
    Frame { axes: [x, y, axis], origin: [0.0; 3] }
}

/// Numbers separated by blanks.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut words = text.split_ascii_whitespace();
    let mut found = [0.0; N];
    for slot in &mut found {
        *slot = words.next()?.parse().ok()?;
    }
    words.next().is_none().then_some(found)
}

/// The numbers of an attribute, finite ones, if it is there. `who` has the element.
pub(crate) fn attribute<const N: usize>(source: &str, who: &str, element: &Element, name: &str) -> Result<Option<[f64; N]>> {
    let Some(text) = element.attribute(name) else { return Ok(None) };
    let count = if N == 1 { "a finite number" } else { &format!("{N} finite numbers") };
    let macros = if text.contains("${") { " (this is a macro: expand the file with xacro first)" } else { "" };
    let wrong = || fault(source, element.line, format!("{who}: {name} of <{}> is {}, expected {count}{macros}", element.name, shown(text)));
    numbers(text).filter(|found| found.iter().all(|x| x.is_finite())).map(Some).ok_or_else(wrong)
}

/// The frame of an `<origin>`: position, and roll, pitch, yaw about fixed axes; none is at the parent's.
pub(crate) fn origin(source: &str, who: &str, element: &Element) -> Result<Frame> {
    let Some(element) = element.child("origin") else { return Ok(Frame::IDENTITY) };
    let place: [f64; 3] = attribute(source, who, element, "xyz")?.unwrap_or_default();
    if let Some(length) = place.iter().find(|x| x.abs() > LARGEST_LENGTH) {
        let why = format!("{who}: xyz of <origin> has {length:e}, expected at most {LARGEST_LENGTH:e} m");
        return Err(fault(source, element.line, why));
    }
    let [roll, pitch, yaw] = attribute(source, who, element, "rpy")?.unwrap_or_default();
    let turn = |axis: Vec3, angle: f64| Frame::rotation(axis, angle);
    let rotation = turn([0.0, 0.0, 1.0], yaw).compose(&turn([0.0, 1.0, 0.0], pitch)).compose(&turn([1.0, 0.0, 0.0], roll));
    Ok(Frame { origin: place, ..rotation })
}

impl Document {
    /// How a joint moves, with limits in place of the file's.
    pub fn motion(&self, joint: usize, given: &[JointLimits]) -> Result<Motion> {
        let it = &self.joints[joint];
        let who = format!("joint {:?}", it.name);
        let origin = origin(&self.source, &who, &it.element)?;
        let Some((kind, bounded)) = self.kind(it)? else { return Ok(Motion::Fixed(origin)) };
        let align = with_z(self.axis(it, &who)?);
        let mut limits = self.limits(it, bounded, given)?;
        let mimic = self.mimic(joint, given)?;
        let locked = limits[0] == limits[1];
        let held = match &mimic {
            None => locked.then_some(limits[0]),
            Some(mimic) => (mimic.factor == 0.0).then_some(mimic.offset),
        };
        if locked {
            // The joint that it follows says where this one stands.
            (limits[0], limits[1]) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        Ok(match held {
            Some(q) if kind == Joint::Prismatic && q.abs() > LARGEST_LENGTH => {
                return Err(self.failed(it, format!("it is held at {q:e}, expected at most {LARGEST_LENGTH:e} m")));
            }
            Some(q) => Motion::Fixed(origin.compose(&align).compose(&motion(kind, q)).compose(&align.inverse())),
            None => Motion::Moving { joint: MovingJoint { name: it.name.clone(), kind, limits, mimic }, origin, align },
        })
    }

    /// The frame of a joint's child in that of its parent where the joint is fixed, or held by its own limits. What is off the chain and no fixed
    /// joint may say what it wants.
    pub fn held(&self, joint: usize, given: &[JointLimits]) -> Result<Option<Frame>> {
        let element = &self.joints[joint].element;
        let fixed = element.attribute("type") == Some("fixed");
        if !fixed && element.child("mimic").is_some() {
            return Ok(None);
        }
        match self.motion(joint, given) {
            Ok(Motion::Fixed(frame)) => Ok(Some(frame)),
            Err(error) if fixed => Err(error),
            _ => Ok(None),
        }
    }

    fn failed(&self, joint: &JointElement, why: impl std::fmt::Display) -> Error {
        fault(&self.source, joint.element.line, format!("joint {:?}: {why}", joint.name))
    }

    /// What moves, and whether limits bound it; `None` for a fixed joint.
    fn kind(&self, joint: &JointElement) -> Result<Option<(Joint, bool)>> {
        match joint.element.attribute("type") {
            Some("fixed") => Ok(None),
            Some("revolute") => Ok(Some((Joint::Revolute, true))),
            Some("continuous") => Ok(Some((Joint::Revolute, false))),
            Some("prismatic") => Ok(Some((Joint::Prismatic, true))),
            other => Err(self.failed(
                joint,
                format!(
                    "its type is {}, expected revolute, continuous, prismatic or fixed: others form no serial robot",
                    other.unwrap_or("missing")
                ),
            )),
        }
    }

    /// The unit vector along the axis; x where there is none.
    fn axis(&self, joint: &JointElement, who: &str) -> Result<Vec3> {
        let Some(element) = joint.element.child("axis") else { return Ok([1.0, 0.0, 0.0]) };
        let axis: Option<[f64; 3]> = attribute(&self.source, who, element, "xyz")?;
        axis.and_then(unit).ok_or_else(|| {
            let got = element.attribute("xyz").map_or("missing".into(), shown);
            fault(&self.source, element.line, format!("{who}: xyz of <axis> is {got}, expected a vector that is not zero"))
        })
    }

    /// Lower and upper limit, of speed and of acceleration. Where a file has neither a lower nor an upper limit there is none, and one alone
    /// has the other at 0, as the format says. A speed of 0, which exporters write where they know none, is no limit; nor are zeros alone.
    fn limits(&self, joint: &JointElement, bounded: bool, given: &[JointLimits]) -> Result<[f64; 4]> {
        let element = joint.element.child("limit");
        let read = |name: &str| -> Result<Option<f64>> {
            let Some((element, text)) = element.and_then(|it| it.attribute(name).map(|text| (it, text))) else { return Ok(None) };
            let number = text.parse().ok().filter(|x: &f64| !x.is_nan());
            let why = || format!("joint {:?}: {name} of <limit> is {}, expected a number", joint.name, shown(text));
            number.map(Some).ok_or_else(|| fault(&self.source, element.line, why()))
        };
        let zero = |name: &str| element.and_then(|it| it.attribute(name)).and_then(|text| text.parse().ok()) == Some(0.0);
        let unset = ["lower", "upper", "velocity", "effort"].into_iter().all(zero);
        let (mut low, mut high) = match (bounded && !unset, read("lower")?, read("upper")?) {
            (false, ..) | (true, None, None) => (f64::NEG_INFINITY, f64::INFINITY),
            (true, low, high) => (low.unwrap_or(0.0), high.unwrap_or(0.0)),
        };
        let mut speed = read("velocity")?.unwrap_or(0.0);
        if let Some(given) = given.iter().find(|given| given.joint == joint.name) {
            (low, high) = (given.low.unwrap_or(low), given.high.unwrap_or(high));
            speed = given.velocity.unwrap_or(speed);
        }
        if low.is_nan() || high.is_nan() || low > high || low == f64::INFINITY || high == f64::NEG_INFINITY {
            return Err(self.failed(joint, format!("limits {low} and {high}, expected a lower one not above the upper one")));
        }
        if speed.is_nan() || speed < 0.0 {
            return Err(self.failed(joint, format!("a limit of velocity of {speed}, expected a number above 0 (0: no limit)")));
        }
        Ok([low, high, if speed == 0.0 { f64::INFINITY } else { speed }, f64::INFINITY])
    }

    /// The joint that one follows at the end, if it follows any. A driver that does not move leaves a factor of 0.
    fn mimic(&self, joint: usize, given: &[JointLimits]) -> Result<Option<Mimic>> {
        let (mut at, mut factor, mut offset) = (joint, 1.0, 0.0);
        for _ in 0..=self.joints.len() {
            let it = &self.joints[at];
            let Some(element) = it.element.child("mimic") else {
                if at == joint {
                    return Ok(None);
                }
                let follows = || self.failed(&self.joints[joint], format!("it mimics joint {:?}, which does not move", it.name));
                let (_, bounded) = self.kind(it)?.ok_or_else(follows)?;
                let [low, high, ..] = self.limits(it, bounded, given)?;
                let (factor, offset) = if low == high { (0.0, factor * low + offset) } else { (factor, offset) };
                return Ok(Some(Mimic { driver: it.name.clone(), factor, offset }));
            };
            let who = format!("joint {:?}", it.name);
            let number = |name: &str, default: f64| -> Result<f64> {
                Ok(attribute::<1>(&self.source, &who, element, name)?.map_or(default, |[x]| x))
            };
            let (next_factor, next_offset) = (number("multiplier", 1.0)?, number("offset", 0.0)?);
            (factor, offset) = (factor * next_factor, factor * next_offset + offset);
            if !(factor.is_finite() && offset.is_finite()) {
                return Err(self.failed(
                    &self.joints[joint],
                    format!("it mimics others by a multiplier of {factor} and an offset of {offset}, expected finite ones"),
                ));
            }
            let driver = element.attribute("joint").unwrap_or_default();
            at = self.joint(driver).ok_or_else(|| {
                let why = format!("it mimics {driver:?}, expected one of the joints{}", instead(driver, self.joint_names()));
                self.failed(it, why)
            })?;
        }
        Err(self.failed(&self.joints[joint], "it mimics itself, by way of those that it follows"))
    }
}
