"""The tasks of Dufour and Suleiman (2020) as paths of Baxter's left hand, with obstacles.

K. Dufour and W. Suleiman, On maximizing manipulability index while solving a kinematics task, Journal of Intelligent
and Robotic Systems, 2020; section 5. Equations and figures are cited where they are used.
Printed: the robot, Q = I, a tick of 10 ms, the ranges of the stiffness profile (fig. 1), a vertical line with cubic
interpolation (scenario 1), a taught path that comes near a singularity (scenario 2), a ball near the elbow
(scenario 3), five tasks, planned or taught (table 1). Postures, lengths, times, bounds of the deviation, obstacles and
distances are not printed; they are chosen here, so figures compare methods with each other and are no oracles.

Every path takes 5 s and lasts from rest to rest (cubic in time). The base frame is that of joint S0: x forward, z up.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import redundancy as rd
from numpy.typing import ArrayLike, NDArray

F64 = NDArray[np.float64]

TICK = 0.01
"""Length of a control tick [s], section 5."""

DURATION = 5.0
"""Of every path [s]."""

LOW, HIGH, RAMP = 1.0, 1e5, 0.2
"""Q_low and Q_high of fig. 1, from the ranges of section 3.2, and the share of the path on either side of Q_low."""

TUBE = (0.1, 0.05)
"""Largest deviation of any component, as an angle [rad] and a distance [m]: delta^+ T = -delta^- T of (3)."""

RADIUS = 0.06
"""Of the capsules along the arm [m]."""

BALL = 0.08
"""Radius of the obstacle [m]."""

INFLUENCE, SECURITY, DAMPING = 0.10, 0.03, 0.5
"""d_i and d_s [m], and xi [m/s], of (A.1)."""

MARGIN = 1e-6
"""What the programme keeps beyond d_s [m]: it looks at distances at ticks only, and to 1 nm."""


@dataclass(frozen=True, eq=False)
class Case:
    """A path of the hand, and where the arm starts.

    Attributes
    ----------
    name : str
        T1 to T5, as in table 1.
    about : str
        What the hand does.
    path : Toolpath
        A pose every tick, with times.
    start : ndarray, shape (7,)
        Posture on the first pose, within limits [rad].
    taught : ndarray, shape (N, 7), or None
        The joints that were recorded, where the path was taught [rad].
    """

    name: str
    about: str
    path: rd.Toolpath
    start: F64
    taught: F64 | None = None


@cache
def robot() -> rd.Robot:
    """Return Baxter's left arm, from joint S0 to the hand frame."""
    return rd.robots.get("baxter_left")


def vertical_line() -> Case:
    """Build scenario 1, T1: up by 400 mm, the hand pointing down; the arm ends nearly stretched."""
    return _moved("T1", "line, 400 mm up", [0.07, 0.01, -0.61, 0.57, 0.70, 1.10, 2.86], _way() * [0.0, 0.0, 0.4])


def near_singularity() -> Case:
    """Build scenario 2, T2: taught past a nearly stretched arm, where the index falls to a fortieth of its start's."""
    postures = [
        [-0.7, -0.5, 0.2, 1.5, 0.3, 0.7, 0.0],
        [0.0, -0.2, 0.3, 0.2, 0.3, 0.5, 0.2],
        [0.6, 0.1, -0.3, 1.4, -0.3, 0.6, 0.4],
    ]
    return _taught("T2", "taught, past a stretched arm", postures)


def turning_line() -> Case:
    """Build T3: 400 mm to the left, 100 mm up and 50 mm forward while the hand turns by 45 deg about the vertical."""
    start = [1.04, 0.91, -1.38, 2.15, 0.69, -1.07, 1.96]
    return _moved(
        "T3", "line, 415 mm, turning by 45 deg", start, _way() * [0.05, 0.4, 0.1], 0.25 * np.pi * _way()[:, 0]
    )


def swing() -> Case:
    """Build T4: taught from the right to the left by two postures."""
    return _taught(
        "T4", "taught, two postures", [[-0.6, 0.2, 0.3, 1.5, 0.3, 0.2, 0.0], [0.6, -0.8, -0.3, 1.3, -0.3, -0.4, 0.5]]
    )


def arch() -> Case:
    """Build T5: half an ellipse across the arm, 400 mm wide and 240 mm high, the hand pointing forward."""
    angle = np.pi * _way()[:, 0]
    offset = np.stack([0.0 * angle, 0.2 * (1.0 - np.cos(angle)), 0.24 * np.sin(angle)], axis=1)
    return _moved("T5", "arch, 400 by 240 mm", [-1.40, 0.18, 1.14, 1.90, -0.78, -0.68, -1.01], offset)


@cache
def cases() -> tuple[Case, ...]:
    """Return T1 to T5."""
    return vertical_line(), near_singularity(), turning_line(), swing(), arch()


def ball_scene(center: ArrayLike) -> rd.Scene:
    """Return capsules along the arm beside a ball (scenario 3)."""
    pose = np.eye(4)
    pose[:3, 3] = center
    return rd.Scene(robot(), rd.capsules_along_links(robot(), RADIUS), {"ball": (rd.Shape.sphere(BALL), pose)})


def elbow_ball() -> F64:
    """Return the centre of the ball of scenario 3 [m]: the elbow would run into it, whatever alpha."""
    return np.array([0.42, 0.12, 0.38])


def goal_ball() -> F64:
    """Return the centre of a ball in which the goal of scenario 1 lies, 61 mm from its centre [m]."""
    return np.array([0.80, -0.10, 0.24])


def _way() -> F64:
    """Return the share of the way at every tick, cubic in time, (N, 1)."""
    share = np.linspace(0.0, 1.0, round(DURATION / TICK) + 1)[:, None]
    way: F64 = share**2 * (3.0 - 2.0 * share)
    return way


def _path(frames: F64) -> rd.Toolpath:
    return rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], frames[:, :3, :3], TICK * np.arange(len(frames)))


def _moved(name: str, about: str, start: ArrayLike, offset: F64, turn: F64 | None = None) -> Case:
    """Return a path from the pose of a posture, by offsets [m] and turns about the vertical [rad]."""
    q = np.asarray(start, dtype=np.float64)
    frames = np.tile(robot().fk(q), (len(offset), 1, 1))
    frames[:, :3, 3] += offset
    if turn is not None:
        turns = np.tile(np.eye(3), (len(turn), 1, 1))
        turns[:, 0, 0] = turns[:, 1, 1] = np.cos(turn)
        turns[:, 1, 0] = np.sin(turn)
        turns[:, 0, 1] = -turns[:, 1, 0]
        frames[:, :3, :3] = turns @ frames[:, :3, :3]
    return Case(name, about, _path(frames), q)


def _taught(name: str, about: str, postures: ArrayLike) -> Case:
    """Return the path of the hand while joints follow the polynomial of least degree through postures."""
    known, way = np.asarray(postures, dtype=np.float64), _way()[:, 0]
    at = np.linspace(0.0, 1.0, len(known))
    q = sum(
        np.prod([(way - b) / (a - b) for b in at if b != a], axis=0)[:, None] * posture
        for a, posture in zip(at, known, strict=True)
    )
    joints = np.asarray(q, dtype=np.float64)
    return Case(name, about, _path(robot().fk(joints)), joints[0].copy(), joints)
