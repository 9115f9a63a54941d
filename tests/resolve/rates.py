"""What the tests of the methods at the level of rates share: methods, robots, a twist, a path."""

from typing import Any

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]
METHODS: dict[str, Any] = {
    method.__name__: method
    for method in (
        rd.TwistDecomposition,
        rd.ResolvedRate,
        rd.GradientProjection,
        rd.WeightedInverse,
        rd.TaskPriority,
        rd.Householder,
        rd.Elimination,
        rd.VirtualJoint,
    )
}
FANUC = rd.robots.get("fanuc_m710ic50_milling")
WRIST = rd.robots.get("fanuc_m710ic50")
TWIST = np.array([0.1, -0.2, 0.3, 0.05, 0.02, -0.04])
Q = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
AXIAL = rd.Task.axisymmetric()
NAN = np.nan


def circle(points: int = 60) -> rd.Toolpath:
    """A level circle within reach, the tool down, one orientation all along."""
    turn = np.linspace(0.0, 2.0 * np.pi, points)
    position = np.array([1.2, 0.0, 0.3]) + 0.2 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    down = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    return rd.Toolpath(
        position, np.tile(down[:, 2], (points, 1)), np.tile(down, (points, 1, 1)), np.linspace(0, 6, points)
    )


TORCH = WRIST.with_tool(np.array([[0.8, 0, 0.6, 0.1], [0, 1, 0, 0], [-0.6, 0, 0.8, 0.3], [0, 0, 0, 1.0]]))
