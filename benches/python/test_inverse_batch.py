"""Every posture of many poses: one call beside a loop over single ones."""

import numpy as np
import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from .chains import F64
from .conftest import label
from .contender import per

COUNT = 2_000
BATCH = {"timer": per(COUNT), "min_rounds": 5, "min_time": 0.02 / COUNT, "max_time": 2.0 / COUNT}


def arm(name: str) -> rd.Robot:
    """A robot of the package, or the first as it may be calibrated."""
    if name != "calibrated":
        return rd.robots.get(name)
    ideal = rd.robots.get("abb_irb120")
    links = ideal.links.copy()
    links[4, 0, 3] += 1e-4
    return rd.Robot.from_links(links, ideal.flange, ideal.joints, tool=ideal.tool)


def loop(robot: rd.Robot, poses: F64) -> tuple[F64, F64]:
    """What people write without a batch."""
    each = [robot.inverse(pose) for pose in poses]
    return np.concatenate(each), np.repeat(np.arange(len(poses)), [len(q) for q in each])


def batch(robot: rd.Robot, poses: F64) -> tuple[F64, F64]:
    q, frame = robot.inverse(poses)
    return q, frame


WAYS = {"loop": loop, "batch": batch}


@pytest.mark.benchmark(**BATCH)
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", ["abb_irb120", "ur5e", "calibrated"])
def test_many_poses(benchmark: BenchmarkFixture, name: str, way: str) -> None:
    robot, call = arm(name), WAYS[way]
    poses = robot.fk(robot.random_postures(COUNT, 1))
    label(benchmark, name, "inverse_batch", way)
    q, frame = benchmark(call, robot, poses)
    for i in (0, len(poses) // 2, len(poses) - 1):
        np.testing.assert_array_equal(q[frame == i], robot.inverse(poses[i]))
