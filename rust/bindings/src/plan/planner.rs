//! A whole plan in one call.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use redundancy::error::Error;
use redundancy::plan::{Hooks, Plan, Planner, Progress, Transfer, WarmStart};

use super::failure::PyPlanFailure;
use super::path::{PyPath, rows_array};
use super::predicate::{asked, priced, raised};
use super::settings::PyPlanSettings;
use crate::array::{Rows, read_rows, vector};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::robot::PyRobot;
use crate::task::PyTask;

/// How often the interpreter is asked for signals.
const PATIENCE: Duration = Duration::from_millis(50);

/// A path planned as a whole, in numbers; `redundancy.Plan` explains them.
#[pyclass(name = "PlannedPath", frozen, get_all, module = "redundancy._core")]
pub struct PyPlannedPath {
    q: Py<PyArray2<f64>>,
    value: Py<PyArray1<f64>>,
    position_error: Py<PyArray1<f64>>,
    axis_error: Py<PyArray1<f64>>,
    status: Vec<&'static str>,
    length: f64,
    smoothness: f64,
    cost: f64,
    motion: f64,
    edge_cost: f64,
    bound: f64,
    residual: f64,
    refined: bool,
    failure: Option<Py<PyPlanFailure>>,
    notes: Vec<String>,
    ways: Vec<(f64, f64, f64, bool)>,
    segments: Vec<(usize, usize)>,
    transfers: Vec<Py<PyPathTransfer>>,
}

/// From the end of a segment of a path to the start of the next, in numbers; `redundancy.Transfer` explains them.
#[pyclass(name = "PathTransfer", frozen, get_all, module = "redundancy._core")]
pub struct PyPathTransfer {
    points: (usize, usize),
    q: Py<PyArray2<f64>>,
    lift: (f64, f64),
    allowed: bool,
}

impl PyPathTransfer {
    fn new(py: Python<'_>, transfer: &Transfer, n: usize) -> PyResult<Py<Self>> {
        let q = rows_array(py, &transfer.q, n)?.unbind();
        Ok(Py::new(py, Self { points: transfer.points, q, lift: transfer.lift, allowed: transfer.allowed })?)
    }
}

impl PyPlannedPath {
    fn new(py: Python<'_>, plan: &Plan, n: usize) -> PyResult<Self> {
        Ok(Self {
            q: rows_array(py, &plan.q, n)?.unbind(),
            value: vector(py, &plan.value).unbind(),
            position_error: vector(py, &plan.position_error).unbind(),
            axis_error: vector(py, &plan.axis_error).unbind(),
            status: plan.status.iter().map(|status| status.name()).collect(),
            length: plan.length,
            smoothness: plan.smoothness,
            cost: plan.cost,
            motion: plan.motion,
            edge_cost: plan.edge_cost,
            bound: plan.bound,
            residual: plan.residual,
            refined: plan.refined,
            failure: plan.failure.clone().map(|failure| Py::new(py, PyPlanFailure::from(failure))).transpose()?,
            notes: plan.notes.clone(),
            ways: plan.ways.iter().map(|way| (way.value, way.motion, way.largest_step, way.refined)).collect(),
            segments: plan.segments.clone(),
            transfers: plan.transfers.iter().map(|transfer| PyPathTransfer::new(py, transfer, n)).collect::<PyResult<_>>()?,
        })
    }
}

