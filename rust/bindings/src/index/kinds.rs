//! The indices as Python classes: each is an objective of one term.

use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{ok, read_list};
use crate::index::objective::PyObjective;
use redundancy::error::Error;
use redundancy::index as core;
use redundancy::index::{Index, Rows, Spectral, SpectralKind};

fn rows(rows: Option<Vec<usize>>, length: f64) -> PyResult<Rows> {
    ok(match rows {
        Some(rows) => Rows::new(&rows, length),
        None => Rows::all(length),
    })
}

/// Condition number of the homogeneous Jacobian: 1 at an isotropic posture, inf at a singular one.
///
/// Parameters
/// ----------
/// length : float
///     Characteristic length that multiplies the angular rows [m].
/// norm : {"frobenius", "spectral"}
///     kappa_F = (1/m) sqrt(tr(G) tr(G^-1)), G = J_n J_n^T (Leger 2014, eq. 2.14), or kappa_2 = sigma_1/sigma_m.
/// rows : sequence of int, optional
///     Rows in use, 0 to 2 angular, 3 to 5 linear; all six if not given (planar robots: [2, 3, 4]).
/// squared : bool
///     Whether the value is the square.
///
/// Raises
/// ------
/// InvalidValueError
///     If the length is not positive, the norm unknown or the rows are not increasing.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct ConditionNumber;

#[pymethods]
impl ConditionNumber {
    #[new]
    #[pyo3(signature = (length=1.0, norm="frobenius", rows=None, squared=false))]
    fn new(length: f64, norm: &str, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyClassInitializer<Self>> {
        let rows = self::rows(rows, length)?;
        let index = match norm {
            "frobenius" => Index::Condition(core::ConditionNumber { rows, squared }),
            "spectral" => Index::Spectral(Spectral { kind: SpectralKind::ConditionNumber, rows, squared }),
            _ => return Err(Error::value("norm", format!("{norm:?}"), "\"frobenius\" or \"spectral\"").into()),
        };
        Ok(PyClassInitializer::from(PyObjective::single(index)?).add_subclass(Self))
    }
}

/// Manipulability sqrt(det(J_n J_n^T)), the volume of the ellipsoid (Leger 2014, eq. 1.8): 0 at a singular posture.
///
/// Parameters
/// ----------
/// length, rows, squared
///     As for `ConditionNumber`; length 1 gives the usual index in SI units.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct Manipulability;

#[pymethods]
impl Manipulability {
    #[new]
    #[pyo3(signature = (length=1.0, rows=None, squared=false))]
    fn new(length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyClassInitializer<Self>> {
        let index = Index::Manipulability(core::Manipulability { rows: self::rows(rows, length)?, squared });
        Ok(PyClassInitializer::from(PyObjective::single(index)?).add_subclass(Self))
    }
}

fn spectral(kind: SpectralKind, length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyObjective> {
    PyObjective::single(Index::Spectral(Spectral { kind, rows: self::rows(rows, length)?, squared }))
}

/// Smallest singular value of the homogeneous Jacobian: 0 at a singular posture.
///
/// Parameters
/// ----------
/// length, rows, squared
///     As for `ConditionNumber`.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct SmallestSingularValue;

#[pymethods]
impl SmallestSingularValue {
    #[new]
    #[pyo3(signature = (length=1.0, rows=None, squared=false))]
    fn new(length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyClassInitializer<Self>> {
        Ok(PyClassInitializer::from(spectral(SpectralKind::SmallestSingularValue, length, rows, squared)?).add_subclass(Self))
    }
}

/// Huo's parameter of singularity sqrt(kappa_2 / manipulability) (Huo 2009, eq. 4.6): inf at a singular posture.
///
/// Parameters
/// ----------
/// length, rows, squared
///     As for `ConditionNumber`; the source uses length 1.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct SingularityParameter;

#[pymethods]
impl SingularityParameter {
    #[new]
    #[pyo3(signature = (length=1.0, rows=None, squared=false))]
    fn new(length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyClassInitializer<Self>> {
        Ok(PyClassInitializer::from(spectral(SpectralKind::SingularityParameter, length, rows, squared)?).add_subclass(Self))
    }
}

fn weights(weights: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
    weights.map_or_else(|| Ok(Vec::new()), |weights| read_list("weights", weights))
}

/// Distance to the middle of the joint ranges, 1/2 sum w_i ((q_i - middle_i) / half range_i)^2 (Huo 2009, eq. 4.1, made dimensionless).
///
/// Parameters
/// ----------
/// weights : array_like, shape (n,), optional
///     One for each joint; ones if not given. Joints without both limits do not count.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct JointLimits;

#[pymethods]
impl JointLimits {
    #[new]
    #[pyo3(signature = (weights=None))]
    fn new(weights: Option<&Bound<'_, PyAny>>) -> PyResult<PyClassInitializer<Self>> {
        let index = Index::JointLimits(ok(core::JointLimits::new(&self::weights(weights)?))?);
        Ok(PyClassInitializer::from(PyObjective::single(index)?).add_subclass(Self))
    }
}

/// Logarithmic barrier at the joint limits, -sum w_i ln((q_max - q)(q - q_min) / half range^2): 0 in the middle, inf at a limit.
///
/// Parameters
/// ----------
/// weights : array_like, shape (n,), optional
///     One for each joint; ones if not given. Joints without both limits do not count.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct LimitBarrier;

#[pymethods]
impl LimitBarrier {
    #[new]
    #[pyo3(signature = (weights=None))]
    fn new(weights: Option<&Bound<'_, PyAny>>) -> PyResult<PyClassInitializer<Self>> {
        let index = Index::LimitBarrier(ok(core::LimitBarrier::new(&self::weights(weights)?))?);
        Ok(PyClassInitializer::from(PyObjective::single(index)?).add_subclass(Self))
    }
}

/// A Python callable as an index.
///
/// Parameters
/// ----------
/// function : callable
///     Takes ``q`` of shape (n,); returns a number, or (number, gradient), or (number, gradient, Hessian). Missing derivatives are taken by
///     central differences. It holds the GIL while it runs; its exceptions reach the caller.
#[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
pub struct CustomIndex;

#[pymethods]
impl CustomIndex {
    #[new]
    fn new(function: &Bound<'_, PyAny>) -> PyResult<PyClassInitializer<Self>> {
        Ok(PyClassInitializer::from(PyObjective::from_callable(function)?).add_subclass(Self))
    }
}
