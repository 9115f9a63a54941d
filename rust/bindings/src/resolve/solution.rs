//! Solutions as Python gets them, the same from every solver.

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{Rows, elements, ok, output, read_rows, read_vector, vector};
use crate::task::PyTask;
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Solution, SolveStatus};
use redundancy::task::{Target, Task};

/// One target: q, value, status, iterations.
pub type Solved<'py> = (Bound<'py, PyArray1<f64>>, f64, &'static str, usize);

/// Many: q, value, position error, axis error, statuses, iterations altogether.
pub type Followed<'py> = (
    Bound<'py, PyArrayDyn<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Vec<&'static str>,
    usize,
);

/// The name of a status.
pub fn status_name(status: SolveStatus) -> &'static str {
    match status {
        SolveStatus::Converged => "converged",
        SolveStatus::OnTarget => "on target",
        SolveStatus::Unreachable => "unreachable",
    }
}

/// A solution, NaN where no start came near.
pub fn solved(py: Python<'_>, solution: Option<Solution>, n: usize) -> Solved<'_> {
    match solution {
        Some(s) => (vector(py, &s.q[..n]), s.value, status_name(s.status), s.iterations),
        None => (vector(py, &[f64::NAN; MAX_JOINTS][..n]), f64::NAN, status_name(SolveStatus::Unreachable), 0),
    }
}

/// The solutions along some targets.
pub fn followed<'py>(py: Python<'py>, points: &[Solution], n: usize) -> PyResult<Followed<'py>> {
    let array = output(py, None, [points.len(), n])?;
    for (row, point) in elements(&array).chunks_exact_mut(n).zip(points) {
        row.copy_from_slice(&point.q[..n]);
    }
    let column = |f: fn(&Solution) -> f64| vector(py, &points.iter().map(f).collect::<Vec<_>>());
    let statuses = points.iter().map(|p| status_name(p.status)).collect();
    let iterations = points.iter().map(|p| p.iterations).sum();
    Ok((array, column(|p| p.value), column(|p| p.position_error), column(|p| p.angle_error), statuses, iterations))
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
