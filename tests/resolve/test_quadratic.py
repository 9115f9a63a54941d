"""Resolution as a quadratic programme: the printed formulas in numpy, limits, rows, singular postures, memory."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st

from tests.reference.chain import F64

PANDA, UR5E = rd.robots.get("panda"), rd.robots.get("ur5e")
ROBOTS = {"panda": PANDA, "ur5e": UR5E, "stanford_arm": rd.robots.get("stanford_arm")}
TASKS = {
    "full": rd.Task.full(),
    "axisymmetric": rd.Task.axisymmetric((1.0, -2.0, 2.0)),
    "position": rd.Task.position(),
    "base": rd.Task(("line", (1, 2, 3)), ("plane", (0, 1, 1)), "base"),
}
TWIST = np.array([0.1, -0.2, 0.3, 0.05, 0.02, -0.04])
Q = np.array([0.1, 0.2, -0.3, -1.4, 0.2, 1.6, 0.4])
MANIPULABILITY = -1.0 * rd.Manipulability(0.5)
QUICK = PANDA.with_limits(PANDA.q_min, PANDA.q_max, PANDA.qd_max, np.full(7, np.inf))
"""Without limits of acceleration."""


def posture(robot: rd.Robot, rng: np.random.Generator) -> F64:
    low, high = np.maximum(robot.q_min, -2.5), np.minimum(robot.q_max, 2.5)
    return rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))


def programme(
    robot: rd.Robot, task: rd.Task, q: F64, twist: F64, stiffness: float, length: float, weights: F64
) -> tuple[F64, F64]:
    """H and g of equation (3) with the deviation put into the objective; angles count ``length``."""
    T = task.projector(robot, q)
    metric = np.diag([length**2] * 3 + [1.0] * 3)
    rows, wanted = T @ robot.jacobian(q), T @ twist
    return np.diag(weights) + stiffness * rows.T @ metric @ rows, -stiffness * rows.T @ metric @ wanted


def augmented(J: F64, r: F64, Q_: F64, Q_delta: F64, g: F64) -> F64:
    """The rates of (3) as printed: variables qd and delta, ``J qd + delta = r``, by the system of Lagrange."""
    n = len(Q_)
    h = np.block([[Q_, np.zeros((n, 6))], [np.zeros((6, n)), Q_delta]])
    a = np.hstack([J, np.eye(6)])
    system = np.block([[h, a.T], [a, np.zeros((6, 6))]])
    rates: F64 = np.linalg.solve(system, np.r_[-g, np.zeros(6), r])[:n]
    return rates


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_without_limits_it_is_a_linear_system(robot: str, task: str) -> None:
    arm, what, rng = ROBOTS[robot], TASKS[task], np.random.default_rng(1)
    for _ in range(20):
        q, t, weights = posture(arm, rng), rng.uniform(-1.0, 1.0, 6), 10.0 ** rng.uniform(-1.0, 1.0, arm.n)
        stiffness, length = float(10.0 ** rng.uniform(0.0, 4.0)), float(rng.uniform(0.2, 1.5))
        h, g = programme(arm, what, q, t, stiffness, length, weights)
        solver = rd.QuadraticProgram(arm, what, rate_weights=weights, stiffness=stiffness, length=length, limits=False)
        got, wanted = solver.step(q, t), -np.linalg.solve(h, g)
        np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-14 * np.linalg.cond(h) * (1.0 + np.abs(wanted).max()))
        left = what.projector(arm, q) @ (t - arm.jacobian(q) @ got)
        np.testing.assert_allclose(solver.deviation, left, rtol=0, atol=1e-11)
        # The stiffness of the step takes precedence.
        h, g = programme(arm, what, q, t, 3.0, length, weights)
        np.testing.assert_allclose(solver.step(q, t, stiffness=3.0), -np.linalg.solve(h, g), rtol=1e-9, atol=1e-9)


def test_the_classical_formula_is_the_limit_of_a_stiff_task() -> None:
    # (7): J+ r + k0 (1 - J+ J) grad m, with k0 = alpha T where nothing is known of the curvature, as in the first step.
    rng, alpha, dt = np.random.default_rng(2), 30.0, 1e-2
    for _ in range(10):
        q, t = posture(PANDA, rng), rng.uniform(-0.3, 0.3, 6)
        J = PANDA.jacobian(q)
        if np.linalg.svd(J, compute_uv=False)[5] < 0.05:
            continue
        solver = rd.QuadraticProgram(
            PANDA, rd.Task.full(), MANIPULABILITY, weight=alpha, derivatives="bfgs", stiffness=1e9, dt=dt, limits=False
        )
        slope = rd.Manipulability(0.5).evaluate(PANDA, q, order=1)[1]
        pinv = np.linalg.pinv(J)
        wanted = pinv @ t + alpha * dt * (np.eye(7) - pinv @ J) @ slope
        np.testing.assert_allclose(solver.step(q, t), wanted, rtol=0, atol=1e-5)
        assert solver.status == "solved"


@pytest.mark.parametrize("form", ["curvature", "printed", "equality"])
@pytest.mark.parametrize("derivatives", ["exact", "differences"])
def test_the_printed_formulas(form: Any, derivatives: Any) -> None:
    # (10) and (14), with variables qd, delta (and epsilon) as they are printed.
    rng, alpha, dt, stiffness = np.random.default_rng(3), 200.0, 1e-2, 50.0
    index = rd.Manipulability(0.5)
    for _ in range(10):
        q, t = posture(PANDA, rng), rng.uniform(-0.3, 0.3, 6)
        solver = rd.QuadraticProgram(
            PANDA,
            rd.Task.full(),
            -1.0 * index,
            weight=alpha,
            form=form,
            derivatives=derivatives,
            stiffness=stiffness,
            dt=dt,
            limits=False,
        )
        m, slope, curvature = index.evaluate(PANDA, q, order=2)
        if form == "equality":
            # m - T grad m'qd = epsilon, weighed with alpha.
            Q_, g = np.eye(7) + alpha * dt**2 * np.outer(slope, slope), -alpha * m * dt * slope
        else:
            Q_, g = np.eye(7) - alpha * dt**2 * curvature, -alpha * dt * slope
            # Half of the cost of the rates is left: nothing is cut off.
            assert np.linalg.eigvalsh(Q_).min() > 0.5
        wanted = augmented(PANDA.jacobian(q), t, Q_, stiffness * np.eye(6), g)
        tolerance = 1e-9 if derivatives == "exact" else 1e-4
        np.testing.assert_allclose(solver.step(q, t), wanted, rtol=0, atol=tolerance * (1.0 + np.abs(wanted).max()))
        assert solver.conditioned


def test_large_weights() -> None:
    # (10) ceases to be convex, as the authors say; the other two go on.
    rng, seen = np.random.default_rng(4), set()
    for _ in range(20):
        q = posture(PANDA, rng)
        for form in ("curvature", "printed", "equality"):
            solver = rd.QuadraticProgram(
                QUICK, rd.Task.full(), MANIPULABILITY, weight=1e6, form=form, dt=1e-2, stiffness=10.0
            )
            rates = solver.step(q, TWIST)
            assert np.isfinite(rates).all()
            if form == "printed":
                seen.add(solver.status)
                plain = rd.QuadraticProgram(QUICK, rd.Task.full(), dt=1e-2, stiffness=10.0)
                if solver.status == "not convex":
                    np.testing.assert_allclose(rates, plain.step(q, TWIST), rtol=0, atol=1e-9)
            else:
                assert solver.status in ("solved", "relaxed", "limited")
    assert "not convex" in seen


@given(st.sampled_from(sorted(ROBOTS)), st.sampled_from(sorted(TASKS)), st.integers(0, 2**32 - 1))
def test_bounds_hold_and_the_minimiser_is_the_projected_one(robot: str, task: str, seed: int) -> None:
    arm, what, rng = ROBOTS[robot], TASKS[task], np.random.default_rng(seed)
    arm = arm.with_limits(arm.q_min, arm.q_max, rng.uniform(0.05, 1.0, arm.n), np.full(arm.n, np.inf))
    q, t, dt = posture(arm, rng), rng.uniform(-2.0, 2.0, 6), 1e-2
    solver = rd.QuadraticProgram(arm, what, stiffness=100.0, dt=dt)
    x = solver.step(q, t)
    low, high = np.maximum(-arm.qd_max, (arm.q_min - q) / dt), np.minimum(arm.qd_max, (arm.q_max - q) / dt)
    assert (x >= low).all()
    assert (x <= high).all()
    h, g = programme(arm, what, q, t, 100.0, 1.0, np.ones(arm.n))
    slope = h @ x + g
    scale = 1e-11 * (np.abs(h) @ np.abs(x) + np.abs(g)).max()
    assert (slope[x > low] <= scale).all()
    assert (slope[x < high] >= -scale).all()
    held = bool(((x == low) | (x == high)).any())
    assert solver.status in (("limited", "solved") if held else ("relaxed", "solved"))


def test_rows_and_what_fails() -> None:
    solver = rd.QuadraticProgram(QUICK, rd.Task.full(), dt=1e-2)
    row = np.zeros((1, 7))
    row[0, 3] = 1.0
    free = solver.step(Q, TWIST)
    assert (solver.status, solver.failed, solver.distance) == ("solved", [], np.inf)
    x = solver.step(Q, TWIST, rows=row, upper=[free[3] - 0.05])
    assert x[3] == pytest.approx(free[3] - 0.05, abs=1e-12)
    assert solver.failed == []
    assert solver.status in ("solved", "relaxed")
    # Rows that exclude each other fail by as little as can be, and are named.
    x = solver.step(
        Q, TWIST, rows=np.vstack([row, row, np.eye(7)[:1]]), lower=[0.3, -np.inf, -1.0], upper=[np.inf, 0.1, 1.0]
    )
    assert solver.status == "infeasible"
    assert solver.failed == ["row 0", "row 1"]
    assert x[3] == pytest.approx(0.2, abs=1e-3)
    # Limits of joints come before rows.
    x = solver.step(Q, TWIST, rows=row, lower=[100.0])
    assert (solver.status, solver.failed) == ("infeasible", ["row 0"])
    # Rows are opened by 1e-4 more than the least violation.
    assert x[3] == pytest.approx(QUICK.qd_max[3], abs=1.01e-4 * 100.0)
    assert x[3] <= QUICK.qd_max[3]
    # All but as many as may be.
    rows = np.random.default_rng(0).standard_normal((32, 7))
    assert np.isfinite(solver.step(Q, TWIST, rows=rows, lower=np.full(32, 0.5))).all()
    assert np.abs(solver.step(Q, TWIST, rows=rows, lower=np.zeros(32), upper=np.zeros(32))).max() < 1e-9


def test_the_largest_deviation_gives_way_to_rows_and_limits() -> None:
    slow = QUICK.with_limits(QUICK.q_min, QUICK.q_max, np.full(7, 0.1), np.full(7, np.inf))
    near = rd.QuadraticProgram(QUICK, rd.Task.full(), stiffness=1e-2, largest_deviation=(0.01, 0.002))
    x = near.step(Q, TWIST)
    assert np.abs(near.deviation[:3]).max() <= 0.01 + 1e-12
    assert np.abs(near.deviation[3:]).max() <= 0.002 + 1e-12
    assert np.abs(TWIST - QUICK.jacobian(Q) @ x - near.deviation).max() < 1e-12
    over = rd.QuadraticProgram(slow, rd.Task.full(), largest_deviation=(0.01, 0.002))
    x = over.step(Q, 10.0 * TWIST)
    assert np.abs(x).max() <= 0.1
    assert over.status == "limited"
    assert over.failed == ["largest_deviation"]


def test_a_largest_deviation_just_out_of_reach_is_missed_by_little() -> None:
    worst = []
    for most in (0.28, 0.27):
        slow = QUICK.with_limits(QUICK.q_min, QUICK.q_max, np.full(7, most), np.full(7, np.inf))
        solver = rd.QuadraticProgram(slow, rd.Task.full(), stiffness=1e-2, largest_deviation=(0.01, 0.002))
        solver.step(Q, TWIST)
        worst.append(np.abs(solver.deviation).max())
    assert worst[0] <= 0.01 + 1e-12
    assert worst[1] < 0.05


def test_a_row_that_asks_for_very_much_is_met_as_far_as_can_be() -> None:
    row = np.eye(7)[3:4]
    rates = rd.QuadraticProgram(QUICK, rd.Task.full()).step(Q, TWIST, rows=row, lower=[1e6])
    assert rates[3] == pytest.approx(QUICK.qd_max[3], rel=1e-2)


def test_a_twist_beyond_measure_is_not_followed() -> None:
    solver = rd.QuadraticProgram(QUICK, rd.Task.full())
    assert (np.abs(solver.step(Q, 1e200 * TWIST)) <= QUICK.qd_max).all()
    assert solver.status == "limited"


def loop(robot: rd.Robot, seed: int, start: F64, rates: F64, ticks: int, dt: float, task: rd.Task) -> tuple[F64, F64]:
    """Postures and rates of a closed loop with twists that change at random and are far too large at times."""
    rng = np.random.default_rng(seed)
    objective = (rd.ConditionNumber(0.5, squared=True) + 0.1 * rd.JointLimits()) if seed % 2 else None
    solver = rd.QuadraticProgram(robot, task, objective, weight=10.0, dt=dt, stiffness=float(10.0 ** rng.uniform(0, 5)))
    q, x = [start], [rates]
    twist = np.zeros(6)
    for tick in range(ticks):
        if tick % 40 == 0:
            twist = rng.standard_normal(6) * 10.0 ** rng.uniform(-2.0, 1.0)
        x.append(solver.step(q[-1], twist, rates=rates if tick == 0 else None))
        q.append(q[-1] + dt * x[-1])
    return np.array(q), np.array(x)


@pytest.mark.parametrize("seed", range(12))
def test_limits_of_position_speed_and_acceleration_hold_at_every_tick(seed: int) -> None:
    rng = np.random.default_rng(seed)
    dt = float(rng.choice([1e-3, 1e-2]))
    task = [rd.Task.full(), rd.Task.axisymmetric(), rd.Task.position()][seed % 3]
    q, x = loop(PANDA, seed, posture(PANDA, rng), np.zeros(7), 1200, dt, task)
    assert (np.abs(x) <= PANDA.qd_max).all()
    assert (q >= PANDA.q_min - 1e-14).all()
    assert (q <= PANDA.q_max + 1e-14).all()
    assert (np.abs(np.diff(x, axis=0)) <= PANDA.qdd_max * dt * (1.0 + 1e-9) + 1e-12).all()


@pytest.mark.parametrize("seed", range(4))
def test_beyond_a_limit_a_joint_only_moves_back(seed: int) -> None:
    rng = np.random.default_rng(100 + seed)
    start = posture(PANDA, rng)
    out = rng.random(7) < 0.5
    start[out] = np.where(rng.random(out.sum()) < 0.5, PANDA.q_max[out] + 0.2, PANDA.q_min[out] - 0.2)
    # On its way outwards at that.
    q, x = loop(PANDA, seed, start, np.sign(start) * 0.5 * PANDA.qd_max, 800, 1e-2, rd.Task.full())
    assert (np.abs(x[1:]) <= PANDA.qd_max).all()
    over = np.maximum(np.maximum(q - PANDA.q_max, PANDA.q_min - q), 0.0)
    assert (np.diff(over, axis=0) <= 1e-14).all()


def test_a_target_out_of_reach_and_singular_postures() -> None:
    solver = rd.QuadraticProgram(UR5E, rd.Task.axisymmetric(), rd.ConditionNumber(0.5, squared=True), dt=1e-2)
    q = np.array([0.3, -1.0, 1.2, -0.5, 0.8, 0.2])
    target = np.array([5.0, 0.0, 0.4, 1.0, 0.0, 0.0])
    errors = []
    for _ in range(600):
        rates = solver.step(q, solver.twist_to(q, target))
        assert np.isfinite(rates).all()
        assert (np.abs(rates) <= UR5E.qd_max).all()
        q = q + 1e-2 * rates
        errors.append(np.linalg.norm(UR5E.fk(q)[:3, 3] - target[:3]))
    assert errors[-1] < min(errors) + 1e-2
    assert solver.status in ("relaxed", "limited")
    # Stretched out, wrist straight, all zero; the index has no derivative there.
    for q in (np.zeros(6), np.array([0.3, -1.0, 0.0, 0.2, 0.0, 0.1]), np.array([0.3, -1.0, 1.0, 0.2, 0.0, 0.1])):
        for form in ("curvature", "printed", "equality"):
            for objective in (rd.ConditionNumber(0.5, squared=True), MANIPULABILITY):
                at = rd.QuadraticProgram(UR5E, rd.Task.full(), objective, weight=100.0, form=form, dt=1e-2)
                assert np.isfinite(at.step(q, TWIST)).all()
                assert (np.abs(at.step(q, TWIST)) <= UR5E.qd_max).all()


def test_where_the_objective_is_singular_the_step_goes_without() -> None:
    solver = rd.QuadraticProgram(UR5E, rd.Task.full(), rd.ConditionNumber(0.5), weight=100.0)
    plain = rd.QuadraticProgram(UR5E, rd.Task.full())
    np.testing.assert_array_equal(solver.step(np.zeros(6), TWIST), plain.step(np.zeros(6), TWIST))
    assert not solver.conditioned
    solver.step(np.array([0.3, -1.0, 1.2, -0.5, 0.8, 0.2]), TWIST)
    assert solver.conditioned


def test_memory_and_reset() -> None:
    solver = rd.QuadraticProgram(PANDA, rd.Task.full(), dt=1e-3)
    first = solver.step(Q, 10.0 * TWIST)
    second = solver.step(Q, -10.0 * TWIST)
    assert (np.abs(second - first) <= PANDA.qdd_max * 1e-3 * (1.0 + 1e-12)).all()
    np.testing.assert_array_equal(solver.step(Q, -10.0 * TWIST, rates=first), second)
    solver.reset()
    assert (solver.status, solver.failed, solver.changes) == ("solved", [], 0)
    np.testing.assert_array_equal(solver.deviation, np.zeros(6))
    np.testing.assert_allclose(solver.step(Q, 10.0 * TWIST), first, rtol=0, atol=1e-12)
    rest = solver.step(Q, 10.0 * TWIST, rates=np.zeros(7))
    assert (np.abs(rest) <= PANDA.qdd_max * 1e-3 * (1.0 + 1e-12)).all()


def test_what_bfgs_knows_comes_from_the_steps() -> None:
    def solver() -> rd.QuadraticProgram:
        return rd.QuadraticProgram(
            QUICK, rd.Task.position(), MANIPULABILITY, weight=300.0, derivatives="bfgs", dt=1e-2, limits=False
        )

    one, other = solver(), solver()
    one.step(Q, TWIST)
    moved = Q + 0.01
    assert np.abs(one.step(moved, TWIST) - other.step(moved, TWIST)).max() > 1e-6
    one.reset()
    np.testing.assert_array_equal(one.step(moved, TWIST), solver().step(moved, TWIST))
