//! Refinement of paths, and what surrounds it.

use numpy::PyArray1;
use pyo3::prelude::*;

use crate::errors::PyResult;

use crate::array::{elements, ok, output, read_any, read_list, vector};
use crate::index::objective::PyObjective;
use crate::plan::map::{Array, criterion};
use crate::resolve::solution;
use crate::robot::PyRobot;
use crate::robot::frames::read_frames;
use crate::task::PyTask;
use redundancy::error::{Error, check_finite};
use redundancy::linalg::frame::Frame;
use redundancy::plan::{Criterion, Kind, PathProblem, RefineStatus, Refined, SpinRange, least_value, onto_path, refine};
use redundancy::robot::Robot;
use redundancy::task::{Target, Task};
use redundancy::with_capacity;

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
    let problem = PathProblem {
        robot: &robot.robot,
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
    let found = py.detach(|| {
        with_capacity!(n, least(&robot.robot, task.task, &target, &postures, &values, &objective.objective, limits, length, spin.as_ref()))
    });
    objective.check()?;
    Ok(found)
}

fn least<const C: usize>(
    robot: &Robot,
    task: Task,
    target: &[Target],
    postures: &[f64],
    values: &[f64],
    objective: &redundancy::index::Objective,
    limits: bool,
    length: f64,
    spin: Option<&OwnedSpin>,
) -> f64 {
    let problem = PathProblem {
        robot,
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
    let reached = py.detach(|| with_capacity!(n, restored(&robot.robot, task.task, &targets, &mut rows, length)));
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
