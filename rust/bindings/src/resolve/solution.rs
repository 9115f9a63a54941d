//! Targets as Python gives them, and solutions as it gets them, the same from every solver.

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::array::{
    RowOrMatrix, elements, ok, output, read_one_or_many, read_rotation_or_pose, read_row_or_matrix, read_rows_or_matrices, read_vector,
    vector,
};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::results::{PATH_SOLUTION, SOLUTION};
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::error::Error;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::Vec3;
use redundancy::linalg::{MAX_JOINTS, Row6};
use redundancy::resolve::{Memory, PathFrame, Resolver, Solution, SolveStatus, StepStatus};
use redundancy::robot::Robot;
use redundancy::task::{Target, Task};

/// What a solver was made of in Python.
pub struct Given {
    pub robot: Py<PyRobot>,
    pub task: Py<PyTask>,
    pub objective: Option<Py<PyAny>>,
    /// Whether a step calls back into Python, where another thread may get in.
    pub calls_python: bool,
}

impl Given {
    pub fn new(py: Python<'_>, robot: Py<PyRobot>, task: Py<PyTask>, objective: Option<Py<PyAny>>) -> Self {
        let calls_python = terms(py, objective.as_ref()).is_some_and(|objective| !objective.get().custom.is_empty());
        Self { robot, task, objective, calls_python }
    }

    /// The same with another objective.
    pub fn with_objective(&self, py: Python<'_>, objective: Option<Py<PyAny>>) -> Self {
        Self::new(py, self.robot.clone_ref(py), self.task.clone_ref(py), objective)
    }

    /// Raises the exception of a callable among the terms of the objective, if one was raised.
    #[inline]
    pub fn check(&self, py: Python<'_>) -> PyResult<()> {
        match terms(py, self.objective.as_ref().filter(|_| self.calls_python)) {
            Some(objective) => objective.get().check(),
            None => Ok(()),
        }
    }

    /// A posture on a target, from `q0` or from the best of some random starts.
    pub fn solve<'py>(
        &self,
        py: Python<'py>,
        solver: &dyn Resolver,
        asked: &Bound<'py, PyAny>,
        q0: Option<&Bound<'py, PyAny>>,
        starts: usize,
        seed: u64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let target = target(form(solver), "target", asked)?;
        let n = solver.robot().n();
        let solution = match q0 {
            Some(q0) => {
                let q = posture(solver.robot(), "q0", q0)?;
                Some(py.detach(|| solver.solve(&target, &q[..n])))
            }
            None => py.detach(|| solver.solve_best(&target, starts, seed)),
        };
        self.check(py)?;
        let parts = match solution {
            Some(s) => (vector(py, &s.q[..n]), s.value, s.status.name(), s.iterations),
            // NaN where no start came near.
            None => (vector(py, &[f64::NAN; MAX_JOINTS][..n]), f64::NAN, SolveStatus::Unreachable.name(), 0),
        };
        Ok(SOLUTION.make(py, parts)?)
    }

    /// Along some targets, and the posture at the end.
    pub fn follow<'py>(
        &self,
        py: Python<'py>,
        solver: &dyn Resolver,
        targets: &[Target],
        q0: &[f64; MAX_JOINTS],
        memory: &mut Memory,
    ) -> PyResult<(Bound<'py, PyAny>, [f64; MAX_JOINTS])> {
        let n = solver.robot().n();
        let mut points = Vec::with_capacity(targets.len());
        py.detach(|| solver.follow(targets, &q0[..n], memory, &mut |point| points.push(*point)));
        self.check(py)?;
        let array = output(py, None, [points.len(), n])?;
        for (row, point) in elements(&array).chunks_exact_mut(n).zip(&points) {
            row.copy_from_slice(&point.q[..n]);
        }
        let column = |f: fn(&Solution) -> f64| vector(py, &points.iter().map(f).collect::<Vec<_>>());
        let statuses: Vec<&str> = points.iter().map(|p| p.status.name()).collect();
        let iterations: usize = points.iter().map(|p| p.iterations).sum();
        let parts = (array, column(|p| p.value), column(|p| p.position_error), column(|p| p.angle_error), statuses, iterations);
        Ok((PATH_SOLUTION.make(py, parts)?, points.last().map_or(*q0, |point| point.q)))
    }
}

fn terms<'a, 'py>(py: Python<'py>, objective: Option<&'a Py<PyAny>>) -> Option<&'a Bound<'py, PyObjective>> {
    objective.and_then(|objective| objective.bind(py).cast::<PyObjective>().ok())
}

/// A posture of a robot.
#[inline]
pub fn posture(robot: &Robot, name: &str, q: &Bound<'_, PyAny>) -> PyResult<[f64; MAX_JOINTS]> {
    let mut buffer = [0.0; MAX_JOINTS];
    read_vector(name, q, robot.n(), &mut buffer)?;
    Ok(buffer)
}

/// Targets of a path, and the posture that it starts from.
pub fn path(solver: &dyn Resolver, asked: &Bound<'_, PyAny>, q0: &Bound<'_, PyAny>) -> PyResult<(Vec<Target>, [f64; MAX_JOINTS])> {
    Ok((targets(form(solver), asked)?, posture(solver.robot(), "q0", q0)?))
}

/// The task whose targets a solver takes: whole frames where the orientation has to be in a volume about them.
pub fn form(solver: &dyn Resolver) -> &Task {
    if solver.volume().is_some() { &Task::FULL } else { solver.task() }
}

