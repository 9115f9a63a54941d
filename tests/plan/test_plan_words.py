"""What plans say of themselves: which limit ends a way and what would help, singularities, spins that do not matter."""

import re
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy import _core

from tests.plan.test_plan_kinds import five_joints
from tests.reference.chain import F64
from tests.reference.plans import KAPPA, ROBOT, circle, helix, line, speed_share

INDEX = rd.ConditionNumber(0.4)


def along_z(length: float) -> F64:
    """A tool that goes on along the flange's z axis."""
    tool = np.eye(4)
    tool[2, 3] = length
    return tool


def torch(bend: float = 45.0, length: float = 0.35, offset: float = 0.05) -> F64:
    """A bent tool: its axis leans from the flange's about y [deg]."""
    c, s = np.cos(np.deg2rad(bend)), np.sin(np.deg2rad(bend))
    return np.array([[c, 0.0, s, offset], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, length], [0.0, 0.0, 0.0, 1.0]])


def knife(center: tuple[float, float, float], radius: float, turns: int, points: int) -> rd.Toolpath:
    """Rounds of a circle, a blade turning with the way."""
    t = np.linspace(0.0, turns * 2.0 * np.pi, points)
    z = np.tile([0.0, 0.0, -1.0], (points, 1))
    x = np.stack([-np.sin(t), np.cos(t), 0.0 * t], axis=1)
    position = np.array(center) + radius * np.stack([np.cos(t), np.sin(t), 0.0 * t], axis=1)
    return rd.Toolpath(position, z, np.stack([x, np.cross(z, x), z], axis=2))


def pipe_weld(center: tuple[float, float, float], main: float, branch: float, points: int) -> rd.Toolpath:
    """Where a pipe meets a thicker one, the tool leaning outwards; its frames follow the x axis of the base."""
    f = np.linspace(0.0, 2.0 * np.pi, points)
    f[-1] = 0.0
    out = np.stack([np.cos(f), np.sin(f), 0.0 * f], axis=1)
    height = np.sqrt(main**2 - (branch * np.sin(f)) ** 2)
    position = np.array(center) + np.stack([branch * np.cos(f), branch * np.sin(f), height], axis=1)
    axis = -(out + np.array([0.0, 0.0, 1.0])) / np.sqrt(2.0)
    x = axis * axis[:, 2:] - [0.0, 0.0, 1.0]
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return rd.Toolpath(position, axis, np.stack([x, np.cross(axis, x), axis], axis=2))


def check(plan: rd.Plan, limits: bool = True) -> None:
    """Own kinematics and own limits: what is said to be reached is, within the limits."""
    good = np.array([status != "unreachable" for status in plan.status])
    assert np.isfinite(plan.q).all()
    assert not np.isnan(plan.value[good]).any()
    assert np.isnan(plan.value[~good]).all()
    tools = plan.robot.fk(plan.q)[good]
    assert np.abs(tools[:, :3, 3] - plan.path.position[good]).max(initial=0.0) < 2e-9
    assert np.abs(tools[:, :3, 2] - plan.path.axis[good]).max(initial=0.0) < 2e-9
    if limits:
        beyond = np.maximum(plan.robot.q_min - plan.q, plan.q - plan.robot.q_max)[good]
        assert beyond.max(initial=-1.0) <= 1e-12
    if plan.failure is None:
        assert good.all()
        if plan.time is not None and len(plan) > 1 and limits:
            assert speed_share(plan).max() <= 1.0 + 1e-9


def told(plan: rd.Plan) -> str:
    assert plan.failure is not None
    words = plan.failure.told(plan.robot)
    assert words in repr(plan)
    return words


# What a failed plan holds


def test_a_failed_plan_holds_nothing_beyond_limits() -> None:
    robot = rd.robots.get("kuka_iiwa14")
    start = robot.fk([-2.9, 0.5, -2.9, 1.9, 0.7, 0.9, -2.7])
    position = [start[:3, 3], start[:3, 3] + [0.0, -0.4, 0.2]]
    path = rd.Toolpath(position, [start[:3, 2]] * 2, time=[0.0, 1.0])
    plan = rd.plan(robot, path, criterion="motion", progress=False)
    check(plan)
    if plan.failure is not None and plan.failure.cause == "speed limit":
        assert plan.failure.joint is not None
        share = speed_share(plan)[plan.failure.point - 1]
        assert share[plan.failure.joint] == pytest.approx(plan.failure.excess, rel=1e-6)
        assert share.max() == share[plan.failure.joint]


