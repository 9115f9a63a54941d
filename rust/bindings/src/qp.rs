//! `redundancy.solve_qp`.

use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{ok, read_any, read_list, vector};
use crate::results::QP_SOLUTION;
use redundancy::error::Error;
use redundancy::qp::{self, MAX_VARIABLES, Place, Programme, Row};

/// A small strictly convex quadratic programme: minimise ``x'Hx/2 + g'x`` subject to bounds and rows.
///
/// Parameters
/// ----------
/// h : array_like, shape (n, n)
///     Symmetric and positive definite, n at most 20; the lower triangle is read.
/// g : array_like, shape (n,)
///     Gradient at zero.
/// lower, upper : array_like, shape (n,), optional
///     Bounds; infinite if not given.
/// rows : array_like, shape (m, n), optional
///     A of ``row_lower <= A x <= row_upper``.
/// row_lower, row_upper : array_like, shape (m,), optional
///     Infinite if not given; equal for an equality.
///
/// Returns
/// -------
/// x : ndarray, shape (n,)
///     Minimiser, if solved; the last iterate if not.
/// status : str
///     "solved", "infeasible", "not convex", "iterations" or "undefined" (numbers that are not finite, or overflow on the way).
/// bound_multipliers : ndarray, shape (n,)
///     Of the bounds: at least 0 at a lower one, at most 0 at an upper one. If infeasible, with those of the rows a certificate:
///     the combination of the normals vanishes while that of the limits is positive. Zeros where one constraint's own limits are crossed.
/// row_multipliers : ndarray, shape (m,)
///     Of the rows, likewise.
/// changes : int
///     Constraints added or dropped.
///
/// Raises
/// ------
/// ShapeError
///     If the arrays do not fit together.
/// InvalidValueError
///     If there are more than 20 variables.
///
/// Notes
/// -----
/// The dual active-set method of Goldfarb and Idnani (1983), from the free minimiser; at most 50 + 10 (n + m) changes.
#[pyfunction]
#[pyo3(signature = (h, g, lower=None, upper=None, rows=None, row_lower=None, row_upper=None))]
pub fn solve_qp<'py>(
    py: Python<'py>,
    h: &Bound<'py, PyAny>,
    g: &Bound<'py, PyAny>,
    lower: Option<&Bound<'py, PyAny>>,
    upper: Option<&Bound<'py, PyAny>>,
    rows: Option<&Bound<'py, PyAny>>,
    row_lower: Option<&Bound<'py, PyAny>>,
    row_upper: Option<&Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyAny>> {
    let g = read_list("g", g)?;
    let n = g.len();
    if n > MAX_VARIABLES {
        return Err(Error::value("g", format!("{n} variables"), &format!("at most {MAX_VARIABLES}")).into());
    }
    let matrix = |name: &str, value: &Bound<'py, PyAny>, rows: Option<usize>| -> PyResult<Vec<f64>> {
        let (numbers, shape) = read_any(name, value)?;
        let expected = rows.map_or("m".into(), |rows| rows.to_string());
        match shape.as_slice() {
            [m, width] if *width == n && rows.is_none_or(|rows| rows == *m) => Ok(numbers),
            _ => Err(Error::Shape { name: name.into(), got: format!("{shape:?}"), expected: format!("({expected}, {n})") }.into()),
        }
    };
    let list = |name: &str, value: Option<&Bound<'py, PyAny>>, count: usize, open: f64| -> PyResult<Vec<f64>> {
        let list = value.map_or_else(|| Ok(vec![open; count]), |value| read_list(name, value))?;
        if list.len() == count { Ok(list) } else { Err(Error::length(name, list.len(), count).into()) }
    };
    let h = matrix("h", h, Some(n))?;
    let a = rows.map_or_else(|| Ok(Vec::new()), |rows| matrix("rows", rows, None))?;
    let m = a.len().checked_div(n).unwrap_or(0);
    let (lower, upper) = (list("lower", lower, n, f64::NEG_INFINITY)?, list("upper", upper, n, f64::INFINITY)?);
    let (row_lower, row_upper) = (list("row_lower", row_lower, m, f64::NEG_INFINITY)?, list("row_upper", row_upper, m, f64::INFINITY)?);
    let rows: Vec<Row<'_>> = (0..m).map(|k| Row { a: &a[k * n..(k + 1) * n], lower: row_lower[k], upper: row_upper[k] }).collect();
    let found = ok(qp::solve(&Programme { h: &h, g: &g, lower: &lower, upper: &upper, rows: &rows }, &[]))?;
    let last = |place: Place| found.violated.filter(|(constraint, _)| constraint.place == place).map_or(0.0, |(_, value)| value);
    let multipliers =
        |count: usize, place: fn(usize) -> Place| -> Vec<f64> { (0..count).map(|i| found.multiplier(place(i)) + last(place(i))).collect() };
    let (bounds, of_rows) = (multipliers(n, Place::Bound), multipliers(m, Place::Row));
    let parts = (vector(py, &found.x), found.status.name(), vector(py, &bounds), vector(py, &of_rows), found.changes);
    Ok(QP_SOLUTION.make(py, parts)?)
}
