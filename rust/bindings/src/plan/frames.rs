//! Vectors carried along and put across, and the grids of spins and of spare joints.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use redundancy::error::{Error, check_finite};
use redundancy::linalg::vector::Vec3;
use redundancy::plan::{self, PlanSettings, SpareGrid};

use crate::array::{read_any, read_vector, vector};
use crate::errors::PyResult;
use crate::robot::PyRobot;
use crate::task::PyTask;

/// Rotations that take the first of some unit vectors (N, 3) to each of them, by the smallest rotation from each to the next: none of the steps
/// turns about its axis, shape (N, 3, 3).
#[pyfunction]
pub fn transport<'py>(py: Python<'py>, axis: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray3<f64>>> {
    rotations(py, &read_vectors("axis", axis)?)
}

/// A unit vector across a unit vector, shape (3,).
#[pyfunction]
pub fn perpendicular<'py>(py: Python<'py>, vector: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let mut axis = [0.0; 3];
    read_vector("vector", vector, 3, &mut axis)?;
    Ok(self::vector(py, &plan::across(axis)))
}

/// The spins of a grid [rad]: from -pi over a whole turn, from end to end of a range, or 0 where the tool does not spin freely.
///
/// Raises
/// ------
/// InvalidValueError
///     If there is not at least one angle, or the range is not one.
#[pyfunction]
pub fn angle_grid<'py>(
    py: Python<'py>,
    spins: bool,
    n_angles: usize,
    spin_range: Option<(f64, f64)>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    Ok(vector(py, &plan::angle_grid(spins, n_angles, spin_range)?))
}

/// The joints that are held on a grid, counted from 0 and chosen if not given, and every combination of their values [rad or m], shape (S, k);
/// and whether the tool may spin as it likes beside them.
///
/// Raises
/// ------
/// InvalidValueError
///     If what is left does not fit the task.
#[pyfunction]
pub fn spare_grid<'py>(
    py: Python<'py>,
    robot: &PyRobot,
    task: &PyTask,
    spare: Option<Vec<usize>>,
    n_spare: Option<usize>,
) -> PyResult<(Vec<usize>, Bound<'py, PyArray2<f64>>, bool)> {
    let settings = PlanSettings { spare, n_spare, ..PlanSettings::default() };
    let SpareGrid { joints, values, spins, .. } = SpareGrid::new(&robot.robot, &task.axial()?, &settings)?;
    let array = PyArray1::from_vec(py, values.concat()).reshape([values.len(), joints.len()])?;
    Ok((joints, array, spins))
}

/// Vectors (N, 3), finite.
pub fn read_vectors(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Vec3>> {
    let (numbers, shape) = read_any(name, value)?;
    if !matches!(shape[..], [_, 3]) {
        return Err(Error::Shape { name: name.into(), got: format!("{shape:?}"), expected: "(N, 3)".into() }.into());
    }
    check_finite(name, &numbers)?;
    Ok(numbers.as_chunks::<3>().0.to_vec())
}

/// Transport along unit vectors as matrices (N, 3, 3).
pub fn rotations<'py>(py: Python<'py>, axis: &[Vec3]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let by_rows = |axes: &[Vec3; 3]| [0, 1, 2].map(|r| [axes[0][r], axes[1][r], axes[2][r]]);
    let turns = plan::transport(axis);
    let numbers: Vec<f64> = turns.iter().flat_map(|axes| by_rows(axes).concat()).collect();
    Ok(PyArray1::from_vec(py, numbers).reshape([turns.len(), 3, 3])?)
}
