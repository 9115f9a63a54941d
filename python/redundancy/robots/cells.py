"""Robots with an axis more than their own: on a rail, or in front of a turntable. Both are robots like any other."""

from itertools import count

import numpy as np
from numpy.typing import ArrayLike

from .._core import Robot, perpendicular
from .._util import F64, checked
from ..errors import InvalidValueError

_OVER = np.diag([1.0, -1.0, -1.0, 1.0])
"""Half a turn about x: the joint behind it turns the other way round."""


def on_rail(robot: Robot, direction: ArrayLike, q_min: float, q_max: float, qd_max: float = np.inf) -> Robot:
    """Return a robot that stands on a rail: joint 0 slides its base.

    Parameters
    ----------
    robot : Robot
        The robot; its base is where it stands with the rail at 0.
    direction : array_like, shape (3,)
        Direction of the rail in the world, any length but zero.
    q_min, q_max : float
        Ends of the rail [m].
    qd_max : float
        Its speed limit [m/s].

    Returns
    -------
    Robot
        With the rail as first joint ("P"); paths and frames stay in the world.

    Raises
    ------
    ShapeError, NonFiniteError, InvalidValueError
        If the direction is not a vector, or the ends are in the wrong order.

    Examples
    --------
    >>> import redundancy as rd
    >>> rd.on_rail(rd.robots.get("abb_irb120"), (0.0, 1.0, 0.0), -1.0, 1.0).joints
    'PRRRRRR'
    """
    along = checked("direction", direction, (3,))
    length = float(np.linalg.norm(along))
    if length == 0.0:
        raise InvalidValueError("direction is zero, expected a vector that is not")
    z = along / length
    x = perpendicular(z)
    rail = np.eye(4)
    rail[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return _with_first_joint(
        robot, "P", rail, np.linalg.inv(rail) @ robot.base, (q_min, q_max, qd_max), "rail", "on a rail"
    )


def with_turntable(robot: Robot, table: ArrayLike, q_min: float, q_max: float, qd_max: float = np.inf) -> Robot:
    """Return a robot whose part stands on a turntable: joint 0 turns the table, and the world is the part.

    Parameters
    ----------
    robot : Robot
        The robot in its own world.
    table : array_like, shape (4, 4)
        The part's frame in that world with the table at 0; the table turns about its z axis.
    q_min, q_max : float
        Limits of the table [rad].
    qd_max : float
        Its speed limit [rad/s].

    Returns
    -------
    Robot
        With the table as first joint ("R"). Paths, frames and twists are in the part's frame.

    Raises
    ------
    ShapeError, NonFiniteError, InvalidValueError
        If the frame is none, or the limits are in the wrong order.

    Examples
    --------
    >>> from itertools import count

    import numpy as np
    >>> import redundancy as rd
    >>> table = np.eye(4)
    >>> table[:3, 3] = [0.5, 0.0, 0.2]
    >>> rd.with_turntable(rd.robots.get("abb_irb120"), table, -np.pi, np.pi).n
    7
    """
    frame = checked("table", table, (4, 4))
    to_robot = _OVER @ np.linalg.inv(frame) @ robot.base
    return _with_first_joint(robot, "R", _OVER, to_robot, (q_min, q_max, qd_max), "turntable", "with a turntable")


def _with_first_joint(
    robot: Robot, letter: str, before: F64, after: F64, limits: tuple[float, float, float], name: str, how: str
) -> Robot:
    links = robot.links.copy()
    links[0] = after @ links[0]
    low, high, speed = limits
    while name in robot.joint_names:
        name = f"outer {name}"
    longer = Robot.from_links(
        np.concatenate([before[None], links]),
        robot.flange,
        letter + robot.chain,
        tool=robot.tool,
        name=f"{robot.name} {how}",
        joint_names=[name, *robot.joint_names],
        mimic={i + 1: (driver + 1, factor, offset) for i, (driver, factor, offset) in robot.mimic.items()} or None,
    ).with_limits(
        q_min=np.concatenate([[low], robot.q_min]),
        q_max=np.concatenate([[high], robot.q_max]),
        qd_max=np.concatenate([[speed], robot.qd_max]),
        qdd_max=np.concatenate([[np.inf], robot.qdd_max]),
        coupled=[({joint + 1: c for joint, c in row.items()}, low, high) for row, low, high in robot.coupled_limits],
    )
    own = robot.controller
    if own == robot.with_controller().controller:
        return longer
    name = next(name for name in map("E{}".format, count(1)) if name not in own.names)
    matrix = np.eye(robot.n + 1)
    matrix[1:, 1:] = own.matrix
    return longer.with_controller(matrix, np.concatenate([[0.0], own.offset]), names=[name, *own.names])
