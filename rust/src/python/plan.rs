//! The planner's parts: lattice, route, refinement, bound. `redundancy.plan` puts them together.

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use super::array::{elements, ok, output, read_any, read_list, read_vector, vector};
use super::objective::PyObjective;
use super::robot::PyRobot;
use super::solution;
use super::task::PyTask;
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::plan::{
    Criterion, Graph, Kind, Lattice, PathProblem, RefineStatus, Refined, Search, SpinRange, find_route, least_value, onto_path, refine,
    wide_joints,
};
use crate::robot::{Limits, Robot};
use crate::task::{Target, Task};
use crate::with_capacity;

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
type Causes<'py> = Bound<'py, PyArrayDyn<u8>>;

fn criterion(name: &str) -> Result<Criterion> {
    match name {
        "minimax" => Ok(Criterion::Minimax),
        "integral" => Ok(Criterion::Integral),
        _ => Err(Error::value("criterion", format!("{name:?}"), "\"minimax\" or \"integral\"")),
    }
}

/// Postures at every point of a path, over a grid of spins and of the joints to spare.
#[pyclass(name = "Lattice", frozen, module = "redundancy._core")]
pub struct PyLattice {
    lattice: Lattice,
    objective: Option<Py<PyObjective>>,
}

impl PyLattice {
    fn check(&self) -> PyResult<()> {
        self.objective.as_ref().map_or(Ok(()), |objective| objective.get().check())
    }

    fn range(&self, first: usize, count: usize) -> PyResult<()> {
        if first + count <= self.lattice.points() && count > 0 {
            return Ok(());
        }
        Err(Error::value("points", format!("{first} to {}", first + count), &format!("within 0 to {}", self.lattice.points())).into())
    }
}

#[pymethods]
impl PyLattice {
    /// A lattice.
    ///
    /// Parameters
    /// ----------
    /// robot : Robot
    ///     The robot.
    /// frames : array_like, shape (N, 4, 4)
    ///     Tool frames at spin 0.
    /// axis : array_like, shape (3,)
    ///     Axis of the spin in the tool frame.
    /// angles : array_like, shape (A,)
    ///     Spins [rad].
    /// spare : list of int
    ///     Joints that are held, counted from 0; six revolute ones have to be left.
    /// values : array_like, shape (S, k)
    ///     Coordinates at which they are held.
    /// objective : Objective, optional
    ///     What cells are worth; 0 if not given.
    /// limits : bool
    ///     Whether postures beyond the position limits are out.
    #[new]
    #[pyo3(signature = (robot, frames, axis, angles, spare, values, objective=None, limits=true))]
    fn new(
        py: Python<'_>,
        robot: &PyRobot,
        frames: &Bound<'_, PyAny>,
        axis: &Bound<'_, PyAny>,
        angles: &Bound<'_, PyAny>,
        spare: Vec<usize>,
        values: &Bound<'_, PyAny>,
        objective: Option<Py<PyObjective>>,
        limits: bool,
    ) -> PyResult<Self> {
        let frames = read_frames(frames)?;
        let mut direction = [0.0; 3];
        read_vector("axis", axis, 3, &mut direction)?;
        let angles = read_list("angles", angles)?;
        ok(check_finite("angles", &angles))?;
        let (numbers, _) = read_any("values", values)?;
        let rows: Vec<Vec<f64>> =
            if spare.is_empty() { vec![Vec::new()] } else { numbers.chunks(spare.len()).map(<[f64]>::to_vec).collect() };
        let terms = objective.as_ref().map(|objective| objective.bind(py).get().objective.clone());
        let lattice = Lattice::new(robot.robot.clone(), frames, direction, &angles, &spare, &rows, terms, limits);
        Ok(Self { lattice: ok(lattice)?, objective })
    }

