//! A weighted sum of indices as a Python class: evaluation at one posture and at many.

use std::sync::{Arc, OnceLock};

use numpy::{PyArray2, PyArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};
use pyo3::types::{PyDict, PyTuple};

use crate::array::{Rows as Postures, elements, for_each_chunk, ok, output, read_one_or_many, read_rows, read_vector};
use crate::index::custom::PyIndex;
use crate::index::kinds::rows_in;
use crate::robot::PyRobot;
use crate::spare::Spare;
use redundancy::error::Error;
use redundancy::index::{Answers, Index, Objective, Order, Status};
use redundancy::linalg::MAX_JOINTS;
use redundancy::robot::Robot;

/// A weighted sum of indices of a posture.
///
/// Made by adding indices and multiplying them by numbers: ``ConditionNumber(0.48, squared=True) + 0.1 * JointLimits()``. A term may
/// be any callable of ``q`` that returns a number, or (number, gradient), or (number, gradient, Hessian); what it does not return is taken by
/// central differences.
#[pyclass(name = "Objective", subclass, frozen, module = "redundancy._core")]
pub struct PyObjective {
    pub objective: Objective,
    pub custom: Vec<Arc<PyIndex>>,
    gradients: Spare,
}

fn order(order: i64) -> PyResult<Order> {
    match order {
        0 => Ok(Order::Value),
        1 => Ok(Order::Gradient),
        2 => Ok(Order::Hessian),
        _ => Err(Error::value("order", order, "0 (value), 1 (and gradient) or 2 (and Hessian)").into()),
    }
}

impl PyObjective {
    fn new(objective: Objective, custom: Vec<Arc<PyIndex>>) -> Self {
        Self { objective, custom, gradients: Spare::default() }
    }

    pub fn single(index: Index) -> PyResult<Self> {
        Ok(Self::new(ok(Objective::new(vec![(1.0, index)]))?, Vec::new()))
    }

    pub fn from_callable(function: &Bound<'_, PyAny>) -> PyResult<Self> {
        if !function.is_callable() {
            return Err(PyTypeError::new_err(format!("expected an index or a callable, got {}", function.get_type())).into());
        }
        let index = Arc::new(PyIndex::new(function.clone().unbind()));
        let mut out = Self::single(Index::Custom(index.clone()))?;
        out.custom.push(index);
        Ok(out)
    }

    fn sum(&self, other: &Self) -> PyResult<Self> {
        let terms = self.objective.terms().iter().chain(other.objective.terms()).cloned().collect();
        Ok(Self::new(ok(Objective::new(terms))?, self.custom.iter().chain(&other.custom).cloned().collect()))
    }

    /// Raises the exception of a callable among the terms, if one was raised.
    #[inline(always)]
    pub fn check(&self) -> PyResult<()> {
        match self.custom.iter().find_map(|index| index.take_error()) {
            Some(error) => Err(error.into()),
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
        let n = robot.n();
        let size = n + usize::from(with_length);
        let mut buffer = [0.0; MAX_JOINTS];
        if let Some(rows) = read_one_or_many("q", q, n, &mut buffer)? {
            let parts = self.many(py, robot, &rows, order, with_length)?;
            return Ok(if order == Order::Value { parts.get_item(0)? } else { parts.into_any() });
        }
        let q = &buffer[..n];
        let gradient = if order >= Order::Gradient { Some(self.gradients.vector(py, size)) } else { None };
        let hessian = if order == Order::Hessian { Some(unsafe_square(py, size)) } else { None };
        // SAFETY: both arrays are contiguous, and nobody else has them.
        let g: &mut [f64] = match &gradient {
            Some(array) => unsafe { std::slice::from_raw_parts_mut(array.data(), size) },
            None => &mut [],
        };
        let h: &mut [f64] = match &hessian {
            Some(array) => unsafe { std::slice::from_raw_parts_mut(array.data(), size * size) },
            None => &mut [],
        };
        let (value, _) = ok(self.objective.evaluate_into(robot, q, with_length, g, h))?;
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
        let rows = match read_rows("q", q, robot.n())? {
            Postures::Many(rows) => rows,
            Postures::One(row) => row[..robot.n()].to_vec(),
        };
        let Some(threads) = threads else { return self.many(py, robot, &rows, order, false) };
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|e| Failure::from(Error::value("threads", threads, &format!("a number of threads that can be started ({e})"))))?;
        self.many_in(py, Some(&pool), robot, &rows, order, false)
    }

