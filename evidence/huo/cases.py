"""The example tasks of Huo's thesis on twist decomposition, as robots with tools, toolpaths and start postures.

L. Huo, Robotic joint-motion optimization of functionally-redundant tasks for joint-limits and singularity avoidance,
PhD thesis, Ecole Polytechnique de Montreal, 2009; chapters 3 to 6. Equations and tables are cited where they are used.
Only the first task is printed in full. The docstring of each of the others says what is printed and what was chosen
here, so that joints leave their limits, and the singularity of the wrist comes near, much as the thesis tells. Figures
of the chosen tasks compare methods; they are no oracles.

Every tool has its axis of symmetry along z, and every path does two turns. The rotations of a path are what a robot
follows that does not use its redundancy; the start is the posture on the first of them, within limits, nearest to the
middle of the joints that the thesis names.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import redundancy as rd
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]

TURNS = 2
DOWN = np.array([0.0, 0.0, -1.0])

PUMA_MIDDLE = np.array([np.pi / 2, -np.pi / 3, np.pi, np.pi / 4, np.pi / 3, np.pi])
"""Middle of the joints of the PUMA [rad], (3.18); not the middle of the limits of its robot file."""

PART = np.array([1.15, 0.2, -0.2])
"""Origin of the welded part in the base frame of the M-710iC [m], (3.30); the axes are parallel."""

BRANCH, MAIN = 0.25, 0.4
"""Radii of the two welded cylinders [m], section 3.5.1."""

WRIST_RANGE = 0.78
"""What section 5.4.1 allows joint 4 of the M-710iC to either side [rad]."""


@dataclass(frozen=True, eq=False)
class Case:
    """A robot, what its tool has to do, and where it starts.

    Attributes
    ----------
    name : str
        Name of the function that builds it.
    robot : Robot
        With tool and limits.
    task : Task
        Axisymmetric about the z axis of the tool.
    path : Toolpath
        Two turns, with rotations and times; the axis is the z axis of the rotations.
    start : ndarray, shape (6,)
        Posture on the first position and rotation, within limits [rad].
    dt : float
        Time from each point to the next [s].
    """

    name: str
    robot: rd.Robot
    task: rd.Task
    path: rd.Toolpath
    start: F64
    dt: float


def puma_pipe() -> Case:
    """Build the pipe welded to a flange by a PUMA 500 (section 3.3); all of it is printed.

    Robot of Table 3.1, tool (3.14), path (3.15), a turn in 285 s. The corrected sign in the rotation of (3.15) makes it
    Rz(alpha) Rx(beta): x along the motion, and the electrode z inward and down at 45 deg. (3.16) takes the electrode
    from the six joints alone; the tool is part of it here. Chosen: 100 points a turn; the limits, which are not printed
    (those of the robot file).
    """
    turn = 2.0 * np.pi * _clock(100)
    radial, motion = _circle(turn)
    beta = -0.75 * np.pi
    return _case(
        "puma_pipe",
        rd.robots.get("puma500").with_tool(_tool([0.0, 0.1, 0.501], rx=np.pi / 6)),
        position=[0.0, 0.6, -0.59] + 0.1 * radial,
        rotation=_frames(np.sin(beta) * radial - np.cos(beta) * DOWN, motion),
        duration=285.0,
        middle=PUMA_MIDDLE,
    )


def m16ib_sphere_edge() -> Case:
    """Build the edges of a patch on a sphere, milled by a FANUC M-16iB (section 3.4).

    Printed: robot of Table 3.3, tool (3.26), a turn in 50 s, an axis normal to the sphere, a speed from zero at each
    corner over a sine along the edge and back to zero, and the middle (3.29) of the joints. Chosen, for Fig. 3.5 is not
    printed: a sphere of radius 300 mm around (1, 0, 0.6) m; four great circles between corners 0.6 rad off its upper
    pole, counter-clockwise from above; 100 points a turn; x level, in the sense of the motion about the pole. It stays
    within 45 deg of the motion; a frame along the motion itself would have to jump at each corner.
    """
    center, radius, colatitude = np.array([1.0, 0.0, 0.6]), 0.3, 0.6
    corners, _ = _circle(0.25 * np.pi + 2.0 * np.pi * _clock(4))
    corners = np.sin(colatitude) * corners - np.cos(colatitude) * DOWN
    edge, way = np.divmod(4.0 * (_clock(100) % 1.0), 1.0)
    start, end = corners[edge.astype(int)], corners[edge.astype(int) + 1]
    angle = np.arccos(corners[0] @ corners[1])
    # Angle along the edge: a sine from -pi/2 to pi/2.
    way = 0.5 * (1.0 - np.cos(np.pi * way))[:, None]
    normal = (np.sin((1.0 - way) * angle) * start + np.sin(way * angle) * end) / np.sin(angle)
    return _case(
        "m16ib_sphere_edge",
        _m16ib(),
        position=center + radius * normal,
        rotation=_frames(-normal, np.cross(-DOWN, normal)),
        duration=50.0,
    )


def m710_cylinders(tilt: float = 0.0) -> Case:
    """Build the intersection of two cylinders, welded by a FANUC M-710iC/50 (section 3.5: Tests I to IV, A to C).

    Printed: robot of Table 3.5, radii of 250 and 400 mm whose axes cross at right angles in the part's origin (3.30),
    an axis always towards this origin, the tilt of 0 (3.5) or 60 deg (6.3). The curve is 1618.1 mm long, not 1829 mm;
    with the instants 61 and 194 s of the same passage a turn takes 133 s, so that the speed is 730 mm/min, not 75.
    Chosen: the smaller cylinder along z, the larger along y; the start at the far side, clockwise from above; x along
    the motion; 133 points a turn; the tools. The parallel one, 300 mm beside axis 6 and 60 mm ahead of the flange,
    takes the wrist past its singularity half way round, as Test I has it. A tilted one is 200 mm to the other side of
    axis 6 and 100 mm ahead of the flange, and leans outward; it was tried at 60 deg.

    Parameters
    ----------
    tilt : float
        Angle of the tool's axis from axis 6 [rad].
    """
    tool = _tool([-0.2, 0.0, 0.1], ry=-tilt) if tilt else _tool([0.3, 0.0, 0.06])
    position, motion = _intersection(np.linspace(0.0, 2.0 * np.pi, 20001))
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    # Equal lengths from point to point; the curve is evaluated again so that each point is on both cylinders.
    angle = np.interp(_clock(133) % 1.0, way / way[-1], np.linspace(0.0, 2.0 * np.pi, len(way)))
    position, motion = _intersection(angle)
    return _case(
        "m710_cylinders",
        rd.robots.get("fanuc_m710ic50").with_tool(tool),
        position=PART + position,
        rotation=_frames(-position, motion),
        duration=133.0,
    )


def m710_rectangle() -> Case:
    """Build a rectangular path of a FANUC M-710iC/50 whose tool is perpendicular to axis 6 (section 5.4.1).

    Printed: joint 4 within 0.78 rad, which the initial weights exceed by going to 1.05. Chosen: a level rectangle of
    300 by 1000 mm, its long sides across the arm, its middle at (1.2, 0, 0.2) m, from the middle of the far side
    counter-clockwise from above; the axis straight down; the tip 300 mm below axis 6 and 200 mm ahead of the flange;
    one rotation all along, axis 6 forward; a turn in 60 s at constant speed, 104 points, corners among them.
    """
    robot = rd.robots.get("fanuc_m710ic50").with_tool(_tool([-0.3, 0.0, 0.2], ry=-np.pi / 2))
    q_min, q_max = robot.q_min.copy(), robot.q_max.copy()
    q_min[3], q_max[3] = -WRIST_RANGE, WRIST_RANGE
    x, y = 0.15, 0.5
    corners = np.array([[x, 0, 0], [x, y, 0], [-x, y, 0], [-x, -y, 0], [x, -y, 0], [x, 0, 0]])
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = way[-1] * (_clock(104) % 1.0)
    position = np.array([1.2, 0.0, 0.2]) + np.stack([np.interp(at, way, column) for column in corners.T], axis=1)
    forward = np.array([1.0, 0.0, 0.0])
    return _case(
        "m710_rectangle",
        robot.with_limits(q_min, q_max),
        position=position,
        rotation=_frames(np.broadcast_to(DOWN, position.shape), np.broadcast_to(forward, position.shape)),
        duration=60.0,
    )


def m16ib_oblique() -> Case:
    """Build a closed path of a FANUC M-16iB whose tool is oblique to axis 6 (section 5.4.3).

    Printed: only that the tool is neither parallel nor perpendicular to axis 6, and that the initial weights take
    joints 4 and 5 out of their limits (here joint 4). Chosen: the tool (3.26), 25 deg off axis 6; the bevelled rim of
    a disc, a level circle of radius 200 mm around (1.1, 0, 0.4) m, counter-clockwise from above, the axis inward and
    down, 20 deg off the vertical; x along the motion; a turn in 60 s at constant speed, 100 points.
    """
    radial, motion = _circle(2.0 * np.pi * _clock(100))
    bevel = np.pi / 9
    return _case(
        "m16ib_oblique",
        _m16ib(),
        position=[1.1, 0.0, 0.4] + 0.2 * radial,
        rotation=_frames(np.cos(bevel) * DOWN - np.sin(bevel) * radial, motion),
        duration=60.0,
    )


def _case(name: str, robot: rd.Robot, position: F64, rotation: F64, duration: float, middle: F64 | None = None) -> Case:
    dt = TURNS * duration / (len(position) - 1)
    path = rd.Toolpath(position, rotation[:, :, 2], rotation, dt * np.arange(len(position)))
    start = _nearest(robot, path, 0.5 * (robot.q_min + robot.q_max) if middle is None else middle)
    return Case(name, robot, rd.Task.axisymmetric(), path, start, dt)


def _nearest(robot: rd.Robot, path: rd.Toolpath, middle: F64) -> F64:
    """Return the posture within limits on the first position and rotation that is nearest to ``middle``."""

    def distance(q: F64) -> tuple[float, F64, F64]:
        away = q - middle
        return 0.5 * float(away @ away), away, np.eye(len(q))

    task = rd.Task.full()
    # The pose leaves no freedom: of the postures found from many starts the objective picks the nearest.
    q, _, status, _ = rd.OrthogonalSQP(robot, task, rd.CustomIndex(distance)).solve(path.targets(task)[0], starts=64)
    if status == "unreachable":
        raise ValueError(f"first point is out of reach of {robot.name}")
    return q


def _m16ib() -> rd.Robot:
    # Tool (3.26): its rotation is one by -beta about y.
    return rd.robots.get("fanuc_m16ib").with_tool(_tool([-0.0785, 0.0, 0.154], ry=0.4398))


def _tool(tip: ArrayLike, rx: float = 0.0, ry: float = 0.0) -> F64:
    """Return a tool transform: its tip in the flange's frame [m], and Ry(ry) Rx(rx)."""
    tool = np.eye(4)
    about_x = [[1.0, 0.0, 0.0], [0.0, np.cos(rx), -np.sin(rx)], [0.0, np.sin(rx), np.cos(rx)]]
    about_y = [[np.cos(ry), 0.0, np.sin(ry)], [0.0, 1.0, 0.0], [-np.sin(ry), 0.0, np.cos(ry)]]
    tool[:3, :3] = np.array(about_y) @ np.array(about_x)
    tool[:3, 3] = tip
    return tool


