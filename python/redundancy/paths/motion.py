"""How a robot moves along a path: derivatives of its joints in the length of the path, by differences."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._util import F64
from ..errors import InvalidValueError


class Differences(NamedTuple):
    """Weights of the values at four points that make up a first and a second derivative: arrays of shape (N, 4)."""

    points: NDArray[np.intp]
    first: F64
    second: F64

    def of(self, q: F64) -> tuple[F64, F64]:
        """Return first and second derivatives of values at the points, shape (N, n) each."""
        near = q[self.points]
        return np.einsum("ij,ijk->ik", self.first, near), np.einsum("ij,ijk->ik", self.second, near)


def differences(s: F64) -> Differences:
    """Return weights for derivatives at points along a path.

    Within the path they are those of the parabola through a point and its neighbours: of second order at equal
    distances. At both ends those of the parabola, and for the second derivative of the cubic, through the nearest.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Increasing lengths of the path to the points [m].

    Returns
    -------
    Differences
        The weights; zero for a path of one point.
    """
    count = len(s)
    index = np.clip(np.add.outer(np.arange(count), np.arange(-1, 3)), 0, count - 1)
    first, second = np.zeros((count, 4)), np.zeros((count, 4))
    if count > 1:
        _fill(first, second, s, index[1:-1, :3], slice(1, -1))
        for end, way in ((0, 1), (count - 1, -1)):
            near = end + way * np.arange(min(count, 4))
            index[end, : len(near)] = near
            three, four = np.zeros((1, 4)), np.zeros((1, 4))
            _fill(three, np.zeros((1, 4)), s, near[None, :3], slice(None), end)
            _fill(np.zeros((1, 4)), four, s, near[None], slice(None), end)
            first[end], second[end] = three[0], four[0]
    return Differences(index, first, second)


def _fill(first: F64, second: F64, s: F64, near: np.ndarray, rows: slice, at: int | None = None) -> None:
    """Write the weights of the values at some points into rows, for derivatives at the middle ones or at a point."""
    if not len(near):
        return
    size = near.shape[1]
    offset = s[near] - (s[near[:, 1]] if at is None else s[[at]])[:, None]
    scale = np.abs(offset).max(axis=1)
    powers = (offset / scale[:, None])[:, None, :] ** np.arange(size)[None, :, None]
    wanted = np.zeros((len(near), size, 2))
    wanted[:, 1, 0] = 1.0
    if size > 2:
        wanted[:, 2, 1] = 2.0
    weights = np.linalg.solve(powers, wanted) / np.stack([scale, scale**2], axis=1)[:, None, :]
    first[rows, :size], second[rows, :size] = weights[..., 0], weights[..., 1]


def length_along(position: F64) -> F64:
    """Return the lengths of the path to its points [m], shape (N,): sums of the distances from point to point.

    Raises
    ------
    InvalidValueError
        If the tool point rests from a point to the next, where a constant speed has no meaning; the message names it.
    """
    step = np.linalg.norm(np.diff(position, axis=0), axis=1)
    still = np.flatnonzero(step == 0.0)
    if still.size:
        raise InvalidValueError(f"position[{still[0] + 1}] is position[{still[0]}], expected the tool point to move on")
    return np.concatenate([[0.0], np.cumsum(step)])
