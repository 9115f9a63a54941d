"""One linear programme of the search for the fastest motion: how far 1/v^2 can fall within a trust region."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from .._util import F64
from ..loops import Motion
from ..paths import Differences
from ..robots import Derivatives, TorqueFunction
from .tolerance import STEP

LEAST_SHARE = 0.25
"""Share of the present 1/v^2 to which one step may bring it: the model of the rates is a tangent there."""


@dataclass(frozen=True)
class MotionLimits:
    """What bounds a motion: limits of each joint, infinite where there is none; the function of torques, if any.

    ``derivatives`` are those of that function, where they are known.
    """

    rate: F64
    acceleration: F64
    torque: F64
    function: TorqueFunction | None
    derivatives: Derivatives | None
    low: F64
    high: F64

    def speeds(self, motion: Motion) -> F64:
        """Return the largest speeds that points allow [m/s], shape (N,); 0 where a robot cannot even rest."""
        speeds = [motion.by_rate(self.rate), motion.by_acceleration(self.acceleration)]
        if self.function is not None:
            speeds.append(motion.by_torque(self.function, self.torque))
        slowest: F64 = np.min(speeds, axis=(0, 2))
        return slowest

    def demand(self, motion: Motion) -> float:
        """Return the largest 1/v^2 that a motion demands [s^2/m^2]; inf where it cannot even rest."""
        slowest = float(self.speeds(motion).min())
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
    """Return the rows |alpha + w g| <= w tau."""
    alpha, rest = motion.torques(torque)
    derivatives = limits.derivatives or partial(_by_differences, torque)
    in_q, in_rate, mass = derivatives(motion.q, motion.first, motion.second)
    still = np.zeros_like(motion.q)
    # alpha is the torque at speed 1 less g.
    in_q = in_q + (w - 1.0) * derivatives(motion.q, still, still)[0]
    rows = []
    for joint in np.flatnonzero(np.isfinite(limits.torque)):
        scale = limits.torque[joint] * w
        for sign in (1.0, -1.0):
            slopes = tuple(sign * part[:, joint] / scale for part in (in_q, in_rate, mass))
            factor = (sign * rest[:, joint] - limits.torque[joint]) / scale
            rows.append(Rows(sign * alpha[:, joint] / scale, factor, (slopes[0], slopes[1], slopes[2])))
    return rows


def _by_differences(torque: TorqueFunction, q: F64, qd: F64, qdd: F64) -> tuple[F64, F64, F64]:
    """Return the derivatives of torques: exact in rates, in which these are quadratic, and in accelerations."""
    in_q, in_rate, mass = np.empty((3, *q.shape, q.shape[1]))
    for k, unit in enumerate(np.eye(q.shape[1])):
        for part, step, shift in ((in_q, STEP, (1, 0, 0)), (in_rate, 1.0, (0, 1, 0)), (mass, 1.0, (0, 0, 1))):
            move = [step * on * unit for on in shift]
            ahead, behind = (
                np.asarray(torque(q + sign * move[0], qd + sign * move[1], qdd + sign * move[2]))
                for sign in (1.0, -1.0)
            )
            part[:, :, k] = (ahead - behind) / (2.0 * step)
    return in_q, in_rate, mass


@dataclass(frozen=True)
class Linear:
    """A motion and its neighbourhood, N points in all.

    Attributes
    ----------
    motion : Motion
        Postures and their derivatives in the length of the path.
    w : float
        The 1/v^2 that it demands [s^2/m^2].
    slopes : ndarray, shape (N, 6, 3)
        Derivatives of the postures in tilt and spin.
    differences : Differences
        Derivatives in the length of the path.
    basis : sparse array, shape (N, m)
        From control values of tilt and spin to their values at the points.
    outside : ndarray, shape (N,)
        Signed distances to the volume [rad].
    normal : ndarray, shape (N, 3)
        Derivatives of these in tilt and spin.
    """

    motion: Motion
    w: float
    slopes: F64
    differences: Differences
    basis: Any
    outside: F64
    normal: F64


def least_demand(model: Linear, limits: MotionLimits, radius: float) -> tuple[F64, float] | None:
    """Minimise w = 1/v^2 over the linear model within a trust region.

    Parameters
    ----------
    model : Linear
        The model.
    limits : MotionLimits
        Limits of the motion.
    radius : float
        Largest change of a control value [rad].

    Returns
    -------
    tuple of (ndarray, shape (m, 3), float), or None
        The change of the control values, and the least w; None where the model has no answer.
    """
    from scipy import sparse
    from scipy.optimize import linprog

    motion, w, every = model.motion, model.w, np.arange(len(model.motion.q))
    blocks = [_at_points(model.normal, every, len(every))]
    bounds, factors = [-model.outside], [np.zeros(len(every))]
    for row in rows_of(motion, limits, w):
        blocks.append(_in_angles(row, model.slopes, model.differences))
        bounds.append(-row.constant)
        factors.append(row.factor)
    for sign, gap in ((1.0, limits.high - motion.q), (-1.0, motion.q - limits.low)):
        for joint in np.flatnonzero(np.isfinite(gap).all(axis=0)):
            blocks.append(_at_points(sign * model.slopes[:, joint], every, len(every)))
            bounds.append(gap[:, joint])
            factors.append(np.zeros(len(every)))
    matrix = sparse.vstack(blocks, format="csr") @ sparse.kron(model.basis, sparse.eye_array(3), format="csr")
    bound, factor = np.concatenate(bounds), np.concatenate(factors)
    # Rows that nothing within the trust region can reach only cost time.
    lowest = LEAST_SHARE * w
    kept = np.flatnonzero(radius * abs(matrix).sum(axis=1) + lowest * factor > bound)
    whole = sparse.hstack([matrix[kept], factor[kept, None]], format="csr")
    box = np.array([[-radius, radius]] * matrix.shape[1] + [[lowest, np.inf]])
    cost = np.eye(len(box))[-1]
    found = linprog(cost, A_ub=whole, b_ub=bound[kept], bounds=box, method="highs")
    return None if found.x is None else (found.x[:-1].reshape(-1, 3), float(found.x[-1]))


def _in_angles(row: Rows, slopes: F64, differences: Differences) -> Any:  # noqa: ANN401
    """Return slopes in tilt and spin of all points: those of a point and of the neighbours whose differences it has."""
    count = len(slopes)
    total = _at_points(np.einsum("ij,ijk->ik", row.slopes[0], slopes), np.arange(count), count)
    for k, column in enumerate(differences.points.T):
        weight = differences.first[:, k, None] * row.slopes[1] + differences.second[:, k, None] * row.slopes[2]
        total = total + _at_points(np.einsum("ij,ijk->ik", weight, slopes[column]), column, count)
    return total


def _at_points(values: F64, points: Any, count: int) -> Any:  # noqa: ANN401
    """Return a sparse array, shape (M, 3 N), with three values of one point a row."""
    from scipy import sparse

    rows = np.repeat(np.arange(len(points)), 3)
    columns = (3 * points[:, None] + np.arange(3)).ravel()
    return sparse.csr_array((values.ravel(), (rows, columns)), shape=(len(points), 3 * count))
