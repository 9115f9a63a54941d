"""Orientations along a path as curves of tilt and spin, and the postures of a six-joint robot that belong to them."""

from typing import Any

import numpy as np

from .._core import Robot
from .._util import F64, turns
from ..loops import Motion
from ..paths import Differences

STEP = 1e-6
"""Step of central differences [rad]: rounding over it, and its square, both stay below 1e-9."""

DEGREE = 3
"""Of the curves: with cubic ones accelerations are continuous."""


def tilted(angles: F64) -> F64:
    """Return rotations by tilt and spin.

    Parameters
    ----------
    angles : ndarray, shape (N, 3)
        The rotation vector of the tilt (its parts along x and y) and then the spin about the tool's z axis [rad].

    Returns
    -------
    ndarray, shape (N, 3, 3)
        Rotations relative to the path's frame.
    """
    tilt = np.pad(angles[:, :2], ((0, 0), (0, 1)))
    swing: F64 = turns(tilt, np.linalg.norm(tilt, axis=1)) @ turns(np.array([0.0, 0.0, 1.0]), angles[:, 2])
    return swing


def tilt_and_spin(rotation: F64) -> F64:
    """Return tilt and spin of rotations by less than a half turn of the tool's axis: the inverse of `tilted`.

    Parameters
    ----------
    rotation : ndarray, shape (N, 3, 3)
        Rotations relative to the path's frame.

    Returns
    -------
    ndarray, shape (N, 3)
        Parts of the tilt and the spin [rad]; the spin is continuous along the path.
    """
    z = rotation[:, :, 2]
    across = np.hypot(z[:, 0], z[:, 1])
    tilt = np.arctan2(across, z[:, 2]) / np.where(across > 0.0, across, 1.0)
    swing = np.stack([-tilt * z[:, 1], tilt * z[:, 0], np.zeros(len(z))], axis=1)
    rest = turns(swing, np.linalg.norm(swing, axis=1)).transpose(0, 2, 1) @ rotation
    swing[:, 2] = np.unwrap(np.arctan2(rest[:, 1, 0], rest[:, 0, 0]))
    return swing


def splines(s: F64, spacing: float) -> Any:  # noqa: ANN401  (scipy has no types)
    """Return a matrix from control values to values at points: cubic splines with knots at equal distances.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Increasing lengths of the path to the points [m].
    spacing : float
        Largest distance of the knots [m].

    Returns
    -------
    scipy.sparse.csr_array, shape (N, m)
        Its rows are not negative and sum up to 1: values stay between those of the control points near them.
    """
    from scipy.interpolate import BSpline

    pieces = max(int(np.ceil((s[-1] - s[0]) / spacing)), 1)
    inner = np.linspace(s[0], s[-1], pieces + 1)
    knots = np.concatenate([np.repeat(s[0], DEGREE), inner, np.repeat(s[-1], DEGREE)])
    return BSpline.design_matrix(s, knots, DEGREE).tocsr()


class Postures:
    """The postures of a robot along a path, by tilt and spin.

    Parameters
    ----------
    robot : Robot
        Of six joints.
    position : ndarray, shape (N, 3)
        Tool points [m].
    frames : ndarray, shape (N, 3, 3)
        Orientations of the path.
    differences : Differences
        Derivatives in the length of the path.
    """

    def __init__(self, robot: Robot, position: F64, frames: F64, differences: Differences) -> None:
        self.robot = robot
        self.position = position
        self.frames = frames
        self.differences = differences

    def rotation(self, angles: F64) -> F64:
        """Return the orientations of the tool in the base frame, shape (N, 3, 3)."""
        rotation: F64 = self.frames @ tilted(angles)
        return rotation

    def angles(self, q: F64) -> F64:
        """Return the tilt and the spin of postures at all points, shape (N, 3)."""
        return tilt_and_spin(self.frames.transpose(0, 2, 1) @ self.robot.fk(q)[:, :3, :3])

    def at(self, angles: F64, near: F64) -> F64 | None:
        """Return the postures nearest to others, shape (N, 6); None where a point has none."""
        pose = np.tile(np.eye(4), (len(angles), 1, 1))
        pose[:, :3, :3], pose[:, :3, 3] = self.rotation(angles), self.position
        found, frame = self.robot.inverse(pose, near=near)
        first = np.searchsorted(frame, np.arange(len(angles)))
        if (first >= len(frame)).any() or (frame[first] != np.arange(len(angles))).any():
            return None
        return np.asarray(found)[first]

    def motion(self, q: F64) -> Motion:
        """Return postures with their derivatives in the length of the path."""
        return Motion(q, *self.differences.of(q))

    def slopes(self, angles: F64, q: F64) -> F64 | None:
        """Return the derivatives of postures in tilt and spin, shape (N, 6, 3), by differences."""
        slopes = np.empty((*q.shape, 3))
        for k, shift in enumerate(STEP * np.eye(3)):
            ends = [self.at(angles + sign * shift, q) for sign in (1.0, -1.0)]
            if ends[0] is None or ends[1] is None:
                return None
            slopes[:, :, k] = (ends[0] - ends[1]) / (2.0 * STEP)
        return slopes
