//! `redundancy.OrthogonalSQP`.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use crate::array::{elements, ok, output, read_vector, vector};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::resolve::solution::{self, Given, Last, posture};
use crate::results::{CONSTRAINT, SOLVE_HISTORY};
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::error::Error;
use redundancy::linalg::{MAX_JOINTS, Row6};
use redundancy::resolve::{Iteration, Memory, OrthogonalSqp, Resolver, SqpSettings};

/// Redundancy resolution by sequential quadratic programming in the null space of the task (Leger 2014, 3.2.3, 4.2).
///
/// Parameters
/// ----------
/// robot : Robot
///     With at least as many joints as the task has dimensions.
/// task : Task
///     What the tool has to do.
/// objective : Objective
///     What the free motion minimises.
/// length : float, optional
///     Distance of the tool's two points (4.5) [m]: weighs angles against distances. The objective's length, or 1, if not given.
/// hessian : {"exact", "bfgs"}
///     The exact Hessian of the objective, or BFGS updates (3.51a) that start from it.
/// gain : float
///     Rate at which `step` closes the distance to the objective's minimum [1/s]; it keeps up with a minimum that moves whatever the gain.
/// dt : float
///     Length of a control tick [s].
/// limits : bool
///     Whether position limits (and in `step` speed limits) hold.
/// tolerance : float
///     Error at which a target counts as reached [rad, and m over length].
/// max_iterations : int
///     Steps of one solution at most.
///
/// Raises
/// ------
/// InvalidValueError
///     If a setting is out of its domain or the robot has too few joints.
#[pyclass(name = "OrthogonalSQP", frozen, module = "redundancy._core")]
pub struct PyOrthogonalSqp {
    solver: OrthogonalSqp,
    given: Given,
    last: Mutex<Last>,
}

impl PyOrthogonalSqp {
    fn last(&self) -> MutexGuard<'_, Last> {
        // What a panic of another thread left is still a step.
        self.last.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn tick<'py>(
        &self,
        py: Python<'py>,
        q: &[f64; MAX_JOINTS],
        twist: &Row6,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.solver.robot().n();
        let array = output(py, out, [n])?;
        let rates = elements(&array);
        let status = self.solver.step(&q[..n], twist, rates);
        self.given.check(py)?;
        self.last().take(status, q, twist, rates);
        Ok(array)
    }
}

#[pymethods]
impl PyOrthogonalSqp {
    #[new]
    #[pyo3(signature = (robot, task, objective, *, length=None, hessian="exact", gain=10.0, dt=1e-3, limits=true, tolerance=1e-12, max_iterations=100))]
    fn new(
        py: Python<'_>,
        robot: Py<PyRobot>,
        task: Py<PyTask>,
        objective: Py<PyObjective>,
        length: Option<f64>,
        hessian: &str,
        gain: f64,
        dt: f64,
        limits: bool,
        tolerance: f64,
        max_iterations: usize,
    ) -> PyResult<Self> {
        let exact_hessian = match hessian {
            "exact" => true,
            "bfgs" => false,
            _ => return Err(Error::value("hessian", format!("{hessian:?}"), "\"exact\" or \"bfgs\"").into()),
        };
        let terms = &objective.bind(py).get().objective;
        let length = length.or_else(|| terms.length()).unwrap_or(1.0);
        let settings = SqpSettings { length, exact_hessian, gain, dt, limits, tolerance, max_iterations };
        let asked = *task.get().plain("OrthogonalSQP")?;
        let solver = OrthogonalSqp::new(robot.get().robot.clone(), asked, terms.clone(), settings);
        let given = Given::new(py, robot, task, Some(objective.into_any()));
        Ok(Self { solver: ok(solver)?, given, last: Mutex::new(Last::NONE) })
    }

    /// The robot.
    #[getter]
    fn robot(&self, py: Python<'_>) -> Py<PyRobot> {
        self.given.robot.clone_ref(py)
    }

    /// The task.
    #[getter]
    fn task(&self, py: Python<'_>) -> Py<PyTask> {
        self.given.task.clone_ref(py)
    }

    /// The objective.
    #[getter]
    fn objective(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.given.objective.as_ref().map(|objective| objective.clone_ref(py))
    }

    /// Distance of the tool's two points [m].
    #[getter]
    fn length(&self) -> f64 {
        self.solver.settings().length
    }

    /// Length of a control tick [s].
    #[getter]
    fn dt(&self) -> f64 {
        self.solver.dt()
    }

