"""The largest manipulability of a robot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .._core import Manipulability, Robot
from .._util import F64
from ..errors import InvalidValueError

__all__ = ["ManipulabilityResult", "maximum_manipulability"]

_KEPT: Final = 64
"""Starts from which the search climbs."""
_ITERATIONS: Final = 100
"""Steps of a climb at most."""
_SETTLED: Final = 1e-9
"""A climb ends where the next step is shorter than this [rad or m]."""
_AT: Final = 1e-9
"""How near a combination of joints is to a limit that it is at, in the joints [rad or m]."""
_SHARES: Final = 0.5 ** np.arange(12)
"""Parts of a Newton step that are tried."""
_LARGEST_STEP: Final = 0.5
"""Largest motion of a joint in one step [rad or m]."""
_LEAST_CURVATURE: Final = 1e-6
"""Curvatures count as at least this part of the largest."""

_Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ManipulabilityResult:
    """A posture of largest manipulability.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Joint coordinates [rad or m].
    manipulability : float
        sqrt(det(J J')) there.
    slope : float
        Largest derivative along a joint that a limit does not hold: 0 at a maximum.
    at_limit : ndarray of bool, shape (n,)
        The joints that a limit holds.
    """

    q: F64
    manipulability: float
    slope: float
    at_limit: _Flags


def maximum_manipulability(
    robot: Robot,
    length: float = 1.0,
    *,
    rows: Sequence[int] | None = None,
    limits: bool = True,
    starts: int = 20_000,
    seed: int = 0,
) -> ManipulabilityResult:
    """Find the posture of largest manipulability, which normalises the index over all postures.

    Parameters
    ----------
    robot : Robot
        The robot.
    length : float
        Divides the linear rows of the Jacobian [m]: 1 for SI units.
    rows : sequence of int, optional
        Rows of the Jacobian in use; all six if not given (planar robots: [2, 3, 4]).
    limits : bool
        Whether position limits hold.
    starts : int
        Random postures that are looked at, at least 1; the search climbs from the 64 best.
    seed : int
        Seed of the random postures.

    Returns
    -------
    ManipulabilityResult
        The best that was found. No proof that there is no better one: more starts, or another seed, tell.

    Raises
    ------
    InvalidValueError
        If a setting is out of its domain or the rows cannot be used with this robot.

    Notes
    -----
    Newton's method with the exact Hessian in the joints that no limit holds, each curvature taken as its size, so that
    every step climbs. A sliding joint without limits, with which the manipulability may grow without bound, is
    searched near 0.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.Robot.from_dh([0.7, 0.4], [0, 0], [0, 0], [0, 0])  # a1 a2 |sin q2| where only the position counts
    >>> round(rd.maximum_manipulability(robot, rows=[3, 4], starts=100).manipulability, 6)
    0.28
    """
    if starts < 1:
        raise InvalidValueError(f"starts is {starts}, expected at least 1")
    index, open_ended = Manipulability(length, rows=rows), np.full(robot.n, np.inf)
    searched = robot if limits else robot.with_limits(-open_ended, open_ended, coupled=[])
    low, high = searched.q_min, searched.q_max
    q = searched.random_postures(starts, seed)
    q = q[np.argsort(index.evaluate_many(robot, q, 0)[0])[-_KEPT:]]
    for _ in range(_ITERATIONS):
        value, gradient, hessian = index.evaluate_many(robot, q, 2)
        assert gradient is not None
        assert hessian is not None
        free = _freedom(searched, q, gradient)
        step = _newton(gradient, hessian, free)
        step *= _room(searched, q, step)
        tried = np.clip(q + _SHARES[:, None, None] * step, low, high)
        found = np.stack(
            [np.where(searched.within_limits(x), index.evaluate_many(robot, x, 0)[0], -np.inf) for x in tried]
        )
        best = found.argmax(axis=0)
        better = found.max(axis=0) > value
        moved = np.abs(tried[best, np.arange(len(q))] - q).max(axis=1) * better
        q[better] = tried[best, np.arange(len(q))][better]
        if moved.max() < _SETTLED:
            break
    value, gradient = index.evaluate_many(robot, q, 1)[:2]
    assert gradient is not None
    k, held = int(value.argmax()), _held(q, gradient, low, high)
    slope = _freedom(searched, q, gradient)[k] @ gradient[k]
    return ManipulabilityResult(q[k], float(value[k]), float(np.abs(slope).max()), held[k])


def _held(q: F64, gradient: F64, low: F64, high: F64) -> _Flags:
    """Return which joints are at a limit that the gradient points beyond."""
    return ((q <= low) & (gradient < 0.0)) | ((q >= high) & (gradient > 0.0))


def _rows(robot: Robot) -> F64:
    """Return the rows of limits on combinations of joints, (k, n)."""
    rows = np.zeros((len(robot.coupled_limits), robot.n))
    for row, (terms, _, _) in zip(rows, robot.coupled_limits, strict=True):
        row[list(terms)] = list(terms.values())
    return rows


def _freedom(robot: Robot, q: F64, gradient: F64) -> F64:
    """Return the projectors, (K, n, n), onto what joints and combinations leave that no limit holds."""
    held = _held(q, gradient, robot.q_min, robot.q_max)
    free: F64 = np.eye(robot.n) * ~held[:, None, :]
    rows = _rows(robot)
    ends = np.array([limits[1:] for limits in robot.coupled_limits]).reshape(-1, 2)
    for k in range(len(q) if len(rows) else 0):
        values, slopes, size = rows @ q[k], rows @ free[k] @ gradient[k], np.linalg.norm(rows, axis=1)
        at_low = (values <= ends[:, 0] + _AT * size) & (slopes < 0.0)
        at_high = (values >= ends[:, 1] - _AT * size) & (slopes > 0.0)
        pressed = rows[at_low | at_high] @ free[k]
        free[k] -= np.linalg.pinv(pressed) @ pressed
    return free


def _room(robot: Robot, q: F64, step: F64) -> F64:
    """Return the part of each step, at most all of it, that takes no combination of joints beyond its limit."""
    part = np.ones((len(q), 1))
    for row, (_, low, high) in zip(_rows(robot), robot.coupled_limits, strict=True):
        value, change = q @ row, step @ row
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(change > 0.0, (high - value) / change, (low - value) / change)
        part[:, 0] = np.minimum(
            part[:, 0], np.where(np.abs(change) > _AT * np.linalg.norm(row), np.maximum(room, 0.0), 1.0)
        )
    return part


def _newton(gradient: F64, hessian: F64, free: F64) -> F64:
    """Return a step that climbs in what a projector leaves, no joint moving far; no step without derivatives."""
    slope = np.einsum("kij,kj->ki", free, np.nan_to_num(gradient))
    values, vectors = np.linalg.eigh(free @ np.nan_to_num(hessian) @ free)
    size = np.abs(values)
    size = np.maximum(size, _LEAST_CURVATURE * size.max(axis=1, keepdims=True)) + np.finfo(float).tiny
    along = np.einsum("kia,ki->ka", vectors, slope) / size
    step: F64 = np.einsum("kij,kja,ka->ki", free, vectors, along)
    largest = np.abs(step).max(axis=1, keepdims=True)
    step *= np.minimum(1.0, _LARGEST_STEP / np.maximum(largest, np.finfo(float).tiny))
    return step
