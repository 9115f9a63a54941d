"""Closed-loop rate steps: the helix at 1 kHz against its pointwise minima, limits, every kind of singularity."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st

from tests.reference.files import read_json

HELIX: dict[str, Any] = read_json("leger_fanuc.json")["helix"]
LENGTH = float(HELIX["length_m"])
FANUC = rd.robots.get("fanuc_m710ic50_milling")
DT = 1e-3
WRIST = rd.robots.get("fanuc_m710ic50")


def sqp(robot: rd.Robot = FANUC, **settings: Any) -> rd.OrthogonalSQP:
    return rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(LENGTH, squared=True), **settings)


def test_closed_loop_along_the_helix() -> None:
    solver = sqp(gain=20.0, dt=DT)
    ticks = 10_000
    path = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.0, np.pi / 2, np.pi, (1.3, 1.0, 0.0), ticks + 1, duration=10.0)
    targets = path.targets()
    q = np.deg2rad(HELIX["first_point_q_deg"])
    out = np.empty(6)
    errors, lag, fastest = [], [], 0.0
    index = rd.ConditionNumber(LENGTH)
    minima = np.array(HELIX["pointwise_minimum_kappa"])
    for k in range(ticks):
        # Feedforward by the difference to the next target, feedback inside: both are the error to the next target.
        twist = solver.error(q, targets[k + 1]) / DT
        rates = solver.step(q, twist, out=out)
        assert rates is out
        fastest = max(fastest, float(np.max(np.abs(rates) / FANUC.qd_max)))
        q = q + DT * rates
        errors.append(np.abs(solver.error(q, targets[k + 1])).max())
        if (k + 1) % 100 == 0:
            lag.append(index.evaluate(FANUC, q, order=0) - minima[(k + 1) // 100])
    print(f"closed loop: worst error {max(errors):.1e}, kappa above its minimum by {max(lag):.1e}, speed {fastest:.2f}")
    assert max(errors) < 1e-6
    assert min(lag) > -1e-6
    assert max(lag) < 1e-2
    assert fastest <= 1.0
    assert solver.step_status == "regular"


def test_step_follows_the_task_exactly() -> None:
    rng = np.random.default_rng(2)
    solver = sqp(limits=False)
    for _ in range(50):
        q = rng.uniform(FANUC.q_min, FANUC.q_max)
        twist = rng.uniform(-0.1, 0.1, 6)
        rates = solver.step(q, twist)
        if solver.step_status != "regular":
            continue
        got = FANUC.jacobian(q) @ rates
        axis = FANUC.fk(q)[:3, 2]
        np.testing.assert_allclose(got[3:], twist[3:], atol=1e-9)
        np.testing.assert_allclose(np.cross(axis, got[:3]), np.cross(axis, twist[:3]), atol=1e-9)


def _stretched(robot: rd.Robot, q: list[float], joint: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Bring one joint to the zero of det J by bisection."""
    low, high = q.copy(), q.copy()
    grid = np.linspace(-2.0, 2.0, 401)

    def determinant(x: float) -> float:
        moved = q.copy()
        moved[joint] = x
        return float(np.linalg.det(robot.jacobian(moved)))

    values = [determinant(x) for x in grid]
    change = next(i for i in range(400) if values[i] * values[i + 1] < 0)
    a, b = float(grid[change]), float(grid[change + 1])
    for _ in range(80):
        middle = 0.5 * (a + b)
        if determinant(a) * determinant(middle) <= 0:
            b = middle
        else:
            a = middle
    low[joint] = high[joint] = a
    return np.array(low)


SINGULAR = {
    "wrist": np.array([0.3, 0.2, -0.4, 0.5, 0.0, 0.9]),
    "elbow": _stretched(WRIST, [0.3, 0.2, 0.0, 0.5, 0.9, 0.4], 2),
    "shoulder": _stretched(WRIST, [0.3, 0.0, -1.0, 0.5, 0.9, 0.4], 1),
}


