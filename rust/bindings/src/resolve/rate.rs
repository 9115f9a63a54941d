//! `redundancy.TwistDecomposition` and its rivals: one base class, a subclass for each method.

use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Mutex, MutexGuard};

use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::array::{elements, ok, output, read_list, read_vector};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::resolve::secondary::{scaling, secondary};
use crate::resolve::solution::{self, Given, posture};
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::linalg::MAX_JOINTS;
use redundancy::resolve::{Memory, Method, RateSettings, RateSolver, Resolver, Scaling, StepStatus};

/// A method of redundancy resolution at the level of rates; the base class of `TwistDecomposition`, `ResolvedRate`, `GradientProjection`,
/// `WeightedInverse`, `TaskPriority`, `Householder`, `Elimination` and `VirtualJoint`.
#[pyclass(name = "RateSolver", subclass, frozen, module = "redundancy._core")]
pub struct PyRateSolver {
    solver: RateSolver,
    given: Given,
    scaling: Scaling,
    /// What is remembered from step to step and from chunk to chunk, and the posture at the end of the last chunk.
    memory: Mutex<(Memory, [f64; MAX_JOINTS])>,
    /// How the last step came about, by its number.
    last: AtomicU8,
}

impl PyRateSolver {
    fn of(solver: RateSolver, given: Given, scaling: Scaling) -> Self {
        Self { solver, given, scaling, memory: Mutex::new((Memory::default(), [f64::NAN; MAX_JOINTS])), last: AtomicU8::new(0) }
    }

    fn remembered(&self) -> MutexGuard<'_, (Memory, [f64; MAX_JOINTS])> {
        // What a panic of another thread left is still a posture.
        self.memory.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
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
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Rates [rad/s or m/s], never NaN; with ``limits``, within speed limits and never across a position limit within ``dt``: the free
    ///     motion gives way first, then all joints slow down together, then each stops at its limit. `step_status` tells how they came
    ///     about.
    ///
    /// Notes
    /// -----
    /// Where the shortest orthogonal row of the method's matrix is below ``damping`` times the longest, the step is damped. No allocation but that
    /// of the result.
    #[pyo3(signature = (q, twist, out=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        twist: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.solver.robot().n();
        let q = posture(self.solver.robot(), "q", q)?;
        let mut desired = [0.0; 6];
        read_vector("twist", twist, 6, &mut desired)?;
        let array = output(py, out, [n])?;
        let step = |memory: &mut Memory| self.solver.step(&q[..n], &desired, memory, elements(&array));
        let status = if self.given.calls_python {
            // Taken out, not held: a Python objective may let another thread in.
            let mut memory = self.remembered().0;
            let status = step(&mut memory);
            self.remembered().0 = memory;
            status
        } else {
            step(&mut self.remembered().0)
        };
        self.given.check(py)?;
        self.last.store(status as u8, Ordering::Relaxed);
        Ok(array)
    }

    /// How the last `step` came about: "regular", "damped", "task only" (the secondary task could not be evaluated) or "limited".
    #[getter]
    fn step_status(&self) -> &'static str {
        StepStatus::ALL[usize::from(self.last.load(Ordering::Relaxed))].name()
    }

    /// Forgets the posture that a `PosturePull` remembers.
    fn reset(&self) {
        *self.remembered() = (Memory::default(), [f64::NAN; MAX_JOINTS]);
    }

    /// A posture on a target (Huo 2009, algorithm 3.1, with the task's own error in place of its line 6, which corrects an axis about which
    /// the tool may spin only linearly).
    ///
    /// Parameters
    /// ----------
    /// target : array_like
    ///     Axisymmetric: (6,), position [m] and axis direction; free rotation: (3,), position; else (12,), position and rotation matrix by
    ///     rows.
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
    /// targets : array_like, shape (N, k)
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
        let (mut memory, end) = *self.remembered();
        if end[..n] != q[..n] {
            memory = Memory::default();
        }
        let (found, end) = self.given.follow(py, &self.solver, &targets, &q, &mut memory)?;
        *self.remembered() = (memory, end);
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

struct Arguments<'a, 'py> {
    robot: Py<PyRobot>,
    task: Py<PyTask>,
    objective: Option<&'a Bound<'py, PyAny>>,
    scaling: &'a str,
    length: Option<f64>,
    weights: Option<&'a Bound<'py, PyAny>>,
    settings: RateSettings,
}

fn make(py: Python<'_>, method: Method, given: Arguments<'_, '_>) -> PyResult<PyRateSolver> {
    let core = given.robot.get().robot.clone();
    let own = given.objective.and_then(|objective| objective.cast::<PyObjective>().ok()).and_then(|o| o.get().objective.length());
    let settings = RateSettings { length: given.length.or(own).unwrap_or(1.0), ..given.settings };
    let scaling = scaling(given.scaling)?;
    let secondary = secondary(given.objective, &core, scaling)?;
    let weights = given.weights.map(|weights| read_list("weights", weights)).transpose()?;
    let solver = ok(RateSolver::new(core, given.task.get().task, method, secondary, weights.as_deref(), settings))?;
    let task = if *solver.task() == given.task.get().task { given.task } else { Py::new(py, PyTask { task: *solver.task() })? };
    let objective = given.objective.map(|objective| objective.clone().unbind());
    Ok(PyRateSolver::of(solver, Given::new(py, given.robot, task, objective), scaling))
}

