"""Full matrices of the weights, bounds of the deviation by component and side, jerk, the step of differences.

The programme (3) of Dufour and Suleiman (2020) as printed, with the deviation as a variable, is proven solved.
"""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from scipy.optimize import nnls

from tests.reference.chain import F64
from tests.resolve.test_quadratic import MANIPULABILITY, PANDA, QUICK, TASKS, TWIST, Q, augmented, posture


def definite(rng: np.random.Generator, n: int, spread: float = 1.0) -> F64:
    """A random symmetric positive definite matrix."""
    turn = np.linalg.qr(rng.standard_normal((n, n)))[0]
    out: F64 = turn @ np.diag(10.0 ** rng.uniform(-spread, spread, n)) @ turn.T
    return 0.5 * (out + out.T)


def assert_optimal(J: F64, t: F64, Q_: F64, W: F64, x: F64, bounds: tuple[F64, F64]) -> None:
    """Fail unless x = [qd; delta] solves (3) within bounds: feasible, with multipliers of the right sign."""
    a = np.hstack([J, np.eye(6)])
    np.testing.assert_allclose(a @ x, t, rtol=0, atol=1e-12)
    assert (x >= bounds[0] - 1e-9).all()
    assert (x <= bounds[1] + 1e-9).all()
    gradient = np.r_[Q_ @ x[: len(Q_)], W @ x[len(Q_) :]]
    sides = np.eye(len(x))
    at = np.hstack([a.T, -a.T, sides[:, x <= bounds[0] + 1e-9], -sides[:, x >= bounds[1] - 1e-9]])
    assert nnls(at, gradient)[1] < 1e-8 * (1.0 + np.abs(gradient).max())


@pytest.mark.parametrize("task", TASKS)
def test_full_matrices(task: str) -> None:
    rng, what = np.random.default_rng(1), TASKS[task]
    for _ in range(10):
        q, t = posture(PANDA, rng), rng.uniform(-1.0, 1.0, 6)
        Q_, W, s = definite(rng, 7), definite(rng, 6, 2.0), float(10.0 ** rng.uniform(0.0, 3.0))
        solver = rd.QuadraticProgram(PANDA, what, rate_weights=Q_, stiffness=s * W, length=0.3, limits=False)
        T = what.projector(PANDA, q)
        rows, wanted = T @ PANDA.jacobian(q), T @ t
        h = Q_ + s * rows.T @ W @ rows
        rates = np.linalg.solve(h, s * rows.T @ W @ wanted)
        np.testing.assert_allclose(solver.step(q, t), rates, rtol=0, atol=1e-12 * np.linalg.cond(h))
        np.testing.assert_allclose(solver.deviation, wanted - rows @ rates, rtol=0, atol=1e-9)
        if task == "full":
            np.testing.assert_allclose(rates, augmented(PANDA.jacobian(q), t, Q_, s * W, np.zeros(7)), atol=1e-7)
        # The number of a step multiplies the matrix.
        other = rd.QuadraticProgram(PANDA, what, rate_weights=Q_, stiffness=W, length=0.3, limits=False)
        np.testing.assert_allclose(other.step(q, t, stiffness=s), rates, rtol=0, atol=1e-11 * np.linalg.cond(h))


def _make(more: dict[str, Any], **given: Any) -> rd.QuadraticProgram:
    return rd.QuadraticProgram(QUICK, rd.Task.full(), dt=1e-2, **given, **more)


def test_diagonals_are_what_vectors_were() -> None:
    weights, stiff = np.linspace(0.5, 2.0, 7), np.array([3.0, 4.0, 5.0, 300.0, 400.0, 500.0])
    more: dict[str, Any]
    for more in ({}, {"objective": MANIPULABILITY, "weight": 50.0}):
        one = _make(more, rate_weights=weights, stiffness=stiff).step(Q, TWIST)
        two = _make(more, rate_weights=np.diag(weights), stiffness=np.diag(stiff)).step(Q, TWIST)
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-12)
        one = _make(more, stiffness=77.0, length=0.5).step(Q, TWIST)
        two = _make(more, stiffness=77.0 * np.array([0.25] * 3 + [1.0] * 3)).step(Q, TWIST)
        np.testing.assert_allclose(one, two, rtol=0, atol=1e-10)


