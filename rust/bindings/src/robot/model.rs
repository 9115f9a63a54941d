//! `redundancy.Robot`.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn};
use pyo3::basic::CompareOp;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyMapping, PyTuple};

use super::controller::{self, PyController};
use super::inverse::{Asked, read_fixed, read_samples, whole};
use super::pose;
use crate::array::{elements, map_rows, ok, output, read_vector, vector};
use crate::errors::PyResult;
use crate::results::SINGULARITY;
use crate::robot::coupled::{list, with_coupled};
use crate::robot::frames::{Maybe, finish, limits, matrices, matrix, named, placed, read_frame, read_links, read_place};
use crate::robot::joint_limits::read_joint_limits;
use crate::robot::mimic::{self, chain_letters, read_joints};
use crate::robot::tables::{dictionary, read_table, rebuilt_from};
use crate::task::PyTask;
use redundancy::error::Result;
use redundancy::inverse::{ArmAngle, Settings, Structure, TaskInverse, branch, singularity};
use redundancy::kinematics::{first_derivative, forward_into, jacobian_into, jacobian_rate, link_frames, second_derivative};
use redundancy::linalg::MAX_JOINTS;
use redundancy::robot::{AT_LIMIT, RandomPostures, Robot, UrdfChain, parse_joints};

/// An array of any shape.
type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// A serial robot: joints, fixed transforms, base, tool and limits; it never changes.
///
/// SI units and radians. A twist is [omega; v], angular part first, at the tool point, in the base frame; so are the rows of every
/// Jacobian. Methods take one posture ``q`` of shape (n,) or a batch of shape (N, n), whose results have a leading axis N; batches run on
/// every core with the GIL released. ``out`` receives the result instead of a new array: float64, C-contiguous, of the result's shape.
///
/// Raises
/// ------
/// ShapeError, NonFiniteError
///     If an array has the wrong shape or holds NaN or infinities.
#[pyclass(name = "Robot", frozen, eq, module = "redundancy._core")]
pub struct PyRobot {
    pub robot: Arc<Robot>,
    /// Made when first asked for.
    inverse: OnceLock<Result<TaskInverse>>,
    poses: pose::Solvers,
}

impl PartialEq for PyRobot {
    fn eq(&self, other: &Self) -> bool {
        self.robot == other.robot
    }
}

impl From<Robot> for PyRobot {
    fn from(robot: Robot) -> Self {
        Self { robot: Arc::new(robot), inverse: OnceLock::new(), poses: pose::Solvers::default() }
    }
}

#[pymethods]
impl PyRobot {
    /// A robot from its Denavit-Hartenberg table.
    ///
    /// Parameters
    /// ----------
    /// a, d, alpha, theta : array_like, shape (n,)
    ///     Lengths [m] and angles [rad]. Standard: ``T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)``; modified:
    ///     ``T_i = Rx(alpha) Tx(a) Rz(theta) Tz(d)``. The joint coordinate adds to theta (R) or d (P).
    /// joints : str, optional
    ///     One letter a joint, R or P; all R if not given.
    /// convention : {"standard", "modified"}
    ///     Which of the two products the table means.
    /// tool, base : array_like, shape (4, 4), optional
    ///     Tool frame in the frame of the last row; base frame in the world.
    /// q_min, q_max, qd_max, qdd_max : array_like, shape (n,), optional
    ///     Limits [rad or m, per s, per s^2]; infinite where not given.
    /// name : str
    ///     Name.
    /// coupled : sequence of (dict, float, float), optional
    ///     Limits on combinations of joints, at most 8: ``({1: 1.0, 2: 1.0}, low, high)`` is low <= q[1] + q[2] <= high, joints counted from 0; one
    ///     of the two may be infinite.
    /// joint_names : sequence of str, optional
    ///     A name for each joint coordinate, no two the same; "joint 1", "joint 2" and so on if not given.
    /// mimic : dict, optional
    ///     Joints that follow others: ``{joint: (driver, factor, offset)}``, counted from 0 along the table, stand at ``factor q_driver + offset``
    ///     [rad or m]. The coordinates of the robot are the other joints; limits are given for all of them, and those of a joint tighten those of
    ///     its driver, unless that leaves no range. Letters beyond the table are joints off the chain that only drive.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError, InvalidValueError, ModelError
    ///     If shapes disagree, numbers are not finite, a length is beyond 1e6 m, limits are inverted or a transform is not rigid.
    #[staticmethod]
    #[pyo3(signature = (a, d, alpha, theta, joints=None, convention="standard", tool=None, base=None, q_min=None, q_max=None, qd_max=None, qdd_max=None, name="robot", coupled=None, joint_names=None, mimic=None))]
    fn from_dh(
        a: &Bound<'_, PyAny>,
        d: &Bound<'_, PyAny>,
        alpha: &Bound<'_, PyAny>,
        theta: &Bound<'_, PyAny>,
        joints: Option<&str>,
        convention: &str,
        tool: Maybe<'_, '_>,
        base: Maybe<'_, '_>,
        q_min: Maybe<'_, '_>,
        q_max: Maybe<'_, '_>,
        qd_max: Maybe<'_, '_>,
        qdd_max: Maybe<'_, '_>,
        name: &str,
        coupled: Maybe<'_, '_>,
        joint_names: Option<Vec<String>>,
        mimic: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let table = read_table(convention, [a, d, alpha, theta])?;
        let letters = joints.map_or_else(|| "R".repeat(table.a.len()), String::from);
        let limits = [q_min, q_max, qd_max, qdd_max];
        let robot = match mimic {
            Some(mimic) => {
                let joints = read_joints(&letters, mimic, limits)?;
                named(placed(ok(Robot::from_dh_coupled(name, table, &joints))?, tool, base)?, joint_names)?.into()
            }
            None => finish(ok(Robot::from_dh(name, table, &letters))?, tool, base, limits, joint_names)?,
        };
        with_coupled(robot, coupled)
    }

