//! `redundancy.Scene`.

use std::sync::{Mutex, MutexGuard};

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::errors::{Failure, PyResult};

use crate::array::{ok, read_any, read_vector, vector};
use crate::collision::shape::{PyBody, PyShape};
use crate::robot::PyRobot;
use crate::robot::frames::{matrix, read_frame};
use redundancy::collision::{Obstacle, Pair, Proximity, Scene};
use redundancy::error::{Error, check_finite};
use redundancy::linalg::MAX_JOINTS;
use redundancy::linalg::frame::Frame;

/// Two bodies, or a body and an obstacle, and how near they are.
#[pyclass(name = "Proximity", frozen, module = "redundancy._core")]
pub struct PyProximity {
    names: [String; 2],
    found: Proximity,
    n: usize,
}

#[pymethods]
impl PyProximity {
    /// Names of the body, and of the obstacle or other body.
    #[getter]
    fn names(&self) -> (&str, &str) {
        (&self.names[0], &self.names[1])
    }

    /// Signed distance [m]: negative by the depth where they overlap.
    #[getter]
    fn distance(&self) -> f64 {
        self.found.distance
    }

    /// Nearest points on both, or those deepest in each other, shape (2, 3) [m], in the base frame.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(PyArray2::from_vec2(py, &self.found.points.map(|p| p.to_vec()))?)
    }

    /// Unit vector from the first to the second, shape (3,).
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.found.normal)
    }

    /// What the joints change of the distance, shape (n,) [m/rad or 1]: ``d' = gradient @ qd + drift``.
    #[getter]
    fn gradient<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.found.row[..self.n])
    }

    /// What the obstacle's motion changes of it [m/s].
    #[getter]
    fn drift(&self) -> f64 {
        self.found.drift
    }

    fn __repr__(&self) -> String {
        format!("Proximity({:?}, {:?}, distance={:.6})", self.names[0], self.names[1], self.found.distance)
    }
}

/// A robot's bodies among obstacles.
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot.
/// bodies : sequence of Body
///     Its bodies.
/// obstacles : dict of str to Shape or (Shape, pose)
///     Names, shapes and poses (4, 4) of the obstacles, in the frame in which the robot's base is given.
/// self_pairs : sequence of (int, int)
///     Pairs of bodies that are looked at, as of `self_collision_pairs`.
///
/// Raises
/// ------
/// InvalidValueError
///     If a body names no link of the robot, a pair no bodies, or a pose is no frame.
///
/// Notes
/// -----
/// Distances of spheres, capsules and boxes are in closed form, those of hulls by GJK and EPA (parry). Bodies on the base are looked at beside
/// other bodies only: no joint moves them away from an obstacle.
#[pyclass(name = "Scene", frozen, module = "redundancy._core")]
pub struct PyScene {
    scene: Mutex<Scene>,
    robot: Py<PyRobot>,
}

impl PyScene {
    /// The scene, for this thread alone.
    pub fn lock(&self) -> MutexGuard<'_, Scene> {
        // What a panic of another thread left are still frames, computed anew by every query.
        self.scene.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Names of a pair.
    pub fn name_of(scene: &Scene, pair: Pair) -> [String; 2] {
        let body = |i: usize| scene.bodies()[i].name.clone();
        match pair {
            Pair::Obstacle { body: i, obstacle } => [body(i), scene.obstacles()[obstacle].name.clone()],
            Pair::Bodies { first, second } => [body(first), body(second)],
        }
    }

