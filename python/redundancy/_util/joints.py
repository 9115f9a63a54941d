"""Joint coordinates as the robot has them and as its controller has them, for what is written and shown."""

from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from .._core import Robot
from ..errors import InvalidValueError
from .arrays import F64

Joints: TypeAlias = Literal["robot", "controller"]
"""Whose coordinates are meant."""
JOINTS: Final[tuple[Joints, ...]] = get_args(Joints)


def checked_joints(joints: str) -> Joints:
    """Return whose joints are meant, or raise an InvalidValueError."""
    for known in JOINTS:
        if joints == known:
            return known
    raise InvalidValueError(f"joints is {joints!r}, expected {' or '.join(map(repr, JOINTS))}")


def kinds_of(robot: Robot, joints: Joints) -> str:
    """Return one letter a joint, "R" or "P": the controller's are of the kind of what moves them most."""
    if joints == "robot":
        return robot.joints
    return "".join(robot.joints[k] for k in np.abs(robot.controller.matrix).argmax(axis=1))


def coordinates_of(robot: Robot, q: F64, joints: Joints) -> F64:
    """Return postures [rad or m], shape (N, n), as the robot or its controller has them."""
    return q if joints == "robot" else np.asarray(robot.controller.from_robot(q))


def limits_of(robot: Robot, joints: Joints) -> tuple[F64, F64]:
    """Return lower and upper limits [rad or m], shape (n,) each.

    A joint of the controller that several of the robot's move has no limits of its own: infinite ones.
    """
    low, high = robot.q_min, robot.q_max
    if joints == "robot":
        return low, high
    controller = robot.controller
    alone = (controller.matrix != 0.0).sum(axis=1) == 1
    leading = np.abs(controller.matrix).argmax(axis=1)
    factor = controller.matrix[np.arange(robot.n), leading]
    ends = np.sort(factor * np.stack([low[leading], high[leading]]) + controller.offset, axis=0)
    return np.where(alone, ends[0], -np.inf), np.where(alone, ends[1], np.inf)


def names_of(robot: Robot, joints: Joints) -> list[str]:
    """Return what joints are called where they are shown: "joint 1" or a name, or the controller's name."""
    return list(robot.joint_names) if joints == "robot" else robot.controller.names
