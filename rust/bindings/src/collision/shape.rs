//! `redundancy.Shape` and `redundancy.Body`.

use std::path::PathBuf;

use numpy::{PyArray2, PyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyMapping;

use crate::errors::PyResult;

use crate::array::Rows;
use crate::array::{elements, ok, output, read_rows, read_vector};
use crate::robot::PyRobot;
use crate::robot::frames::{matrix, read_frame};
use crate::robot::joint_limits::read_joint_limits;
use redundancy::collision::{Body, Mount, Shape, bodies_from_urdf_file, capsules_along_links, self_pairs};
use redundancy::error::{Error, check_positive};
use redundancy::linalg::MAX_JOINTS;
use redundancy::linalg::frame::Frame;
use redundancy::linalg::vector::Vec3;
use redundancy::robot::UrdfChain;

/// A convex solid: what can be near, or touch.
#[pyclass(name = "Shape", frozen, module = "redundancy._core")]
#[derive(Clone)]
pub struct PyShape {
    pub shape: Shape,
}

#[pymethods]
impl PyShape {
    /// A ball about the origin.
    ///
    /// Parameters
    /// ----------
    /// radius : float
    ///     Radius [m].
    #[staticmethod]
    fn sphere(radius: f64) -> PyResult<Self> {
        Ok(Self { shape: ok(Shape::sphere(radius))? })
    }

    /// A cylinder along z about the origin with round ends beyond its length.
    ///
    /// Parameters
    /// ----------
    /// radius, length : float
    ///     Radius, and length of the axis between the centres of the ends [m].
    #[staticmethod]
    fn capsule(radius: f64, length: f64) -> PyResult<Self> {
        let length = ok(check_positive("length", length))?;
        Ok(Self { shape: ok(Shape::capsule(0.5 * length, radius))? })
    }

    /// A box about the origin.
    ///
    /// Parameters
    /// ----------
    /// size : array_like, shape (3,)
    ///     Lengths along x, y, z [m].
    #[staticmethod]
    fn cuboid(size: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut lengths = [0.0; 3];
        read_vector("size", size, 3, &mut lengths)?;
        for length in lengths {
            ok(check_positive("size", length))?;
        }
        Ok(Self { shape: ok(Shape::cuboid(lengths.map(|x| 0.5 * x)))? })
    }

    /// The convex hull of points.
    ///
    /// Parameters
    /// ----------
    /// points : array_like, shape (k, 3)
    ///     Points that do not all lie in a plane [m].
    #[staticmethod]
    fn hull(points: &Bound<'_, PyAny>) -> PyResult<Self> {
        let numbers = match read_rows("points", points, 3)? {
            Rows::Many(numbers) => numbers,
            Rows::One(row) => row[..3].to_vec(),
        };
        let points: Vec<Vec3> = numbers.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
        Ok(Self { shape: ok(Shape::hull(&points))? })
    }

    /// The same shape with all that is within a margin of it.
    ///
    /// Parameters
    /// ----------
    /// margin : float
    ///     Distance [m].
    fn grown(&self, margin: f64) -> PyResult<Self> {
        Ok(Self { shape: ok(self.shape.grown(margin))? })
    }

    /// Radius of a sphere or a capsule, or of the rounding of the edges [m].
    #[getter]
    fn radius(&self) -> f64 {
        self.shape.radius()
    }

    /// Lengths along x, y, z of the box (0, 0, length of a capsule's axis; zeros of a sphere), without the radius [m]; None of a hull.
    #[getter]
    fn size(&self) -> Option<[f64; 3]> {
        self.shape.half_extents().map(|half| half.map(|x| 2.0 * x))
    }

    /// Vertices of a hull, shape (k, 3) [m]; none of other shapes.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let vertices = self.shape.vertices();
        let array = output(py, None, [vertices.len(), 3])?;
        elements(&array).copy_from_slice(vertices.as_flattened());
        Ok(array)
    }

    fn __repr__(&self) -> String {
        let radius = self.shape.radius();
        match self.shape.half_extents() {
            Some([0.0, 0.0, 0.0]) => format!("Shape.sphere({radius})"),
            Some([0.0, 0.0, half]) => format!("Shape.capsule({radius}, {})", 2.0 * half),
            Some(half) if radius == 0.0 => format!("Shape.cuboid({:?})", half.map(|x| 2.0 * x)),
            Some(half) => format!("Shape.cuboid({:?}).grown({radius})", half.map(|x| 2.0 * x)),
            None => format!("Shape.hull({} points)", self.shape.vertices().len()),
        }
    }
}

/// A shape that is part of a robot.
///
/// Parameters
/// ----------
/// name : str
///     Name, for messages and drawings.
/// link : int or str
///     What it is fixed to: link k, which moves with joints 0 to k; "base"; or "tool".
/// shape : Shape
///     The shape.
/// pose : array_like, shape (4, 4), optional
///     Its frame in that of the link, as `Robot.link_frames` gives them; that of the link itself if not given.
///
/// Raises
/// ------
/// InvalidValueError
///     If the link is no link, or the pose no frame.
#[pyclass(name = "Body", frozen, module = "redundancy._core")]
#[derive(Clone)]
pub struct PyBody {
    pub body: Body,
}