/// The path's frame of a tick as a (3, 3) or (4, 4) array, needed where the orientation has to be in a volume about it and refused elsewhere; `start` is that at
/// the end of the tick before.
#[inline(never)]
pub fn path_frame(solver: &dyn Resolver, frame: Option<&Bound<'_, PyAny>>, start: Option<[Vec3; 3]>) -> PyResult<Option<PathFrame>> {
    let Some(frame) = frame else {
        return match solver.volume() {
            None => Ok(None),
            Some(_) => {
                Err(Error::value("frame", "None", "the path's frame at the end of the tick, as the task is within a volume about it")
                    .into())
            }
        };
    };
    if solver.volume().is_none() {
        return Err(Error::value("frame", "given", "none, as the task has no volume about it").into());
    }
    let matrix = read_rotation_or_pose("frame", frame)?;
    Ok(Some(PathFrame { start, end: ok(Frame::from_matrix("frame", &matrix))?.axes }))
}

/// One target of a task: its own numbers, or a pose of the tool.
#[inline(never)]
pub fn target(task: &Task, name: &str, value: &Bound<'_, PyAny>) -> PyResult<Target> {
    ok(match read_row_or_matrix(name, value, PyTask::width(task))? {
        RowOrMatrix::Row(row) => PyTask::target(task, &row),
        RowOrMatrix::Matrix(matrix) => PyTask::pose(&matrix),
    })
}

/// Targets of a task, one a row, or poses of the tool.
pub fn targets(task: &Task, value: &Bound<'_, PyAny>) -> PyResult<Vec<Target>> {
    let (numbers, size) = read_rows_or_matrices("targets", value, PyTask::width(task))?;
    let one = |row: &[f64]| if size == 16 { PyTask::pose(row) } else { PyTask::target(task, row) };
    numbers.chunks_exact(size).map(|row| ok(one(row))).collect()
}

/// The small motions from the tool to targets over the time `dt`: of one posture, or of each of many to its own target.
#[inline(never)]
pub fn error<'py>(
    py: Python<'py>,
    solver: &dyn Resolver,
    q: &Bound<'py, PyAny>,
    asked: &Bound<'py, PyAny>,
    dt: f64,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let (n, mut row) = (solver.robot().n(), [0.0; MAX_JOINTS]);
    let each = |out: &mut [f64], target: &Target, q: &[f64]| out.copy_from_slice(&solver.error(target, q).map(|error| error / dt));
    let Some(rows) = read_one_or_many("q", q, n, &mut row)? else {
        let (target, array) = (target(form(solver), "target", asked)?, output(py, None, [6])?);
        each(elements(&array), &target, &row[..n]);
        return Ok(array);
    };
    let targets = targets(form(solver), asked)?;
    let count = rows.len() / n;
    if targets.len() != count {
        return Err(Error::length("targets", targets.len(), count).into());
    }
    let array = output(py, None, [count, 6])?;
    for ((out, target), q) in elements(&array).chunks_exact_mut(6).zip(&targets).zip(rows.chunks_exact(n)) {
        each(out, target, q);
    }
    Ok(array)
}

/// The posture, the twist and, about which a volume is, the path's frame of a tick along a path.
#[inline(never)]
pub fn along(
    solver: &dyn Resolver,
    q: &Bound<'_, PyAny>,
    now: &Bound<'_, PyAny>,
    next: &Bound<'_, PyAny>,
    share: f64,
) -> PyResult<([f64; MAX_JOINTS], Row6, Option<PathFrame>)> {
    let q = posture(solver.robot(), "q", q)?;
    if !(share > 0.0 && share <= 1.0) {
        return Err(Error::value("share", share, "a part above 0, at most 1").into());
    }
    let (now, next) = (target(form(solver), "now", now)?, target(form(solver), "next", next)?);
    let frame = solver.volume().map(|_| PathFrame { start: Some(now.frame), end: next.frame });
    Ok((q, solver.twist_along(&now, &next, share, &q[..solver.robot().n()]), frame))
}

/// What the last step was asked and answered.
#[derive(Clone, Copy)]
pub struct Last {
    pub status: StepStatus,
    q: [f64; MAX_JOINTS],
    twist: Row6,
    rates: [f64; MAX_JOINTS],
    /// The path's frame at its end, about which a volume is.
    pub frame: Option<[Vec3; 3]>,
}

impl Last {
    /// Nothing asked yet.
    pub const NONE: Self =
        Self { status: StepStatus::Regular, q: [0.0; MAX_JOINTS], twist: [0.0; 6], rates: [0.0; MAX_JOINTS], frame: None };

    /// Takes up a step, in place.
    #[inline(always)]
    pub fn take(&mut self, status: StepStatus, q: &[f64; MAX_JOINTS], twist: &Row6, frame: Option<&PathFrame>, rates: &[f64]) {
        (self.status, self.q, self.twist, self.frame) = (status, *q, *twist, frame.map(|frame| frame.end));
        for (kept, rate) in self.rates.iter_mut().zip(rates) {
            *kept = *rate;
        }
    }

    /// The part of the twist that was not followed.
    pub fn deviation<'py>(&self, py: Python<'py>, solver: &dyn Resolver) -> Bound<'py, PyArray1<f64>> {
        let n = solver.robot().n();
        vector(py, &solver.deviation(&self.q[..n], &self.twist, &self.rates[..n]))
    }
}
