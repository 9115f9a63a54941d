"""The largest constant speed of the tool, beside a search of its own over a fine grid of spins."""

import numpy as np
import pytest
import redundancy as rd
from redundancy._core import Lattice, angle_grid

from tests.reference.chain import F64

AXIS = rd.Task.axisymmetric()
STEP = 0.25
"""Largest motion of a joint from point to point where nothing is said [rad]."""


def slowness(robot: rd.Robot, path: rd.Toolpath, q: F64) -> float:
    """Return the time that the tool takes for a metre [s/m]."""
    length = np.linalg.norm(np.diff(path.position, axis=0), axis=1)
    return float((np.abs(np.diff(q, axis=0)) / robot.qd_max / length[:, None]).max())


def least_on_grid(robot: rd.Robot, path: rd.Toolpath, angles: int, window: int) -> float:
    """Return the least slowness over routes through a grid of spins, branch by branch."""
    frames = rd.planning.core_path(path).frames(AXIS)
    lattice = Lattice(robot, frames, AXIS, angle_grid(True, angles, None), [], np.zeros((1, 0)))
    q, _, cause = lattice.postures(0, len(path))
    q, open_ = q.reshape(len(path), angles, 8, robot.n), cause.reshape(len(path), angles, 8) == 0
    length = np.linalg.norm(np.diff(path.position, axis=0), axis=1)
    best = np.inf
    for branch in range(8):
        cost = np.where(open_[0, :, branch], 0.0, np.inf)
        for i in range(1, len(path)):
            after = np.full(angles, np.inf)
            for shift in range(-window, window + 1):
                step = q[i, :, branch] - np.roll(q[i - 1, :, branch], shift, axis=0)
                step = np.abs(step - 2.0 * np.pi * np.round(step / (2.0 * np.pi)))
                time = (step / robot.qd_max).max(axis=1) / length[i - 1]
                time[~open_[i, :, branch] | ~(step <= STEP).all(axis=1)] = np.inf
                after = np.minimum(after, np.maximum(np.roll(cost, shift), time))
            cost = after
        best = min(best, float(cost.min()))
    return best


def offset_ur5e() -> rd.Robot:
    tool = np.eye(4)
    tool[:3, 3] = 0.07, 0.0, 0.15
    return rd.robots.get("ur5e").with_tool(tool)


def joint_line(robot: rd.Robot, start: F64, end: F64, points: int = 13) -> rd.Toolpath:
    frames = robot.fk(np.linspace(start, end, points))
    return rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2])