    /// A robot from the chain between two links of a URDF file.
    ///
    /// Links, joints and, on the chain, origins, axes, limits and mimics are read; visuals, inertias, transmissions and whatever else a file
    /// has can refuse nothing. A joint without a lower and an upper limit has no limit of position (one of the two alone has the other at
    /// 0, as the format says); one without a limit of velocity, or with 0, as many exporters write, has none of speed, and one with zeros
    /// alone has none at all. A joint whose lower limit is its upper one is fixed there. An axis is taken at length one; none is x. Files of xacro have to be expanded first.
    ///
    /// Parameters
    /// ----------
    /// path : path-like
    ///     URDF file.
    /// base, tip : str, optional
    ///     Names of the first and last link; the root, and the only link at an end of what the base carries, if not given.
    /// tool : array_like, shape (4, 4), optional
    ///     Tool frame in the frame of the tip.
    /// limits : dict, optional
    ///     By names of joints, (low, high) or a dictionary with some of "low", "high" and "velocity" [rad or m, per s], in place of what the file
    ///     says; None leaves that. Joints beside the chain may be among them.
    ///
    /// Raises
    /// ------
    /// ModelError
    ///     If the file cannot be read, is no URDF, the tree has a fault or the chain is not serial or has more than 16 joints: with
    ///     file, line and the name of the link or joint.
    /// InvalidValueError
    ///     If a link or joint does not exist (the message lists those that do), or limits are given in another way.
    #[staticmethod]
    #[pyo3(signature = (path, base=None, tip=None, tool=None, limits=None))]
    fn from_urdf(
        path: PathBuf,
        base: Option<&str>,
        tip: Option<&str>,
        tool: Maybe<'_, '_>,
        limits: Option<&Bound<'_, PyMapping>>,
    ) -> PyResult<Self> {
        let limits = read_joint_limits(limits)?;
        finish(ok(Robot::from_urdf_file(&path, &UrdfChain { base, tip, limits: &limits }))?, tool, None, [None; 4], None)
    }

    /// A robot from the fixed transforms ahead of each joint, which moves about or along z, and the one after the last.
    ///
    /// Parameters
    /// ----------
    /// links : array_like, shape (n, 4, 4)
    ///     Fixed transforms ahead of the joints.
    /// flange : array_like, shape (4, 4)
    ///     Fixed transform after the last joint.
    /// joints : str
    ///     One letter a joint, R or P.
    /// tool, base, q_min, q_max, qd_max, qdd_max, name, coupled, joint_names, mimic
    ///     As for `from_dh`.
    #[staticmethod]
    #[pyo3(signature = (links, flange, joints, tool=None, base=None, q_min=None, q_max=None, qd_max=None, qdd_max=None, name="robot", coupled=None, joint_names=None, mimic=None))]
    fn from_links(
        links: &Bound<'_, PyAny>,
        flange: &Bound<'_, PyAny>,
        joints: &str,
        tool: Maybe<'_, '_>,
        base: Maybe<'_, '_>,
        q_min: Maybe<'_, '_>,
        q_max: Maybe<'_, '_>,
        qd_max: Maybe<'_, '_>,
        qdd_max: Maybe<'_, '_>,
        name: &str,
        coupled: Maybe<'_, '_>,
        joint_names: Option<Vec<String>>,
        mimic: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let frames = read_links(links)?;
        let flange = read_frame("flange", flange)?;
        let limits = [q_min, q_max, qd_max, qdd_max];
        let robot = match mimic {
            Some(mimic) => {
                let joints = read_joints(joints, mimic, limits)?;
                named(placed(ok(Robot::new_coupled(name, &joints, &frames, flange))?, tool, base)?, joint_names)?.into()
            }
            None => finish(ok(Robot::new(name, &ok(parse_joints(joints))?, &frames, flange))?, tool, base, limits, joint_names)?,
        };
        with_coupled(robot, coupled)
    }

