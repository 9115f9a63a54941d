//! A user's predicate, and a user's cost of a step, as the core asks them.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use redundancy::error::Error;
use redundancy::plan::{PlanError, PredicateError};

use super::path::rows_array;
use crate::array::{read_any, shape_of};
use crate::errors::{Failure, PyResult};

/// Which postures, n joints a row, a callable of postures (M, n) allows.
pub fn asked(feasible: &Py<PyAny>, q: &[f64], n: usize) -> Result<Vec<bool>, PredicateError> {
    Python::attach(|py| answer(feasible.bind(py), q, n)).map_err(|failure| PyErr::from(failure).into())
}

fn answer(feasible: &Bound<'_, PyAny>, q: &[f64], n: usize) -> PyResult<Vec<bool>> {
    static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let py = feasible.py();
    let count = q.len() / n;
    let given = ASARRAY.import(py, "numpy", "asarray")?.call1((feasible.call1((rows_array(py, q, n)?,))?,))?;
    if let Ok(array) = given.cast::<PyArray1<bool>>()
        && let Ok(allowed) = array.try_readonly()
        && allowed.as_array().len() == count
    {
        return Ok(allowed.as_array().iter().copied().collect());
    }
    let got = format!("{} of shape {}", given.getattr("dtype")?, given.getattr("shape")?);
    Err(Error::value("what feasible returned", got, &format!("bool of shape ({count},)")).into())
}

/// What a callable of the postures before and after a step, (M, n) each, says that steps cost.
pub fn priced(edge_cost: &Py<PyAny>, before: &[f64], after: &[f64], n: usize) -> Result<Vec<f64>, PredicateError> {
    Python::attach(|py| costs(edge_cost.bind(py), before, after, n)).map_err(|failure| PyErr::from(failure).into())
}

fn costs(edge_cost: &Bound<'_, PyAny>, before: &[f64], after: &[f64], n: usize) -> PyResult<Vec<f64>> {
    let py = edge_cost.py();
    let count = before.len() / n;
    let (numbers, shape) = read_any("what edge_cost returned", &edge_cost.call1((rows_array(py, before, n)?, rows_array(py, after, n)?))?)?;
    if shape == [count] {
        return Ok(numbers);
    }
    let got = format!("of shape {}", shape_of(&shape));
    Err(Error::value("what edge_cost returned", got, &format!("floats of shape ({count},)")).into())
}

/// What a plan that was not made raises: the error of the caller's own code, as it is.
pub fn raised(error: PlanError) -> Failure {
    match error {
        PlanError::Input(error) => error.into(),
        PlanError::Predicate(error) => match error.downcast::<PyErr>() {
            Ok(own) => (*own).into(),
            Err(other) => pyo3::exceptions::PyRuntimeError::new_err(other.to_string()).into(),
        },
        _ => pyo3::exceptions::PyKeyboardInterrupt::new_err(()).into(),
    }
}