    /// Values of the spare joints, angles and branches: the shape of one point's cells.
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        (self.lattice.slices(), self.lattice.angles(), self.lattice.branches())
    }

    /// Whether branches are the same from cell to cell.
    #[getter]
    fn named(&self) -> bool {
        self.lattice.has_branches()
    }

    /// Postures (count, cells, n), values and causes (count, cells) of some points.
    fn postures<'py>(&self, py: Python<'py>, first: usize, count: usize) -> PyResult<(Array<'py>, Array<'py>, Causes<'py>)> {
        self.range(first, count)?;
        let (cells, n) = (self.lattice.cells(), self.lattice.robot().n());
        let q = output(py, None, [count, cells, n])?;
        let value = output(py, None, [count, cells])?;
        let mut cause = vec![0u8; count * cells];
        let (q_out, value_out) = (elements(&q), elements(&value));
        py.detach(|| {
            q_out.fill(f64::NAN);
            self.lattice.fill(first, q_out, value_out, &mut cause);
        });
        self.check()?;
        Ok((q, value, PyArray1::from_vec(py, cause).reshape([count, cells])?.to_dyn().clone()))
    }

    /// Values and causes (count, cells) of some points; postures are not kept.
    fn survey<'py>(&self, py: Python<'py>, first: usize, count: usize) -> PyResult<(Array<'py>, Causes<'py>)> {
        self.range(first, count)?;
        let cells = self.lattice.cells();
        let value = output(py, None, [count, cells])?;
        let mut cause = vec![0u8; count * cells];
        let value_out = elements(&value);
        py.detach(|| self.lattice.survey(first, value_out, &mut cause));
        self.check()?;
        Ok((value, PyArray1::from_vec(py, cause).reshape([count, cells])?.to_dyn().clone()))
    }

    /// The joint that is least beyond its limit at a point, over all postures, and by how much [rad or m]; None where there is no posture.
    fn nearest_to_limits(&self, point: usize) -> PyResult<Option<(usize, f64)>> {
        self.range(point, 1)?;
        Ok(self.lattice.nearest_to_limits(point))
    }
}

/// What a route was found to be: postures (k, n), cells (k,), cost, and what blocks the next layer: joint and excess.
type RouteFound<'py> = (Array<'py>, Vec<usize>, f64, Option<(usize, f64)>);

/// The best route through the layers of a lattice.
///
/// Parameters
/// ----------
/// robot : Robot
///     Its limits decide about whole turns.
/// q : ndarray, shape (M, cells, n)
///     Postures.
/// value, cause : ndarray, shape (M, cells)
///     Their values, and why they are out (0: they are not).
/// shape : tuple of int
///     Spare values, angles, branches.
/// named : bool
///     Whether branches are the same from cell to cell.
/// weights, steps : array_like, shape (M,), (M - 1,)
///     Share of the path of each layer, and from each to the next.
/// bounds : array_like, shape (M - 1, n)
///     Largest motions [rad or m]; infinite for none.
/// criterion : {"minimax", "integral"}
///     What is minimised.
/// smoothness : float
///     Weight of the integral of the squared joint speed.
/// window, slice_window : int
///     Cells of spin and of spare joints that may be crossed from layer to layer.
/// around : bool
///     Whether the angles close a turn.
/// branch_step : float
///     Largest motion of a joint where the branch changes [rad or m]; 0 forbids it.
/// slack : float
///     What the worst value may exceed its minimum by, relative, for the sake of motion (minimax).
/// limits, closed : bool
///     Whether position limits hold, and whether the last layer is the first.
#[pyfunction(name = "find_route")]
pub fn find_route_py<'py>(
    py: Python<'py>,
    robot: &PyRobot,
    q: &Bound<'py, PyAny>,
    value: &Bound<'py, PyAny>,
    cause: Bound<'py, PyArrayDyn<u8>>,
    shape: (usize, usize, usize),
    named: bool,
    weights: &Bound<'py, PyAny>,
    steps: &Bound<'py, PyAny>,
    bounds: &Bound<'py, PyAny>,
    criterion: &str,
    smoothness: f64,
    window: usize,
    slice_window: usize,
    around: bool,
    branch_step: f64,
    slack: f64,
    limits: bool,
    closed: bool,
) -> PyResult<RouteFound<'py>> {
    let robot = &robot.robot;
    let (q, _) = read_any("q", q)?;
    let (value, _) = read_any("value", value)?;
    let cause: Vec<u8> =
        cause.try_readonly().map_err(|e| PyErr::from(Error::value("cause", e, "a readable array")))?.as_array().iter().copied().collect();
    let (weights, steps) = (read_list("weights", weights)?, read_list("steps", steps)?);
    let (bounds, _) = read_any("bounds", bounds)?;
    let cells = shape.0 * shape.1 * shape.2;
    let (n, layers) = (robot.n(), weights.len());
    let expected = [("q", q.len(), layers * cells * n), ("value", value.len(), layers * cells), ("cause", cause.len(), layers * cells)];
    for (name, got, wanted) in expected.into_iter().chain([("steps", steps.len(), layers - 1), ("bounds", bounds.len(), (layers - 1) * n)])
    {
        if got != wanted {
            return Err(Error::Shape { name: name.into(), got: format!("{got} numbers"), expected: format!("{wanted}") }.into());
        }
    }
    let graph = Graph {
        n,
        slices: shape.0,
        angles: shape.1,
        branches: shape.2,
        named,
        copies: 1,
        q,
        value,
        cause,
        wide: wide_joints(robot, limits),
        weights,
        steps,
        bounds,
    };
    let search = Search { criterion: ok(self::criterion(criterion))?, smoothness, window, slice_window, around, branch_step, slack };
    let found = py.detach(|| find_route(&graph, &search, limits.then(|| robot.limits()), closed));
    let array = output(py, None, [found.cells.len(), n])?;
    elements(&array).copy_from_slice(&found.q);
    Ok((array, found.cells, found.cost, found.blockage.map(|b| (b.joint, b.excess))))
}

