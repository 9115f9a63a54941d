"""The example tasks of Huo's thesis on twist decomposition, as robots with tools, toolpaths and start postures.

L. Huo, Robotic joint-motion optimization of functionally-redundant tasks for joint-limits and singularity avoidance,
PhD thesis, Ecole Polytechnique de Montreal, 2009; chapters 3 to 6. Equations and tables are cited where they are used.
Only the first task is printed in full. The docstring of each of the others says what is printed and what was chosen
here, so that joints leave their limits, and the singularity of the wrist comes near, much as the thesis tells. Figures
of the chosen tasks compare methods; they are no oracles.

Every tool has its axis of symmetry along z, and every path does two turns. The rotations of a path are what a robot
follows that does not use its redundancy; the start is the posture on the first of them, within limits, nearest to the
middle of the joints that the thesis names, but for the weld, where it decides too much and its docstring tells it.
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
"""Origin of the welded part in the base frame of the M-710iC [m], (3.30)."""

BRANCH, MAIN = 0.25, 0.4
"""Radii of the two welded cylinders [m], section 3.5.1."""

CROSSING = np.deg2rad(52.83)
"""Angle between their axes [rad]: the one whose curve has the printed 1829 mm; with a right angle it has 1618 mm."""

LEAN, TOWARDS = np.deg2rad(31.8), np.deg2rad(157.5)
"""How far the branch leans from the vertical, and the heading in which it does [rad]: back towards the base.

Neither is printed: found, with the tool and the start, so that Tests I to IV come near the figures of Table 4.1.
"""

ALONG = 0.3633
"""Angle around the branch at which the weld begins, from its level side left of the robot [rad]; found likewise."""

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


def m16ib_sphere_edge(points: int = 100) -> Case:
    """Build the edges of a patch on a sphere, milled by a FANUC M-16iB (section 3.4).

    Printed: robot of Table 3.3, tool (3.26), a turn in 50 s, an axis normal to the sphere, a speed from zero at each
    corner over a sine along the edge and back to zero, and the middle (3.29) of the joints. Chosen, for Fig. 3.5 is not
    printed: a sphere of radius 300 mm around (1, 0, 0.6) m; four great circles between corners 0.6 rad off its upper
    pole, counter-clockwise from above; x level, in the sense of the motion about the pole. It stays within 45 deg of
    the motion; a frame along the motion itself would have to jump at each corner.

    Parameters
    ----------
    points : int
        Number of points a turn, a multiple of 4.
    """
    center, radius, colatitude = np.array([1.0, 0.0, 0.6]), 0.3, 0.6
    corners, _ = _circle(0.25 * np.pi + 2.0 * np.pi * _clock(4))
    corners = np.sin(colatitude) * corners - np.cos(colatitude) * DOWN
    edge, way = np.divmod(4.0 * (_clock(points) % 1.0), 1.0)
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


def m710_cylinders() -> Case:
    """Build the intersection of two cylinders, welded by a FANUC M-710iC/50 (section 3.5: Tests I to IV).

    Printed: robot of Table 3.5, radii of 250 and 400 mm whose axes cross in the part's origin (3.30), a curve of
    1829 mm, the tool's axis along axis 6 and always towards this origin, and 4.17 rad as the upper end of joint 6 in
    Tests II and III alike, where both must have started. With the instants 61 and 194 s of the same passage a turn
    takes 133 s, so that the speed is 825 mm/min, not 75. Chosen: how the part lies (`CROSSING`, `LEAN`, `ALONG`);
    counter-clockwise from above; 133 points a turn; the tip 154 mm beside axis 6 and 16 mm ahead of the flange; the
    other joints at the start.
    """
    tip = [0.1539, 0.0013, 0.0163]
    return _weld("m710_cylinders", _tool(tip), start=[0.56, 0.012, -0.629, 4.091, 1.165, 4.17])


def m710_tilted() -> Case:
    """Build the same weld with a tool whose axis is 60 deg from axis 6 (section 6.3: Tests A to C).

    Printed: only that angle. Chosen: the tip 7 mm beside axis 6 and 99 mm ahead of the flange, the heading in which the
    tool leans, and the start, so that joint 5 leaves its limits in Test A and is within them in Test B.
    """
    place, heading = 2.2699, -2.1131
    tip = [0.0067 * np.cos(place), 0.0067 * np.sin(place), 0.0987]
    tool = _tool(tip, ry=np.pi / 3, rz=heading)
    return _weld("m710_tilted", tool, start=[0.7219, 0.0028, -0.933, -0.9969, 1.1803, 2.2539])


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


def _weld(name: str, tool: F64, start: ArrayLike) -> Case:
    """Return the weld of the cylinders, two turns of 133 points, from the posture on its first point near `start`."""
    robot = rd.robots.get("fanuc_m710ic50").with_tool(tool)
    turn = ALONG + np.linspace(0.0, 2.0 * np.pi, 20001)
    position, _ = _intersection(turn)
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(position, axis=0), axis=1))])
    # Equal lengths from point to point; the curve is evaluated again so that each point is on both cylinders.
    position, motion = _intersection(np.interp(_clock(133) % 1.0, way / way[-1], turn))
    rotation = _frames(-position, motion)
    first = rd.Toolpath(PART + position[:1], rotation[:1, :, 2])
    found = rd.follow(rd.TwistDecomposition(robot, rd.Task.axisymmetric()), first, start, progress=False).q[0]
    # The tool keeps the spin against the motion that it has at the start.
    spun = rotation @ rotation[0].T @ robot.fk(found)[:3, :3]
    return _case(name, robot, PART + position, spun, duration=133.0, start=found)


def _case(
    name: str,
    robot: rd.Robot,
    position: F64,
    rotation: F64,
    duration: float,
    middle: F64 | None = None,
    start: F64 | None = None,
) -> Case:
    dt = TURNS * duration / (len(position) - 1)
    path = rd.Toolpath(position, rotation[:, :, 2], rotation, dt * np.arange(len(position)))
    if start is None:
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


def _tool(tip: ArrayLike, rx: float = 0.0, ry: float = 0.0, rz: float = 0.0) -> F64:
    """Return a tool transform: its tip in the flange's frame [m], and Rz(rz) Ry(ry) Rx(rx)."""
    tool = np.eye(4)
    about_x = [[1.0, 0.0, 0.0], [0.0, np.cos(rx), -np.sin(rx)], [0.0, np.sin(rx), np.cos(rx)]]
    about_y = [[np.cos(ry), 0.0, np.sin(ry)], [0.0, 1.0, 0.0], [-np.sin(ry), 0.0, np.cos(ry)]]
    about_z = [[np.cos(rz), -np.sin(rz), 0.0], [np.sin(rz), np.cos(rz), 0.0], [0.0, 0.0, 1.0]]
    tool[:3, :3] = np.array(about_z) @ np.array(about_y) @ np.array(about_x)
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