def test_bounds_by_component_and_side() -> None:
    rng, seen = np.random.default_rng(2), 0
    for _ in range(60):
        q, t = posture(PANDA, rng), rng.uniform(-0.5, 0.5, 6)
        Q_, W = definite(rng, 7), definite(rng, 6)
        most = -rng.uniform(0.02, 0.3, 6), rng.uniform(0.02, 0.3, 6)
        most[0][rng.integers(6)] = -np.inf
        most[1][rng.integers(6)] = np.inf
        solver = rd.QuadraticProgram(QUICK, rd.Task.full(), rate_weights=Q_, stiffness=W, largest_deviation=most)
        rates = solver.step(q, t)
        low = np.maximum(-QUICK.qd_max, (QUICK.q_min - q) / solver.dt)
        high = np.minimum(QUICK.qd_max, (QUICK.q_max - q) / solver.dt)
        if solver.failed:
            continue
        seen += 1
        x, bounds = np.r_[rates, solver.deviation], (np.r_[low, most[0]], np.r_[high, most[1]])
        assert_optimal(PANDA.jacobian(q), t, Q_, W, x, bounds)
        assert (solver.deviation >= most[0] - 1e-9).all()
        assert (solver.deviation <= most[1] + 1e-9).all()
    assert seen > 40


def test_bounds_of_a_task_with_freedom() -> None:
    rng, what = np.random.default_rng(3), TASKS["base"]
    upper = np.array([0.01, 0.02, 0.03, 0.01, 0.02, 0.03])
    for _ in range(20):
        q = posture(PANDA, rng)
        solver = rd.QuadraticProgram(QUICK, what, stiffness=1e-3, largest_deviation=upper)
        solver.step(q, 0.05 * rng.uniform(-1.0, 1.0, 6))
        if not solver.failed:
            assert (np.abs(solver.deviation) <= upper + 1e-9).all()
    # One number for each side of every component is what a number for angles and one for distances was, of a full task.
    few = rd.QuadraticProgram(QUICK, rd.Task.full(), stiffness=1.0, largest_deviation=(0.02, 0.01)).step(Q, TWIST)
    six = np.array([0.02] * 3 + [0.01] * 3)
    for many in (six, np.stack([-six, six])):
        other = rd.QuadraticProgram(QUICK, rd.Task.full(), stiffness=1.0, largest_deviation=many)
        np.testing.assert_allclose(other.step(Q, TWIST), few, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({"rate_weights": np.ones((7, 6))}, rd.ShapeError),
        ({"rate_weights": np.ones((7, 7))}, rd.InvalidValueError),
        ({"rate_weights": -np.eye(7)}, rd.InvalidValueError),
        ({"rate_weights": np.eye(7) + np.eye(7, k=1)}, rd.InvalidValueError),
        ({"rate_weights": np.eye(7) * np.nan}, rd.NonFiniteError),
        ({"rate_weights": np.zeros(7)}, rd.InvalidValueError),
        ({"stiffness": np.ones(5)}, rd.ShapeError),
        ({"stiffness": np.zeros(6)}, rd.InvalidValueError),
        ({"stiffness": np.ones((6, 6))}, rd.InvalidValueError),
        ({"stiffness": 0.0}, rd.InvalidValueError),
        ({"stiffness": "stiff"}, rd.InvalidValueError),
        ({"largest_deviation": np.ones(3)}, rd.ShapeError),
        ({"largest_deviation": -np.ones(6)}, rd.InvalidValueError),
        ({"largest_deviation": np.ones((2, 6))}, rd.InvalidValueError),
        ({"largest_deviation": (np.nan, 1.0)}, rd.InvalidValueError),
        ({"largest_deviation": np.full(6, np.nan)}, rd.InvalidValueError),
        ({"jerk": 0.0}, rd.InvalidValueError),
        ({"jerk": np.ones(6)}, rd.ShapeError),
        ({"jerk": np.full(7, np.nan)}, rd.InvalidValueError),
        ({"step": 1e-3}, rd.InvalidValueError),
        ({"step": 0.0, "derivatives": "differences"}, rd.InvalidValueError),
    ],
)
def test_bad_settings(given: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error, match=next(iter(given))):
        rd.QuadraticProgram(PANDA, rd.Task.full(), **given)


def test_step_of_the_differences() -> None:
    # (17): what is left of the derivative is the step's square times the third one.
    slope = rd.Manipulability().evaluate(PANDA, Q, order=1)[1]
    found = []
    for step in (4e-2, 2e-2, 1e-4, None):
        given: dict[str, Any] = {} if step is None else {"step": step}
        solver = rd.QuadraticProgram(
            PANDA,
            rd.Task.position(),
            MANIPULABILITY,
            weight=1.0,
            form="equality",
            derivatives="differences",
            limits=False,
            stiffness=1e-9,
            dt=1e-2,
            **given,
        )
        found.append(solver.step(Q, np.zeros(6)))
    exact = rd.QuadraticProgram(
        PANDA, rd.Task.position(), MANIPULABILITY, form="equality", limits=False, stiffness=1e-9, dt=1e-2
    ).step(Q, np.zeros(6))
    assert np.linalg.norm(slope) > 1e-2
    errors = [np.linalg.norm(rates - exact) for rates in found]
    assert errors[0] == pytest.approx(4.0 * errors[1], rel=0.05)
    assert errors[2] < 1e-4 * errors[0]
    np.testing.assert_array_equal(found[2], found[3])


