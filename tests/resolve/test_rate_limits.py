"""The methods at the level of rates at joint limits, speed limits and singular postures."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st

from tests.resolve.rates import AXIAL, FANUC, METHODS, NAN, TWIST, WRIST, Q


@pytest.mark.parametrize("name", METHODS)
def test_speed_limits_slow_all_joints_down_together(name: str) -> None:
    solver = METHODS[name](FANUC, AXIAL)
    free = METHODS[name](FANUC, AXIAL, limits=False)
    slow = solver.step(Q, TWIST)
    assert solver.step_status == "regular"
    np.testing.assert_array_equal(slow, free.step(Q, TWIST))
    fast = solver.step(Q, 100.0 * TWIST)
    assert solver.step_status == "limited"
    assert np.max(np.abs(fast) / FANUC.qd_max) == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(fast / np.linalg.norm(fast), slow / np.linalg.norm(slow), rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", METHODS)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-12, 1e-4, 0.5]), st.floats(0.0, 50.0))
def test_no_step_crosses_a_limit(name: str, seed: int, room: float, speed: float) -> None:
    rng = np.random.default_rng(seed)
    upper = rng.random(6) < 0.5
    q = np.where(upper, WRIST.q_max - room, WRIST.q_min + room)
    solver = METHODS[name](WRIST, AXIAL, rd.JointLimits(), dt=0.01)
    rates = solver.step(q, speed * rng.uniform(-1.0, 1.0, 6))
    assert np.isfinite(rates).all()
    assert (np.abs(rates) <= WRIST.qd_max * (1.0 + 1e-12)).all()
    slack = 4e-16 * np.abs(q).max() + 1e-15
    assert (q + 0.01 * rates <= WRIST.q_max + slack).all()
    assert (q + 0.01 * rates >= WRIST.q_min - slack).all()


def test_joint_at_its_limit_stops_and_one_beyond_comes_back() -> None:
    solver = rd.TwistDecomposition(FANUC, AXIAL, dt=0.01)
    free = rd.TwistDecomposition(FANUC, AXIAL, limits=False)
    for joint in range(6):
        q = Q.copy()
        high, low = FANUC.q_max[joint], FANUC.q_min[joint]
        for value, sign in ((high, 1.0), (high + 0.1, 1.0), (low - 0.1, -1.0)):
            q[joint] = value
            out = free.step(q, TWIST)
            twist = TWIST if out[joint] * sign > 0.0 else -TWIST
            outside = value != high
            back = -0.25 * sign * FANUC.qd_max[joint] if outside else 0.0
            assert solver.step(q, twist)[joint] == pytest.approx(back)
            assert solver.step_status == ("returning" if outside else "limited")
            assert solver.step(q, -twist)[joint] * sign < 0.0


SINGULAR = {
    "wrist": np.array([0.3, 0.2, -0.4, 0.5, 0.0, 0.9]),
    "zero": np.zeros(6),
}


@pytest.mark.parametrize("kind", SINGULAR)
@pytest.mark.parametrize("name", METHODS)
def test_singular_postures(name: str, kind: str) -> None:
    q = SINGULAR[kind]
    assert np.linalg.cond(WRIST.jacobian(q)) > 1e9
    rng = np.random.default_rng(5)
    for limits in (True, False):
        solver = METHODS[name](WRIST, rd.Task.full(), rd.SingularityParameter(), limits=limits)
        for _ in range(10):
            t = rng.uniform(-1.0, 1.0, 6)
            rates = solver.step(q, t)
            assert np.isfinite(rates).all()
            assert solver.step_status in (("damped", "limited") if limits else ("damped",))
            # A' (A A' + lambda)^-1 b is at most |b| / (2 sqrt(lambda)) long, and lambda is damping^2 |A|^2 here.
            bound = np.linalg.norm(t) / (2e-3 * np.linalg.norm(WRIST.jacobian(q)))
            assert np.linalg.norm(rates) <= bound * (1.0 + 1e-6)


@pytest.mark.parametrize("distance", [1e-14, 1e-10, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("name", METHODS)
def test_near_a_singularity_rates_stay_bounded(name: str, distance: float) -> None:
    solver = METHODS[name](WRIST, rd.Task.full(), limits=False)
    rng = np.random.default_rng(6)
    size = np.linalg.norm(WRIST.jacobian(SINGULAR["wrist"]))
    for _ in range(10):
        q = SINGULAR["wrist"] + distance * rng.uniform(-1.0, 1.0, 6)
        t = rng.uniform(-1.0, 1.0, 6)
        # Never longer than |b| / (damping |A|) times the few units by which shortest row and singular value differ.
        assert np.linalg.norm(solver.step(q, t)) <= 10.0 * np.linalg.norm(t) / (1e-3 * size)


def test_objective_without_value_leaves_the_task() -> None:
    for name, method in METHODS.items():
        solver = method(FANUC, AXIAL, rd.CustomIndex(lambda q: (NAN, np.full(6, NAN))), limits=False)
        rates = solver.step(Q, TWIST)
        np.testing.assert_allclose(rates, method(FANUC, AXIAL, limits=False).step(Q, TWIST), rtol=0, atol=1e-15)
        assert solver.step_status == ("regular" if name == "ResolvedRate" else "task only")
