//! `redundancy.QuadraticProgram`.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArrayDyn};
use pyo3::prelude::*;

use crate::array::{elements, ok, output, read_vector, vector};
use crate::collision::scene::PyScene;
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::resolve::quadratic_arguments::{Weights, read_constraints, read_derivatives, read_form};
use crate::resolve::quadratic_beside::{frame, read_beside, read_twists};
use crate::resolve::quadratic_state::{Shared, State};
use crate::resolve::solution::{self, Given, posture};
use crate::robot::PyRobot;
use crate::task::PyTask;
use redundancy::error::{Error, check_positive};
use redundancy::linalg::MAX_JOINTS;
use redundancy::qp::Row;
use redundancy::resolve::{Beside, Damper, Guard, Memory, Outcome, QuadraticSettings, QuadraticSolver, Resolver, Tick};

/// Resolution of the redundancy as a quadratic programme (Dufour and Suleiman 2020).
///
/// Each `step` minimises ``qd' Q qd / 2 + stiffness |t - J qd|^2 / 2 + (the worth of an index)`` (eq. 3, with the deviation ``delta = t - J qd``
/// in the objective) within limits of position, speed and acceleration, rows ``lower <= A qd <= upper`` and the distances to obstacles
/// (eq. A.1).
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot.
/// task : Task
///     What the tool has to do: any task, so that the free spin of a welding torch and the elbow of a seven-axis arm are one thing.
/// objective : Objective, optional
///     What is kept small beside the task: ``-1.0 * Manipulability(...)``, a ConditionNumber, any sum.
/// weight : float
///     Weight of the objective (alpha).
/// form : {"curvature", "equality", "printed"}
///     "curvature": ``weight (T g'qd + T^2 qd'H qd / 2)`` (eq. 10), and where that would take more than half the cost of the rates,
///     only what is convex of it; "printed": the same without that care, which is not convex for large weights; "equality":
///     ``weight (|value| + T g'qd)^2 / 2`` (eq. 14), convex whatever the weight.
/// derivatives : {"exact", "bfgs", "differences"}
///     Exact gradient and Hessian; exact gradient and the direct BFGS update (eq. 20, corrected); or differences of values (eq. 17, 19).
/// step : float, optional
///     Step of the differences [rad or m]; 1e-4 if not given.
/// rate_weights : float or array_like, shape (n,) or (n, n)
///     Q, the weight of the rates: one number, one a joint, or a symmetric positive definite matrix; 1 if not given.
/// stiffness : float or array_like, shape (6,) or (6, 6)
///     Q_delta, 1e4 if not given: the weight of the deviation delta = [omega; v] in the base frame at the tool point, as far as the task
///     looks at it: of ``|v|^2`` and of
///     ``length^2 |omega|^2``, or one weight a component, or a symmetric positive definite matrix, in which case ``length`` weighs nothing.
///     A number that a step gives replaces this one, and multiplies weights that are more than a number.
/// largest_deviation : array_like, shape (2,), (6,) or (2, 6), optional
///     Bounds of the deviation, which give way before rows do: the largest angular [rad/s] and linear [m/s] one of any component of the task; or that
///     of each component of [omega; v] in the base frame; or their lower bounds, at most 0, and their upper ones. Infinite for none.
/// jerk : float or array_like, shape (n,), optional
///     Limits of jerk [rad/s^3 or m/s^3], where ``limits`` hold. They yield to limits of position, speed and acceleration, in this order.
/// length : float, optional
///     Weighs angular deviations against linear ones [m]. 1 if not given.
/// dt : float
///     Length of a tick [s].
/// limits : bool
///     Whether limits of position, speed and acceleration hold.
/// scene : Scene, optional
///     Bodies of the robot, and obstacles.
/// influence, security : float
///     Distances [m] below which a pair is looked at, and which no pair may fall short of.
/// damping : float
///     Speed at which a distance may fall at the influence distance [m/s]; in proportion below.
/// tolerance : float
///     Deviation, as a part of the twist, up to which the task counts as kept.
/// beside : sequence of PostureTask and FrameTask, optional
///     What counts beside the task: a posture that the joints are drawn to, tasks of other frames of the arm.
///
/// Raises
/// ------
/// InvalidValueError
///     If a setting is out of its domain.
/// ShapeError
///     If the weights do not fit the robot.
#[pyclass(name = "QuadraticProgram", frozen, module = "redundancy._core")]
pub struct PyQuadraticProgram {
    solver: QuadraticSolver,
    given: Given,
    guard: Option<(Py<PyScene>, Damper)>,
    /// What is remembered from step to step, and what came of the last one.
    state: Mutex<State>,
}