def jerks(rates: F64, dt: float) -> F64:
    """The changes of acceleration over the time between ticks; at rest before the first."""
    whole = np.vstack([np.zeros((2, rates.shape[1])), rates])
    out: F64 = np.diff(whole, 2, axis=0) / dt**2
    return out


@pytest.mark.parametrize("acceleration", [np.inf, 10.0])
def test_jerk(acceleration: float) -> None:
    robot, dt, most = PANDA.with_limits(PANDA.q_min, PANDA.q_max, PANDA.qd_max, np.full(7, acceleration)), 2e-3, 100.0
    q, rates, rest = Q.copy(), [], np.zeros(7)
    solver = rd.QuadraticProgram(robot, rd.Task.full(), jerk=most, dt=dt, stiffness=1e4)
    solver.step(q, np.zeros(6), rates=rest)
    rng = np.random.default_rng(4)
    for k in range(1500):
        if k % 250 == 0:
            twist = rng.uniform(-1.0, 1.0, 6)
        rates.append(solver.step(q, twist))
        q = q + dt * rates[-1]
        assert ((robot.q_min <= q) & (q <= robot.q_max)).all()
    assert np.abs(rates).max() > 0.5
    assert (np.abs(rates) <= robot.qd_max * (1.0 + 1e-12)).all()
    assert np.abs(np.diff(rates, axis=0)).max() <= acceleration * dt * (1.0 + 1e-9)
    assert np.abs(jerks(np.array(rates), dt)).max() <= most * (1.0 + 1e-6)


def test_jerk_in_front_of_a_limit_and_its_reset() -> None:
    dt, most = 2e-3, 50.0
    q = Q.copy()
    q[6] = QUICK.q_max[6] - 0.4
    solver = rd.QuadraticProgram(QUICK, rd.Task.full(), jerk=np.r_[np.full(6, np.inf), most], dt=dt)
    solver.step(q, np.zeros(6))
    rates = []
    # The last joint is driven at its limit by a row.
    for _ in range(2000):
        rates.append(solver.step(q, np.zeros(6), rows=np.eye(7)[6:], lower=[2.0], stiffness=1e-3))
        q = q + dt * rates[-1]
    assert q[6] <= QUICK.q_max[6] + 1e-12
    assert QUICK.q_max[6] - q[6] < 1e-3
    assert np.abs(jerks(np.array(rates), dt)[:, 6]).max() <= most * (1.0 + 1e-6)
    solver.reset()
    # Nothing is known of the rates before.
    q[6] = 0.0
    assert solver.step(q, np.zeros(6), rows=np.eye(7)[6:], lower=[2.0], stiffness=1e-3)[6] == pytest.approx(2.0)


def test_jerk_on_the_way_back_from_beyond_a_limit() -> None:
    dt, most = 2e-3, 300.0
    q = Q.copy()
    q[6] = PANDA.q_max[6] + 0.2
    solver = rd.QuadraticProgram(PANDA, rd.Task.full(), jerk=most, dt=dt)
    rates = [np.zeros(7)]
    solver.step(q, np.zeros(6), rates=rates[0])
    for _ in range(1000):
        rates.append(solver.step(q, np.zeros(6)))
        q = q + dt * rates[-1]
    assert q[6] <= PANDA.q_max[6]
    # A quarter of the speed; the other joints move so that the hand stands still.
    assert -np.array(rates)[:, 6].min() == pytest.approx(0.25 * PANDA.qd_max[6], rel=1e-3)
    assert np.abs(np.diff(rates[1:], 2, axis=0)).max() <= most * dt**2 * (1.0 + 1e-6)
    assert np.abs(rates[-1]).max() < 1e-9


def test_with_jerk_rates_do_not_swing_about_what_is_asked() -> None:
    dt = 2e-3
    solver, q, rates = rd.QuadraticProgram(QUICK, rd.Task.full(), jerk=300.0, dt=dt), Q.copy(), []
    solver.step(q, np.zeros(6), rates=np.zeros(7))
    for k in range(800):
        rates.append(solver.step(q, TWIST if k < 400 else np.zeros(6)))
        q = q + dt * rates[-1]
    plain = rd.QuadraticProgram(QUICK, rd.Task.full(), dt=dt).step(q, TWIST)
    # At rest for good after as long as the jerk takes; a joint that swings would do so for ever.
    assert np.abs(rates[550:]).max() < 1e-9
    assert np.abs(np.array(rates)[:400]).max() < 1.5 * np.abs(plain).max()
