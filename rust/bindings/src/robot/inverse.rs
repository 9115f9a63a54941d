//! Inverse kinematics as Python gets it.

use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use redundancy::error::{Error, Result};
use redundancy::inverse::{Postures, TaskInverse};
use redundancy::robot::Robot;
use redundancy::task::Task;

use crate::array::{elements, output};
use crate::errors::{Failure, PyResult};
use crate::robot::frames::read_frame;

/// Postures, whether each is at a singularity, whether there are no others.
pub type Report<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArray1<bool>>, bool);

/// The joints that are held: ``{joint: coordinate}``.
pub fn read_fixed(fixed: &Bound<'_, PyDict>) -> PyResult<Vec<(usize, f64)>> {
    let wrong = |item: String| Failure::from(Error::value("fixed", item, "joints counted from 0, each with a coordinate"));
    fixed
        .iter()
        .map(|(joint, value)| match (joint.extract::<usize>(), value.extract::<f64>()) {
            (Ok(joint), Ok(value)) => Ok((joint, value)),
            _ => Err(wrong(format!("{{{joint}: {value}}}"))),
        })
        .collect()
}

/// Which solutions of a pose are asked for.
pub struct Wanted<'a, 'py> {
    pub task: Option<Task>,
    pub fixed: Option<&'a Bound<'py, PyDict>>,
    pub arm_angle: Option<f64>,
    pub limits: bool,
    pub turns: bool,
}

/// All postures for a pose.
pub fn solve(
    robot: &Arc<Robot>,
    solver: &OnceLock<Result<TaskInverse>>,
    pose: &Bound<'_, PyAny>,
    wanted: &Wanted<'_, '_>,
) -> PyResult<Postures> {
    let target = read_frame("pose", pose)?;
    let fixed = wanted.fixed.map(read_fixed).transpose()?;
    let task = wanted.task.unwrap_or(Task::FULL);
    let found = match (&fixed, wanted.arm_angle) {
        (Some(_), Some(_)) => return Err(Error::value("arm_angle", "given beside fixed", "one of the two").into()),
        (None, Some(_)) if task != Task::FULL => return Err(Error::value("arm_angle", "given beside a task", "the whole frame").into()),
        (None, Some(angle)) => Postures::with_arm_angle(robot, &target, angle)?,
        (Some(fixed), None) => Postures::with_fixed(robot, &task, &target, fixed)?,
        (None, None) if task != Task::FULL => Postures::of(&TaskInverse::new(robot.clone(), task)?, &target),
        (None, None) => Postures::of(solver.get_or_init(|| TaskInverse::new(robot.clone(), task)).as_ref().map_err(Clone::clone)?, &target),
    };
    let inside = wanted.limits || wanted.turns;
    Ok(if inside { found.within_limits(robot, wanted.turns, &fixed.unwrap_or_default()) } else { found })
}

/// Postures as an array (k, n).
pub fn array<'py>(py: Python<'py>, found: &Postures) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = output(py, None, [found.len(), found.n()])?;
    elements(&array).copy_from_slice(found.as_slice());
    Ok(array)
}

/// As a report.
pub fn report<'py>(py: Python<'py>, found: Postures) -> PyResult<Report<'py>> {
    Ok((array(py, &found)?, PyArray1::from_vec(py, found.singular), found.complete))
}
