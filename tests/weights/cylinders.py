"""What the tests of weights share: the robot with a tool at an angle, the welded cylinders, a performance."""

import math
from typing import Any

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy import weights as rw

F64 = NDArray[np.float64]
FANUC = rd.robots.get("fanuc_m710ic50")
TASK = rd.Task.axisymmetric()


def performance(limit: float = -0.5, singularity: float = 3.0, **more: Any) -> rw.Performance:
    return rw.Performance(limit, singularity, **more)


def arm(degrees: float) -> rd.Robot:
    """The FANUC with a tool of 250 mm at an angle to the axis of joint 6."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    tool = np.array([[c, 0.0, s, 0.25 * s], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, 0.25 * c], [0.0, 0.0, 0.0, 1.0]])
    return FANUC.with_tool(tool)


def cylinders(points: int = 60) -> rd.Toolpath:
    """Where cylinders of radius 250 and 400 mm meet, the tool directed to where their axes do (section 3.5.1)."""
    u = np.linspace(0.0, 2.0 * np.pi, points)
    around = 0.25 * np.stack([np.cos(u), np.sin(u)])
    p = np.stack([*around, np.sqrt(0.4**2 - around[1] ** 2)], axis=1)
    return rd.Toolpath(p + np.array([1.15, 0.2, -0.2]), -p, time=np.linspace(0.0, 133.0, points))


def postures(robot: rd.Robot, count: int = 20) -> F64:
    return np.random.default_rng(4).uniform(-1.0, 1.0, (count, robot.n))
