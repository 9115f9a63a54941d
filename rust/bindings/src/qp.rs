//! `redundancy.solve_qp`.

use numpy::PyArray1;
use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{read_any, read_list, vector};
use redundancy::error::Error;
use redundancy::optimize::qp::{self, ActiveSet, Place, Problem, Row, Status};

/// Variables at most.
const LARGEST: usize = 20;

/// Minimiser, status, multipliers of the bounds and of the rows, and changes.
type Solved<'py> = (Bound<'py, PyArray1<f64>>, &'static str, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, usize);

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
) -> PyResult<Solved<'py>> {
    let g = read_list("g", g)?;
    let n = g.len();
    if n > LARGEST {
        return Err(Error::value("g", format!("{n} variables"), &format!("at most {LARGEST}")).into());
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
    let wide = |values: &[f64]| -> [f64; LARGEST] { std::array::from_fn(|i| values.get(i).copied().unwrap_or(0.0)) };
    let square: [[f64; LARGEST]; LARGEST] = std::array::from_fn(|i| if i < n { wide(&h[i * n..(i + 1) * n]) } else { [0.0; LARGEST] });
    let rows: Vec<Row<LARGEST>> =
        (0..m).map(|k| Row { a: wide(&a[k * n..(k + 1) * n]), lower: row_lower[k], upper: row_upper[k] }).collect();
    let problem = Problem { n, h: &square, g: &wide(&g), lower: &wide(&lower), upper: &wide(&upper), rows: &rows };
    let found = qp::solve(&problem, &ActiveSet::default());
    let status = match found.status {
        Status::Solved => "solved",
        Status::Infeasible => "infeasible",
        Status::NotConvex => "not convex",
        Status::Iterations => "iterations",
        Status::Undefined => "undefined",
    };
    let last = |place: Place| found.violated.filter(|(constraint, _)| constraint.place == place).map_or(0.0, |(_, value)| value);
    let multipliers =
        |count: usize, place: fn(usize) -> Place| -> Vec<f64> { (0..count).map(|i| found.multiplier(place(i)) + last(place(i))).collect() };
    let (bounds, of_rows) = (multipliers(n, Place::Bound), multipliers(m, Place::Row));
    Ok((vector(py, &found.x[..n]), status, vector(py, &bounds), vector(py, &of_rows), found.changes))
}
