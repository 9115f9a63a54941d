"""How fast a tool moves and turns along points in time, by differences."""

import numpy as np

from .._util import F64, axis_angle, between


def twists(position: F64, axis: F64, rotation: F64 | None, time: F64) -> F64:
    """Return the twists of a tool at points in time.

    From each point to the next there is one screw motion; its twist is that of the middle, to second order. In between,
    and beyond the first and the last middle, twists change linearly.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Positions of the tool point [m].
    axis : ndarray, shape (N, 3)
        The tool's axes, unit vectors.
    rotation : ndarray, shape (N, 3, 3), optional
        Orientations; if None, the tool turns by the smallest rotation from each axis to the next.
    time : ndarray, shape (N,)
        Increasing times [s].

    Returns
    -------
    ndarray, shape (N, 6)
        Twists [omega; v] at the tool point, in the frame of the positions [rad/s, m/s]; zero for a single point.
    """
    if len(time) == 1:
        return np.zeros((1, 6))
    if rotation is None:
        normal, angle = between(axis[:-1], axis[1:])
    else:
        normal, angle = axis_angle(rotation[1:] @ rotation[:-1].transpose(0, 2, 1))
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = normal / np.where(length > 0.0, length, 1.0)
    step = np.diff(time)[:, None]
    turning = angle[:, None] * normal / step
    moving = _start_of_screw(normal, angle[:, None], np.diff(position, axis=0)) / step
    first, share = _neighbours(time)
    omega, v = np.zeros((2, len(time), 3))
    for interval, weight in ((first, 1.0 - share), (np.minimum(first + 1, len(step) - 1), share)):
        omega += weight * turning[interval]
        # The same screw motion, seen at the point where the twist is wanted.
        v += weight * (moving[interval] + np.cross(turning[interval], position - position[interval]))
    if rotation is None:
        # What rounding and curvature leave along the axis is no spin.
        omega -= (omega * axis).sum(axis=1, keepdims=True) * axis
    return np.hstack([omega, v])


def _start_of_screw(normal: F64, angle: F64, shift: F64) -> F64:
    """Return the velocity with which a point sets out on a screw motion, constant for a unit of time, that shifts it.

    The inverse of the left Jacobian of the rotation vector, applied to the shift.
    """
    half = 0.5 * angle
    bend = 1.0 - np.where(half > 0.0, half / np.tan(np.where(half > 0.0, half, 1.0)), 1.0)
    across = np.cross(normal, shift)
    velocity: F64 = shift - half * across + bend * np.cross(normal, across)
    return velocity


def _neighbours(time: F64) -> tuple[np.ndarray, F64]:
    """Return for every point the first of two intervals, and the weight of the second, shapes (N,) and (N, 1)."""
    middle = 0.5 * (time[:-1] + time[1:])
    first = np.clip(np.arange(len(time)) - 1, 0, max(len(middle) - 2, 0))
    if len(middle) == 1:
        return first, np.zeros((len(time), 1))
    share = (time - middle[first]) / (middle[first + 1] - middle[first])
    return first, share[:, None]
