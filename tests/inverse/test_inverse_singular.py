"""All inverse solutions at singular postures and next to them: what exists, and a flag."""

from collections.abc import Callable

import numpy as np
import pytest
import redundancy as rd

from tests.reference.arms import (
    PLACES,
    angles,
    check_solutions,
    distance,
    random_arm,
    smallest_singular_value,
)
from tests.reference.chain import F64

IRB120, UR5E = (rd.robots.get(name) for name in ("abb_irb120", "ur5e"))

# Singular postures by construction, from the lengths in the data sheets.
UPPER, FOREARM, OFFSET = 0.270, 0.302, 0.070
STRAIGHT = -np.arctan2(FOREARM, OFFSET)


def _wrist(q: F64) -> F64:
    q[4] = 0.0
    return q


def _wrist_back(q: F64) -> F64:
    q[4] = np.pi
    return q


def _elbow(q: F64) -> F64:
    q[2] = STRAIGHT
    return q


def _folded(q: F64) -> F64:
    q[2] = STRAIGHT + np.pi
    return q


def _shoulder(q: F64) -> F64:
    # Distance of the wrist centre from axis 1: A sin q2 + B cos q2 = 0.
    s, c = np.sin(q[2]), np.cos(q[2])
    q[1] = np.arctan2(-(FOREARM * c + OFFSET * s), UPPER - FOREARM * s + OFFSET * c)
    return q


def _ur_wrist(q: F64) -> F64:
    q[4] = 0.0
    return q


def _ur_wrist_back(q: F64) -> F64:
    q[4] = np.pi
    return q


def _ur_elbow(q: F64) -> F64:
    q[2] = 0.0
    return q


def _ur_folded(q: F64) -> F64:
    q[2] = np.pi
    return q


def _ur_shoulder(q: F64) -> F64:
    # The point where axes 5 and 6 meet, in the plane of axis 1 and the direction of axis 2.
    a2, a3, d5 = -0.425, -0.3922, 0.0997
    s, c = np.sin(q[2]), np.cos(q[2])
    along = a2 + a3 * c + d5 * np.sin(q[2] + q[3])
    across = -a3 * s + d5 * np.cos(q[2] + q[3])
    q[1] = np.arctan2(-along, across)
    return q


SINGULAR: dict[str, tuple[rd.Robot, list[Callable[[F64], F64]]]] = {
    "IRB 120 wrist": (IRB120, [_wrist]),
    "IRB 120 wrist back": (IRB120, [_wrist_back]),
    "IRB 120 elbow stretched": (IRB120, [_elbow]),
    "IRB 120 elbow folded": (IRB120, [_folded]),
    "IRB 120 shoulder": (IRB120, [_shoulder]),
    "IRB 120 wrist and elbow": (IRB120, [_wrist, _elbow]),
    "IRB 120 wrist and shoulder": (IRB120, [_wrist, _shoulder]),
    "IRB 120 elbow and shoulder": (IRB120, [_elbow, _shoulder]),
    "IRB 120 all three": (IRB120, [_wrist, _elbow, _shoulder]),
    "UR axis 6 parallel": (UR5E, [_ur_wrist]),
    "UR axis 6 against": (UR5E, [_ur_wrist_back]),
    "UR elbow stretched": (UR5E, [_ur_elbow]),
    "UR elbow folded": (UR5E, [_ur_folded]),
    "UR shoulder": (UR5E, [_ur_shoulder]),
    "UR axis 6 and elbow": (UR5E, [_ur_wrist, _ur_elbow]),
    "UR axis 6 and shoulder": (UR5E, [_ur_wrist, _ur_shoulder]),
    "UR elbow and shoulder": (UR5E, [_ur_elbow, _ur_shoulder]),
}


@pytest.mark.parametrize("case", SINGULAR)
def test_singular_postures(case: str) -> None:
    robot, constraints = SINGULAR[case]
    for q in np.random.default_rng(6).uniform(-1.2, 1.2, (60, 6)):
        for constraint in constraints:
            q = constraint(q)
        assert smallest_singular_value(robot, q) < 1e-15
        pose = robot.fk(q)
        solutions, singular, _ = robot.inverse(pose, report=True)
        assert len(solutions)
        check_solutions(robot, pose, solutions)
        # Half the digits are left of a double root; in between it may be told either way.
        sigma = smallest_singular_value(robot, solutions)
        assert singular[sigma < 1e-9].all(), (q, sigma, singular)
        assert not singular[sigma > 1e-5].any()
        assert sigma.min() < 1e-6


