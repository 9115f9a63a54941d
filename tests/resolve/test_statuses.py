"""What statuses promise, by search: joints at and near their limits, twists from 1e-12 to 1."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64
from tests.resolve.rates import METHODS

ARMS = {name: rd.robots.get(name) for name in ("ur5e", "panda")}
TASKS = (rd.Task.full(), rd.Task.axisymmetric(), rd.Task.position(), rd.Task("free", ("plane", (0, 1, 1)), "base"))
TOLERANCE, DT = 1e-3, 2e-3


def cases(robot: rd.Robot, count: int) -> Any:
    """Postures with some joints at their limits, and twists of every size."""
    rng = np.random.default_rng(11)
    low, high = np.maximum(robot.q_min, -3.0), np.minimum(robot.q_max, 3.0)
    for _ in range(count):
        q = rng.uniform(low, high)
        room = 10.0 ** rng.uniform(-15.0, 0.0, robot.n)
        at = rng.random(robot.n)
        q = np.where(at < 0.15, robot.q_min + room * (at < 0.1), q)
        q = np.where(at > 0.85, robot.q_max - room * (at > 0.9), q)
        yield TASKS[rng.integers(len(TASKS))], q, 10.0 ** rng.uniform(-12.0, 0.0) * rng.uniform(-1.0, 1.0, 6)


def sizes(robot: rd.Robot, task: rd.Task, q: F64, twist: F64, rates: F64) -> tuple[float, float, float]:
    """Return the deviation, the twist and what rounds in them, as far as the task looks."""
    T, J = task.projector(robot, q), robot.jacobian(q)
    left, whole = T @ (twist - J @ rates), T @ twist
    return float(np.linalg.norm(left)), float(np.linalg.norm(whole)), float(np.linalg.norm(np.abs(J) @ np.abs(rates)))


def held(robot: rd.Robot, q: F64, rates: F64) -> bool:
    """Whether a joint is as fast as its limits of position, speed and acceleration let it be at all."""
    low, high = np.maximum(-robot.qd_max, (robot.q_min - q) / DT), np.minimum(robot.qd_max, (robot.q_max - q) / DT)
    slack = 1e-9 * np.abs(rates).max() + 1e-15 / DT
    return bool(((rates <= low + slack) | (rates >= high - slack)).any())


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("objective", [None, rd.JointLimits()])
def test_programme(arm: str, objective: rd.Objective | None) -> None:
    # No limits of acceleration, which let the room in front of a limit count too.
    robot = ARMS[arm].with_limits(ARMS[arm].q_min, ARMS[arm].q_max, ARMS[arm].qd_max, np.full(ARMS[arm].n, np.inf))
    seen: dict[str, int] = {}
    for task, q, twist in cases(robot, 400):
        program = rd.QuadraticProgram(robot, task, objective, weight=0.1, stiffness=1e6, dt=DT, tolerance=TOLERANCE)
        rates = program.step(q, twist)
        left, whole, size = sizes(robot, task, q, twist, rates)
        seen[program.status] = seen.get(program.status, 0) + 1
        if program.status == "solved":
            assert np.linalg.norm(program.deviation) <= TOLERANCE * whole
            assert left <= TOLERANCE * whole + 1e-14 * size
        else:
            assert left > TOLERANCE * whole - 1e-14 * size
        if program.status == "limited":
            assert held(robot, q, rates)
    assert {"solved", "relaxed", "limited"} <= set(seen), seen


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("method", ["OrthogonalSQP", *METHODS])
@pytest.mark.parametrize("objective", [None, rd.JointLimits()])
def test_other_methods(arm: str, method: str, objective: rd.Objective | None) -> None:
    robot, seen = ARMS[arm], dict[str, int]()
    for task, q, twist in cases(robot, 150):
        if method == "OrthogonalSQP":
            if objective is None or robot.n < task.dimension:
                continue
            solver: Any = rd.OrthogonalSQP(robot, task, objective, dt=DT)
        else:
            solver = METHODS[method](robot, task, objective, dt=DT)
        rates = solver.step(q, twist)
        left, whole, size = sizes(robot, solver.task, q, twist, rates)
        seen[solver.status] = seen.get(solver.status, 0) + 1
        np.testing.assert_allclose(np.linalg.norm(solver.deviation), left, rtol=1e-6, atol=1e-14 * (size + whole))
        if solver.status == "regular":
            # A secondary motion of about 1, of which a posture may leave nothing, rounds too.
            assert left <= 1e-9 * whole + 1e-12 * size + (0.0 if objective is None else 1e-14)
        if solver.status == "limited":
            assert held(robot, q, rates)
    assert objective is None or method == "ResolvedRate" or {"regular", "limited"} <= set(seen), seen
