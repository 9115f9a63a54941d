//! `redundancy.TwistDecomposition` and its rivals: one base class, a subclass for each method.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::array::{elements, ok, output, read_vector};
use crate::errors::PyResult;
use crate::resolve::secondary::secondary;
use crate::resolve::solution::{self, Given, Last, posture};
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::linalg::{MAX_JOINTS, Row6};
use redundancy::resolve::{Memory, PathFrame, RateSolver, Resolver, Scaling, StepStatus};

/// A method of redundancy resolution at the level of rates; the base class of `TwistDecomposition`, `ResolvedRate`, `GradientProjection`,
/// `WeightedInverse`, `TaskPriority`, `Householder`, `Elimination` and `VirtualJoint`.
#[pyclass(name = "RateSolver", subclass, frozen, module = "redundancy._core")]
pub struct PyRateSolver {
    solver: RateSolver,
    given: Given,
    scaling: Scaling,
    memory: Mutex<Remembered>,
}

/// What is remembered.
struct Remembered {
    /// From step to step and from chunk to chunk.
    memory: Memory,
    /// The posture at the end of the last chunk.
    end: [f64; MAX_JOINTS],
    last: Last,
}

impl Remembered {
    /// Nothing yet.
    fn nothing() -> Self {
        Self { memory: Memory::default(), end: [f64::NAN; MAX_JOINTS], last: Last::NONE }
    }
}

impl PyRateSolver {
    pub fn of(solver: RateSolver, given: Given, scaling: Scaling) -> Self {
        Self { solver, given, scaling, memory: Mutex::new(Remembered::nothing()) }
    }

    fn remembered(&self) -> MutexGuard<'_, Remembered> {
        // What a panic of another thread left is still a posture.
        self.memory.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn step_on(&self, q: &[f64], twist: &Row6, frame: Option<&PathFrame>, memory: &mut Memory, rates: &mut [f64]) -> StepStatus {
        match frame {
            Some(frame) => self.solver.step_about(q, twist, frame, memory, rates),
            None => self.solver.step(q, twist, memory, rates),
        }
    }

    fn tick<'py>(
        &self,
        py: Python<'py>,
        q: &[f64; MAX_JOINTS],
        twist: &Row6,
        frame: Option<PathFrame>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.solver.robot().n();
        let array = output(py, out, [n])?;
        let rates = elements(&array);
        if self.given.calls_python {
            // Taken out, not held: a Python objective may let another thread in.
            let mut memory = self.remembered().memory;
            let status = self.step_on(&q[..n], twist, frame.as_ref(), &mut memory, rates);
            self.remembered().memory = memory;
            self.given.check(py)?;
            self.remembered().last.take(status, q, twist, frame.as_ref(), rates);
        } else {
            let mut remembered = self.remembered();
            let status = self.step_on(&q[..n], twist, frame.as_ref(), &mut remembered.memory, rates);
            remembered.last.take(status, q, twist, frame.as_ref(), rates);
        }
        Ok(array)
    }
}

#[pymethods]
impl PyRateSolver {
    /// The robot.
    #[getter]
    fn robot(&self, py: Python<'_>) -> Py<PyRobot> {
        self.given.robot.clone_ref(py)
    }

    /// The task that is followed: `Task.full()` for `ResolvedRate`.
    #[getter]
    fn task(&self, py: Python<'_>) -> Py<PyTask> {
        self.given.task.clone_ref(py)
    }

    /// The secondary task: an Objective, a PosturePull or None.
    #[getter]
    fn objective(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.given.objective.as_ref().map(|objective| objective.clone_ref(py))
    }

    /// Length that weighs angles against distances [m].
    #[getter]
    fn length(&self) -> f64 {
        self.solver.settings().length
    }

    /// Length of a control tick [s].
    #[getter]
    fn dt(&self) -> f64 {
        self.solver.dt()
    }

