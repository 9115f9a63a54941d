//! The planner's lattice and routes. `redundancy.plan` puts the parts together.

use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};

use crate::array::{elements, ok, output, read_any, read_list, read_vector};
use crate::index::objective::PyObjective;
use crate::robot::PyRobot;
use crate::robot::frames::read_frames;
use redundancy::error::{Error, Result, check_finite};
use redundancy::plan::{Criterion, Graph, Lattice, Search, find_route, wide_joints};

pub(crate) type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
type Causes<'py> = Bound<'py, PyArrayDyn<u8>>;

pub(crate) fn criterion(name: &str) -> Result<Criterion> {
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
        cause.try_readonly().map_err(|e| Failure::from(Error::value("cause", e, "a readable array")))?.as_array().iter().copied().collect();
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
