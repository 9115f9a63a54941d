"""Files of trajectories: what they are written as, and what can be read again."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Final, Protocol, TypeAlias

import numpy as np

from .._core import Robot
from .._util import F64, Joints, checked_joints, coordinates_of, kinds_of
from ..errors import InvalidValueError, ToolpathError
from .text import fault_in, parse_json, read_text

POINT: Final = ("x_m", "y_m", "z_m", "i", "j", "k")
WORTH: Final = ("condition_number", "objective", "position_error_m", "axis_error_rad")
TIME: Final = "t_s"
FRAMES: Final = ("tool", "flange")
"""Whose poses a file of poses may hold."""
_Content: TypeAlias = tuple[dict[str, list[Any]], list[str], dict[str, Any]]


class Followed(Protocol):
    """What is written of the path of a trajectory, N points."""

    @property
    def position(self) -> F64:
        """Positions [m], shape (N, 3)."""

    @property
    def axis(self) -> F64:
        """Axes, shape (N, 3)."""

    @property
    def speed(self) -> F64 | None:
        """Speeds [m/s], shape (N,), if it has times."""


class Written(Protocol):
    """What is written of a trajectory: N points of a robot with n joints, as in `redundancy.Trajectory`."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def path(self) -> Followed:
        """The path."""

    @property
    def time(self) -> F64 | None:
        """Times [s], shape (N,), if there are any."""

    @property
    def q(self) -> F64:
        """Joint coordinates [rad or m], shape (N, n)."""

    @property
    def condition_number(self) -> F64:
        """kappa_F, shape (N,)."""

    @property
    def value(self) -> F64:
        """The objective, shape (N,)."""

    @property
    def position_error(self) -> F64:
        """Distances to the path [m], shape (N,)."""

    @property
    def axis_error(self) -> F64:
        """Angles to the path [rad], shape (N,)."""

    @property
    def status(self) -> list[str]:
        """One word a point."""

    @property
    def length(self) -> float | None:
        """Length that made kappa_F homogeneous [m], if known."""

    @property
    def max_condition_number(self) -> float:
        """The largest."""

    @property
    def mean_condition_number(self) -> float:
        """The mean."""

    @property
    def largest_step(self) -> float:
        """The largest motion of a joint from point to point [rad or m]."""

    @property
    def limit_margin(self) -> float:
        """Smallest distance to a position limit [rad or m]."""

    @property
    def max_joint_speed(self) -> float | None:
        """Largest joint speed [rad/s or m/s], if there are times."""

    def __len__(self) -> int: ...


@dataclass(frozen=True, eq=False)
class TrajectoryColumns:
    """What a file holds: columns of N numbers by their names, and the status of each point.

    Attributes
    ----------
    file : Path
        The file.
    robot : str or None
        Name of the robot, where the file has it.
    length : float or None
        Length that made the condition number homogeneous [m], where the file has it.
    values : dict
        Columns in SI units, float64; among them those of `POINT` and `WORTH`.
    status : list of str
        One for each point.
    """

    file: Path
    robot: str | None
    length: float | None
    values: dict[str, F64]
    status: list[str]

    @property
    def position(self) -> F64:
        """Positions of the path [m], shape (N, 3)."""
        return np.stack([self.values[name] for name in POINT[:3]], axis=1)

    @property
    def axis(self) -> F64:
        """Axes of the path, shape (N, 3)."""
        return np.stack([self.values[name] for name in POINT[3:]], axis=1)

    @property
    def time(self) -> F64 | None:
        """Times [s], shape (N,), if there are any."""
        return self.values.get(TIME)

    @property
    def worth(self) -> tuple[F64, F64, F64, F64]:
        """Condition number, objective, position error [m] and axis error [rad], each of shape (N,)."""
        condition, value, position_error, axis_error = (self.values[name] for name in WORTH)
        return condition, value, position_error, axis_error

    def joints(self, robot: Robot) -> F64:
        """Return the postures of a robot [rad or m], shape (N, n), from its own joints or those of its controller.

        Raises
        ------
        ToolpathError
            If the file has others, or a number is not finite.
        """
        others = {*POINT, *WORTH, TIME, "point"}
        have = [name for name in self.values if name not in others]
        expected = joint_names(robot, "robot")
        theirs = have == joint_names(robot, "controller")
        if have != expected and not theirs:
            message = f"joints are {', '.join(have) or 'none'}, expected {', '.join(expected)}"
            raise ToolpathError(message, self.file)
        q = np.stack([self.values[name] for name in have], axis=1)
        if not np.isfinite(q).all():
            raise ToolpathError("expected columns of equally many numbers, finite ones for the joints", self.file)
        return np.asarray(robot.controller.to_robot(_from_readable(robot, q))) if theirs else q