@pytest.mark.parametrize("kind", SINGULAR)
@pytest.mark.parametrize("distance", [0.0, 1e-12, 1e-8, 1e-5, 1e-3, 1e-1])
def test_near_a_singularity(kind: str, distance: float) -> None:
    solver = sqp(WRIST)
    rng = np.random.default_rng(3)
    q = SINGULAR[kind] + distance * rng.uniform(-1, 1, 6)
    if distance < 1e-11:
        assert np.linalg.cond(WRIST.jacobian(q)) > 1e9
    for _ in range(20):
        rates = solver.step(q, rng.uniform(-1, 1, 6))
        assert np.isfinite(rates).all()
        assert (np.abs(rates) <= WRIST.qd_max * (1 + 1e-12)).all()


def test_statuses() -> None:
    solver = sqp(WRIST)
    assert not np.any(np.isnan(solver.step(SINGULAR["elbow"], [0.0, 0, 0, 1, 0, 0])))
    assert solver.step_status in ("damped", "task only", "limited")
    regular = np.array([0.3, 0.2, -0.4, 0.5, 1.0, 0.9])
    solver.step(regular, [0.0, 0, 0, 0.01, 0, 0])
    assert solver.step_status == "regular"
    rates = solver.step(regular, [0.0, 0, 0, 100.0, 0, 0])
    assert solver.step_status == "limited"
    # Cut to the speed limit, one joint is as fast as it may be.
    assert np.max(np.abs(rates) / WRIST.qd_max) == pytest.approx(1.0, rel=1e-9)


@given(
    st.integers(0, 2**32 - 1),
    st.lists(st.sampled_from([0.0, 1e-12, 1e-6, 1e-3, 0.5]), min_size=6, max_size=6),
    st.floats(0, 100),
    st.sampled_from(["fanuc_m710ic50", "ur5e", "abb_irb120"]),
)
def test_no_step_crosses_a_position_or_speed_limit(seed: int, rooms: list[float], speed: float, name: str) -> None:
    robot = rd.robots.get(name)
    rng = np.random.default_rng(seed)
    room = np.array(rooms)
    upper = rng.random(6) < 0.5
    q = np.where(upper, robot.q_max - room, robot.q_min + room)
    solver = sqp(robot, dt=0.01)
    rates = solver.step(q, speed * rng.uniform(-1, 1, 6))
    assert np.isfinite(rates).all()
    assert (np.abs(rates) <= robot.qd_max * (1 + 1e-12)).all()
    after = q + 0.01 * rates
    slack = 4e-16 * np.abs(q).max() + 1e-15
    assert (after <= np.maximum(robot.q_max, q) + slack).all()
    assert (after >= np.minimum(robot.q_min, q) - slack).all()


@given(st.integers(0, 2**32 - 1), st.floats(1e-9, 1.0))
def test_joint_beyond_a_limit_may_only_come_back(seed: int, beyond: float) -> None:
    rng = np.random.default_rng(seed)
    q = rng.uniform(FANUC.q_min, FANUC.q_max)
    joint = rng.integers(6)
    q[joint] = FANUC.q_max[joint] + beyond
    rates = sqp().step(q, rng.uniform(-1, 1, 6))
    assert rates[joint] <= 0.0


def test_objective_without_derivatives_leaves_the_task() -> None:
    solver = rd.OrthogonalSQP(FANUC, rd.Task.axisymmetric(), rd.CustomIndex(lambda q: float("nan")), limits=False)
    q = np.deg2rad(HELIX["first_point_q_deg"])
    twist = np.array([0.01, 0.02, 0.03, 0.04, 0.05, 0.06])
    rates = solver.step(q, twist)
    assert solver.step_status == "task only"
    np.testing.assert_allclose((FANUC.jacobian(q) @ rates)[3:], twist[3:], atol=1e-12)


def test_exception_of_a_callable_reaches_the_caller() -> None:
    def fail(q: object) -> float:
        raise LookupError("of the callable")

    solver = rd.OrthogonalSQP(FANUC, rd.Task.axisymmetric(), rd.CustomIndex(fail))
    q = np.deg2rad(HELIX["first_point_q_deg"])
    with pytest.raises(LookupError, match="of the callable"):
        solver.step(q, np.zeros(6))
    with pytest.raises(LookupError):
        solver.solve([1.05, 1.0, 0.0, 1.0, 0.0, 0.0], q)
