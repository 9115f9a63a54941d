"""`OrthogonalSQP.solve` for every pair of projectors in every frame: a minimum on the target, or a limit."""

import numpy as np
import pytest
import redundancy as rd
from scipy.optimize import minimize

from tests.reference.projectors import PART, ROBOTS, differences, jumps, slope, tasks

KAPPA = rd.ConditionNumber(0.4855933, squared=True)
STARTS = 10


@pytest.mark.parametrize("name", ROBOTS)
def test_minimum_or_limit(name: str) -> None:
    robot, rng, statuses = rd.robots.get(name), np.random.default_rng(4), set[str]()
    for which, task in tasks():
        solver = rd.OrthogonalSQP(robot, task, KAPPA)
        if task.dimension == robot.n:
            continue
        for _ in range(STARTS):
            q0 = rng.uniform(np.maximum(robot.q_min, -3.0), np.minimum(robot.q_max, 3.0))
            target = robot.fk(q0)
            q, value, status, _ = solver.solve(target, q0)
            assert np.abs(solver.error(q, target)).max() <= 1e-9, which
            assert value <= KAPPA.evaluate(robot, q0, order=0) * (1.0 + 1e-9), which
            if jumps(robot, q, target):
                continue
            left, size, limited = slope(solver, q, target)
            # What differences leave of a gradient whose curvature is thousands.
            assert left <= 1e-8 * (1.0 + size), (which, status, left, size)
            assert status == "converged" or limited, which
            statuses.add(status)
    assert "converged" in statuses


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(
    "which", ["line line tool", "plane line part", "line full base", "free plane tool", "free line part"]
)
def test_an_independent_descent_finds_nothing_better_nearby(name: str, which: str) -> None:
    robot, rng = rd.robots.get(name), np.random.default_rng(8)
    solver = rd.OrthogonalSQP(robot, dict(tasks())[which], KAPPA)
    for _ in range(2):
        q0 = rng.uniform(np.maximum(robot.q_min, -2.0), np.minimum(robot.q_max, 2.0))
        target = robot.fk(q0)
        q, value, _, _ = solver.solve(target, q0)
        near = [*zip(np.maximum(robot.q_min, q - 0.05), np.minimum(robot.q_max, q + 0.05), strict=True)]
        found = minimize(
            lambda x: float(KAPPA.evaluate(robot, x, order=0)),
            q,
            jac=lambda x: KAPPA.evaluate(robot, x, order=1)[1],
            bounds=near,
            constraints={"type": "eq", "fun": lambda x, target=target: solver.constraint(x, target).h},
            method="SLSQP",
            options={"maxiter": 200, "ftol": 1e-14},
        )
        on_target = np.abs(solver.error(found.x, target)).max() < 1e-9
        assert not on_target or found.fun >= value - 1e-7 * abs(value), (which, found.fun, value)


def test_a_free_direction_and_a_distance_along_the_axis_of_the_tool() -> None:
    robot = rd.robots.get("fanuc_m710ic50_milling").with_limits(q_min=[-np.inf] * 6, q_max=[np.inf] * 6)
    q = np.deg2rad([30, 40, 10, 60, -60, 100.0])
    solver = rd.OrthogonalSQP(robot, rd.Task(("plane", (0, 0, 1)), ("line", (0, 0, 1))), KAPPA)
    _, value, status, _ = solver.solve(robot.fk(q), q)
    # Found by a descent of another kind on the constraint.
    assert value == pytest.approx(6.4285, abs=1e-4)
    assert status == "converged"


def test_nothing_free_and_nothing_asked_for() -> None:
    """Full and full has no freedom on six joints; free and free is a descent without a target."""
    robot = rd.robots.get("ur5e")
    q0 = np.array([0.3, -1.0, 1.2, -0.4, 0.8, 0.1])
    fixed = rd.OrthogonalSQP(robot, rd.Task.full(), KAPPA)
    q, _, status, _ = fixed.solve(robot.fk(q0), q0)
    np.testing.assert_allclose(q, q0, atol=1e-9)
    assert status == "converged"
    out = np.array([5.0, 0.0, 0.0])
    assert fixed.solve(np.r_[out, np.eye(3).ravel()], q0).status == "unreachable"
    for frame in ("tool", "base", PART):
        free = rd.OrthogonalSQP(robot, rd.Task("free", "free", frame), KAPPA)
        q, value, status, _ = free.solve(out, q0)
        assert status == "converged"
        assert value == pytest.approx(
            rd.minimum_condition_posture(robot, q0, length=0.4855933).condition_number ** 2, rel=0.2
        )
        assert np.linalg.norm(KAPPA.evaluate(robot, q, order=1)[1]) < 1e-8


