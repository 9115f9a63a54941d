"""Orthogonal SQP: the thesis' helix against the minima of `data/leger_fanuc.json`, other arms by perturbation."""

from typing import Any, Literal

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray

from tests.reference.files import read_json

ORACLE: dict[str, Any] = read_json("leger_fanuc.json")
HELIX = ORACLE["helix"]
LENGTH = float(HELIX["length_m"])
POINTWISE = np.array(HELIX["pointwise_minimum_kappa"])
FANUC = rd.robots.get("fanuc_m710ic50_milling")
AXISYMMETRIC = rd.Task.axisymmetric()

F64 = NDArray[np.float64]


def helix(points: int = 101) -> rd.Toolpath:
    """Table 4-3 of the thesis, 9 degrees a second."""
    return rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.0, np.pi / 2, np.pi, (1.3, 1.0, 0.0), points, duration=10.0)


def sqp(**settings: Any) -> rd.OrthogonalSQP:
    return rd.OrthogonalSQP(FANUC, AXISYMMETRIC, rd.ConditionNumber(LENGTH, squared=True), **settings)


def test_helix_is_that_of_the_thesis() -> None:
    path = helix()
    # (4.36)
    np.testing.assert_allclose(path.position[0], [1.05, 1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(path.axis[0], [1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(path.position[-1], [1.3, 1.25, 0.25], atol=1e-15)
    np.testing.assert_allclose(path.axis[-1], [0.0, 0.0, -1.0], atol=1e-15)


def _check_helix(q: F64, tolerance: float = 1e-6) -> None:
    path = helix()
    kappa = rd.ConditionNumber(LENGTH).evaluate_many(FANUC, q, 0)[0]
    np.testing.assert_allclose(kappa, POINTWISE, rtol=0, atol=tolerance)
    assert kappa.max() <= 2.54226
    # The thesis' trajectory, with its axis, reaches this at most.
    assert kappa.max() < float(HELIX["thesis_maximum"]["normalised"])
    tools = FANUC.fk(q)
    # The tool frame's z axis is the oracle's axis in the frame that follows joint 6, before the turn of alpha_6.
    position = np.linalg.norm(tools[:, :3, 3] - path.position, axis=1)
    angle = np.linalg.norm(np.cross(tools[:, :3, 2], path.axis), axis=1)
    assert position.max() < 1e-9
    assert angle.max() < 1e-9
    assert ((FANUC.q_min <= q) & (q <= FANUC.q_max)).all()
    assert np.abs(np.diff(q, axis=0)).max() < 0.06


def test_axis_of_the_tool_is_that_of_the_oracle() -> None:
    # Before Rx(alpha_6 = 180 deg) the axis is (sin 60, 0, cos 60).
    np.testing.assert_allclose(FANUC.tool[:3, 2], [np.sin(np.pi / 3), 0.0, -np.cos(np.pi / 3)], atol=1e-15)


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_follow_reaches_the_pointwise_minima(hessian: Literal["exact", "bfgs"]) -> None:
    trajectory = rd.follow(sqp(hessian=hessian), helix())
    _check_helix(trajectory.q)
    assert set(trajectory.status) == {"converged"}
    assert trajectory.position_error.max() < 1e-9
    assert trajectory.axis_error.max() < 1e-9
    np.testing.assert_allclose(trajectory.value, trajectory.condition_number**2, rtol=1e-12)
    assert trajectory.max_joint_speed is not None
    assert trajectory.joint_speed is not None
    assert (np.abs(trajectory.joint_speed) <= FANUC.qd_max).all()
    print(
        f"{hessian}: {trajectory.iterations} iterations, error {abs(trajectory.condition_number - POINTWISE).max():.1e}"
    )


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
def test_a_chunk_from_the_first_posture(hessian: Literal["exact", "bfgs"]) -> None:
    first = np.deg2rad(HELIX["first_point_q_deg"])
    q, value, position, axis, statuses, iterations = sqp(hessian=hessian).follow_chunk(helix().targets(), first)
    _check_helix(q)
    np.testing.assert_allclose(q[0], first, atol=1e-7)
    # The oracle's last posture is the mirror image of this one, with the same kappa.
    last = rd.ConditionNumber(LENGTH).evaluate(FANUC, np.deg2rad(HELIX["last_point_q_deg"]), order=0)
    assert np.sqrt(value[-1]) == pytest.approx(last, abs=1e-6)
    assert statuses == ["converged"] * 101
    assert max(position.max(), axis.max()) < 1e-9
    np.testing.assert_allclose(np.sqrt(value), POINTWISE, atol=1e-6)
    assert iterations <= 101 * 12


def test_null_direction_is_the_spin_of_the_tool() -> None:
    # (4.12): L = J_n^-1 [e; 0]; a step for no motion of the tool moves along it only, and against the gradient.
    first = np.deg2rad(HELIX["first_point_q_deg"]) + np.array([0.05, -0.1, 0.2, 0.1, -0.1, 0.3])
    scale = np.repeat([LENGTH, 1.0], 3)
    axis = FANUC.fk(first)[:3, 2]
    null = np.linalg.solve(scale[:, None] * FANUC.jacobian(first), np.append(axis, np.zeros(3)))
    rates = sqp().step(first, np.zeros(6))
    across = rates - null * (null @ rates) / (null @ null)
    assert np.linalg.norm(rates) > 1e-3
    assert np.linalg.norm(across) < 1e-12 * np.linalg.norm(rates)
    gradient = rd.ConditionNumber(LENGTH, squared=True).evaluate(FANUC, first, order=1)[1]
    assert gradient @ rates < 0


def _null_space(solver: rd.OrthogonalSQP, q: F64) -> F64:
    jacobian = solver.robot.jacobian(q)
    kind = solver.task.kind
    if kind == "axisymmetric":
        axis = solver.robot.fk(q)[:3, :3] @ solver.task.axis
        jacobian = np.vstack([np.cross(np.eye(3), axis) @ jacobian[:3], jacobian[3:]])
    elif kind == "position":
        jacobian = jacobian[3:]
    _, sigma, rows = np.linalg.svd(jacobian)
    rank = int(np.sum(sigma > 1e-9 * sigma[0]))
    assert rank == solver.task.dimension
    null: F64 = rows[rank:]
    return null


def _back(solver: rd.OrthogonalSQP, q: F64, target: F64) -> F64:
    """Newton's method back to the target by numpy."""
    for _ in range(20):
        error = solver.error(q, target)
        jacobian = solver.robot.jacobian(q)
        if solver.task.kind == "position":
            jacobian, error = jacobian[3:], error[3:]
        elif solver.task.kind == "axisymmetric":
            axis = solver.robot.fk(q)[:3, :3] @ solver.task.axis
            turn = np.eye(3) - np.outer(axis, axis)
            jacobian = np.vstack([turn @ jacobian[:3], jacobian[3:]])
        q = q + np.linalg.lstsq(jacobian, error, rcond=1e-10)[0]
    assert np.linalg.norm(solver.error(q, target)) < 1e-12
    return q


def _check_local_minimum(solver: rd.OrthogonalSQP, q: F64, target: F64) -> None:
    value, gradient = solver.objective.evaluate(solver.robot, q, order=1)
    null = _null_space(solver, q)
    assert np.linalg.norm(null @ gradient) < 1e-5 * max(1.0, value)
    rng = np.random.default_rng(0)
    for direction in [*null, *rng.standard_normal((6, len(null))) @ null]:
        for distance in (1e-3, -1e-3):
            moved = _back(solver, q + distance * direction, target)
            assert solver.objective.evaluate(solver.robot, moved, order=0) >= value - 1e-12 * value


def _target(task: rd.Task, frame: F64) -> F64:
    if task.kind == "axisymmetric":
        return np.concatenate([frame[:3, 3], frame[:3, :3] @ task.axis])
    return frame[:3, 3] if task.kind == "position" else np.concatenate([frame[:3, 3], frame[:3, :3].ravel()])


CASES = [
    ("fanuc_m710ic50_milling", AXISYMMETRIC),
    ("ur5e", rd.Task.axisymmetric((1.0, 0.5, -0.2))),
    ("ur5e", rd.Task.position()),
    ("panda", AXISYMMETRIC),
    ("panda", rd.Task.full()),
    ("panda", rd.Task.position()),
    ("kuka_iiwa14", AXISYMMETRIC),
    ("kuka_iiwa14", rd.Task.full()),
    ("baxter_left", AXISYMMETRIC),
    ("stanford_arm", rd.Task.axisymmetric((1.0, 0.5, -0.2))),
]


@pytest.mark.parametrize("hessian", ["exact", "bfgs"])
@pytest.mark.parametrize(("name", "task"), CASES, ids=[f"{name}-{task.kind}" for name, task in CASES])
def test_solve_ends_at_a_local_minimum(name: str, task: rd.Task, hessian: Literal["exact", "bfgs"]) -> None:
    robot = rd.robots.get(name)
    length = 0.4
    solver = rd.OrthogonalSQP(robot, task, rd.ConditionNumber(length, squared=True), hessian=hessian, limits=False)
    rng = np.random.default_rng(9)
    converged = 0
    for _ in range(8):
        start = rng.uniform(np.maximum(robot.q_min, -2.5), np.minimum(robot.q_max, 2.5))
        target = _target(task, robot.fk(start))
        before = solver.objective.evaluate(robot, start, order=0)
        q, value, status, _ = solver.solve(target, start)
        assert np.isfinite(q).all()
        # The start is on the target: there is no excuse for leaving it.
        assert status != "unreachable"
        assert np.linalg.norm(solver.error(q, target)) < 2e-9
        assert value <= before * (1 + 1e-9)
        if status == "converged":
            converged += 1
            _check_local_minimum(solver, q, target)
    assert converged >= 7


@pytest.mark.parametrize("name", ["fanuc_m710ic50", "ur5e", "stanford_arm", "abb_irb120"])
def test_spin_that_the_objective_does_not_feel_is_left_alone(name: str) -> None:
    # The axis of the bare flange is that of joint 6: no index of the Jacobian changes with it.
    robot = rd.robots.get(name)
    solver = rd.OrthogonalSQP(robot, AXISYMMETRIC, rd.ConditionNumber(0.4, squared=True), limits=False)
    rng = np.random.default_rng(9)
    for _ in range(8):
        start = rng.uniform(robot.q_min, robot.q_max)
        q, _, status, iterations = solver.solve(_target(AXISYMMETRIC, robot.fk(start)), start)
        assert status == "converged"
        assert iterations <= 5
        np.testing.assert_allclose(q, start, atol=1e-6)


def test_task_of_full_dimension_is_plain_inverse_kinematics() -> None:
    solver = rd.OrthogonalSQP(FANUC, rd.Task.full(), rd.ConditionNumber(LENGTH, squared=True))
    q = np.deg2rad([10.0, 20.0, -10.0, 30.0, -80.0, 40.0])
    found, _, status, iterations = solver.solve(_target(rd.Task.full(), FANUC.fk(q)), q + 0.05)
    assert status == "converged"
    np.testing.assert_allclose(found, q, atol=1e-9)
    assert iterations < 12


def _tightened(margin: float) -> tuple[rd.OrthogonalSQP, F64, F64]:
    """The first point of the helix, where joint 5 may not go to its optimum."""
    best = np.deg2rad(HELIX["first_point_q_deg"])
    upper = FANUC.q_max.copy()
    upper[4] = best[4] - margin
    robot = FANUC.with_limits(q_max=upper)
    solver = rd.OrthogonalSQP(robot, AXISYMMETRIC, rd.ConditionNumber(LENGTH, squared=True))
    return solver, best, helix().targets()[0]


@pytest.mark.parametrize("margin", [0.02, 0.1, 0.2])
def test_limit_that_binds(margin: float) -> None:
    solver, best, target = _tightened(margin)
    # A feasible start: spin the tool away from the limit.
    robot = solver.robot
    q = best.copy()
    for _ in range(400):
        null = _null_space(solver, q)[0]
        q = _back(solver, q - 0.01 * np.sign(null[4]) * null, target)
        if q[4] < robot.q_max[4] - 0.05:
            break
    assert q[4] < robot.q_max[4]
    found, value, status, _ = solver.solve(target, q)
    assert status in ("converged", "on target")
    assert np.linalg.norm(solver.error(found, target)) < 2e-9
    assert (found <= robot.q_max + 1e-12).all()
    assert (found >= robot.q_min - 1e-12).all()
    # The limit holds the least value back: it is active, and only it.
    assert found[4] == pytest.approx(robot.q_max[4], abs=1e-6)
    assert value > POINTWISE[0] ** 2
    gradient = solver.objective.evaluate(robot, found, order=1)[1]
    null = _null_space(solver, found)[0]
    assert (null @ gradient) * null[4] < 0


def test_limits_hold_along_a_path() -> None:
    # Every joint's range cut to what the unlimited trajectory needs, less a tenth of it, where it starts in the middle.
    free = rd.follow(sqp(), helix())
    lower, upper = FANUC.q_min.copy(), FANUC.q_max.copy()
    upper[4] = np.quantile(free.q[:, 4], 0.7)
    robot = FANUC.with_limits(lower, upper)
    solver = rd.OrthogonalSQP(robot, AXISYMMETRIC, rd.ConditionNumber(LENGTH, squared=True))
    trajectory = rd.follow(solver, helix())
    assert trajectory.limit_margin >= -1e-12
    assert trajectory.unreachable == []
    assert trajectory.position_error.max() < 1e-9
    assert trajectory.axis_error.max() < 1e-9
    assert (trajectory.condition_number >= POINTWISE - 1e-6).all()


@pytest.mark.parametrize("position", [[5.0, 0.0, 0.0], [0.0, 0.0, 40.0], [1e6, 1e6, 1e6]])
def test_unreachable_target_is_a_status(position: list[float]) -> None:
    solver = sqp()
    start = np.deg2rad(HELIX["first_point_q_deg"])
    target = np.array([*position, 1.0, 0.0, 0.0])
    q, _, status, _ = solver.solve(target, start)
    assert status == "unreachable"
    assert np.isfinite(q).all()
    assert ((FANUC.q_min <= q) & (q <= FANUC.q_max)).all()
    q, value, status, iterations = solver.solve(target, starts=4)
    assert status == "unreachable"
    assert np.isnan(q).all()
    assert np.isnan(value)
    assert iterations == 0
    path = rd.Toolpath([position, [1.05, 1.0, 0.0]], [[1.0, 0.0, 0.0]] * 2)
    trajectory = rd.follow(solver, path)
    assert trajectory.unreachable[0] == 0
    assert np.isfinite(trajectory.q).all()


def test_unreachable_point_is_approached() -> None:
    spatial = rd.Robot.from_dh([0.0, 1.0, 1.0], [0.0] * 3, [np.pi / 2, 0.0, 0.0], [0.0] * 3)
    solver = rd.OrthogonalSQP(spatial, rd.Task.position(), rd.ConditionNumber(1.0, rows=[3, 4, 5]))
    target = np.array([3.0, 2.0, 1.0])
    start = np.array([0.3, 0.5, 0.4])
    q, _, status, _ = solver.solve(target, start)
    assert status == "unreachable"
    least = np.linalg.norm(target) - 2.0
    distance = np.linalg.norm(target - spatial.fk(q)[:3, 3])
    print(f"distance {distance:.4f}, the least possible is {least:.4f}")
    assert least - 1e-12 <= distance <= np.linalg.norm(target - spatial.fk(start)[:3, 3])


def test_opposite_axes() -> None:
    solver = sqp()
    start = np.deg2rad(HELIX["first_point_q_deg"])
    target = np.concatenate([FANUC.fk(start)[:3, 3], -FANUC.fk(start)[:3, 2]])
    error = solver.error(start, target)
    assert np.linalg.norm(error[:3]) == pytest.approx(np.pi, abs=1e-9)
    q, _, status, _ = solver.solve(target, start)
    assert np.isfinite(q).all()
    if status != "unreachable":
        np.testing.assert_allclose(FANUC.fk(q)[:3, 2], target[3:], atol=1e-8)


def test_nearly_opposite_axes_are_turned_about_a_perpendicular() -> None:
    # Rounding alone must not choose the axis of the half turn: about the tool's own axis nothing would move.
    solver = sqp()
    rng = np.random.default_rng(6)
    for _ in range(200):
        q = rng.uniform(FANUC.q_min, FANUC.q_max)
        frame = FANUC.fk(q)
        target = np.concatenate([frame[:3, 3], -frame[:3, 2] + 1e-16 * rng.standard_normal(3)])
        error = solver.error(q, target)[:3]
        assert np.linalg.norm(error) == pytest.approx(np.pi, abs=1e-7)
        assert abs(error @ frame[:3, 2]) < 1e-6


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e160, 1e300])
def test_axes_of_extreme_length_are_directions(size: float) -> None:
    axis = np.array([3.0, 0.0, -4.0])
    np.testing.assert_allclose(rd.Task.axisymmetric(size * axis).axis, axis / 5.0, rtol=1e-14)
    q = np.deg2rad(HELIX["first_point_q_deg"])
    targets = [np.concatenate([[1.05, 1.0, 0.0], each]) for each in (axis, size * axis)]
    plain, scaled = (sqp().error(q, target) for target in targets)
    np.testing.assert_allclose(scaled, plain, atol=1e-14)


def test_error_is_the_motion_to_the_target() -> None:
    # Against the matrix logarithm of a known rotation.
    solver = rd.OrthogonalSQP(FANUC, rd.Task.full(), rd.ConditionNumber(LENGTH))
    q = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
    frame = FANUC.fk(q)
    for angle in (0.0, 1e-9, 1e-3, 1.0, 3.0, np.pi - 1e-9, np.pi):
        axis = np.array([2.0, -1.0, 2.0]) / 3.0
        cross = np.cross(np.eye(3), axis)
        turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        moved = frame.copy()
        moved[:3, :3] = turn @ frame[:3, :3]
        moved[:3, 3] += [0.1, 0.2, 0.3]
        error = solver.error(q, _target(rd.Task.full(), moved))
        np.testing.assert_allclose(error[3:], [0.1, 0.2, 0.3], atol=1e-14)
        sign = -1.0 if error[:3] @ axis < 0 and angle > 3.1 else 1.0
        np.testing.assert_allclose(sign * error[:3], angle * axis, atol=1e-7)
