"""Robots of seven joints: postures over the values of a joint that is held, against calls with that joint held."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.inverse.arms import IRB120, KUKA, POSE, POSE7
from tests.reference.arms import check_solutions, distance
from tests.reference.chain import F64, Chain

PANDA, BAXTER = rd.robots.get("panda"), rd.robots.get("baxter_left")
SWEPT = {"panda": 4, "baxter_left": 4, "kuka_iiwa14": 4}
"""Of the joints whose holding leaves a closed form, if any does, the one with the largest share in the self-motion."""


def _share(robot: rd.Robot) -> F64:
    """Mean square of each joint's part of the unit self-motion, lengths over the size of the robot."""
    ends = [*robot.links[1:, :3, 3], (robot.flange @ robot.tool)[:3, 3]]
    unit = np.repeat([1.0, 1.0 / sum(np.linalg.norm(end) for end in ends)], 3)
    _, _, v = np.linalg.svd(unit[:, None] * robot.jacobian(robot.random_postures(500, 8)))
    mean: F64 = np.mean(v[:, 6] ** 2, axis=0)
    return mean


@pytest.mark.parametrize("name", SWEPT)
def test_joint_that_is_swept(name: str) -> None:
    robot, joint = rd.robots.get(name), SWEPT[name]
    easy = [robot.with_fixed({i: 0.3}).structure != "general" for i in range(7)]
    candidates = np.flatnonzero(easy) if any(easy) else np.arange(7)
    # Of two that are nearly as good either may be taken.
    share = _share(robot)
    assert joint in candidates
    assert share[joint] > share[candidates].max() - 0.03
    q = robot.random_postures(1, 4)[0]
    postures, _, complete = robot.inverse(robot.fk(q), samples=5, report=True)
    values = np.linspace(robot.q_min[joint], robot.q_max[joint], 5)
    each = [robot.inverse(robot.fk(q), fixed={joint: value}) for value in values]
    np.testing.assert_array_equal(postures, np.concatenate(each))
    assert len(postures)
    assert not complete


def test_every_posture_takes_the_tool_there() -> None:
    for q in PANDA.random_postures(20, 2):
        pose = PANDA.fk(q)
        postures = PANDA.inverse(pose, samples=40)
        check_solutions(PANDA, pose, postures[np.random.default_rng(1).permutation(len(postures))[:20]])
        assert np.abs(PANDA.fk(postures) - pose).max() < 1e-9
        inside = PANDA.inverse(pose, samples=40, limits=True)
        kept = ((postures >= PANDA.q_min) & (postures <= PANDA.q_max)).all(axis=1)
        np.testing.assert_array_equal(inside, postures[kept])


@pytest.mark.parametrize("robot", [PANDA, BAXTER, KUKA], ids=lambda robot: robot.name)
def test_near_has_its_own_value_in_the_grid(robot: rd.Robot) -> None:
    for q in robot.random_postures(5, 3):
        postures = robot.inverse(robot.fk(q), samples=6, near=q, limits=True)
        np.testing.assert_allclose(postures[0], q, rtol=0, atol=1e-9)
        assert (np.diff(np.linalg.norm(postures - q, axis=1)) >= 0.0).all()
        assert (distance(postures[1:], postures[0]) > 1e-7).all()


def test_without_limits_over_a_turn() -> None:
    free = KUKA.with_limits(q_min=np.full(7, -np.inf), q_max=np.full(7, np.inf))
    postures = free.inverse(POSE7, samples=8)
    swept = np.unique(postures[:, SWEPT["kuka_iiwa14"]])
    np.testing.assert_allclose(swept, -np.pi + np.arange(8) * np.pi / 4, rtol=0, atol=1e-15)
    np.testing.assert_allclose(KUKA.inverse(POSE7, samples=1)[:, 4], 0.0, atol=1e-15)


def test_a_rail_is_swept() -> None:
    robot = rd.robots.on_rail(IRB120, (1, 0, 0), -1.0, 1.0)
    joint = robot.joints.index("P")
    q = np.insert(np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6]), joint, 0.2)
    postures = robot.inverse(robot.fk(q), samples=21)
    assert set(np.unique(postures[:, joint])) <= set(np.linspace(-1.0, 1.0, 21))
    assert distance(postures, q).min() < 1e-9
    with pytest.raises(rd.InvalidValueError, match="two limits"):
        robot.with_limits(q_min=np.full(7, -np.inf)).inverse(robot.fk(q), samples=3)


def test_beside_held_joints() -> None:
    rng = np.random.default_rng(5)
    (a, d), (alpha, theta) = rng.uniform(-0.5, 0.5, (2, 8)), rng.uniform(-np.pi, np.pi, (2, 8))
    robot, q = Chain(a, d, alpha, theta, "RRRRRRRR").robot(), rng.uniform(-1, 1, 8)
    postures = robot.inverse(robot.fk(q), fixed={3: q[3]}, samples=2, near=q)
    assert (postures[:, 3] == q[3]).all()
    np.testing.assert_allclose(postures[0], q, rtol=0, atol=1e-8)


def test_a_tool_that_may_spin() -> None:
    task = rd.Task.axisymmetric((0, 0, 1))
    for q in IRB120.random_postures(5, 2):
        pose = IRB120.fk(q)
        postures = IRB120.inverse(pose, task=task, samples=20, near=q)
        np.testing.assert_allclose(postures[0], q, rtol=0, atol=1e-9)
        # Place and axis of the tool.
        np.testing.assert_allclose(
            IRB120.fk(postures)[:, :3, 2:], np.broadcast_to(pose[:3, 2:], (len(postures), 3, 2)), atol=1e-9
        )


WRONG: list[tuple[rd.Robot, F64, dict[str, Any]]] = [
    (IRB120, POSE, {"samples": 5}),
    (PANDA, POSE7, {"samples": 5, "fixed": {0: 0.1}}),
    (PANDA, POSE7, {"samples": 0}),
    (KUKA, POSE7, {"samples": 5, "arm_angle": 0.1}),
]


@pytest.mark.parametrize(("robot", "pose", "asked"), WRONG)
def test_wrong_input(robot: rd.Robot, pose: F64, asked: dict[str, Any]) -> None:
    with pytest.raises(rd.InvalidValueError, match="samples"):
        robot.inverse(pose, **asked)