    fn index(scene: &Scene, name: &str) -> PyResult<usize> {
        scene.obstacles().iter().position(|obstacle| obstacle.name == name).ok_or_else(|| {
            let names: Vec<&str> = scene.obstacles().iter().map(|obstacle| obstacle.name.as_str()).collect();
            Error::value("name", format!("{name:?}"), &format!("one of the obstacles: {}", names.join(", "))).into()
        })
    }
}

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (robot, bodies, obstacles=None, self_pairs=Vec::new()))]
    fn new(
        robot: Py<PyRobot>,
        bodies: Vec<PyRef<'_, PyBody>>,
        obstacles: Option<&Bound<'_, pyo3::types::PyDict>>,
        self_pairs: Vec<(usize, usize)>,
    ) -> PyResult<Self> {
        let mut list = Vec::new();
        for (name, given) in obstacles.into_iter().flatten() {
            let name: String = name.extract()?;
            let (shape, pose) = match given.cast::<PyShape>() {
                Ok(shape) => (shape.get().shape.clone(), Frame::IDENTITY),
                Err(_) => {
                    let (shape, pose): (PyRef<'_, PyShape>, Bound<'_, PyAny>) = given.extract()?;
                    (shape.shape.clone(), read_frame(&format!("pose of {name:?}"), &pose)?)
                }
            };
            list.push(ok(Obstacle::new(&name, shape, pose))?);
        }
        let bodies = bodies.iter().map(|body| body.body.clone()).collect();
        let pairs = self_pairs.into_iter().map(|(a, b)| [a, b]).collect();
        let scene = ok(Scene::new(robot.get().robot.clone(), bodies, list, pairs))?;
        Ok(Self { scene: Mutex::new(scene), robot })
    }

    /// The robot.
    #[getter]
    fn robot(&self, py: Python<'_>) -> Py<PyRobot> {
        self.robot.clone_ref(py)
    }

    /// The bodies.
    #[getter]
    fn bodies(&self) -> Vec<PyBody> {
        self.lock().bodies().iter().map(|body| PyBody { body: body.clone() }).collect()
    }

    /// Names of the obstacles.
    #[getter]
    fn obstacles(&self) -> Vec<String> {
        self.lock().obstacles().iter().map(|obstacle| obstacle.name.clone()).collect()
    }

    /// Pairs of bodies that are looked at.
    #[getter]
    fn self_pairs(&self) -> Vec<(usize, usize)> {
        self.lock().self_pairs().iter().map(|[a, b]| (*a, *b)).collect()
    }

    /// The shape of an obstacle.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Its name.
    fn shape_of(&self, name: &str) -> PyResult<PyShape> {
        let scene = self.lock();
        Ok(PyShape { shape: scene.obstacles()[Self::index(&scene, name)?].shape.clone() })
    }

    /// The pose of an obstacle, shape (4, 4).
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Its name.
    fn pose_of<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let scene = self.lock();
        matrix(py, scene.obstacles()[Self::index(&scene, name)?].pose())
    }

    /// Moves an obstacle.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     Its name.
    /// pose : array_like, shape (4, 4) or (3,)
    ///     Its frame, or its position [m] with the axes of the base.
    /// velocity : array_like, shape (6,), optional
    ///     [omega; v] at its origin in the base frame [rad/s, m/s]; at rest if not given.
    #[pyo3(signature = (name, pose, velocity=None))]
    fn place(&self, name: &str, pose: &Bound<'_, PyAny>, velocity: Option<&Bound<'_, PyAny>>) -> PyResult<()> {
        let (numbers, shape) = read_any("pose", pose)?;
        let frame = match (shape.as_slice(), numbers.as_slice()) {
            ([3], [x, y, z]) => {
                check_finite("pose", &numbers).map_err(Failure::from)?;
                Frame::translation([*x, *y, *z])
            }
            _ => read_frame("pose", pose)?,
        };
        let mut twist = [0.0; 6];
        if let Some(velocity) = velocity {
            read_vector("velocity", velocity, 6, &mut twist)?;
        }
        let mut scene = self.lock();
        let index = Self::index(&scene, name)?;
        ok(scene.place(index, frame, twist))
    }

    /// The pairs that are near at a posture.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// influence : float
    ///     Distance up to which pairs count as near [m].
    ///
    /// Returns
    /// -------
    /// list of Proximity
    ///     Nearest first.
    #[pyo3(signature = (q, influence=f64::INFINITY))]
    fn near(&self, q: &Bound<'_, PyAny>, influence: f64) -> PyResult<Vec<PyProximity>> {
        let mut scene = self.lock();
        let n = scene.robot().n();
        let mut posture = [0.0; MAX_JOINTS];
        read_vector("q", q, n, &mut posture)?;
        let pairs = scene.bodies().len() * scene.obstacles().len() + scene.self_pairs().len();
        let mut found = vec![Proximity::NONE; pairs];
        let count = ok(scene.near(&posture[..n], influence, &mut found))?.written;
        found.truncate(count);
        Ok(found.into_iter().map(|found| PyProximity { names: Self::name_of(&scene, found.pair), found, n }).collect())
    }

    /// The smallest distance of any pair at a posture [m]; infinite without pairs.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    fn distance(&self, q: &Bound<'_, PyAny>) -> PyResult<f64> {
        let mut scene = self.lock();
        let n = scene.robot().n();
        let mut posture = [0.0; MAX_JOINTS];
        read_vector("q", q, n, &mut posture)?;
        let mut nearest = [Proximity::NONE];
        ok(scene.near(&posture[..n], f64::INFINITY, &mut nearest))?;
        Ok(nearest[0].distance)
    }
}
