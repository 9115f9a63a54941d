"""Grids of the spin and of the joints that a robot has to spare."""

from itertools import combinations, product
from typing import Final

import numpy as np

from ._core import Robot, Task
from ._util import F64
from .errors import InvalidValueError

_MOVING: Final = 6
_EDGE: Final = 1e-3
"""How far from its limits a spare joint's grid begins, relative to its range."""


def angle_grid(task: Task, n_angles: int, spin_range: tuple[float, float] | None) -> F64:
    """Return the spins of a grid [rad]: from -pi over a whole turn, from end to end of a range, or 0 for a full task.

    Raises
    ------
    InvalidValueError
        If there is not at least one angle, or the range is not one.
    """
    if task.kind == "full":
        return np.zeros(1)
    if n_angles < 1:
        raise InvalidValueError(f"n_angles is {n_angles}, expected at least 1")
    if spin_range is None:
        return np.linspace(-np.pi, np.pi, n_angles, endpoint=False)
    low, high = spin_range
    if not (np.isfinite(low) and np.isfinite(high) and low < high <= low + 2.0 * np.pi):
        raise InvalidValueError(
            f"spin_range is {spin_range}, expected two increasing angles at most a turn apart [rad]"
        )
    return np.linspace(low, high, n_angles) if n_angles > 1 else np.array([0.5 * (low + high)])


def spare_grid(robot: Robot, spare: tuple[int, ...] | None, n_spare: int) -> tuple[tuple[int, ...], F64]:
    """Choose the joints that are held on a grid, and their values.

    Parameters
    ----------
    robot : Robot
        The robot.
    spare : tuple of int, optional
        The joints, counted from 0; chosen if not given.
    n_spare : int
        Values of each.

    Returns
    -------
    spare : tuple of int
        The joints.
    values : ndarray, shape (S, k)
        Every combination of their values [rad or m].

    Raises
    ------
    InvalidValueError
        If six revolute joints are not what is left.
    """
    chosen = tuple(_choice(robot) if spare is None else spare)
    if n_spare < 1:
        raise InvalidValueError(f"n_spare is {n_spare}, expected at least 1")
    left = "".join(letter for i, letter in enumerate(robot.joints) if i not in chosen)
    if left != "R" * _MOVING or any(not 0 <= joint < robot.n for joint in chosen):
        raise InvalidValueError(
            f"spare is {chosen}, which leaves the joints {left!r} of {robot.joints!r}, expected six revolute ones"
        )
    columns = [_values(robot, joint, n_spare) for joint in chosen]
    return chosen, np.array(list(product(*columns)))


def _choice(robot: Robot) -> tuple[int, ...]:
    """Return the joints to hold: all that slide, and those without which the rest has a closed form."""
    sliding = [i for i, letter in enumerate(robot.joints) if letter == "P"]
    turning = [i for i, letter in enumerate(robot.joints) if letter == "R"]
    count = len(turning) - _MOVING
    if count < 0:
        raise InvalidValueError(f"robot has the joints {robot.joints!r}, expected at least six revolute ones")
    # The middle of a joint's range is as good as any other place to look at the geometry, but no multiple of a right
    # angle, where axes of other places happen to meet.
    choices = [tuple(sorted([*sliding, *extra])) for extra in combinations(turning, count)]
    rank = {"wrist": 0, "parallel": 1, "general": 2}
    return min(choices, key=lambda joints: rank[robot.with_fixed(dict.fromkeys(joints, 0.37)).structure])


def _values(robot: Robot, joint: int, count: int) -> F64:
    low, high = robot.q_min[joint], robot.q_max[joint]
    if not np.isfinite(high - low):
        if robot.joints[joint] == "P":
            raise InvalidValueError(f"joint {joint + 1} slides without limits, expected limits for a spare joint")
        return np.linspace(-np.pi, np.pi, count, endpoint=False)
    edge = _EDGE * (high - low)
    return np.linspace(low + edge, high - edge, count) if count > 1 else np.array([0.5 * (low + high)])