fn mount(link: &Bound<'_, PyAny>) -> PyResult<Mount> {
    let wrong =
        || Error::value("link", link.repr().map_or_else(|_| "?".into(), |r| r.to_string()), "'base', 'tool' or the number of a link");
    if let Ok(name) = link.extract::<String>() {
        return match name.as_str() {
            "base" => Ok(Mount::Base),
            "tool" => Ok(Mount::Tool),
            _ => Err(wrong().into()),
        };
    }
    match link.extract::<usize>() {
        Ok(k) if k < MAX_JOINTS => Ok(Mount::Link(k)),
        _ => Err(wrong().into()),
    }
}

#[pymethods]
impl PyBody {
    #[new]
    #[pyo3(signature = (name, link, shape, pose=None))]
    fn new(name: String, link: &Bound<'_, PyAny>, shape: &PyShape, pose: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let pose = pose.map_or(Ok(Frame::IDENTITY), |pose| read_frame("pose", pose))?;
        Ok(Self { body: Body { name, mount: mount(link)?, pose, shape: shape.shape.clone() } })
    }

    /// Name.
    #[getter]
    fn name(&self) -> &str {
        &self.body.name
    }

    /// What it is fixed to: the number of a link, "base" or "tool".
    #[getter]
    fn link(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        Ok(match self.body.mount {
            Mount::Base => "base".into_pyobject(py)?.into_any().unbind(),
            Mount::Tool => "tool".into_pyobject(py)?.into_any().unbind(),
            Mount::Link(k) => k.into_pyobject(py)?.into_any().unbind(),
        })
    }

    /// The shape.
    #[getter]
    fn shape(&self) -> PyShape {
        PyShape { shape: self.body.shape.clone() }
    }

    /// Its frame in that of the link, shape (4, 4).
    #[getter]
    fn pose<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.body.pose)
    }

    fn __repr__(&self) -> String {
        format!("Body({:?}, {:?})", self.body.name, self.body.mount)
    }
}

/// The collision elements of a URDF file as bodies of the robot that `Robot.from_urdf` reads with the same links.
///
/// Parameters
/// ----------
/// path : path-like
///     The file.
/// base, tip, limits : optional
///     As for `Robot.from_urdf`: the joints that these fix are fixed here, too.
/// search : sequence of path-like
///     Folders of packages, for mesh files named ``package://...``; beside the folders above the file.
///
/// Returns
/// -------
/// list of Body
///     Boxes, spheres, capsules (a cylinder becomes the capsule that holds it) and convex hulls of meshes (.stl, .obj).
///
/// Raises
/// ------
/// ModelError
///     If the file or a mesh cannot be read, or no link of the chain has a collision element.
#[pyfunction]
#[pyo3(name = "bodies_from_urdf", signature = (path, base=None, tip=None, search=Vec::new(), limits=None))]
pub fn bodies_from_urdf_py(
    path: PathBuf,
    base: Option<&str>,
    tip: Option<&str>,
    search: Vec<PathBuf>,
    limits: Option<&Bound<'_, PyMapping>>,
) -> PyResult<Vec<PyBody>> {
    let limits = read_joint_limits(limits)?;
    let asked = UrdfChain { base, tip, limits: &limits };
    Ok(ok(bodies_from_urdf_file(&path, &asked, &search))?.into_iter().map(|body| PyBody { body }).collect())
}

/// A capsule from the origin of every joint frame to that of the next: bodies for a robot of which nothing but its chain is known.
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot.
/// radius : float
///     Radius of every capsule [m].
///
/// Returns
/// -------
/// list of Body
///     Bodies on the base, the links and the tool, none where two origins coincide.
///
/// Raises
/// ------
/// InvalidValueError
///     If the radius is not above 0.
///
/// Notes
/// -----
/// Joint frames follow the robot's convention: with DH tables their origins may lie off the links, and a stretched prismatic joint leaves a gap.
#[pyfunction]
#[pyo3(name = "capsules_along_links")]
pub fn capsules_along_links_py(robot: &PyRobot, radius: f64) -> PyResult<Vec<PyBody>> {
    Ok(ok(capsules_along_links(&robot.robot, radius))?.into_iter().map(|body| PyBody { body }).collect())
}

/// Pairs of bodies that may collide with each other: those at least two joints apart, less those that are near anyway.
///
/// Parameters
/// ----------
/// robot : Robot
///     The robot.
/// bodies : sequence of Body
///     Its bodies.
/// reference : array_like, shape (n,)
///     A posture at which nothing collides [rad or m].
/// clearance : float
///     Distance [m] below which a pair is left out at that posture.
///
/// Returns
/// -------
/// list of tuple of int
///     Numbers of bodies.
///
/// Raises
/// ------
/// ShapeError, InvalidValueError
///     If the posture does not fit the robot, or a body names no link of it.
#[pyfunction]
#[pyo3(name = "self_collision_pairs", signature = (robot, bodies, reference, clearance=0.02))]
pub fn self_pairs_py(
    robot: &PyRobot,
    bodies: Vec<PyRef<'_, PyBody>>,
    reference: &Bound<'_, PyAny>,
    clearance: f64,
) -> PyResult<Vec<(usize, usize)>> {
    let mut posture = [0.0; MAX_JOINTS];
    let n = robot.robot.n();
    read_vector("reference", reference, n, &mut posture)?;
    let bodies: Vec<Body> = bodies.iter().map(|body| body.body.clone()).collect();
    Ok(ok(self_pairs(&robot.robot, &bodies, &posture[..n], clearance))?.into_iter().map(|[a, b]| (a, b)).collect())
}
