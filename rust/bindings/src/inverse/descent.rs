//! `redundancy.CoordinateDescent`.

use std::ffi::CString;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyRuntimeWarning;
use pyo3::prelude::*;

use super::terms::{read_centres, read_metric, read_points};
use crate::array::{ok, read_list, read_vector, vector};
use crate::errors::PyResult;
use crate::resolve::solution;
use crate::results::{DESCENT, DESCENT_TRACE};
use crate::robot::PyRobot;
use crate::robot::frames::Maybe;
use crate::task::PyTask;
use redundancy::error::Error;
use redundancy::inverse::descent::{Algorithm, Cost, Descent, Goal, Order, Rule, Stop, suggested_weights};
use redundancy::linalg::MAX_JOINTS;
use redundancy::linalg::quaternion::Quaternion;
use redundancy::robot::Joint;
use redundancy::task::Task;

/// W of (46), for six revolute joints.
const SIX: [f64; 6] = [1.0, 0.5, 0.5, 0.3, 0.3, 0.3];

/// Sweeps of a trace at most, which keeps them all: more are a mistake, and would fill the memory.
const MOST_SWEEPS: usize = 1_000_000;

/// Coordinate descent to a pose: the five algorithms of From and Gravdahl (2007, section 5), each joint in closed form.
///
/// The cost is ``w_p |p - p_d|^2 + w_o E_o`` and what points and centring add. Algorithms 1, 2, 3 and 5 with its search never raise it (``monotone``); 4, and 5 as
/// printed, are no descent. Convergence near a goal is slow, see the page on coordinate descent: take a few sweeps as a start, or for a goal out of reach.
///
/// Parameters
/// ----------
/// robot : Robot
///     A robot whose joints are all free: none follows another.
/// target : array_like, shape (4, 4)
///     Pose of the tool in the base frame, or a target of the task: position (3,), or position and axis (6,).
/// task : Task, optional
///     ``Task.full()``; ``Task.axisymmetric(axis)``, of which the spin is free and ``|z - z_d|^2`` is E_o; ``Task.position()``; or ``Task.within(volume)``, of
///     which before each sweep, and each move of algorithms 2 and 3, the member nearest to the present orientation is wanted, the volume standing in the
///     target's frame. If not given the whole pose, for a target of three numbers the position.
/// algorithm : {1, 2, 3, 4, 5}
///     1: the joints in turn, each to its minimum (5.3). 2: n times the joint with the largest decrease (5.4). 3: n times the one with the largest decrease
///     over its change (5.5). 4: all at once, ``q + step W x`` (45). 5: along the estimate G of the gradient (47).
/// order : {"end_to_base", "base_to_end", "double"}
///     Of algorithm 1; "double" is to the base and back, Aitken's.
/// w_p, w_o : float, optional
///     Weights of position [1/m^2] and orientation, at least 0; 1 and half the square of a third of the robot's size if not given.
/// orientation_metric : {"frobenius", "quaternion"}
///     E_o: ``|C - D|_F^2 = 8 sin^2(w/2)``, or ``2 - 2 |<c, d>| = 4 sin^2(w/4)``, with w the angle of error.
/// weights : array_like, shape (n,), optional
///     Of algorithms 2 and 3: which part of its way a joint moves, above 0, at most 1; 1 if not given. Of 4 and 5 as printed: W, above 0; that of (46) for six
///     revolute joints, 1 for other robots.
/// step : float, optional
///     w_s of algorithm 4; ``1 / sum(W)``, which is stable near a goal, if not given. Above ``2 / sum(W)`` it may not be: a RuntimeWarning says so.
/// rule : {"search", "printed", "normalised"}
///     Of algorithm 5: Armijo's search along G, a descent; ``q - min|x| W G`` as printed, whose units do not match and which stalls as soon as one joint is at
///     its minimum; the same with ``G / max|G|``.
/// limits : bool
///     Keep the robot's limits, those on combinations of joints included. A start beyond them is put onto them first.
/// points : sequence of (int, array_like, array_like, float), optional
///     Points of links (43), at most 8: the number of joints that carry it, its place in the frame of the link after them as `Robot.link_frames` gives it, its
///     goal in the base frame [m], a weight [1/m^2]; below zero the point is kept off the goal.
/// centring : array_like, shape (n,), or float, optional
///     Weights of joints that are drawn to the middle: ``weight (1 - cos(q - middle))``, for a joint that slides ``weight (q - middle)^2 / 2``.
/// middle : array_like, shape (n,), optional
///     Where these are drawn to [rad or m]; the middle of the ranges if not given.
///
/// Raises
/// ------
/// ShapeError, NonFiniteError, InvalidValueError
///     If an argument is not one of these, joints of the robot follow others, or nothing bounds the cost of a joint that slides without limits.
#[pyclass(name = "CoordinateDescent", frozen, module = "redundancy._core")]
pub struct PyCoordinateDescent {
    descent: Descent,
    robot: Py<PyRobot>,
    #[pyo3(get)]
    algorithm: i64,
    #[pyo3(get)]
    w_p: f64,
    #[pyo3(get)]
    w_o: f64,
}

