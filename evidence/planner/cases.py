"""Ten toolpaths for four robots, on which `evidence.planner.compare` sets `redundancy.plan` beside a grid search.

A path is a shape, about one unit in size, in a frame of its own with z up. It is scaled and put in front of a robot
with the numbers of `PLACES`. They were drawn at random; kept were those for which a coarse grid has a way and few spins
are feasible or, for `limit_line`, this way comes near a joint limit. Robots but the FANUC have a tool whose axis is
tilted from axis 6: else the spin would turn nothing but joint 6.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]

REACH: Final = {"fanuc_m710ic50_milling": 2.05, "abb_irb120": 0.58, "abb_irb2400": 1.55, "ur5e": 0.85}
"""Robots, and how far they reach without a tool [m]."""

TOOLS: Final = {
    "abb_irb120": (0.02, 0.06, 50.0),
    "abb_irb2400": (0.08, 0.16, 45.0),
    "ur5e": (0.03, 0.10, 60.0),
}
"""Tools: x and z of the tip in the flange [m], and the tilt of the tool's axis about y [deg]."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A path of about one unit in size.

    Attributes
    ----------
    position, axis : ndarray, shape (N, 3)
        Points, and directions of the tool's axis.
    closed : bool
        Whether the last point is the first, and the posture there has to be the same.
    """

    position: F64
    axis: F64
    closed: bool = False


@dataclass(frozen=True, eq=False)
class Case:
    """A path of a robot.

    Attributes
    ----------
    name : str
        Name of the shape.
    robot : Robot
        With its tool.
    path : Toolpath
        In the base frame.
    closed : bool
        As for `redundancy.plan`.
    length : float
        Characteristic length: a third of the reach [m].
    """

    name: str
    robot: rd.Robot
    path: rd.Toolpath
    closed: bool
    length: float


def circle_tilted(points: int = 121) -> Shape:
    """Return a closed circle in a plane tilted by 25 deg, the tool's axis along the plane's normal."""
    turn = _turn(points)
    plane = _about_y(np.deg2rad(25.0))
    position = 0.5 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1) @ plane.T
    return Shape(_ring(position), np.tile(-plane[:, 2], (points, 1)), closed=True)


def cylinder_outside(points: int = 200) -> Shape:
    """Return a helix on the outside of a lying cylinder, the tool's axis towards the cylinder's."""
    angle = np.linspace(np.deg2rad(35.0), np.deg2rad(145.0), points)
    outward = np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], axis=1)
    return Shape(0.4 * outward + np.linspace(-0.3, 0.3, points)[:, None] * [0.0, 1.0, 0.0], -outward)


def cylinder_inside(points: int = 150) -> Shape:
    """Return a helix in a bore that leans back by 30 deg, the tool's axis outward and down by 45 deg."""
    angle = np.linspace(np.deg2rad(-60.0), np.deg2rad(60.0), points)
    lean = _about_y(np.deg2rad(30.0))
    outward = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    position = 0.4 * outward + np.linspace(-0.1, 0.1, points)[:, None] * [0.0, 0.0, 1.0]
    return Shape(position @ lean.T, (outward - [0.0, 0.0, 1.0]) @ lean.T)


def sphere_spiral(points: int = 400) -> Shape:
    """Return a spiral of three turns from near the pole of a sphere down to 40 deg, the tool's axis normal to it."""
    share = np.linspace(0.0, 1.0, points)
    off, turn = np.deg2rad(4.0 + 36.0 * share), 6.0 * np.pi * share
    normal = np.stack([np.sin(off) * np.cos(turn), np.sin(off) * np.sin(turn), np.cos(off)], axis=1)
    return Shape(0.6 * normal - [0.0, 0.0, 0.5], -normal)


def figure_eight(points: int = 241) -> Shape:
    """Return a closed figure eight (a lemniscate of Gerono), the tool vertical."""
    turn = _turn(points)
    position = np.stack([0.25 * np.sin(2.0 * turn), 0.5 * np.sin(turn), 0.0 * turn], axis=1)
    return Shape(_ring(position), np.tile([0.0, 0.0, -1.0], (points, 1)), closed=True)


def raster(points: int = 300) -> Shape:
    """Return six parallel lines, joined by short ones at right angles, the tool leading by 15 deg."""
    corners = [[x, y, 0.0] for i, x in enumerate(np.linspace(-0.3, 0.3, 6)) for y in ((-0.4, 0.4), (0.4, -0.4))[i % 2]]
    return Shape(_polyline(np.array(corners), points), np.tile(_leaning(15.0), (points, 1)))


