//! From the core's errors to the exception classes of `redundancy.errors`.

use std::convert::Infallible;

use numpy::FromVecError;
use pyo3::CastError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use redundancy::error::Error;

/// Why a call failed: an exception, made from one of the core's errors or of Python's own. (A conversion from the core's error straight to
/// [`PyErr`] is not this crate's to write.)
pub struct Failure(PyErr);

/// Result of a binding.
pub type PyResult<T> = Result<T, Failure>;

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

impl From<CastError<'_, '_>> for Failure {
    fn from(error: CastError<'_, '_>) -> Self {
        Self(error.into())
    }
}

impl From<FromVecError> for Failure {
    fn from(error: FromVecError) -> Self {
        Self(error.into())
    }
}

impl From<Infallible> for Failure {
    fn from(never: Infallible) -> Self {
        match never {}
    }
}

impl From<Failure> for PyErr {
    fn from(failure: Failure) -> Self {
        failure.0
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        static SHAPE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static NON_FINITE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static VALUE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        static MODEL: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        Python::attach(|py| {
            let found = match &error {
                Error::Shape { .. } => class(py, &SHAPE, "ShapeError"),
                Error::NonFinite { .. } => class(py, &NON_FINITE, "NonFiniteError"),
                Error::Value { .. } => class(py, &VALUE, "InvalidValueError"),
                _ => class(py, &MODEL, "ModelError"),
            };
            Self(match found {
                Ok(class) => PyErr::from_type(class.clone(), error.to_string()),
                Err(import) => import,
            })
        })
    }
}

fn class<'py>(py: Python<'py>, cell: &'static PyOnceLock<Py<PyType>>, name: &str) -> Result<&'py Bound<'py, PyType>, PyErr> {
    cell.import(py, "redundancy.errors", name)
}