/// Plan a path; `redundancy.plan` explains the arguments.
///
/// Parameters
/// ----------
/// robot, path, task, objective, settings
///     The problem.
/// feasible : callable, optional
///     Gets postures (M, n), returns which are allowed, bool of shape (M,).
/// edge_cost : callable, optional
///     Gets postures before and after a step, (M, n) each, returns what the step costs, shape (M,).
/// warm_start : tuple, optional
///     Path and postures (N, n) of an earlier plan.
/// progress : callable, optional
///     Called with the share of the work that was done since the last call; all of them together are 1.
#[pyfunction]
#[pyo3(signature = (robot, path, task, objective, settings, feasible=None, edge_cost=None, warm_start=None, progress=None))]
pub fn plan_path(
    py: Python<'_>,
    robot: &PyRobot,
    path: &PyPath,
    task: &PyTask,
    objective: Option<Py<PyObjective>>,
    settings: &PyPlanSettings,
    feasible: Option<Py<PyAny>>,
    edge_cost: Option<Py<PyAny>>,
    warm_start: Option<(PyRef<'_, PyPath>, Bound<'_, PyAny>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyPlannedPath> {
    let n = robot.robot.n();
    let objective = objective.as_ref().map(Py::get);
    let terms = objective.map(|objective| objective.objective.clone());
    let (arm, along, settings) = (robot.robot.clone(), path.path.clone(), settings.settings.clone());
    let mut planner = match &task.volume {
        Some(volume) => Planner::within(arm, along, volume, terms, settings)?,
        None => Planner::new(arm, along, task.task, terms, settings)?,
    };
    if let Some((path, q)) = &warm_start {
        planner = planner.with_warm_start(earlier(path, q, n)?);
    }
    let interruption = Interruption { objective, error: Mutex::new(None), asked: Mutex::new(Instant::now()) };
    let planned = py.detach(|| {
        let mut ask = feasible.as_ref().map(|feasible| |q: &[f64]| asked(feasible, q, n));
        let mut price = edge_cost.as_ref().map(|edge_cost| |before: &[f64], after: &[f64]| priced(edge_cost, before, after, n));
        let mut tell = progress.as_ref().map(|progress| |share: f64| interruption.tell(progress, share));
        let mut cancelled = || interruption.is_cancelled();
        planner.plan(&mut Hooks {
            feasible: ask.as_mut().map(|ask| ask as _),
            edge_cost: price.as_mut().map(|price| price as _),
            progress: tell.as_mut().map(|tell| Progress::new(tell)),
            cancelled: Some(&mut cancelled),
        })
    });
    interruption.check()?;
    PyPlannedPath::new(py, &planned.map_err(raised)?, n)
}

/// An earlier plan; the number of its joints is for the planner to judge.
fn earlier(path: &PyPath, q: &Bound<'_, PyAny>, n: usize) -> PyResult<WarmStart> {
    let joints = q.getattr("shape")?.get_item(1)?.extract()?;
    let q = match read_rows("warm_start", q, joints)? {
        Rows::Many(rows) => rows,
        Rows::One(row) => row[..n].to_vec(),
    };
    if q.len() != joints * path.path.len() {
        return Err(Error::length("warm_start", q.len() / joints.max(1), path.path.len()).into());
    }
    Ok(WarmStart { path: path.path.clone(), n: joints, q })
}

/// What ends a plan from outside: an exception in the user's code, or a signal.
struct Interruption<'a> {
    objective: Option<&'a PyObjective>,
    error: Mutex<Option<PyErr>>,
    asked: Mutex<Instant>,
}

impl Interruption<'_> {
    fn is_cancelled(&self) -> bool {
        if let Some(Err(error)) = self.objective.map(PyObjective::check) {
            self.keep(error.into());
        }
        if let Ok(mut asked) = self.asked.lock()
            && asked.elapsed() > PATIENCE
        {
            if let Err(signal) = Python::attach(|py| py.check_signals()) {
                self.keep(signal);
            }
            *asked = Instant::now();
        }
        self.error.lock().is_ok_and(|error| error.is_some())
    }

    fn tell(&self, progress: &Py<PyAny>, share: f64) {
        if let Err(error) = Python::attach(|py| progress.call1(py, (share,))) {
            self.keep(error);
        }
    }

    /// The first exception counts.
    fn keep(&self, error: PyErr) {
        if let Ok(mut slot) = self.error.lock() {
            slot.get_or_insert(error);
        }
    }

    /// Raises the exception that ended the plan, or came at its end.
    fn check(&self) -> PyResult<()> {
        self.objective.map_or(Ok(()), PyObjective::check)?;
        match self.error.lock().ok().and_then(|mut slot| slot.take()) {
            Some(error) => Err(error.into()),
            None => Ok(()),
        }
    }
}
