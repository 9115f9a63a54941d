"""A start beyond a limit of position comes back, by every method: at a bounded rate, with a status that says so."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference.chain import F64
from tests.resolve.rates import METHODS

ARMS = {name: rd.robots.get(name) for name in ("ur5e", "kuka_iiwa14")}
ARMS = {
    name: arm.with_limits(arm.q_min, arm.q_max, arm.qd_max, np.full(arm.n, np.inf)) for name, arm in ARMS.items()
} | {"panda": rd.robots.get("panda")}
"""Six joints, seven, and seven with limits of acceleration."""
TASK = rd.Task.axisymmetric()
SHARE, ROUNDING = 0.25, 1e-9


def solver(method: str, robot: rd.Robot, dt: float) -> Any:
    if method == "QuadraticProgram":
        return rd.QuadraticProgram(robot, TASK, dt=dt)
    if method == "OrthogonalSQP":
        return rd.OrthogonalSQP(robot, TASK, rd.JointLimits(), dt=dt, gain=1.0)
    return METHODS[method](robot, TASK, dt=dt)


ALL = ["QuadraticProgram", "OrthogonalSQP", *METHODS]


def inside(robot: rd.Robot) -> F64:
    """A posture well inside, away from singular ones."""
    low, high = np.maximum(robot.q_min, -2.0), np.minimum(robot.q_max, 2.0)
    shares: F64 = low + np.resize([0.45, 0.62, 0.35, 0.58, 0.4, 0.66, 0.52], robot.n) * (high - low)
    return shares


def come_back(one: Any, robot: rd.Robot, q: F64, joint: int, twist: F64) -> int:
    """Run until the joint is inside and ten ticks more; check every tick; return the ticks that it took."""
    upper = q[joint] > robot.q_max[joint]

    def beyond(q: F64) -> float:
        return float(q[joint] - robot.q_max[joint] if upper else robot.q_min[joint] - q[joint])

    one.reset()
    before, took, rest = np.zeros(robot.n), 0, 10
    accelerates = isinstance(one, rd.QuadraticProgram) and np.isfinite(robot.qdd_max).all()
    # A quarter of the speed, and the time to get there.
    most = 2.0 + 1.5 * beyond(q) / (SHARE * robot.qd_max[joint]) / one.dt
    most += SHARE * robot.qd_max[joint] / robot.qdd_max[joint] / one.dt if accelerates else 0.0
    while rest:
        outside = beyond(q)
        # At rest before the first tick: the acceleration is limited from there.
        rates = one.step(q, twist, rates=before) if isinstance(one, rd.QuadraticProgram) else one.step(q, twist)
        assert (np.abs(rates) <= robot.qd_max * (1.0 + 1e-12)).all()
        if accelerates:
            assert (np.abs(rates - before) <= robot.qdd_max * one.dt * (1.0 + 1e-9)).all()
        q, before = q + one.dt * rates, rates
        if outside > ROUNDING:
            assert one.status == "returning"
            assert beyond(q) < outside
            took += 1
            assert took <= most
        else:
            rest -= 1
            assert beyond(q) <= ROUNDING
            assert one.status != "returning"
    return took


@pytest.mark.parametrize("method", ALL)
@pytest.mark.parametrize("arm", ARMS)
def test_every_joint_comes_back(arm: str, method: str) -> None:
    robot = ARMS[arm]
    for dt in (1e-3, 1e-2):
        one = solver(method, robot, dt)
        for joint in range(robot.n):
            for offset in (1e-3, 0.03, 0.5):
                for limit, side in ((robot.q_max[joint], 1.0), (robot.q_min[joint], -1.0)):
                    if dt == 1e-3 and offset == 0.5 and joint % 3:
                        continue
                    q = inside(robot)
                    q[joint] = limit + side * offset
                    assert come_back(one, robot, q, joint, np.zeros(6)) > 0


@settings(deadline=None, max_examples=60)
@given(
    method=st.sampled_from(ALL),
    arm=st.sampled_from(sorted(ARMS)),
    joint=st.integers(0, 6),
    offset=st.floats(1e-3, 0.5),
    upper=st.booleans(),
    dt=st.sampled_from([2e-3, 1e-2]),
    seed=st.integers(0, 2**32 - 1),
)
def test_with_a_twist_too(method: str, arm: str, joint: int, offset: float, upper: bool, dt: float, seed: int) -> None:
    robot = ARMS[arm]
    joint, q = joint % robot.n, inside(robot)
    q[joint] = robot.q_max[joint] + offset if upper else robot.q_min[joint] - offset
    twist = 0.02 * np.random.default_rng(seed).uniform(-1.0, 1.0, 6)
    assert come_back(solver(method, robot, dt), robot, q, joint, twist) > 0


@pytest.mark.parametrize("method", ALL)
def test_joints_without_limits_of_speed_and_without_limits_at_all(method: str) -> None:
    infinite = np.full(6, np.inf)
    one = ARMS["ur5e"].with_limits(np.r_[-infinite[:5], -1.0], np.r_[infinite[:5], 1.0], infinite, infinite)
    q = np.array([9.0, -1.2, 1.4, -0.8, 1.1, 1.2])
    loop = solver(method, one, 1e-2)
    rates = loop.step(q, np.zeros(6))
    # Half a radian a second where nothing limits it.
    assert rates[5] <= -0.5 + 1e-9
    assert loop.status == "returning"
    q[5] = 0.0
    loop.reset()
    assert np.isfinite(loop.step(q, np.zeros(6))).all()
    assert loop.status != "returning"


def test_contradicting_rows_are_told_first() -> None:
    robot = ARMS["ur5e"]
    q = inside(robot)
    q[5] = robot.q_max[5] + 0.1
    program = rd.QuadraticProgram(robot, TASK)
    row = np.eye(6)[5:]
    program.step(q, np.zeros(6), rows=row, lower=[0.1])
    assert program.status == "infeasible"
    assert program.step(q, np.zeros(6))[5] <= -SHARE * robot.qd_max[5] * (1.0 - 1e-12)


def test_without_limits_nothing_comes_back() -> None:
    robot = ARMS["ur5e"]
    q = inside(robot)
    q[5] = robot.q_max[5] + 0.1
    for program in (
        rd.QuadraticProgram(robot, TASK, limits=False),
        rd.TwistDecomposition(robot, TASK, limits=False),
        rd.OrthogonalSQP(robot, TASK, rd.JointLimits(), limits=False, gain=0.0),
    ):
        np.testing.assert_allclose(program.step(q, np.zeros(6)), 0.0, atol=1e-12)
        assert program.status in ("solved", "regular")
