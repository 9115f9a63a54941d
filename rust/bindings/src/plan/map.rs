//! The cells that maps show.

use numpy::{PyArray1, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;

use super::path::rows_array;
use super::predicate::{asked, raised};
use crate::array::{elements, ok, output, read_any, read_list};
use crate::errors::PyResult;
use crate::index::objective::PyObjective;
use crate::robot::PyRobot;
use crate::robot::frames::read_frames;
use crate::task::PyTask;
use redundancy::error::{Error, check_finite};
use redundancy::plan::{Hooks, Lattice, Members, SpareGrid};

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;
type Causes<'py> = Bound<'py, PyArrayDyn<u8>>;

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
    /// task : Task
    ///     Its axis is that of the spin.
    /// angles : array_like, shape (A,)
    ///     Spins [rad].
    /// spare : list of int
    ///     Joints that are held, counted from 0.
    /// values : array_like, shape (S, k)
    ///     Coordinates at which they are held.
    /// objective : Objective, optional
    ///     What cells are worth; 0 if not given.
    /// limits : bool
    ///     Whether postures beyond the position limits are out.
    /// rings, headings : int
    ///     Where the task is a volume, its tilts: so many rings around the middle, out to the bound, each of so many headings.
    #[new]
    #[pyo3(signature = (robot, frames, task, angles, spare, values, objective=None, limits=true, rings=1, headings=8))]
    fn new(
        py: Python<'_>,
        robot: &PyRobot,
        frames: &Bound<'_, PyAny>,
        task: &PyTask,
        angles: &Bound<'_, PyAny>,
        spare: Vec<usize>,
        values: &Bound<'_, PyAny>,
        objective: Option<Py<PyObjective>>,
        limits: bool,
        rings: usize,
        headings: usize,
    ) -> PyResult<Self> {
        let frames = read_frames(frames)?;
        let angles = read_list("angles", angles)?;
        ok(check_finite("angles", &angles))?;
        let (numbers, _) = read_any("values", values)?;
        let rows: Vec<Vec<f64>> =
            if spare.is_empty() { vec![Vec::new()] } else { numbers.chunks(spare.len()).map(<[f64]>::to_vec).collect() };
        let axial = ok(task.axial())?;
        let terms = objective.as_ref().map(|objective| objective.bind(py).get().objective.clone());
        let members = match &task.volume {
            Some(volume) => Members::within(volume, &angles, rings, headings),
            None => Members::spins(axial.spin_axis().unwrap_or([0.0, 0.0, 1.0]), &angles, true),
        };
        let spare = ok(SpareGrid::at(&robot.robot, &axial, &spare, rows))?;
        let lattice = Lattice::new(robot.robot.clone(), frames.into(), &axial, members, &spare, terms, limits);
        Ok(Self { lattice: ok(lattice)?, objective })
    }

    /// Values of the spare joints, angles and branches: the shape of one point's cells.
    #[getter]
    fn shape(&self) -> (usize, usize, usize) {
        (self.lattice.slices(), self.lattice.angles(), self.lattice.branches())
    }

    /// Tilts of the tool, each with its heading [rad], shape (M, 2): beside every value of the spare joints all of them come one after another.
    #[getter]
    fn tilts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        rows_array(py, self.lattice.tilts().as_flattened(), 2)
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
        let points: Vec<usize> = (first..first + count).collect();
        py.detach(|| self.lattice.fill(&points, q_out, value_out, &mut cause));
        self.check()?;
        Ok((q, value, PyArray1::from_vec(py, cause).reshape([count, cells])?.to_dyn().clone()))
    }

    /// Values and causes (count, cells) of some points; postures are not kept. A callable ``feasible`` gets postures (M, n) and returns which are
    /// allowed, bool of shape (M,).
    #[pyo3(signature = (first, count, feasible=None))]
    fn survey<'py>(&self, py: Python<'py>, first: usize, count: usize, feasible: Option<Py<PyAny>>) -> PyResult<(Array<'py>, Causes<'py>)> {
        self.range(first, count)?;
        let (n, cells) = (self.lattice.robot().n(), self.lattice.cells());
        let value = output(py, None, [count, cells])?;
        let mut cause = vec![0u8; count * cells];
        let value_out = elements(&value);
        py.detach(|| match &feasible {
            None => {
                self.lattice.survey(first, value_out, &mut cause);
                Ok(())
            }
            Some(feasible) => {
                let mut ask = |q: &[f64]| asked(feasible, q, n);
                self.lattice.survey_allowed(first, value_out, &mut cause, &mut Hooks { feasible: Some(&mut ask), ..Hooks::default() })
            }
        })
        .map_err(raised)?;
        self.check()?;
        Ok((value, PyArray1::from_vec(py, cause).reshape([count, cells])?.to_dyn().clone()))
    }
}