    /// Joint rates of one control tick.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// twist : array_like, shape (6,)
    ///     Desired twist [omega; v] of the tool point in the base frame [rad/s, m/s]; its free components are not looked at, but by
    ///     `ResolvedRate` (which follows them), `TaskPriority` (as far as the first task and the arm allow) and `VirtualJoint` (which shares
    ///     them between the virtual joint and the arm).
    /// out : ndarray, shape (n,), optional
    ///     Receives the result.
    /// frame : array_like, shape (3, 3) or (4, 4), optional
    ///     For a `Task.within` a volume, which needs it: the path's frame at the end of the tick, about which the volume is. Where the tool is outside of it about
    ///     that of the step before too, it comes back with 0.5 rad/s.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Rates [rad/s or m/s], never NaN; with ``limits``, within speed limits and never across a position limit within ``dt``: the free
    ///     motion gives way first, then all joints slow down together, then each stops at its limit. A joint that is beyond a limit of position
    ///     comes back, with a quarter of its speed limit at least. `status` tells how they came about.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError, InvalidValueError
    ///     If an array has the wrong shape, a number is not finite, or ``frame`` is missing where the task is within a volume, or given where it is not.
    ///
    /// Notes
    /// -----
    /// Where the shortest orthogonal row of the method's matrix is below ``damping`` times the longest, the step is damped; in front of a goal
    /// out of reach it is that of the posture nearest to it. No allocation but that
    /// of the result.
    #[pyo3(signature = (q, twist, out=None, *, frame=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        twist: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        frame: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let q = posture(self.solver.robot(), "q", q)?;
        let mut desired = [0.0; 6];
        read_vector("twist", twist, 6, &mut desired)?;
        let frame = solution::path_frame(&self.solver, frame, self.remembered().last.frame)?;
        self.tick(py, &q, &desired, frame, out)
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
        let (q, twist, frame) = solution::along(&self.solver, q, now, next, share)?;
        self.tick(py, &q, &twist, frame, out)
    }

    /// How the last `step` came about: "regular" (the twist is followed to rounding, as far as the task looks at it), "damped", "task only" (the secondary
    /// task could not be evaluated), "limited" (slowed down or held by limits) or "returning" (a joint is beyond a limit of position, or the tool outside
    /// the volume, and comes back).
    #[getter]
    fn status(&self) -> &'static str {
        self.remembered().last.status.name()
    }

    /// As `status`.
    #[getter]
    fn step_status(&self) -> &'static str {
        self.status()
    }

    /// The part of the twist that the last `step` did not follow, [omega; v] (6,) [rad/s, m/s], as far as the task looks at it.
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.remembered().last.deviation(py, &self.solver)
    }

    /// The small motion [rotation vector; translation] from the tool at ``q`` to the target [rad, m], as far as the task looks at it.
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

    /// Forgets the posture that a `PosturePull` remembers.
    fn reset(&self) {
        *self.remembered() = Remembered::nothing();
    }

    /// A posture on a target (Huo 2009, algorithm 3.1, with the task's own error in place of its line 6, which corrects an axis about which
    /// the tool may spin only linearly).
    ///
    /// Parameters
    /// ----------
    /// target : array_like
    ///     Axisymmetric: (6,), position [m] and axis direction; free rotation: (3,), position; else (12,), position and rotation matrix by
    ///     rows. Any task: (4, 4), a pose of the tool as `Robot.fk` answers it.
    /// q0 : array_like, shape (n,), optional
    ///     Start; if not given, the best of ``starts`` random postures: least objective, or nearest to the middle of the ranges.
    /// starts, seed : int
    ///     Number and seed of the random starts.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (n,)
    ///     Joint coordinates; the nearest found when unreachable (NaN when no start came near).
    /// value : float
    ///     Objective there, NaN without.
    /// status : str
    ///     "on target" or "unreachable".
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
    ///     Start. Where it is the end of the last chunk, the posture that a `PosturePull` remembers is kept.
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
        let n = self.solver.robot().n();
        let mut memory = {
            let before = self.remembered();
            if before.end[..n] == q[..n] { before.memory } else { Memory::default() }
        };
        let (found, end) = self.given.follow(py, &self.solver, &targets, &q, &mut memory)?;
        let mut remembered = self.remembered();
        (remembered.memory, remembered.end) = (memory, end);
        Ok(found)
    }

    /// The same solver with another secondary task: an Objective, a PosturePull or None.
    #[pyo3(signature = (objective=None))]
    fn with_objective(&self, py: Python<'_>, objective: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let solver = ok(self.solver.with_secondary(secondary(objective, self.solver.robot(), self.scaling)?))?;
        let given = self.given.with_objective(py, objective.map(|objective| objective.clone().unbind()));
        Ok(Self::of(solver, given, self.scaling))
    }
}
