//! The indices as Python classes: each is an objective of one term.

use std::sync::Arc;

use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use super::array::{Rows as Postures, elements, for_each_row, ok, output, read_list, read_rows, read_vector};
use super::custom::PyIndex;
use super::robot::PyRobot;
use crate::error::Error;
use crate::index as core;
use crate::index::{Evaluation, Index, Objective, Order, Rows, Spectral, SpectralKind, Status};
use crate::linalg::MAX_JOINTS;
use crate::robot::Robot;
use crate::with_capacity;

/// A weighted sum of indices of a posture.
///
/// Made by adding indices and multiplying them by numbers: ``ConditionNumber(0.48, squared=True) + 0.1 * JointLimits()``. A term may
/// be any callable of ``q`` that returns a number, or (number, gradient), or (number, gradient, Hessian); what it does not return is taken by
/// central differences.
#[pyclass(name = "Objective", subclass, frozen, module = "redundancy._core")]
pub struct PyObjective {
    pub objective: Objective,
    pub custom: Vec<Arc<PyIndex>>,
}

fn order(order: i64) -> PyResult<Order> {
    match order {
        0 => Ok(Order::Value),
        1 => Ok(Order::Gradient),
        2 => Ok(Order::Hessian),
        _ => Err(Error::value("order", order, "0 (value), 1 (and gradient) or 2 (and Hessian)").into()),
    }
}

fn rows(rows: Option<Vec<usize>>, length: f64) -> PyResult<Rows> {
    ok(match rows {
        Some(rows) => Rows::new(&rows, length),
        None => Rows::all(length),
    })
}

impl PyObjective {
    fn single(index: Index) -> PyResult<Self> {
        Ok(Self { objective: ok(Objective::new(vec![(1.0, index)]))?, custom: Vec::new() })
    }

    fn from_callable(function: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !function.is_callable() {
            return Err(PyTypeError::new_err(format!("expected an index or a callable, got {}", function.get_type())));
        }
        let index = Arc::new(PyIndex::new(function.clone().unbind()));
        let mut out = Self::single(Index::Custom(index.clone()))?;
        out.custom.push(index);
        Ok(out)
    }

    fn sum(&self, other: &Self) -> PyResult<Self> {
        let terms = self.objective.terms().iter().chain(other.objective.terms()).cloned().collect();
        Ok(Self { objective: ok(Objective::new(terms))?, custom: self.custom.iter().chain(&other.custom).cloned().collect() })
    }

    /// Raises the exception of a callable among the terms, if one was raised.
    #[inline(always)]
    pub fn check(&self) -> PyResult<()> {
        match self.custom.iter().find_map(|index| index.take_error()) {
            Some(error) => Err(error),
            None => Ok(()),
        }
    }

    fn check_length(&self, with_length: bool) -> PyResult<()> {
        if with_length && self.objective.length().is_none() {
            return Err(Error::value("with_length", true, "terms that share one length").into());
        }
        Ok(())
    }
}

/// Writes value, gradient and Hessian; with the length as entry n when `with_length`.
#[inline(always)]
fn write<const C: usize>(got: &Evaluation<C>, n: usize, with_length: bool, gradient: &mut [f64], hessian: &mut [f64]) {
    let size = n + usize::from(with_length);
    if !gradient.is_empty() {
        gradient[..n].copy_from_slice(&got.gradient[..n]);
        if with_length {
            gradient[n] = got.length_slope;
        }
    }
    if hessian.is_empty() {
        return;
    }
    for k in 0..n {
        hessian[k * size..k * size + n].copy_from_slice(&got.hessian[k][..n]);
        if with_length {
            hessian[k * size + n] = got.length_gradient[k];
            hessian[n * size + k] = got.length_gradient[k];
        }
    }
    if with_length {
        hessian[n * size + n] = got.length_curvature;
    }
}

fn evaluate_into<const C: usize>(
    objective: &Objective,
    robot: &Robot,
    q: &[f64],
    order: Order,
    with_length: bool,
    gradient: &mut [f64],
    hessian: &mut [f64],
) -> (f64, Status) {
    let got = objective.evaluate::<C>(robot, q, order, with_length);
    write(&got, q.len(), with_length, gradient, hessian);
    (got.value, got.status)
}

