//! The classes of the methods at the level of rates: what they are made of is read once for all of them.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use crate::array::{ok, read_list};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::resolve::rate::PyRateSolver;
use crate::resolve::secondary::{scaling, secondary};
use crate::resolve::solution::Given;
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::resolve::{Method, RateSettings, RateSolver, Resolver};

/// What the classes of all methods are made of: their arguments are read by one function, as reading them is much machine code.
#[pyclass(frozen)]
struct Arguments {
    robot: Py<PyRobot>,
    task: Py<PyTask>,
    objective: Option<Py<PyAny>>,
    scaling: String,
    length: Option<f64>,
    weights: Option<Py<PyAny>>,
    settings: RateSettings,
}

#[pyfunction(name = "RateSolver")]
#[pyo3(signature = (robot, task, objective=None, *, scaling="gradient".into(), gain=1.0, relaxation=1.0, length=None, damping=1e-3, dt=1e-3, limits=true,
                    iterations=20, stop=0.0, correct=true, tolerance=1e-12, weights=None))]
fn arguments(
    robot: Py<PyRobot>,
    task: Py<PyTask>,
    objective: Option<Py<PyAny>>,
    scaling: String,
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
    weights: Option<Py<PyAny>>,
) -> Arguments {
    let settings = RateSettings { length: 1.0, gain, relaxation, damping, dt, limits, iterations, stop, correct, tolerance };
    Arguments { robot, task, objective, scaling, length, weights, settings }
}

#[inline(never)]
fn make(method: Method, given: &Bound<'_, PyTuple>, keywords: Option<&Bound<'_, PyDict>>) -> PyResult<PyRateSolver> {
    let py = given.py();
    let read = wrap_pyfunction!(arguments, py)?.call(given, keywords)?;
    let given = read.cast::<Arguments>().map_err(PyErr::from)?.get();
    let core = given.robot.get().robot.clone();
    let objective = given.objective.as_ref().map(|objective| objective.bind(py));
    let own = objective.and_then(|objective| objective.cast::<PyObjective>().ok()).and_then(|o| o.get().objective.length());
    let settings = RateSettings { length: given.length.or(own).unwrap_or(1.0), ..given.settings };
    let scaling = scaling(&given.scaling)?;
    let secondary = secondary(objective, &core, scaling)?;
    let weights = given.weights.as_ref().map(|weights| read_list("weights", weights.bind(py))).transpose()?;
    let task = given.task.clone_ref(py);
    let asked = *task.get().plain("a method at the level of rates")?;
    let solver = ok(RateSolver::new(core, asked, method, secondary, weights.as_deref(), settings))?;
    let task = if *solver.task() == asked { task } else { Py::new(py, PyTask::from(*solver.task()))? };
    let objective = objective.map(|objective| objective.clone().unbind());
    Ok(PyRateSolver::of(solver, Given::new(py, given.robot.clone_ref(py), task, objective), scaling))
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
                #[pyo3(signature = (*args, **settings), text_signature = "(robot, task, objective=None, *, scaling='gradient', gain=1.0, relaxation=1.0, \
                                    length=None, damping=1e-3, dt=1e-3, limits=True, iterations=20, stop=0.0, correct=True, tolerance=1e-12, weights=None)")]
                fn new(args: &Bound<'_, PyTuple>, settings: Option<&Bound<'_, PyDict>>) -> PyResult<PyClassInitializer<Self>> {
                    Ok(PyClassInitializer::from(make(Method::$method, args, settings)?).add_subclass(Self))
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
