//! `redundancy.Task`.

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};

use crate::array::{ok, read_matrix, read_vector, vector};
use crate::robot::PyRobot;
use crate::volume::PyVolume;
use redundancy::error::{Error, Result, check_finite};
use redundancy::kinematics::forward;
use redundancy::linalg::MAX_JOINTS;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::unit;
use redundancy::task::{OrientationVolume, Projector, Reference, Target, Task};

/// What the tool has to do; the rest of its motion is free (Huo 2009, table 3.6: 16 twist projectors).
///
/// `Task.axisymmetric`, `Task.full` and `Task.position` make the commonest ones.
///
/// Parameters
/// ----------
/// angular, linear : {"free", "full"} or ("line", axis) or ("plane", axis)
///     Which directions of the angular and of the linear velocity matter: none, all, those along an axis, those normal to it. An axis has
///     shape (3,), any length but zero, in the frame.
/// frame : {"tool", "base"} or array_like, shape (4, 4)
///     Where the axes stand and at which point the twist is decomposed: in the tool frame or the base frame at the tool point, or in the frame of
///     a part, given in the base frame, at its origin (the symmetry of a round part that is picked).
///
/// Raises
/// ------
/// InvalidValueError
///     If a projector or the frame is not one of these.
#[pyclass(name = "Task", frozen, eq, module = "redundancy._core")]
#[derive(PartialEq)]
pub struct PyTask {
    /// Of a task within a volume that of its position.
    pub task: Task,
    /// The orientations allowed, of [`PyTask::within`].
    pub volume: Option<OrientationVolume>,
}

impl From<Task> for PyTask {
    fn from(task: Task) -> Self {
        Self { task, volume: None }
    }
}

fn projector(name: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Projector> {
    let Some(value) = value else { return Ok(Projector::All) };
    let wrong = || {
        let shown = value.repr().map_or_else(|_| "?".into(), |r| r.to_string());
        Failure::from(Error::value(name, shown, "\"free\", \"full\", (\"line\", axis) or (\"plane\", axis)"))
    };
    if let Ok(kind) = value.extract::<String>() {
        return match kind.as_str() {
            "free" => Ok(Projector::None),
            "full" => Ok(Projector::All),
            _ => Err(wrong()),
        };
    }
    let (kind, axis): (String, Bound<'_, PyAny>) = value.extract().map_err(|_| wrong())?;
    let mut e = [0.0; 3];
    read_vector(name, &axis, 3, &mut e)?;
    match kind.as_str() {
        "line" => ok(Projector::line(e)),
        "plane" => ok(Projector::plane(e)),
        _ => Err(wrong()),
    }
}

fn reference(value: Option<&Bound<'_, PyAny>>) -> PyResult<Reference> {
    let Some(value) = value else { return Ok(Reference::Tool) };
    match value.extract::<String>().as_deref() {
        Ok("tool") => Ok(Reference::Tool),
        Ok("base") => Ok(Reference::Base),
        Ok(other) => Err(Error::value("frame", format!("{other:?}"), "\"tool\", \"base\" or a (4, 4) array").into()),
        Err(_) => Ok(Reference::Part(ok(Frame::from_matrix("frame", &read_matrix("frame", value)?))?)),
    }
}

#[pymethods]
impl PyTask {
    #[new]
    #[pyo3(signature = (angular=None, linear=None, frame=None), text_signature = "(angular='full', linear='full', frame='tool')")]
    fn new(angular: Option<&Bound<'_, PyAny>>, linear: Option<&Bound<'_, PyAny>>, frame: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let (angular, linear) = (projector("angular", angular)?, projector("linear", linear)?);
        let isotropic = |projector| matches!(projector, Projector::All | Projector::None);
        // Without a direction the frame at the tool point does not matter: tasks that mean the same compare equal.
        let reference = match reference(frame)? {
            Reference::Base if isotropic(angular) && isotropic(linear) => Reference::Tool,
            other => other,
        };
        Ok(Task { angular, linear, reference }.into())
    }

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
        Ok(ok(Task::axisymmetric(e))?.into())
    }

    /// Position and orientation.
    #[staticmethod]
    fn full() -> Self {
        Task::FULL.into()
    }

    /// Position alone.
    #[staticmethod]
    fn position() -> Self {
        Task::POSITION.into()
    }

    /// Position, and an orientation that stays within a volume: it may tilt and spin as far as the volume says (painting, coating, inspection).
    ///
    /// Parameters
    /// ----------
    /// volume : OrientationVolume
    ///     The tool's orientations that are allowed, relative to the frame of the path at each of its points.
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If the volume has no smooth bounds: products of four rotations and more or whose axes come to lie in a plane, pyramids tilted
    ///     beyond a quarter turn, squares whose corners reach the horizon.
    #[staticmethod]
    fn within(volume: &Bound<'_, PyVolume>) -> PyResult<Self> {
        let volume = volume.get().volume.clone();
        ok(volume.check_as_task())?;
        Ok(Self { task: Task::POSITION, volume: Some(volume) })
    }

    /// "axisymmetric", "full", "position" or "within", or "general" for the other projectors.
    #[getter]
    fn kind(&self) -> &'static str {
        if self.volume.is_some() { "within" } else { self.task.kind() }
    }

    /// The orientations that are allowed, of a task within a volume; None of others.
    #[getter]
    fn volume(&self) -> Option<PyVolume> {
        self.volume.clone().map(|volume| PyVolume { volume })
    }

    /// Unit axis in the tool frame, shape (3,); z unless axisymmetric about another.
    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.task.spin_axis().unwrap_or([0.0, 0.0, 1.0]))
    }

    /// Number of components of the tool's twist that matter, 0 to 6; within a volume those that it bounds from both sides at once alone.
    #[getter]
    fn dimension(&self) -> usize {
        self.task.dimension() + self.equalities()
    }

    /// Numbers of a target: 6 (position and axis) for an axisymmetric tool, 3 (position) where the rotation is free, else 12 (position and
    /// rotation matrix by rows).
    #[getter]
    fn target_size(&self) -> usize {
        if self.volume.is_some() { 12 } else { Self::width(&self.task) }
    }

    /// The twist projector T of a posture (Huo 2009, eq. 3.6), symmetric and idempotent.
    ///
    /// Parameters
    /// ----------
    /// robot : Robot
    ///     The robot.
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    ///
    /// Returns
    /// -------
    /// ndarray, shape (6, 6)
    ///     Acts on twists [omega; v] in the base frame, at the tool point or, for a task in the frame of a part, at that frame's origin.
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If the task is within a volume: which of its bounds matter depends on the target.
    fn projector<'py>(&self, py: Python<'py>, robot: &Bound<'py, PyRobot>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let task = self.plain("Task.projector")?;
        let robot = &*robot.get().robot;
        let n = robot.n();
        let mut buffer = [0.0; MAX_JOINTS];
        read_vector("q", q, n, &mut buffer)?;
        let tool = ok(forward(robot, &buffer[..n]))?;
        let m = task.projector(&tool);
        let rows: Vec<Vec<f64>> = m.iter().map(|row| row.to_vec()).collect();
        Ok(PyArray1::from_vec(py, rows.concat()).reshape([6, 6])?)
    }

    /// Degrees of redundancy of a robot with this task (Huo 2009, eq. 1.4 to 1.6).
    ///
    /// Parameters
    /// ----------
    /// robot : Robot
    ///     The robot.
    ///
    /// Returns
    /// -------
    /// intrinsic, functional, total : int
    ///     n - o, o - t and their sum, with o the dimension of the motions that the robot can make at all and t that of the task. The
    ///     functional one is negative when the robot cannot do the task.
    fn redundancy(&self, robot: &Bound<'_, PyRobot>) -> (isize, isize, isize) {
        let (intrinsic, functional) = self.task.redundancy(&robot.get().robot);
        let functional = functional - self.equalities() as isize;
        (intrinsic as isize, functional, intrinsic as isize + functional)
    }

    fn __repr__(&self) -> String {
        if let Some(volume) = self.volume() {
            return format!("Task.within({})", volume.shown());
        }
        let shown = |projector: Projector| match projector {
            Projector::None => "'free'".into(),
            Projector::All => "'full'".into(),
            Projector::Line([x, y, z]) => format!("('line', ({x}, {y}, {z}))"),
            Projector::Plane([x, y, z]) => format!("('plane', ({x}, {y}, {z}))"),
        };
        let frame = match self.task.reference {
            Reference::Tool => "'tool'",
            Reference::Base => "'base'",
            Reference::Part(_) => "<part>",
        };
        match (self.kind(), self.task.spin_axis()) {
            ("general", _) => format!("Task({}, {}, {frame})", shown(self.task.angular), shown(self.task.linear)),
            (_, Some([x, y, z])) => format!("Task.axisymmetric(({x}, {y}, {z}))"),
            (kind, None) => format!("Task.{kind}()"),
        }
    }
}