/// The numbers of a path problem, owned.
struct Owned {
    targets: Vec<Target>,
    weights: Vec<f64>,
    steps: Vec<f64>,
    bounds: Vec<f64>,
    turns: Option<Vec<f64>>,
    length: f64,
    spin: Option<OwnedSpin>,
}

/// Frames at spin 0, axis and range of a spin.
type OwnedSpin = (Vec<Frame>, [f64; 3], (f64, f64));

/// What Python gives of it: frames (N, 4, 4), axis, least and largest spin.
type GivenSpin<'py> = (Bound<'py, PyAny>, [f64; 3], f64, f64);

fn read_spin(spin: Option<GivenSpin<'_>>, points: usize) -> PyResult<Option<OwnedSpin>> {
    let Some((frames, axis, low, high)) = spin else { return Ok(None) };
    let frames = read_frames(&frames)?;
    if frames.len() != points {
        return Err(Error::length("spin", frames.len(), points).into());
    }
    Ok(Some((frames, axis, (low, high))))
}

fn spin_range(owned: &OwnedSpin) -> SpinRange<'_> {
    SpinRange { frames: &owned.0, axis: owned.1, range: owned.2 }
}

fn read_frames(frames: &Bound<'_, PyAny>) -> PyResult<Vec<Frame>> {
    let (numbers, _) = read_any("frames", frames)?;
    ok(numbers.chunks(16).map(|matrix| Frame::from_matrix("frames", matrix)).collect())
}

