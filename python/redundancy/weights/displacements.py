"""What the task, the joint limits and the singularities each move in a step of the twist decomposition (4.10)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .._core import PosturePull, Robot, SingularityParameter, Task, TwistDecomposition
from .._util import F64, checked
from .setting import checked_weights

UNCUT = 2.0**-40
"""What pulls are multiplied by, and motions divided: the core cuts a pull at 0.3 rad or m a joint, (4.10) does not."""

LARGEST_PARAMETER = 1e6
"""What w_ps counts as at most, as in `PosturePull`."""


class Displacements(NamedTuple):
    """The three parts of (4.10), each of shape (n,) [rad or m]; their sum is the step.

    ``task`` moves the tool. ``limits`` goes towards the middle of the ranges (redundant displacement 1), and
    ``singularity`` towards the posture where w_ps passed its threshold (redundant displacement 2).
    """

    task: F64
    limits: F64
    singularity: F64


def displacements(
    robot: Robot,
    task: Task,
    q: ArrayLike,
    twist: ArrayLike,
    w: ArrayLike,
    k: ArrayLike = 0.0,
    held: ArrayLike | None = None,
    *,
    middle: ArrayLike | None = None,
) -> Displacements:
    """Return what the three parts of (4.10) move at a posture.

    Parameters
    ----------
    robot : Robot
        The robot, n joints.
    task : Task
        What the tool has to do; the rest of the twist is free.
    q : array_like, shape (n,)
        Posture [rad or m].
    twist : array_like, shape (6,)
        Wanted small motion [rotation; translation] of the tool point in the base frame [rad, m], or a twist [rad/s,
        m/s], which makes rates of the first part.
    w, k : array_like, shape (n,) or ()
        Weights of joint limits and of singularity, at least 0.
    held : array_like, shape (n,), optional
        The posture q_Ts at which the parameter of singularity w_ps passed its threshold [rad or m]; below the threshold
        there is none, and the third part is 0.
    middle : array_like, shape (n,), optional
        The posture of the second part [rad or m]; the middle of the ranges if not given.

    Returns
    -------
    Displacements
        ``task``, J^+ T t; ``limits``, J^+ (1 - T) J W (middle - q); ``singularity``, J^+ (1 - T) J K w_ps (q_Ts - q).
        With more joints than rows that move, the last two contain what the null space of J takes of the pulls, as in
        `TwistDecomposition`.

    Raises
    ------
    ShapeError, NonFiniteError
        If an array has the wrong shape or is not finite.
    InvalidValueError
        If a weight is negative.

    Notes
    -----
    At a singularity J^+ is damped as in `TwistDecomposition`, and w_ps counts as 1e6 where it is larger.
    """
    posture, motion = checked("q", q, (robot.n,)), checked("twist", twist, (6,))
    pull, away = checked_weights("w", w, robot.n), checked_weights("k", k, robot.n)
    still, singularity = np.zeros(6), np.zeros(robot.n)
    if held is not None:
        index = SingularityParameter(1.0, rows=robot.rows_in_use())
        strength = min(float(index.evaluate(robot, posture, 0)), LARGEST_PARAMETER)
        back = PosturePull(UNCUT * strength * away, middle=checked("held", held, (robot.n,)))
        singularity = _moved(robot, task, posture, still, back)
    return Displacements(
        task=_moved(robot, task, posture, motion, None),
        limits=_moved(robot, task, posture, still, PosturePull(UNCUT * pull, middle=middle)),
        singularity=singularity,
    )


def _moved(robot: Robot, task: Task, q: F64, twist: F64, pull: PosturePull | None) -> F64:
    """Return the step (3.8) for a twist and a pull."""
    gain = 1.0 if pull is None else 1.0 / UNCUT
    # In so short a tick the tool's way does not bend: (3.8) as it stands, however long the motion.
    return TwistDecomposition(robot, task, pull, gain=gain, limits=False, dt=1e-12).step(q, twist)
