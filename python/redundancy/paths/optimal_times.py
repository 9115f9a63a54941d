"""Times along a path that are least under limits of the joints, by toppra."""

from typing import NamedTuple

import numpy as np

from .._util import F64, checked
from ..errors import InvalidValueError
from ..robots import TorqueFunction

_FREE = 1e3
"""Limits that are infinite become so many times what a motion at the other joints' limits asks for: never active."""


class MotionBounds(NamedTuple):
    """Largest rates, accelerations and, with their function, torques of joints, shape (n,); infinite for none."""

    rate: F64
    acceleration: F64 | None
    torque: tuple[TorqueFunction, F64] | None


def least_times(s: F64, q: F64, bounds: MotionBounds, start_speed: float, end_speed: float) -> F64:
    """Return the least times at which a robot can be at postures along a path.

    Parameters
    ----------
    s : ndarray, shape (N,)
        Increasing lengths of the path to the points [m], from 0.
    q : ndarray, shape (N, n)
        Postures; a cubic spline joins them.
    bounds : MotionBounds
        Limits, held at the points and, for accelerations and torques, on both sides of each.
    start_speed, end_speed : float
        Speeds along the path at its ends [m/s].

    Returns
    -------
    ndarray, shape (N,)
        Times [s], from 0.

    Raises
    ------
    InvalidValueError
        If no limit is finite, a speed is negative, or no motion keeps the limits.
    """
    import toppra
    from toppra import constraint
    from toppra.algorithm import TOPPRA

    for name, speed in {"start_speed": start_speed, "end_speed": end_speed}.items():
        if checked(name, speed, ()) < 0.0:
            raise InvalidValueError(f"{name} is {speed}, expected a number from 0 up")
    if len(s) < 2:
        raise InvalidValueError("trajectory has a single point, expected at least 2")
    both = constraint.DiscretizationType.Interpolation
    constraints: list[object] = []
    if np.isfinite(bounds.rate).any():
        constraints.append(constraint.JointVelocityConstraint(_pairs(bounds.rate)))
    if bounds.acceleration is not None and np.isfinite(bounds.acceleration).any():
        constraints.append(
            constraint.JointAccelerationConstraint(_pairs(bounds.acceleration), discretization_scheme=both)
        )
    if bounds.torque is not None and np.isfinite(bounds.torque[1]).any():
        function, limit = bounds.torque

        def torque(at: F64, rate: F64, acceleration: F64) -> F64:
            one: F64 = np.asarray(function(at[None], rate[None], acceleration[None]), dtype=np.float64)[0]
            return one

        friction = np.zeros(len(limit))
        constraints.append(
            constraint.JointTorqueConstraint(torque, _pairs(limit), friction, discretization_scheme=both)
        )
    if not constraints:
        raise InvalidValueError("rate, acceleration and torque: no limit is finite, expected at least one")
    spline = toppra.SplineInterpolator(s, q)
    found = TOPPRA(constraints, spline, gridpoints=s, solver_wrapper="seidel")
    speed = found.compute_parameterization(start_speed, end_speed)[1]
    if speed is None or not np.isfinite(speed).all():
        raise InvalidValueError(
            f"no motion from {start_speed} m/s to {end_speed} m/s keeps the limits: those of rest, at these speeds, or "
            "along the path"
        )
    # Between two points the acceleration along the path is constant.
    mean = 0.5 * (speed[1:] + speed[:-1])
    if not (mean > 0.0).all():
        raise InvalidValueError(f"no motion passes point {int(np.argmin(mean))} within the limits")
    return np.concatenate([[0.0], np.cumsum(np.diff(s) / mean)])


def _pairs(limit: F64) -> F64:
    """Return lower and upper limits, shape (n, 2), large numbers for infinite ones."""
    finite = np.isfinite(limit)
    most = np.where(finite, limit, _FREE * limit[finite].max())
    return np.stack([-most, most], axis=1)
