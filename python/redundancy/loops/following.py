"""Following a toolpath from end to end."""

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from .._core import ConditionNumber, Objective, OrthogonalSQP, PathSolution, PosturePull, Robot, Solution, Task
from .._util import F64, checked, progress_bar
from ..paths import Toolpath, Trajectory

_CHUNK = 256
"""Points between two signs of life."""


class Solver(Protocol):
    """What `follow` needs from a method of redundancy resolution; `OrthogonalSQP` and `TwistDecomposition` are."""

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def task(self) -> Task:
        """The task."""

    @property
    def objective(self) -> Objective | PosturePull | None:
        """What the free motion is for."""

    def solve(self, target: ArrayLike, q0: ArrayLike | None = None, starts: int = 64, seed: int = 0) -> Solution:
        """Find a posture on a target."""

    def follow_chunk(self, targets: ArrayLike, q0: ArrayLike) -> PathSolution:
        """Follow some targets from a posture."""


def joined(parts: Sequence[PathSolution]) -> PathSolution:
    """Return what a solver answered to successive parts of a path as one."""
    return PathSolution(
        q=np.concatenate([part.q for part in parts]),
        value=np.concatenate([part.value for part in parts]),
        position_error=np.concatenate([part.position_error for part in parts]),
        axis_error=np.concatenate([part.axis_error for part in parts]),
        status=[word for part in parts for word in part.status],
        iterations=sum(part.iterations for part in parts),
    )


def follow(step: Solver, path: Toolpath, q0: ArrayLike | None = None, progress: bool = True) -> Trajectory:
    """Follow a toolpath: the best posture at the first point, then from each point to the next.

    Parameters
    ----------
    step : OrthogonalSQP, TwistDecomposition or another method
        The solver, with its robot, task and objective.
    path : Toolpath
        The path, N points.
    q0 : array_like, shape (n,), optional
        Start [rad or m]. If not given, the best of many random postures that reach the first point.
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    Trajectory
        Its ``status`` tells which points were not reached; there the posture is the nearest found, and the following
        points start from it.

    Raises
    ------
    ShapeError, NonFiniteError
        If ``q0`` has the wrong shape or is not finite.
    InvalidValueError
        If the task fixes the whole orientation and the path has no rotations.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.robots.get("fanuc_m710ic50_milling")
    >>> step = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(0.4856, squared=True))
    >>> path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0))
    >>> trajectory = rd.follow(step, path)
    >>> trajectory.q.shape, trajectory.max_condition_number < 2.6
    ((101, 6), True)
    """
    targets = path.targets(step.task)
    q = first_posture(step, targets[0]) if q0 is None else checked("q0", q0, (step.robot.n,))
    found = joined(list(_chunks(step, targets, q, progress)))
    length = _length(step)
    return Trajectory(
        robot=step.robot,
        path=path,
        q=found.q,
        condition_number=_condition_number(step.robot, found.q, length),
        value=found.value,
        position_error=found.position_error,
        axis_error=found.axis_error,
        status=found.status,
        length=length,
        iterations=found.iterations,
    )


def follow_without_spin(optimised: Trajectory, objective: Objective, progress: bool = True) -> Trajectory:
    """Follow the path of a trajectory from its first posture with a tool that never turns about its axis.

    It shows what the spin that was chosen is worth.

    Parameters
    ----------
    optimised : Trajectory
        Along a path of an axisymmetric task.
    objective : Objective
        What a robot of more than six joints minimises still.
    progress : bool
        As for `follow`.

    Returns
    -------
    Trajectory
        With the orientation of the tool at the first point carried along the path by the smallest rotations.
    """
    robot, q0 = optimised.robot, optimised.q[0]
    path = optimised.path.without_spin(robot.fk(q0)[:3, :3])
    return follow(OrthogonalSQP(robot, Task.full(), objective), path, q0, progress)


def first_posture(step: Solver, target: F64) -> F64:
    """Return the posture from which `follow` starts on a first target, shape (n,) [rad or m].

    Parameters
    ----------
    step : Solver
        The solver.
    target : ndarray
        A row of `Toolpath.targets`.
    """
    q, _, _, _ = step.solve(target)
    # Where nothing came near, what follows starts in the middle and says "unreachable".
    return step.robot.turned(q) if np.isfinite(q).all() else step.robot.middle


def _chunks(step: Solver, targets: F64, q: F64, show: bool) -> Iterator[PathSolution]:
    with progress_bar(len(targets), "following the path", show) as advance:
        for first in range(0, len(targets), _CHUNK):
            part = step.follow_chunk(targets[first : first + _CHUNK], q)
            q = part.q[-1]
            advance(len(part.q))
            yield part


def _length(step: Solver) -> float | None:
    objective = step.objective
    return (objective.length if isinstance(objective, Objective) else None) or getattr(step, "length", None)


def _condition_number(robot: Robot, q: F64, length: float | None) -> F64:
    rows = robot.rows_in_use()
    if len(rows) > robot.n:
        return np.full(len(q), np.nan)
    index = ConditionNumber(1.0 if length is None else length, rows=rows)
    values: F64 = index.evaluate_many(robot, q, 0)[0]
    return values