    /// Number of joint coordinates: of joints, less those that follow others.
    #[getter]
    fn n(&self) -> usize {
        self.robot.n()
    }

    /// Name.
    #[getter]
    fn name(&self) -> &str {
        self.robot.name()
    }

    /// One letter a joint coordinate, R (revolute) or P (prismatic).
    #[getter]
    fn joints(&self) -> String {
        self.robot.joint_letters()
    }

    /// Name of every joint: "joint 1", "joint 2" and so on unless it has another.
    #[getter]
    fn joint_names<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        Ok(PyTuple::new(py, self.robot.joint_names())?)
    }

    /// Joint ``joint``, counted from 0, as people count and call it: "joint 3", "joint 3 (elbow)".
    fn joint_label(&self, joint: usize) -> String {
        self.robot.joint_label(joint)
    }

    /// One letter a joint of the chain, those that follow others among them, then one for each joint off it that drives some: what `from_links`
    /// takes beside `mimic`. The same as ``joints`` where no joint follows another.
    #[getter]
    fn chain(&self) -> String {
        chain_letters(&self.robot)
    }

    /// Joints of the chain that follow others, ``{joint: (driver, factor, offset)}``, counted from 0 along ``chain``; empty for most robots.
    #[getter]
    fn mimic<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        mimic::dictionary(py, &self.robot)
    }

    /// The joint of ``chain`` that each joint coordinate is: 0 to n - 1 where no joint follows another.
    #[getter]
    fn coordinates(&self) -> Vec<usize> {
        mimic::places(&self.robot)
    }

    /// Whether a whole turn of a joint coordinate takes the robot to where it was, shape (n,): of revolute joints, if none follows them by a part
    /// of a turn.
    #[getter]
    fn periodic<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, (0..self.robot.n()).map(|i| self.robot.is_periodic(i)))
    }

    /// Lower position limits, shape (n,) [rad or m]; -inf where there is none.
    #[getter]
    fn q_min<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.robot.limits().q_min)
    }

    /// Upper position limits, shape (n,) [rad or m]; inf where there is none.
    #[getter]
    fn q_max<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.robot.limits().q_max)
    }

    /// Speed limits, shape (n,) [rad/s or m/s]; inf where there is none.
    #[getter]
    fn qd_max<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.robot.limits().qd_max)
    }

    /// Acceleration limits, shape (n,) [rad/s^2 or m/s^2]; inf where there is none.
    #[getter]
    fn qdd_max<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.robot.limits().qdd_max)
    }

    /// Tool frame in the flange frame, shape (4, 4).
    #[getter]
    fn tool<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.robot.tool())
    }

    /// Base frame in the world, shape (4, 4).
    #[getter]
    fn base<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.robot.base())
    }

    /// Fixed transform after the last joint, without the tool, shape (4, 4).
    #[getter]
    fn flange<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.robot.flange())
    }

    /// Fixed transforms ahead of the joints of the chain, without the base, shape (m, 4, 4); m is n where no joint follows another.
    #[getter]
    fn links<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        matrices(py, self.robot.bare_links())
    }

    /// The DH table it was made from (convention, a, d, alpha, theta), or None.
    #[getter]
    fn dh<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        self.robot.dh().map(|table| dictionary(py, table)).transpose()
    }

    /// Tool frame in the base frame, shape (4, 4) (batch: (N, 4, 4)).
    #[pyo3(signature = (q, out=None))]
    fn fk<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, out: Maybe<'_, 'py>) -> PyResult<Array<'py>> {
        let robot = &*self.robot;
        map_rows::<2, 3>(py, robot.n(), q, out, [4, 4], |q, out| forward_into(robot, q, out))
    }

    /// Geometric Jacobian, shape (6, n) (batch: (N, 6, n)): rows [omega; v], angular first, at the tool point, in the base frame
    /// (Leger 2014, eq. 1.2).
    #[pyo3(signature = (q, out=None))]
    fn jacobian<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, out: Maybe<'_, 'py>) -> PyResult<Array<'py>> {
        let robot = &*self.robot;
        map_rows::<2, 3>(py, robot.n(), q, out, [6, robot.n()], |q, out| jacobian_into(robot, q, out))
    }

    /// Derivative of the Jacobian, shape (6, n, n) (batch: (N, 6, n, n)): ``[:, i, k]`` is dJ_i/dq_k (Leger 2014, eq. 3.10 to 3.22).
    #[pyo3(signature = (q, out=None))]
    fn jacobian_derivative<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, out: Maybe<'_, 'py>) -> PyResult<Array<'py>> {
        let robot = &*self.robot;
        let n = robot.n();
        map_rows::<3, 4>(py, n, q, out, [6, n, n], |q, out| first_derivative(robot, q, out))
    }

    /// Second derivative of the Jacobian, shape (6, n, n, n) (batch: (N, 6, n, n, n)): ``[:, i, k, l]`` is d2J_i/dq_k dq_l
    /// (Leger 2014, eq. 3.41, 3.42).
    #[pyo3(signature = (q, out=None))]
    fn jacobian_second_derivative<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, out: Maybe<'_, 'py>) -> PyResult<Array<'py>> {
        let robot = &*self.robot;
        let n = robot.n();
        map_rows::<4, 5>(py, n, q, out, [6, n, n, n], |q, out| second_derivative(robot, q, out))
    }

    /// Time derivative of the Jacobian at rates ``qd``, shape (6, n); one posture at a time.
    #[pyo3(signature = (q, qd, out=None))]
    fn jacobian_rate<'py>(
        &self,
        py: Python<'py>,
        q: &Bound<'py, PyAny>,
        qd: &Bound<'py, PyAny>,
        out: Maybe<'_, 'py>,
    ) -> PyResult<Array<'py>> {
        let n = self.robot.n();
        let (mut posture, mut rates) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        read_vector("q", q, n, &mut posture)?;
        read_vector("qd", qd, n, &mut rates)?;
        let array = output(py, out, [6, n])?;
        ok(jacobian_rate(&self.robot, &posture[..n], &rates[..n], elements(&array)))?;
        Ok(array)
    }

    /// Rows of the Jacobian in which the tool can move at all: 0 to 2 (angular) and 3 to 5 (linear).
    ///
    /// Returns
    /// -------
    /// list of int
    ///     All six for most robots; 2, 3 and 4 for a planar one in the x-y plane.
    fn rows_in_use(&self) -> Vec<usize> {
        self.robot.rows_in_use()
    }

    /// Frames of the links after each joint's motion and of the tool, in the base frame, shape (m + 1, 4, 4) for the m joints of the chain; for
    /// drawings. m is n where no joint follows another.
    fn link_frames<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let mut posture = [0.0; MAX_JOINTS];
        read_vector("q", q, self.robot.n(), &mut posture)?;
        matrices(py, &ok(link_frames(&self.robot, &posture[..self.robot.n()]))?)
    }

    /// The same robot with another tool frame (4, 4) in its flange frame.
    fn with_tool(&self, tool: &Bound<'_, PyAny>) -> PyResult<Self> {
        let tool = read_place("tool", tool)?;
        Ok(self.robot.with_tool(tool).into())
    }

    /// The same robot with another base frame (4, 4) in the world.
    fn with_base(&self, base: &Bound<'_, PyAny>) -> PyResult<Self> {
        let base = read_place("base", base)?;
        Ok(self.robot.with_base(base).into())
    }

    /// The same robot with other limits; those not given stay.
    ///
    /// Parameters
    /// ----------
    /// q_min, q_max, qd_max, qdd_max : array_like, shape (n,), optional
    ///     Limits of position, speed and acceleration [rad or m, per s, per s^2].
    /// coupled : sequence of (dict, float, float), optional
    ///     Limits on combinations of joints, in the place of all that there are (see `from_dh`); an empty one takes them away.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError, InvalidValueError
    ///     If shapes disagree, a coefficient is not finite, limits are inverted, or a combination has no joint.
    #[pyo3(signature = (q_min=None, q_max=None, qd_max=None, qdd_max=None, coupled=None))]
    fn with_limits(
        &self,
        q_min: Maybe<'_, '_>,
        q_max: Maybe<'_, '_>,
        qd_max: Maybe<'_, '_>,
        qdd_max: Maybe<'_, '_>,
        coupled: Maybe<'_, '_>,
    ) -> PyResult<Self> {
        let limits = limits(&self.robot, [q_min, q_max, qd_max, qdd_max])?;
        with_coupled(ok(self.robot.with_limits(limits))?.into(), coupled)
    }

    /// Limits on combinations of joints: ``[({joint: coefficient}, low, high), ...]``, joints counted from 0 [rad or m].
    #[getter]
    fn coupled_limits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        list(py, &self.robot)
    }

    /// Whether a posture is within the position limits of all joints and combinations of them, or on one.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,) or (N, n)
    ///     Joint coordinates [rad or m].
    ///
    /// Returns
    /// -------
    /// bool or ndarray of bool, shape (N,)
    ///     True up to 1e-9 beyond a limit: so far a posture is on it. The same everywhere in the package.
    fn within_limits<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        Ok(self.limit_margin(py, q)?.rich_compare(-AT_LIMIT, CompareOp::Ge)?)
    }

    /// Smallest distance of a posture to a position limit.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,) or (N, n)
    ///     Joint coordinates [rad or m].
    ///
    /// Returns
    /// -------
    /// float or ndarray, shape (N,)
    ///     Negative beyond a limit, inf without any [rad, or m of a prismatic joint]. The distance to a limit on a combination of joints is that of its value
    ///     over the length of its row of coefficients: how far the joints are from it.
    fn limit_margin<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let robot = &*self.robot;
        let margin = |q: &[f64], out: &mut [f64]| {
            out[0] = robot.limits().margin(q);
            Ok(())
        };
        // A scalar array becomes a number.
        Ok(map_rows::<0, 1>(py, robot.n(), q, None, [], margin)?.get_item(())?)
    }

    /// Its joints as its controller shows and takes them; the same ones, called J1, J2, ..., if nothing else is known.
    #[getter]
    fn controller(&self) -> PyController {
        controller::of(&self.robot)
    }

    /// The same robot with another map to the joints of its controller, ``p = matrix q + offset``; without arguments the same coordinates.
    ///
    /// Everything that computes takes the robot's own joints q. What is written and shown in the controller's says so.
    ///
    /// Parameters
    /// ----------
    /// matrix : array_like, shape (n, n), optional
    ///     What the robot's joints add to each of the controller's; invertible.
    /// offset : array_like, shape (n,), optional
    ///     The controller's joints where the robot's are zero [rad or m]; zeros if not given.
    /// signs : array_like, shape (n,), optional
    ///     Instead of a matrix, its diagonal: 1, or -1 where the controller counts the other way.
    /// coupling : dict, optional
    ///     Beside signs, entries ``{(i, k): factor}``, joints counted from 0: joint i of the controller moves with joint k of the robot by that factor,
    ///     too. FANUC measures joint 3 against the horizontal: ``{(2, 1): -1.0}``.
    /// names : list of str, optional
    ///     Names of the controller's joints; J1, J2, ... if not given.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError, InvalidValueError
    ///     If shapes disagree, the matrix has no inverse, is given beside its parts, or names are not different ones.
    #[pyo3(signature = (matrix=None, offset=None, signs=None, coupling=None, names=None))]
    fn with_controller(
        &self,
        matrix: Maybe<'_, '_>,
        offset: Maybe<'_, '_>,
        signs: Maybe<'_, '_>,
        coupling: Option<&Bound<'_, PyDict>>,
        names: Option<Vec<String>>,
    ) -> PyResult<Self> {
        let controller = controller::read(self.robot.n(), matrix, offset, signs, coupling, names)?;
        Ok(ok(self.robot.with_controller(controller))?.into())
    }

    /// The same robot under another name.
    fn with_name(&self, name: &str) -> Self {
        self.robot.with_name(name).into()
    }

    /// The same robot with other names of its joints.
    ///
    /// Raises
    /// ------
    /// ShapeError, InvalidValueError
    ///     If there is not one for each joint, or one is empty or there twice.
    fn with_joint_names(&self, names: Vec<String>) -> PyResult<Self> {
        Ok(ok(self.robot.with_joint_names(&names))?.into())
    }

    /// The same robot with some joints held: ``{joint: coordinate}``, joints counted from 0, coordinates in rad or m. The others are its joints.
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If there is no such joint, or none is left.
    fn with_fixed(&self, fixed: &Bound<'_, PyDict>) -> PyResult<Self> {
        Ok(ok(self.robot.with_fixed(&read_fixed(fixed)?))?.into())
    }

    /// The middle posture, shape (n,) [rad or m]: each joint in the middle of its range; where it lacks a limit, next to 0.
    #[getter]
    fn middle<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        vector(py, &self.robot.middle())
    }

    /// The same posture with revolute joints by whole turns nearest to the middle of their ranges: within the limits if any copy is.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    ///
    /// Returns
    /// -------
    /// ndarray, shape (n,)
    ///     The posture, nearest to 0 where a joint has no limits, to its limit where it has one and is beyond it.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError
    ///     If ``q`` has the wrong shape or a number that is not finite.
    fn turned<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (n, mut posture) = (self.robot.n(), [0.0; MAX_JOINTS]);
        read_vector("q", q, n, &mut posture)?;
        self.robot.turn(&mut posture[..n]);
        Ok(vector(py, &posture[..n]))
    }

    /// Random postures within the limits.
    ///
    /// Parameters
    /// ----------
    /// count : int
    ///     How many.
    /// seed : int
    ///     The same seed gives the same postures.
    ///
    /// Returns
    /// -------
    /// ndarray, shape (count, n)
    ///     Uniform within the limits [rad or m]; a joint without limits turns within a turn about 0 or slides within 1 m to each side, one with
    ///     a single limit as much next to it.
    #[pyo3(signature = (count, seed=0))]
    fn random_postures<'py>(&self, py: Python<'py>, count: usize, seed: u64) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let array = output(py, None, [count, self.robot.n()])?;
        let mut postures = RandomPostures::new(seed);
        elements(&array).chunks_exact_mut(self.robot.n()).for_each(|q| postures.fill(&self.robot, q));
        Ok(array)
    }

    /// Every posture in which the tool does its task at a frame, or at each of many.
    ///
    /// Parameters
    /// ----------
    /// pose : array_like, shape (4, 4) or (N, 4, 4)
    ///     The tool frame in the base frame [m], or many of them: these are solved on every core, with the GIL released.
    /// task : Task, optional
    ///     What of the frame matters; all of it if not given, also for robots of fewer than six joints, which then have postures only where they
    ///     can reach the whole frame. ``Task.axisymmetric()`` is for five joints and the tool's axis, ``Task.position()`` for three joints.
    ///     With ``Task.within(volume)`` the pose is the frame that the volume is about, and the whole frame is reached with the member that is nearest: to the
    ///     tool at ``near``, or without to the pose itself; or, with three ``samples``, with each member of a grid.
    /// near : array_like, shape (n,), optional
    ///     A posture [rad or m], such as where the robot stands: the answer is in order of the Euclidean norm of the difference from it, joints by the
    ///     whole turn nearest to it (with ``limits`` the nearest that they allow). A joint that may be chosen in a singular posture is where this
    ///     posture has it, or as near as it can be. With many poses one for all, or (N, n), one for each.
    /// fixed : dict of int to float, optional
    ///     Joints that are held, counted from 0, and where [rad or m]: for robots of more joints than the task takes.
    /// arm_angle : float, optional
    ///     Instead of a held joint, the angle of the arm's plane [rad] (see `arm_angle`).
    /// samples : int or (int, int, int), optional
    ///     For a robot with one joint more than the task takes: one is held at so many values over its limits (a turn without), and the postures of
    ///     all of them are returned; with ``near`` also those with its value. The joint is the one whose holding leaves a closed form, of several the one
    ///     with the largest share in the self-motion. Never complete. Three numbers are those of `OrientationVolume.grid`, of tilts, headings and spins: then the answer has the postures of all
    ///     members, for one pose.
    /// limits : bool
    ///     Whether only postures within the position limits are returned.
    /// turns : bool
    ///     Whether a joint that can reach the same place in several whole turns is returned in all of them; implies ``limits``.
    /// report : bool
    ///     Whether to tell about singularities and completeness.
    ///
    /// Returns
    /// -------
    /// q : ndarray, shape (k, n)
    ///     Postures [rad or m], k from 0 to 16 (more with ``turns`` and ``samples``); without ``near`` each joint within half a turn of the middle of its
    ///     range (of 0 without limits), in the order of their branches where `branch` has names for them, else of joint 1, then joint 2 and so on. Each
    ///     does the task to 1e-10 (rad, and m over the size of the robot; to 1e-8 where the task asks for more than the robot
    ///     has joints) and none comes twice.
    /// frame : ndarray of int, shape (K,)
    ///     With many poses: the number of the pose of each posture, counted from 0.
    /// member : ndarray of int, shape (k,)
    ///     With three ``samples``: the member of each posture, as its place in the grid.
    /// singular : ndarray of bool, shape (k,)
    ///     With ``report``: whether branches meet in this posture, or a joint of it may be chosen (without ``near`` it is 0 then; with
    ///     ``limits`` as near to it as these let).
    /// complete : bool
    ///     With ``report``: false where there may be others (a continuum, a geometry that defeats the elimination, or one that is searched). With many poses
    ///     (N,), one each.
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError
    ///     If an array has the wrong shape or holds NaN or infinities; the message has the number of the pose, ``pose[3]``.
    /// InvalidValueError
    ///     If a pose is no rigid transform, if joints are to spare (the message tells which can be held), or the arm has no arm angle.
    ///
    /// Notes
    /// -----
    /// Closed forms for three neighbouring axes through a point (Pieper 1968; the other three joints revolute or prismatic in any order, before or
    /// behind it), for three parallel ones and for three prismatic joints anywhere; other geometries of six revolute joints by elimination to a
    /// polynomial of degree 16 (Raghavan and Roth 1993). Polished by Newton where rounding shows. A motion that the task leaves free counts as a
    /// joint at the tool, and where there are fewer than six, joints that stay at 0 make six. What has no such form (one or two prismatic joints
    /// without a wrist; a task whose free motion is no joint's) is searched by Newton from many starts, and told to be incomplete.
    #[pyo3(signature = (pose, *, task=None, near=None, fixed=None, arm_angle=None, samples=None, limits=false, turns=false, report=false))]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        pose: &Bound<'py, PyAny>,
        task: Option<&PyTask>,
        near: Maybe<'_, 'py>,
        fixed: Option<&Bound<'py, PyDict>>,
        arm_angle: Option<f64>,
        samples: Maybe<'_, 'py>,
        limits: bool,
        turns: bool,
        report: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let volume = task.and_then(|task| task.volume.as_ref());
        let task = task.filter(|_| volume.is_none()).map(|task| task.task);
        let samples = samples.map(read_samples).transpose()?;
        Asked { task, volume, near, fixed, arm_angle, samples, limits, turns, report }.answer(py, &self.robot, &self.inverse, pose)
    }

    /// One posture that takes the tool to a pose, or as near to it as may be; one each of many.
    ///
    /// Parameters
    /// ----------
    /// target : array_like, shape (4, 4) or (N, 4, 4), or (k,) or (N, k)
    ///     Where the tool has to be, in the base frame: poses, or targets of a task of `Task.target_size` k numbers (position and axis, or position).
    /// q0 : array_like, shape (n,) or (N, n), optional
    ///     Where the search starts, and what the answer is to be near to where there is a choice; the middle posture if not given.
    /// method : {"auto", "closed", "newton", "hybrid", "descent"}
    ///     "auto": the nearest of all postures where six joints have a closed form; else damped Newton from q0 and from postures whose tools are near
    ///     the target, and for six joints without a closed form elimination where that fails. "closed": the nearest of all postures, whatever they
    ///     take. "newton": without a closed form. "hybrid": with two sweeps of coordinate descent from each start ahead. "descent": these alone, from q0.
    /// task : Task, optional
    ///     What of the pose matters; all if not given.
    /// limits : bool
    ///     Whether the posture is held within the position limits.
    /// position_tolerance, orientation_tolerance : float
    ///     Errors [m, rad] at which the pose is reached. As a rule what is left is far less.
    /// iterations : int
    ///     Steps from one start at most.
    /// restarts : int
    ///     Starts beside q0 at most.
    /// seed : int
    ///     Of the random starts: the same seed, the same answer.
    /// trace : bool
    ///     Whether to keep the cost at every posture on the way (of one target).
    ///
    /// Returns
    /// -------
    /// PoseSolution
    ///     ``q``, ``status``, ``position_error``, ``orientation_error``, ``iterations``, ``restarts``, ``cost`` and ``trace``; of many targets arrays of them. The status is "converged" where both errors are within
    ///     their tolerances. Else the posture is the nearest that was found, and the status "unreachable" where the pose is known to be out of reach (it is
    ///     farther away than the robot is long, or no posture of a closed form is within the limits), "stationary" where no small motion within the limits
    ///     brings the tool nearer, by the cost ``|dp|^2 + L^2/2 |R - R_d|_F^2`` with L a third of the links in line, or "out of iterations".
    ///
    /// Raises
    /// ------
    /// ShapeError, NonFiniteError
    ///     If an array has the wrong shape or holds NaN or infinities.
    /// InvalidValueError
    ///     If a pose is no rigid transform, or a setting is not one of these.
    ///
    /// Notes
    /// -----
    /// The cost is that of From and Gravdahl (2007, eqs. 14, 36) with weights 1 and L^2/2, near the target ``|dp|^2 + L^2 angle^2``. The GIL is released and every
    /// core used for many targets. Singular postures and postures on limits are as good targets as others.
    #[pyo3(signature = (target, q0=None, method="auto", *, task=None, limits=true, position_tolerance=1e-4, orientation_tolerance=1e-3, iterations=40, restarts=300, seed=0, trace=false))]
    fn solve_pose<'py>(
        &self,
        py: Python<'py>,
        target: &Bound<'py, PyAny>,
        q0: Maybe<'_, 'py>,
        method: &str,
        task: Option<&PyTask>,
        limits: bool,
        position_tolerance: f64,
        orientation_tolerance: f64,
        iterations: usize,
        restarts: usize,
        seed: u64,
        trace: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let method = pose::read_method(method)?;
        let settings = Settings { method, position: position_tolerance, orientation: orientation_tolerance, iterations, restarts, seed };
        let asked = pose::Asked { q0, task, limits, trace, settings };
        asked.answer(py, &self.robot, &self.poses, &self.inverse, target)
    }

    /// The name of a posture's branch: shoulder, elbow and wrist, as in ``"front, up, no flip"``.
    ///
    /// Shoulder: "front" where the centre of the wrist (with three parallel axes: where axes 5 and 6 meet) is on the side of axis 1 on which axis 2 is,
    /// "back" on the other; where axes 1 and 2 meet, "right" on the side of z1 x z2, else "left" (a right arm lifts its wrist when joint 2 turns forward).
    /// Elbow: "up" above the line from shoulder to wrist, seen with the wrist ahead, else "down". Wrist: "no flip" where joint 5 is turned from in line
    /// in its positive sense, ``(z5 x z4) . z6 > 0``, else "flip". Axis 1 counts as pointing up, from the base to axis 2. Each word is the sign of a
    /// factor of det J, so that it changes at a singularity alone (where either may be told) and the postures of one pose have different names.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    ///
    /// Returns
    /// -------
    /// str
    ///     "none" for robots other than six revolute joints with axes 2 and 3 parallel and axes 4, 5 and 6 through a point, or with axes 2, 3 and 4
    ///     parallel and axes 5 and 6 meeting.
    ///
    /// Notes
    /// -----
    /// The words are those of Lee and Ziegler (1984), for arms with a shoulder offset those of their makers.
    fn branch(&self, q: &Bound<'_, PyAny>) -> PyResult<String> {
        let mut posture = [0.0; MAX_JOINTS];
        read_vector("q", q, self.robot.n(), &mut posture)?;
        Ok(ok(branch(&self.robot, &posture[..self.robot.n()]))?.map_or("none".into(), |branch| branch.to_string()))
    }

    /// How near a posture is to a singularity, and which one.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (n,)
    ///     Joint coordinates [rad or m].
    /// tolerance : float
    ///     Smallest singular value below which the posture counts as singular.
    ///
    /// Returns
    /// -------
    /// kind : str
    ///     "regular"; for robots whose branches have names "shoulder", "elbow", "wrist" or several of them, as in ``"shoulder, wrist"``: which factors of
    ///     det J vanish; for others "singular".
    /// value : float
    ///     Smallest of the min(6, n) singular values of the Jacobian without units: linear rows over the size of the robot (its links in line), sliding
    ///     joints in multiples of that.
    /// twist : ndarray, shape (6,), or None
    ///     The unit motion [omega; v over the size], in the base frame, that the tool makes least of: none at a singularity. None for fewer than
    ///     six joints.
    /// joints : ndarray, shape (n,), or None
    ///     The unit motion of the joints that moves the tool least. None for more than six joints.
    #[pyo3(signature = (q, tolerance=1e-6))]
    fn singularity<'py>(&self, py: Python<'py>, q: &Bound<'py, PyAny>, tolerance: f64) -> PyResult<Bound<'py, PyAny>> {
        let mut posture = [0.0; MAX_JOINTS];
        read_vector("q", q, self.robot.n(), &mut posture)?;
        let found = ok(singularity(&self.robot, &posture[..self.robot.n()], tolerance))?;
        let (twist, joints) = (found.twist.map(|twist| vector(py, &twist)), found.joints.map(|joints| vector(py, &joints)));
        Ok(SINGULARITY.make(py, (found.kind, found.value, twist, joints))?)
    }

    /// What the inverse kinematics of whole frames is built on: "wrist" (three neighbouring revolute axes meet in a point), "parallel" (three
    /// neighbouring axes are parallel) or "general" for six revolute joints; "wrist" or "sliding" (three joints slide, three turn) for six joints
    /// some of which are prismatic; of a robot of fewer joints, that of six joints of which it is a part; "search" where none of these is known;
    /// "none" where joints are to spare.
    #[getter]
    fn structure(&self) -> &'static str {
        match whole(&self.robot, &self.inverse).map(TaskInverse::structure) {
            Ok(Some(Structure::Wrist { .. })) => "wrist",
            Ok(Some(Structure::Parallel { .. })) => "parallel",
            Ok(Some(Structure::General)) => "general",
            Ok(Some(Structure::Sliding)) => "sliding",
            Ok(None) => "search",
            Err(_) => "none",
        }
    }

    /// The angle of the arm's plane [rad], for seven revolute joints of which the first three and the last three meet in a point each.
    ///
    /// The plane holds shoulder, wrist and upper arm (axis 3); its angle about the line from shoulder to wrist is counted from the plane that holds
    /// axis 1 (Shimizu et al. 2008). NaN where the arm is straight or points along axis 1.
    ///
    /// Parameters
    /// ----------
    /// q : array_like, shape (7,)
    ///     Joint coordinates [rad].
    ///
    /// Raises
    /// ------
    /// InvalidValueError
    ///     If the axes do not meet.
    fn arm_angle(&self, q: &Bound<'_, PyAny>) -> PyResult<f64> {
        let arm = ok(ArmAngle::new(&self.robot))?;
        let mut posture = [0.0; MAX_JOINTS];
        read_vector("q", q, 7, &mut posture)?;
        Ok(arm.of(&posture[..7]))
    }

    fn __repr__(&self) -> String {
        format!("Robot({:?}, joints={:?})", self.robot.name(), self.robot.joint_letters())
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (class, robot) = (slf.py().get_type::<Self>(), &slf.get().robot);
        match robot.controller() {
            None => rebuilt_from(&class, robot),
            Some(map) => {
                let plain = Self::from(ok(robot.with_controller(None))?);
                controller::rebuilt(&class, plain.into_pyobject(slf.py())?.into_any(), map)
            }
        }
    }
}
