"""Which rows of the Jacobian a robot uses."""

import numpy as np

from ._core import Robot


def rows_in_use(robot: Robot) -> list[int]:
    """Return the rows in which the robot's tool can move at all.

    Parameters
    ----------
    robot : Robot
        Any robot.

    Returns
    -------
    list of int
        Rows 0 to 2 (angular) and 3 to 5 (linear); a planar robot in the x-y plane has 2, 3, 4, most have all six.
    """
    # A row that is zero at some random postures is zero at all of them: its entries are analytic in q.
    q = np.random.default_rng(0).uniform(-np.pi, np.pi, (8, robot.n))
    jacobian = np.abs(robot.jacobian(q))
    size = jacobian.max(axis=(0, 2))
    # Angular and linear rows have different units, so each kind is measured by its own largest entry.
    scale = np.repeat([size[:3].max(), size[3:].max()], 3)
    return [int(row) for row in np.flatnonzero(size > 1e-12 * scale)]
