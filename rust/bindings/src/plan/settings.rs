//! `redundancy.planning.PlanSettings`.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use redundancy::error::Error;
use redundancy::plan::{Aim, Held, Pin, PlanSettings};

use crate::array::{read_list, vector};
use crate::errors::PyResult;

/// How a path is planned; as for `redundancy.plan`, which explains every setting. Angles in radians, joints counted from 0.
///
/// Raises
/// ------
/// InvalidValueError
///     If a setting is out of its domain.
#[pyclass(name = "PlanSettings", frozen, eq, module = "redundancy._core")]
#[derive(PartialEq)]
pub struct PyPlanSettings {
    pub settings: PlanSettings,
}

/// A count, or its default.
fn count(name: &str, given: Option<i64>, default: usize) -> PyResult<usize> {
    match given {
        None => Ok(default),
        Some(x) => usize::try_from(x).map_err(|_| Error::value(name, x, "at least 1").into()),
    }
}

/// Joints or branches, counted from 0.
fn numbers(name: &str, given: Option<Vec<i64>>) -> PyResult<Option<Vec<usize>>> {
    let Some(given) = given else { return Ok(None) };
    let read = given.iter().map(|x| usize::try_from(*x)).collect::<Result<_, _>>();
    read.map(Some).map_err(|_| Error::value(name, format!("{given:?}"), "numbers counted from 0").into())
}

/// Spins or postures by their points.
fn read_pins(given: &Bound<'_, PyAny>) -> PyResult<Vec<Pin>> {
    let wrong = |given: &Bound<'_, PyAny>| Error::value("pins", given, "points, counted from 0, with a spin [rad] or a posture each");
    let mut pins = Vec::new();
    for entry in given.call_method0("items").map_err(|_| wrong(given))?.try_iter()? {
        let (point, held): (Bound<'_, PyAny>, Bound<'_, PyAny>) = entry?.extract()?;
        let point = point.extract::<usize>().map_err(|_| wrong(given))?;
        let held = match held.extract::<f64>() {
            Ok(spin) => Held::Spin(spin),
            Err(_) => Held::Posture(read_list(&format!("pins[{point}]"), &held)?),
        };
        pins.push(Pin { point, held });
    }
    Ok(pins)
}

