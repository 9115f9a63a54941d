//! Joints that follow others, in and out.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::{ok, read_list, vector};
use crate::errors::{Failure, PyResult};
use crate::robot::frames::Maybe;
use redundancy::error::Error;
use redundancy::robot::{Coupling, Joint, Limits, Mimic, MovingJoint, Robot, parse_joints};

/// Names of limits, in the order of a joint's.
const LIMITS: [&str; 4] = ["q_min", "q_max", "qd_max", "qdd_max"];

/// The joints that some of `letters` follow, ``{joint: (driver, factor, offset)}``, with the limits of all of them; names are their numbers.
pub fn read_joints(letters: &str, mimic: &Bound<'_, PyDict>, given: [Maybe<'_, '_>; 4]) -> PyResult<Vec<MovingJoint>> {
    let kinds = ok(parse_joints(letters))?;
    let none = Limits::none(kinds.len());
    let mut limits = [none.q_min, none.q_max, none.qd_max, none.qdd_max];
    for ((name, slot), value) in LIMITS.iter().zip(&mut limits).zip(given) {
        if let Some(value) = value {
            *slot = read_list(name, value)?;
            if slot.len() != kinds.len() {
                return Err(Error::length(name, slot.len(), kinds.len()).into());
            }
        }
    }
    let named = |(i, kind): (usize, &Joint)| MovingJoint {
        name: i.to_string(),
        kind: *kind,
        limits: limits.each_ref().map(|slot| slot[i]),
        mimic: None,
    };
    let mut joints: Vec<MovingJoint> = kinds.iter().enumerate().map(named).collect();
    for (joint, value) in mimic.iter() {
        let wrong = || {
            let expected = format!("joints from 0 to {}, each with (driver, factor, offset)", kinds.len() - 1);
            Failure::from(Error::value("mimic", format!("{{{joint}: {value}}}"), &expected))
        };
        let place = joint.extract::<usize>().map_err(|_| wrong())?;
        let (driver, factor, offset) = value.extract::<(usize, f64, f64)>().map_err(|_| wrong())?;
        if place >= joints.len() || driver >= joints.len() {
            return Err(wrong());
        }
        joints[place].mimic = Some(Mimic { driver: driver.to_string(), factor, offset });
    }
    Ok(joints)
}

/// One letter a joint of the chain, then one for each joint off it that drives some.
pub fn chain_letters(robot: &Robot) -> String {
    let letter = |joint: &Joint| if *joint == Joint::Revolute { 'R' } else { 'P' };
    let off = off_chain(robot);
    robot.chain().iter().map(letter).chain(off.iter().map(|k| letter(&robot.joints()[*k]))).collect()
}

/// The coordinates that are joints off the chain.
fn off_chain(robot: &Robot) -> Vec<usize> {
    let own = robot.coupling().map_or(&[][..], Coupling::own);
    (0..own.len()).filter(|k| own[*k].is_none()).collect()
}

/// The number of the joint that each coordinate is: of the chain, or beyond it.
pub fn places(robot: &Robot) -> Vec<usize> {
    let Some(coupling) = robot.coupling() else { return (0..robot.n()).collect() };
    let (m, off) = (robot.chain().len(), off_chain(robot));
    let beyond = |k: usize| m + off.iter().position(|other| *other == k).unwrap_or(0);
    coupling.own().iter().enumerate().map(|(k, own)| own.unwrap_or_else(|| beyond(k))).collect()
}

/// Which joints follow others, as it is read.
pub fn dictionary<'py>(py: Python<'py>, robot: &Robot) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    if let Some(coupling) = robot.coupling() {
        let places = places(robot);
        for (i, follows) in coupling.follows().iter().enumerate() {
            if coupling.own()[follows.coordinate] != Some(i) {
                dict.set_item(i, (places[follows.coordinate], follows.factor, follows.offset))?;
            }
        }
    }
    Ok(dict)
}

/// Limits of the coordinates as limits of all joints: none for those that follow others.
pub fn limits_by_joint<'py>(py: Python<'py>, robot: &Robot) -> [Bound<'py, PyArray1<f64>>; 4] {
    let limits = robot.limits();
    let columns = [&limits.q_min, &limits.q_max, &limits.qd_max, &limits.qdd_max];
    let places = places(robot);
    let none = Limits::none(chain_letters(robot).len());
    let mut wide = [none.q_min, none.q_max, none.qd_max, none.qdd_max];
    for (wide, column) in wide.iter_mut().zip(columns) {
        for (k, place) in places.iter().enumerate() {
            wide[*place] = column[k];
        }
    }
    wide.each_ref().map(|column| vector(py, column))
}
