"""Goals out of reach, loops of every method that are sent there, and where an independent optimiser comes to rest."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import redundancy as rd
from scipy.optimize import least_squares

from tests.reference.chain import F64
from tests.resolve.rates import METHODS

ROBOTS = ("ur5e", "panda", "kuka_iiwa14", "baxter_left")
LOOPS = ("QuadraticProgram", "OrthogonalSQP", *METHODS)
STILL = 1e-3
"""Rates of a robot at rest [rad/s]."""
SAME_COST = 1e-4
SECONDS = 5.0
WITHIN_REACH = 1e-12


@dataclass(frozen=True)
class Goal:
    """A pose that a robot cannot reach, or only beyond its limits, and how a loop is sent there."""

    robot: rd.Robot
    task: rd.Task
    pose: F64
    dt: float
    stiffness: float
    gain: float
    """Part of the error that a tick asks for, over dt [1/s]."""


def within(robot: rd.Robot) -> tuple[F64, F64]:
    """Return the limits of position, three radians where there are none or wider ones."""
    return np.maximum(robot.q_min, -3.0), np.minimum(robot.q_max, 3.0)


def random_rotation(rng: np.random.Generator) -> F64:
    """Return a rotation matrix, all alike likely."""
    w, x, y, z = (lambda v: v / np.linalg.norm(v))(rng.standard_normal(4))
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def random_goal(rng: np.random.Generator, name: str, behind_limits: bool, slow: bool = False) -> Goal:
    """Return a goal beyond the arm's length or, with limits in the way, any pose; `slow` for a gain of 10 1/s."""
    robot = rd.robots.get(name)
    low, high = within(robot)
    pose = robot.fk(rng.uniform(-np.pi, np.pi, robot.n))
    if not behind_limits:
        reach = max(float(np.linalg.norm(robot.fk(rng.uniform(low, high))[:3, 3])) for _ in range(100))
        direction = rng.standard_normal(3)
        pose[:3, :3], pose[:3, 3] = (
            random_rotation(rng),
            direction * rng.uniform(1.05, 1.6) * reach / np.linalg.norm(direction),
        )
    dt = float(rng.choice([1e-3, 4e-3, 1e-2]))
    task = rd.Task.full() if rng.random() < 0.5 else rd.Task.axisymmetric()
    return Goal(robot, task, pose, dt, float(10.0 ** rng.uniform(4.0, 6.0)), 10.0 if slow else 1.0 / dt)


def loop(goal: Goal, method: str) -> Any:
    """Return a solver of a method for a goal."""
    if method == "QuadraticProgram":
        return rd.QuadraticProgram(goal.robot, goal.task, stiffness=goal.stiffness, dt=goal.dt)
    if method == "OrthogonalSQP":
        return rd.OrthogonalSQP(goal.robot, goal.task, rd.ConditionNumber(0.4, squared=True), length=1.0, dt=goal.dt)
    return METHODS[method](goal.robot, goal.task, dt=goal.dt)


def send(goal: Goal, method: str, q: F64) -> tuple[F64, float]:
    """Run a loop for five seconds; return where it is then, and the largest rate of the last twentieth of a second."""
    solver, fastest = loop(goal, method), 0.0
    count = round(SECONDS / goal.dt)
    for k in range(count):
        rates = solver.step(q, goal.gain * solver.error(q, goal.pose))
        q = q + goal.dt * rates
        if k * goal.dt > SECONDS - 0.05:
            fastest = max(fastest, float(np.abs(rates).max()))
    return q, fastest


def cost_left(goal: Goal, q: F64) -> float:
    """Return by how much an independent optimiser, from there, makes |e|^2 / 2 less within the limits.

    NaN where it makes it nothing: the goal was within reach after all.
    """
    judge = rd.OrthogonalSQP(goal.robot, goal.task, rd.JointLimits(), length=1.0)
    inside = np.clip(q, goal.robot.q_min + 1e-12, goal.robot.q_max - 1e-12)
    found = least_squares(
        lambda x: judge.error(x, goal.pose),
        inside,
        bounds=(goal.robot.q_min, goal.robot.q_max),
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-12,
        max_nfev=300,
    )
    return float(0.5 * np.sum(judge.error(q, goal.pose) ** 2) - found.cost) if found.cost > WITHIN_REACH else np.nan
