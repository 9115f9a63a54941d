"""Postures within an orientation volume: minima on it, members by the inverse kinematics, paths and loops."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy.errors import InvalidValueError
from scipy.optimize import minimize

from tests.reference.arms import random_arm
from tests.reference.chain import F64
from tests.reference.volumes import KINDS, Measure, drawn, frame_about, pose, rotation_of, turned

CONDITION = rd.ConditionNumber(0.4, squared=True)
ARMS = ("ur5e", "kuka_iiwa14", "fanuc_m710ic50_milling", "puma500", "random")
Q = np.array([0.3, -1.2, 1.4, 0.2, 1.1, 0.3])


def case(seed: int, kind: str) -> tuple[rd.Robot, rd.OrientationVolume, Measure, F64, F64]:
    rng = np.random.default_rng(seed)
    name = ARMS[seed % len(ARMS)]
    robot = random_arm(rng, "general").robot() if name == "random" else rd.robots.get(name)
    volume, measure = drawn(kind, rng)
    low, high = np.maximum(robot.q_min, -2.5), np.minimum(robot.q_max, 2.5)
    q = low + (high - low) * rng.uniform(0.2, 0.8, robot.n)
    target = pose(frame_about(robot, q, volume, seed), robot.fk(q)[:3, 3])
    return robot, volume, measure, q, target


def lower(robot: rd.Robot, measure: Measure, target: F64, q: F64) -> tuple[float, float]:
    """What scipy makes of a posture: the value it ends at, and how far away."""

    def inside(x: F64) -> float:
        return -measure(target[:3, :3].T @ robot.fk(x)[:3, :3])

    found: Any = minimize(
        lambda x: CONDITION.evaluate(robot, x, 1),
        q,
        jac=True,
        method="SLSQP",
        bounds=list(zip(robot.q_min, robot.q_max, strict=True)),
        constraints=[
            {"type": "eq", "fun": lambda x: robot.fk(x)[:3, 3] - target[:3, 3]},
            {"type": "ineq", "fun": inside},
        ],
        options={"maxiter": 60, "ftol": 1e-12},
    )
    kept = np.abs(robot.fk(found.x)[:3, 3] - target[:3, 3]).max() < 1e-8 and inside(found.x) > -1e-8
    return (float(found.fun) if kept else np.inf), float(np.linalg.norm(found.x - q))


@pytest.mark.parametrize("kind", KINDS)
def test_the_sqp_ends_in_the_volume_where_scipy_goes_no_lower(kind: str) -> None:
    for seed in range(8):
        robot, volume, measure, q, target = case(seed + 10 * len(kind), kind)
        solver = rd.OrthogonalSQP(robot, rd.Task.within(volume), CONDITION)
        x, value, status, _ = solver.solve(target, q)
        there = robot.fk(x)
        assert status in ("converged", "on target")
        assert measure(target[:3, :3].T @ there[:3, :3]) <= 1e-9
        assert np.linalg.norm(there[:3, 3] - target[:3, 3]) <= 1e-9
        assert value <= CONDITION.evaluate(robot, q, 0) * (1.0 + 1e-9)
        if kind in ("cone", "pyramid", "square"):
            best, away = lower(robot, measure, target, x)
            # Another minimum, far away, may be lower.
            assert best > value * (1.0 - 1e-6) or away > 0.3, (seed, value, best, away)


def test_the_sqp_finds_the_best_of_a_grid_of_members() -> None:
    robot = rd.robots.get("puma500")
    q = np.array([0.2, -0.4, 2.2, 0.5, 0.6, 0.4])
    volume = rd.OrientationVolume.cone(0.25)
    target = robot.fk(q)
    solver = rd.OrthogonalSQP(robot, rd.Task.within(volume), CONDITION)
    _x, value, status, _ = solver.solve(target, starts=200)
    assert status != "unreachable"
    postures, member = robot.inverse(target, task=rd.Task.within(volume), samples=(6, 24, 24), limits=True)
    assert len(postures) == len(member)
    assert member.max() < len(volume.grid(6, 24, 24))
    values = CONDITION.evaluate_many(robot, postures, 0)[0]
    assert value <= np.nanmin(values) * (1.0 + 1e-9)
    assert value > 0.9 * np.nanmin(values), "and no other problem has been solved"


@pytest.mark.parametrize("solver", [rd.TwistDecomposition, rd.GradientProjection, rd.QuadraticProgram])
def test_other_methods_find_postures_in_the_volume(solver: Any) -> None:
    for seed, kind in enumerate(KINDS):
        robot, volume, measure, q, target = case(seed, kind)
        one = solver(robot, rd.Task.within(volume), CONDITION)
        x, _, status, _ = one.solve(target, q + 0.1)
        there = robot.fk(x)
        assert status == "on target"
        assert measure(target[:3, :3].T @ there[:3, :3]) <= 1e-9
        assert np.linalg.norm(there[:3, 3] - target[:3, 3]) <= 1e-9


def test_an_error_is_the_way_into_the_volume() -> None:
    robot, volume = rd.robots.get("ur5e"), rd.OrientationVolume.cone(0.2)
    solver = rd.OrthogonalSQP(robot, rd.Task.within(volume), CONDITION)
    target = robot.fk(Q)
    assert (solver.error(Q, target) == 0.0).all()
    target[:3, :3] = turned(target[:3, :3], 0.5 * robot.fk(Q)[:3, 0])
    error = solver.error(Q, target)
    assert abs(np.linalg.norm(error[:3]) - 0.3) < 1e-12
    assert (error[3:] == 0.0).all()
    there = turned(robot.fk(Q)[:3, :3], error[:3])
    assert abs(volume.distance(target[:3, :3].T @ there)) < 1e-12
    row = np.concatenate([target[:3, 3], target[:3, :3].ravel()])
    assert (solver.error(Q, row) == error).all()


def test_inverse_kinematics_of_the_nearest_member() -> None:
    robot, volume = rd.robots.get("ur5e"), rd.OrientationVolume.cone(0.2)
    task, target = rd.Task.within(volume), robot.fk(Q)
    nearest = robot.inverse(target, task=task, near=Q)
    assert np.abs(nearest[0] - Q).max() < 1e-9, "inside, the posture itself"
    assert len(robot.inverse(target, task=task)) == len(robot.inverse(target))
    target[:3, :3] = turned(target[:3, :3], np.array([0.4, 0.2, 0.1]))
    for q in robot.inverse(target, task=task, near=Q):
        there = robot.fk(q)
        assert volume.distance(target[:3, :3].T @ there[:3, :3]) < 1e-9
        # No member is nearer to the tool at the posture.
        turn = robot.fk(Q)[:3, :3].T @ there[:3, :3]
        angle = np.arccos(min(1.0, 0.5 * (np.trace(turn) - 1.0)))
        assert abs(angle - volume.distance(target[:3, :3].T @ robot.fk(Q)[:3, :3])) < 1e-7
    many, frame = robot.inverse(np.stack([robot.fk(Q), target]), task=task, near=np.stack([Q, Q]))
    assert len(many) == len(frame)
    assert set(frame.tolist()) == {0, 1}


def test_inverse_kinematics_of_a_grid_of_members() -> None:
    robot = rd.robots.get("kuka_iiwa14")
    volume, q = rd.OrientationVolume.pyramid(0.2, 0.1, (-0.3, 0.3)), np.array([0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1])
    task, target = rd.Task.within(volume), robot.fk(q)
    members = volume.grid(2, 6, 3)
    for how in ({"fixed": {2: 0.2}}, {"arm_angle": robot.arm_angle(q)}):
        postures, member, singular, complete = robot.inverse(target, task=task, samples=(2, 6, 3), report=True, **how)
        assert len(postures) == len(member) == len(singular)
        assert len(complete) == len(members)
        for x, k in zip(postures, member, strict=True):
            there = robot.fk(x)
            assert volume.contains(target[:3, :3].T @ there[:3, :3], 1e-8)
            wanted = rotation_of(members[k])
            assert np.abs(target[:3, :3] @ wanted - there[:3, :3]).max() < 1e-8
    with pytest.raises(InvalidValueError, match="three numbers, expected one"):
        robot.inverse(target, samples=(2, 6, 3))
    with pytest.raises(InvalidValueError, match="beside many poses"):
        robot.inverse(target[None], task=task, samples=(2, 6, 3))
    wrongs: list[Any] = ["x", (1, 2), -1, 2.5, (1, 2, -3)]
    for wrong in wrongs:
        with pytest.raises(InvalidValueError, match="samples"):
            robot.inverse(target, task=task, samples=wrong)


def helix(rotations: bool) -> rd.Toolpath:
    path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0))
    path = rd.Toolpath(path.position, path.axis, None, np.linspace(0.0, 1.0, len(path)))
    if not rotations:
        return path
    z = path.axis[0]
    x = np.cross(z, [0.0, 0.0, 1.0])
    return path.without_spin(np.stack([x, np.cross(z, x), z], axis=1))


@pytest.mark.parametrize("rotations", [False, True])
def test_paths_are_followed_within_a_volume(rotations: bool) -> None:
    robot, path = rd.robots.get("fanuc_m710ic50_milling"), helix(rotations)
    volume = rd.OrientationVolume.square(0.1, 0.2) if rotations else rd.OrientationVolume.cone(np.radians(10.0))
    task, index = rd.Task.within(volume), rd.ConditionNumber(0.4856, squared=True)
    plain = rd.follow(rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), index), path, progress=False)
    for solver in (
        rd.OrthogonalSQP(robot, task, index),
        rd.TwistDecomposition(robot, task, index),
        rd.QuadraticProgram(robot, task, index, weight=10.0),
    ):
        found = rd.follow(solver, path, plain.q[0], progress=False)
        assert "unreachable" not in found.status
        assert found.axis_error.max() <= 1e-9
        assert found.position_error.max() <= 1e-9
        tool = robot.fk(found.q)
        if not rotations:
            tilt = np.arccos(np.einsum("ij,ij->i", tool[:, :3, 2], path.axis))
            assert tilt.max() < np.radians(10.0) + 1e-9
        if isinstance(solver, rd.OrthogonalSQP):
            assert found.max_condition_number < plain.max_condition_number
        loop = rd.track(solver, path, found.q[0], progress=False)
        assert loop.axis_error.max() <= 1e-9
        assert loop.position_error[1:].max() < 1e-3


def test_a_path_without_rotations_has_no_frame_for_other_volumes() -> None:
    robot = rd.robots.get("fanuc_m710ic50_milling")
    for volume in (rd.OrientationVolume.square(0.1, 0.1), rd.OrientationVolume.cone(0.1, (-1.0, 1.0))):
        solver = rd.OrthogonalSQP(robot, rd.Task.within(volume), CONDITION)
        with pytest.raises(InvalidValueError, match="no rotations"):
            rd.follow(solver, helix(False), progress=False)


@pytest.mark.parametrize("weight", [1.0, 0.1])
def test_an_objective_of_weight_along_a_bound_leaves_the_position_to_be_reached(weight: float) -> None:
    robot, s = rd.robots.get("ur5e"), np.linspace(0.0, 1.0, 21)
    position = np.array([0.4, 0.1, 0.15]) + np.c_[0.05 * np.sin(6 * s), 0.3 * (s - 0.5), 0.03 * np.cos(5 * s)]
    path = rd.Toolpath(position, np.tile([0.0, 0.1, -1.0], (21, 1)))
    task = rd.Task.within(rd.OrientationVolume.cone(0.2))
    solver = rd.QuadraticProgram(robot, task, rd.ConditionNumber(0.4, squared=True), weight=weight)
    q0 = robot.solve_pose([*position[0], 0.0, 0.1, -1.0], task=rd.Task.axisymmetric()).q
    followed = rd.follow(solver, path, q0=q0)
    assert set(followed.status) == {"on target"}
    assert followed.position_error.max() < 1e-9
    assert followed.axis_error.max() < 1e-9
