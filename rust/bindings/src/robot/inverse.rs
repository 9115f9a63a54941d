//! Inverse kinematics as Python gets it.

use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use redundancy::error::{Error, Result};
use redundancy::inverse::{Postures, Request, TaskInverse, Wanted};
use redundancy::kinematics::forward;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::quaternion::Quaternion;
use redundancy::robot::Robot;
use redundancy::task::{OrientationVolume, Task};

use crate::array::{elements, ok, output, read_any, read_vector, shape_of};
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

/// How many values are tried of what is to spare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Samples {
    /// Of a joint.
    Joint(usize),
    /// Of the tilt, the heading and the spin of a volume's members.
    Members((usize, usize, usize)),
}

/// One number of values or three.
#[inline(never)]
pub fn read_samples(samples: &Bound<'_, PyAny>) -> PyResult<Samples> {
    if let Ok(count) = samples.extract() {
        return Ok(Samples::Joint(count));
    }
    samples.extract::<[usize; 3]>().map(|[tilts, headings, spins]| Samples::Members((tilts, headings, spins))).map_err(|_| {
        let shown = samples.repr().map_or_else(|_| "?".into(), |shown| shown.to_string());
        Error::value("samples", shown, "a number of values, or three for the members of a volume").into()
    })
}

/// What is asked beside the poses.
pub struct Asked<'a, 'py> {
    pub task: Option<Task>,
    /// The orientations that are allowed about the poses.
    pub volume: Option<&'a OrientationVolume>,
    pub near: Maybe<'a, 'py>,
    pub fixed: Option<&'a Bound<'py, PyDict>>,
    pub arm_angle: Option<f64>,
    pub samples: Option<Samples>,
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
        let mut poses = read_poses("pose", pose)?;
        let near = self.near.map(|near| read_near(near, robot.n(), &poses)).transpose()?;
        let samples = match (self.volume, self.samples) {
            (Some(volume), samples) => {
                let joints = take_members(robot, volume, &mut poses, samples, near.as_deref())?;
                joints.map(Samples::Joint)
            }
            (None, samples) => samples,
        };
        let samples = match samples {
            Some(Samples::Members(_)) => return Err(Error::value("samples", "three numbers", "one, as the task has no volume").into()),
            Some(Samples::Joint(joint)) => Some(joint),
            None => None,
        };
        let fixed = self.fixed.map(read_fixed).transpose()?;
        let task = self.task.unwrap_or(Task::FULL);
        let wanted = Wanted { task, fixed: fixed.as_deref().unwrap_or_default(), limits: self.limits, turns: self.turns };
        let request = match (self.arm_angle, samples, &fixed) {
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

/// Replaces poses by those of members of a volume about them: all of a grid, or the nearest to the tool at `near` or to the pose itself. The number of values that
/// are left for a joint.
#[inline(never)]
fn take_members(
    robot: &Robot,
    volume: &OrientationVolume,
    poses: &mut Poses,
    samples: Option<Samples>,
    near: Option<&[f64]>,
) -> PyResult<Option<usize>> {
    let about = |pose: &Frame, member: &Quaternion| {
        let turned = Frame { axes: member.axes(), origin: [0.0; 3] };
        pose.compose(&turned)
    };
    if let Some(Samples::Members((tilts, headings, spins))) = samples {
        let Poses::One(pose) = poses else {
            return Err(Error::value("samples", "three numbers beside many poses", "one pose").into());
        };
        let members = volume.grid(tilts, headings, spins);
        *poses = Poses::Many(members.iter().map(|member| about(pose, &member.orientation)).collect());
        return Ok(None);
    }
    let n = robot.n();
    let nearest = |i: usize, pose: &Frame| {
        let own = near.map(|near| if near.len() == n { near } else { &near[i * n..(i + 1) * n] });
        let tool = own.map_or(Ok(*pose), |q| forward(robot, q))?;
        let seen = Quaternion::from_axes(&pose.axes).conjugate().product(&Quaternion::from_axes(&tool.axes));
        Ok::<_, Error>(about(pose, &volume.nearest(&seen).orientation))
    };
    match poses {
        Poses::One(pose) => *pose = ok(nearest(0, pose))?,
        Poses::Many(poses) => {
            for (i, pose) in poses.iter_mut().enumerate() {
                *pose = ok(nearest(i, pose))?;
            }
        }
    }
    Ok(match samples {
        Some(Samples::Joint(count)) => Some(count),
        _ => None,
    })
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
