"""Frames carried along a path without spin."""

import numpy as np

from ._arrays import F64


def transport(axis: F64) -> F64:
    """Carry a frame along unit vectors by the smallest rotation from each to the next.

    Parameters
    ----------
    axis : ndarray, shape (N, 3)
        Unit vectors.

    Returns
    -------
    ndarray, shape (N, 3, 3)
        Rotation i takes ``axis[0]`` to ``axis[i]``; the first is the identity. None of the steps turns about its axis.
        Where two successive axes are opposite the smallest rotation is not unique: it is then about some perpendicular.
    """
    rotations = np.empty((len(axis), 3, 3))
    rotations[0] = np.eye(3)
    for i in range(1, len(axis)):
        rotations[i] = _smallest(axis[i - 1], axis[i]) @ rotations[i - 1]
        # Rounding must not pile up over long paths.
        rotations[i] = _nearest_rotation(rotations[i])
    return rotations


def perpendicular(vector: F64) -> F64:
    """Return a unit vector perpendicular to a unit vector, both of shape (3,)."""
    other = np.eye(3)[np.argmin(np.abs(vector))]
    normal = np.cross(vector, other)
    result: F64 = normal / np.linalg.norm(normal)
    return result


def _smallest(start: F64, end: F64) -> F64:
    cosine = float(start @ end)
    if cosine < -1.0 + 1e-12:
        normal = perpendicular(start)
        half_turn: F64 = 2.0 * np.outer(normal, normal) - np.eye(3)
        return half_turn
    x, y, z = np.cross(start, end)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: F64 = np.eye(3) + cross + cross @ cross / (1.0 + cosine)
    return rotation


def _nearest_rotation(matrix: F64) -> F64:
    # One Newton step towards the polar factor: enough from an error of rounding size.
    rotation: F64 = 1.5 * matrix - 0.5 * matrix @ matrix.T @ matrix
    return rotation
