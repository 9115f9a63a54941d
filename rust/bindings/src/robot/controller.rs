//! `redundancy.Controller`.

use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};

use crate::array::{map_rows, ok, read_list, read_square, vector};
use crate::errors::{Failure, PyResult};
use crate::robot::frames::Maybe;
use redundancy::error::Error;
use redundancy::robot::{Controller, Robot};

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Joints as a robot's controller shows and takes them: ``p = matrix q + offset``, q being the robot's own; see `Robot.with_controller`.
///
/// Methods take one posture of shape (n,) or a batch of shape (N, n), rad where revolute and m where prismatic.
///
/// Raises
/// ------
/// ShapeError, NonFiniteError
///     If an array has the wrong shape or holds NaN or infinities.
#[pyclass(name = "Controller", frozen, eq, module = "redundancy._core")]
#[derive(PartialEq)]
pub struct PyController(pub Controller);

#[pymethods]
impl PyController {
    /// What a robot's joints add to each of the controller's, shape (n, n).
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let n = self.0.n();
        Ok(PyArray1::from_slice(py, self.0.matrix()).reshape([n, n])?)
    }

    /// Where the controller's joints stand when the robot's are zero, shape (n,) [rad or m].
    #[getter]
    fn offset<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, self.0.offset())
    }

    /// Names of the controller's joints: J1, J2, ... if none are given.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.names().to_vec()
    }

    /// The controller's joints from the robot's.
    #[pyo3(name = "from_robot")]
    fn of_robot<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
        self.mapped(py, q, Controller::from_robot)
    }

    /// The robot's joints from the controller's.
    fn to_robot<'py>(&self, py: Python<'py>, p: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
        self.mapped(py, p, Controller::to_robot)
    }

    /// The controller's joint rates from the robot's [rad/s or m/s]: without the offset.
    fn rates_from_robot<'py>(&self, py: Python<'py>, qd: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
        self.mapped(py, qd, Controller::rates_from_robot)
    }

    /// The robot's joint rates from the controller's [rad/s or m/s]: without the offset.
    fn rates_to_robot<'py>(&self, py: Python<'py>, pd: &Bound<'py, PyAny>) -> PyResult<Array<'py>> {
        self.mapped(py, pd, Controller::rates_to_robot)
    }

    fn __repr__(&self) -> String {
        format!("Controller({:?}, matrix={:?}, offset={:?})", self.0.names(), self.0.matrix(), self.0.offset())
    }
}

impl PyController {
    fn mapped<'py>(&self, py: Python<'py>, x: &Bound<'py, PyAny>, map: fn(&Controller, &[f64], &mut [f64])) -> PyResult<Array<'py>> {
        map_rows::<1, 2>(py, self.0.n(), x, None, [self.0.n()], |x, out| {
            map(&self.0, x, out);
            Ok(())
        })
    }
}

/// The map that is given in parts, or as a matrix; `None` where nothing is given.
pub fn read(
    n: usize,
    matrix: Maybe<'_, '_>,
    offset: Maybe<'_, '_>,
    signs: Maybe<'_, '_>,
    coupling: Option<&Bound<'_, PyDict>>,
    names: Option<Vec<String>>,
) -> PyResult<Option<Controller>> {
    if matrix.is_none() && offset.is_none() && signs.is_none() && coupling.is_none() && names.is_none() {
        return Ok(None);
    }
    let mut entries = Controller::identity(n).matrix().to_vec();
    if let Some(matrix) = matrix {
        if signs.is_some() || coupling.is_some() {
            return Err(Error::value("matrix", "given beside signs or coupling", "the matrix or its parts").into());
        }
        entries = read_square("matrix", matrix, n)?;
    }
    if let Some(signs) = signs {
        let signs = read_list("signs", signs)?;
        if signs.len() != n {
            return Err(Error::length("signs", signs.len(), n).into());
        }
        if let Some(sign) = signs.iter().find(|sign| sign.abs() != 1.0) {
            return Err(Error::value("signs", sign, "1 or -1").into());
        }
        signs.iter().enumerate().for_each(|(i, sign)| entries[i * (n + 1)] = *sign);
    }
    for (joints, factor) in coupling.into_iter().flatten() {
        let wrong = || {
            let expected = format!("pairs of two different joints from 0 to {}, each with a factor", n - 1);
            Failure::from(Error::value("coupling", format!("{{{joints}: {factor}}}"), &expected))
        };
        let (i, k) = joints.extract::<(usize, usize)>().map_err(|_| wrong())?;
        if i >= n || k >= n || i == k {
            return Err(wrong());
        }
        entries[i * n + k] = factor.extract::<f64>().map_err(|_| wrong())?;
    }
    let offset = offset.map_or_else(|| Ok(vec![0.0; n]), |offset| read_list("offset", offset))?;
    if offset.len() != n {
        return Err(Error::length("offset", offset.len(), n).into());
    }
    ok(Controller::new(entries, offset, names)).map(Some)
}

/// What makes a robot with a controller again: that without one, and the call that adds it.
pub fn rebuilt<'py>(
    class: &Bound<'py, PyType>,
    plain: Bound<'py, PyAny>,
    controller: &Controller,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let (py, n) = (class.py(), controller.n());
    let matrix = PyArray1::from_slice(py, controller.matrix()).reshape([n, n])?;
    let arguments = (plain, matrix, vector(py, controller.offset()), py.None(), py.None(), controller.names().to_vec());
    Ok((class.getattr("with_controller")?, arguments.into_pyobject(py)?.into_any()))
}

/// The map of a robot.
pub fn of(robot: &Robot) -> PyController {
    PyController(robot.controller().cloned().unwrap_or_else(|| Controller::identity(robot.n())))
}