@pytest.mark.parametrize("seed", range(24))
def test_starts_near_limits(seed: int) -> None:
    """Short paths from postures on the edge of their ranges, with and without times, by every criterion."""
    rng = np.random.default_rng(seed)
    robot = rd.robots.get(("abb_irb120", "puma500", "ur5e", "fanuc_m710ic50", "kuka_iiwa14", "panda")[seed % 6])
    low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
    share = rng.random(robot.n)
    share = np.where(rng.random(robot.n) < 0.6, np.where(share < 0.5, 0.03 * share, 1.0 - 0.03 * (1.0 - share)), share)
    pose = robot.fk(low + share * (high - low))
    points = int(rng.choice([2, 5, 12]))
    way = rng.normal(size=3) * rng.choice([0.03, 0.1, 0.3])
    time = np.linspace(0.0, rng.choice([0.2, 1.0]), points) if rng.random() < 0.5 else None
    position = pose[:3, 3] + np.linspace(0.0, 1.0, points)[:, None] * way
    path = rd.Toolpath(position, np.tile(pose[:3, 2], (points, 1)), time=time)
    criterion = ("minimax", "integral", "motion")[seed // 6 % 3]
    plan = rd.plan(robot, path, None, INDEX, criterion, n_angles=16, n_spare=8, effort=1, progress=False)
    check(plan)
    assert plan.failure is not None or not plan.unreachable


@pytest.mark.parametrize(("angles", "places"), [(4, 1), (1, 1), (2, 3), (12, 4)])
def test_joints_to_spare_on_a_grid_with_no_posture(angles: int, places: int) -> None:
    arm = rd.robots.get("kuka_iiwa14")
    low, high = arm.q_min.copy(), arm.q_max.copy()
    low[6], high[6] = -0.3, 0.3
    narrow = arm.with_limits(q_min=low, q_max=high)
    path = line((0.6, 0.15, 0.3), (0.6, 0.25, 0.3), 6)
    for criterion in ("minimax", "motion"):
        plan = rd.plan(
            narrow, path, None, rd.ConditionNumber(0.3), criterion, n_angles=angles, n_spare=places, progress=False
        )
        check(plan)
        assert plan.failure is None or plan.failure.cause not in ("unreachable", "joint limit")
        assert repr(plan)


def test_a_point_that_newton_reaches_is_not_called_unreachable() -> None:
    robot = rd.robots.get("panda")
    q = np.array([2.5862, 0.9178, -2.1299, -0.6219, 1.9878, 1.3162, 0.065])
    pose = np.array([robot.fk(q), robot.fk(q + 1e-3)])
    path = rd.Toolpath(pose[:, :3, 3], pose[:, :3, 2], pose[:, :3, :3])
    for more in ({}, {"n_spare": 2}, {"spare": (2,), "n_spare": 1}):
        plan = rd.plan(robot, path, rd.Task.full(), criterion="motion", progress=False, **more)
        check(plan)
        assert plan.failure is None or plan.failure.cause not in ("unreachable", "joint limit")


# Which limit ends a way


def test_out_of_whole_turns() -> None:
    robot = rd.robots.get("ur10e").with_tool(along_z(0.15))
    plan = rd.plan(robot, knife((-0.7, 0.1, 0.1), 0.1, 3, 180), rd.Task.full(), INDEX, progress=False)
    check(plan)
    words = told(plan)
    assert plan.failure is not None
    assert (plan.failure.cause, plan.failure.joint) == ("joint limit", 5)
    assert "out of whole turns" in words
    # Three rounds with the blade along the way are three turns of the last joint; its limits leave two.
    assert plan.failure.excess == pytest.approx(2.0 * np.pi, abs=1e-6)
    assert "1 turn of joint 6 more" in words
    assert 110 < plan.failure.point < 125


def test_the_range_of_the_spin() -> None:
    robot = rd.robots.get("ur10e").with_tool(torch(45.0, 0.35, 0.05))
    path = pipe_weld((-0.7, -0.1, 0.3), 0.15, 0.06, 91)
    plan = rd.plan(robot, path, objective=INDEX, spin_range=(-np.pi / 2.0, np.pi / 2.0), progress=False)
    check(plan)
    assert plan.failure is not None
    assert plan.failure.cause == "spin range"
    assert "without it there is a way" in told(plan)
    assert rd.plan(robot, path, objective=INDEX, effort=1, progress=False).failure is None


def test_more_time_helps_where_speed_is_short() -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 61, duration=0.2)
    plan = rd.plan(ROBOT, path, objective=KAPPA, progress=False)
    assert plan.failure is not None
    assert plan.failure.cause == "speed limit"
    assert "more time there would help" in told(plan)