impl PyTask {
    /// The task, for what does not take volumes.
    pub fn plain(&self, what: &str) -> PyResult<&Task> {
        if self.volume.is_some() {
            return Err(Error::value("task", self.__repr__(), &format!("a task without a volume: {what} does not take one")).into());
        }
        Ok(&self.task)
    }

    /// The task; where it is a volume, that of the volume's axis.
    pub fn axial(&self) -> Result<Task> {
        if self.volume.is_some() { Task::axisymmetric([0.0, 0.0, 1.0]) } else { Ok(self.task) }
    }

    /// Components of the angular velocity that a volume leaves no freedom in.
    fn equalities(&self) -> usize {
        self.volume.as_ref().map_or(0, |volume| 3 - volume.freedoms())
    }

    /// Numbers of one target.
    pub fn width(task: &Task) -> usize {
        match task.angular {
            _ if task.spin_axis().is_some() => 6,
            Projector::None => 3,
            _ => 12,
        }
    }

    /// A target of any task from a pose of the tool, a 4 x 4 matrix by rows: its position, and of its orientation what the task looks at.
    pub fn pose(matrix: &[f64]) -> Result<Target> {
        let frame = Frame::from_matrix("target", matrix)?;
        Ok(Target { position: frame.origin, axis: None, frame: frame.axes })
    }

    /// A target from its row of numbers: position, then axis or rotation matrix by rows.
    pub fn target(task: &Task, row: &[f64]) -> Result<Target> {
        let mut target = Target { position: [row[0], row[1], row[2]], axis: None, frame: Frame::IDENTITY.axes };
        match Self::width(task) {
            6 => {
                let axis = [row[3], row[4], row[5]];
                target.axis = Some(unit(axis).ok_or_else(|| Error::value("axis", format!("{axis:?}"), "a vector that is not zero"))?);
            }
            12 => {
                let r = &row[3..12];
                let matrix = [r[0], r[1], r[2], row[0], r[3], r[4], r[5], row[1], r[6], r[7], r[8], row[2], 0.0, 0.0, 0.0, 1.0];
                target.frame = Frame::from_matrix("rotation", &matrix)?.axes;
            }
            _ => check_finite("position", &target.position)?,
        }
        Ok(target)
    }
}
