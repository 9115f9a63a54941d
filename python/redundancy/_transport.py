"""Frames carried along a path without spin."""

import numpy as np

from ._util import F64, perpendicular


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
    steps = _smallest(axis[:-1], axis[1:])
    turned = (axis[:-1] != axis[1:]).any(axis=1)
    for i in range(1, len(axis)):
        # Rounding must not pile up over long paths.
        rotations[i] = _nearest_rotation(steps[i - 1] @ rotations[i - 1]) if turned[i - 1] else rotations[i - 1]
    return rotations


def _smallest(start: F64, end: F64) -> F64:
    """Return the smallest rotations from unit vectors (M, 3) to others, shape (M, 3, 3)."""
    cosine = (start * end).sum(axis=1)
    x, y, z = np.cross(start, end).T
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    opposite = cosine < -1.0 + 1e-12
    factor = 1.0 / np.where(opposite, 1.0, 1.0 + cosine)
    rotation: F64 = np.eye(3) + cross + factor[:, None, None] * (cross @ cross)
    for i in np.flatnonzero(opposite):
        normal = perpendicular(start[i])
        rotation[i] = 2.0 * np.outer(normal, normal) - np.eye(3)
    return rotation


def _nearest_rotation(matrix: F64) -> F64:
    # One Newton step towards the polar factor: enough from an error of rounding size.
    rotation: F64 = 1.5 * matrix - 0.5 * matrix @ matrix.T @ matrix
    return rotation
