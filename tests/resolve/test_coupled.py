"""Limits on combinations of joints in every solver: ticks keep them, come back, and follow the task where they can."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from scipy.optimize import lsq_linear, minimize

from tests.reference.chain import F64
from tests.resolve.rates import METHODS

KAPPA = rd.ConditionNumber(0.48, squared=True)
AXIAL = rd.Task.axisymmetric()
ARMS = {
    "ur5e": (rd.robots.get("ur5e"), np.array([0.3, -1.2, 1.5, -0.9, -1.2, 0.2]), {1: 1.0, 2: 1.0}),
    "panda": (rd.robots.get("panda"), np.array([0.0, -0.5, 0.0, -2.0, 0.1, 1.5, 0.5]), {1: 1.0, 3: -0.5}),
}
PANDA = ARMS["panda"][0]
QUICK = PANDA.with_limits(qdd_max=np.full(7, np.inf))
"""Without limits of acceleration."""
ALL = ["QuadraticProgram", "OrthogonalSQP", *METHODS]


def row(robot: rd.Robot, terms: dict[int, float]) -> F64:
    out = np.zeros(robot.n)
    out[list(terms)] = list(terms.values())
    return out


def solver(method: str, robot: rd.Robot, task: rd.Task, **settings: Any) -> Any:
    if method in METHODS:
        return METHODS[method](robot, task, **settings)
    return getattr(rd, method)(robot, task, KAPPA, **settings)


def run(one: Any, q: F64, twist: F64, ticks: int, dt: float = 1e-3) -> tuple[F64, list[str]]:
    """All postures of some ticks, the first included, and their statuses."""
    postures, statuses = [q], []
    for k in range(ticks):
        rates = one.step(postures[-1], min(1.0, k / 200.0) * twist)
        postures.append(postures[-1] + dt * rates)
        statuses.append(one.status)
    return np.array(postures), statuses


@pytest.mark.parametrize("task", [rd.Task.full(), AXIAL], ids=["full", "axisymmetric"])
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("method", ALL)
def test_ticks_keep_them_and_would_cross_them_without(method: str, name: str, task: rd.Task) -> None:
    arm, q, terms = ARMS[name]
    c = row(arm, terms)
    twist = 0.3 * (np.r_[0.0, 0.0, 0.0, 1.0, 0.0, 1.0] if name == "ur5e" else np.r_[0.0, 0.0, 0.0, -1.0, 0.0, -1.0])
    free, _ = run(solver(method, arm, task), q, twist, 700)
    drift = free @ c - q @ c
    far = drift[np.abs(drift).argmax()]
    assert abs(far) > 0.1
    ends = (-np.inf, q @ c + 0.5 * far) if far > 0.0 else (q @ c + 0.5 * far, np.inf)
    robot = arm.with_limits(coupled=[(terms, *ends)])
    kept, statuses = run(solver(method, robot, task), q, twist, 700)
    beyond = np.maximum(kept @ c - ends[1], ends[0] - kept @ c)
    assert beyond.max() <= 1e-12
    assert beyond.max() > -1e-3  # it is reached
    assert "limited" in statuses
    assert (np.abs(np.diff(kept, axis=0)) <= 1e-3 * robot.qd_max + 1e-15).all()
    assert ((kept >= robot.q_min) & (kept <= robot.q_max)).all()
    # Nothing changes where the limit is far.
    loose = arm.with_limits(coupled=[(terms, -50.0, 50.0)])
    np.testing.assert_allclose(run(solver(method, loose, task), q, twist, 50)[0], free[:51], atol=1e-12)


@pytest.mark.parametrize("method", ALL)
def test_the_spare_joint_makes_up_for_it(method: str) -> None:
    """At a limit that the free motion of seven joints can make up for, the tool still follows its task."""
    q, terms = np.array([0.3, -0.5, 0.4, -2.0, 0.1, 1.5, 0.5]), {0: 1.0, 4: -1.0}
    c = row(QUICK, terms)
    one = solver(method, QUICK, rd.Task.full(), **({"stiffness": 1e6} if method == "QuadraticProgram" else {}))
    twist = np.r_[0.0, 0.0, 0.0, -0.05, 0.02, -0.03]
    wanted, here = float(one.step(q, twist) @ c), float(q @ c)
    robot = QUICK.with_limits(coupled=[(terms, here, np.inf) if wanted < 0.0 else (terms, -np.inf, here)])
    at = solver(method, robot, rd.Task.full(), **({"stiffness": 1e6} if method == "QuadraticProgram" else {}))
    rates = at.step(q, twist)
    assert abs(wanted) > 1e-3
    assert abs(rates @ c) < 1e-12
    tolerance = 1e-4 if method == "QuadraticProgram" else 1e-6
    np.testing.assert_allclose(robot.jacobian(q) @ rates, twist, atol=tolerance * np.abs(twist).max())
    assert at.status == ("solved" if method == "QuadraticProgram" else "limited")


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("name", ARMS)
@pytest.mark.parametrize("method", ALL)
def test_beyond_one_they_come_back(method: str, name: str, side: float) -> None:
    arm, q, terms = ARMS[name]
    c = row(arm, terms)
    ends = (-np.inf, q @ c - 0.15) if side > 0.0 else (q @ c + 0.15, np.inf)
    robot = arm.with_limits(coupled=[(terms, *ends)])
    one = solver(method, robot, AXIAL)
    postures, statuses = run(one, q, np.r_[0.0, 0.0, 0.0, 0.02, 0.0, 0.0], 400)
    margins = robot.limit_margin(postures)
    assert statuses[0] == "returning"
    back = statuses.index(next(status for status in statuses if status != "returning"))
    assert 10 < back < 300
    assert (np.diff(margins[: back + 1]) >= -1e-15).all()
    assert (margins[back + 1 :] >= -1e-12).all()
    assert (np.abs(np.diff(postures, axis=0)) <= 1e-3 * robot.qd_max + 1e-15).all()
    if method == "QuadraticProgram" and np.isfinite(robot.qdd_max).all():
        rates = np.diff(postures, axis=0) / 1e-3
        assert (np.abs(np.diff(rates, axis=0)) <= 1e-3 * robot.qdd_max * (1.0 + 1e-9) + 1e-9).all()


def test_accelerations_are_kept_in_front_of_a_limit() -> None:
    rng = np.random.default_rng(1)
    for _ in range(8):
        q = rng.uniform(np.maximum(PANDA.q_min, -2.0) + 0.3, np.minimum(PANDA.q_max, 2.0) - 0.3)
        i, j = (int(x) for x in rng.choice(7, 2, replace=False))
        value = q[i] - q[j]
        robot = PANDA.with_limits(coupled=[({i: 1.0, j: -1.0}, value - 0.05, value + 0.05)])
        postures, _ = run(rd.QuadraticProgram(robot, AXIAL, KAPPA), q, rng.uniform(-0.3, 0.3, 6), 500)
        rates = np.diff(postures, axis=0) / 1e-3
        assert robot.limit_margin(postures).min() >= -1e-12
        assert (np.abs(np.diff(rates, axis=0)) <= 1e-3 * robot.qdd_max * (1.0 + 1e-6) + 1e-9).all()


def test_the_programme_is_optimal() -> None:
    """The least squares of task and rates within bounds and two combinations, by scipy."""
    rng = np.random.default_rng(2)
    terms = [{0: 1.0, 2: 1.0}, {1: 1.0, 3: -0.5, 5: 2.0}]
    weights, stiffness, dt, held = 10.0 ** rng.uniform(-1.0, 1.0, 7), 300.0, 1e-2, 0
    for _ in range(30):
        q = rng.uniform(np.maximum(QUICK.q_min, -2.0) + 0.2, np.minimum(QUICK.q_max, 2.0) - 0.2)
        rows = np.array([row(QUICK, it) for it in terms])
        room = rng.uniform(0.0, 4e-4, (2, 2))
        ends = [(it, x @ q - low, x @ q + high) for it, x, (low, high) in zip(terms, rows, room, strict=True)]
        robot = QUICK.with_limits(coupled=ends)
        twist = rng.uniform(-0.3, 0.3, 6)
        one = rd.QuadraticProgram(robot, rd.Task.full(), length=0.5, stiffness=stiffness, rate_weights=weights, dt=dt)
        rates = one.step(q, twist)
        scale = np.sqrt(stiffness) * np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])
        a = np.vstack([scale[:, None] * robot.jacobian(q), np.diag(np.sqrt(weights))])
        b = np.r_[scale * twist, np.zeros(7)]

        def cost(x: F64, a: F64 = a, b: F64 = b) -> tuple[float, F64]:
            left = a @ x - b
            return 0.5 * float(left @ left), a.T @ left

        inside = [
            {"type": "ineq", "fun": lambda x, r=rows, u=room: u[:, 1] / dt - r @ x, "jac": lambda x, r=rows: -r},
            {"type": "ineq", "fun": lambda x, r=rows, u=room: u[:, 0] / dt + r @ x, "jac": lambda x, r=rows: r},
        ]
        bounds = list(zip(-robot.qd_max, robot.qd_max, strict=True))
        start = lsq_linear(a, b).x * 0.0
        best = minimize(
            cost,
            start,
            jac=True,
            method="SLSQP",
            bounds=bounds,
            constraints=inside,
            options={"ftol": 1e-16, "maxiter": 500},
        )
        assert (dt * rows @ rates <= room[:, 1] + 1e-14).all()
        assert (dt * rows @ rates >= -room[:, 0] - 1e-14).all()
        assert cost(rates)[0] <= best.fun * (1.0 + 1e-9) + 1e-12
        np.testing.assert_allclose(rates, best.x, atol=2e-4)
        held += one.status == "limited"
    assert held > 20


@pytest.mark.parametrize("kind", ["full", "axisymmetric", "position"])
def test_solutions_are_optimal(kind: str) -> None:
    """On a target, the minimum under a combination that the free minimum is beyond, by SLSQP."""
    rng, iterations = np.random.default_rng(0), list[int]()
    for case in range(8):
        q0 = rng.uniform(np.maximum(PANDA.q_min, -2.0) + 0.3, np.minimum(PANDA.q_max, 2.0) - 0.3)
        pose = PANDA.fk(q0)
        targets = {
            "full": np.r_[pose[:3, 3], pose[:3, :3].ravel()],
            "axisymmetric": np.r_[pose[:3, 3], pose[:3, 2]],
            "position": pose[:3, 3],
        }
        task: rd.Task = {"full": rd.Task.full(), "axisymmetric": AXIAL, "position": rd.Task.position()}[kind]
        free = rd.OrthogonalSQP(PANDA, task, KAPPA).solve(targets[kind], q0=q0)
        terms = {0: 1.0, 2: 1.0} if case % 2 else {1: 1.0, 3: -0.5}
        c = row(PANDA, terms)
        before, after = c @ q0, c @ free.q
        if free.status == "unreachable" or abs(after - before) < 0.02:
            continue
        end, sign = float(0.5 * (before + after)), np.sign(after - before)
        robot = PANDA.with_limits(coupled=[(terms, -np.inf, end) if sign > 0.0 else (terms, end, np.inf)])
        found = rd.OrthogonalSQP(robot, task, KAPPA).solve(targets[kind], q0=q0)
        assert found.status in ("converged", "on target")
        assert sign * (c @ found.q - end) <= 1e-12

        def off(q: F64, pose: F64 = pose) -> F64:
            there = PANDA.fk(q)
            turn = there[:3, :3].T @ pose[:3, :3]
            angular = {
                "position": np.zeros(0),
                "axisymmetric": pose[:3, :2].T @ there[:3, 2],
                "full": np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]),
            }
            return np.concatenate([there[:3, 3] - pose[:3, 3], angular[kind]])

        inside = {"type": "ineq", "fun": lambda q, c=c, s=sign, e=end: s * (e - c @ q)}
        best = minimize(
            lambda q: KAPPA.evaluate(PANDA, q, 1),
            found.q,
            jac=True,
            method="SLSQP",
            bounds=list(zip(PANDA.q_min, PANDA.q_max, strict=True)),
            constraints=[{"type": "eq", "fun": off}, inside],
            options={"ftol": 1e-15, "maxiter": 300},
        )
        assert found.value <= best.fun * (1.0 + 1e-8)
        # Where a joint is at its own limit too, the valley is flat. Joint 7 spins the tool, unseen by its axis.
        count = 6 if kind == "axisymmetric" else 7
        np.testing.assert_allclose(found.q[:count], best.x[:count], atol=3e-4)
        iterations.append(found.iterations)
    assert len(iterations) >= 3
    assert np.median(iterations) <= 15


@pytest.mark.parametrize("method", ["OrthogonalSQP", "QuadraticProgram", "TwistDecomposition"])
def test_solutions_from_anywhere_are_within(method: str) -> None:
    robot = PANDA.with_limits(coupled=[({1: 1.0, 3: 1.0}, -2.0, -1.5), ({0: 1.0, 2: 1.0, 4: 1.0}, 0.2, 0.6)])
    for q in robot.random_postures(6, seed=4):
        pose = robot.fk(q)
        found = solver(method, robot, rd.Task.full()).solve(np.r_[pose[:3, 3], pose[:3, :3].ravel()], starts=24)
        assert found.status != "unreachable"
        assert robot.within_limits(found.q)


def test_a_combination_without_limits_that_hold_changes_nothing() -> None:
    q = ARMS["panda"][1]
    robot = PANDA.with_limits(coupled=[({1: 1.0, 3: 1.0}, 0.0, 1.0)])
    twist = np.r_[0.0, 0.1, 0.0, 0.1, 0.0, -0.1]
    for method in ALL:
        free = solver(method, PANDA, AXIAL, limits=False).step(q, twist)
        np.testing.assert_array_equal(solver(method, robot, AXIAL, limits=False).step(q, twist), free)