/// What the algorithms are made of.
struct Asked<'a> {
    number: i64,
    order: &'a str,
    weights: Option<Vec<f64>>,
    step: Option<f64>,
    rule: &'a str,
}

impl Asked<'_> {
    fn algorithm(&self, joints: &[Joint]) -> PyResult<Algorithm> {
        let order = match self.order {
            "end_to_base" => Order::EndToBase,
            "base_to_end" => Order::BaseToEnd,
            "double" => Order::Double,
            other => return Err(Error::value("order", format!("{other:?}"), "\"end_to_base\", \"base_to_end\" or \"double\"").into()),
        };
        let mut all = [1.0; MAX_JOINTS];
        if let Some(weights) = &self.weights {
            if weights.len() != joints.len() {
                return Err(Error::length("weights", weights.len(), joints.len()).into());
            }
            all[..weights.len()].copy_from_slice(weights);
        } else if self.number >= 4 && joints == [Joint::Revolute; 6] {
            all[..6].copy_from_slice(&SIX);
        }
        let rule = match self.rule {
            "search" => Rule::Search,
            "printed" => Rule::Printed(all),
            "normalised" => Rule::Normalised(all),
            other => return Err(Error::value("rule", format!("{other:?}"), "\"search\", \"printed\" or \"normalised\"").into()),
        };
        let step = self.step.unwrap_or_else(|| 1.0 / all[..joints.len()].iter().sum::<f64>());
        match self.number {
            1 => Ok(Algorithm::Cyclic(order)),
            2 => Ok(Algorithm::LargestDecrease { share: all }),
            3 => Ok(Algorithm::LargestRate { share: all }),
            4 => Ok(Algorithm::Together { weights: all, step }),
            5 => Ok(Algorithm::Gradient(rule)),
            other => Err(Error::value("algorithm", other, "1 to 5").into()),
        }
    }
}

#[pymethods]
impl PyCoordinateDescent {
    #[new]
    #[pyo3(signature = (robot, target, task=None, algorithm=1, *, order="end_to_base", w_p=None, w_o=None, orientation_metric="frobenius", weights=None, step=None, rule="search", limits=true, points=None, centring=None, middle=None))]
    fn new(
        py: Python<'_>,
        robot: &Bound<'_, PyRobot>,
        target: &Bound<'_, PyAny>,
        task: Option<&Bound<'_, PyTask>>,
        algorithm: i64,
        order: &str,
        w_p: Option<f64>,
        w_o: Option<f64>,
        orientation_metric: &str,
        weights: Maybe<'_, '_>,
        step: Option<f64>,
        rule: &str,
        limits: bool,
        points: Maybe<'_, '_>,
        centring: Maybe<'_, '_>,
        middle: Maybe<'_, '_>,
    ) -> PyResult<Self> {
        let it = &robot.get().robot;
        let volume = task.and_then(|task| task.get().volume.clone());
        let task = match task {
            // The frame that the volume stands in is the whole of the target.
            Some(_) if volume.is_some() => Task::FULL,
            Some(task) => task.get().task,
            None if target.len().is_ok_and(|length| length == 3) => Task::POSITION,
            None => Task::FULL,
        };
        let suggested = suggested_weights(it);
        let (w_p, w_o) = (w_p.unwrap_or(suggested.0), w_o.unwrap_or(suggested.1));
        let target = solution::target(&task, "target", target)?;
        let volume = volume.map(|volume| volume.reoriented(&Quaternion::from_axes(&target.frame)));
        let mut goal = ok(Goal::of(&task, &target, (w_p, w_o)))?;
        goal.metric = read_metric(orientation_metric)?;
        let cost = Cost { goal, points: read_points(points)?, centres: read_centres(it, centring, middle)? };
        let weights = weights.map(|weights| read_list("weights", weights)).transpose()?;
        let asked = Asked { number: algorithm, order, weights, step, rule };
        let mut descent = ok(Descent::new(it.clone(), cost, asked.algorithm(it.joints())?, limits))?;
        if let Some(volume) = volume {
            descent = descent.within(volume);
        }
        if let Some(most) = descent.algorithm().largest_safe_step(it.n()) {
            let text = format!("step is above 2 / sum(W) = {most}: near a goal the sweeps may not converge");
            PyErr::warn(py, &py.get_type::<PyRuntimeWarning>(), &CString::new(text).unwrap_or_default(), 1)?;
        }
        Ok(Self { descent, robot: robot.clone().unbind(), algorithm, w_p, w_o })
    }

    /// The robot.
    #[getter]
    fn robot(&self, py: Python<'_>) -> Py<PyRobot> {
        self.robot.clone_ref(py)
    }

    /// Whether no sweep raises the cost: algorithms 1, 2, 3, and 5 with its search.
    #[getter]
    fn monotone(&self) -> bool {
        self.descent.algorithm().is_monotone()
    }