HELIX = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0), points=13)
CASES = {
    "helix": (rd.robots.get("fanuc_m710ic50_milling"), HELIX),
    "ur5e": (
        offset_ur5e(),
        joint_line(offset_ur5e(), np.array([0, -1.2, 1.5, -1, 0.7, 0.2]), np.array([0.3, -1, 1.2, -0.6, 1.1, 1.2])),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_no_slower_than_a_fine_grid(name: str) -> None:
    robot, path = CASES[name]
    plan = rd.plan(robot, path, AXIS, criterion="speed", progress=False)
    assert plan.failure is None
    assert plan.refined
    worst = slowness(robot, path, plan.q)
    assert plan.speed == pytest.approx(1.0 / worst, rel=1e-12)
    assert np.max(plan.value) == pytest.approx(worst, rel=1e-9)
    assert worst <= least_on_grid(robot, path, 360, 15) * (1.0 + 1e-9)
    assert max(plan.position_error.max(), plan.axis_error.max()) <= 1e-9
    assert np.isnan(plan.bound)


@pytest.mark.parametrize("name", CASES)
def test_faster_than_other_criteria_and_than_a_constant_orientation(name: str) -> None:
    robot, path = CASES[name]
    plan = rd.plan(robot, path, AXIS, criterion="speed", progress=False)
    motion = rd.plan(robot, path, AXIS, criterion="motion", progress=False)
    assert plan.speed >= motion.speed * (1.0 - 1e-7)
    frames = rd.planning.core_path(path).frames(AXIS)
    fixed = rd.Toolpath(path.position, path.axis, frames[:, :3, :3])
    constant = rd.plan(robot, fixed, rd.Task.full(), criterion="speed", progress=False)
    if constant.failure is None:
        assert plan.speed >= constant.speed * (1.0 - 1e-7)


def test_what_the_plan_does_not_hang_on() -> None:
    robot, path = CASES["helix"]
    plan = rd.plan(robot, path, AXIS, criterion="speed", progress=False)
    timed = rd.Toolpath(path.position, path.axis, time=np.linspace(0.0, 1e-3, len(path)) ** 2)
    again = rd.plan(robot, timed, AXIS, criterion="speed", progress=False)
    assert again.failure is None
    assert again.speed == pytest.approx(plan.speed, rel=1e-6)
    # Twice as fast joints, twice as fast a tool.
    limits = {"q_min": robot.q_min, "q_max": robot.q_max, "qd_max": 2.0 * robot.qd_max}
    double = rd.plan(robot.with_limits(**limits), path, AXIS, criterion="speed", progress=False)
    assert double.speed == pytest.approx(2.0 * plan.speed, rel=1e-6)


def test_a_step_without_length_does_not_count() -> None:
    robot, path = CASES["helix"]
    twice = rd.Toolpath(np.repeat(path.position, 2, axis=0), np.repeat(path.axis, 2, axis=0))
    plan = rd.plan(robot, path, AXIS, criterion="speed", progress=False)
    standing = rd.plan(robot, twice, AXIS, criterion="speed", progress=False)
    assert standing.failure is None
    assert standing.speed >= plan.speed * (1.0 - 1e-6)


def test_closed_path() -> None:
    robot = CASES["helix"][0]
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    position = np.array([1.3, 0.0, 0.3]) + 0.15 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    position[-1] = position[0]
    path = rd.Toolpath(position, np.tile([0.0, 0.0, -1.0], (25, 1)))
    plan = rd.plan(robot, path, AXIS, criterion="speed", closed=True, progress=False)
    assert plan.failure is None
    turns = (plan.q[-1] - plan.q[0]) / (2.0 * np.pi)
    assert np.abs(turns - np.round(turns)).max() < 1e-9
    free = rd.plan(robot, path, AXIS, criterion="speed", progress=False)
    assert free.speed >= plan.speed * (1.0 - 1e-6)


def test_a_seven_axis_arm() -> None:
    robot = rd.robots.get("kuka_iiwa14")
    path = joint_line(robot, np.array([0, 0.5, 0, -1.2, 0, 0.8, 0]), np.array([0.4, 0.7, 0.2, -1.0, 0.3, 1.0, 0.4]), 9)
    plan = rd.plan(robot, path, AXIS, criterion="speed", n_spare=12, progress=False)
    motion = rd.plan(robot, path, AXIS, criterion="motion", n_spare=12, progress=False)
    assert plan.failure is None
    assert plan.speed >= motion.speed * (1.0 - 1e-6)


def test_what_is_refused() -> None:
    robot, path = CASES["helix"]
    with pytest.raises(rd.InvalidValueError, match="speed limits"):
        rd.plan(robot.with_limits(qd_max=np.full(6, np.inf)), path, AXIS, criterion="speed")
    still = rd.Toolpath(np.tile(path.position[0], (3, 1)), np.tile(path.axis[0], (3, 1)))
    with pytest.raises(rd.InvalidValueError, match="length"):
        rd.plan(robot, still, AXIS, criterion="speed")
    with pytest.raises(rd.InvalidValueError, match="reconfigurations"):
        rd.plan(robot, path, AXIS, criterion="speed", reconfigurations=True)
    with pytest.raises(rd.InvalidValueError, match="edge_cost"):
        rd.plan(robot, path, AXIS, criterion="speed", edge_cost=lambda a, _: np.zeros(len(a)))
