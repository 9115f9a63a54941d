"""Ticks whose tool stays in an orientation volume: never out of it, whatever the method, tick, twist and arm."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy.errors import InvalidValueError, NonFiniteError, ShapeError

from tests.reference.arms import random_arm
from tests.reference.chain import F64
from tests.reference.volumes import KINDS, WIDE, Loop, drawn, frame_about, loop, pose, turned

BAR = 1e-9
"""How far outside a tick may end [rad]."""
CONDITION = rd.ConditionNumber(0.4, squared=True)
SOLVERS: dict[str, Callable[..., Any]] = {
    "QuadraticProgram": lambda robot, task, **how: rd.QuadraticProgram(robot, task, CONDITION, weight=30.0, **how),
    "without objective": lambda robot, task, **how: rd.QuadraticProgram(robot, task, **how),
    "OrthogonalSQP": lambda robot, task, **how: rd.OrthogonalSQP(robot, task, CONDITION, **how),
    "TwistDecomposition": lambda robot, task, **how: rd.TwistDecomposition(robot, task, CONDITION, **how),
    "newton": lambda robot, task, **how: rd.TwistDecomposition(robot, task, CONDITION, scaling="newton", **how),
    "GradientProjection": lambda robot, task, **how: rd.GradientProjection(robot, task, CONDITION, **how),
    "WeightedInverse": lambda robot, task, **how: rd.WeightedInverse(robot, task, CONDITION, **how),
    "Householder": lambda robot, task, **how: rd.Householder(robot, task, CONDITION, **how),
}
POSTURES = {"ur5e": [0.3, -1.2, 1.4, 0.2, 1.1, 0.3], "kuka_iiwa14": [0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1]}
ARMS = ("ur5e", "kuka_iiwa14", "fanuc_m710ic50_milling", "puma500", "random")


def arm(name: str, rng: np.random.Generator) -> rd.Robot:
    robot = random_arm(rng, "general").robot() if name == "random" else rd.robots.get(name)
    return robot.with_limits(robot.q_min, robot.q_max, robot.qd_max, np.full(robot.n, np.inf))


def within(robot: rd.Robot, rng: np.random.Generator, share: float = 0.1) -> F64:
    """A posture well within the limits."""
    low, high = np.maximum(robot.q_min, -2.5), np.minimum(robot.q_max, 2.5)
    q: F64 = low + (high - low) * rng.uniform(share, 1.0 - share, robot.n)
    return q


def run(solver: str, name: str, kind: str, seed: int, speed: float, turn: float, limits: bool, ticks: int = 40) -> Loop:
    """Drive the tool to and fro while the path's frame turns to and fro."""
    rng = np.random.default_rng(seed)
    robot, dt = arm(name, rng), (1e-3, 4e-3, 1e-2)[seed % 3]
    volume, measure = drawn(kind, rng)
    q, (v, w) = within(robot, rng), rng.normal(size=(2, 3))
    one = SOLVERS[solver](robot, rd.Task.within(volume), dt=dt, limits=limits)
    frame = frame_about(robot, q, volume, seed)
    velocity = speed * v / np.linalg.norm(v)
    omega = turn * w / np.linalg.norm(w)
    return loop(
        one, q, frame, measure, lambda k: velocity * np.cos(20 * k * dt), lambda k: omega * np.sin(10 * k * dt), ticks
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("solver", SOLVERS)
def test_a_tool_never_leaves_its_volume(solver: str, kind: str) -> None:
    for seed, name in enumerate(ARMS):
        for speed, turn, limits in ((0.2, 0.3, False), (2.0, 2.0, False), (0.5, 0.0, True)):
            out = run(solver, name, kind, 7 * seed + len(kind), speed, turn, limits)
            assert np.isfinite(out.q).all()
            assert out.outside <= BAR, (name, speed, out)
            assert "infeasible" not in out.status


def test_limits_of_acceleration_leave_room_to_come_to_rest_in_front_of_a_bound() -> None:
    robot = rd.robots.get("panda")
    q = np.array([0.1, -0.4, 0.3, -2.0, 0.2, 1.7, 0.5])
    frame, tilt = robot.fk(q)[:3, :3], 0.15
    volume = rd.OrientationVolume.cone(tilt)
    for dt in (1e-3, 1e-2):
        # An index that wants to tilt: the bound is met with speed.
        program = rd.QuadraticProgram(
            robot, rd.Task.within(volume), rd.ConditionNumber(0.4, squared=True), weight=3e3, dt=dt
        )
        there, before, farthest = q, np.zeros(7), 0.0
        for _ in range(int(2.0 / dt)):
            rates = program.step(there, np.zeros(6), rates=before, frame=frame)
            assert (np.abs(rates - before) <= robot.qdd_max * dt * (1.0 + 1e-9)).all()
            there, before = there + dt * rates, rates
            distance = volume.signed_distance(frame.T @ robot.fk(there)[:3, :3])
            assert distance <= BAR
            assert program.status != "infeasible"
            farthest = max(farthest, float(distance) + tilt)
        assert farthest > tilt - 1e-3, "it gets to the bound"


@pytest.mark.parametrize("solver", ["QuadraticProgram", "OrthogonalSQP", "GradientProjection"])
def test_the_objective_tilts_the_tool_up_to_the_bound_and_no_farther(solver: str) -> None:
    robot = rd.robots.get("fanuc_m710ic50_milling")
    robot = robot.with_limits(robot.q_min, robot.q_max, robot.qd_max, np.full(6, np.inf))
    q, length = np.array([0.2, 0.4, -0.3, 0.5, -0.9, 0.4]), 0.4856
    index = rd.ConditionNumber(length, squared=True)
    frame, position, tilt = robot.fk(q)[:3, :3], robot.fk(q)[:3, 3], np.radians(5.0)
    make: dict[str, Callable[[rd.Task], Any]] = {
        "QuadraticProgram": lambda task: rd.QuadraticProgram(robot, task, index, weight=100.0, dt=1e-2),
        "OrthogonalSQP": lambda task: rd.OrthogonalSQP(robot, task, index, dt=1e-2),
        "GradientProjection": lambda task: rd.GradientProjection(robot, task, index, dt=1e-2, gain=1.0),
    }
    volume = rd.OrientationVolume.cone(tilt)
    ends = []
    for task in (rd.Task.within(volume), rd.Task.axisymmetric()):
        one, there, target = make[solver](task), q, pose(frame, position)
        for _ in range(600):
            there = there + 1e-2 * one.step_along(there, target, target)
        ends.append((there, index.evaluate(robot, there, 0)))
    (inside, value), (_, plain) = ends
    assert value < plain - 0.02
    relative = frame.T @ robot.fk(inside)[:3, :3]
    assert abs(volume.signed_distance(relative)) < 1e-9, "active at the bound"
    if solver == "GradientProjection":
        return  # on its way down a slope
    # Stationary in what the position and the bound leave free.
    z = robot.fk(inside)[:3, 2]
    jacobian = robot.jacobian(inside)
    held = np.vstack([jacobian[3:], np.cross(z, frame[:, 2]) @ jacobian[:3]])
    gradient = index.evaluate(robot, inside, 1)[1]
    force = np.linalg.lstsq(held.T, gradient, rcond=None)[0]
    slack = np.linalg.norm(gradient - held.T @ force) / np.linalg.norm(gradient)
    assert slack < 2e-3
    assert force[3] > 0.0, "the bound pushes inwards"


@pytest.mark.parametrize("solver", ["TwistDecomposition", "GradientProjection", "WeightedInverse", "Householder"])
@pytest.mark.parametrize("arm_name", ["ur5e", "kuka_iiwa14"])
def test_rates_at_a_bound_are_the_nearest_to_those_without(solver: str, arm_name: str) -> None:
    robot, tilt, dt = rd.robots.get(arm_name), np.radians(5.0), 1e-3
    volume = rd.OrientationVolume.cone(tilt)
    inside = SOLVERS[solver](robot, rd.Task.within(volume), dt=dt)
    free = SOLVERS[solver](robot, rd.Task.position(), dt=dt)
    q, held = np.array(POSTURES[arm_name]), 0
    frame = robot.fk(q)[:3, :3]
    for k in range(1500):
        twist = np.array([0.0, 0.0, 0.0, 0.05, 0.03, 0.02]) * np.cos(6.0 * k * dt)
        rates, without = inside.step(q, twist, frame=frame), free.step(q, twist)
        change, there = rates - without, robot.fk(q + dt * rates)[:3, 2]
        if np.abs(change).max() > 1e-3 and inside.status == free.status == "regular":
            # Along the gradient of the slack where the tick ends, less what moves the tool point.
            position, turn = robot.jacobian(q)[3:], robot.jacobian(q + dt * rates)[:3]
            row = np.cross(there, frame[:, 2]) @ turn
            along = row - np.linalg.pinv(position) @ (position @ row)
            assert np.abs(position @ change).max() < 1e-9 * np.abs(change).max() + 1e-12
            assert abs(np.arccos(there @ frame[:, 2]) - tilt) < 1e-9, "at the bound"
            assert along @ change > (1.0 - 1e-4) * np.linalg.norm(along) * np.linalg.norm(change)
            held += 1
        q = q + dt * rates
    assert held > 100


@pytest.mark.parametrize("kind", WIDE)
@pytest.mark.parametrize("solver", ["QuadraticProgram", "OrthogonalSQP", "TwistDecomposition"])
def test_a_tool_outside_comes_back_with_a_bounded_speed(solver: str, kind: str) -> None:
    rng = np.random.default_rng(len(kind))
    for name in POSTURES:
        robot, dt = arm(name, rng), 4e-3
        volume, measure = drawn(kind, rng)
        q = np.array(POSTURES[name])
        frame = turned(frame_about(robot, q, volume, 3), np.array([0.5, -0.6, 0.4]))
        position = robot.fk(q)[:3, 3]
        before = float(volume.distance(frame.T @ robot.fk(q)[:3, :3]))
        one = SOLVERS[solver](robot, rd.Task.within(volume), dt=dt)
        ticks, first = 0, before
        while before > BAR:
            q = q + dt * one.step_along(q, pose(frame, position), pose(frame, position))
            after = float(volume.distance(frame.T @ robot.fk(q)[:3, :3]))
            assert one.status == "returning"
            assert after < before
            assert before - after < 4.0 * dt, "half a radian per second a bound"
            ticks, before = ticks + 1, after
        assert first < 1e-6 or ticks > 10
        one.step(q, np.zeros(6), frame=frame)
        assert one.status != "returning"
        assert measure(frame.T @ robot.fk(q)[:3, :3]) <= BAR
        assert np.linalg.norm(robot.fk(q)[:3, 3] - position) < 1e-3


def test_a_volume_about_a_frame_that_jumps_is_reached_at_a_bounded_speed() -> None:
    robot, q = rd.robots.get("ur5e"), np.array([0.3, -1.2, 1.4, 0.2, 1.1, 0.3])
    volume = rd.OrientationVolume.cone(0.1)
    one = rd.TwistDecomposition(robot, rd.Task.within(volume), dt=1e-3)
    frame = turned(robot.fk(q)[:3, :3], np.array([0.4, 0.0, 0.0]))
    rates = one.step(q, np.zeros(6), frame=frame)
    assert one.status == "returning"
    assert np.abs(robot.jacobian(q)[:3] @ rates).max() < 2.0


def test_a_frame_is_a_rotation_or_a_pose_and_positions_of_it_do_not_matter() -> None:
    robot, q = rd.robots.get("ur5e"), np.array([0.3, -1.2, 1.4, 0.2, 1.1, 0.3])
    frame = robot.fk(q)
    for solver in SOLVERS:
        one = SOLVERS[solver](robot, rd.Task.within(rd.OrientationVolume.cone(0.1)))
        twist = np.array([0.3, 0.2, 0.1, 0.05, 0.02, -0.04])
        first = one.step(q, twist, frame=frame)
        one.reset()
        assert (one.step(q, twist, frame=frame[:3, :3].tolist()) == first).all()


def test_bad_input() -> None:
    robot, q = rd.robots.get("ur5e"), np.array([0.3, -1.2, 1.4, 0.2, 1.1, 0.3])
    task = rd.Task.within(rd.OrientationVolume.cone(0.1))
    frame = robot.fk(q)[:3, :3]
    for solver in SOLVERS:
        one = SOLVERS[solver](robot, task)
        with pytest.raises(InvalidValueError, match="frame is None, expected the path's frame"):
            one.step(q, np.zeros(6))
        with pytest.raises(NonFiniteError, match="frame"):
            one.step(q, np.zeros(6), frame=np.full((3, 3), np.nan))
        with pytest.raises(ShapeError, match="frame: got shape \\(2, 2\\)"):
            one.step(q, np.zeros(6), frame=np.eye(2))
        with pytest.raises(InvalidValueError, match="orthogonal"):
            one.step(q, np.zeros(6), frame=2.0 * frame)
        with pytest.raises(ShapeError):
            one.step_along(q, np.zeros(3), np.zeros(3))
        plain = SOLVERS[solver](robot, rd.Task.position())
        with pytest.raises(InvalidValueError, match="frame is given, expected none"):
            plain.step(q, np.zeros(6), frame=frame)
    for method in (rd.ResolvedRate, rd.TaskPriority, rd.Elimination, rd.VirtualJoint):
        with pytest.raises(InvalidValueError, match="free components of the twist"):
            method(robot, task)


def test_what_excludes_a_volume_is_told() -> None:
    robot, q = rd.robots.get("ur5e"), np.array([0.3, -1.2, 1.4, 0.2, 1.1, 0.3])
    frame = robot.fk(q)[:3, :3]
    one = rd.QuadraticProgram(robot, rd.Task.within(rd.OrientationVolume.cone(0.01)))
    # All joints have to stand, and the frame turns away.
    stands: dict[str, Any] = {"rows": np.eye(6), "lower": np.zeros(6), "upper": np.zeros(6)}
    one.step(q, np.zeros(6), frame=frame, **stands)
    assert one.status == "solved"
    assert one.failed == []
    one.step(q, np.zeros(6), frame=turned(frame, np.array([0.02, 0.01, 0.0])), **stands)
    assert one.status == "infeasible"
    assert "volume" in one.failed


def test_a_tool_that_accelerations_kept_from_following_a_frame_comes_back() -> None:
    robot = rd.robots.get("panda")
    q = np.array([0.1, -0.4, 0.3, -2.0, 0.2, 1.7, 0.5])
    target, volume, dt = robot.fk(q), rd.OrientationVolume.cone(0.02), 1e-3
    program = rd.QuadraticProgram(robot, rd.Task.within(volume), dt=dt)
    rates, statuses = np.zeros(7), []
    for k in range(1500):
        turn = np.array([1.5, 0.5, 0.0]) * (k < 200)
        target[:3, :3] = turned(target[:3, :3], dt * turn)
        before = rates
        rates = program.step(q, 0.01 * program.twist_to(q, target), rates=before, frame=target)
        assert (np.abs(rates - before) <= robot.qdd_max * dt * (1.0 + 1e-9)).all()
        q = q + dt * rates
        statuses.append(program.status)
    assert volume.distance(target[:3, :3].T @ robot.fk(q)[:3, :3]) <= BAR
    assert "infeasible" not in statuses[-500:]
    assert np.linalg.norm(robot.fk(q)[:3, 3] - target[:3, 3]) < 1e-3


@pytest.mark.parametrize("dt", [1e-3, 1e-2])
@pytest.mark.parametrize("tilt", [1e-4, 3e-4, 1e-3])
@pytest.mark.parametrize("method", [rd.QuadraticProgram, rd.TwistDecomposition])
def test_cones_that_are_thin_beside_the_turn_of_their_frame_keep_the_position(
    method: Callable[..., Any], tilt: float, dt: float
) -> None:
    robot, s = rd.robots.get("ur5e"), np.linspace(0.0, 1.0, 21)
    position = np.array([0.4, 0.1, 0.15]) + np.c_[0.05 * np.sin(6 * s), 0.3 * (s - 0.5), 0.03 * np.cos(5 * s)]
    down = np.diag([1.0, -1.0, -1.0])
    leaning = turned(down, np.array([-0.1, 0.0, 0.0]))
    rotation = np.array([turned(leaning, np.array([0.0, 0.0, -0.5 * np.sin(3 * x)])) for x in s])
    path = rd.Toolpath(position, rotation[:, :, 2], rotation=rotation, time=2.0 * s)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation[0], position[0]
    solver = method(robot, rd.Task.within(rd.OrientationVolume.cone(tilt)), CONDITION, dt=dt)
    tracked = rd.track(solver, path, q0=robot.solve_pose(pose).q)
    assert tracked.axis_error.max() < BAR
    assert tracked.position_error.max() < 2e-5 * (dt / 1e-2) + 1e-6