def test_a_largest_step_that_binds_is_named_on_timed_paths_too() -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 31, duration=30.0)
    plan = rd.plan(ROBOT, path, objective=KAPPA, max_step=0.01, progress=False)
    assert plan.failure is not None
    assert plan.failure.cause == "step limit"
    assert "a path with more points or a larger max_step" in told(plan)


# What is wrong with a path out of reach


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (line((1000.0, -300.0, 400.0), (1000.0, 300.0, 400.0), 50), r"1\.08 km away.*millimetres\?"),
        (line((1e-3, -3e-4, 4e-4), (1e-3, 3e-4, 4e-4), 9), "metres taken for millimetres"),
        (line((40.0, -12.0, 16.0), (40.0, 12.0, 16.0), 9), "inches"),
        (line((9.0, -0.3, 0.4), (9.0, 0.3, 0.4), 9), "9.* m away, and the robot reaches .* another base"),
        (rd.Toolpath([(1.0, 0.1 * i, 0.4) for i in range(5)], np.tile([0.0, 0.0, 1.0], (5, 1))), "axis reversed"),
    ],
)
def test_a_path_in_other_units_or_with_its_axis_reversed(path: rd.Toolpath, words: str) -> None:
    robot = rd.robots.get("abb_irb2400").with_tool(torch(0.0, 0.2, 0.0) if "axis" in words else torch())
    plan = rd.plan(robot, path, objective=INDEX, progress=False)
    assert plan.failure is not None
    assert plan.failure.point == 0
    assert plan.failure.cause in ("unreachable", "joint limit")
    assert plan.failure.hint is not None
    assert re.search(words, told(plan))


def test_one_point_far_away() -> None:
    path = line((1.0, -0.3, 0.4), (1.0, 0.3, 0.4), 20)
    position = path.position.copy()
    position[7] = [4.0, 4.0, 0.4]
    robot = rd.robots.get("abb_irb2400").with_tool(torch())
    plan = rd.plan(robot, rd.Toolpath(position, path.axis), objective=INDEX, progress=False)
    assert plan.failure is not None
    assert (plan.failure.point, plan.failure.cause) == (7, "unreachable")
    assert "1 of 20 points are that far" in told(plan)


@pytest.mark.parametrize("place", [(3.0, 1.0, 0.0), (0.0, 0.0, 1.5)])
def test_a_path_in_the_frame_of_the_base(place: tuple[float, float, float]) -> None:
    base = np.eye(4)
    base[:3, 3] = place
    robot = rd.robots.get("ur10e")
    assert robot.dh is not None
    a, d, alpha, theta = (robot.dh[name] for name in ("a", "d", "alpha", "theta"))
    away = rd.Robot.from_dh(a, d, alpha, theta, q_min=robot.q_min, q_max=robot.q_max, base=base)
    plan = rd.plan(away, line((0.5, -0.2, 0.3), (0.5, 0.2, 0.3), 9), objective=INDEX, progress=False)
    assert "in the frame of the robot's base" in told(plan)


def test_degrees_as_a_range_of_the_spin() -> None:
    with pytest.raises(rd.InvalidValueError, match=r"\(-90.0, 90.0\).*degrees\?"):
        rd.plan(ROBOT, helix(5), objective=KAPPA, spin_range=(-90.0, 90.0))


# Singularities, spins and steps


def test_a_way_through_a_singularity() -> None:
    robot = rd.robots.get("abb_irb2400").with_tool(along_z(0.2))
    pose = robot.fk([0.0, 0.3, 0.2, 0.0, 0.0, 0.0])
    position = pose[:3, 3] + np.outer(np.linspace(-0.25, 0.25, 101), [0.0, 1.0, 0.0])
    path = rd.Toolpath(position, np.tile(pose[:3, 2], (101, 1)))
    plan = rd.plan(robot, path, objective=INDEX, branch_changes=True, progress=False)
    assert plan.failure is None
    check(plan)
    assert plan.value[50] == plan.condition_number[50] == np.inf
    assert np.isfinite(np.delete(plan.value, 50)).all()
    assert not np.isnan(plan.gap)
    assert plan.largest_step == np.abs(np.diff(plan.q, axis=0)).max() < np.deg2rad(0.3)
    assert any("through a singularity at point 50" in note for note in plan.notes)
    assert "largest step 0.277 deg" in repr(plan)
    assert "worst value inf" in repr(plan)
    # The motion alone sees no value, but the condition number is told.
    still = rd.plan(robot, path, criterion="motion", branch_changes=True, progress=False)
    assert still.max_condition_number == np.inf
    assert any("singularity at point 50" in note for note in still.notes)
    assert still.motion == pytest.approx(0.4746, abs=1e-4)


