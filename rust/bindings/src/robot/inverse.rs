//! Inverse kinematics as Python gets it.

use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use redundancy::error::{Error, Result};
use redundancy::inverse::{Postures, Request, TaskInverse, Wanted};
use redundancy::robot::Robot;
use redundancy::task::Task;

use crate::array::{elements, output, read_any, read_vector, shape_of};
use crate::errors::{Failure, PyResult};
use crate::robot::frames::{Maybe, Poses, read_poses};
use redundancy::error::check_finite;

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

/// What is asked beside the poses.
pub struct Asked<'a, 'py> {
    pub task: Option<Task>,
    pub near: Maybe<'a, 'py>,
    pub fixed: Option<&'a Bound<'py, PyDict>>,
    pub arm_angle: Option<f64>,
    pub samples: Option<usize>,
    pub limits: bool,
    pub turns: bool,
    pub report: bool,
}

impl Asked<'_, '_> {
    /// Postures for one pose, or for many with the numbers of their poses.
    pub fn answer<'py>(
        &self,
        py: Python<'py>,
        robot: &Arc<Robot>,
        solver: &OnceLock<Result<TaskInverse>>,
        pose: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let poses = read_poses("pose", pose)?;
        let near = self.near.map(|near| read_near(near, robot.n(), &poses)).transpose()?;
        let fixed = self.fixed.map(read_fixed).transpose()?;
        let task = self.task.unwrap_or(Task::FULL);
        let wanted = Wanted { task, fixed: fixed.as_deref().unwrap_or_default(), limits: self.limits, turns: self.turns };
        let request = match (self.arm_angle, self.samples, &fixed) {
            (Some(_), _, Some(_)) => return Err(Error::value("arm_angle", "given beside fixed", "one of the two").into()),
            (Some(_), Some(_), _) => return Err(Error::value("samples", "given beside arm_angle", "one of the two").into()),
            (Some(_), None, None) if task != Task::FULL => {
                return Err(Error::value("arm_angle", "given beside a task", "the whole frame").into());
            }
            (Some(angle), None, None) => Request::with_arm_angle(robot, angle, wanted)?,
            (None, Some(samples), _) => Request::swept(robot, samples, wanted)?,
            (None, None, None) if task == Task::FULL => Request::whole(whole(robot, solver)?, wanted),
            (None, None, _) => Request::held(robot, wanted)?,
        };
        match poses {
            Poses::One(pose) => {
                let solve = || request.solve(&pose, near.as_deref());
                let found = if request.is_slow() { py.detach(solve) } else { solve() }?;
                let q = array(py, &found)?;
                if !self.report {
                    return Ok(q.into_any());
                }
                Ok((q, PyArray1::from_vec(py, found.singular), found.complete).into_bound_py_any(py)?)
            }
            Poses::Many(poses) => {
                let found = py.detach(|| request.solve_many(&poses, near.as_deref()))?;
                let (q, singular) = found.postures.into_parts();
                let q = PyArray1::from_vec(py, q).reshape([singular.len(), robot.n()])?;
                let frame = PyArray1::from_vec(py, found.frame);
                if !self.report {
                    return Ok((q, frame).into_bound_py_any(py)?);
                }
                Ok((q, frame, PyArray1::from_vec(py, singular), PyArray1::from_vec(py, found.complete)).into_bound_py_any(py)?)
            }
        }
    }
}

/// The solver of whole frames, made when first asked for.
pub fn whole<'a>(robot: &Arc<Robot>, solver: &'a OnceLock<Result<TaskInverse>>) -> Result<&'a TaskInverse> {
    made(robot, solver).as_ref().map_err(Clone::clone)
}

/// The same, or why there is none.
pub fn made<'a>(robot: &Arc<Robot>, solver: &'a OnceLock<Result<TaskInverse>>) -> &'a Result<TaskInverse> {
    solver.get_or_init(|| TaskInverse::new(robot.clone(), Task::FULL))
}

/// The posture to be near to, or one for each pose.
fn read_near(near: &Bound<'_, PyAny>, n: usize, poses: &Poses) -> PyResult<Vec<f64>> {
    let Poses::Many(poses) = poses else {
        let mut one = vec![0.0; n];
        read_vector("near", near, n, &mut one)?;
        return Ok(one);
    };
    let (numbers, shape) = read_any("near", near)?;
    check_finite("near", &numbers)?;
    if shape != [n] && shape != [poses.len(), n] {
        return Err(
            Error::Shape { name: "near".into(), got: shape_of(&shape), expected: format!("({n},) or ({}, {n})", poses.len()) }.into()
        );
    }
    Ok(numbers)
}

/// Postures as an array (k, n).
fn array<'py>(py: Python<'py>, found: &Postures) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = output(py, None, [found.len(), found.n()])?;
    elements(&array).copy_from_slice(found.as_slice());
    Ok(array)
}
