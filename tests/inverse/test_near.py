"""Postures in order of nearness: against a search over all copies in numpy; what may be chosen stays."""

import itertools

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inverse.arms import IRB120, KUKA, SIX, UR5E
from tests.inverse.test_inverse_singular import SINGULAR
from tests.reference.arms import check_solutions, distance, random_arm
from tests.reference.chain import F64

TWO_PI = 2.0 * np.pi


def _copies(robot: rd.Robot, q: F64, near: F64, within: bool) -> list[F64]:
    """Every posture that is q up to whole turns, within the limits or near by."""
    if not within:
        return [near + np.remainder(q - near + np.pi, TWO_PI) - np.pi]
    columns = []
    for x, low, high in zip(q, robot.q_min, robot.q_max, strict=True):
        turns = x + TWO_PI * np.arange(-4, 5)
        columns.append(turns[(turns >= low) & (turns <= high)])
    return [np.array(row) for row in itertools.product(*columns)]


@pytest.mark.parametrize("name", [*SIX, "general"])
@pytest.mark.parametrize("asked", ["all", "limits", "turns"])
def test_order_is_that_of_a_search(name: str, asked: str) -> None:
    robot = random_arm(np.random.default_rng(9), "general").robot() if name == "general" else rd.robots.get(name)
    rng = np.random.default_rng(1)
    if asked != "all":
        robot = robot.with_limits(q_min=rng.uniform(-6.0, -2.0, 6), q_max=rng.uniform(2.0, 6.0, 6))
    for near in rng.uniform(-4.0, 4.0, (12, 6)):
        pose = robot.fk(rng.uniform(-np.pi, np.pi, 6))
        got = robot.inverse(pose, near=near, limits=asked == "limits", turns=asked == "turns")
        each = [_copies(robot, q, near, asked != "all") for q in robot.inverse(pose)]
        if asked != "turns":
            each = [[min(copies, key=lambda q: float(np.linalg.norm(q - near)))] for copies in each if copies]
        wanted = sorted(itertools.chain(*each), key=lambda q: float(np.linalg.norm(q - near)))
        assert got.shape == (len(wanted), 6)
        if wanted:
            np.testing.assert_allclose(got, wanted, rtol=0, atol=1e-12)