@pytest.mark.parametrize("beside", [0.0, 1e-3, 5e-3])
def test_a_flip_of_the_wrist_is_a_failure_that_names_it(beside: float) -> None:
    """The same line, through the singularity and beside it, on one branch: joint 4 turns by 34 to 90 deg a point."""
    robot = rd.robots.get("abb_irb2400").with_tool(along_z(0.2))
    pose = robot.fk([0.0, 0.3, 0.2, 0.0, 0.0, 0.0])
    position = pose[:3, 3] + np.outer(np.linspace(-0.25, 0.25, 101), [0.0, 1.0, 0.0])
    axis = np.tile(pose[:3, 2], (101, 1))
    axis += beside / 0.8 * pose[:3, 0]
    plan = rd.plan(robot, rd.Toolpath(position, axis), objective=INDEX, max_step=0.1, progress=False)
    check(plan)
    if plan.failure is None:
        assert plan.largest_step <= 0.1 + 1e-9
    else:
        assert plan.failure.cause == "step limit"
        assert 45 <= plan.failure.point <= 55
        assert "a singularity is near: branch_changes=True may lead through it" in told(plan)
        step = np.abs(np.diff(plan.q, axis=0))[plan.failure.point - 1]
        assert step.max() == pytest.approx(0.1 * plan.failure.excess, rel=1e-6)


def test_no_note_where_there_is_nothing_to_say() -> None:
    assert rd.plan(ROBOT, helix(21), objective=KAPPA, effort=1, progress=False).notes == ()


def test_a_spin_that_does_not_matter() -> None:
    robot = rd.robots.get("ur10e")
    path = line((-0.7, -0.1, 0.3), (-0.7, 0.1, 0.3), 9)
    plain = rd.plan(robot.with_tool(along_z(0.1)), path, objective=INDEX, effort=1, progress=False)
    assert any("does not depend on the spin of the tool, which joint 6 alone makes" in note for note in plain.notes)
    assert plain.notes[0] in repr(plain)
    bent = rd.plan(robot.with_tool(torch()), path, objective=INDEX, effort=1, progress=False)
    assert not any("spin" in note for note in bent.notes)
    arm = five_joints()
    pose = arm.fk(np.array([[0.1, 0.5, 0.4, 0.3, 0.2], [0.11, 0.51, 0.41, 0.31, 0.2]]))
    five = rd.plan(arm, rd.Toolpath(pose[:, :3, 3], pose[:, :3, 2]), criterion="motion", progress=False)
    assert any("no joint is left to turn it" in note for note in five.notes)


def test_the_largest_step_is_of_points_that_are_reached() -> None:
    plan = rd.plan(ROBOT, helix(21), objective=KAPPA, effort=1, progress=False)
    steps = np.abs(np.diff(plan.q, axis=0))
    assert plan.largest_step == steps.max()
    assert steps[plan.largest_step_at, plan.largest_step_joint] == steps.max()
    assert plan.largest_step_told.startswith(f"{np.rad2deg(steps.max()):.3g} deg of joint")
    point = rd.plan(ROBOT, line((1.3, 0.5, 0.1), (1.3, 0.5, 0.1), 1), objective=KAPPA, effort=1, progress=False)
    assert (point.largest_step, point.largest_step_at) == (0.0, 0)


# Progress


@pytest.mark.parametrize(
    "settings",
    [{}, {"criterion": "motion"}, {"criterion": "integral", "bound": True}, {"effort": 3}, {"spin_range": (0.0, 0.05)}],
)
@pytest.mark.parametrize("far", [0.0, 9.0])
def test_progress_moves_and_ends_with_the_work(settings: dict[str, Any], far: float) -> None:
    path = helix(31)
    told: list[float] = []
    data = _core.PathData(path.position + np.array([far, 0.0, 0.0]), path.axis)
    task = rd.Task.axisymmetric()
    asked = _core.PlanSettings(settings.pop("criterion", "minimax"), **settings)
    _core.plan_path(ROBOT, data, task, KAPPA, asked, progress=told.append)
    assert len(told) >= 2
    assert min(told) > 0.0
    assert sum(told) == pytest.approx(1.0, abs=1e-12)
