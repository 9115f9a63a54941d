"""Rotations about an axis, and what belongs to an axis."""

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InvalidValueError
from .arrays import F64, checked

ORTHOGONAL = 1e-6
"""How far the products of a rotation's columns may be from those of an orthogonal matrix: data of single precision."""


def checked_pose(name: str, value: ArrayLike) -> F64:
    """Copy an array-like into a pose.

    Parameters
    ----------
    name : str
        Name for the error message.
    value : array_like
        The numbers.

    Returns
    -------
    ndarray, shape (4, 4)
        Read-only.

    Raises
    ------
    InvalidValueError, ShapeError, NonFiniteError
        If these are no finite numbers of that shape, the last row is not 0, 0, 0, 1 or the rotation is none.
    """
    pose = checked(name, value, (4, 4))
    rotation = pose[:3, :3]
    if (pose[3] != [0.0, 0.0, 0.0, 1.0]).any():
        raise InvalidValueError(f"{name}[3] is {pose[3].tolist()}, expected [0, 0, 0, 1]")
    if np.abs(rotation.T @ rotation - np.eye(3)).max() > ORTHOGONAL or np.linalg.det(rotation) < 0.0:
        raise InvalidValueError(f"{name} has the rotation {rotation.tolist()}, expected an orthogonal matrix")
    return pose


def turns(axis: F64, angle: F64) -> F64:
    """Return the rotations by angles about axes (Rodrigues' formula).

    Parameters
    ----------
    axis : ndarray, shape (3,) or (N, 3)
        Axes of any length; about a zero axis there is no rotation.
    angle : ndarray, shape (N,)
        Angles [rad].

    Returns
    -------
    ndarray, shape (N, 3, 3)
        Rotation matrices.
    """
    length = np.linalg.norm(axis, axis=-1, keepdims=True)
    x, y, z = np.moveaxis(axis / np.where(length > 0.0, length, 1.0), -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*np.shape(x), 3, 3)
    sine, versine = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    rotations: F64 = np.eye(3) + sine * cross + versine * (cross @ cross)
    return rotations


def between(start: F64, end: F64) -> tuple[F64, F64]:
    """Return the smallest rotations from unit vectors to others.

    Parameters
    ----------
    start, end : ndarray, shape (N, 3)
        Unit vectors.

    Returns
    -------
    axis : ndarray, shape (N, 3)
        Axes, not of unit length; zero between vectors that are parallel.
    angle : ndarray, shape (N,)
        Angles [rad], from 0 to pi.
    """
    normal = np.cross(start, end)
    return normal, np.arctan2(np.linalg.norm(normal, axis=1), (start * end).sum(axis=1))


def axis_angle(rotation: F64) -> tuple[F64, F64]:
    """Return axis and angle of rotations.

    Parameters
    ----------
    rotation : ndarray, shape (N, 3, 3)
        Rotation matrices.

    Returns
    -------
    axis : ndarray, shape (N, 3)
        Axes, 2 sin(angle) long: zero for no turn and for a half turn.
    angle : ndarray, shape (N,)
        Angles [rad], from 0 to pi.
    """
    skew = rotation - rotation.transpose(0, 2, 1)
    axis = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    return axis, np.arctan2(np.linalg.norm(axis, axis=1), np.trace(rotation, axis1=1, axis2=2) - 1.0)
