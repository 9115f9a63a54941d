//! The indices as Python classes: each is an objective of one term.

use pyo3::prelude::*;

use crate::array::{ok, read_list};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use redundancy::error::Error;
use redundancy::index as core;
use redundancy::index::{Index, Kind, Rows};

/// The rows in use and the length; all six rows if not given.
pub fn rows_in(rows: Option<Vec<usize>>, length: f64) -> PyResult<Rows> {
    ok(rows.map_or_else(|| Rows::all(length), |rows| Rows::new(&rows, length)))
}

fn of_jacobian(kind: Kind, length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyObjective> {
    PyObjective::single(Index::of(kind, rows_in(rows, length)?, squared))
}

/// One Python class a kind of the core's declaration. [`ConditionNumber`], which is two of them, is written out.
macro_rules! class {
    ($(#[$doc:meta])* ConditionNumber) => {};
    ($(#[$doc:meta])* SpectralConditionNumber) => {};
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        ///
        /// Parameters
        /// ----------
        /// length : float
        ///     Characteristic length that multiplies the angular rows [m]; 1 gives the usual index in SI units.
        /// rows : sequence of int, optional
        ///     Rows in use, 0 to 2 angular, 3 to 5 linear; all six if not given (planar robots: [2, 3, 4]).
        /// squared : bool
        ///     Whether the value is the square.
        ///
        /// Raises
        /// ------
        /// InvalidValueError
        ///     If the length is not positive or the rows are not increasing.
        #[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
        pub struct $name;

        #[pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (length=1.0, rows=None, squared=false))]
            fn new(length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<PyClassInitializer<Self>> {
                Ok(PyClassInitializer::from(of_jacobian(Kind::$name, length, rows, squared)?).add_subclass(Self))
            }
        }
    };
}

/// One Python class a weighted index of the joints' limits.
macro_rules! class_of_limits {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        ///
        /// Parameters
        /// ----------
        /// weights : array_like, shape (n,), optional
        ///     One for each joint; ones if not given. Joints without both limits do not count.
        #[pyclass(extends = PyObjective, frozen, module = "redundancy._core")]
        pub struct $name;

        #[pymethods]
        impl $name {
            #[new]
            #[pyo3(signature = (weights=None))]
            fn new(weights: Option<&Bound<'_, PyAny>>) -> PyResult<PyClassInitializer<Self>> {
                let weights = weights.map_or_else(|| Ok(Vec::new()), |weights| read_list("weights", weights))?;
                let index = Index::$name(ok(core::$name::new(&weights))?);
                Ok(PyClassInitializer::from(PyObjective::single(index)?).add_subclass(Self))
            }
        }
    };
}

macro_rules! register {
    ($module:ident SpectralConditionNumber) => {};
    ($module:ident $name:ident) => {
        $module.add_class::<$name>()?;
    };
}

macro_rules! classes {
    ($($(#[$doc:meta])* $kind:ident $name:literal $lanes:ident $kernel:expr;)*) => {
        $(class! { $(#[$doc])* $kind })*

        /// Adds every class to the module.
        pub fn register(module: &Bound<'_, PyModule>) -> Result<(), PyErr> {
            $(register!(module $kind);)*
            module.add_class::<JointLimits>()?;
            module.add_class::<LimitBarrier>()?;
            module.add_class::<CustomIndex>()
        }
    };
}

redundancy::of_jacobian!(classes);

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
        let kind = match norm {
            "frobenius" => Kind::ConditionNumber,
            "spectral" => Kind::SpectralConditionNumber,
            _ => return Err(Error::value("norm", format!("{norm:?}"), "\"frobenius\" or \"spectral\"").into()),
        };
        Ok(PyClassInitializer::from(of_jacobian(kind, length, rows, squared)?).add_subclass(Self))
    }
}

class_of_limits! {
    /// Distance to the middle of the joint ranges, 1/2 sum w_i ((q_i - middle_i) / half range_i)^2 (Huo 2009, eq. 4.1, made dimensionless).
    JointLimits
}

class_of_limits! {
    /// Logarithmic barrier at the joint limits, -sum w_i ln((q_max - q)(q - q_min) / half range^2): 0 in the middle, inf at a limit.
    LimitBarrier
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
