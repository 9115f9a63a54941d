//! One posture for a pose, or one for each of many.

use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use redundancy::error::{Error, Result, check_finite};
use redundancy::inverse::{Aim, Method, Pose, PoseSolver, Settings, TaskInverse};
use redundancy::linalg::MAX_JOINTS;
use redundancy::robot::{Limits, Robot};
use redundancy::task::{Target, Task};

use crate::array::{RowOrMatrix, ok, read_any, read_row_or_matrix, read_vector, shape_of, vector};
use crate::errors::PyResult;
use crate::robot::frames::Maybe;
use crate::robot::inverse::whole;
use crate::task::PyTask;

/// The posture that `Robot.solve_pose` found for one pose, with what is left of the way to it.
#[pyclass(name = "PoseSolution", frozen, module = "redundancy._core")]
pub struct PyPoseSolution {
    n: usize,
    pose: Pose,
    trace: Vec<f64>,
}

#[pymethods]
impl PyPoseSolution {
    /// The posture, shape (n,) [rad or m].
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.pose.q[..self.n])
    }

    /// "converged", "unreachable", "stationary" or "out of iterations".
    #[getter]
    fn status(&self) -> &'static str {
        self.pose.outcome.name()
    }

    /// Distance of the tool point from the target, as far as the task looks at it [m].
    #[getter]
    fn position_error(&self) -> f64 {
        self.pose.position_error
    }

    /// Angle between the tool and the target, as far as the task looks at it [rad].
    #[getter]
    fn orientation_error(&self) -> f64 {
        self.pose.orientation_error
    }

    /// Steps of all starts; 0 where a closed form gave the posture.
    #[getter]
    fn iterations(&self) -> usize {
        self.pose.iterations
    }

    /// Starts beside the first one.
    #[getter]
    fn restarts(&self) -> usize {
        self.pose.restarts
    }

    /// The cost ``|dp|^2 + L^2/2 |R - R_d|_F^2`` that is left [m^2], L the length of the robot.
    #[getter]
    fn cost(&self) -> f64 {
        self.pose.cost
    }

    /// The cost at every posture that was looked at, in their order, one start after the other; empty unless asked for.
    #[getter]
    fn trace<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.trace)
    }

    fn __repr__(&self) -> String {
        let Pose { position_error, orientation_error, iterations, .. } = self.pose;
        format!("PoseSolution({}, {position_error:.3e} m, {orientation_error:.3e} rad, {iterations} iterations)", self.status())
    }
}

/// The postures that `Robot.solve_pose` found for N poses, with what is left of the way to each.
#[pyclass(name = "PoseSolutions", frozen, module = "redundancy._core")]
pub struct PyPoseSolutions {
    n: usize,
    poses: Vec<Pose>,
}

impl PyPoseSolutions {
    fn each<'py, T: numpy::Element>(&self, py: Python<'py>, of: impl Fn(&Pose) -> T) -> Bound<'py, PyArray1<T>> {
        PyArray1::from_iter(py, self.poses.iter().map(of))
    }
}

#[pymethods]
impl PyPoseSolutions {
    fn __len__(&self) -> usize {
        self.poses.len()
    }

    /// The postures, shape (N, n) [rad or m].
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let numbers: Vec<f64> = self.poses.iter().flat_map(|pose| &pose.q[..self.n]).copied().collect();
        Ok(PyArray1::from_vec(py, numbers).reshape([self.poses.len(), self.n])?)
    }

    /// The status of each, in words.
    #[getter]
    fn status(&self) -> Vec<&'static str> {
        self.poses.iter().map(|pose| pose.outcome.name()).collect()
    }

    /// Distances of the tool point from the targets, shape (N,) [m].
    #[getter]
    fn position_error<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |pose| pose.position_error)
    }

    /// Angles between the tool and the targets, shape (N,) [rad].
    #[getter]
    fn orientation_error<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |pose| pose.orientation_error)
    }

    /// Steps of all starts of each, shape (N,).
    #[getter]
    fn iterations<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.each(py, |pose| pose.iterations as i64)
    }

    /// Starts of each beside the first one, shape (N,).
    #[getter]
    fn restarts<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.each(py, |pose| pose.restarts as i64)
    }

    /// The costs that are left, shape (N,) [m^2].
    #[getter]
    fn cost<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.each(py, |pose| pose.cost)
    }

    fn __repr__(&self) -> String {
        let reached = self.poses.iter().filter(|pose| pose.outcome == redundancy::inverse::Outcome::Converged).count();
        format!("PoseSolutions({reached} of {} converged)", self.poses.len())
    }
}

/// What a robot keeps for poses, made when first asked for: within its limits, and without any.
#[derive(Default)]
pub struct Solvers {
    within: OnceLock<PoseSolver>,
    anywhere: OnceLock<PoseSolver>,
}

impl Solvers {
    fn of(&self, robot: &Arc<Robot>, limits: bool) -> PyResult<&PoseSolver> {
        if limits {
            return Ok(self.within.get_or_init(|| PoseSolver::new(robot.clone())));
        }
        let free = ok(robot.with_limits(Limits::none(robot.n())))?;
        Ok(self.anywhere.get_or_init(|| PoseSolver::new(Arc::new(free))))
    }
}

