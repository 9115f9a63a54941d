//! A path of the tool in numbers: what maps, plans and pictures ask of it.

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use redundancy::error::Error;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::Vec3;
use redundancy::plan::{Path, point_weights, spin, spin_along, spin_frames, tilt_heading_twist, tools, volume_frames};

use super::frames::{read_vectors, rotations};
use crate::array::{Rows, read_any, read_list, read_rows, vector};
use crate::errors::PyResult;
use crate::robot::PyRobot;
use crate::robot::frames::matrices;
use crate::task::PyTask;

/// A toolpath in numbers.
///
/// Parameters
/// ----------
/// position, axis : array_like, shape (N, 3)
///     Positions of the tool point [m] and directions of the tool's axis, in the robot's base frame.
/// rotation : array_like, shape (N, 3, 3), optional
///     Orientations of the tool frame.
/// time : array_like, shape (N,), optional
///     Strictly increasing times [s].
#[pyclass(name = "PathData", frozen, module = "redundancy._core")]
pub struct PyPath {
    pub path: Path,
}

#[pymethods]
impl PyPath {
    #[new]
    #[pyo3(signature = (position, axis, rotation=None, time=None))]
    fn new(
        position: &Bound<'_, PyAny>,
        axis: &Bound<'_, PyAny>,
        rotation: Option<&Bound<'_, PyAny>>,
        time: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let rotation = rotation.map(read_rotations).transpose()?;
        let time = time.map(|time| read_list("time", time)).transpose()?;
        Ok(Self { path: Path::new(read_vectors("position", position)?, read_vectors("axis", axis)?, rotation, time)? })
    }

    fn __len__(&self) -> usize {
        self.path.len()
    }

    /// The share of the path from each point to the next, shape (N - 1,), summing to 1: by time where the path has times; else by length, a
    /// turn of the axis by one radian counting as 0.1 m.
    #[getter]
    fn shares<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.path.shares())
    }

    /// The share of the path that each point stands for (trapezoidal rule), shape (N,).
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &point_weights(&self.path.shares(), false))
    }

    /// The tool frames at spin 0, shape (N, 4, 4): the path's rotations where it has any; else the first is arbitrary and the others follow
    /// without turning about the axis. In a closed path what the way round turned the tool by is spread over the path.
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If the task is neither axisymmetric nor full, the rotations that it needs are missing, or a closed path does not end where it starts.
    #[pyo3(signature = (task, closed=false))]
    fn frames<'py>(&self, py: Python<'py>, task: &PyTask, closed: bool) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, &self.seen_in(task, closed)?)
    }

    /// The spins of the tool at postures (N, n) against the frames at spin 0 [rad], shape (N,), from -pi to pi.
    fn spins<'py>(&self, py: Python<'py>, robot: &PyRobot, task: &PyTask, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let frames = self.measured_from(task)?;
        let axis = task.task.spin_axis().unwrap_or([0.0, 0.0, 1.0]);
        let tools = tools(&robot.robot, &self.postures(robot, q)?);
        let of = |(frame, tool)| if task.volume.is_some() { tilt_heading_twist(frame, tool)[2] } else { spin(frame, tool, axis) };
        let spins: Vec<f64> = frames.iter().zip(&tools).map(of).collect();
        Ok(vector(py, &spins))
    }

    /// Tilt of the tool's z axis at postures (N, n), its heading from x to y and its twist about z, in the frames that a task is seen in [rad],
    /// shape (N, 3). Where the tilt is 0 the heading is as rounding leaves it.
    fn tilts<'py>(&self, py: Python<'py>, robot: &PyRobot, task: &PyTask, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let frames = self.measured_from(task)?;
        let tools = tools(&robot.robot, &self.postures(robot, q)?);
        let rows: Vec<f64> = frames.iter().zip(&tools).flat_map(|(frame, tool)| tilt_heading_twist(frame, tool)).collect();
        rows_array(py, &rows, 3)
    }

    /// How far the tool has turned about the path's axis since the first point at postures (N, n) [rad], shape (N,), unwrapped.
    fn spin_along<'py>(&self, py: Python<'py>, robot: &PyRobot, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &spin_along(&robot.robot, self.path.axis(), &self.postures(robot, q)?)))
    }

    /// Rotations that take the first axis to each of them without turning about it, shape (N, 3, 3).
    fn transport<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        rotations(py, self.path.axis())
    }
}

impl PyPath {
    /// The frames at spin 0; of a volume those that it is seen in.
    fn seen_in(&self, task: &PyTask, closed: bool) -> PyResult<Vec<Frame>> {
        let Some(volume) = &task.volume else { return Ok(spin_frames(&self.path, &task.task, closed)?) };
        Ok(volume_frames(&self.path, volume, closed)?)
    }

    /// The same for tilts and spins: those of a volume are from its reference.
    fn measured_from(&self, task: &PyTask) -> PyResult<Vec<Frame>> {
        let frames = self.seen_in(task, false)?;
        let Some(volume) = &task.volume else { return Ok(frames) };
        let reference = Frame { axes: volume.reference().axes(), origin: [0.0; 3] };
        Ok(frames.iter().map(|frame| frame.compose(&reference)).collect())
    }

    /// Postures, one a point.
    fn postures(&self, robot: &PyRobot, q: &Bound<'_, PyAny>) -> PyResult<Vec<f64>> {
        let n = robot.robot.n();
        let rows = match read_rows("q", q, n)? {
            Rows::Many(rows) => rows,
            Rows::One(row) => row[..n].to_vec(),
        };
        if rows.len() != n * self.path.len() {
            let expected = format!("({}, {n})", self.path.len());
            return Err(Error::Shape { name: "q".into(), got: format!("({}, {n})", rows.len() / n), expected }.into());
        }
        Ok(rows)
    }
}

/// Rotations (N, 3, 3) as the axes of frames.
fn read_rotations(value: &Bound<'_, PyAny>) -> PyResult<Vec<[Vec3; 3]>> {
    let (numbers, shape) = read_any("rotation", value)?;
    if !matches!(shape[..], [_, 3, 3]) {
        return Err(Error::Shape { name: "rotation".into(), got: format!("{shape:?}"), expected: "(N, 3, 3)".into() }.into());
    }
    let axes = |m: &[f64]| [0, 1, 2].map(|c| [m[c], m[3 + c], m[6 + c]]);
    Ok(numbers.chunks_exact(9).map(axes).collect())
}

/// Rows of many numbers as an array.
pub fn rows_array<'py>(py: Python<'py>, rows: &[f64], n: usize) -> PyResult<Bound<'py, PyArray2<f64>>> {
    Ok(PyArray1::from_slice(py, rows).reshape([rows.len() / n.max(1), n])?)
}
