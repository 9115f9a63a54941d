"""The largest manipulability of a robot: closed forms, derivatives by differences, random search."""

import numpy as np
import pytest
import redundancy as rd
from scipy.optimize import minimize

from tests.reference.chain import F64

PANDA = rd.robots.get("panda")


def test_planar_two_joints() -> None:
    # m = a1 a2 |sin q2| for the position of the tool.
    robot = rd.Robot.from_dh([0.7, 0.4], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0])
    found = rd.maximum_manipulability(robot, rows=[3, 4], starts=50)
    assert found.manipulability == pytest.approx(0.28, rel=1e-12)
    assert abs(np.sin(found.q[1])) == pytest.approx(1.0, abs=1e-9)
    assert found.slope < 1e-9
    assert not found.at_limit.any()
    # Where a limit ends short of a right angle, it is at the limit.
    narrow = robot.with_limits([-3.0, -0.6], [3.0, 0.5], [1.0, 1.0], [np.inf, np.inf])
    found = rd.maximum_manipulability(narrow, rows=[3, 4], starts=50)
    assert found.manipulability == pytest.approx(0.28 * np.sin(0.6), rel=1e-12)
    assert found.at_limit.tolist() == [False, True]
    assert rd.maximum_manipulability(narrow, rows=[3, 4], starts=50, limits=False).manipulability == pytest.approx(0.28)


@pytest.mark.parametrize("limits", [True, False])
def test_nothing_is_better(limits: bool) -> None:
    index, found = rd.Manipulability(0.5), rd.maximum_manipulability(PANDA, 0.5, limits=limits, starts=2000)
    assert found.manipulability == pytest.approx(index.evaluate(PANDA, found.q, order=0), rel=1e-12)
    if limits:
        assert ((PANDA.q_min <= found.q) & (found.q <= PANDA.q_max)).all()
    assert found.slope < 1e-8
    other = rd.maximum_manipulability(PANDA, 0.5, limits=limits, starts=2000, seed=7)
    assert other.manipulability == pytest.approx(found.manipulability, rel=1e-9)
    # An independent optimiser from random postures finds nothing larger.
    bounds = list(zip(PANDA.q_min, PANDA.q_max, strict=True)) if limits else None
    for q in PANDA.random_postures(8, 3):
        best = minimize(lambda q: -index.evaluate(PANDA, q, order=0), q, method="L-BFGS-B", bounds=bounds)
        assert -best.fun <= found.manipulability * (1.0 + 1e-9)


def test_bad_settings() -> None:
    with pytest.raises(rd.InvalidValueError, match="starts"):
        rd.maximum_manipulability(PANDA, starts=0)
    with pytest.raises(rd.InvalidValueError):
        rd.maximum_manipulability(PANDA, -1.0)


def test_a_limit_on_two_joints_holds() -> None:
    arm = rd.robots.get("ur5e")
    free = rd.maximum_manipulability(arm, starts=2000)
    terms, row = {1: 1.0, 2: 1.0}, np.array([0.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    end = float(row @ free.q)
    wide = np.full(6, np.pi)
    for sign in (1.0, -1.0):
        ends = (end + 0.4, end + 2.0) if sign > 0.0 else (end - 2.0, end - 0.4)
        robot = arm.with_limits(free.q - wide, free.q + wide, coupled=[(terms, *ends)])
        found = rd.maximum_manipulability(robot, starts=5000)
        assert robot.within_limits(found.q)
        assert found.manipulability <= free.manipulability * (1.0 + 1e-9)
        assert found.slope <= 1e-6
        bounds = list(zip(robot.q_min, robot.q_max, strict=True))
        inside = {"type": "ineq", "fun": lambda q, e=ends: np.array([e[1] - row @ q, row @ q - e[0]])}

        def fall(q: F64, robot: rd.Robot = robot) -> float:
            return -rd.Manipulability(1.0).evaluate(robot, q, 0)

        best = minimize(fall, found.q, method="SLSQP", bounds=bounds, constraints=[inside])
        assert found.manipulability >= -best.fun * (1.0 - 1e-6)