/// Postures and values, cost, residual, gap, iterations, status, and the tightest constraint: kind, point, joint.
type PathRefined<'py> = (Array<'py>, Bound<'py, PyArray1<f64>>, f64, f64, f64, usize, &'static str, Option<(&'static str, usize, usize)>);

/// Refines a path of postures.
///
/// Parameters
/// ----------
/// robot, task : Robot, Task
///     Robot and task.
/// targets : array_like, shape (N, k)
///     Targets of the task; without the last one, which is the first, when closed.
/// q : array_like, shape (N, n)
///     Postures near the optimum.
/// objective : Objective or None
///     What is minimised; motion alone if None.
/// criterion : {"minimax", "integral"}
///     Worst value or integral.
/// smoothness : float
///     Weight of the integral of the squared joint speed.
/// weights, steps, bounds : array_like
///     As for `find_route`; one step more than gaps when closed.
/// limits : bool
///     Whether position limits hold.
/// turns : array_like, shape (n,), optional
///     Given for a closed path: whole turns from the last posture to the first [rad].
/// length : float
///     Weighs angles against distances [m].
/// max_iterations : int
///     Newton steps at most.
/// spin : tuple, optional
///     Range of the spin: frames at spin 0 (N, 4, 4), axis in the tool frame, least and largest spin [rad].
#[pyfunction]
#[pyo3(signature = (robot, task, targets, q, objective, criterion, smoothness, weights, steps, bounds, limits, turns, length, max_iterations, spin=None))]
pub fn refine_path<'py>(
    py: Python<'py>,
    robot: &PyRobot,
    task: &PyTask,
    targets: &Bound<'py, PyAny>,
    q: &Bound<'py, PyAny>,
    objective: Option<&PyObjective>,
    criterion: &str,
    smoothness: f64,
    weights: &Bound<'py, PyAny>,
    steps: &Bound<'py, PyAny>,
    bounds: &Bound<'py, PyAny>,
    limits: bool,
    turns: Option<&Bound<'py, PyAny>>,
    length: f64,
    max_iterations: usize,
    spin: Option<GivenSpin<'py>>,
) -> PyResult<PathRefined<'py>> {
    let targets = solution::targets(&task.task, targets)?;
    let owned = Owned {
        spin: read_spin(spin, targets.len())?,
        targets,
        weights: read_list("weights", weights)?,
        steps: read_list("steps", steps)?,
        bounds: read_any("bounds", bounds)?.0,
        turns: turns.map(|turns| read_list("turns", turns)).transpose()?,
        length,
    };
    let n = robot.robot.n();
    let (rows, _) = read_any("q", q)?;
    ok(check_finite("q", &rows))?;
    let (points, gaps) = (owned.targets.len(), owned.targets.len() - usize::from(owned.turns.is_none()));
    for (name, got, expected) in [
        ("q", rows.len(), points * n),
        ("weights", owned.weights.len(), points),
        ("steps", owned.steps.len(), gaps),
        ("bounds", owned.bounds.len(), gaps * n),
    ] {
        if got != expected {
            return Err(Error::Shape { name: name.into(), got: format!("{got} numbers"), expected: format!("{expected}") }.into());
        }
    }
    let terms = objective.map(|objective| objective.objective.clone());
    let unlimited = ok(robot.robot.with_limits(Limits::none(n)))?;
    let problem = PathProblem {
        robot: &robot.robot,
        unlimited: &unlimited,
        task: task.task,
        targets: &owned.targets,
        objective: terms.as_ref(),
        criterion: ok(self::criterion(criterion))?,
        smoothness,
        weights: &owned.weights,
        steps: &owned.steps,
        bounds: &owned.bounds,
        limits,
        closed: owned.turns.as_deref(),
        length: owned.length,
        spin: owned.spin.as_ref().map(spin_range),
    };
    let (rows, values, rest) = py.detach(|| with_capacity!(n, refined(&problem, &rows, max_iterations)));
    objective.map_or(Ok(()), PyObjective::check)?;
    let array = output(py, None, [points, n])?;
    elements(&array).copy_from_slice(&rows);
    Ok((array, vector(py, &values), rest.cost, rest.residual, rest.gap, rest.iterations, rest.status, rest.tightest))
}