@pytest.mark.parametrize("kind", PLACES)
def test_singular_postures_of_random_arms(kind: str) -> None:
    rng = np.random.default_rng(13)
    for _ in range(25):
        robot = random_arm(rng, kind).robot()
        q = _singular(robot, rng)
        pose = robot.fk(q)
        solutions, singular, _ = robot.inverse(pose, report=True)
        check_solutions(robot, pose, solutions)
        sigma = smallest_singular_value(robot, solutions)
        assert sigma.min(initial=np.inf) < 1e-5
        assert singular[sigma < 1e-9].all()
        assert not singular[sigma > 1e-4].any()


def _singular(robot: rd.Robot, rng: np.random.Generator) -> F64:
    """A posture where the determinant of the Jacobian changes its sign along a line."""
    while True:
        ends = angles(rng, 2, 6)
        low, high = np.linalg.det(robot.jacobian(ends))
        if low * high < 0.0:
            break
    for _ in range(60):
        middle = ends.mean(axis=0)
        ends[0 if np.linalg.det(robot.jacobian(middle)) * low > 0.0 else 1] = middle
    singular: F64 = ends[0]
    return singular


def test_what_may_be_chosen_is_zero_and_the_rest_comes_back() -> None:
    rng = np.random.default_rng(7)
    for q in rng.uniform(-1.2, 1.2, (50, 6)):
        solutions, singular, complete = IRB120.inverse(IRB120.fk(_wrist(q)), report=True)
        row = solutions[singular][distance(solutions[singular][:, :3], q[:3]).argmin()]
        assert distance(row[:3], q[:3]) < 1e-9
        assert abs(row[3]) < 1e-9
        assert abs(row[4]) < 1e-7
        assert distance(row[3:4] + row[5], q[3:4] + q[5]) < 1e-9
        assert not complete

    for q in rng.uniform(-1.2, 1.2, (50, 6)):
        solutions, singular, complete = IRB120.inverse(IRB120.fk(_shoulder(q)), report=True)
        assert singular.all()
        assert (solutions[:, 0] == 0.0).all()
        assert distance(solutions[:, 2:3], q[2:3]).min() < 1e-8
        assert not complete


@pytest.mark.parametrize("bend", [0.0, 1e-12, 1e-10, 1e-9, 3e-9, 1e-8, 3e-8, 1e-7, 1e-6])
@pytest.mark.parametrize("name", ["abb_irb120", "puma500", "ur5e"])
def test_next_to_a_wrist_singularity(name: str, bend: float) -> None:
    # Joint 5 nearly 0. What the singularity leaves alone is the arm (wrist), or joints 1 and 5 (three parallel axes).
    robot = rd.robots.get(name)
    firm = [0, 4] if robot.structure == "parallel" else [0, 1, 2]
    for q in np.random.default_rng(9).uniform(-1.2, 1.2, (60, 6)):
        q[4] = bend
        pose = robot.fk(q)
        solutions = robot.inverse(pose)
        check_solutions(robot, pose, solutions)
        assert distance(solutions[:, firm], q[firm]).min(initial=np.inf) < 1e-6


def test_a_rounded_pose_at_a_wrist_singularity() -> None:
    for q in np.random.default_rng(10).uniform(-1.2, 1.2, (60, 6)):
        pose = IRB120.fk(_wrist(q)).astype(np.float32)
        assert distance(IRB120.inverse(pose)[:, :3], q[:3]).min() < 1e-5


def test_nearly_a_double_root_has_no_third() -> None:
    # Two postures 4e-5 rad apart; the point between them is off the pose by the square of that.
    rng = np.random.default_rng([0, 0, 0, 178])
    robot = random_arm(rng, "general").robot()
    pose = robot.fk(angles(rng, 1000, 6)[43])
    solutions = robot.inverse(pose)
    assert len(solutions) == 6
    assert np.abs(robot.fk(solutions) - pose).max() < 1e-13


def test_double_root_is_one_solution_with_a_flag() -> None:
    for q in np.random.default_rng(8).uniform(-1.2, 1.2, (50, 6)):
        solutions, singular, _ = IRB120.inverse(IRB120.fk(_elbow(q)), report=True)
        # Forwards or over the shoulder, and the wrist's two ways.
        assert len(solutions) == 4
        assert singular.all()
        assert distance(solutions, q).min() < 1e-7