impl PyQuadraticProgram {
    fn state(&self) -> MutexGuard<'_, State> {
        // What a panic of another thread left is still a state.
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// One tick on a state, which it leaves where it lies.
    fn tick(&self, tick: &Tick<'_>, state: &mut State, rates: &mut [f64]) -> redundancy::error::Result<Outcome> {
        match (&self.guard, &mut state.near) {
            (Some((scene, damper)), Some(near)) => {
                let mut guard = Guard { scene: &mut Shared(scene.get()), damper: *damper, near };
                guard.step(&self.solver, tick, &mut state.memory, rates)
            }
            _ => Ok(self.solver.step(tick, &mut state.memory, rates)),
        }
    }

    /// The weight of the deviation in a tick.
    fn stiffness(&self, given: Option<f64>) -> PyResult<f64> {
        ok(given.map_or(Ok(self.solver.settings().stiffness), |value| check_positive("stiffness", value)))
    }

    /// One tick, after the rates `before` where these are given.
    fn run(&self, py: Python<'_>, tick: &Tick<'_>, before: Option<[f64; MAX_JOINTS]>, rates: &mut [f64]) -> PyResult<()> {
        let run = |state: &mut State, rates: &mut [f64]| {
            state.memory.rates = before.or(state.memory.rates);
            state.outcome = self.tick(tick, state, rates)?;
            state.own = tick.rows.len();
            if !self.solver.beside().is_empty() {
                state.beside = Some((tick.q.to_vec(), tick.twists.to_vec()));
            }
            Ok(())
        };
        if self.given.calls_python {
            // Taken out, not held: a Python objective may let another thread in.
            let mut state = self.state().clone();
            ok(run(&mut state, rates))?;
            *self.state() = state;
        } else {
            ok(run(&mut self.state(), rates))?;
        }
        self.given.check(py)
    }
}