struct Rest {
    cost: f64,
    residual: f64,
    gap: f64,
    iterations: usize,
    status: &'static str,
    tightest: Option<(&'static str, usize, usize)>,
}

fn refined<const C: usize>(problem: &PathProblem<'_>, rows: &[f64], max_iterations: usize) -> (Vec<f64>, Vec<f64>, Rest) {
    let n = problem.n();
    let start = rows.chunks_exact(n).map(padded).collect();
    let found: Refined<C> = refine(problem, start, max_iterations);
    let status = match found.status {
        RefineStatus::Converged => "converged",
        RefineStatus::Stopped => "stopped",
        RefineStatus::Infeasible => "infeasible",
        RefineStatus::Singular => "singular",
    };
    let kind = |kind: Kind| match kind {
        Kind::Position => "joint limit",
        Kind::Motion => "speed limit",
        Kind::Spin => "spin range",
        Kind::Value | Kind::Widening => "value",
    };
    let tightest = found.tightest.map(|c| (kind(c.kind), c.point, c.joint));
    let rest = Rest { cost: found.cost, residual: found.residual, gap: found.gap, iterations: found.iterations, status, tightest };
    (found.q.iter().flat_map(|q| &q[..n]).copied().collect(), found.values, rest)
}

/// The least value at one target, from postures (k, n) with their values (k,), the best of which are brought to their minima.
#[pyfunction(name = "least_value")]
#[pyo3(signature = (robot, task, target, postures, values, objective, limits, length, spin=None))]
pub fn least_value_py<'py>(
    py: Python<'py>,
    robot: &PyRobot,
    task: &PyTask,
    target: &Bound<'py, PyAny>,
    postures: &Bound<'py, PyAny>,
    values: &Bound<'py, PyAny>,
    objective: &PyObjective,
    limits: bool,
    length: f64,
    spin: Option<GivenSpin<'py>>,
) -> PyResult<f64> {
    let spin = read_spin(spin, 1)?;
    let target = [solution::target(&task.task, target)?];
    let (postures, values) = (read_any("postures", postures)?.0, read_list("values", values)?);
    let n = robot.robot.n();
    if postures.len() != n * values.len() {
        return Err(Error::Shape {
            name: "postures".into(),
            got: format!("{} numbers", postures.len()),
            expected: format!("{}", n * values.len()),
        }
        .into());
    }
    let unlimited = ok(robot.robot.with_limits(Limits::none(n)))?;
    let found = py.detach(|| {
        with_capacity!(
            n,
            least((&robot.robot, &unlimited), task.task, &target, &postures, &values, &objective.objective, limits, length, spin.as_ref())
        )
    });
    objective.check()?;
    Ok(found)
}

fn least<const C: usize>(
    (robot, unlimited): (&Robot, &Robot),
    task: Task,
    target: &[Target],
    postures: &[f64],
    values: &[f64],
    objective: &crate::index::Objective,
    limits: bool,
    length: f64,
    spin: Option<&OwnedSpin>,
) -> f64 {
    let problem = PathProblem {
        robot,
        unlimited,
        task,
        targets: target,
        objective: Some(objective),
        criterion: Criterion::Integral,
        smoothness: 0.0,
        weights: &[1.0],
        steps: &[],
        bounds: &[],
        limits,
        closed: None,
        length,
        spin: spin.map(spin_range),
    };
    least_value::<C>(&problem, postures, values)
}

/// Brings postures onto a path, each by Newton: postures (N, n), and whether each got there (N,).
#[pyfunction]
pub fn restore_path<'py>(
    py: Python<'py>,
    robot: &PyRobot,
    task: &PyTask,
    targets: &Bound<'py, PyAny>,
    q: &Bound<'py, PyAny>,
    length: f64,
) -> PyResult<(Array<'py>, Bound<'py, PyArray1<bool>>)> {
    let targets = solution::targets(&task.task, targets)?;
    let n = robot.robot.n();
    let (mut rows, _) = read_any("q", q)?;
    ok(check_finite("q", &rows))?;
    if rows.len() != targets.len() * n {
        return Err(
            Error::Shape { name: "q".into(), got: format!("{} numbers", rows.len()), expected: format!("{}", targets.len() * n) }.into()
        );
    }
    let unlimited = ok(robot.robot.with_limits(Limits::none(n)))?;
    let reached = py.detach(|| with_capacity!(n, restored(&unlimited, task.task, &targets, &mut rows, length)));
    let array = output(py, None, [targets.len(), n])?;
    elements(&array).copy_from_slice(&rows);
    Ok((array, PyArray1::from_vec(py, reached)))
}

fn restored<const C: usize>(robot: &Robot, task: Task, targets: &[Target], rows: &mut [f64], length: f64) -> Vec<bool> {
    let n = robot.n();
    let mut q: Vec<[f64; C]> = rows.chunks_exact(n).map(padded).collect();
    let reached = onto_path(robot, &task, targets, length, &mut q);
    rows.chunks_exact_mut(n).zip(&q).for_each(|(row, q)| row.copy_from_slice(&q[..n]));
    reached
}

/// A posture in the capacity of the kernels.
fn padded<const C: usize>(row: &[f64]) -> [f64; C] {
    let mut q = [0.0; C];
    q[..row.len()].copy_from_slice(row);
    q
}