macro_rules! methods {
    ($($(#[$doc:meta])* $name:ident = $method:ident;)*) => {
        $(
            $(#[$doc])*
            ///
            /// Parameters
            /// ----------
            /// robot : Robot
            ///     The robot.
            /// task : Task
            ///     What the tool has to do.
            /// objective : Objective or PosturePull, optional
            ///     The secondary task; the shortest motion if not given.
            /// scaling : {"gradient", "newton"}
            ///     How the gradient of an Objective becomes a motion: as it is, or as a Newton step in the redundant subspace.
            /// gain : float
            ///     Factor of the secondary motion in `step` [1/s].
            /// relaxation : float
            ///     Factor of the secondary motion in an iteration of `solve` and `follow_chunk`.
            /// length : float, optional
            ///     Weighs angles against distances [m]. The objective's length, or 1, if not given.
            /// damping : float
            ///     Ratio of shortest to longest orthogonal row below which a system is solved with damping.
            /// dt : float
            ///     Length of a control tick [s].
            /// limits : bool
            ///     Whether `step` keeps position and speed limits, and random starts those of position.
            /// iterations : int
            ///     Iterations a target with the secondary task, at most.
            /// stop : float
            ///     The norm of the joint motion below which they end, epsilon of algorithm 3.1; that motion is not made [rad or m]. 0 makes
            ///     all of them.
            /// correct : bool
            ///     Whether iterations of the task alone follow until its error is below the tolerance, and a damped Newton from the start where
            ///     they lose their way.
            /// tolerance : float
            ///     That tolerance [rad, and m over length].
            /// weights : array_like, shape (n,), optional
            ///     Weights of the joints, for `WeightedInverse`; those of Chan and Dubey (1995) if not given.
            ///
            /// Raises
            /// ------
            /// InvalidValueError
            ///     If a setting is out of its domain.
            /// ShapeError
            ///     If the weights do not fit the robot.
            #[pyclass(extends = PyRateSolver, frozen, module = "redundancy._core")]
            pub struct $name;

            #[pymethods]
            impl $name {
                #[new]
                #[pyo3(signature = (robot, task, objective=None, *, scaling="gradient", gain=1.0, relaxation=1.0, length=None, damping=1e-3, dt=1e-3, limits=true,
                                    iterations=20, stop=0.0, correct=true, tolerance=1e-12, weights=None))]
                fn new(
                    py: Python<'_>,
                    robot: Py<PyRobot>,
                    task: Py<PyTask>,
                    objective: Option<&Bound<'_, PyAny>>,
                    scaling: &str,
                    gain: f64,
                    relaxation: f64,
                    length: Option<f64>,
                    damping: f64,
                    dt: f64,
                    limits: bool,
                    iterations: usize,
                    stop: f64,
                    correct: bool,
                    tolerance: f64,
                    weights: Option<&Bound<'_, PyAny>>,
                ) -> PyResult<PyClassInitializer<Self>> {
                    let settings = RateSettings { length: 1.0, gain, relaxation, damping, dt, limits, iterations, stop, correct, tolerance };
                    let given = Arguments { robot, task, objective, scaling, length, weights, settings };
                    Ok(PyClassInitializer::from(make(py, Method::$method, given)?).add_subclass(Self))
                }
            }
        )*
    };
}

methods! {
    /// Twist decomposition (Huo 2009, eq. 3.8): ``J^+ T t + J^+ (1 - T) J h``, and what the null space of J takes of h, so that functional and
    /// intrinsic redundancy are resolved together.
    TwistDecomposition = TwistDecomposition;
    /// Resolved rate without resolution (Huo 2009, eq. 2.24): ``J^+ t``, every component of the twist.
    ResolvedRate = ResolvedRate;
    /// Generalised inverse with gradient projection (Huo 2009, eq. 2.25) on the task's own Jacobian.
    GradientProjection = GradientProjection;
    /// Weighted generalised inverse (Huo 2009, eq. 2.38, 2.39).
    WeightedInverse = WeightedInverse;
    /// Task priority (Huo 2009, eq. 2.37): the free components of the twist second, the objective last.
    TaskPriority = TaskPriority;
    /// Householder scheme (Huo 2009, eq. 2.44 to 2.50): gradient projection without a generalised inverse.
    Householder = Householder;
    /// Elimination of the free velocities (Huo 2009, eq. 2.74, 2.75).
    Elimination = Elimination;
    /// Virtual joint along every free direction (Huo 2009, eq. 2.76 to 2.79).
    VirtualJoint = VirtualJoint;
}
