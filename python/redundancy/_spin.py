"""The angle of a tool about its own axis."""

import numpy as np

from ._core import Robot
from ._transport import transport
from ._util import F64


def spin_along(robot: Robot, axis: F64, q: F64) -> F64:
    """Return how far a tool has turned about its axis since the first point.

    Parameters
    ----------
    robot : Robot
        The robot.
    axis : ndarray, shape (N, 3)
        Unit vectors: directions of the tool's axis in the base frame.
    q : ndarray, shape (N, n)
        Joint coordinates.

    Returns
    -------
    ndarray, shape (N,)
        Angle of a tool axis, projected perpendicular to ``axis``, from where transport without spin would have taken it
        [rad], unwrapped; 0 at the first point.
    """
    tools = robot.fk(q)[:, :3, :3]
    # The x axis shows the spin, unless the tool turns about it.
    pointer = tools[:, :, 0 if abs(float(tools[0, :, 0] @ axis[0])) < 0.9 else 1]
    start = pointer[0] - (pointer[0] @ axis[0]) * axis[0]
    reference = transport(axis) @ (start / np.linalg.norm(start))
    across = np.cross(axis, reference)
    angle: F64 = np.unwrap(np.arctan2((pointer * across).sum(axis=1), (pointer * reference).sum(axis=1)))
    return angle
