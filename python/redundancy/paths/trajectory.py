"""What a robot does along a toolpath."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from .. import plots, robots
from .._core import PathData, Robot
from .._util import F64, Joints, checked
from ..errors import InvalidValueError, RedundancyError, ToolpathError
from ..files import TrajectoryColumns, formatted, read_trajectory, write_atomically
from ..robots import Dynamics, TorqueFunction
from .motion import length_along
from .optimal_times import MotionBounds, least_times
from .toolpath import Toolpath

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SAME_TOOL = 1e-6
"""How well the distance of the tool to the path and the error in a file agree for the robot that wrote it [m]."""


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Joint coordinates along a toolpath, with what they are worth.

    Attributes
    ----------
    robot : Robot
        The robot.
    path : Toolpath
        The path that was followed, N points.
    q : ndarray, shape (N, n)
        Joint coordinates [rad or m].
    condition_number : ndarray, shape (N,)
        kappa_F with ``length``; inf at a singularity, NaN where it is not defined (fewer joints than rows that move).
    value : ndarray, shape (N,)
        Objective.
    position_error : ndarray, shape (N,)
        Distance of the tool point to the path [m].
    axis_error : ndarray, shape (N,)
        Angle of the tool to the axis, or the orientation, of the path [rad].
    status : list of str
        For each point "converged", "on target" (limits or rounding stopped the objective) or "unreachable".
    length : float or None
        Length that made the condition number homogeneous [m].
    iterations : int
        Steps of the solver altogether.
    """

    robot: Robot
    path: Toolpath
    q: F64
    condition_number: F64
    value: F64
    position_error: F64
    axis_error: F64
    status: list[str]
    length: float | None = None
    iterations: int = 0

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.q)

    def __repr__(self) -> str:
        return f"Trajectory({self.robot.name}, {len(self)} points, max kappa_F {self.max_condition_number:.6g})"

    @property
    def time(self) -> F64 | None:
        """Times of the path [s], shape (N,), if it has any."""
        return self.path.time

    @property
    def max_condition_number(self) -> float:
        """Largest condition number of the path."""
        return float(self.condition_number.max())

    @property
    def mean_condition_number(self) -> float:
        """Mean condition number of the points."""
        return float(self.condition_number.mean())

    @property
    def margins(self) -> F64:
        """Distances of joints to their nearer limits [rad or m], shape (N, n); negative beyond, inf without one."""
        margins: F64 = np.minimum(self.q - self.robot.q_min, self.robot.q_max - self.q)
        return margins

    @property
    def limit_margin(self) -> float:
        """Smallest distance to a position limit, of a joint or of a combination (`Robot.limit_margin`) [rad or m]."""
        return float(self.robot.limit_margin(self.q).min())

    @property
    def joint_speed(self) -> F64 | None:
        """Mean joint speeds from each point to the next [rad/s or m/s], shape (N, n); None without times.

        The last row repeats the one before. A jump from one point to the next shows in full.
        """
        if self.time is None:
            return None
        if len(self) == 1:
            return np.zeros_like(self.q)
        speed = np.diff(self.q, axis=0) / np.diff(self.time)[:, None]
        return np.vstack([speed, speed[-1:]])

    @property
    def max_joint_speed(self) -> float | None:
        """Largest joint speed [rad/s; m/s where the joint is prismatic]; None without times."""
        speed = self.joint_speed
        return None if speed is None else float(np.abs(speed).max())

    @property
    def steps(self) -> F64:
        """Motions of the joints from point to point [rad or m], shape (N - 1, n); 0 where one is not reached."""
        reached = np.array([status != "unreachable" for status in self.status])
        steps: F64 = np.where((reached[1:] & reached[:-1])[:, None], np.diff(self.q, axis=0), 0.0)
        return steps

    @property
    def largest_step(self) -> float:
        """Largest motion of a joint from point to point [rad or m]: what ``max_step`` of plans bounds."""
        return float(np.abs(self.steps).max(initial=0.0))

    @property
    def largest_step_at(self) -> int:
        """The point from which it goes, counted from 0."""
        return self._largest(range(self.robot.n))[0]

    @property
    def largest_step_joint(self) -> int:
        """The joint whose motion it is, counted from 0."""
        return self._largest(range(self.robot.n))[1]

    @property
    def largest_step_told(self) -> str:
        """The largest step in words, "14.2 deg of joint 4, from point 50"; for turning and for sliding joints."""
        kinds = [[i for i, joint in enumerate(self.robot.joints) if joint == kind] for kind in "RP"]
        told = []
        for unit, factor, joints in zip(("deg", "mm"), (180.0 / np.pi, 1000.0), kinds, strict=True):
            if joints:
                point, joint = self._largest(joints)
                step = factor * abs(self.steps[point, joint]) if len(self) > 1 else 0.0
                told.append(f"{step:.3g} {unit} of {self.robot.joint_label(joint)}, from point {point}")
        return "; ".join(told)

    def _largest(self, joints: Sequence[int]) -> tuple[int, int]:
        """Return point and joint of the largest step of some joints."""
        if len(self) < 2:
            return 0, joints[0]
        steps = np.abs(self.steps[:, joints])
        point, at = np.unravel_index(int(steps.argmax()), steps.shape)
        return int(point), joints[int(at)]

    @property
    def unreachable(self) -> list[int]:
        """Points that were not reached, counted from 0."""
        return [point for point, status in enumerate(self.status) if status == "unreachable"]

    @property
    def spin(self) -> F64:
        """Angle that the tool has turned about its axis since the first point [rad], shape (N,), unwrapped.

        It is the angle of the tool frame's x axis (y, where x is along the axis) from a perpendicular that is carried
        along the path by the smallest rotation from each axis to the next; a tool that does not spin keeps 0.
        """
        return PathData(self.path.position, self.path.axis).spin_along(self.robot, self.q)

    def timed(
        self,
        speed: float | None = None,
        *,
        method: Literal["constant", "toppra"] = "constant",
        rate: ArrayLike | None = None,
        acceleration: ArrayLike | None = None,
        torque: Dynamics | TorqueFunction | None = None,
        torque_limit: ArrayLike | None = None,
        start_speed: float = 0.0,
        end_speed: float = 0.0,
    ) -> Self:
        """Return the trajectory with times: at a constant speed of the tool, or as fast as limits allow.

        Parameters
        ----------
        speed : float, optional
            Constant speed of the tool point [m/s], such as that of `constant_speed`; for "constant" alone.
        method : {"constant", "toppra"}
            "toppra": time-optimal along the postures (Pham and Pham 2018), which a cubic spline joins.
        rate, acceleration : array_like, shape (n,), optional
            Largest joint rates and accelerations, for "toppra"; ``robot.qd_max`` and none if not given.
        torque, torque_limit
            Dynamics and largest torques, for "toppra", as in `constant_speed`; friction may be part of them.
        start_speed, end_speed : float
            Speeds of the tool point at both ends [m/s], for "toppra".

        Returns
        -------
        Trajectory
            The same with ``time``, from 0.

        Raises
        ------
        ImportError
            If toppra is not installed (``pip install redundancy[timing]``), for that method.
        ShapeError, InvalidValueError
            If an argument is wrong or misplaced, the tool point rests on the way, or no motion keeps the limits.
        """
        s = length_along(self.path.position)
        if method == "constant":
            if speed is None or not checked("speed", speed, ()) > 0.0:
                raise InvalidValueError(f"speed is {speed}, expected a number above 0")
            return self._with_time(s / speed)
        if method != "toppra":
            raise InvalidValueError(f"method is {method!r}, expected 'constant' or 'toppra'")
        if speed is not None:
            raise InvalidValueError(f"speed is {speed} for method 'toppra', expected none")
        if self.unreachable:
            raise InvalidValueError(f"trajectory does not reach point {self.unreachable[0]}, expected all points")
        n = self.robot.n
        limits = MotionBounds(
            robots.checked_limit("rate", self.robot.qd_max if rate is None else rate, n),
            None if acceleration is None else robots.checked_limit("acceleration", acceleration, n),
            None if torque is None else robots.torques_of(torque, torque_limit, n),
        )
        return self._with_time(least_times(s, self.q, limits, start_speed, end_speed))

    def _with_time(self, time: F64) -> Self:
        path = Toolpath(self.path.position, self.path.axis, self.path.rotation, time)
        return replace(self, path=path)

    @classmethod
    def read(cls, file: str | Path, robot: Robot | None = None) -> "Trajectory":
        """Read a trajectory that `write` wrote.

        Parameters
        ----------
        file : path-like
            ``.json`` or, with any other ending, CSV.
        robot : Robot, optional
            Whose trajectory it is; if not given, the packaged robot that the file names, as ``.json`` does. Joints of
            the controller become the robot's by `Robot.controller`.

        Returns
        -------
        Trajectory
            As it was written, but for rotations of the path and the number of iterations, which files do not hold, and
            the length, which ``.json`` alone has; what JSON has as null is NaN.

        Raises
        ------
        OSError
            If the file cannot be opened.
        ToolpathError
            If it is none of a trajectory of such a robot; if none is given, also where its tool is not where the file
            says: that robot had another tool or base.
        InvalidValueError
            If no robot is given and the file names none.
        UnknownRobotError
            If no robot is given and the one that the file names is not packaged.
        """
        columns = read_trajectory(Path(file))
        if robot is None:
            if columns.robot is None:
                raise InvalidValueError(f"{file} does not name its robot, expected the argument robot")
            robot = robots.get(columns.robot)
            _check_tool(robot, columns)
        q = columns.joints(robot)
        try:
            path = Toolpath(columns.position, columns.axis, time=columns.time)
        except RedundancyError as error:
            raise ToolpathError(str(error), columns.file) from None
        return Trajectory(robot, path, q, *columns.worth, columns.status, columns.length)

    def write(self, file: str | Path, frame: Literal["tool", "flange"] = "tool", joints: Joints = "robot") -> None:
        """Write the trajectory.

        Parameters
        ----------
        file : path-like
            ``.csv`` or ``.json``: every column in SI units, every digit. ``.pathx``: the format of RobotMaster (Leger
            2014, appendix A), one ``<m>command x y z a b c contour feed</m>`` a point. The command is "jc" (joint
            move) for the first point and "lc" (linear move) for the others, then come the position [mm] and the XYZ
            Euler angles [deg] of a frame in the base frame, R = Rx(a) Ry(b) Rz(c), the contour flag 0, and the feed
            rate of the tool point [mm/s] (0 without times). The file is replaced as a whole or not at all.
        frame : {"tool", "flange"}
            Whose poses a ``.pathx`` file holds: those of the tool frame, or those of the flange, without the tool. The
            program of appendix A writes the last frame of the DH table, whose origin is at the tip of the tool and
            which does not turn with the milling axis: "flange" for ``fanuc_m710ic50_milling``.
        joints : {"robot", "controller"}
            Whose joints the columns of a ``.csv`` or ``.json`` file are: the robot's own, ``q1_rad`` ..., or those that
            its controller shows (`Robot.controller`), by their names in deg (mm where prismatic), ``J1_deg`` ....
            `read` knows both.

        Raises
        ------
        InvalidValueError
            If the file's ending, the frame or ``joints`` is another, the frame is not the tool's in a file without
            poses, or the joints are the controller's in a file without joints.
        OSError
            If the file cannot be written.
        """
        write_atomically(file, formatted(self, Path(file), frame, joints))

    def plot(self, path: str | Path | None = None, joints: Joints = "robot") -> "Figure":
        """Draw condition number, joints in their ranges and spin, one above the other.

        Parameters
        ----------
        path : path-like, optional
            Where to save the picture (``.png``, ``.svg``, ``.pdf``); nowhere if not given.
        joints : {"robot", "controller"}
            Whose joints are drawn.

        Returns
        -------
        matplotlib.figure.Figure
            The picture.

        Raises
        ------
        ImportError
            If matplotlib is not installed.
        """
        return plots.saved(plots.overview(self, joints), path)


def _check_tool(robot: Robot, columns: TrajectoryColumns) -> None:
    """Refuse a robot of the right name with another tool or base than the one that was written."""
    distance = np.linalg.norm(robot.fk(columns.joints(robot))[:, :3, 3] - columns.position, axis=1)
    if (np.abs(distance - columns.worth[2]) > _SAME_TOOL).any():
        raise ToolpathError(f"not of the packaged {robot.name}: its tool is elsewhere; give the robot", columns.file)
