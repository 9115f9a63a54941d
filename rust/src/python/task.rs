//! `redundancy.Task`.

use numpy::PyArray1;
use pyo3::prelude::*;

use super::array::{ok, read_vector, vector};
use crate::error::{Error, Result, check_finite};
use crate::linalg::frame::Frame;
use crate::linalg::vector::unit;
use crate::task::{Target, Task};

/// What the tool has to do; the rest of its motion is free.
///
/// Made by `Task.axisymmetric`, `Task.full` or `Task.position`.
#[pyclass(name = "Task", frozen, eq, module = "redundancy._core")]
#[derive(PartialEq)]
pub struct PyTask {
    pub task: Task,
}

#[pymethods]
impl PyTask {
    /// Position and the direction of an axis of the tool: the spin about it is free (milling, welding, deburring, printing).
    ///
    /// Parameters
    /// ----------
    /// axis : array_like, shape (3,)
    ///     The axis in the tool frame, any length but zero.
    #[staticmethod]
    #[pyo3(signature = (axis=None), text_signature = "(axis=(0.0, 0.0, 1.0))")]
    fn axisymmetric(axis: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let mut e = [0.0, 0.0, 1.0];
        if let Some(axis) = axis {
            read_vector("axis", axis, 3, &mut e)?;
        }
        Ok(Self { task: ok(Task::axisymmetric(e))? })
    }

    /// Position and orientation.
    #[staticmethod]
    fn full() -> Self {
        Self { task: Task::Full }
    }

    /// Position alone.
    #[staticmethod]
    fn position() -> Self {
        Self { task: Task::Position }
    }

    /// "axisymmetric", "full" or "position".
    #[getter]
    fn kind(&self) -> &'static str {
        match self.task {
            Task::Axisymmetric(_) => "axisymmetric",
            Task::Full => "full",
            Task::Position => "position",
        }
    }

    /// Unit axis in the tool frame, shape (3,); z unless axisymmetric about another.
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &if let Task::Axisymmetric(axis) = self.task { axis } else { [0.0, 0.0, 1.0] })
    }

    /// Number of components of the tool's twist that matter: 5, 6 or 3.
    #[getter]
    fn dimension(&self) -> usize {
        self.task.dimension()
    }

    fn __repr__(&self) -> String {
        match self.task {
            Task::Axisymmetric([x, y, z]) => format!("Task.axisymmetric(({x}, {y}, {z}))"),
            _ => format!("Task.{}()", self.kind()),
        }
    }
}

impl PyTask {
    /// Numbers of one target.
    pub fn width(task: &Task) -> usize {
        match task {
            Task::Axisymmetric(_) => 6,
            Task::Full => 12,
            Task::Position => 3,
        }
    }

    /// A target from its row of numbers: position, then axis or rotation matrix by rows.
    pub fn target(task: &Task, row: &[f64]) -> Result<Target> {
        let mut target = Target { position: [row[0], row[1], row[2]], axis: [0.0, 0.0, 1.0], rotation: Frame::IDENTITY.axes };
        match task {
            Task::Axisymmetric(_) => {
                let axis = [row[3], row[4], row[5]];
                target.axis = unit(axis).ok_or_else(|| Error::value("axis", format!("{axis:?}"), "a vector that is not zero"))?;
            }
            Task::Full => {
                let r = &row[3..12];
                let matrix = [r[0], r[1], r[2], row[0], r[3], r[4], r[5], row[1], r[6], r[7], r[8], row[2], 0.0, 0.0, 0.0, 1.0];
                target.rotation = Frame::from_matrix("rotation", &matrix)?.axes;
            }
            Task::Position => check_finite("position", &target.position)?,
        }
        Ok(target)
    }
}
