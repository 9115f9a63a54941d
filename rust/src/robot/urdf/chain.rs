//! From the tree of links to a chain of moving joints.

use super::document::Document;
use super::joint::Motion;
use super::names::{instead, listed};
use super::xml::fault;
use super::{JointLimits, UrdfChain};
use crate::error::{Error, Result};
use crate::linalg::MAX_JOINTS;
use crate::linalg::frame::Frame;
use crate::robot::MovingJoint;

/// The chain between two links.
pub(crate) struct Chain {
    /// The joints that move, first to last, and behind them joints off the chain that some of them follow.
    pub joints: Vec<MovingJoint>,
    /// The fixed transforms ahead of those of the chain, which move about or along z.
    pub links: Vec<Frame>,
    /// The one after the last.
    pub flange: Frame,
    /// Every link on the way: its number, how many joints move it, and its frame in that of the last of them (of the base where none does).
    pub places: Vec<(usize, usize, Frame)>,
}

/// The chain that is asked for.
pub(crate) fn chain(document: &Document, asked: &UrdfChain) -> Result<Chain> {
    check_names(document, asked.limits)?;
    let (start, path) = document.path(asked.base, asked.tip)?;
    let (mut joints, mut links, mut pending) = (Vec::new(), Vec::new(), Frame::IDENTITY);
    let mut places = vec![(start, 0, pending)];
    for number in &path {
        match document.motion(*number, asked.limits)? {
            Motion::Fixed(frame) => pending = pending.compose(&frame),
            Motion::Moving { joint, origin, align } => {
                joints.push(joint);
                links.push(pending.compose(&origin).compose(&align));
                pending = align.inverse();
            }
        }
        places.push((document.joints[*number].child, joints.len(), pending));
    }
    check_count(document, &path, &places, &joints)?;
    let chain = Chain { joints, links, flange: pending, places };
    with_drivers(document, chain, asked.limits)
}

/// Limits are for joints that the file has, on the chain or not, and that can move.
fn check_names(document: &Document, given: &[JointLimits]) -> Result<()> {
    for JointLimits { joint, .. } in given {
        let Some(number) = document.joint(joint) else {
            let expected = format!("names of joints{}", instead(joint, document.joint_names()));
            return Err(Error::value("limits", format!("for {joint:?}"), &expected));
        };
        if document.joints[number].element.attribute("type") == Some("fixed") {
            return Err(Error::value("limits", format!("for {joint:?}"), "names of joints that move: this one is fixed"));
        }
    }
    Ok(())
}

fn check_count(document: &Document, path: &[usize], places: &[(usize, usize, Frame)], joints: &[MovingJoint]) -> Result<()> {
    if (1..=MAX_JOINTS).contains(&joints.len()) {
        return Ok(());
    }
    let [first, last] = [places.first(), places.last()].map(|place| &document.links[place.map_or(0, |(link, ..)| *link)]);
    let held = path.iter().map(|number| &document.joints[*number]).filter(|joint| joint.element.attribute("type") != Some("fixed"));
    let held = listed(held.map(|joint| joint.name.as_str()));
    let what = match joints.len() {
        0 if held.is_empty() => "no joint that moves".into(),
        0 => format!("no joint that moves: equal limits, or a mimic of a factor 0, hold {held} (limits= gives others)"),
        n => format!("{n} joints that move ({})", listed(joints.iter().map(|joint| joint.name.as_str()))),
    };
    let why = format!("the chain from {:?} to {:?} has {what}; expected 1 to {MAX_JOINTS} joints that move", first.name, last.name);
    Err(fault(&document.source, last.element.line, why))
}

/// Adds the joints that some of the chain follow without their being on it: one coordinate for all that follow it.
fn with_drivers(document: &Document, mut chain: Chain, given: &[JointLimits]) -> Result<Chain> {
    for i in 0..chain.links.len() {
        let Some(mimic) = &chain.joints[i].mimic else { continue };
        if chain.joints.iter().any(|joint| joint.name == mimic.driver) {
            continue;
        }
        let number = document.joint(&mimic.driver).unwrap_or_default();
        if let Motion::Moving { joint, .. } = document.motion(number, given)? {
            chain.joints.push(joint);
        }
    }
    Ok(chain)
}
