"""The three parts of (4.10), against pseudo-inverses of numpy."""

import math
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray
from redundancy import weights as rw

F64 = NDArray[np.float64]
ARMS = {name: rd.robots.get(name) for name in ("fanuc_m710ic50", "kuka_iiwa14")}
TASKS = {"axis": rd.Task.axisymmetric([0.0, 0.6, 0.8]), "position": rd.Task.position(), "all": rd.Task.full()}
RNG = np.random.default_rng(3)


def parts(robot: rd.Robot, task: rd.Task, q: F64, twist: F64, w: F64, k: F64, held: F64) -> tuple[F64, F64, F64]:
    """(4.10) as printed, and for seven joints what J leaves of the pulls, which the thesis' arms do not have."""
    jacobian, projector = robot.jacobian(q), task.projector(robot, q)
    inverse = np.linalg.pinv(jacobian)
    free = inverse @ (np.eye(6) - projector) @ jacobian + np.eye(robot.n) - inverse @ jacobian
    s = np.linalg.svd(jacobian, compute_uv=False)
    w_ps = math.sqrt(s[0] / s[-1] / s.prod())
    return inverse @ projector @ twist, free @ (w * (robot.middle - q)), free @ (k * w_ps * (held - q))


def regular(robot: rd.Robot, number: int) -> F64:
    """Random postures where no pseudo-inverse is damped."""
    q = RNG.uniform(-2.0, 2.0, (10 * number, robot.n))
    found: F64 = q[np.linalg.cond(robot.jacobian(q)) < 100.0][:number]
    return found


@pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)
@pytest.mark.parametrize("robot", ARMS.values(), ids=ARMS)
def test_parts_are_those_of_the_formula(robot: rd.Robot, task: rd.Task) -> None:
    for q in regular(robot, 20):
        held = RNG.uniform(-2.0, 2.0, robot.n)
        twist, (w, k) = RNG.normal(size=6), RNG.uniform(0.0, 1.0, (2, robot.n))
        found = rw.displacements(robot, task, q, twist, w, k, held)
        for part, expected in zip(found, parts(robot, task, q, twist, w, k, held), strict=True):
            np.testing.assert_allclose(part, expected, rtol=1e-9, atol=1e-11 * (1.0 + np.abs(expected).max()))


def test_their_sum_is_the_step() -> None:
    robot, task, q = ARMS["fanuc_m710ic50"], TASKS["axis"], np.array([0.3, 0.4, -0.5, 0.6, 0.05, 0.2])
    solver = rd.TwistDecomposition(robot, task, rd.PosturePull(0.01 * np.ones(6), 0.02 * np.ones(6)), limits=False)
    solver.step(q, np.zeros(6))  # past the threshold: this posture is held
    moved, twist = q + 0.02, np.array([0.1, 0.0, -0.2, 0.05, 0.1, 0.0])
    found = rw.displacements(robot, task, moved, twist, 0.01, 0.02, held=q)
    assert np.linalg.norm(found.singularity) > 1e-3
    np.testing.assert_allclose(np.sum(found, axis=0), solver.step(moved, twist), rtol=0, atol=1e-14)


def test_only_the_first_part_moves_the_tool_where_it_matters() -> None:
    robot, task, q = ARMS["fanuc_m710ic50"], TASKS["axis"], np.array([0.3, 0.4, -0.5, 0.6, 0.9, 0.2])
    found = rw.displacements(robot, task, q, np.ones(6), 1.0, 1.0, held=np.zeros(6))
    motions = [task.projector(robot, q) @ robot.jacobian(q) @ part for part in found]
    np.testing.assert_allclose(motions[0], task.projector(robot, q) @ np.ones(6), rtol=0, atol=1e-12)
    np.testing.assert_allclose(motions[1:], 0.0, rtol=0, atol=1e-11)


def test_nothing_held_and_nothing_to_do() -> None:
    robot, task = ARMS["fanuc_m710ic50"], TASKS["axis"]
    for part in rw.displacements(robot, task, robot.middle + 0.1, np.zeros(6), 0.0, 1.0):
        np.testing.assert_array_equal(part, 0.0)
    # At a singularity the parts stay finite.
    for part in rw.displacements(robot, task, np.zeros(6), np.ones(6), 1.0, 1.0, held=np.ones(6)):
        assert np.isfinite(part).all()


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"q": np.zeros(5)}, rd.ShapeError, "q"),
        ({"twist": np.full(6, np.nan)}, rd.NonFiniteError, "twist"),
        ({"w": -0.1}, rd.InvalidValueError, r"w\[0\] is -0\.1"),
        ({"k": [0.0] * 5}, rd.ShapeError, "k"),
        ({"held": np.zeros(7)}, rd.ShapeError, "held"),
        ({"middle": np.full(6, np.inf)}, rd.NonFiniteError, "middle"),
    ],
)
def test_bad_input(given: dict[str, Any], error: type[Exception], message: str) -> None:
    arguments: dict[str, Any] = {"q": np.zeros(6), "twist": np.zeros(6), "w": 0.01} | given
    with pytest.raises(error, match=message):
        rw.displacements(ARMS["fanuc_m710ic50"], TASKS["axis"], **arguments)
