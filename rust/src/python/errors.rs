//! From the core's errors to the exception classes of `redundancy.errors`.

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;

use crate::error::Error;

fn class<'py>(py: Python<'py>, cell: &'static PyOnceLock<Py<PyType>>, name: &str) -> PyResult<&'py Bound<'py, PyType>> {
    cell.import(py, "redundancy.errors", name)
}

impl From<Error> for PyErr {
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
                Error::Model(_) => class(py, &MODEL, "ModelError"),
            };
            match found {
                Ok(class) => PyErr::from_type(class.clone(), error.to_string()),
                Err(import) => import,
            }
        })
    }
}
