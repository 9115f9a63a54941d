"""A control loop in which the rates of a solver are followed exactly, before a robot does it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from .. import plots
from .._core import Objective, OrthogonalSQP, QuadraticProgram, RateSolver
from .._util import F64, axis_angle, between, checked, progress_bar, turns
from ..errors import InvalidValueError
from ..paths import Toolpath

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Stepper = QuadraticProgram | OrthogonalSQP | RateSolver
"""What makes joint rates of a path, tick by tick."""

_UNHURRIED: Final = 10.0
"""Gain where accelerations have limits [1/s]."""
_MOST_TICKS: Final = 10_000_000
"""Ticks of a path at most: ten thousand seconds at 1 kHz."""


def stiffness_profile(share: ArrayLike, low: float = 1.0, high: float = 1e4, ramp: float = 0.2) -> F64:
    """Return how much a deviation from the path weighs: much at both ends of the path, little in between.

    Parameters
    ----------
    share : array_like
        Share of the path, from 0 to 1; what is beyond counts as the end.
    low, high : float
        Weights in the middle and at the ends, above 0. Dufour and Suleiman (2020) use 1 to 10 and 1e4 to 1e5.
    ramp : float
        Share of the path over which the weight falls, and rises again; above 0, at most 0.5.

    Returns
    -------
    ndarray
        Weights, of the shape of ``share``: quintic polynomials with flat ends on either side of a constant.

    Raises
    ------
    InvalidValueError
        If a weight or the ramp is out of its domain.

    Notes
    -----
    The profile of Dufour and Suleiman (2020, figure 1), whose polynomials are not printed: these have no jump in the
    first two derivatives.
    """
    for name, value in (("low", low), ("high", high)):
        if not 0.0 < value < np.inf:
            raise InvalidValueError(f"{name} is {value}, expected a finite number above 0")
    if not 0.0 < ramp <= 0.5:
        raise InvalidValueError(f"ramp is {ramp}, expected a share above 0, at most 0.5")
    s = np.clip(np.asarray(share, dtype=np.float64), 0.0, 1.0)
    x = np.clip(np.minimum(s, 1.0 - s) / ramp, 0.0, 1.0)
    fallen = x**3 * (10.0 + x * (6.0 * x - 15.0))
    profile: F64 = high + (low - high) * fallen
    return profile


@dataclass(frozen=True, eq=False)
class Tracking:
    """What came of a control loop, tick by tick.

    Attributes
    ----------
    program : QuadraticProgram, OrthogonalSQP, TwistDecomposition or another method
        The solver.
    time : ndarray, shape (N + 1,)
        Times of the postures [s].
    q : ndarray, shape (N + 1, n)
        Postures; the first is the start [rad or m].
    rates : ndarray, shape (N, n)
        Rates from each posture to the next [rad/s or m/s].
    deviation : ndarray, shape (N, 6)
        The part of the twist that was not followed, as far as the task looks at it, [omega; v] in rad/s and m/s.
    distance : ndarray, shape (N + 1,)
        Smallest distance to obstacles and between bodies [m]; infinite without a scene.
    status : list of str
        How each step ended, as ``status`` of the solver.
    position_error, axis_error : ndarray, shape (N + 1,)
        Distance [m] and angle [rad] to the path.
    value : ndarray, shape (N + 1,)
        The objective; NaN without one that has a value.
    """

    program: Stepper
    time: F64 = field(repr=False)
    q: F64 = field(repr=False)
    rates: F64 = field(repr=False)
    deviation: F64 = field(repr=False)
    distance: F64 = field(repr=False)
    status: list[str] = field(repr=False)
    position_error: F64 = field(repr=False)
    axis_error: F64 = field(repr=False)
    value: F64 = field(repr=False)

    def __repr__(self) -> str:
        """Say how long, and how the steps ended."""
        ended = ", ".join(f"{count} {name}" for name, count in Counter(self.status).most_common())
        return f"Tracking({self.time[-1]:.3f} s: {ended})"

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the joints, the error, the objective and the distance over time.

        Parameters
        ----------
        path : path-like, optional
            Where to save it.

        Returns
        -------
        matplotlib.figure.Figure
            The figure.
        """
        return plots.saved(plots.tracking_figure(self), path)


