"""What robots of few joints, or in a plane, can do of a task, and by which rows their postures are valued."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal, TypeAlias

import numpy as np

from .._core import ConditionNumber, Robot, Task
from .._util import F64
from ..errors import InvalidValueError
from ..paths import Trajectory

_Projector: TypeAlias = Literal["free", "full"] | tuple[Literal["line", "plane"], F64]

_POSTURES: Final = 8
_SAME: Final = 1e-9
"""Directions that differ by less are one."""
_REACHED: Final = 1e-6
"""Errors below this are none [m, rad]: a solver's own tolerance is far below."""


def rows_for(robot: Robot, axis: F64, asked: Sequence[int] | None = None) -> list[int]:
    """Return the rows of the Jacobian by which postures are valued.

    Parameters
    ----------
    robot : Robot
        The robot.
    axis : ndarray, shape (3,)
        Direction of the tool's axis in the base frame.
    asked : sequence of int, optional
        The answer, if somebody knows it.

    Returns
    -------
    list of int
        The rows in use if these are no more than joints; else those without the row of the tool's spin, the angular row
        nearest to the axis; else the linear ones. Of these the first in which the robot can move in every direction.

    Raises
    ------
    InvalidValueError
        If there are none, or those asked for are wrong.
    """
    if asked is not None:
        if not asked or list(asked) != sorted(set(asked) & set(range(6))) or len(asked) > robot.n:
            raise InvalidValueError(
                f"rows is {list(asked)}, expected at most {robot.n} different numbers from 0 to 5 in increasing order"
            )
        return list(asked)
    rows = robot.rows_in_use()
    spin = max((row for row in rows if row < 3), key=lambda row: abs(axis[row]), default=None)
    choices = [rows, [row for row in rows if row != spin], [row for row in rows if row >= 3]]
    choices = [choice for choice in choices if 0 < len(choice) <= robot.n]
    if not choices:
        raise InvalidValueError(
            f"rows in use are {rows}, more than the {robot.n} joints: choose some (--rows, key rows)"
        )
    jacobians = robot.jacobian(robot.random_postures(_POSTURES))
    moves = (choice for choice in choices if np.linalg.matrix_rank(jacobians[:, choice]).max() == len(choice))
    return next(moves, choices[0])


def mixed(rows: Sequence[int]) -> bool:
    """Return whether rows have both units, angular and linear ones, so that a length matters."""
    return 0 < sum(row < 3 for row in rows) < len(rows)


def possible(task: Task, robot: Robot) -> Task:
    """Return the part of a task that the joints of a robot change: what is always as it is cannot be asked for.

    Parameters
    ----------
    task : Task
        "axisymmetric", "position" or "full".
    robot : Robot
        The robot.

    Returns
    -------
    Task
        The task itself for a robot that moves and turns its tool in every direction. One that always points the tool
        in one direction is not told where to point it, one in a plane not how high it is. Whether the path has them
        where they are is for `judged` to tell.
    """
    rows = robot.rows_in_use()
    linear = _projector([row - 3 for row in rows if row >= 3])
    angular = _projector([row for row in rows if row < 3])
    if task.kind == "position":
        return Task("free", linear, "base") if linear != "full" else task
    if task.kind == "full":
        return task if angular == linear == "full" else Task(angular, linear, "base")
    axes = robot.fk(robot.random_postures(_POSTURES))[:, :3, :3] @ task.axis
    if np.ptp(axes, axis=0).max() > _SAME:
        return task
    return Task("free", linear, "base")


def _projector(rows: Sequence[int]) -> _Projector:
    """Return which directions, of the three along the axes of the base, are among some."""
    if len(rows) in (0, 3):
        return "full" if rows else "free"
    alone = rows[0] if len(rows) == 1 else next(row for row in range(3) if row not in rows)
    return ("line" if len(rows) == 1 else "plane"), np.eye(3)[alone]


def judged(trajectory: Trajectory, task: Task, rows: Sequence[int]) -> Trajectory:
    """Return a trajectory with the errors of the whole task, and valued by some rows.

    Parameters
    ----------
    trajectory : Trajectory
        Found for the part of the task that is `possible`.
    task : Task
        The whole.
    rows : sequence of int
        Rows of the Jacobian.
    """
    robot, path = trajectory.robot, trajectory.path
    tool = robot.fk(trajectory.q)
    distance = np.linalg.norm(tool[:, :3, 3] - path.position, axis=1)
    angle = trajectory.axis_error
    if task.kind == "axisymmetric":
        axis = tool[:, :3, :3] @ task.axis
        across = np.linalg.norm(np.cross(axis, path.axis), axis=1)
        angle = np.arctan2(across, (axis * path.axis).sum(axis=1))
    lost = (distance > _REACHED) | (angle > _REACHED)
    status = ["unreachable" if bad else old for bad, old in zip(lost, trajectory.status, strict=True)]
    index = ConditionNumber(trajectory.length or 1.0, rows=rows)
    value, *_ = index.evaluate_many(robot, trajectory.q, 0)
    return replace(trajectory, condition_number=value, position_error=distance, axis_error=angle, status=status)
