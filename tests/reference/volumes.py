"""Orientation volumes as formulas of their own, and control loops within them."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import redundancy as rd

from tests.reference.chain import F64

Measure = Callable[[F64], float]
"""How far a rotation (3, 3), relative to the path's frame, is outside [rad]; negative inside."""


def _spin(angle: float, spin: tuple[float, float] | None) -> float:
    if spin is None:
        return -np.inf
    low, high = spin
    off = np.remainder(angle - 0.5 * (low + high) + np.pi, 2.0 * np.pi) - np.pi
    return float(abs(off) - 0.5 * (high - low))


def _twist(r: F64) -> float:
    return float(np.arctan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]))


def _tilt(r: F64) -> float:
    return float(np.arctan2(np.hypot(r[0, 2], r[1, 2]), r[2, 2]))


def _angles(r: F64) -> tuple[float, float, float]:
    """Angles of Qx(a) Qy(b) Qz(c)."""
    a, b = np.arctan2(-r[1, 2], r[2, 2]), np.arctan2(r[0, 2], np.hypot(r[0, 0], r[0, 1]))
    return float(a), float(b), float(np.arctan2(-r[0, 1], r[0, 0]))


def drawn(kind: str, rng: np.random.Generator) -> tuple[rd.OrientationVolume, Measure]:
    """Draw a volume of a kind, its spin bounded in half of the cases, and its measure."""
    x, y = np.radians(rng.uniform(1.0, 30.0, 2))
    low = rng.uniform(-1.0, 0.5)
    spin = (low, low + rng.uniform(0.1, 1.5)) if rng.random() < 0.5 else None
    make = rd.OrientationVolume
    if kind == "cone":
        return make.cone(x, spin), lambda r: max(_tilt(r) - x, _spin(_twist(r), spin))
    if kind == "axis":
        return make.cone(0.0, spin), lambda r: max(_tilt(r), _spin(_twist(r), spin))
    if kind == "square":
        return make.square(x, y, spin), lambda r: max(
            abs(np.arcsin(r[0, 2])) - y, abs(np.arcsin(r[1, 2])) - x, _spin(_twist(r), spin)
        )
    if kind == "line_x":
        x, y = x, 0.0
    elif kind == "line_y":
        x, y = 0.0, y
    volume = {"pyramid": lambda: make.pyramid(x, y, spin), "line_x": lambda: make.line_x(x, spin)}.get(
        kind, lambda: make.line_y(y, spin)
    )()

    def measure(r: F64) -> float:
        a, b, c = _angles(r)
        return float(max(abs(a) - x, abs(b) - y, _spin(c, spin)))

    return volume, measure


KINDS = ("cone", "axis", "pyramid", "square", "line_x", "line_y")
WIDE = ("cone", "pyramid", "square")
"""Those with an open interior."""


def turned(rotation: F64, by: F64) -> F64:
    """Turn a rotation by a rotation vector in the base frame."""
    angle = float(np.linalg.norm(by))
    if angle == 0.0:
        return rotation
    x, y, z = by / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    out: F64 = (np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross) @ rotation
    return out


def pose(rotation: F64, position: F64) -> F64:
    """A pose (4, 4)."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation, position
    return out


@dataclass
class Loop:
    """What came of a loop: the farthest outside [rad], the farthest from the path [m], statuses, the last posture."""

    outside: float = -np.inf
    position: float = 0.0
    status: Counter[str] = field(default_factory=Counter)
    q: F64 = field(default_factory=lambda: np.zeros(0))
    tilt: float = 0.0


def rotation_of(quaternion: F64) -> F64:
    """The rotation (3, 3) of a unit quaternion [w, x, y, z]."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def frame_about(robot: rd.Robot, q: F64, volume: rd.OrientationVolume, seed: int) -> F64:
    """A path's frame about which the tool at a posture is a random member of a volume."""
    out: F64 = robot.fk(q)[:3, :3] @ rotation_of(volume.sample(1, seed)[0]).T
    return out


def loop(
    solver: Any,
    q: F64,
    frame: F64,
    measure: Measure,
    velocity: Callable[[int], F64],
    turning: Callable[[int], F64],
    ticks: int,
) -> Loop:
    """Run ticks along a path that moves with a velocity and turns with an angular velocity, from where the tool is."""
    robot, dt, out = solver.robot, solver.dt, Loop()
    position = robot.fk(q)[:3, 3]
    for k in range(ticks):
        now = pose(frame, position)
        frame, position = turned(frame, dt * turning(k)), position + dt * velocity(k)
        q = q + dt * solver.step_along(q, now, pose(frame, position))
        there = robot.fk(q)
        relative = frame.T @ there[:3, :3]
        out.status[solver.status] += 1
        out.outside = max(out.outside, measure(relative))
        out.position = max(out.position, float(np.linalg.norm(there[:3, 3] - position)))
        out.tilt = max(out.tilt, _tilt(relative))
    out.q = q
    return out