def star(points: int = 151) -> Shape:
    """Return a closed star with five points and ten corners, the tool tilted by 30 deg, to and fro along the way."""
    angle = 0.2 * np.pi * np.arange(11)
    radius = np.where(np.arange(11) % 2 == 0, 0.5, 0.22)
    corners = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.0 * angle], axis=1)
    turn = _turn(points)
    axis = np.stack([np.sin(0.5) * np.cos(turn), np.sin(0.5) * np.sin(turn), np.full(points, -np.cos(0.5))], axis=1)
    return Shape(_ring(_polyline(_ring(corners), points)), _ring(axis), closed=True)


def limit_line(points: int = 50) -> Shape:
    """Return a straight line across, along which the axis rolls from -40 to 40 deg: it comes near a joint limit."""
    roll = np.deg2rad(np.linspace(-40.0, 40.0, points))
    axis = np.stack([0.2 + 0.0 * roll, np.sin(roll), -np.cos(roll)], axis=1)
    return Shape(np.linspace([0.0, -0.6, 0.1], [0.1, 0.6, -0.1], points), axis)


def contour(points: int = 2000) -> Shape:
    """Return a long closed contour with seven lobes on a wavy surface, the tool normal to the surface."""
    turn = _turn(points)
    radius = 0.42 + 0.08 * np.cos(7.0 * turn)
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    z = 0.05 * np.sin(5.0 * x) * np.cos(4.0 * y)
    slope_x = 0.25 * np.cos(5.0 * x) * np.cos(4.0 * y)
    slope_y = -0.2 * np.sin(5.0 * x) * np.sin(4.0 * y)
    return Shape(
        _ring(np.stack([x, y, z], axis=1)), _ring(np.stack([slope_x, slope_y, 0.0 * x - 1.0], axis=1)), closed=True
    )


def dash(points: int = 101) -> Shape:
    """Return an S in a leaning plane whose axis swings by 35 deg, to be driven as fast as the joints can."""
    share = np.linspace(-1.0, 1.0, points)
    swing = np.deg2rad(35.0) * np.sin(np.pi * share)
    position = np.stack([0.15 * np.sin(np.pi * share), 0.5 * share, 0.1 * share], axis=1)
    return Shape(position, np.stack([np.sin(swing), 0.3 * np.cos(swing), -np.cos(swing)], axis=1))


SHAPES: Final[tuple[Callable[..., Shape], ...]] = (
    circle_tilted,
    cylinder_outside,
    cylinder_inside,
    sphere_spiral,
    figure_eight,
    raster,
    star,
    limit_line,
    contour,
    dash,
)

PLACES: Final[dict[str, dict[str, tuple[float, ...]]]] = {
    "fanuc_m710ic50_milling": {
        "circle_tilted": (1.848, 0.495, 0.862, 0.72, -72.0, 15.0),
        "cylinder_outside": (1.846, 0.038, 0.639, 1.197, -147.0, 2.0),
        "cylinder_inside": (1.091, 1.133, 0.524, 0.86, -32.0, -10.0),
        "sphere_spiral": (1.91, 0.085, 0.808, 1.048, -26.0, 15.0),
        "figure_eight": (1.172, -0.429, -0.077, 0.559, -103.0, 17.0),
        "raster": (0.872, 1.14, 0.921, 1.12, 40.0, -12.0),
        "star": (1.142, -0.644, 0.417, 1.023, 178.0, 12.0),
        "limit_line": (0.855, -0.332, 0.929, 0.863, 172.0, 4.0),
        "contour": (1.07, -1.552, 0.357, 1.018, -64.0, 10.0),
        "dash": (0.97, -0.709, -0.116, 0.832, 161.0, 3.0),
    },
    "abb_irb120": {
        "circle_tilted": (0.218, -0.284, 0.239, 0.358, 83.0, -15.0),
        "cylinder_outside": (0.328, 0.385, 0.291, 0.282, 150.0, -18.0),
        "cylinder_inside": (0.215, 0.034, 0.256, 0.396, 127.0, -18.0),
        "sphere_spiral": (0.162, -0.139, 0.186, 0.201, 23.0, 18.0),
        "figure_eight": (0.312, 0.052, -0.08, 0.344, -133.0, -15.0),
        "raster": (0.261, 0.079, 0.236, 0.343, 80.0, -2.0),
        "star": (0.336, 0.166, -0.09, 0.405, 140.0, 17.0),
        "limit_line": (0.19, -0.191, 0.283, 0.271, -114.0, 7.0),
        "contour": (0.228, 0.136, 0.311, 0.301, -61.0, 17.0),
        "dash": (0.49, 0.053, -0.086, 0.335, -174.0, 18.0),
    },
    "abb_irb2400": {
        "circle_tilted": (1.165, -0.084, 0.705, 0.86, 51.0, -4.0),
        "cylinder_outside": (1.253, -0.139, -0.267, 0.659, 130.0, 3.0),
        "cylinder_inside": (0.742, -0.009, 0.211, 0.965, 118.0, -1.0),
        "sphere_spiral": (0.894, -0.496, 0.341, 0.828, -107.0, 18.0),
        "figure_eight": (0.761, 0.933, 0.46, 0.923, 90.0, -6.0),
        "raster": (0.559, -0.436, 0.278, 0.398, -15.0, -13.0),
        "star": (0.997, -0.357, -0.287, 0.893, 70.0, -3.0),
        "limit_line": (0.7, 0.64, -0.306, 0.936, -92.0, -14.0),
        "contour": (0.95, -0.1, 0.6, 0.8, -30.0, -8.0),
        "dash": (1.292, 0.706, 0.029, 0.787, 2.0, -17.0),
    },
    "ur5e": {
        "circle_tilted": (0.51, -0.549, 0.458, 0.251, -90.0, -13.0),
        "cylinder_outside": (0.66, -0.061, 0.175, 0.276, -130.0, -9.0),
        "cylinder_inside": (0.284, -0.14, 0.055, 0.501, -88.0, -4.0),
        "sphere_spiral": (0.407, 0.488, -0.124, 0.43, -15.0, 3.0),
        "figure_eight": (0.591, 0.32, 0.508, 0.272, 113.0, -4.0),
        "raster": (0.282, -0.217, 0.304, 0.502, -73.0, 5.0),
        "star": (0.189, 0.26, 0.184, 0.442, 73.0, -7.0),
        "limit_line": (0.274, 0.128, -0.003, 0.58, 143.0, 5.0),
        "contour": (0.543, -0.298, 0.478, 0.525, 51.0, 1.0),
        "dash": (0.405, -0.049, 0.314, 0.405, 133.0, 16.0),
    },
}
"""Where a path is: x, y, z [m], size [m], turn about z and before that about y [deg]."""