def part_axes() -> tuple[F64, F64]:
    """Return the directions of the axes of the branch and of the main cylinder, in the base frame."""
    heading, up = np.array([np.cos(TOWARDS), np.sin(TOWARDS), 0.0]), -DOWN
    branch = np.cos(LEAN) * up + np.sin(LEAN) * heading
    return branch, np.cos(LEAN + CROSSING) * up + np.sin(LEAN + CROSSING) * heading


def _intersection(angle: F64) -> tuple[F64, F64]:
    """Return points on both cylinders about the part's origin [m], and their derivatives by the angle.

    A point is c + z u, with c on the circle around the axis u of the branch, and is MAIN away from the other axis m:
    |c + z u|^2 - ((c + z u) . m)^2 = MAIN^2, a quadratic equation for z.
    """
    branch, main = part_axes()
    side = np.cross(main, branch)
    side /= np.linalg.norm(side)
    across = np.cross(branch, side)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    circle, turned = BRANCH * (cosine * side + sine * across), BRANCH * (cosine * across - sine * side)
    u_m, c_m, slope = branch @ main, circle @ main, turned @ main
    a, b, c = 1.0 - u_m**2, -c_m * u_m, BRANCH**2 - c_m**2 - MAIN**2
    root = np.sqrt(b**2 - a * c)
    # The derivative of the equation a z^2 + 2 b z + c = 0, with that of b and of c by way of c . m.
    z = (root - b) / a
    dz = slope * (u_m * z + c_m) / root
    return circle + z[:, None] * branch, turned + dz[:, None] * branch


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
    m710_tilted,
    m710_rectangle,
    m16ib_oblique,
)
"""Every case in the order of the thesis."""
