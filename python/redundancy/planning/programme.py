"""One linear programme of the search for the fastest motion: how far 1/v^2 can fall within a trust region."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._util import F64
from ..loops import Motion
from ..robots import TorqueFunction
from .tolerance import STEP

NEAR = 0.25
"""Share of the largest demand of 1/v^2 from which a row counts: a step within the trust region brings none so far."""


@dataclass(frozen=True)
class MotionLimits:
    """What bounds a motion: limits of each joint, infinite where there is none, and the function of torques, if any."""

    rate: F64
    acceleration: F64
    torque: F64
    function: TorqueFunction | None
    low: F64
    high: F64

    def demand(self, motion: Motion) -> float:
        """Return the largest 1/v^2 that a motion demands [s^2/m^2]; inf where it cannot even rest."""
        speeds = [motion.by_rate(self.rate), motion.by_acceleration(self.acceleration)]
        if self.function is not None:
            speeds.append(motion.by_torque(self.function, self.torque))
        slowest = min(float(speed.min()) for speed in speeds)
        return np.inf if slowest == 0.0 else 1.0 / slowest**2


@dataclass(frozen=True)
class Rows:
    """Linear inequalities ``value + slope . (q, q', q'') changes + w part <= 0`` at points of a path.

    ``constant`` and ``factor`` have shape (N,), the value being constant + factor w; slopes, of shape (N, 6) each, are
    those of the value in q, q' and q''.
    """

    constant: F64
    factor: F64
    slopes: tuple[F64, F64, F64]


def rows_of(motion: Motion, limits: MotionLimits, w: float) -> list[Rows]:
    """Return the rows of all criteria and joints, each divided by its limit and by w."""
    n, zero = motion.q.shape[1], np.zeros_like(motion.q)
    rows = []
    for sign in (1.0, -1.0):
        for joint in range(n):
            unit = zero + sign * np.eye(n)[joint]
            if np.isfinite(limits.rate[joint]):
                # |q'| <= qd sqrt(w), whose right side has this tangent at w.
                scale, root = limits.rate[joint] * np.sqrt(w), np.full(len(zero), 0.5)
                rows.append(Rows(sign * motion.first[:, joint] / scale - root, -root / w, (zero, unit / scale, zero)))
            if np.isfinite(limits.acceleration[joint]):
                scale = limits.acceleration[joint] * w
                factor = np.full(len(zero), -1.0 / w)
                rows.append(Rows(sign * motion.second[:, joint] / scale, factor, (zero, zero, unit / scale)))
    if limits.function is not None and np.isfinite(limits.torque).any():
        rows += _torque_rows(motion, limits, limits.function, w)
    return rows


def _torque_rows(motion: Motion, limits: MotionLimits, torque: TorqueFunction, w: float) -> list[Rows]:
    """Return the rows |alpha + w g| <= w tau; the derivatives in q' and q'' are exact, as torques are quadratic."""
    q, qd, qdd = motion.q, motion.first, motion.second
    zero, n = np.zeros_like(q), motion.q.shape[1]
    alpha, rest = motion.torques(torque)
    in_q, in_rate, mass = np.empty((3, *q.shape, n))
    for k, unit in enumerate(np.eye(n)):
        ahead, behind = q + STEP * unit, q - STEP * unit
        # alpha + w g, as the torque at the accelerations of speed 1 less g, plus w g.
        change = [
            np.asarray(torque(at, qd, qdd)) + (w - 1.0) * np.asarray(torque(at, zero, zero)) for at in (ahead, behind)
        ]
        in_q[:, :, k] = (change[0] - change[1]) / (2.0 * STEP)
        in_rate[:, :, k] = 0.5 * (np.asarray(torque(q, qd + unit, zero)) - np.asarray(torque(q, qd - unit, zero)))
        mass[:, :, k] = np.asarray(torque(q, zero, zero + unit)) - rest
    rows = []
    for joint in np.flatnonzero(np.isfinite(limits.torque)):
        scale = limits.torque[joint] * w
        for sign in (1.0, -1.0):
            slopes = tuple(sign * part[:, joint] / scale for part in (in_q, in_rate, mass))
            factor = (sign * rest[:, joint] - limits.torque[joint]) / scale
            rows.append(Rows(sign * alpha[:, joint] / scale, factor, (slopes[0], slopes[1], slopes[2])))
    return rows


def largest_gain(
    rows: list[Rows],
    motion: Motion,
    limits: MotionLimits,
    slopes: F64,
    differences: Any,  # noqa: ANN401
    basis: Any,  # noqa: ANN401
    membership: tuple[F64, F64],
    w: float,
    radius: float,
) -> tuple[F64, float] | None:
    """Solve the linear programme.

    Parameters
    ----------
    rows : list of Rows
        Limits of the motion.
    motion : Motion
        The present motion, of N points.
    limits : MotionLimits
        Its position limits.
    slopes : ndarray, shape (N, 6, 3)
        Derivatives of the postures in tilt and spin.
    differences : Differences
        Derivatives in the length of the path.
    basis : sparse array, shape (N, m)
        From control values to points.
    membership : tuple of ndarray, shapes (N,) and (N, 3)
        Signed distances to the volume and their slopes.
    w : float
        Present 1/v^2 [s^2/m^2].
    radius : float
        Largest change of a control value [rad].

    Returns
    -------
    tuple of (ndarray, shape (m, 3), float), or None
        The change of the control values, and 1/v^2 where all were linear; None where there is no answer.
    """
    from scipy import sparse
    from scipy.optimize import linprog

    blocks, bounds, factors = [], [], []
    count = len(motion.q)
    for row in rows:
        at = np.flatnonzero(row.constant + row.factor * w > NEAR - 1.0)
        blocks.append(_in_angles(row, at, slopes, differences, count))
        bounds.append(-row.constant[at])
        factors.append(row.factor[at])
    distance, normal = membership
    near = np.flatnonzero(distance > -4.0 * radius)
    blocks.append(_at_points(normal[near], near, count))
    bounds.append(-distance[near])
    factors.append(np.zeros(len(near)))
    for sign, gap in ((1.0, limits.high - motion.q), (-1.0, motion.q - limits.low)):
        reach = radius * np.abs(slopes).sum(axis=2)
        for joint in range(motion.q.shape[1]):
            near = np.flatnonzero(gap[:, joint] < 2.0 * reach[:, joint])
            blocks.append(_at_points(sign * slopes[near, joint], near, count))
            bounds.append(gap[near, joint])
            factors.append(np.zeros(len(near)))
    spread = sparse.kron(basis, sparse.eye_array(3), format="csr")
    matrix = sparse.hstack([sparse.vstack(blocks) @ spread, np.concatenate(factors)[:, None]], format="csr")
    cost = np.zeros(matrix.shape[1])
    cost[-1] = 1.0
    box = np.array([[-radius, radius]] * (len(cost) - 1) + [[0.25 * w, 4.0 * w]])
    found = linprog(cost, A_ub=matrix, b_ub=np.concatenate(bounds), bounds=box, method="highs")
    if found.x is None:
        return None
    return found.x[:-1].reshape(-1, 3), float(found.x[-1])


def _in_angles(row: Rows, at: F64, slopes: F64, differences: Any, count: int) -> Any:  # noqa: ANN401
    """Return a row's slopes in tilt and spin of all points: those of a point and of the neighbours it differs from."""
    from scipy import sparse

    total = _at_points(np.einsum("ij,ijk->ik", row.slopes[0][at], slopes[at]), at, count)
    for k in range(differences.index.shape[1]):
        column = differences.index[at, k]
        weight = differences.first[at, k, None] * row.slopes[1][at] + differences.second[at, k, None] * row.slopes[2][at]
        total = total + _at_points(np.einsum("ij,ijk->ik", weight, slopes[column]), column, count)
    return sparse.csr_array(total)


def _at_points(values: F64, points: Any, count: int) -> Any:  # noqa: ANN401
    """Return a sparse array, shape (M, 3 N), with three values of one point a row."""
    from scipy import sparse

    rows = np.repeat(np.arange(len(points)), 3)
    columns = (3 * points[:, None] + np.arange(3)).ravel()
    return sparse.csr_array((values.ravel(), (rows, columns)), shape=(len(points), 3 * count))
