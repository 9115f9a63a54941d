"""The 16 twist projectors in three frames, and what a minimum on their targets is, by differences."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import redundancy as rd
from scipy.optimize import nnls

from tests.reference.chain import F64

ROBOTS = ("fanuc_m710ic50_milling", "ur5e", "panda", "kuka_iiwa14")
ANGULAR: dict[str, Any] = {
    "free": "free",
    "full": "full",
    "line": ("line", (0.2, -0.3, 0.9)),
    "plane": ("plane", (0.1, 0.4, 0.8)),
}
LINEAR: dict[str, Any] = {
    "free": "free",
    "full": "full",
    "line": ("line", (-0.5, 0.3, 0.8)),
    "plane": ("plane", (0.3, -0.2, 0.9)),
}
PART = np.array([[0.8, -0.6, 0.0, 0.5], [0.6, 0.8, 0.0, 0.2], [0.0, 0.0, 1.0, 0.3], [0.0, 0.0, 0.0, 1.0]])
FRAMES: dict[str, Any] = {"tool": "tool", "base": "base", "part": PART}
STEP = 1e-3
AT_LIMIT = 1e-9
NEAR_HALF_TURN = np.deg2rad(179.5)
"""Angles between tool and target beyond which the rotation vector between them is about to jump."""


def tasks() -> Iterator[tuple[str, rd.Task]]:
    """Every pair of projectors in every frame, with its name."""
    for (angular, linear), frame in product(product(ANGULAR, LINEAR), FRAMES):
        yield f"{angular} {linear} {frame}", rd.Task(ANGULAR[angular], LINEAR[linear], FRAMES[frame])


def differences(solver: rd.OrthogonalSQP, q: F64, target: F64) -> F64:
    """Return minus the derivative of the task's error, (6, n), by differences of sixth order."""
    columns = []
    for unit in STEP * np.eye(len(q)):
        ahead = [solver.error(q + k * unit, target) - solver.error(q - k * unit, target) for k in (1, 2, 3)]
        columns.append(-(45.0 * ahead[0] - 9.0 * ahead[1] + ahead[2]) / (60.0 * STEP))
    return np.array(columns).T


def slope(solver: rd.OrthogonalSQP, q: F64, target: F64) -> tuple[float, float, bool]:
    """Return what task and limits do not hold of the objective's gradient, its size, and whether limits hold some."""
    robot = solver.robot
    gradient = solver.objective.evaluate(robot, q, order=1)[1]
    free = np.linalg.svd(differences(solver, q, target))[2][solver.task.dimension :]
    sides = np.hstack([free[:, q - robot.q_min < AT_LIMIT], -free[:, robot.q_max - q < AT_LIMIT]])
    left = float(nnls(sides, free @ gradient)[1]) if sides.size else float(np.linalg.norm(free @ gradient))
    return left, float(np.linalg.norm(gradient)), bool(sides.size)


def jumps(robot: rd.Robot, q: F64, target: F64) -> bool:
    """Whether the rotation from the tool to its target is nearly half a turn, where differences mean nothing."""
    between = robot.fk(q)[:3, :3].T @ target[:3, :3]
    angle = float(np.arccos(np.clip(0.5 * (np.trace(between) - 1.0), -1.0, 1.0)))
    return bool(angle > NEAR_HALF_TURN)