#[pymethods]
impl PyObjective {
    /// Value and derivatives at a posture.
    ///
    /// Parameters
    /// ----------
    /// robot : Robot
    ///     The robot.
    /// q : array_like, shape (n,) or (N, n)
    ///     Joint coordinates [rad or m].
    /// order : {0, 1, 2}
    ///     0: the value; 1: (value, gradient (n,)); 2: (value, gradient, Hessian (n, n)).
    /// with_length : bool
    ///     Append the characteristic length as entry n of gradient and Hessian.
    ///
    /// Returns
    /// -------
    /// float, or tuple of float and arrays
    ///     For a batch, arrays with a leading axis N, computed on every core with the GIL released.
    ///
    /// Notes
    /// -----
    /// At a singularity the value is its limit (inf for condition numbers and the parameter of singularity, 0 for manipulability and
    /// the smallest singular value) and the derivatives are NaN. Where singular values coincide, spectral indices return one of their
    /// one-sided gradients and a NaN Hessian. `status` tells which.
    #[pyo3(signature = (robot, q, order=2, with_length=false))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        robot: &Bound<'py, PyRobot>,
        q: &Bound<'py, PyAny>,
        order: i64,
        with_length: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let order = self::order(order)?;
        self.check_length(with_length)?;
        let robot = &*robot.get().robot;
        ok(self.objective.check(robot))?;
        let n = robot.n();
        let size = n + usize::from(with_length);
        let mut buffer = [0.0; MAX_JOINTS];
        if q.cast::<PyArray1<f64>>().is_err()
            && let Postures::Many(rows) = read_rows("q", q, n)?
        {
            let parts = self.many(py, robot, &rows, order, with_length)?;
            return Ok(if order == Order::Value { parts.get_item(0)? } else { parts.into_any() });
        }
        read_vector("q", q, n, &mut buffer)?;
        let q = &buffer[..n];
        let gradient = if order >= Order::Gradient { Some(unsafe_vector(py, size)) } else { None };
        let hessian = if order == Order::Hessian { Some(unsafe_square(py, size)) } else { None };
        // SAFETY: both arrays are new and contiguous, and nobody else has them.
        let g: &mut [f64] = match &gradient {
            Some(array) => unsafe { std::slice::from_raw_parts_mut(array.data(), size) },
            None => &mut [],
        };
        let h: &mut [f64] = match &hessian {
            Some(array) => unsafe { std::slice::from_raw_parts_mut(array.data(), size * size) },
            None => &mut [],
        };
        let (value, _) = with_capacity!(n, evaluate_into(&self.objective, robot, q, order, with_length, g, h));
        self.check()?;
        match (gradient, hessian) {
            (Some(gradient), Some(hessian)) => Ok((value, gradient, hessian).into_pyobject(py)?.into_any()),
            (Some(gradient), None) => Ok((value, gradient).into_pyobject(py)?.into_any()),
            _ => Ok(value.into_pyobject(py)?.into_any()),
        }
    }

    /// Values and derivatives at many postures on a chosen number of threads.
    ///
    /// Parameters
    /// ----------
    /// robot : Robot
    ///     The robot.
    /// q : array_like, shape (N, n)
    ///     Joint coordinates [rad or m].
    /// order : {0, 1, 2}
    ///     As for `evaluate`.
    /// threads : int, optional
    ///     Number of threads; every core if not given.
    ///
    /// Returns
    /// -------
    /// tuple of arrays
    ///     (N,), and (N, n), and (N, n, n), as far as `order` asks.
    #[pyo3(signature = (robot, q, order=2, threads=None))]
    fn evaluate_many<'py>(
        &self,
        py: Python<'py>,
        robot: &Bound<'py, PyRobot>,
        q: &Bound<'py, PyAny>,
        order: i64,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let order = self::order(order)?;
        let robot = &*robot.get().robot;
        ok(self.objective.check(robot))?;
        let rows = match read_rows("q", q, robot.n())? {
            Postures::Many(rows) => rows,
            Postures::One(row) => row[..robot.n()].to_vec(),
        };
        let Some(threads) = threads else { return self.many(py, robot, &rows, order, false) };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| PyErr::from(Error::value("threads", threads, &format!("a number of threads that can be started ({e})"))))?;
        self.many_in(py, Some(&pool), robot, &rows, order, false)
    }

    /// "regular", "repeated" (singular values coincide), "singular" or "outside limits".
    fn status(&self, robot: &Bound<'_, PyRobot>, q: &Bound<'_, PyAny>) -> PyResult<&'static str> {
        let robot = &*robot.get().robot;
        ok(self.objective.check(robot))?;
        let n = robot.n();
        let mut buffer = [0.0; MAX_JOINTS];
        read_vector("q", q, n, &mut buffer)?;
        let (_, status) = with_capacity!(n, evaluate_into(&self.objective, robot, &buffer[..n], Order::Gradient, false, &mut [], &mut []));
        self.check()?;
        Ok(match status {
            Status::Regular => "regular",
            Status::Repeated => "repeated",
            Status::Singular => "singular",
            Status::OutsideLimits => "outside limits",
        })
    }

    /// The length that all terms share [m], or None.
    #[getter]
    fn length(&self) -> Option<f64> {
        self.objective.length()
    }

    /// The same objective with another length in every term that has one.
    fn with_length(&self, length: f64) -> PyResult<Self> {
        ok(crate::error::check_positive("length", length))?;
        Ok(Self { objective: self.objective.with_length(length), custom: self.custom.clone() })
    }

    fn __add__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        match other.cast::<Self>() {
            Ok(other) => self.sum(other.get()),
            Err(_) => self.sum(&Self::from_callable(other)?),
        }
    }

    fn __radd__(&self, other: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::from_callable(other)?.sum(self)
    }

    fn __mul__(&self, weight: f64) -> PyResult<Self> {
        let terms = self.objective.terms().iter().map(|(w, index)| (weight * w, index.clone())).collect();
        Ok(Self { objective: ok(Objective::new(terms))?, custom: self.custom.clone() })
    }

    fn __rmul__(&self, weight: f64) -> PyResult<Self> {
        self.__mul__(weight)
    }

    fn __repr__(&self) -> String {
        let terms: Vec<String> = self
            .objective
            .terms()
            .iter()
            .map(|(w, index)| if *w == 1.0 { format!("{index:?}") } else { format!("{w} * {index:?}") })
            .collect();
        terms.join(" + ")
    }
}