def _clock(points: int) -> F64:
    """Return the turns done at each point, 0 to 2, for a number of points a turn."""
    return np.arange(TURNS * points + 1) / points


def _circle(angle: F64) -> tuple[F64, F64]:
    """Return points of the level unit circle, and the directions in which the angle grows there."""
    zero = np.zeros_like(angle)
    radial = np.stack([np.cos(angle), np.sin(angle), zero], axis=1)
    return radial, np.stack([-np.sin(angle), np.cos(angle), zero], axis=1)


def _intersection(angle: F64) -> tuple[F64, F64]:
    """Return points on both cylinders in the part's frame [m], and their derivatives by the angle."""
    x, y = BRANCH * np.cos(angle), -BRANCH * np.sin(angle)
    z = np.sqrt(MAIN**2 - x**2)
    # x' = y and y' = -x, so that z' = -x x' / z.
    return np.stack([x, y, z], axis=1), np.stack([y, -x, -x * y / z], axis=1)


def _frames(axis: F64, heading: F64) -> F64:
    """Return rotations with z along ``axis`` and x as near to ``heading`` as that allows."""
    z = axis / np.linalg.norm(axis, axis=1, keepdims=True)
    x = heading - (heading * z).sum(axis=1, keepdims=True) * z
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2)


BUILDERS: tuple[Callable[[], Case], ...] = (
    puma_pipe,
    m16ib_sphere_edge,
    m710_cylinders,
    m710_rectangle,
    m16ib_oblique,
)
"""Every case in the order of the thesis."""