#[pymethods]
impl PyQuadraticProgram {
    #[new]
    #[pyo3(signature = (robot, task, objective=None, *, weight=1.0, form="curvature", derivatives="exact", step=None, rate_weights=None,
                        stiffness=None, largest_deviation=None, jerk=None, length=1.0, dt=1e-3, limits=true, scene=None, influence=0.1,
                        security=0.02, damping=0.5, tolerance=1e-3, beside=None))]
    fn new(
        py: Python<'_>,
        robot: Py<PyRobot>,
        task: Py<PyTask>,
        objective: Option<&Bound<'_, PyAny>>,
        weight: f64,
        form: &str,
        derivatives: &str,
        step: Option<f64>,
        rate_weights: Option<&Bound<'_, PyAny>>,
        stiffness: Option<&Bound<'_, PyAny>>,
        largest_deviation: Option<&Bound<'_, PyAny>>,
        jerk: Option<&Bound<'_, PyAny>>,
        length: f64,
        dt: f64,
        limits: bool,
        scene: Option<Py<PyScene>>,
        influence: f64,
        security: f64,
        damping: f64,
        tolerance: f64,
        beside: Option<Vec<Bound<'_, PyAny>>>,
    ) -> PyResult<Self> {
        let core = robot.get().robot.clone();
        let n = core.n();
        let mut settings = QuadraticSettings { length, dt, limits, tolerance, ..QuadraticSettings::default() };
        let index = objective.map(|given| Ok::<_, PyErr>((given.cast::<PyObjective>()?.get().objective.clone(), weight))).transpose()?;
        let guard = match scene {
            None => None,
            Some(scene) => {
                if !scene.get().lock().robot().is_same_chain(&core) {
                    return Err(Error::value("scene", "that of another robot", "bodies of this robot").into());
                }
                Some((scene, ok(Damper::new(influence, security, damping))?))
            }
        };
        let (form, derivatives, task_of) = (read_form(form)?, read_derivatives(derivatives, step)?, *task.get().plain("QuadraticProgram")?);
        let rest = Weights { rate_weights, stiffness, largest_deviation, jerk }.apply(&mut settings, n)?;
        let mut solver = ok(QuadraticSolver::new(core, task_of, index, form, derivatives, settings))?;
        ok(rest.give(&mut solver))?;
        if let Some(beside) = beside.filter(|beside| !beside.is_empty()) {
            ok(solver.set_beside(read_beside(&beside)?))?;
        }
        let state = Mutex::new(State::new(guard.is_some()));
        let given = Given::new(py, robot, task, objective.map(|objective| objective.clone().unbind()));
        Ok(Self { solver, given, guard, state })
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

    /// The objective, if any.
    #[getter]
    fn objective(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.given.objective.as_ref().map(|objective| objective.clone_ref(py))
    }

    /// The scene, if any.
    #[getter]
    fn scene(&self, py: Python<'_>) -> Option<Py<PyScene>> {
        self.guard.as_ref().map(|(scene, _)| scene.clone_ref(py))
    }

    /// Length that weighs angles against distances [m].
    #[getter]
    fn length(&self) -> f64 {
        self.solver.settings().length
    }

    /// Length of a tick [s].
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
    ///     Desired twist [omega; v] of the tool point in the base frame [rad/s, m/s]; its free components are not looked at.
    /// out : ndarray, shape (n,), optional
    ///     Receives the result.
    /// stiffness : float, optional
    ///     Weight of the squared deviation in this tick, as of `stiffness_profile`; the solver's if not given.
    /// rates : array_like, shape (n,), optional
    ///     Rates of the tick before, from which accelerations count [rad/s or m/s]; those that the last step answered if not given,
    ///     none after `reset`.
    /// rows : array_like, shape (m, n), optional
    ///     A of ``lower <= A qd <= upper``, at most 32 rows.
    /// lower, upper : array_like, shape (m,), optional
    ///     Their limits; infinite if not given.
    /// twists : array_like, shape (K, 6), optional
    ///     Twists [omega; v] of the K frames beside the task, in their order, at their origins in the base frame [rad/s, m/s]; the frames do not count
    ///     where none are given.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     Rates [rad/s or m/s]: always finite and within the limits of the joints. `status`, `deviation`, `failed` and `near` tell how
    ///     they came about.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError, InvalidValueError
    ///     If an array has the wrong shape, a number is not finite, or a limit of a row is infinite on the side that nothing can meet.
    ///
    /// Notes
    /// -----
    /// Where not everything can be kept, the task gives way first, then its largest deviation, by little, then all rows by the same least
    /// amount. Limits of joints never give way. Beyond a position limit a joint moves back, with a quarter
    /// of its speed limit at least (0.5 rad/s or m/s where it has none), as far as its acceleration allows. At a singularity of the task the programme is as convex as anywhere;
    /// where the objective itself is singular the step goes without it. No allocation but that of the result and of the rows.
    #[pyo3(signature = (q, twist, out=None, *, stiffness=None, rates=None, rows=None, lower=None, upper=None, twists=None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        twist: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        stiffness: Option<f64>,
        rates: Option<&Bound<'py, PyAny>>,
        rows: Option<&Bound<'py, PyAny>>,
        lower: Option<&Bound<'py, PyAny>>,
        upper: Option<&Bound<'py, PyAny>>,
        twists: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.solver.robot().n();
        let q = posture(self.solver.robot(), "q", q)?;
        let mut desired = [0.0; 6];
        read_vector("twist", twist, 6, &mut desired)?;
        let stiffness = self.stiffness(stiffness)?;
        let twists = twists.map_or_else(|| Ok(Vec::new()), |twists| read_twists(&self.solver, twists))?;
        let (rows, lower, upper) = read_constraints(rows, lower, upper, n)?;
        let before = rates.map(|rates| posture(self.solver.robot(), "rates", rates)).transpose()?;
        let array = output(py, out, [n])?;
        let rows: Vec<Row<'_>> = lower
            .iter()
            .zip(&upper)
            .enumerate()
            .map(|(k, (lower, upper))| Row { a: &rows[k * n..(k + 1) * n], lower: *lower, upper: *upper })
            .collect();
        self.run(py, &Tick { q: &q[..n], twist: desired, stiffness, rows: &rows, twists: &twists }, before, elements(&array))?;
        Ok(array)
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
    /// stiffness, rates
    ///     As for `step`.
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
    #[pyo3(signature = (q, now, next, out=None, *, share=1.0, stiffness=None, rates=None))]
    fn step_along<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        now: &Bound<'py, PyAny>,
        next: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
        share: f64,
        stiffness: Option<f64>,
        rates: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let n = self.solver.robot().n();
        let (q, twist) = solution::along(&self.solver, q, now, next, share)?;
        let stiffness = self.stiffness(stiffness)?;
        let before = rates.map(|rates| posture(self.solver.robot(), "rates", rates)).transpose()?;
        let array = output(py, out, [n])?;
        self.run(py, &Tick { q: &q[..n], twist, stiffness, rows: &[], twists: &[] }, before, elements(&array))?;
        Ok(array)
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
    /// q : array_like, shape (n,) or (N, n)
    ///     Joint coordinates [rad or m].
    /// target : array_like
    ///     As for `error`.
    /// beside : int, optional
    ///     The place of a FrameTask in what counts beside the task, which then is what the target is for, and has to be one; the tool if not given.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6,) or (N, 6)
    ///     [omega; v] in the base frame [rad/s, m/s].
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If there is no FrameTask at that place, or the target is none.
    #[pyo3(signature = (q, target, beside=None))]
    fn twist_to<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        target: &Bound<'py, PyAny>,
        beside: Option<usize>,
    ) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let Some(k) = beside else { return solution::error(py, &self.solver, q, target, self.solver.dt()) };
        let frame = frame(&self.solver, k)?;
        let (q, n) = (posture(self.solver.robot(), "q", q)?, self.solver.robot().n());
        let error = self.solver.error_beside(frame, &solution::target(&frame.task, "target", target)?, &q[..n]);
        let array = output(py, None, [6])?;
        elements(&array).copy_from_slice(&error.map(|error| error / self.solver.dt()));
        Ok(array)
    }

    /// How the last `step` ended: "solved" (the deviation is at most ``tolerance`` times the twist, as far as the task looks at them, with angles times the
    /// length), "relaxed" (the task gave way to rows, obstacles, the cost of the rates or the worth of the objective), "limited" (to limits of
    /// joints), "returning" (a joint is beyond a limit of position and comes back), "infeasible" (rows exclude each other or the limits: they failed by as little as can be), or "not convex" (the printed
    /// form, which then goes without the objective).
    #[getter]
    fn status(&self) -> &'static str {
        self.state().outcome.status.name()
    }

    /// The part of the twist that the last `step` did not follow, [omega; v] (6,) [rad/s, m/s].
    #[getter]
    fn deviation<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.state().outcome.deviation)
    }

    /// What the last `step` left undone beside the task, in the order of ``beside``: of a posture the rates that are missing (n,), of a frame the part of its
    /// twist that it does not follow, [omega; v] (6,), zero where none was given. Nothing before the first step.
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<f64>>> {
        let state = self.state();
        let (Some((q, twists)), Some(rates)) = (&state.beside, &state.memory.rates) else { return Vec::new() };
        let mut twists = twists.iter();
        let each = |one: &Beside| {
            let twist = if matches!(one, Beside::Frame(_)) { twists.next() } else { None };
            let asked = twist.is_some() || matches!(one, Beside::Posture(_));
            let (left, size) = self.solver.deviation_beside(one, q, twist.unwrap_or(&[0.0; 6]), &rates[..q.len()]);
            if asked { vector(py, &left[..size]) } else { vector(py, &[0.0; 6]) }
        };
        self.solver.beside().iter().map(each).collect()
    }

    /// What failed in the last `step`: "row 2", the names of the pair that falls short of what its distance asks for, or "largest_deviation".
    #[getter]
    fn failed(&self) -> Vec<String> {
        let (own, outcome, pairs) = {
            let state = self.state();
            (state.own, state.outcome, state.pairs().iter().map(|pair| pair.pair).collect::<Vec<_>>())
        };
        let names = self.guard.as_ref().map(|(scene, _)| scene.get().lock());
        let name = |k: usize| match &names {
            Some(scene) if k >= own => PyScene::name_of(scene, pairs[k - own]).join(" and "),
            _ => format!("row {k}"),
        };
        let rows = (0..own + pairs.len()).filter(|k| outcome.failed >> k & 1 == 1).map(name);
        rows.chain(outcome.beyond_deviation.then(|| "largest_deviation".into())).collect()
    }

    /// Smallest distance between the pairs that were looked at in the last `step`, at the posture it was given [m]; infinite where none was near.
    #[getter]
    fn distance(&self) -> f64 {
        self.state().pairs().iter().map(|pair| pair.distance).fold(f64::INFINITY, f64::min)
    }

    /// Whether the objective could be evaluated in the last `step`.
    #[getter]
    fn conditioned(&self) -> bool {
        self.state().outcome.conditioned
    }

    /// Constraints that the last programme added or dropped.
    #[getter]
    fn changes(&self) -> usize {
        self.state().outcome.changes
    }

    /// Forgets the rates of the tick before, what BFGS knows, and the active constraints.
    fn reset(&self) {
        *self.state() = State::new(self.guard.is_some());
    }

    /// A posture on a target: steps with the objective, without obstacles and speed limits, then Newton onto the target.
    ///
    /// Parameters
    /// ----------
    /// target : array_like
    ///     Axisymmetric: (6,), position [m] and axis direction; free rotation: (3,), position; else (12,), position and rotation matrix by
    ///     rows. Any task: (4, 4), a pose of the tool as `Robot.fk` answers it.
    /// q0 : array_like, shape (n,), optional
    ///     Start; if not given, the best of ``starts`` random postures.
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
