//! `redundancy.PosturePull`, and any secondary task from Python.

use numpy::PyArray1;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{ok, read_list, vector};
use crate::index::objective::PyObjective;
use redundancy::error::Error;
use redundancy::resolve::{PosturePull, Scaling, Secondary};
use redundancy::robot::Robot;

/// Huo's secondary task (Huo 2009, eq. 3.17, 3.31, 4.9, 4.12): the pull of the middle posture, and of the posture where the parameter of
/// singularity w_ps was last acceptable: ``h = w * (middle - q) + k * w_ps * (q_s - q)``, the second part while ``w_ps >= threshold``.
///
/// Parameters
/// ----------
/// w : array_like, shape (n,)
///     Weights of the pull to the middle.
/// k : array_like, shape (n,), optional
///     Weights of the pull away from singularity; none if not given.
/// middle : array_like, shape (n,), optional
///     The middle posture [rad or m]; that of the joint ranges (0 for joints without) if not given.
/// threshold : float
///     Value of w_ps at which the second part sets in.
/// length : float
///     Length of the Jacobian for w_ps [m]; the source uses 1.
///
/// Raises
/// ------
/// NonFiniteError
///     If a weight is not finite.
/// InvalidValueError
///     If the threshold or the length is not positive.
///
/// Notes
/// -----
/// At a singularity w_ps counts as 1e6; the motion is cut at 0.3 rad or m a joint.
#[pyclass(name = "PosturePull", frozen, module = "redundancy._core")]
pub struct PyPosturePull {
    w: Vec<f64>,
    k: Option<Vec<f64>>,
    middle: Option<Vec<f64>>,
    #[pyo3(get)]
    threshold: f64,
    #[pyo3(get)]
    length: f64,
}

#[pymethods]
impl PyPosturePull {
    #[new]
    #[pyo3(signature = (w, k=None, middle=None, threshold=5.0, length=1.0))]
    fn new(
        w: &Bound<'_, PyAny>,
        k: Option<&Bound<'_, PyAny>>,
        middle: Option<&Bound<'_, PyAny>>,
        threshold: f64,
        length: f64,
    ) -> PyResult<Self> {
        let list = |name: &str, values: &Bound<'_, PyAny>| -> PyResult<Vec<f64>> {
            let values = read_list(name, values)?;
            ok(redundancy::error::check_finite(name, &values))?;
            Ok(values)
        };
        ok(redundancy::error::check_positive("threshold", threshold))?;
        ok(redundancy::error::check_positive("length", length))?;
        let k = k.map(|k| list("k", k)).transpose()?;
        let middle = middle.map(|middle| list("middle", middle)).transpose()?;
        Ok(Self { w: list("w", w)?, k, middle, threshold, length })
    }

    /// Weights of the pull to the middle, shape (n,).
    #[getter]
    fn w<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.w)
    }

    /// Weights of the pull away from singularity, shape (n,), or None.
    #[getter]
    fn k<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.k.as_ref().map(|k| vector(py, k))
    }
}

impl PyPosturePull {
    fn pull(&self, robot: &Robot) -> PyResult<PosturePull> {
        ok(PosturePull::new(robot, &self.w, self.k.as_deref(), self.middle.as_deref(), self.threshold, self.length))
    }
}

pub fn scaling(name: &str) -> PyResult<Scaling> {
    match name {
        "gradient" => Ok(Scaling::Gradient),
        "newton" => Ok(Scaling::Newton),
        _ => Err(Error::value("scaling", format!("{name:?}"), "\"gradient\" or \"newton\"").into()),
    }
}

pub fn secondary(objective: Option<&Bound<'_, PyAny>>, robot: &Robot, scaling: Scaling) -> PyResult<Secondary> {
    let Some(objective) = objective else { return Ok(Secondary::None) };
    if let Ok(objective) = objective.cast::<PyObjective>() {
        return Ok(Secondary::Objective(objective.get().objective.clone(), scaling));
    }
    match objective.cast::<PyPosturePull>() {
        Ok(pull) => Ok(Secondary::Pull(Box::new(pull.get().pull(robot)?))),
        Err(_) => {
            Err(PyTypeError::new_err(format!("objective: got {}, expected an Objective, a PosturePull or None", objective.get_type()))
                .into())
        }
    }
}
