//! Targets as Python gives them, and solutions as it gets them, the same from every solver.

use pyo3::prelude::*;

use crate::array::{Rows, elements, ok, output, read_rows, read_vector, vector};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::results::{PATH_SOLUTION, SOLUTION};
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Memory, Resolver, Solution, SolveStatus};
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
        let target = target(solver.task(), asked)?;
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
    Ok((targets(solver.task(), asked)?, posture(solver.robot(), "q0", q0)?))
}

/// One target of a task.
pub fn target(task: &Task, value: &Bound<'_, PyAny>) -> PyResult<Target> {
    let mut row = [0.0; MAX_JOINTS];
    read_vector("target", value, PyTask::width(task), &mut row)?;
    ok(PyTask::target(task, &row))
}

/// Targets of a task, one a row.
pub fn targets(task: &Task, value: &Bound<'_, PyAny>) -> PyResult<Vec<Target>> {
    let width = PyTask::width(task);
    let rows = match read_rows("targets", value, width)? {
        Rows::Many(rows) => rows,
        Rows::One(row) => row[..width].to_vec(),
    };
    rows.chunks_exact(width).map(|row| ok(PyTask::target(task, row))).collect()
}
