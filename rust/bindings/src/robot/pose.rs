//! One posture for a pose, or one for each of many.

use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use redundancy::error::{Error, Result, check_finite};
use redundancy::inverse::{Aim, Method, Outcome, Pose, PoseSolver, Settings, TaskInverse};
use redundancy::linalg::MAX_JOINTS;
use redundancy::robot::{Limits, Robot};
use redundancy::task::{Target, Task};

use crate::array::{RowOrMatrix, ok, read_any, read_row_or_matrix, read_vector, shape_of, vector};
use crate::errors::PyResult;
use crate::robot::frames::Maybe;
use crate::robot::inverse::{made, whole};
use crate::task::PyTask;

/// Poses that are solved before a look whether the caller wants to stop: half a second's where all are out of reach.
const BETWEEN_SIGNALS: usize = 2048;

/// What `Robot.solve_pose` found: of one target numbers, of N targets arrays with a leading axis N.
#[pyclass(name = "PoseSolution", frozen, module = "redundancy._core")]
pub struct PyPoseSolution {
    n: usize,
    /// One, or those of many targets.
    poses: std::result::Result<Pose, Vec<Pose>>,
    trace: Vec<f64>,
}

impl PyPoseSolution {
    /// A number, or an array of them.
    fn each<'py, T: numpy::Element + IntoPyObject<'py>>(&self, py: Python<'py>, of: &dyn Fn(&Pose) -> T) -> PyResult<Bound<'py, PyAny>> {
        match &self.poses {
            Ok(pose) => Ok(of(pose).into_bound_py_any(py)?),
            Err(many) => Ok(PyArray1::from_iter(py, many.iter().map(of)).into_any()),
        }
    }
}

#[pymethods]
impl PyPoseSolution {
    fn __len__(&self) -> PyResult<usize> {
        match &self.poses {
            Ok(_) => Err(pyo3::exceptions::PyTypeError::new_err("the solution of one pose has no len()").into()),
            Err(many) => Ok(many.len()),
        }
    }

    /// The posture, shape (n,), or postures (N, n) [rad or m].
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.poses {
            Ok(pose) => Ok(vector(py, &pose.q[..self.n]).into_any()),
            Err(many) => {
                let numbers: Vec<f64> = many.iter().flat_map(|pose| &pose.q[..self.n]).copied().collect();
                Ok(PyArray1::from_vec(py, numbers).reshape([many.len(), self.n])?.into_any())
            }
        }
    }

    /// "converged", "unreachable", "stationary" or "out of iterations"; of many targets a list of these.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match &self.poses {
            Ok(pose) => Ok(pose.outcome.name().into_bound_py_any(py)?),
            Err(many) => Ok(many.iter().map(|pose| pose.outcome.name()).collect::<Vec<_>>().into_bound_py_any(py)?),
        }
    }

    /// Distance of the tool point from the target, as far as the task looks at it [m].
    #[getter]
    fn position_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.each(py, &|pose| pose.position_error)
    }

    /// Angle between the tool and the target, or the nearest member of a volume, as far as the task looks at it [rad].
    #[getter]
    fn orientation_error<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.each(py, &|pose| pose.orientation_error)
    }

    /// Steps of all starts; 0 where a closed form gave the posture.
    #[getter]
    fn iterations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.each(py, &|pose| pose.iterations as i64)
    }

    /// Starts beside the first one.
    #[getter]
    fn restarts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.each(py, &|pose| pose.restarts as i64)
    }

    /// The cost ``|dp|^2 + L^2/2 |R - R_d|_F^2`` that is left [m^2], L a third of the links in line.
    #[getter]
    fn cost<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.each(py, &|pose| pose.cost)
    }

    /// The cost at every posture that was looked at, in their order, one start after the other; empty unless asked for, of one target.
    #[getter]
    fn trace<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.trace)
    }

    fn __repr__(&self) -> String {
        match &self.poses {
            Ok(Pose { outcome, position_error, orientation_error, iterations, .. }) => {
                let errors = format!("{position_error:.3e} m, {orientation_error:.3e} rad");
                format!("PoseSolution({}, {errors}, {iterations} iterations)", outcome.name())
            }
            Err(many) => {
                let reached = many.iter().filter(|pose| pose.outcome == Outcome::Converged).count();
                format!("PoseSolution({reached} of {} converged)", many.len())
            }
        }
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
            Method::Auto if whole_pose => made(robot, inverse).as_ref().ok(),
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
                Ok(Bound::new(py, PyPoseSolution { n, poses: Ok(pose), trace })?.into_any())
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
                let mut poses = Vec::with_capacity(targets.len());
                for (k, part) in targets.chunks(BETWEEN_SIGNALS).enumerate() {
                    let starts = q0.map(|q0| if q0.len() == n { q0 } else { &q0[k * BETWEEN_SIGNALS * n..][..part.len() * n] });
                    poses.extend(ok(py.detach(|| solver.solve_many(inverse, aim, part, starts, &settings)))?);
                    py.check_signals()?;
                }
                Ok(Bound::new(py, PyPoseSolution { n, poses: Err(poses), trace: Vec::new() })?.into_any())
            }
        }
    }
}
