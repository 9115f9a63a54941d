//! `redundancy.PlanFailure`.

use pyo3::prelude::*;
use pyo3::types::PyTuple;
use redundancy::error::Error;
use redundancy::plan::{FailedJoint, FailureCause, PlanFailure};

use crate::errors::PyResult;
use crate::robot::PyRobot;

/// Why a plan is not whole.
///
/// Attributes
/// ----------
/// point : int
///     First point that is not reached as it should be, counted from 0.
/// cause : str
///     "unreachable", "joint limit", "singular", "predicate", "speed limit", "step limit", "edge cost", "spin range", "no way" (the point has postures, but
///     no branch leads there from the points before) or "not closed".
/// joint : int or None
///     The joint in the way, counted from 0, for the limits of joints.
/// combination : str or None
///     The combination of joints in the way, "joint 2 + joint 3".
/// excess : float
///     How far beyond its limit that joint, or combination, would have to go [rad or m], or how many times its speed or step limit it would need; NaN where
///     neither is meant.
/// hint : str or None
///     What is known beside, and what would help, in words.
/// pins : tuple of int
///     The point itself if something is held there (``start``, ``end``, ``pins``), else the next points on either side at which something is.
#[pyclass(name = "PlanFailure", frozen, eq, module = "redundancy._core")]
#[derive(PartialEq)]
pub struct PyPlanFailure {
    failure: PlanFailure,
}

impl From<PlanFailure> for PyPlanFailure {
    fn from(failure: PlanFailure) -> Self {
        Self { failure }
    }
}

#[pymethods]
impl PyPlanFailure {
    #[new]
    #[pyo3(signature = (point, cause, joint=None, excess=f64::NAN, slides=false, combination=None, hint=None, pins=None))]
    fn new(
        point: usize,
        cause: &str,
        joint: Option<usize>,
        excess: f64,
        slides: bool,
        combination: Option<String>,
        hint: Option<String>,
        pins: Option<Vec<usize>>,
    ) -> PyResult<Self> {
        let known = FailureCause::ALL.into_iter().find(|known| known.name() == cause);
        let names = || FailureCause::ALL.map(|cause| format!("'{}'", cause.name())).join(", ");
        let cause = known.ok_or_else(|| Error::value("cause", format!("'{cause}'"), &format!("one of {}", names())))?;
        let number = if combination.is_some() { joint.or(Some(0)) } else { joint };
        let joint = number.map(|number| FailedJoint { number, slides, excess, combination });
        Ok(PlanFailure { point, cause, joint, hint, pins: pins.unwrap_or_default() }.into())
    }

    /// First point that is not reached as it should be, counted from 0.
    #[getter]
    fn point(&self) -> usize {
        self.failure.point
    }

    /// What is in the way.
    #[getter]
    fn cause(&self) -> &'static str {
        self.failure.cause.name()
    }

    /// The joint in the way, counted from 0; None where none is.
    #[getter]
    fn joint(&self) -> Option<usize> {
        self.failure.joint.as_ref().filter(|joint| joint.combination.is_none()).map(|joint| joint.number)
    }

    /// The combination of joints in the way, "joint 2 + joint 3"; None where none is.
    #[getter]
    fn combination(&self) -> Option<&str> {
        self.failure.joint.as_ref().and_then(|joint| joint.combination.as_deref())
    }

    /// How far beyond its limit that joint would have to go [rad or m], or how many times its speed or step limit it would need.
    #[getter]
    fn excess(&self) -> f64 {
        self.failure.joint.as_ref().map_or(f64::NAN, |joint| joint.excess)
    }

    /// What is known beside, and what would help, in words; None where nothing is.
    #[getter]
    fn hint(&self) -> Option<&str> {
        self.failure.hint.as_deref()
    }

    /// The points at which something is held that it hangs on.
    #[getter]
    fn pins<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        Ok(PyTuple::new(py, &self.failure.pins)?)
    }

    /// The failure in words, with the joint as ``robot.joint_label`` has it.
    fn told(&self, robot: &PyRobot) -> String {
        self.failure.told(&robot.robot)
    }

    fn __str__(&self) -> String {
        self.failure.to_string()
    }

    fn __repr__(&self) -> String {
        format!("PlanFailure({})", self.failure)
    }

    fn __getnewargs__(&self) -> (usize, &'static str, Option<usize>, f64, bool, Option<&str>, Option<&str>, Vec<usize>) {
        let joint = self.failure.joint.as_ref();
        let slides = joint.is_some_and(|joint| joint.slides);
        let (number, pins) = (joint.map(|joint| joint.number), self.failure.pins.clone());
        (self.point(), self.cause(), number, self.excess(), slides, self.combination(), self.hint(), pins)
    }
}
