//! Posture of minimum condition number, characteristic length, planar tetrahedron.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors::PyResult;
use pyo3::types::PyDict;

use crate::array::{ok, read_vector, vector};
use crate::index::kinds::rows_in;
use crate::robot::PyRobot;
use redundancy::design::{self, Length, Method, PlanarTetrahedron};
use redundancy::error::Error;
use redundancy::linalg::MAX_JOINTS;
use redundancy::optimize::{Outcome, Stop};

fn posture_of(robot: &PyRobot, name: &str, q: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
    let mut buffer = [0.0; MAX_JOINTS];
    let n = robot.robot.n();
    read_vector(name, q, n, &mut buffer)?;
    Ok(buffer[..n].to_vec())
}

/// One minimisation of kappa_F; the front end is `redundancy.minimum_condition_posture`.
///
/// Returns (q, length, condition number, iterations, evaluations, status, history). History is (k, 3): evaluations up to a point, kappa_F there,
/// norm of the gradient of kappa_F^2.
#[pyfunction]
pub fn minimum_condition_posture<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    q0: &Bound<'py, PyAny>,
    length: Option<f64>,
    length0: Option<f64>,
    method: &str,
    eliminate: bool,
    rows: Option<Vec<usize>>,
    tolerance: f64,
    max_iterations: usize,
) -> PyResult<(Bound<'py, PyArray1<f64>>, f64, f64, usize, usize, &'static str, Bound<'py, PyArray2<f64>>)> {
    let robot = robot.get();
    let q0 = posture_of(robot, "q0", q0)?;
    let method = match method {
        "newton" => Method::Newton,
        "bfgs" => Method::Bfgs,
        _ => return Err(Error::value("method", format!("{method:?}"), "\"newton\" or \"bfgs\"").into()),
    };
    ok(redundancy::error::check_positive("tolerance", tolerance))?;
    let rows = rows_in(rows, length.unwrap_or(1.0))?;
    let start =
        length0.map_or_else(|| design::rms_length(&robot.robot, &q0), |length| redundancy::error::check_positive("length0", length));
    let length = match (length, eliminate) {
        (Some(length), _) => Length::Fixed(length),
        (None, true) => Length::Eliminated,
        (None, false) => Length::Variable(ok(start)?),
    };
    let stop = Stop { step: tolerance, iterations: max_iterations };
    let found = ok(py.detach(|| design::minimum_condition(&robot.robot, &q0, rows, length, method, stop)))?;
    let status = match found.minimum.outcome {
        Outcome::Converged => "converged",
        Outcome::Stalled => "stalled",
        Outcome::Iterations => "out of iterations",
        Outcome::Undefined => "singular start",
    };
    let passed = &found.minimum.history;
    let rows: Vec<f64> = passed.iter().flat_map(|p| [p.evaluations as f64, p.value.sqrt(), p.gradient]).collect();
    let history = PyArray1::from_vec(py, rows).reshape([passed.len(), 3])?;
    let (iterations, evaluations) = (found.minimum.iterations, found.minimum.evaluations);
    Ok((vector(py, &found.q), found.length, found.condition_number, iterations, evaluations, status, history))
}

/// The length that minimises kappa_F at a posture, in closed form [m]; NaN at a singularity.
///
/// ``L^4 = B C / (A D)`` with A, B the squared norms of the angular and linear rows of J, and C, D those of the angular and linear columns of its
/// pseudo-inverse.
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot.
/// q : array_like, shape (n,)
///     Joint coordinates [rad or m].
/// rows : sequence of int, optional
///     Rows in use; all six if not given.
#[pyfunction]
#[pyo3(signature = (robot, q, rows=None))]
pub fn characteristic_length(robot: &Bound<'_, PyRobot>, q: &Bound<'_, PyAny>, rows: Option<Vec<usize>>) -> PyResult<f64> {
    let q = posture_of(robot.get(), "q", q)?;
    let found = design::characteristic_length(&robot.get().robot, &q, rows_in(rows, 1.0)?);
    Ok(ok(found)?.unwrap_or(f64::NAN))
}

/// Root mean square distance of the revolute axes to the operation point [m] (Leger 2014, 2.5 to 2.7).
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot.
/// q : array_like, shape (n,)
///     Joint coordinates [rad or m].
#[pyfunction]
pub fn rms_length(robot: &Bound<'_, PyRobot>, q: &Bound<'_, PyAny>) -> PyResult<f64> {
    let q = posture_of(robot.get(), "q", q)?;
    ok(design::rms_length(&robot.get().robot, &q))
}

/// The tetrahedron of a planar 3R robot (Leger 2014, eq. 2.15 to 2.21) as a dictionary; the front end is `redundancy.PlanarTetrahedron`.
///
/// Parameters
/// ----------
/// robot : Robot
///     Three revolute joints about the base z axis.
/// q : array_like, shape (3,)
///     Joint coordinates [rad].
/// length : float
///     Height of the tetrahedron [m].
#[pyfunction]
pub fn planar_tetrahedron<'py>(
    py: Python<'py>,
    robot: &Bound<'py, PyRobot>,
    q: &Bound<'py, PyAny>,
    length: f64,
) -> PyResult<Bound<'py, PyDict>> {
    let robot = robot.get();
    let q = posture_of(robot, "q", q)?;
    let found = ok(PlanarTetrahedron::of(&robot.robot, &q, length))?;
    let dict = PyDict::new(py);
    let edges: Bound<'py, PyArray2<f64>> = PyArray1::from_vec(py, found.edges.concat()).reshape([3, 3])?;
    dict.set_item("edges", edges)?;
    dict.set_item("volume", found.volume)?;
    dict.set_item("faces", vector(py, &found.faces))?;
    dict.set_item("distances", vector(py, &found.distances))?;
    dict.set_item("height", found.height)?;
    dict.set_item("condition_number", found.condition_number)?;
    Ok(dict)
}