fn unsafe_vector(py: Python<'_>, size: usize) -> Bound<'_, PyArray1<f64>> {
    // SAFETY: every element is written before the array is handed out.
    unsafe { PyArray1::new(py, [size], false) }
}

fn unsafe_square(py: Python<'_>, size: usize) -> Bound<'_, PyArray2<f64>> {
    // SAFETY: as above.
    unsafe { PyArray2::new(py, [size, size], false) }
}

impl PyObjective {
    fn many<'py>(&self, py: Python<'py>, robot: &Robot, rows: &[f64], order: Order, with_length: bool) -> PyResult<Bound<'py, PyTuple>> {
        self.many_in(py, None, robot, rows, order, with_length)
    }

    fn many_in<'py>(
        &self,
        py: Python<'py>,
        pool: Option<&rayon::ThreadPool>,
        robot: &Robot,
        rows: &[f64],
        order: Order,
        with_length: bool,
    ) -> PyResult<Bound<'py, PyTuple>> {
        let n = robot.n();
        let count = rows.len() / n;
        let size = n + usize::from(with_length);
        let (g, h) = (if order >= Order::Gradient { size } else { 0 }, if order == Order::Hessian { size * size } else { 0 });
        // One cell a posture: value, gradient, Hessian; taken apart afterwards.
        let cell = 1 + g + h;
        let mut cells = vec![0.0; count * cell];
        py.detach(|| {
            let run = |cells: &mut [f64]| {
                for_each_row(rows, n, cells, cell, |q, cell| {
                    let (value, rest) = cell.split_at_mut(1);
                    let (gradient, hessian) = rest.split_at_mut(g);
                    (value[0], _) = with_capacity!(n, evaluate_into(&self.objective, robot, q, order, with_length, gradient, hessian));
                });
            };
            match pool {
                Some(pool) => pool.install(|| run(&mut cells)),
                None => run(&mut cells),
            }
        });
        self.check()?;
        let part = |array: Bound<'py, PyArrayDyn<f64>>, from: usize, width: usize| {
            for (out, cell) in elements(&array).chunks_exact_mut(width.max(1)).zip(cells.chunks_exact(cell)) {
                out.copy_from_slice(&cell[from..from + width]);
            }
            array.into_any()
        };
        let mut parts = vec![part(output(py, None, [count])?, 0, 1)];
        if g > 0 {
            parts.push(part(output(py, None, [count, size])?, 1, g));
        }
        if h > 0 {
            parts.push(part(output(py, None, [count, size, size])?, 1 + g, h));
        }
        PyTuple::new(py, parts)
    }
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