def track(
    solver: Stepper,
    path: Toolpath,
    q0: ArrayLike,
    *,
    stiffness: Callable[[F64], F64] | None = None,
    gain: float | None = None,
    before: Callable[[float], None] | None = None,
    hold: float = 0.0,
    progress: bool = True,
) -> Tracking:
    """Follow a path in time as a control loop would.

    At every tick the solver gets the twist of the path, and what takes up the error of the tool; its rates are followed
    exactly until the next tick.

    Parameters
    ----------
    solver : QuadraticProgram, OrthogonalSQP, TwistDecomposition or another method
        Robot, task, tick, obstacles. What it remembers of earlier steps is forgotten first.
    path : Toolpath
        With times: points in between are interpolated, positions linearly and orientations along the shortest arc.
        Without: one point a tick.
    q0 : array_like, shape (n,)
        Posture at the start [rad or m]. It need not be on the path.
    stiffness : callable, optional
        For a QuadraticProgram: gets the shares of time (N,) from 0 to 1, returns the weight of the deviation at each,
        as `stiffness_profile` does; the programme's own if not given.
    gain : float, optional
        Part of the error that is taken up in a second [1/s], at most 1 / dt, with which the next point is reached
        within the tick (Dufour and Suleiman 2020, eq. 1). If not given, that; 10 for a robot with limits of
        acceleration, which needs room to brake.
    before : callable, optional
        Called with the time [s] before every step: the place to move obstacles.
    hold : float
        Time for which the last point is held [s].
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    Tracking
        Every tick.

    Raises
    ------
    InvalidValueError
        If the path takes more than ten million ticks, a number is not finite, ``gain`` is out of its domain, or
        ``stiffness`` is given with a solver that has none.
    ShapeError
        If ``q0`` does not fit the robot.
    """
    robot, dt, objective = solver.robot, solver.dt, solver.objective
    targets = _ticks(solver, path, hold)
    count, share = len(targets) - 1, _share(solver, gain)
    step = _stepper(solver, stiffness, count, share)
    scene = solver.scene if isinstance(solver, QuadraticProgram) else None
    q, rates, deviation = np.empty((count + 1, robot.n)), np.empty((count, robot.n)), np.empty((count, 6))
    q[0] = checked("q0", q0, (robot.n,))
    distance, status = np.full(count + 1, np.inf), []
    # Views are made once, and the tick is an array: an index, and a number that becomes one, cost as much as a twist.
    length = np.array(dt)
    points, postures, row = list(targets), list(q), list(rates)
    solver.reset()
    with progress_bar(count, "tracking", progress) as advance:
        for k in range(count + 1):
            if before is not None:
                before(k * dt)
            if scene is not None:
                distance[k] = scene.distance(postures[k])
            if k == count:
                break
            step(k, postures[k], points[k], points[k + 1], row[k])
            deviation[k] = solver.deviation
            status.append(solver.status)
            np.add(postures[k], np.multiply(row[k], length, postures[k + 1]), postures[k + 1])
            advance(1)
    value = np.full(count + 1, np.nan)
    if isinstance(objective, Objective):
        value = objective.evaluate_many(robot, q, 0)[0]
    time = dt * np.arange(count + 1, dtype=np.float64)
    missing = solver.error(q, targets)
    position, angle = np.linalg.norm(missing[:, 3:], axis=1), np.linalg.norm(missing[:, :3], axis=1)
    return Tracking(solver, time, q, rates, deviation, distance, status, position, angle, value)


def _stepper(
    solver: Stepper, stiffness: Callable[[F64], F64] | None, count: int, share: float
) -> Callable[[int, F64, F64, F64, F64], object]:
    """Return what makes the rates of tick k out of its posture and of where the tool should be at its two ends."""
    if stiffness is None:
        return lambda k, q, now, there, rates: solver.step_along(q, now, there, rates, share=share)
    if not isinstance(solver, QuadraticProgram):
        raise InvalidValueError(
            f"stiffness is given, expected none: a {type(solver).__name__} follows the task as it is"
        )
    weights = np.broadcast_to(
        np.asarray(stiffness(np.arange(1, count + 1) / count), dtype=np.float64), (count,)
    ).tolist()
    return lambda k, q, now, there, rates: solver.step_along(q, now, there, rates, share=share, stiffness=weights[k])


def _share(solver: Stepper, gain: float | None) -> float:
    """Return the part of the error that is taken up in a tick."""
    most = 1.0 / solver.dt
    if gain is None:
        gain = min(most, _UNHURRIED) if np.isfinite(solver.robot.qdd_max).any() else most
    if not 0.0 < gain <= most * (1.0 + 1e-9):
        raise InvalidValueError(f"gain is {gain}, expected a number above 0, at most 1 / dt = {most}")
    return min(gain * solver.dt, 1.0)


def _ticks(solver: Stepper, path: Toolpath, hold: float) -> F64:
    """Return where the tool should be at the start and at the end of every tick."""
    if not 0.0 <= hold < np.inf:
        raise InvalidValueError(f"hold is {hold}, expected a finite time of at least 0 [s]")
    still = round(hold / solver.dt)
    if path.time is None:
        count = len(path) + still
    else:
        count = int(np.ceil((path.time[-1] - path.time[0]) / solver.dt - 1e-9)) + still
    count = max(count, 1)
    if count > _MOST_TICKS:
        raise InvalidValueError(f"path takes {count} ticks of {solver.dt} s, expected at most {_MOST_TICKS}")
    if path.time is None:
        return path.targets(solver.task)[np.clip(np.arange(-1, count), 0, len(path) - 1)]
    times = np.minimum(path.time[0] + solver.dt * np.arange(count + 1), path.time[-1])
    return _at(path, times).targets(solver.task)


def _at(path: Toolpath, times: F64) -> Toolpath:
    """Return the path at some times: positions along lines, orientations along the shortest arcs."""
    known = path.time
    if known is None or len(path) < 2:
        rows = np.zeros(len(times), dtype=np.intp)
        return Toolpath(path.position[rows], path.axis[rows], None if path.rotation is None else path.rotation[rows])
    position = np.stack([np.interp(times, known, column) for column in path.position.T], axis=1)
    first = np.clip(np.searchsorted(known, times, side="right") - 1, 0, len(known) - 2)
    share = (times - known[first]) / (known[first + 1] - known[first])
    if path.rotation is None:
        axis = path.axis[first]
        normal, angle = between(axis, path.axis[first + 1])
        return Toolpath(position, (turns(normal, share * angle) @ axis[:, :, None])[:, :, 0])
    start = path.rotation[first]
    normal, angle = axis_angle(path.rotation[first + 1] @ start.transpose(0, 2, 1))
    turned = turns(normal, share * angle)
    axis = (turned @ path.axis[first][:, :, None])[:, :, 0]
    return Toolpath(position, axis, turned @ start)