DURATIONS: Final[dict[str, dict[str, float]]] = {
    "fanuc_m710ic50_milling": {
        "figure_eight": 0.889,
        "contour": 2.63,
        "dash": 0.85,
    },
    "abb_irb120": {
        "figure_eight": 3.17,
        "contour": 2.41,
        "dash": 0.6,
    },
    "abb_irb2400": {
        "figure_eight": 3.11,
        "contour": 4.18,
        "dash": 0.588,
    },
    "ur5e": {
        "figure_eight": 0.939,
        "contour": 3.8,
        "dash": 0.796,
    },
}
"""How long paths with times take [s], from plans of the same paths without times.

The eight takes 1.03 times what the slower of the plans for the two criteria needs, the contour 1.2 times what the
faster needs, and the S hardly longer than the least share of that, in steps of 0.05, for which a grid of 0.5 degrees
has a way: its speed limits bind.
"""


def robot_named(name: str) -> rd.Robot:
    """Return a robot with its tool."""
    robot = rd.robots.get(name)
    if name not in TOOLS:
        return robot
    x, z, tilt = TOOLS[name]
    tool = np.eye(4)
    tool[:3, :3] = _about_y(np.deg2rad(tilt))
    tool[:3, 3] = x, 0.0, z
    return robot.with_tool(tool)


def placed(shape: Shape, place: tuple[float, ...], duration: float | None = None) -> rd.Toolpath:
    """Return a shape at a place, with times if it has a duration [s]."""
    x, y, z, size, yaw, pitch = place
    cosine, sine = np.cos(np.deg2rad(yaw)), np.sin(np.deg2rad(yaw))
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ _about_y(np.deg2rad(pitch))
    time = None if duration is None else np.linspace(0.0, duration, len(shape.position))
    return rd.Toolpath([x, y, z] + size * shape.position @ turn.T, shape.axis @ turn.T, time=time)


def case(name: str, robot: str) -> Case:
    """Return the path of a name for the robot of a name."""
    shape = next(build for build in SHAPES if build.__name__ == name)()
    path = placed(shape, PLACES[robot][name], DURATIONS[robot].get(name))
    return Case(name, robot_named(robot), path, shape.closed, REACH[robot] / 3.0)


def cases() -> list[Case]:
    """Return every path for every robot."""
    return [case(build.__name__, robot) for robot in REACH for build in SHAPES]


def _turn(points: int) -> F64:
    return np.linspace(0.0, 2.0 * np.pi, points)


def _ring(rows: F64) -> F64:
    """Make the last row the first to the last digit."""
    rows = rows.copy()
    rows[-1] = rows[0]
    return rows


def _about_y(angle: float) -> F64:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def _leaning(degrees: float) -> F64:
    """Return a downward axis that leans towards x."""
    return _about_y(-np.deg2rad(degrees)) @ [0.0, 0.0, -1.0]


def _polyline(corners: F64, points: int) -> F64:
    """Return points along straight lines, a corner at each joint, about equidistant."""
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    at = np.round(ends / ends[-1] * (points - 1))
    return np.stack([np.interp(np.arange(points), at, column) for column in corners.T], axis=1)