    /// The cost of a posture.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    fn cost(&self, q: &Bound<'_, PyAny>) -> PyResult<f64> {
        ok(self.descent.cost(&self.posture("q", q)?))
    }

    /// The gradient of the cost, shape (n,): exact, the b of each joint's closed form.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    fn gradient<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &ok(self.descent.gradient(&self.posture("q", q)?))?))
    }

    /// One sweep from a posture; of algorithms 2 and 3 as many single moves as there are joints, of 4 and 5 one move of all.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (n,)
    ///     After it, within the limits.
    /// cost : float
    ///     There.
    fn sweep<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyArray1<f64>>, f64)> {
        let mut q = self.posture("q", q)?;
        let cost = ok(self.descent.sweep(&mut q))?;
        Ok((vector(py, &q), cost))
    }

    /// A number of sweeps, whatever comes of them, and all that they pass.
    ///
    /// Parameters
    /// ----------
    /// q0 : array_like, shape (n,)
    ///     Where to start [rad or m].
    /// sweeps : int
    ///     How many, at most 1000000.
    ///
    /// Returns
    /// -------
    /// cost : ndarray, shape (sweeps + 1,)
    ///     At the start, put onto the limits if it was beyond them, and after each sweep.
    /// q : ndarray, shape (sweeps + 1, n)
    ///     Joints, likewise.
    /// picks : ndarray of int, shape (sweeps, n)
    ///     Joints that algorithms 2 and 3 moved, counted from 0, -1 where none lowers the cost; (sweeps, 0) for the others.
    #[pyo3(signature = (q0, sweeps=10))]
    fn trace<'py>(&self, py: Python<'py>, q0: &Bound<'py, PyAny>, sweeps: usize) -> PyResult<Bound<'py, PyAny>> {
        if sweeps > MOST_SWEEPS {
            return Err(Error::value("sweeps", sweeps, &format!("at most {MOST_SWEEPS}")).into());
        }
        let q0 = self.posture("q0", q0)?;
        let trace = ok(py.detach(|| self.descent.trace(&q0, sweeps)))?;
        let picks: Vec<i64> = trace.picks.iter().map(|joint| joint.map_or(-1, |joint| joint as i64)).collect();
        let width = picks.len().checked_div(sweeps).unwrap_or(0);
        let picks: Bound<'py, PyArray2<i64>> = PyArray1::from_vec(py, picks).reshape([sweeps, width])?;
        let q: Bound<'py, PyArray2<f64>> = PyArray1::from_vec(py, trace.postures).reshape([sweeps + 1, q0.len()])?;
        Ok(DESCENT_TRACE.make(py, (vector(py, &trace.costs), q, picks))?)
    }

    /// Sweeps until the tool is near enough, no joint alone lowers the cost, or nothing changes.
    ///
    /// Parameters
    /// ----------
    /// q0 : array_like, shape (n,)
    ///     Where to start [rad or m].
    /// sweeps : int
    ///     How many at most.
    /// position_tolerance, orientation_tolerance : float
    ///     Errors that are small enough, both of them [m], [rad].
    /// gradient_tolerance : float
    ///     Slope of the cost along a joint that counts as none.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (n,)
    ///     Joint coordinates [rad or m].
    /// status : str
    ///     "converged" (both errors within their tolerance; never with points or centring, which have more to gain), "stationary" (no slope along any joint that its limits leave free), "stalled" (the last two costs are
    ///     equal within rounding) or "out of sweeps".
    /// position_error, orientation_error : float
    ///     Of the tool [m], [rad]; of an axis its angle, 0 where the orientation is free.
    /// iterations : int
    ///     Sweeps.
    /// cost : float
    ///     At the end.
    /// costs : ndarray, shape (iterations + 1,)
    ///     Before the first sweep and after each.
    #[pyo3(signature = (q0, sweeps=100, *, position_tolerance=1e-4, orientation_tolerance=1e-3, gradient_tolerance=1e-12))]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        q0: &Bound<'py, PyAny>,
        sweeps: usize,
        position_tolerance: f64,
        orientation_tolerance: f64,
        gradient_tolerance: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let q0 = self.posture("q0", q0)?;
        for (name, value) in [
            ("position_tolerance", position_tolerance),
            ("orientation_tolerance", orientation_tolerance),
            ("gradient_tolerance", gradient_tolerance),
        ] {
            if value.is_nan() || value < 0.0 {
                return Err(Error::value(name, value, "at least 0").into());
            }
        }
        let stop = Stop { residuals: (position_tolerance, orientation_tolerance), slope: gradient_tolerance, sweeps };
        let found = ok(py.detach(|| self.descent.solve(&q0, stop)))?;
        let (position, orientation) = found.residuals;
        let (iterations, cost) = (found.costs.len() - 1, found.costs.last().copied().unwrap_or(f64::NAN));
        let parts = (vector(py, &found.q), found.stopped.name(), position, orientation, iterations, cost, vector(py, &found.costs));
        Ok(DESCENT.make(py, parts)?)
    }
}

impl PyCoordinateDescent {
    fn posture(&self, name: &str, q: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        let mut posture = vec![0.0; self.descent.robot().n()];
        let n = posture.len();
        read_vector(name, q, n, &mut posture)?;
        Ok(posture)
    }
}