#[pymethods]
impl PyPlanSettings {
    #[new]
    #[pyo3(signature = (criterion=None, limits=None, *, smoothness=None, joint_weights=None, n_angles=None, layers=None, spin_range=None, max_spin_step=None,
        max_step=None, spare=None, n_spare=None, branches=None, branch_changes=None, closed=None, bound=None, effort=None,
        max_iterations=None, start=None, end=None, pins=None, reconfigurations=None, lift_off=None))]
    fn new(
        criterion: Option<&str>,
        limits: Option<bool>,
        smoothness: Option<f64>,
        joint_weights: Option<&Bound<'_, PyAny>>,
        n_angles: Option<i64>,
        layers: Option<i64>,
        spin_range: Option<(f64, f64)>,
        max_spin_step: Option<f64>,
        max_step: Option<f64>,
        spare: Option<Vec<i64>>,
        n_spare: Option<i64>,
        branches: Option<Vec<i64>>,
        branch_changes: Option<bool>,
        closed: Option<bool>,
        bound: Option<bool>,
        effort: Option<i64>,
        max_iterations: Option<i64>,
        start: Option<&Bound<'_, PyAny>>,
        end: Option<&Bound<'_, PyAny>>,
        pins: Option<&Bound<'_, PyAny>>,
        reconfigurations: Option<bool>,
        lift_off: Option<f64>,
    ) -> PyResult<Self> {
        let default = PlanSettings::default();
        let settings = PlanSettings {
            criterion: criterion.map_or(Ok(default.criterion), Aim::named)?,
            limits: limits.unwrap_or(default.limits),
            smoothness,
            joint_weights: joint_weights.map(|given| read_list("joint_weights", given)).transpose()?,
            n_angles: count("n_angles", n_angles, default.n_angles)?,
            layers: count("layers", layers, default.layers)?,
            spin_range,
            max_spin_step: max_spin_step.unwrap_or(default.max_spin_step),
            max_step,
            spare: numbers("spare", spare)?,
            n_spare: n_spare.map(|values| count("n_spare", Some(values), 1)).transpose()?,
            branches: numbers("branches", branches)?,
            branch_changes: branch_changes.unwrap_or(default.branch_changes),
            closed: closed.unwrap_or(default.closed),
            bound,
            effort: effort.map(|effort| count("effort", Some(effort), 1)).transpose()?,
            max_iterations: count("max_iterations", max_iterations, default.max_iterations)?,
            start: start.map(|q| read_list("start", q)).transpose()?,
            end: end.map(|q| read_list("end", q)).transpose()?,
            pins: pins.map_or(Ok(Vec::new()), read_pins)?,
            reconfigurations: reconfigurations.unwrap_or(default.reconfigurations),
            lift_off: lift_off.unwrap_or(default.lift_off),
        };
        settings.check()?;
        Ok(Self { settings })
    }

    /// The same settings with another criterion.
    fn with_criterion(&self, criterion: &str) -> PyResult<Self> {
        Ok(Self { settings: PlanSettings { criterion: Aim::named(criterion)?, ..self.settings.clone() } })
    }

    /// "minimax", "integral", "motion" or "speed".
    #[getter]
    fn criterion(&self) -> &'static str {
        self.settings.criterion.name()
    }

    /// Whether position and speed limits hold.
    #[getter]
    fn limits(&self) -> bool {
        self.settings.limits
    }

    /// Weight of the integral of the squared joint speed.
    #[getter]
    fn smoothness(&self) -> Option<f64> {
        self.settings.smoothness
    }

    /// Weights of the joints in the motion.
    #[getter]
    fn joint_weights(&self) -> Option<Vec<f64>> {
        self.settings.joint_weights.clone()
    }

    /// Spins of the search's grid.
    #[getter]
    fn n_angles(&self) -> usize {
        self.settings.n_angles
    }

    /// Points of the path at which the first search begins.
    #[getter]
    fn layers(&self) -> usize {
        self.settings.layers
    }

    /// Least and largest spin [rad].
    #[getter]
    fn spin_range(&self) -> Option<(f64, f64)> {
        self.settings.spin_range
    }

    /// Largest change of the spin from one point of the search to the next [rad].
    #[getter]
    fn max_spin_step(&self) -> f64 {
        self.settings.max_spin_step
    }

    /// Largest motion of any joint from point to point [rad or m].
    #[getter]
    fn max_step(&self) -> Option<f64> {
        self.settings.max_step
    }

    /// Joints on the grid, counted from 0.
    #[getter]
    fn spare<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, pyo3::types::PyTuple>>> {
        tuple(py, self.settings.spare.as_deref())
    }

    /// Values of each of them.
    #[getter]
    fn n_spare(&self) -> Option<usize> {
        self.settings.n_spare
    }

    /// Branches that may be used.
    #[getter]
    fn branches<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, pyo3::types::PyTuple>>> {
        tuple(py, self.settings.branches.as_deref())
    }

    /// Whether the branch may change through a singularity.
    #[getter]
    fn branch_changes(&self) -> bool {
        self.settings.branch_changes
    }

    /// Whether the last point is reached in the posture of the first.
    #[getter]
    fn closed(&self) -> bool {
        self.settings.closed
    }

    /// Whether to prove how good the plan is.
    #[getter]
    fn bound(&self) -> Option<bool> {
        self.settings.bound
    }

    /// Searches at most.
    #[getter]
    fn effort(&self) -> Option<usize> {
        self.settings.effort
    }

    /// Newton steps of the refinement at most.
    #[getter]
    fn max_iterations(&self) -> usize {
        self.settings.max_iterations
    }

    /// The posture in which the path begins [rad or m], shape (n,).
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.settings.start.as_ref().map(|q| vector(py, q))
    }

    /// The posture in which it ends [rad or m], shape (n,).
    #[getter]
    fn end<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.settings.end.as_ref().map(|q| vector(py, q))
    }

    /// Spins [rad] or postures [rad or m] that are held, by their points; None where none are.
    #[getter]
    fn pins<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        if self.settings.pins.is_empty() {
            return Ok(None);
        }
        let pins = PyDict::new(py);
        for pin in &self.settings.pins {
            match &pin.held {
                Held::Posture(q) => pins.set_item(pin.point, vector(py, q))?,
                Held::Spin(spin) => pins.set_item(pin.point, spin)?,
            }
        }
        Ok(Some(pins))
    }

    /// Whether the path may be left and entered again where no single way exists.
    #[getter]
    fn reconfigurations(&self) -> bool {
        self.settings.reconfigurations
    }

    /// How far the tool is lifted off for that [m].
    #[getter]
    fn lift_off(&self) -> f64 {
        self.settings.lift_off
    }

    fn __repr__(&self) -> String {
        format!("{:?}", self.settings)
    }
}

fn tuple<'py>(py: Python<'py>, numbers: Option<&[usize]>) -> PyResult<Option<Bound<'py, pyo3::types::PyTuple>>> {
    Ok(numbers.map(|numbers| pyo3::types::PyTuple::new(py, numbers)).transpose()?)
}
