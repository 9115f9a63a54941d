"""How good a joint trajectory is, and which of two is better (Huo 2009, section 5.3.3, Fig. 5.1)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._core import Manipulability, Robot, SingularityParameter
from .._util import F64, checked
from ..errors import InvalidValueError
from ..paths import Trajectory

SINGULARITY_CONSTANT = 0.5
"""Constant k of Fig. 5.1: differences of the singularity parameter below it do not count near a limit."""

NEAR = 0.05
"""What "very close to a limit" means here, as a share of the range; the thesis gives no number."""


@dataclass(frozen=True)
class Performance:
    """What counts of a joint trajectory.

    Attributes
    ----------
    limit_distance : float
        Greatest distance of any joint at any point beyond its nearer limit, as a share of the joint's range: positive
        outside the limits, 0 at one, -0.5 at best; -inf where no joint has both limits.
    singularity : float
        Worst, that is largest, parameter of singularity w_ps with length 1 (4.6); inf at a singularity.
    manipulability : float
        Smallest manipulability with length 1 (4.4); 0 at a singularity.
    ranges : tuple of float
        Distance between the extremes of each joint [rad or m].
    speeds : tuple of float or None
        Largest speed of each joint from a point to the next [rad/s or m/s]; None without times.
    unreachable : int
        Points that were not reached.
    """

    limit_distance: float
    singularity: float
    manipulability: float = np.nan
    ranges: tuple[float, ...] = ()
    speeds: tuple[float, ...] | None = None
    unreachable: int = 0

    @property
    def within_limits(self) -> bool:
        """Whether no joint leaves its limits."""
        return self.limit_distance <= 0.0

    @classmethod
    def of(cls, robot: Robot, q: ArrayLike, time: ArrayLike | None = None, unreachable: int = 0) -> "Performance":
        """Measure a joint trajectory.

        Parameters
        ----------
        robot : Robot
            The robot, n joints.
        q : array_like, shape (N, n)
            Joint coordinates [rad or m], N at least 1.
        time : array_like, shape (N,), optional
            Increasing times [s].
        unreachable : int
            Points that were not reached; it is copied.

        Returns
        -------
        Performance
            The measures.

        Raises
        ------
        ShapeError, NonFiniteError
            If an array has the wrong shape or is not finite.
        InvalidValueError
            If there is no point, time does not increase, or the robot has fewer joints than rows that move, so that
            neither index is defined.
        """
        postures = checked("q", q, (None, robot.n))
        if len(postures) == 0:
            raise InvalidValueError("q has no points, expected at least 1")
        rows = robot.rows_in_use()
        if len(rows) > robot.n:
            raise InvalidValueError(f"robot {robot.name!r} has {robot.n} joints, expected at least {len(rows)}")
        singularity = SingularityParameter(1.0, rows=rows).evaluate_many(robot, postures, 0)[0]
        manipulability = Manipulability(1.0, rows=rows).evaluate_many(robot, postures, 0)[0]
        return cls(
            limit_distance=float(limit_distances(robot, postures).max(initial=-np.inf)),
            singularity=float(singularity.max()),
            manipulability=float(manipulability.min()),
            ranges=tuple(np.ptp(postures, axis=0).tolist()),
            speeds=None if time is None else _largest_speeds(postures, checked("time", time, (len(postures),))),
            unreachable=unreachable,
        )

    @classmethod
    def of_trajectory(cls, trajectory: Trajectory) -> "Performance":
        """Measure a trajectory, see `of`; NaN or infinities in it raise NonFiniteError."""
        return cls.of(trajectory.robot, trajectory.q, trajectory.time, len(trajectory.unreachable))


def limit_distances(robot: Robot, q: F64) -> F64:
    """Return how far joints are beyond their nearer limits, (6.1) with its sign turned to that of section 5.3.3.

    Parameters
    ----------
    robot : Robot
        The robot, n joints.
    q : ndarray, shape (..., n)
        Joint coordinates [rad or m].

    Returns
    -------
    ndarray, shape (..., n)
        Shares of the joint's range: positive outside, negative within; -inf for joints without both limits, and for
        those whose limits coincide and hold 0, or inf beyond such limits.
    """
    reach = robot.q_max - robot.q_min
    bounded = np.isfinite(reach)
    beyond = np.maximum(robot.q_min - q, q - robot.q_max)
    with np.errstate(invalid="ignore", divide="ignore"):
        share: F64 = np.where(reach > 0.0, beyond / reach, np.where(beyond > 0.0, np.inf, 0.0))
    return np.where(bounded, share, -np.inf)


def improvement(new: Performance, old: Performance, k: float = SINGULARITY_CONSTANT, near: float = NEAR) -> float:
    """Tell by how much a trajectory is better than another, in the criterion that the rule of Fig. 5.1 selects.

    With a joint out of its limits in either, the limit distance decides; so it does with a joint closer to a limit than
    ``near`` in either, where the singularity parameters differ by less than ``k``; otherwise the singularity parameter
    decides. Points that were not reached, of which the thesis says nothing, come before everything.

    Parameters
    ----------
    new, old : Performance
        What to compare.
    k : float
        Constant of the rule, at least 0.
    near : float
        Share of the range within which a joint is very close to its limit, at least 0.

    Returns
    -------
    float
        Positive where ``new`` is better: points not reached, the difference of the limit distances (a share of the
        range), or the relative decrease of the singularity parameter, 1 from a singularity to anything regular and
        -inf the other way.

    Raises
    ------
    InvalidValueError
        If ``k`` or ``near`` is negative or not finite.

    Notes
    -----
    The rule is no order: near a limit A may be better than B, B than C and C than A, since differences of the parameter
    below ``k`` are passed over but add up. Whoever searches with it has to bound the number of steps.
    """
    for name, value in (("k", k), ("near", near)):
        if not 0.0 <= value < np.inf:
            raise InvalidValueError(f"{name} is {value}, expected a finite number of at least 0")
    if new.unreachable != old.unreachable:
        return float(old.unreachable - new.unreachable)
    outside = not (new.within_limits and old.within_limits)
    close = max(new.limit_distance, old.limit_distance) > -near
    if outside or (close and _singularity_differs_less(new, old, k)):
        return _difference(old.limit_distance, new.limit_distance)
    return _relative_decrease(new.singularity, old.singularity)


def better(new: Performance, old: Performance, k: float = SINGULARITY_CONSTANT, near: float = NEAR) -> bool:
    """Tell whether a trajectory is better than another by the rule of Fig. 5.1; parameters as for `improvement`.

    Returns
    -------
    bool
        False where they are equally good.

    Raises
    ------
    InvalidValueError
        If ``k`` or ``near`` is negative or not finite.
    """
    return improvement(new, old, k, near) > 0.0


def _singularity_differs_less(new: Performance, old: Performance, k: float) -> bool:
    # Equal comes first: two infinities have no difference.
    return new.singularity == old.singularity or abs(new.singularity - old.singularity) < k


def _difference(old: float, new: float) -> float:
    return 0.0 if old == new else old - new


def _relative_decrease(new: float, old: float) -> float:
    if new == old:
        return 0.0
    return 1.0 if old == math.inf else 1.0 - new / old


def _largest_speeds(q: F64, time: F64) -> tuple[float, ...]:
    step = np.diff(time)
    if (step <= 0.0).any():
        point = int(np.argmax(step <= 0.0)) + 1
        raise InvalidValueError(f"time[{point}] is {time[point]}, expected more than {time[point - 1]}")
    largest = np.abs(np.diff(q, axis=0) / step[:, None]).max(axis=0, initial=0.0)
    return tuple(float(speed) for speed in largest)
