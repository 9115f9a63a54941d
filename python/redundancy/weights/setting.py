"""What both ways of adapting weights need: checked input, one run of the twist decomposition."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._core import PosturePull, Robot, Task, TwistDecomposition
from .._util import F64, checked
from ..errors import InvalidValueError, ShapeError
from ..loops import first_posture, follow
from ..paths import Toolpath, Trajectory

THRESHOLD = 5.0
"""Parameter of singularity from which the singularity is avoided (section 4.3.1)."""

DEFAULT_WEIGHT = 0.01
"""Weight of every joint before it is adapted (3.32), (5.5)."""


@dataclass(frozen=True)
class Setting:
    """A path, a robot to follow it, where it starts and how the twist decomposition is run."""

    robot: Robot
    path: Toolpath
    task: Task
    start: F64
    threshold: float
    iterations: int

    def run(self, w: F64, k: F64) -> Trajectory:
        """Follow the path with weights that stay the same along it."""
        return follow(self.solver(PosturePull(w, k, threshold=self.threshold)), self.path, self.start, progress=False)

    def solver(self, pull: PosturePull) -> TwistDecomposition:
        """Return a solver that pulls the posture, (3.8) with (4.9)."""
        return TwistDecomposition(self.robot, self.task, pull, iterations=self.iterations)


def setting(
    robot: Robot, path: Toolpath, task: Task, w: F64, k: F64, start: ArrayLike | None, threshold: float, iterations: int
) -> Setting:
    """Check what both ways of adapting have in common, and find a starting posture if none is given.

    Raises
    ------
    ShapeError, NonFiniteError, InvalidValueError
        If an argument is not what it should be.
    """
    if task.kind != "axisymmetric":
        raise InvalidValueError(f"task is {task.kind!r}, expected an axisymmetric one: weights are tuned for its spin")
    if not 0.0 < threshold < np.inf:
        raise InvalidValueError(f"threshold is {threshold}, expected a finite number above 0")
    if iterations < 1:
        raise InvalidValueError(f"iterations is {iterations}, expected at least 1")
    given = None if start is None else checked("start", start, (robot.n,))
    made = Setting(robot, path, task, np.zeros(robot.n) if given is None else given, float(threshold), int(iterations))
    if given is not None:
        return made
    found = first_posture(made.solver(PosturePull(w, k, threshold=threshold)), path.targets(task)[0])
    return Setting(robot, path, task, found, made.threshold, made.iterations)


def checked_weights(name: str, value: ArrayLike, n: int) -> F64:
    """Return weights as an array of shape (n,), one number standing for n equal ones.

    Raises
    ------
    ShapeError, NonFiniteError, InvalidValueError
        If there are not n numbers, or one is not finite or negative.
    """
    if np.ndim(value) == 0:
        value = np.full(n, checked(name, value, ()))
    weights = checked(name, value, (None,))
    if len(weights) != n:
        raise ShapeError(f"{name}: got shape {weights.shape}, expected ({n},)")
    if (weights < 0.0).any():
        i = int(np.argmin(weights))
        raise InvalidValueError(f"{name}[{i}] is {weights[i]}, expected at least 0")
    return weights