def test_a_single_limit_and_none() -> None:
    robot = IRB120.with_limits(q_min=np.full(6, -np.inf), q_max=[np.inf] * 5 + [0.0])
    near, pose = np.array([9.0, 0, 0, -20.0, 0, 0.5]), IRB120.fk([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
    free = robot.inverse(pose, near=near)
    assert np.abs(free - near).max() <= np.pi
    inside = robot.inverse(pose, near=near, limits=True)
    assert len(inside) == len(free)
    assert np.abs((inside - near)[:, :5]).max() <= np.pi
    assert ((inside[:, 5] <= 0.0) & (inside[:, 5] > -TWO_PI)).all()


def test_held_joints_stay() -> None:
    q = np.array([0.2, 0.7, -0.4, -1.2, 0.5, 0.9, 0.1])
    pose, near = KUKA.fk(q), q + TWO_PI
    held = KUKA.inverse(pose, fixed={2: -0.4}, near=near)
    assert (held[:, 2] == -0.4).all()
    np.testing.assert_allclose(np.delete(held[0], 2), np.delete(near, 2), rtol=0, atol=1e-12)
    np.testing.assert_allclose(KUKA.inverse(pose, arm_angle=KUKA.arm_angle(q), near=q)[0], q, rtol=0, atol=1e-9)


@pytest.mark.parametrize("case", SINGULAR)
def test_a_singular_posture_is_found_from_itself(case: str) -> None:
    robot, constraints = SINGULAR[case]
    for q in np.random.default_rng(2).uniform(-1.2, 1.2, (40, 6)):
        for constraint in constraints:
            q = constraint(q)
        pose = robot.fk(q)
        solutions, singular, _ = robot.inverse(pose, near=q, report=True)
        check_solutions(robot, pose, solutions)
        # Half the digits are left where two branches only meet.
        meets = "elbow" in case or case == "UR shoulder"
        assert np.abs(solutions[0] - q).max() < (1e-4 if meets else 1e-9), (q, solutions)
        assert meets or singular[0]


FREE = {"IRB 120 wrist": 3, "IRB 120 wrist back": 3, "IRB 120 shoulder": 0}


@pytest.mark.parametrize("case", FREE)
def test_what_may_be_chosen_stays(case: str) -> None:
    (robot, constraints), joint = SINGULAR[case], FREE[case]
    rng = np.random.default_rng(3)
    for q in rng.uniform(-1.2, 1.2, (40, 6)):
        for constraint in constraints:
            q = constraint(q)
        near, pose = q + rng.uniform(-0.5, 0.5, 6), robot.fk(q)
        solutions, singular, _ = robot.inverse(pose, near=near, report=True)
        check_solutions(robot, pose, solutions)
        assert np.abs(solutions[singular, joint] - near[joint]).max() < 1e-9
        # None is lost: what the singularity leaves alone, and the regular ones, are there as without `near`.
        plain, flags, _ = robot.inverse(pose, report=True)
        firm = [0, 1, 2] if joint == 3 else [1, 2]
        for row, flag in zip(plain, flags, strict=True):
            kept = firm if flag else slice(None)
            assert distance(solutions[singular == flag][:, kept], row[kept]).min() < 1e-6


def test_joints_4_and_6_in_line() -> None:
    rng = np.random.default_rng(4)
    for q in rng.uniform(-1.2, 1.2, (40, 6)):
        q[4] = 0.0
        near = q + np.array([0, 0, 0, 0.8, 0, 0.3])
        solutions, singular, _ = IRB120.inverse(IRB120.fk(q), near=near, report=True)
        # Joint 4 stays, joint 6 makes up for it.
        wanted = [*q[:3], near[3], 0.0, q[3] + q[5] - near[3]]
        np.testing.assert_allclose(solutions[singular][0], wanted, rtol=0, atol=1e-9)


def test_a_joint_that_makes_up_stays_within_its_limits() -> None:
    low, high = np.full(6, -2.0), np.full(6, 2.0)
    robot, rng = IRB120.with_limits(q_min=low, q_max=high), np.random.default_rng(7)
    for q in rng.uniform(-1.2, 1.2, (40, 6)):
        # Where joint 4 stays, joint 6 would have to be at 2.5; at 2.0 it takes joint 4 half a radian along.
        q[3:] = 1.0, 0.0, 1.0
        near, pose = [*q[:3], -0.5, 0.1, 1.9], robot.fk(q)
        best = robot.inverse(pose, near=near, limits=True)[0]
        np.testing.assert_allclose(best, [*q[:3], 0.0, 0.0, 2.0], rtol=0, atol=1e-8)
        assert np.abs(robot.fk(best) - pose).max() < 1e-9
        assert ((best >= low) & (best <= high)).all()


def test_limits_alone_do_not_lose_a_continuum() -> None:
    # 0 is beyond the limits of joint 4, and with it at 1.0 joint 6 would be beyond its own.
    robot = IRB120.with_limits(q_min=[-3, -3, -3, 1.0, -3, -3.0], q_max=[3, 3, 3, 3.0, 3, 0.5])
    for q in np.random.default_rng(8).uniform(-1.2, 1.2, (20, 6)):
        q[3:] = 2.0, 0.0, 0.3
        pose = robot.fk(q)
        solutions, singular, _ = robot.inverse(pose, limits=True, report=True)
        check_solutions(robot, pose, solutions)
        assert ((solutions >= robot.q_min) & (solutions <= robot.q_max)).all()
        assert distance(solutions[singular][:, :3], q[:3]).min() < 1e-9


def test_joint_6_of_three_parallel_axes_stays() -> None:
    rng = np.random.default_rng(5)
    for q in rng.uniform(-1.2, 1.2, (40, 6)):
        q[4], q[2] = 0.0, 1.0 + 0.2 * q[2]
        near, pose = q + np.array([0, 0, 0, 0, 0, 0.02]), UR5E.fk(q)
        solutions = UR5E.inverse(pose, near=near)
        check_solutions(UR5E, pose, solutions)
        assert abs(solutions[0, 5] - near[5]) < 1e-9
        assert np.abs(solutions[0] - near).max() < 0.3


def test_wrist_and_shoulder_of_an_arm_angle_stay() -> None:
    for q in np.random.default_rng(6).uniform(0.3, 1.2, (20, 7)):
        q[5] = 0.0
        pose, angle, near = KUKA.fk(q), KUKA.arm_angle(q), q + 0.1
        best = KUKA.inverse(pose, arm_angle=angle, near=near)[0]
        assert np.abs(KUKA.fk(best) - pose).max() < 1e-12
        assert abs(best[4] - near[4]) < 1e-9
        assert abs(KUKA.arm_angle(best) - angle) < 1e-9


@given(
    bend=st.sampled_from([0.0, 1e-15, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5]),
    turns=st.lists(st.integers(-3, 3), min_size=6, max_size=6),
    seed=st.integers(0, 2**32),
)
@settings(max_examples=40, deadline=None)
def test_next_to_a_wrist_in_line(bend: float, turns: list[int], seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-1.2, 1.2, 6)
    q[4] = bend
    near = q + TWO_PI * np.array(turns)
    pose = IRB120.fk(q)
    solutions = IRB120.inverse(pose, near=near)
    check_solutions(IRB120, pose, solutions)
    assert (np.diff(np.linalg.norm(solutions - near, axis=1)) >= 0.0).all()
    # In line joints 4 and 6 are known by their sum alone; next to it by rounding over the bend.
    assert distance(solutions[:1, [0, 1, 2, 4]], q[[0, 1, 2, 4]]).max() < 1e-6
    np.testing.assert_allclose(solutions[0], near, rtol=0, atol=1e-9 + 1e-14 / max(bend, 1e-14))
