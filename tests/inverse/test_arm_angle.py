"""Inverse solutions of more than six joints: joints that are held, and arm angles."""

import numpy as np
import pytest
import redundancy as rd

from tests.inverse.arms import KUKA
from tests.reference.arms import (
    angles,
    check_solutions,
    distance,
    smallest_singular_value,
)
from tests.reference.chain import Chain

SEVEN = {"kuka_iiwa14": (0, 2, 4), "panda": (4, 6), "baxter_left": (1, 2, 4)}
"""Joints to hold: what is left has a wrist, or parallel axes, or nothing."""


@pytest.mark.parametrize(("name", "joint"), [(name, joint) for name, joints in SEVEN.items() for joint in joints])
def test_held_joint(name: str, joint: int) -> None:
    robot, rng = rd.robots.get(name), np.random.default_rng(joint)
    for q in angles(rng, 40, 7):
        pose, rest = robot.fk(q), robot.with_fixed({joint: q[joint]})
        others = np.delete(q, joint)
        np.testing.assert_allclose(rest.fk(others), pose, rtol=0, atol=1e-14)
        solutions = robot.inverse(pose, fixed={joint: q[joint]})
        check_solutions(robot, pose, solutions)
        np.testing.assert_array_equal(solutions[:, joint], q[joint])
        np.testing.assert_array_equal(np.delete(solutions, joint, axis=1), rest.inverse(pose))
        if smallest_singular_value(rest, others) > 1e-3:
            assert distance(solutions, q).min(initial=np.inf) < 1e-8


def test_held_joints_keep_the_rest_of_the_robot() -> None:
    rest = KUKA.with_fixed({0: 0.3, 5: -0.4})
    assert (rest.n, rest.joints) == (5, "RRRRR")
    for key in ("q_min", "q_max", "qd_max"):
        np.testing.assert_array_equal(getattr(rest, key), np.delete(getattr(KUKA, key), [0, 5]))
    q = np.array([0.1, 0.2, 0.5, -0.6, 0.7])
    whole = np.insert(np.insert(q, 0, 0.3), 5, -0.4)
    np.testing.assert_allclose(rest.fk(q), KUKA.fk(whole), rtol=0, atol=1e-14)


def test_held_prismatic_joint() -> None:
    rng = np.random.default_rng(3)
    (a, d), (alpha, theta) = rng.uniform(-0.5, 0.5, (2, 7)), rng.uniform(-np.pi, np.pi, (2, 7))
    chain = Chain(a, d, alpha, theta, "RRPRRRR")
    robot, q = chain.robot(), rng.uniform(-1, 1, 7)
    solutions = robot.inverse(robot.fk(q), fixed={2: q[2]})
    check_solutions(robot, robot.fk(q), solutions)
    assert distance(solutions, q).min() < 1e-8
    assert robot.with_fixed({0: q[0]}).structure == "search"
    solutions, _, complete = robot.inverse(robot.fk(q), fixed={0: q[0]}, report=True)
    assert np.abs(solutions - q).max(axis=1).min() < 1e-8
    assert not complete


def test_arm_angle() -> None:
    rng = np.random.default_rng(4)
    for q in angles(rng, 200, 7):
        pose, angle = KUKA.fk(q), KUKA.arm_angle(q)
        solutions, singular, complete = KUKA.inverse(pose, arm_angle=angle, report=True)
        check_solutions(KUKA, pose, solutions)
        assert complete
        assert len(solutions) == 8
        assert not singular.any()
        assert distance(solutions, q).min() < 1e-8
        for row in solutions:
            assert distance(np.array([KUKA.arm_angle(row)]), np.array([angle])) < 1e-8
        other = rng.uniform(-np.pi, np.pi)
        for row in KUKA.inverse(pose, arm_angle=other):
            assert distance(np.array([KUKA.arm_angle(row)]), np.array([other])) < 1e-8


def test_arm_angle_by_construction() -> None:
    # Joint 3 at zero: the arm is in the plane of axis 1. From there the elbow is turned about the line to the wrist.
    q = np.array([0.4, 0.5, 0.0, -1.2, 0.3, 0.6, 0.2])
    frames = KUKA.link_frames(q)
    shoulder, wrist = frames[1][:3, 3], frames[5][:3, 3]
    angle = KUKA.arm_angle(q)
    assert min(abs(angle), abs(abs(angle) - np.pi)) < 1e-12
    x = (wrist - shoulder) / np.linalg.norm(wrist - shoulder)
    for row in KUKA.inverse(KUKA.fk(q), arm_angle=angle + 0.7):
        elbow = KUKA.link_frames(row)[3][:3, 3]
        before, after = (v - x * (x @ v) for v in (frames[3][:3, 3] - shoulder, elbow - shoulder))
        turn = np.arctan2(x @ np.cross(before, after), before @ after)
        assert turn == pytest.approx(0.7, abs=1e-9)


@pytest.mark.parametrize("joint", [1, 3, 5])
@pytest.mark.parametrize("bend", [1e-2, 1e-4, 1e-6, 1e-7, 1e-8])
def test_arm_angle_next_to_a_singularity(joint: int, bend: float) -> None:
    # Shoulder, elbow or wrist nearly stretched.
    for q in angles(np.random.default_rng(11), 40, 7):
        q[joint] = bend
        angle = KUKA.arm_angle(q)
        solutions = KUKA.inverse(KUKA.fk(q), arm_angle=angle)
        check_solutions(KUKA, KUKA.fk(q), solutions)
        if bend > 1e-5:
            assert distance(solutions, q).min() < 1e-10 / bend**2


def test_straight_arm_has_no_arm_angle() -> None:
    for q in angles(np.random.default_rng(12), 40, 7):
        q[3] = 0.0
        assert np.isnan(KUKA.arm_angle(q))
        solutions, singular, complete = KUKA.inverse(KUKA.fk(q), arm_angle=0.3, report=True)
        check_solutions(KUKA, KUKA.fk(q), solutions)
        assert not complete
        assert singular.all()


@pytest.mark.parametrize("name", ["panda", "baxter_left", "abb_irb120", "stanford_arm"])
def test_arms_without_arm_angle(name: str) -> None:
    robot = rd.robots.get(name)
    with pytest.raises(rd.InvalidValueError, match=name):
        robot.inverse(np.eye(4), arm_angle=0.0)
    with pytest.raises(rd.InvalidValueError, match=name):
        robot.arm_angle(np.zeros(robot.n))