def joint_names(robot: Robot, joints: Joints) -> list[str]:
    """Return the names of the columns of joints: q1_rad, or the controller's own names in deg and mm."""
    if joints == "robot":
        return [f"q{i}_{'rad' if kind == 'R' else 'm'}" for i, kind in enumerate(robot.joints, 1)]
    kinds = zip(robot.controller.names, kinds_of(robot, joints), strict=True)
    return [f"{name}_{'deg' if kind == 'R' else 'mm'}" for name, kind in kinds]


def _to_readable(robot: Robot, p: F64) -> F64:
    """Return coordinates of the controller in deg and mm."""
    return np.where([kind == "R" for kind in kinds_of(robot, "controller")], np.rad2deg(p), 1000.0 * p)


def _from_readable(robot: Robot, p: F64) -> F64:
    """Return coordinates of the controller in rad and m."""
    return np.where([kind == "R" for kind in kinds_of(robot, "controller")], np.deg2rad(p), p / 1000.0)


def read_trajectory(file: Path) -> TrajectoryColumns:
    """Read what was written as ``.csv`` or ``.json``.

    Parameters
    ----------
    file : Path
        The file.

    Returns
    -------
    TrajectoryColumns
        Columns of equal length, at least one point; what JSON has as null is NaN.

    Raises
    ------
    OSError
        If the file cannot be opened.
    ToolpathError
        If it is malformed, or a column is missing.
    """
    text = read_text(file, fault_in(file))
    read = _from_json if file.suffix.lower() == ".json" else _from_csv
    columns, status, about = read(file, text)
    for column in (*POINT, *WORTH):
        if column not in columns:
            raise ToolpathError(f"column {column!r} is missing", file)
    try:
        values = {name: np.array(column, dtype=np.float64) for name, column in columns.items()}
    except (TypeError, ValueError):  # texts
        raise ToolpathError("expected columns of equally many numbers", file) from None
    if {column.shape for column in values.values()} != {(len(status),)} or not status:
        raise ToolpathError("expected columns of equally many numbers", file)
    robot, length = about.get("robot"), about.get("length_m")
    if not isinstance(robot, str | None) or not isinstance(length, int | float | None):
        raise ToolpathError(f"got robot {robot!r:.40} and length_m {length!r:.40}, expected a name and a number", file)
    return TrajectoryColumns(file, robot, length, values, status)


def _from_csv(file: Path, text: str) -> _Content:
    """Return the columns of numbers, and the last one, the status."""
    header, *lines = [line.strip().split(",") for line in text.splitlines() if line.strip()] or [[""]]
    if header[0] != "point" or header[-1] != "status":
        raise ToolpathError("no trajectory, expected columns from point to status", file, 1)
    rows = []
    for number, fields in enumerate(lines, 2):
        if len(fields) != len(header):
            raise ToolpathError(f"{len(fields)} fields, expected {len(header)}, as in the header", file, number)
        try:
            rows.append([float(field) for field in fields[:-1]])
        except ValueError as error:
            raise ToolpathError(str(error), file, number) from None
    if not rows:
        raise ToolpathError("no points after the header", file, 1)
    columns = dict(zip(header[:-1], map(list, zip(*rows, strict=True)), strict=True))
    return columns, [fields[-1] for fields in lines], {}


def _from_json(file: Path, text: str) -> _Content:
    """Return the object of columns, the status, and all that the file says."""
    content = parse_json(text, fault_in(file))
    columns = content.get("columns") if isinstance(content, dict) else None
    status = content.get("status") if isinstance(content, dict) else None
    if not isinstance(columns, dict) or not isinstance(status, list):
        raise ToolpathError("no trajectory, expected an object with columns and status", file)
    if not all(isinstance(column, list) for column in columns.values()):
        raise ToolpathError("expected columns of equally many numbers", file)
    return columns, [str(state) for state in status], content


def to_csv(trajectory: Written, joints: Joints = "robot") -> str:
    """Return a header with units, then one line a point."""
    columns = _columns(trajectory, joints)
    out = StringIO()
    out.write(",".join(["point", *columns, "status"]) + "\n")
    rows = np.stack(list(columns.values()), axis=1).tolist()
    for point, (row, status) in enumerate(zip(rows, trajectory.status, strict=True)):
        out.write(f"{point},{','.join(map(repr, row))},{status}\n")
    return out.getvalue()


