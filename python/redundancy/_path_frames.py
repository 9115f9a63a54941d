"""A path as a planner sees it: tool frames at spin 0, and what share of the path lies between its points."""

import numpy as np

from ._core import Robot, Task
from ._transport import transport
from ._util import F64, perpendicular
from .errors import InvalidValueError
from .paths import Toolpath

_TURN_LENGTH = 0.1
"""Length of path that a turn of the axis by one radian counts for [m], where there are no times."""
_LEAST_SHARE = 1e-3
"""Least share of the path from a point to the next, relative to the mean: points may lie on each other."""
_SAME = 1e-9
"""Two frames this near [m, rad] are one."""


def spin_frames(path: Toolpath, task: Task, closed: bool) -> F64:
    """Return the tool frames at spin 0.

    Parameters
    ----------
    path : Toolpath
        N points. Its rotations are spin 0 where it has any; else the first frame is arbitrary and the others follow
        without turning about the axis.
    task : Task
        Axisymmetric or full.
    closed : bool
        Whether the last frame has to be the first: what the way round turned the tool by is spread over the path.

    Returns
    -------
    ndarray, shape (N, 4, 4)
        Frames [m].

    Raises
    ------
    InvalidValueError
        If the task is another, the rotations that it needs are missing, or a closed path does not end where it starts.
    """
    if task.kind not in ("axisymmetric", "full"):
        raise InvalidValueError(f"task is of the kind {task.kind!r}, expected 'axisymmetric' or 'full'")
    if closed and (
        np.abs(path.position[0] - path.position[-1]).max() > _SAME or path.axis[0] @ path.axis[-1] < 1 - _SAME
    ):
        raise InvalidValueError("closed is True, but the last point of the path is not the first")
    frames = np.tile(np.eye(4), (len(path), 1, 1))
    frames[:, :3, 3] = path.position
    if path.rotation is not None:
        frames[:, :3, :3] = path.rotation
    elif task.kind == "full":
        raise InvalidValueError("the path has no rotations, expected some for a task that fixes the whole orientation")
    else:
        frames[:, :3, :3] = transport(path.axis) @ _first(path.axis[0], task.axis)
        if closed:
            _close(frames, path.axis)
    return frames


def _first(axis: F64, tool: F64) -> F64:
    """Return a rotation that takes the tool's axis to the path's."""
    return _basis(axis) @ _basis(tool).T


def _basis(axis: F64) -> F64:
    across = perpendicular(axis)
    return np.stack([across, np.cross(axis, across), axis], axis=1)


def _close(frames: F64, axis: F64) -> None:
    """Turn frames about the axes, ever more along the path, until the last is the first."""
    across = frames[0, :3, :3].T @ perpendicular(axis[0])
    start, end = frames[0, :3, :3] @ across, frames[-1, :3, :3] @ across
    angle = float(np.arctan2(np.cross(end, start) @ axis[0], end @ start))
    for i, share in enumerate(np.linspace(0.0, angle, len(frames))):
        frames[i, :3, :3] = turn(axis[i], share) @ frames[i, :3, :3]
    frames[-1] = frames[0]


def turn(axis: F64, angle: float) -> F64:
    """Return the rotation by an angle about a unit vector, shape (3, 3)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: F64 = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return rotation


def shares(path: Toolpath) -> F64:
    """Return the share of the path from each point to the next, shape (N - 1,), summing to 1.

    By time where the path has times; else by length, a turn of the axis by one radian counting as 0.1 m.
    """
    if path.time is not None:
        steps = np.diff(path.time)
    else:
        cosine = np.clip((path.axis[1:] * path.axis[:-1]).sum(axis=1), -1.0, 1.0)
        steps = np.linalg.norm(np.diff(path.position, axis=0), axis=1) + _TURN_LENGTH * np.arccos(cosine)
    if steps.sum() == 0.0:
        steps = np.ones_like(steps)
    steps = np.maximum(steps, _LEAST_SHARE * steps.mean()) if len(steps) else steps
    result: F64 = steps / steps.sum() if len(steps) else steps
    return result


def point_weights(steps: F64, closed: bool) -> F64:
    """Return the share of the path that each point stands for (trapezoidal rule), shape (len(steps) + 1,).

    In a closed path the last point, which is the first, has none.
    """
    if not len(steps):
        return np.ones(1)
    weights = np.zeros(len(steps) + 1)
    weights[:-1] += 0.5 * steps
    weights[1:] += 0.5 * steps
    if closed:
        weights[0] += weights[-1]
        weights[-1] = 0.0
    return weights


def motion_bounds(robot: Robot, path: Toolpath, limits: bool) -> F64:
    """Return the largest joint motions from each point to the next, shape (N - 1, n); infinite without times."""
    if path.time is None or not limits:
        return np.full((len(path) - 1, robot.n), np.inf)
    # Rounding of the path must not carry a joint beyond its speed.
    bounds: F64 = (1.0 - 1e-9) * np.diff(path.time)[:, None] * robot.qd_max
    return bounds
