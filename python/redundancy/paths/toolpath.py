"""Where a tool has to go."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._core import Task, perpendicular, transport
from .._util import F64, checked, checked_pose
from ..errors import InvalidValueError, RedundancyError, ToolpathError
from ..files import Table, path_source, read_document, read_toolpath, write_toolpath
from .raster import points_along, raster_corners, rounded
from .rates import twists


class PointError(InvalidValueError):
    """A value is wrong at one point of a path, ``point``, counted from 0."""

    def __init__(self, message: str, point: int = 0) -> None:
        super().__init__(message)
        self.point = point


@dataclass(frozen=True, init=False, eq=False, repr=False)
class Toolpath:
    """Positions and axis directions of a tool, in the robot's base frame.

    Parameters
    ----------
    position : array_like, shape (N, 3)
        Positions of the tool point [m], N at least 1.
    axis : array_like, shape (N, 3)
        Directions of the tool's axis, any length but zero; kept as unit vectors.
    rotation : array_like, shape (N, 3, 3), optional
        Orientations of the tool frame, for tasks that fix its spin too.
    time : array_like, shape (N,), optional
        Strictly increasing times [s].

    Attributes
    ----------
    position, axis, rotation, time
        The parameters as read-only float64 arrays; ``rotation`` and ``time`` may be None.

    Raises
    ------
    ShapeError, NonFiniteError
        If an array has the wrong shape or holds NaN or infinities.
    InvalidValueError
        If there is no point, an axis is zero, a rotation is none or time does not increase; the message names the
        point, counted from 0.
    """

    position: F64
    axis: F64
    rotation: F64 | None
    time: F64 | None

    def __init__(
        self,
        position: ArrayLike,
        axis: ArrayLike,
        rotation: ArrayLike | None = None,
        time: ArrayLike | None = None,
    ) -> None:
        points = checked("position", position, (None, 3))
        n = len(points)
        if n == 0:
            raise InvalidValueError("position has no points, expected at least 1")
        set_field = object.__setattr__  # the class is frozen
        set_field(self, "position", points)
        set_field(self, "axis", _unit(checked("axis", axis, (n, 3))))
        set_field(self, "rotation", None if rotation is None else _rotations(checked("rotation", rotation, (n, 3, 3))))
        set_field(self, "time", None if time is None else _increasing(checked("time", time, (n,))))

    def __len__(self) -> int:
        """Return the number of points."""
        return len(self.position)

    def __repr__(self) -> str:
        return f"Toolpath({len(self)} points, {self.length:.4g} m)"

    @property
    def length(self) -> float:
        """Length of the path [m]: the sum of the distances from point to point."""
        return float(np.linalg.norm(np.diff(self.position, axis=0), axis=1).sum())

    @property
    def duration(self) -> float | None:
        """Time from the first point to the last [s]; None without times."""
        return None if self.time is None else float(self.time[-1] - self.time[0])

    @property
    def speed(self) -> F64 | None:
        """Speed of the tool point [m/s], shape (N,), that of `twist`; None without times."""
        twist = self.twist
        if twist is None:
            return None
        speed: F64 = np.linalg.norm(twist[:, 3:], axis=1)
        return speed

    @property
    def twist(self) -> F64 | None:
        """Twist [omega; v] of the tool [rad/s, m/s], shape (N, 6); None without times.

        At the tool point, in the base frame, angular part first. omega is that of ``rotation``; without rotations that
        of the axis, which then has no component along it. By differences of second order in the distance of the times,
        at both ends too; exact along a screw motion of constant rate, as the helix is (Leger 2014, eq. 4.25 to 4.28).
        From one point to the next the tool turns by less than a half turn. Zero for a path of one point.
        """
        if self.time is None:
            return None
        return twists(self.position, self.axis, self.rotation, self.time)

    @property
    def axis_rate(self) -> F64 | None:
        """Rate of the axis [1/s], shape (N, 3), in the base frame, across the axis; None without times.

        By differences, as `twist`, of the axes alone (Leger 2014, eq. 4.28, 4.32).
        """
        if self.time is None:
            return None
        omega = twists(self.position, self.axis, None, self.time)[:, :3]
        rate: F64 = np.cross(omega, self.axis)
        return rate

    def targets(self, task: Task | None = None) -> F64:
        """Return the rows that a solver takes as targets of a task.

        Parameters
        ----------
        task : Task, optional
            The task; axisymmetric if not given.

        Returns
        -------
        ndarray
            (N, 6), position [m] and axis, for an axisymmetric tool; (N, 3), position, where the rotation is free; else
            (N, 12), position and rotation by rows. For a task within a cone whose spin is free a path without rotations
            has frames with its axis as z.

        Raises
        ------
        InvalidValueError
            If the task needs rotations and the path has none.
        """
        size = 6 if task is None else task.target_size
        if size == 3:
            return self.position.copy()
        if size == 6:
            return np.hstack([self.position, self.axis])
        rotation = self.rotation
        if rotation is None:
            volume = None if task is None else task.volume
            if volume is None:
                raise InvalidValueError(
                    "the path has no rotations, expected some for a task that fixes the whole orientation"
                )
            if volume.kind != "cone" or volume.spin is not None:
                raise InvalidValueError(f"the path has no rotations, expected some for a task within {volume}")
            rotation = self._frames()
        return np.hstack([self.position, rotation.reshape(-1, 9)])

    def _frames(self) -> F64:
        """Return frames (N, 3, 3) whose z is the axis, which never turn about it; the first is arbitrary."""
        z = self.axis[0]
        x = perpendicular(z)
        frames: F64 = transport(self.axis) @ np.stack([x, np.cross(z, x), z], axis=1)
        return frames

    def without_spin(self, first: ArrayLike) -> "Toolpath":
        """Return the same path with orientations that never turn the tool about its axis.

        Parameters
        ----------
        first : array_like, shape (3, 3)
            Orientation of the tool frame at the first point; the others follow by the smallest rotation from each axis
            to the next.

        Returns
        -------
        Toolpath
            With ``rotation``.
        """
        start = checked("first", first, (3, 3))
        return Toolpath(self.position, self.axis, transport(self.axis) @ start, self.time)

    def oriented(self, rotation: ArrayLike) -> "Toolpath":
        """Return the same path with other orientations of the tool, whose z axes become its axis.

        Parameters
        ----------
        rotation : array_like, shape (N, 3, 3)
            Orientations of the tool frame, as those of `SurfaceRule` or of `PointingRule`.

        Returns
        -------
        Toolpath
            With ``rotation``.

        Raises
        ------
        ShapeError, NonFiniteError, InvalidValueError
            As for a path made of these.
        """
        turned = checked("rotation", rotation, (len(self), 3, 3))
        return Toolpath(self.position, turned[:, :, 2], turned, self.time)

    @classmethod
    def helix(
        cls,
        radius: float,
        pitch: float,
        start: float,
        stop: float,
        offset: float = 0.0,
        center: ArrayLike = (0.0, 0.0, 0.0),
        points: int = 101,
        duration: float | None = None,
    ) -> "Toolpath":
        """Return a helix on a cylinder along y, the tool's axis along the inward normal (Leger 2014, eq. 4.21 to 4.24).

        ``x = R cos(offset - phi)``, ``y = p phi``, ``z = R sin(offset - phi)``, and the axis is
        ``-(cos(offset - phi), 0, sin(offset - phi))``.

        Parameters
        ----------
        radius : float
            Radius R of the cylinder [m].
        pitch : float
            Advance p along y for one radian [m/rad].
        start, stop : float
            First and last angle phi [rad].
        offset : float
            Offset angle [rad].
        center : array_like, shape (3,)
            Position of the cylinder [m].
        points : int
            Number of points, equidistant in phi.
        duration : float, optional
            Time from the first to the last point [s]; no times if not given.

        Returns
        -------
        Toolpath
            The helix.

        Raises
        ------
        InvalidValueError
            If the radius is not positive, there are fewer than 2 points or the duration is not positive.
        """
        named = {"radius": radius, "pitch": pitch, "start": start, "stop": stop, "offset": offset}
        for name, value in named.items():
            checked(name, value, ())
        middle = checked("center", center, (3,))
        if not radius > 0.0:
            raise InvalidValueError(f"radius is {radius}, expected a number above 0")
        if points < 2:
            raise InvalidValueError(f"points is {points}, expected at least 2")
        if duration is not None and not 0.0 < duration < np.inf:
            raise InvalidValueError(f"duration is {duration}, expected a finite number above 0")
        phi = np.linspace(start, stop, points)
        outward = np.stack([np.cos(offset - phi), np.zeros(points), np.sin(offset - phi)], axis=1)
        position = middle + radius * outward + np.outer(pitch * phi, [0.0, 1.0, 0.0])
        return cls(position, 0.0 - outward, time=None if duration is None else np.linspace(0.0, duration, points))

    @classmethod
    def raster(
        cls,
        size: tuple[float, float],
        rows: int,
        fillet: float,
        spacing: float,
        along: Literal["x", "y"] = "x",
        frame: ArrayLike | None = None,
        speed: float | None = None,
    ) -> "Toolpath":
        """Return parallel lines over a rectangle, back and forth, with rounded corners.

        It begins at the corner of least x and y. The tool's axis points against the z axis of the frame, its
        orientation is that of the frame after a half turn about y (From and Gravdahl, eq. 48).

        Parameters
        ----------
        size : tuple of float
            Sides of the rectangle along x and along y [m].
        rows : int
            Number of lines; a single one is in the middle.
        fillet : float
            Radius of the corners [m]; with 0 they are sharp, and a constant speed has no finite acceleration there.
        spacing : float
            Largest distance from point to point along the path [m]; all are equal.
        along : {"x", "y"}
            Direction of the lines.
        frame : array_like, shape (4, 4), optional
            Pose of the rectangle: its middle, and its outward normal as z axis; the base frame if not given.
        speed : float, optional
            Constant speed [m/s]: gives the path times, by its exact length; none if not given.

        Returns
        -------
        Toolpath
            With rotations.

        Raises
        ------
        ShapeError, NonFiniteError
            If an array has the wrong shape or a number is NaN or infinite.
        InvalidValueError
            If a size, the number of lines, the spacing or the speed is not above 0, the fillet is negative or too large
            for the lines or their distance, or the frame is no pose.
        """
        sides = checked("size", size, (2,))
        for name, value in {"rows": rows, "fillet": fillet, "spacing": spacing}.items():
            checked(name, value, ())
        for name, value in {"size[0]": sides[0], "size[1]": sides[1], "rows": rows, "spacing": spacing}.items():
            if not value > 0.0:
                raise InvalidValueError(f"{name} is {value}, expected a number above 0")
        if int(rows) != rows:
            raise InvalidValueError(f"rows is {rows}, expected a whole number")
        if fillet < 0.0:
            raise InvalidValueError(f"fillet is {fillet}, expected a number from 0 up")
        if along not in ("x", "y"):
            raise InvalidValueError(f"along is {along!r}, expected 'x' or 'y'")
        if speed is not None and not checked("speed", speed, ()) > 0.0:
            raise InvalidValueError(f"speed is {speed}, expected a number above 0")
        pose = np.eye(4) if frame is None else checked_pose("frame", frame)
        swap = [0, 1] if along == "x" else [1, 0]
        plane, length = points_along(
            rounded(raster_corners((sides[swap[0]], sides[swap[1]]), int(rows)), fillet), spacing
        )
        position = pose[:3, 3] + plane[:, swap] @ pose[:3, :2].T
        tool = pose[:3, :3] * [-1.0, 1.0, -1.0]
        rotation = np.broadcast_to(tool, (len(position), 3, 3))
        return cls(position, rotation[:, :, 2], rotation, None if speed is None else length / speed)

    @classmethod
    def read(cls, file: str | Path) -> "Toolpath":
        """Read a path from a file.

        Parameters
        ----------
        file : path-like
            ``.csv``: a header that names the columns, then one point a line. ``.json``: an object of columns, each an
            array. Columns are x, y, z [m] (or x_mm, y_mm, z_mm) and i, j, k, the axis; optional are t [s] and r11 ...
            r33, the tool frame's rotation by rows. ``.toml``: a job file, whose table ``[path]`` is read.

        Returns
        -------
        Toolpath
            The path.

        Raises
        ------
        OSError
            If the file cannot be opened.
        ToolpathError
            If it is malformed; the message starts with file, line and column as far as known.
        """
        file = Path(file)
        if file.suffix.lower() == ".toml":
            return path_of_table(read_document(file).table("path"), file)
        columns = read_toolpath(file)
        try:
            return cls(columns.position, columns.axis, columns.rotation, columns.time)
        except PointError as error:
            raise columns.fail(error.point, str(error)) from None

    def write(self, file: str | Path) -> None:
        """Write the path to a CSV file that `read` takes; numbers keep all their digits.

        Parameters
        ----------
        file : path-like
            The file. It is replaced as a whole or not at all.

        Raises
        ------
        OSError
            If the file cannot be written.
        """
        write_toolpath(file, self.position, self.axis, self.rotation, self.time)


def path_of_table(table: Table, file: Path) -> Toolpath:
    """Return the path that the table ``[path]`` of a job file stands for.

    Parameters
    ----------
    table : Table
        The table.
    file : Path
        The job file.

    Returns
    -------
    Toolpath
        The path.

    Raises
    ------
    OSError
        If the file that it names cannot be opened.
    ToolpathError
        If the table or that file is malformed.
    """
    source = path_source(table, file)
    if isinstance(source, Path):
        return Toolpath.read(source)
    try:
        return Toolpath.helix(**source)
    except RedundancyError as error:
        raise ToolpathError(f"path.helix: {error}", file) from error


def _unit(axis: F64) -> F64:
    # Scaled by its largest component first, so that no length overflows or vanishes.
    largest = np.abs(axis).max(axis=1, keepdims=True)
    if not largest.all():
        point = int(np.argmin(largest))
        raise PointError(f"axis[{point}] is {axis[point].tolist()}, expected a vector that is not zero", point)
    scaled = axis / largest
    norms = np.linalg.norm(scaled, axis=1, keepdims=True)
    # Unit vectors stay as they are, so that a path that was written reads back the same.
    unit: F64 = np.where(np.abs(norms * largest - 1.0) < 1e-15, axis, scaled / norms)
    unit.setflags(write=False)
    return unit


def _rotations(rotation: F64) -> F64:
    defect = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    wrong = (defect > 1e-6) | (np.linalg.det(rotation) < 0.0)
    if wrong.any():
        point = int(np.argmax(wrong))
        raise PointError(f"rotation[{point}] is {rotation[point].tolist()}, expected an orthogonal matrix", point)
    return rotation


def _increasing(time: F64) -> F64:
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if late.size:
        point = int(late[0]) + 1
        raise PointError(
            f"time[{point}] is {time[point]}, expected more than {time[point - 1]}, the time before", point
        )
    return time