def to_json(trajectory: Written, joints: Joints = "robot") -> str:
    """Return an object of columns with units, and what sums them up; null where a number is not finite."""
    content: dict[str, Any] = {
        "robot": trajectory.robot.name,
        "joints": trajectory.robot.joints,
        "joint_names": trajectory.robot.joint_names,
        "coordinates": joints,
        "points": len(trajectory),
        "length_m": trajectory.length,
        "max_condition_number": _finite(trajectory.max_condition_number),
        "mean_condition_number": _finite(trajectory.mean_condition_number),
        "limit_margin": _finite(trajectory.limit_margin),
        "max_joint_speed": trajectory.max_joint_speed,
        "largest_step": trajectory.largest_step,
        "columns": {
            name: [_finite(x) for x in column.tolist()] for name, column in _columns(trajectory, joints).items()
        },
        "status": trajectory.status,
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def to_pathx(trajectory: Written, frame: str = FRAMES[0]) -> str:
    """Return the path file of RobotMaster (Leger 2014, appendix A), one of `FRAMES` in it; see `Trajectory.write`."""
    robot = trajectory.robot
    poses = (robot if frame == "tool" else robot.with_tool(np.eye(4))).fk(trajectory.q)
    angles = np.round(180.0 / np.pi * euler_xyz(poses[:, :3, :3]), 6)
    # One name for a half turn, whichever side of it rounding falls on; and no "-0".
    angles = np.where(angles == -180.0, 180.0, angles) + 0.0
    position = np.round(1000.0 * poses[:, :3, 3], 6) + 0.0
    speed = trajectory.path.speed
    feed = np.zeros(len(trajectory)) if speed is None else 1000.0 * speed
    out = StringIO()
    out.write('<pathData>\n <operation id="1">\n')
    for point, (x, abc, f) in enumerate(zip(position.tolist(), angles.tolist(), feed.tolist(), strict=True)):
        numbers = " ".join(f"{number:.6f}" for number in (*x, *abc))
        out.write(f"<m>{'lc' if point else 'jc'} {numbers} 0 {f:.3f}</m>\n")
    out.write(" </operation>\n</pathData>\n")
    return out.getvalue()


def euler_xyz(rotation: F64) -> F64:
    """Return the angles a, b, c of R = Rx(a) Ry(b) Rz(c).

    Parameters
    ----------
    rotation : ndarray, shape (N, 3, 3)
        Rotation matrices.

    Returns
    -------
    ndarray, shape (N, 3)
        Angles [rad] in (-pi, pi], b within a quarter turn. Where b is a quarter turn, a and c turn about one axis: a is
        then that of the nearest regular matrix, an earlier one first, so that it does not jump; 0 if there is none.
    """
    r = rotation.transpose(1, 2, 0)
    cosine = np.hypot(r[0, 0], r[0, 1])
    a, b, c = np.arctan2(-r[1, 2], r[2, 2]), np.arctan2(r[0, 2], cosine), np.arctan2(-r[0, 1], r[0, 0])
    regular = np.flatnonzero(cosine > 1e-9)
    for i in np.flatnonzero(cosine <= 1e-9):
        a[i] = a[regular[np.argmin(np.abs(regular - i))]] if regular.size else 0.0
        # Only c + a, or c - a where b is minus a quarter turn, counts.
        angle = np.arctan2(r[1, 0, i], r[1, 1, i]) - np.sign(b[i]) * a[i]
        c[i] = np.arctan2(np.sin(angle), np.cos(angle))
    return np.stack([a, b, c], axis=1)


def _columns(trajectory: Written, joints: Joints) -> dict[str, F64]:
    robot, q = trajectory.robot, coordinates_of(trajectory.robot, trajectory.q, joints)
    columns: dict[str, F64] = {} if trajectory.time is None else {TIME: trajectory.time}
    columns |= zip(joint_names(robot, joints), (q if joints == "robot" else _to_readable(robot, q)).T, strict=True)
    worth = (trajectory.condition_number, trajectory.value, trajectory.position_error, trajectory.axis_error)
    columns |= zip(WORTH, worth, strict=True)
    return columns | dict(zip(POINT, (*trajectory.path.position.T, *trajectory.path.axis.T), strict=True))


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


FORMATS: Final[dict[str, Callable[[Written, str, Joints], str]]] = {
    ".csv": lambda trajectory, _, joints: to_csv(trajectory, joints),
    ".json": lambda trajectory, _, joints: to_json(trajectory, joints),
    ".pathx": lambda trajectory, frame, _: to_pathx(trajectory, frame),
}


def formatted(trajectory: Written, file: Path, frame: str, joints: str = "robot") -> str:
    """Return a trajectory as the text of a file; see `Trajectory.write`.

    Parameters
    ----------
    trajectory : Written
        What is written.
    file : Path
        Its ending tells the format.
    frame : str
        One of `FRAMES`; other than the first for ``.pathx`` alone.
    joints : {"robot", "controller"}
        Whose joints; the robot's for ``.pathx``, which has none.

    Returns
    -------
    str
        The text.

    Raises
    ------
    InvalidValueError
        If there is no such format, frame or kind of joints, or that format does not have it.
    """
    ending = file.suffix.lower()
    if ending not in FORMATS:
        raise InvalidValueError(f"format of {str(file)!r} is unknown, expected one of {', '.join(FORMATS)}")
    poses = ending == ".pathx"
    known = FRAMES if poses else FRAMES[:1]
    if frame not in known:
        raise InvalidValueError(f"frame is {frame!r}, expected {' or '.join(map(repr, known))} for a {ending} file")
    whose = checked_joints(joints)
    if poses and whose != "robot":
        raise InvalidValueError(f"joints is {joints!r}, expected 'robot' for a {ending} file, which has poses alone")
    return FORMATS[ending](trajectory, frame, whose)