/// What is asked beside the target.
pub struct Asked<'a, 'py> {
    pub q0: Maybe<'a, 'py>,
    pub task: Option<&'a PyTask>,
    pub limits: bool,
    pub trace: bool,
    pub settings: Settings,
}

/// A way by its name.
pub fn read_method(name: &str) -> PyResult<Method> {
    Ok(match name {
        "auto" => Method::Auto,
        "closed" => Method::Closed,
        "newton" => Method::Newton,
        "descent" => Method::Descent,
        "hybrid" => Method::Hybrid,
        _ => return Err(Error::value("method", format!("{name:?}"), "\"auto\", \"closed\", \"newton\", \"descent\" or \"hybrid\"").into()),
    })
}

/// One target or many.
enum Targets {
    One(Target),
    Many(Vec<Target>),
}

fn read_targets(value: &Bound<'_, PyAny>, aim: Aim) -> PyResult<Targets> {
    let task = if aim.volume.is_some() { &Task::FULL } else { aim.task };
    let width = PyTask::width(task);
    let from = |numbers: &[f64]| if numbers.len() == 16 { PyTask::pose(numbers) } else { PyTask::target(task, numbers) };
    let dimensions = value.getattr("ndim").ok().and_then(|ndim| ndim.extract::<usize>().ok());
    if dimensions.is_none_or(|count| count < 3) {
        let (numbers, shape) = match (dimensions, value) {
            (Some(1 | 2), value) => match read_row_or_matrix("target", value, width) {
                Ok(RowOrMatrix::Matrix(matrix)) => return Ok(Targets::One(ok(from(&matrix))?)),
                Ok(RowOrMatrix::Row(row)) => return Ok(Targets::One(ok(from(&row[..width]))?)),
                Err(_) => read_any("target", value)?,
            },
            _ => read_any("target", value)?,
        };
        return read_numbers(&numbers, &shape, width, &from);
    }
    let (numbers, shape) = read_any("target", value)?;
    read_numbers(&numbers, &shape, width, &from)
}

fn read_numbers(numbers: &[f64], shape: &[usize], width: usize, from: &dyn Fn(&[f64]) -> Result<Target>) -> PyResult<Targets> {
    check_finite("target", numbers)?;
    let size = match *shape {
        [4, 4] => return Ok(Targets::One(ok(from(numbers))?)),
        [k] if k == width => return Ok(Targets::One(ok(from(numbers))?)),
        [_, 4, 4] => 16,
        [_, k] if k == width => width,
        _ => {
            let expected = format!("(4, 4), (N, 4, 4), ({width},) or (N, {width}) for this task");
            return Err(Error::Shape { name: "target".into(), got: shape_of(shape), expected }.into());
        }
    };
    Ok(Targets::Many(ok(numbers.chunks_exact(size).map(from).collect())?))
}

impl Asked<'_, '_> {
    /// One posture, or one for each of many targets.
    pub fn answer<'py>(
        &self,
        py: Python<'py>,
        robot: &Arc<Robot>,
        solvers: &Solvers,
        inverse: &OnceLock<Result<TaskInverse>>,
        target: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (task, volume) = self.task.map_or((&Task::FULL, None), |task| (&task.task, task.volume.as_ref()));
        let aim = Aim { task, volume };
        ok(self.settings.check())?;
        let (n, targets) = (robot.n(), read_targets(target, aim)?);
        let solver = solvers.of(robot, self.limits)?;
        let whole_pose = *task == Task::FULL && volume.is_none();
        let inverse = match self.settings.method {
            Method::Auto if whole_pose => whole(robot, inverse).ok(),
            Method::Closed if whole_pose => Some(ok(whole(robot, inverse))?),
            Method::Closed => return Err(Error::value("method", "\"closed\"", "another one for a task that is not the whole pose").into()),
            _ => None,
        };
        match targets {
            Targets::One(target) => {
                let mut q0 = [0.0; MAX_JOINTS];
                if let Some(given) = self.q0 {
                    read_vector("q0", given, n, &mut q0)?;
                }
                let q0 = self.q0.map(|_| &q0[..n]);
                let (pose, trace) = ok(solver.solve(inverse, aim, &target, q0, &self.settings, self.trace))?;
                Ok(Bound::new(py, PyPoseSolution { n, pose, trace })?.into_any())
            }
            Targets::Many(targets) => {
                let (q0, shape) =
                    self.q0.map_or(Ok((Vec::new(), Vec::new())), |q0| read_any("q0", q0).map(|(q0, shape)| (q0, shape.to_vec())))?;
                check_finite("q0", &q0)?;
                if self.q0.is_some() && *shape != [n] && *shape != [targets.len(), n] {
                    let expected = format!("({n},) or ({}, {n})", targets.len());
                    return Err(Error::Shape { name: "q0".into(), got: shape_of(&shape), expected }.into());
                }
                let q0 = self.q0.map(|_| &*q0);
                let settings = self.settings;
                let poses = py.detach(|| solver.solve_many(inverse, aim, &targets, q0, &settings));
                Ok(Bound::new(py, PyPoseSolutions { n, poses: ok(poses)? })?.into_any())
            }
        }
    }
}
