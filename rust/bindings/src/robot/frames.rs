//! Frames, limits and what a robot is given beside its chain, in and out.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{ok, read_any, read_list, read_matrix, shape_of};
use crate::robot::PyRobot;
use redundancy::error::Error;
use redundancy::linalg::frame::Frame;
use redundancy::robot::{Limits, Robot, check_lengths};

/// A frame; quickly when it comes as numpy makes it.
pub fn read_frame(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Frame> {
    match read_plain_frame(name, value) {
        Some(frame) => frame,
        None => ok(Frame::from_matrix(name, &read_matrix(name, value)?)),
    }
}

/// The same of what numpy makes; `None` of anything else.
#[inline(always)]
fn read_plain_frame(name: &str, value: &Bound<'_, PyAny>) -> Option<PyResult<Frame>> {
    let array = value.cast::<PyArray2<f64>>().ok()?;
    if array.shape() != [4, 4] || !array.is_c_contiguous() {
        return None;
    }
    let readable = array.try_readonly().ok()?;
    Some(ok(Frame::from_matrix(name, readable.as_slice().ok()?)))
}

/// One frame or many.
pub enum Poses {
    /// Shape (4, 4).
    One(Frame),
    /// Shape (N, 4, 4).
    Many(Vec<Frame>),
}

/// A frame (4, 4) or frames (N, 4, 4).
pub fn read_poses(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Poses> {
    if let Some(frame) = read_plain_frame(name, value) {
        return frame.map(Poses::One);
    }
    let (numbers, shape) = read_any(name, value)?;
    match *shape {
        [4, 4] => Ok(Poses::One(ok(Frame::from_matrix(name, &numbers))?)),
        [_, 4, 4] => {
            let each = numbers.chunks_exact(16).enumerate();
            // A name is made for the one that is refused alone.
            let frames: Option<Vec<Frame>> = each.clone().map(|(_, matrix)| Frame::from_matrix(name, matrix).ok()).collect();
            let Some(frames) = frames else {
                return ok(each
                    .map(|(i, matrix)| Frame::from_matrix(&format!("{name}[{i}]"), matrix))
                    .collect::<Result<_, _>>()
                    .map(Poses::Many));
            };
            Ok(Poses::Many(frames))
        }
        _ => Err(Error::Shape { name: name.into(), got: shape_of(&shape), expected: "(4, 4) or (N, 4, 4)".into() }.into()),
    }
}

/// Frames (N, 4, 4).
pub fn read_frames(frames: &Bound<'_, PyAny>) -> PyResult<Vec<Frame>> {
    let (numbers, _) = read_any("frames", frames)?;
    ok(numbers.chunks(16).map(|matrix| Frame::from_matrix("frames", matrix)).collect())
}

/// The fixed transforms ahead of the joints, (n, 4, 4).
pub fn read_links(links: &Bound<'_, PyAny>) -> PyResult<Vec<Frame>> {
    let (numbers, shape) = read_any("links", links)?;
    if shape.len() != 3 || shape[1..] != [4, 4] {
        return Err(Error::Shape { name: "links".into(), got: format!("{shape:?}"), expected: "(n, 4, 4)".into() }.into());
    }
    ok(numbers.chunks_exact(16).map(|matrix| Frame::from_matrix("links", matrix)).collect())
}

/// An argument that may be left out.
pub type Maybe<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// A frame that a robot is given, and no farther away than a link may be long.
pub fn read_place(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Frame> {
    let frame = read_frame(name, value)?;
    ok(check_lengths(&format!("translation of {name}"), &frame.origin))?;
    Ok(frame)
}

/// Such a frame, if there is one.
fn read_maybe(name: &str, value: Maybe<'_, '_>) -> PyResult<Option<Frame>> {
    value.map(|value| read_place(name, value)).transpose()
}

/// The robot's limits with those that are given in their place.
pub fn limits(robot: &Robot, given: [Maybe<'_, '_>; 4]) -> PyResult<Limits> {
    let mut limits = robot.limits().clone();
    let slots =
        [("q_min", &mut limits.q_min), ("q_max", &mut limits.q_max), ("qd_max", &mut limits.qd_max), ("qdd_max", &mut limits.qdd_max)];
    for ((name, slot), value) in slots.into_iter().zip(given) {
        if let Some(value) = value {
            *slot = read_list(name, value)?;
        }
    }
    Ok(limits)
}

/// A robot with tool and base.
pub fn placed(mut robot: Robot, tool: Maybe<'_, '_>, base: Maybe<'_, '_>) -> PyResult<Robot> {
    if let Some(tool) = read_maybe("tool", tool)? {
        robot = robot.with_tool(tool);
    }
    if let Some(base) = read_maybe("base", base)? {
        robot = robot.with_base(base);
    }
    Ok(robot)
}

/// A robot with names of its joints, if they are given.
pub fn named(robot: Robot, names: Option<Vec<String>>) -> PyResult<Robot> {
    names.map_or_else(|| Ok(robot.clone()), |names| ok(robot.with_joint_names(&names)))
}

/// A robot with tool, base, limits and names of its joints.
pub fn finish(
    robot: Robot,
    tool: Maybe<'_, '_>,
    base: Maybe<'_, '_>,
    given: [Maybe<'_, '_>; 4],
    names: Option<Vec<String>>,
) -> PyResult<PyRobot> {
    let robot = placed(named(robot, names)?, tool, base)?;
    let limits = limits(&robot, given)?;
    Ok(PyRobot::from(ok(robot.with_limits(limits))?))
}

/// A frame as a matrix (4, 4).
pub fn matrix<'py>(py: Python<'py>, frame: &Frame) -> PyResult<Bound<'py, PyArray2<f64>>> {
    Ok(PyArray1::from_slice(py, &frame.matrix()).reshape([4, 4])?)
}

/// Frames as matrices (N, 4, 4).
pub fn matrices<'py>(py: Python<'py>, frames: &[Frame]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let numbers: Vec<f64> = frames.iter().flat_map(Frame::matrix).collect();
    Ok(PyArray1::from_vec(py, numbers).reshape([frames.len(), 4, 4])?)
}
