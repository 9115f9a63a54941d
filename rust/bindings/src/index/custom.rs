//! A Python callable as an index.

use std::sync::Mutex;

use pyo3::prelude::*;

use crate::errors::PyResult;
use pyo3::types::PyTuple;

use crate::array::{read_any, vector};
use redundancy::index::{CustomIndex, Evaluation, Given, Order, Status, completed};

/// The callable, and the first exception it raised.
#[derive(Debug)]
pub struct PyIndex {
    function: Py<PyAny>,
    raised: Mutex<Option<PyErr>>,
}

impl PyIndex {
    pub fn new(function: Py<PyAny>) -> Self {
        Self { function, raised: Mutex::new(None) }
    }

    /// The first exception since the last call, if any.
    pub fn take_error(&self) -> Option<PyErr> {
        self.raised.lock().ok().and_then(|mut slot| slot.take())
    }

    /// What the callable gives.
    fn call(&self, py: Python<'_>, q: &[f64]) -> PyResult<Given> {
        let answer = self.function.bind(py).call1((vector(py, q),))?;
        let Ok(parts) = answer.cast::<PyTuple>() else { return Ok(Given { value: answer.extract()?, ..Given::default() }) };
        let part = |i: usize, name: &str, length: usize| -> PyResult<Option<Vec<f64>>> {
            if parts.len() <= i {
                return Ok(None);
            }
            let (numbers, shape) = read_any(name, &parts.get_item(i)?)?;
            if numbers.len() != length {
                let expected = format!("{length} numbers, for {} joints", q.len());
                return Err(redundancy::error::Error::Shape { name: name.into(), got: format!("{shape:?}"), expected }.into());
            }
            Ok(Some(numbers))
        };
        let n = q.len();
        Ok(Given { value: parts.get_item(0)?.extract()?, gradient: part(1, "gradient", n)?, hessian: part(2, "hessian", n * n)? })
    }
}

impl CustomIndex for PyIndex {
    fn evaluate(&self, q: &[f64], order: Order) -> Evaluation {
        Python::attach(|py| {
            completed(q, order, |q| self.call(py, q)).unwrap_or_else(|error| {
                if let Ok(mut slot) = self.raised.lock() {
                    slot.get_or_insert(error.into());
                }
                Evaluation::without_derivatives(f64::NAN, Status::Singular)
            })
        })
    }
}
