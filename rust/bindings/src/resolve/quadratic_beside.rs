//! `redundancy.PostureTask` and `redundancy.FrameTask`: what counts beside the task of a `redundancy.QuadraticProgram`.

use pyo3::prelude::*;

use crate::array::{ok, read_any, read_list, read_matrix};
use crate::errors::PyResult;
use crate::task::PyTask;
use redundancy::error::Error;
use redundancy::linalg::Row6;
use redundancy::linalg::frame::Frame;
use redundancy::resolve::{Beside, FrameTask, PostureTask, QuadraticSolver};

/// A posture that the joints are drawn to beside the task of a `QuadraticProgram`: ``sum of weight_i (qd_i - gain (posture_i - q_i))^2 / 2`` is added to what it
/// minimises.
///
/// Parameters
/// ----------
/// posture : array_like, shape (n,)
///     The posture [rad or m].
/// weight : float or array_like, shape (n,)
///     Weight, of at least 0: of all joints, or one a joint. Beside ``rate_weights`` of 1 and a ``stiffness`` of 1e4.
/// gain : float
///     Part of the way to go in a second [1/s], of at least 0; never more than the way in a tick.
///
/// Raises
/// ------
/// ShapeError, NonFiniteError, InvalidValueError
///     By the programme that it is given to, if it does not fit the robot or a number is out of its domain.
#[pyclass(name = "PostureTask", frozen, module = "redundancy._core")]
pub struct PyPostureTask(PostureTask);

#[pymethods]
impl PyPostureTask {
    #[new]
    #[pyo3(signature = (posture, weight=None, gain=1.0), text_signature = "(posture, weight=1.0, gain=1.0)")]
    fn new(posture: &Bound<'_, PyAny>, weight: Option<&Bound<'_, PyAny>>, gain: f64) -> PyResult<Self> {
        let posture = read_list("posture", posture)?;
        let weights = match weight.map(|weight| read_any("weight", weight)).transpose()? {
            None => vec![1.0; posture.len()],
            Some((numbers, shape)) if shape.is_empty() => vec![numbers[0]; posture.len()],
            Some((numbers, _)) => numbers,
        };
        Ok(Self(PostureTask { posture, weights, gain }))
    }
}

/// A task of another frame of the arm, such as an elbow or a camera, beside that of a `QuadraticProgram`: ``weight |t - J qd|^2 / 2`` is added to what it minimises,
/// with the twist t that a step gives it in ``twists``, angles times the programme's length. In a step without its twist it does not count.
///
/// Parameters
/// ----------
/// link : int
///     What it is fixed to: link k, which moves with joints 0 to k.
/// task : Task
///     What the frame has to do, as a tool has.
/// frame : array_like, shape (4, 4), optional
///     The frame in that of the link, as `Robot.link_frames` gives them; that of the link itself if not given.
/// weight : float
///     Weight, above 0, beside ``rate_weights`` of 1 and a ``stiffness`` of 1e4.
///
/// Raises
/// ------
/// ShapeError, InvalidValueError
///     If the frame is none; by the programme that it is given to, if the link is none of the robot's or the weight is out of its domain.
#[pyclass(name = "FrameTask", frozen, module = "redundancy._core")]
pub struct PyFrameTask(FrameTask);

#[pymethods]
impl PyFrameTask {
    #[new]
    #[pyo3(signature = (link, task, frame=None, weight=100.0))]
    fn new(link: usize, task: &Bound<'_, PyTask>, frame: Option<&Bound<'_, PyAny>>, weight: f64) -> PyResult<Self> {
        let frame = match frame {
            None => Frame::IDENTITY,
            Some(given) => ok(Frame::from_matrix("frame", &read_matrix("frame", given)?))?,
        };
        Ok(Self(FrameTask { link, frame, task: *task.get().plain("FrameTask")?, weight }))
    }
}

/// What counts beside the task, as Python gives it.
#[inline(never)]
pub fn read_beside(given: &[Bound<'_, PyAny>]) -> PyResult<Vec<Beside>> {
    let one = |item: &Bound<'_, PyAny>| {
        if let Ok(posture) = item.cast::<PyPostureTask>() {
            return Ok(Beside::Posture(posture.get().0.clone()));
        }
        match item.cast::<PyFrameTask>() {
            Ok(frame) => Ok(Beside::Frame(frame.get().0.clone())),
            Err(_) => Err(Error::value("beside", format!("{}", item.get_type()), "PostureTasks and FrameTasks").into()),
        }
    };
    given.iter().map(one).collect()
}

/// The frame at place `k` of what counts beside.
pub fn frame(solver: &QuadraticSolver, k: usize) -> PyResult<&FrameTask> {
    match solver.beside().get(k) {
        Some(Beside::Frame(frame)) => Ok(frame),
        _ => Err(Error::value("beside", k, "the place of a FrameTask").into()),
    }
}

/// Twists of the frames beside, shape (K, 6), one for each frame.
#[inline(never)]
pub fn read_twists(solver: &QuadraticSolver, given: &Bound<'_, PyAny>) -> PyResult<Vec<Row6>> {
    let frames = solver.beside().iter().filter(|one| matches!(one, Beside::Frame(_))).count();
    let (numbers, shape) = read_any("twists", given)?;
    redundancy::error::check_finite("twists", &numbers).map_err(crate::errors::Failure::from)?;
    if shape != [frames, 6] {
        return Err(Error::Shape {
            name: "twists".into(),
            got: format!("{shape:?}"),
            expected: format!("({frames}, 6), a twist a FrameTask"),
        }
        .into());
    }
    Ok(numbers.chunks_exact(6).map(|row| std::array::from_fn(|i| row[i])).collect())
}