    /// Joint rates of one control tick (Leger 2014, eq. 4.20).
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// twist : array_like, shape (6,)
    ///     Desired twist [omega; v] of the tool point in the base frame [rad/s, m/s]; add a gain times `error` for feedback (4.19). Its free
    ///     components are not looked at.
    /// out : ndarray, shape (n,), optional
    ///     Receives the result.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Rates [rad/s or m/s]: finite, within speed limits, never across a position limit within ``dt``; a joint that is beyond one comes
    ///     back, with a quarter of its speed limit at least. `status` tells how they came about.
    ///
    /// Notes
    /// -----
    /// Where the task's Jacobian is nearly singular the step is damped (shortest over longest orthogonal row below 1e-4) and the objective is left
    /// aside. In front of a goal out of reach it is that of the posture nearest to it, "damped" or "limited". No allocation but that of the result.
    #[pyo3(signature = (q, twist, out=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        twist: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let q = posture(self.solver.robot(), "q", q)?;
        let mut desired = [0.0; 6];
        read_vector("twist", twist, 6, &mut desired)?;
        self.tick(py, &q, &desired, out)
    }

    /// Joint rates of one control tick along a path: `step` with the twist that takes the tool to where it has to be at the end of the tick, and takes
    /// up a part of its error.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// now, next : array_like
    ///     Where the tool should be at the start and at the end of the tick: targets as for `solve`.
    /// out : ndarray, shape (n,), optional
    ///     Receives the result.
    /// share : float
    ///     Part of the error that is taken up, above 0, at most 1: ``gain * dt`` for a gain in 1/s. With 1 the twist is `twist_to` of ``next``, else that
    ///     less ``1 - share`` of `twist_to` of ``now``.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     As for `step`.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError, InvalidValueError
    ///     If an array has the wrong shape, a number is not finite, or the share is out of its domain.
    #[pyo3(signature = (q, now, next, out=None, *, share=1.0))]
    fn step_along<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        now: &Bound<'py, PyAny>,
        next: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        share: f64,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let (q, twist) = solution::along(&self.solver, q, now, next, share)?;
        self.tick(py, &q, &twist, out)
    }

    /// How the last `step` came about: "regular" (the twist is followed to rounding, as far as the task looks at it), "damped", "task only" (the objective
    /// has no derivatives there), "limited" (slowed down or held by limits) or "returning" (a joint is beyond a limit of position and comes back).
    #[getter]
    fn status(&self) -> &'static str {
        self.last().status.name()
    }

    /// As `status`.
    #[getter]
    fn step_status(&self) -> &'static str {
        self.status()
    }

    /// The part of the twist that the last `step` did not follow, [omega; v] (6,) [rad/s, m/s], as far as the task looks at it.
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.last().deviation(py, &self.solver)
    }

    /// Forgets the last step.
    fn reset(&self) {
        *self.last() = Last::NONE;
    }

    /// The small motion [rotation vector; translation] from the tool at ``q`` to the target [rad, m] (4.34), as far as the task looks at it.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,) or (N, n)
    ///     Joint coordinates [rad or m].
    /// target : array_like
    ///     As for `solve`; for many postures as many targets, as for `follow_chunk`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,) or (N, 6)
    ///     In the base frame.
    fn error<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, target: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        solution::error(py, &self.solver, q, target, 1.0)
    }

    /// The twist that would bring the tool onto a target within one tick: `error` over ``dt``, that is ``(P_d - P_e) / T`` and the rotation vector of
    /// ``R_d R_e'`` over T (Dufour and Suleiman 2020, eq. 1).
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// target : array_like
    ///     As for `solve`.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,)
    ///     [omega; v] in the base frame [rad/s, m/s].
    fn twist_to<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, target: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        solution::error(py, &self.solver, q, target, self.solver.dt())
    }

    /// The task as an equality constraint at a posture: h(q) = 0 on the target (Leger 2014, eq. 4.5 to 4.13).
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// target : array_like
    ///     As for `solve`.
    ///
    /// Returns
    /// -------
    /// h : ndarray, shape (m,)
    ///     What is there less what should be, components of the task: angular ones first, times ``length`` [m], then linear ones [m].
    /// jacobian : ndarray, shape (m, n)
    ///     dh/dq, exact on the target.
    /// null : ndarray, shape (n, k)
    ///     Orthonormal directions of the free motion: k = n - m, and more where the Jacobian is singular.
    ///
    /// Notes
    /// -----
    /// The lower block of the printed Jacobian (4.13) has the wrong sign: a1 - p1 is right.
    fn constraint<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, target: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.solver.robot().n();
        let target = solution::target(self.solver.task(), "target", target)?;
        let at = ok(self.solver.constraint(&target, &posture(self.solver.robot(), "q", q)?[..n]))?;
        let matrix = |rows: usize, columns: usize, entry: &dyn Fn(usize, usize) -> f64| {
            let numbers = (0..rows * columns).map(|k| entry(k / columns, k % columns)).collect();
            PyArray1::from_vec(py, numbers).reshape([rows, columns])
        };
        let jacobian = matrix(at.dimension, n, &|r, i| at.jacobian[r][i])?;
        let null = matrix(n, at.free, &|i, k| at.null[k][i])?;
        Ok(CONSTRAINT.make(py, (vector(py, &at.h[..at.dimension]), jacobian, null))?)
    }

    /// The way of `solve` from a start: every posture on the target, with what the objective and its gradient are there.
    ///
    /// Parameters
    /// ----------
    /// target : array_like
    ///     As for `solve`.
    /// q0 : array_like, shape (n,)
    ///     Start [rad or m].
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (k, n)
    ///     Postures, the last one less than a step before the answer of `solve`.
    /// value, gradient : ndarray, shape (k,)
    ///     The objective, and the length of its gradient along the free motion; joints held at limits do not count.
    /// step : ndarray, shape (k,)
    ///     Largest component of the step from there, before it is shortened [rad or m].
    /// evaluations : ndarray, shape (k,)
    ///     Evaluations of the objective up to there, those of refused steps included.
    fn history<'py>(&self, py: Python<'py>, target: &Bound<'py, PyAny>, q0: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let n = self.solver.robot().n();
        let target = solution::target(self.solver.task(), "target", target)?;
        let q0 = posture(self.solver.robot(), "q0", q0)?;
        let mut seen = Vec::new();
        py.detach(|| self.solver.trace(&target, &q0[..n], &mut |iteration| seen.push(*iteration)));
        self.given.check(py)?;
        let column = |f: fn(&Iteration) -> f64| vector(py, &seen.iter().map(f).collect::<Vec<_>>());
        let q = PyArray1::from_vec(py, seen.iter().flat_map(|iteration| iteration.q[..n].to_vec()).collect()).reshape([seen.len(), n])?;
        let evaluations = PyArray1::from_vec(py, seen.iter().map(|iteration| iteration.evaluations as i64).collect());
        let parts = (q, column(|x| x.value), column(|x| x.gradient), column(|x| x.step), evaluations);
        Ok(SOLVE_HISTORY.make(py, parts)?)
    }

    /// A posture on a target at a minimum of the objective.
    ///
    /// Parameters
    /// ----------
    /// target : array_like
    ///     Axisymmetric: (6,), position [m] and axis direction; free rotation: (3,), position; else (12,), position and rotation matrix by
    ///     rows. Any task: (4, 4), a pose of the tool as `Robot.fk` answers it.
    /// q0 : array_like, shape (n,), optional
    ///     Start; if not given, the best of ``starts`` random postures within the limits.
    /// starts, seed : int
    ///     Number and seed of the random starts.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (n,)
    ///     Joint coordinates; the nearest found when unreachable (NaN when no start came near).
    /// value : float
    ///     Objective there.
    /// status : str
    ///     "converged" (on target, at a minimum, or where the task leaves no freedom), "on target" (limits hold the objective above its minimum, or the
    ///     iterations ended) or "unreachable".
    /// iterations : int
    ///     Steps.
    #[pyo3(signature = (target, q0=None, starts=24, seed=0))]
    fn solve<'py>(
        &self,
        py: Python<'py>,
        target: &Bound<'py, PyAny>,
        q0: Option<&Bound<'py, PyAny>>,
        starts: usize,
        seed: u64,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.given.solve(py, &self.solver, target, q0, starts, seed)
    }

    /// Along some targets, each solved from the posture of the one before.
    ///
    /// Parameters
    /// ----------
    /// targets : array_like, shape (N, k) or (N, 4, 4)
    ///     Targets as for `solve`.
    /// q0 : array_like, shape (n,)
    ///     Start.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (N, n)
    ///     Joint coordinates.
    /// value, position_error, axis_error : ndarray, shape (N,)
    ///     Objective, distance [m] and angle [rad] to the targets.
    /// statuses : list of str
    ///     As for `solve`.
    /// iterations : int
    ///     Steps altogether.
    fn follow_chunk<'py>(&self, py: Python<'py>, targets: &Bound<'py, PyAny>, q0: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let (targets, q) = solution::path(&self.solver, targets, q0)?;
        Ok(self.given.follow(py, &self.solver, &targets, &q, &mut Memory::default())?.0)
    }
}
