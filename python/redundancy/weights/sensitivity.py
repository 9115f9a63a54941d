"""Which weights matter for the spin of a tool (Huo 2009, section 5.3.2)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._core import Robot, Task
from .._util import F64, checked
from ..errors import InvalidValueError

ANGLE_TOLERANCE = float(np.deg2rad(5.0))
"""How far from parallel or perpendicular axes may be, unless a caller says otherwise [rad]."""

WRIST = 3
"""Joints at the end of the arm whose weights are tuned."""

Case = Literal["perpendicular", "parallel", "oblique"]


@dataclass(frozen=True)
class Sensitivity:
    """Which weights to tune.

    Attributes
    ----------
    case : str
        How the tool's axis lies to the last joint's: "perpendicular", "parallel" or "oblique".
    joints : tuple of int
        Joints whose weights matter, counted from 0, the most sensitive first.
    angle : float
        Angle between the lines of the two axes [rad], 0 to pi/2.
    scores : tuple of float
        Sensitivity of each of ``joints``: what the probe returned, otherwise the mean of |e_i . e_t|.
    """

    case: Case
    joints: tuple[int, ...]
    angle: float
    scores: tuple[float, ...]


def axis_cosines(robot: Robot, task: Task, q: ArrayLike) -> F64:
    """Return |e_i . e_t| of every joint axis and the tool's axis, the cosine of beta_i in (6.2).

    By (3.8) the spin rate that a secondary motion h adds is the sum of (e_i . e_t) h_i, so this is how much the weight
    of joint i can do at a posture.

    Parameters
    ----------
    robot : Robot
        The robot, n joints.
    task : Task
        An axisymmetric task; its axis counts.
    q : array_like, shape (N, n)
        Postures [rad or m].

    Returns
    -------
    ndarray, shape (N, n)
        0 to 1; 0 for prismatic joints, which turn nothing.

    Raises
    ------
    ShapeError, NonFiniteError
        If ``q`` has the wrong shape or is not finite.
    InvalidValueError
        If the task is not axisymmetric: no axis is free then, or all are.
    """
    if task.kind != "axisymmetric":
        raise InvalidValueError(f"task is {task.kind!r}, expected an axisymmetric one: weights are tuned for its spin")
    postures = checked("q", q, (None, robot.n))
    tool = robot.fk(postures)[:, :3, :3] @ task.axis
    cosines: F64 = np.abs(np.einsum("nki,nk->ni", robot.jacobian(postures)[:, :3], tool))
    return np.minimum(cosines, 1.0)


def sensitivity(
    robot: Robot,
    task: Task,
    q: ArrayLike,
    probe: Callable[[int], float] | None = None,
    tolerance: float = ANGLE_TOLERANCE,
    keep: int = 2,
) -> Sensitivity:
    """Choose which of the last three weights to tune.

    With the tool's axis perpendicular to the last joint's, its weight has no influence: the two before it remain. With
    parallel axes the last but one has none, for the axes of a wrist are perpendicular in turn (5.4): the last and the
    last but two remain. Otherwise all three count, each weight is tried alone and the most sensitive are kept.

    Parameters
    ----------
    robot : Robot
        The robot, n joints, at least 3, the last three of which turn.
    task : Task
        An axisymmetric task.
    q : array_like, shape (N, n)
        A trajectory, N at least 1: the angle between tool and last joint is the same all along it, the others vary.
    probe : callable, optional
        Takes a joint, counted from 0, and returns how much the performance changes with its weights alone. It is called
        in the oblique case only; |e_i . e_t|, averaged over the trajectory, stands for it if not given.
    tolerance : float
        Deviation from parallel or perpendicular that passes for either [rad], 0 to pi/4.
    keep : int
        How many joints the oblique case keeps, 1 to 3.

    Returns
    -------
    Sensitivity
        The case and the joints.

    Raises
    ------
    ShapeError, NonFiniteError
        If ``q`` has the wrong shape or is not finite.
    InvalidValueError
        If the robot or the task does not fit, or a parameter is outside its domain.

    Notes
    -----
    The thesis keeps the weights of the first three joints out, as a decoupled arm turns its tool with the wrist. By
    (3.8) they count all the same: what a weight does depends on |e_i . e_t| alone, see `axis_cosines`.
    """
    _check_arguments(robot, tolerance, keep)
    cosines = axis_cosines(robot, task, q)
    if len(cosines) == 0:
        raise InvalidValueError("q has no points, expected at least 1")
    last = robot.n - 1
    mean = cosines.mean(axis=0)
    angle = float(np.arccos(mean[last]))
    if angle >= 0.5 * np.pi - tolerance:
        return _chosen("perpendicular", (last - 1, last - 2), angle, mean)
    if angle <= tolerance:
        return _chosen("parallel", (last, last - 2), angle, mean)
    joints = (last, last - 1, last - 2)
    scores = {i: float(mean[i]) if probe is None else float(probe(i)) for i in joints}
    for i, score in scores.items():
        if np.isnan(score):
            raise InvalidValueError(f"probe of joint {i} is nan, expected a number")
    # Sorting is stable: of equals, the joint nearest to the tool comes first.
    ranked = tuple(sorted(joints, key=lambda i: -scores[i])[:keep])
    return Sensitivity("oblique", ranked, angle, tuple(scores[i] for i in ranked))


def _check_arguments(robot: Robot, tolerance: float, keep: int) -> None:
    if robot.n < WRIST or robot.joints[-WRIST:] != "R" * WRIST:
        raise InvalidValueError(
            f"robot {robot.name!r} has joints {robot.joints!r}, expected three that turn at the end"
        )
    if not 0.0 <= tolerance <= 0.25 * np.pi:
        raise InvalidValueError(f"tolerance is {tolerance}, expected 0 to pi/4 (an angle in rad)")
    if keep not in (1, 2, 3):
        raise InvalidValueError(f"keep is {keep}, expected 1, 2 or 3")


def _chosen(case: Case, joints: tuple[int, ...], angle: float, mean: F64) -> Sensitivity:
    return Sensitivity(case, joints, angle, tuple(float(mean[i]) for i in joints))