    /// "regular", "repeated" (singular values coincide), "singular" or "outside limits".
    fn status(&self, robot: &Bound<'_, PyRobot>, q: &Bound<'_, PyAny>) -> PyResult<&'static str> {
        let robot = &*robot.get().robot;
        let n = robot.n();
        let mut buffer = [0.0; MAX_JOINTS];
        read_vector("q", q, n, &mut buffer)?;
        let (_, status) = ok(self.objective.evaluate_into(robot, &buffer[..n], false, &mut [], &mut []))?;
        self.check()?;
        Ok(match status {
            Status::Regular => "regular",
            Status::Repeated => "repeated",
            Status::Singular => "singular",
            Status::OutsideLimits => "outside limits",
        })
    }

    /// The indices that job files know by name, and whether each is made of the Jacobian: these take a length, rows and a square.
    ///
    /// Returns
    /// -------
    /// dict of str to bool
    ///     In the order in which they are told to people.
    #[staticmethod]
    fn kinds(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let kinds = PyDict::new(py);
        for (name, of_jacobian) in Index::names() {
            kinds.set_item(name, of_jacobian)?;
        }
        Ok(kinds)
    }

    /// An index by its name in job files.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     One of `kinds`.
    /// length, rows, squared
    ///     As for `ConditionNumber`; an index of the joints' limits has none of them.
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If there is no such index, the length is not positive or the rows are not increasing.
    #[staticmethod]
    #[pyo3(signature = (name, length=1.0, rows=None, squared=false))]
    fn named(name: &str, length: f64, rows: Option<Vec<usize>>, squared: bool) -> PyResult<Self> {
        Self::single(ok(Index::named(name, rows_in(rows, length)?, squared))?)
    }

    /// What it is, in words: the name of its index if it has only one, else "value".
    #[getter]
    fn name(&self) -> String {
        match self.objective.terms() {
            [(1.0, index)] if !matches!(index, Index::Custom(_)) => index.name().replace('_', " "),
            _ => "value".into(),
        }
    }

    /// The length that all terms share [m], or None.
    #[getter]
    fn length(&self) -> Option<f64> {
        self.objective.length()
    }

    /// The same objective with another length in every term that has one.
    fn with_length(&self, length: f64) -> PyResult<Self> {
        ok(redundancy::error::check_positive("length", length))?;
        Ok(Self::new(self.objective.with_length(length), self.custom.clone()))
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
        Ok(Self::new(ok(Objective::new(terms))?, self.custom.clone()))
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

fn unsafe_square(py: Python<'_>, size: usize) -> Bound<'_, PyArray2<f64>> {
    // SAFETY: every element is written before the array is handed out.
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
        let arrays = (output(py, None, [count])?, output(py, None, [count, g])?, output(py, None, [count * h.min(1), size, size])?);
        let (values, gradients, hessians) = (elements(&arrays.0), elements(&arrays.1), elements(&arrays.2));
        let refused = OnceLock::new();
        py.detach(|| {
            let mut work = || {
                for_each_chunk(rows, n, [(values, 1), (gradients, g), (hessians, h)], |q, [values, gradients, hessians]| {
                    let out = &mut Answers { values, gradients, hessians };
                    if let Err(error) = self.objective.evaluate_many(robot, q, with_length, out) {
                        refused.get_or_init(|| error);
                    }
                })
            };
            match pool {
                Some(pool) => pool.install(work),
                None => work(),
            }
        });
        ok(refused.into_inner().map_or(Ok(()), Err))?;
        self.check()?;
        let mut parts = vec![arrays.0.into_any()];
        if g > 0 {
            parts.push(arrays.1.into_any());
        }
        if h > 0 {
            parts.push(arrays.2.into_any());
        }
        Ok(PyTuple::new(py, parts)?)
    }
}
