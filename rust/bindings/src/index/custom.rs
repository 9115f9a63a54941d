//! A Python callable as an index.

use std::sync::Mutex;

use pyo3::prelude::*;

use crate::errors::PyResult;
use pyo3::types::PyTuple;

use crate::array::{read_any, vector};
use redundancy::index::{CustomIndex, Evaluation, Order, Status};
use redundancy::linalg::MAX_JOINTS;

/// Step of the central differences that stand in for a gradient the callable does not give: the cube root of the rounding.
const GRADIENT_STEP: f64 = 6e-6;
/// Step of the second differences of values: the fourth root.
const HESSIAN_STEP: f64 = 1.2e-4;

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

    /// Value, and gradient and Hessian as far as the callable gives them.
    fn call(&self, py: Python<'_>, q: &[f64]) -> PyResult<(f64, Option<Vec<f64>>, Option<Vec<f64>>)> {
        let answer = self.function.bind(py).call1((vector(py, q),))?;
        let Ok(parts) = answer.cast::<PyTuple>() else { return Ok((answer.extract()?, None, None)) };
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
        Ok((parts.get_item(0)?.extract()?, part(1, "gradient", q.len())?, part(2, "hessian", q.len() * q.len())?))
    }

    fn value(&self, py: Python<'_>, q: &[f64], moves: &[(usize, f64)]) -> PyResult<f64> {
        let mut moved = q.to_vec();
        for (i, by) in moves {
            moved[*i] += by;
        }
        Ok(self.call(py, &moved)?.0)
    }

    fn gradient(&self, py: Python<'_>, q: &[f64], moves: &[(usize, f64)]) -> PyResult<Vec<f64>> {
        let mut moved = q.to_vec();
        for (i, by) in moves {
            moved[*i] += by;
        }
        if let Some(gradient) = self.call(py, &moved)?.1 {
            return Ok(gradient);
        }
        let h = GRADIENT_STEP;
        (0..q.len()).map(|k| Ok((self.value(py, &moved, &[(k, h)])? - self.value(py, &moved, &[(k, -h)])?) / (2.0 * h))).collect()
    }

    fn hessian(&self, py: Python<'_>, q: &[f64], analytic_gradient: bool, out: &mut Evaluation<MAX_JOINTS>) -> PyResult<()> {
        let n = q.len();
        for k in 0..n {
            if analytic_gradient {
                let h = GRADIENT_STEP;
                let (above, below) = (self.gradient(py, q, &[(k, h)])?, self.gradient(py, q, &[(k, -h)])?);
                for l in 0..n {
                    let half = 0.5 * (above[l] - below[l]) / (2.0 * h);
                    out.hessian[k][l] += half;
                    out.hessian[l][k] += half;
                }
                continue;
            }
            let h = HESSIAN_STEP;
            for l in k..n {
                let at = |a: f64, b: f64| self.value(py, q, &[(k, a * h), (l, b * h)]);
                let entry = (at(1.0, 1.0)? - at(1.0, -1.0)? - at(-1.0, 1.0)? + at(-1.0, -1.0)?) / (4.0 * h * h);
                out.hessian[k][l] = entry;
                out.hessian[l][k] = entry;
            }
        }
        Ok(())
    }

    fn try_evaluate(&self, py: Python<'_>, q: &[f64], order: Order) -> PyResult<Evaluation<MAX_JOINTS>> {
        let n = q.len();
        let (value, gradient, hessian) = self.call(py, q)?;
        let mut out = Evaluation::zero();
        out.value = value;
        let analytic = gradient.is_some();
        if order >= Order::Gradient {
            let gradient = gradient.map_or_else(|| self.gradient(py, q, &[]), Ok)?;
            out.gradient[..n].copy_from_slice(&gradient);
        }
        if order == Order::Hessian {
            match hessian {
                Some(hessian) => (0..n).for_each(|k| out.hessian[k][..n].copy_from_slice(&hessian[k * n..(k + 1) * n])),
                None => self.hessian(py, q, analytic, &mut out)?,
            }
        }
        Ok(out)
    }
}

impl CustomIndex for PyIndex {
    fn evaluate(&self, q: &[f64], order: Order) -> Evaluation<MAX_JOINTS> {
        Python::attach(|py| {
            self.try_evaluate(py, q, order).unwrap_or_else(|error| {
                if let Ok(mut slot) = self.raised.lock() {
                    slot.get_or_insert(error.into());
                }
                Evaluation::without_derivatives(f64::NAN, Status::Singular)
            })
        })
    }
}