@pytest.mark.parametrize("name", ROBOTS)
def test_the_jacobian_is_the_derivative_of_the_error(name: str) -> None:
    robot, rng = rd.robots.get(name), np.random.default_rng(3)
    for which, task in tasks():
        solver = rd.OrthogonalSQP(robot, task, KAPPA, length=0.7)
        q0 = rng.uniform(np.maximum(robot.q_min, -2.0), np.minimum(robot.q_max, 2.0))
        target = robot.fk(q0)
        q = solver.solve(target, q0).q
        if jumps(robot, q, target):
            continue
        h, jacobian, null = solver.constraint(q, target)
        m, n = task.dimension, robot.n
        assert (h.shape, jacobian.shape, null.shape) == ((m,), (m, n), (n, n - min(m, n)))
        assert m == 0 or np.abs(h).max() < 1e-9
        # Components and the six numbers of the error span the same rows.
        expected = differences(solver, q, target)
        np.testing.assert_allclose(np.linalg.svd(expected)[1][m:], 0.0, atol=1e-8)
        np.testing.assert_allclose(expected @ null, 0.0, atol=1e-7, err_msg=which)
        np.testing.assert_allclose(jacobian @ null, 0.0, atol=1e-12)
        np.testing.assert_allclose(null.T @ null, np.eye(null.shape[1]), atol=1e-12)


def test_rows_of_an_axisymmetric_tool() -> None:
    robot = rd.robots.get("ur5e")
    solver = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), KAPPA, length=0.5)
    q = np.array([0.3, -1.0, 1.2, -0.4, 0.8, 0.1])
    h, jacobian, null = solver.constraint(q, robot.fk(q))
    step = 1e-6
    columns = [
        (solver.constraint(q + d, robot.fk(q)).h - solver.constraint(q - d, robot.fk(q)).h) / (2.0 * step)
        for d in step * np.eye(6)
    ]
    np.testing.assert_allclose(np.array(columns).T, jacobian, atol=1e-8)
    # The null direction spins the tool about its axis and leaves its point where it is (4.12).
    twist = robot.jacobian(q) @ null[:, 0]
    np.testing.assert_allclose(np.cross(twist[:3], robot.fk(q)[:3, 2]), 0.0, atol=1e-12)
    np.testing.assert_allclose(twist[3:], 0.0, atol=1e-12)
    assert np.abs(h).max() < 1e-12


def test_null_directions_where_the_jacobian_is_singular() -> None:
    robot = rd.robots.get("ur5e")
    solver = rd.OrthogonalSQP(robot, rd.Task.full(), KAPPA)
    q = np.array([0.3, -1.0, 1.2, -0.4, 0.0, 0.1])  # the axes of joints 4 and 6 are parallel
    null = solver.constraint(q, robot.fk(q)).null
    assert null.shape == (6, 1)
    np.testing.assert_allclose(robot.jacobian(q) @ null, 0.0, atol=1e-12)


def test_history_of_a_solution() -> None:
    robot = rd.robots.get("fanuc_m710ic50_milling")
    for hessian in ("exact", "bfgs"):
        solver = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), KAPPA, hessian=hessian)
        q0 = np.deg2rad([10, 20, -15, 40, -50, 30.0])
        target = robot.fk(q0)
        q, value, status, _ = solver.solve(target, q0)
        seen = solver.history(target, q0)
        assert status == "converged"
        assert len(seen.value) == len(seen.q) == len(seen.evaluations)
        np.testing.assert_allclose(seen.q[0], q0, atol=1e-9)
        np.testing.assert_allclose(seen.q[-1], q, atol=1e-6)
        assert (np.diff(seen.value) <= 1e-10 * value).all()
        assert (np.diff(seen.evaluations) >= 1).all()
        # Newton's last step is the square of the one before.
        assert seen.gradient[-1] < 1e-4 * seen.gradient[0]
        free = solver.constraint(seen.q[0], target).null
        slope_there = free.T @ KAPPA.evaluate(robot, seen.q[0], order=1)[1]
        assert seen.gradient[0] == pytest.approx(np.linalg.norm(slope_there), rel=1e-9)


def test_bad_arguments_of_constraint_and_history() -> None:
    robot = rd.robots.get("ur5e")
    solver = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), KAPPA)
    for call in (solver.constraint, lambda q, target: solver.history(target, q)):
        with pytest.raises(rd.errors.ShapeError):
            call(np.zeros(5), robot.fk(np.zeros(6)))
        with pytest.raises(rd.errors.ShapeError):
            call(np.zeros(6), np.zeros(4))
        with pytest.raises(rd.errors.NonFiniteError):
            call(np.full(6, np.nan), robot.fk(np.zeros(6)))
