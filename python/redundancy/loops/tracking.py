"""A control loop in which the rates of a quadratic programme are followed exactly, before a robot does it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from .. import plots
from .._core import QuadraticProgram
from .._util import F64, axis_angle, between, checked, progress_bar, turns
from ..errors import InvalidValueError
from ..paths import Toolpath

if TYPE_CHECKING:
    from matplotlib.figure import Figure

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
    program : QuadraticProgram
        The programme.
    time : ndarray, shape (N + 1,)
        Times of the postures [s].
    q : ndarray, shape (N + 1, n)
        Postures; the first is the start [rad or m].
    rates : ndarray, shape (N, n)
        Rates from each posture to the next [rad/s or m/s].
    deviation : ndarray, shape (N, 6)
        The part of the twist that was not followed, [omega; v] in rad/s and m/s.
    distance : ndarray, shape (N + 1,)
        Smallest distance to obstacles and between bodies [m]; infinite without a scene.
    status : list of str
        How each step ended, as `QuadraticProgram.status`.
    position_error, axis_error : ndarray, shape (N + 1,)
        Distance [m] and angle [rad] to the path.
    value : ndarray, shape (N + 1,)
        The objective; NaN without.
    """

    program: QuadraticProgram
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
    program: QuadraticProgram,
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

    At every tick the programme gets the twist of the path, and what takes up the error of the tool; its rates are
    followed exactly until the next tick.

    Parameters
    ----------
    program : QuadraticProgram
        Robot, task, tick, obstacles. What it remembers of earlier steps is forgotten first.
    path : Toolpath
        With times: points in between are interpolated, positions linearly and orientations along the shortest arc.
        Without: one point a tick.
    q0 : array_like, shape (n,)
        Posture at the start [rad or m]. It need not be on the path.
    stiffness : callable, optional
        Gets the shares of time (N,) from 0 to 1, returns the weight of the deviation at each, as `stiffness_profile`
        does; the programme's own if not given.
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
        If the path takes more than ten million ticks, a number is not finite, or ``gain`` is out of its domain.
    ShapeError
        If ``q0`` does not fit the robot.
    """
    robot, dt, scene, objective = program.robot, program.dt, program.scene, program.objective
    targets = _ticks(program, path, hold)
    count = len(targets) - 1
    weights, share = _weights(program, stiffness, count), _share(program, gain)
    q, rates, deviation = np.empty((count + 1, robot.n)), np.empty((count, robot.n)), np.empty((count, 6))
    q[0] = checked("q0", q0, (robot.n,))
    distance, status = np.full(count + 1, np.inf), []
    program.reset()
    with progress_bar(count, "tracking", progress) as advance:
        for k in range(count + 1):
            if before is not None:
                before(k * dt)
            if scene is not None:
                distance[k] = scene.distance(q[k])
            if k == count:
                break
            here, there = (program.twist_to(q[k], target) for target in targets[k : k + 2])
            program.step(q[k], there - (1.0 - share) * here, rates[k], stiffness=weights[k])
            deviation[k] = program.deviation
            status.append(program.status)
            q[k + 1] = q[k] + dt * rates[k]
            advance(1)
    value = np.full(count + 1, np.nan) if objective is None else objective.evaluate_many(robot, q, 0)[0]
    time = dt * np.arange(count + 1, dtype=np.float64)
    return Tracking(program, time, q, rates, deviation, distance, status, *_errors(program, targets, q), value)


def _weights(program: QuadraticProgram, stiffness: Callable[[F64], F64] | None, count: int) -> list[float | None]:
    """Return the weight of the deviation at every tick; None for the programme's own."""
    if stiffness is None:
        return [None] * count
    weights = np.asarray(stiffness(np.arange(1, count + 1) / count), dtype=np.float64)
    return [float(weight) for weight in np.broadcast_to(weights, (count,))]


def _share(program: QuadraticProgram, gain: float | None) -> float:
    """Return the part of the error that is taken up in a tick."""
    most = 1.0 / program.dt
    if gain is None:
        gain = min(most, _UNHURRIED) if np.isfinite(program.robot.qdd_max).any() else most
    if not 0.0 < gain <= most * (1.0 + 1e-9):
        raise InvalidValueError(f"gain is {gain}, expected a number above 0, at most 1 / dt = {most}")
    return gain * program.dt


def _errors(program: QuadraticProgram, targets: F64, q: F64) -> tuple[F64, F64]:
    """Return the distances and the angles to the targets."""
    missing = np.array([program.twist_to(row, target) for row, target in zip(q, targets, strict=True)])
    position: F64 = program.dt * np.linalg.norm(missing[:, 3:], axis=1)
    angle: F64 = program.dt * np.linalg.norm(missing[:, :3], axis=1)
    return position, angle


def _ticks(program: QuadraticProgram, path: Toolpath, hold: float) -> F64:
    """Return where the tool should be at the start and at the end of every tick."""
    if not 0.0 <= hold < np.inf:
        raise InvalidValueError(f"hold is {hold}, expected a finite time of at least 0 [s]")
    still = round(hold / program.dt)
    if path.time is None:
        count = len(path) + still
    else:
        count = int(np.ceil((path.time[-1] - path.time[0]) / program.dt - 1e-9)) + still
    count = max(count, 1)
    if count > _MOST_TICKS:
        raise InvalidValueError(f"path takes {count} ticks of {program.dt} s, expected at most {_MOST_TICKS}")
    if path.time is None:
        return path.targets(program.task)[np.clip(np.arange(-1, count), 0, len(path) - 1)]
    times = np.minimum(path.time[0] + program.dt * np.arange(count + 1), path.time[-1])
    return _at(path, times).targets(program.task)


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
