"""Inverse kinematics of many poses in one call: what single calls say, in every form that poses come in."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inverse.arms import IRB120, KUKA, POSE, POSE7, UR5E
from tests.reference.arms import random_arm
from tests.reference.chain import F64

PANDA = rd.robots.get("panda")
GENERAL = random_arm(np.random.default_rng(9), "general").robot()
ROBOTS = {"wrist": IRB120, "parallel": UR5E, "general": GENERAL, "seven": KUKA, "offset": PANDA}
ROBOTS |= {"slides": rd.robots.get("stanford_arm"), "five": IRB120.with_fixed({5: 0.0})}
CALLS: list[tuple[str, dict[str, Any]]] = [
    ("wrist", {}),
    ("wrist", {"limits": True}),
    ("parallel", {"turns": True}),
    ("general", {}),
    ("seven", {"fixed": {2: 0.3}, "limits": True}),
    ("seven", {"arm_angle": 0.4}),
    ("offset", {"samples": 9}),
    ("slides", {"limits": True}),
    ("five", {"task": rd.Task.axisymmetric((0, 0, 1))}),
    ("wrist", {"task": rd.Task.axisymmetric((0, 0, 1)), "samples": 9}),
]


def _poses(robot: rd.Robot, count: int, seed: int) -> F64:
    """Poses of random postures, every fifth of them out of reach."""
    poses = robot.fk(robot.random_postures(count, seed))
    poses[2::5, :3, 3] += 9.0
    return poses


def _singles(robot: rd.Robot, poses: F64, near: F64 | None, asked: dict[str, Any]) -> tuple[Any, ...]:
    """What single calls answer, one after the other."""
    nears = [None] * len(poses) if near is None else np.broadcast_to(near, (len(poses), robot.n))
    each = [robot.inverse(pose, near=its, report=True, **asked) for pose, its in zip(poses, nears, strict=True)]
    frame = np.repeat(np.arange(len(poses)), [len(q) for q, _, _ in each])
    q, singular, complete = zip(*each, strict=True)
    return np.concatenate(q), frame, np.concatenate(singular), np.array(complete)


@pytest.mark.parametrize("near", ["none", "one", "each"])
@pytest.mark.parametrize(("name", "asked"), CALLS)
def test_many_are_as_one_after_the_other(name: str, asked: dict[str, Any], near: str) -> None:
    robot = ROBOTS[name]
    poses, postures = _poses(robot, 40, 3), robot.random_postures(40, 4)
    given_near = {"none": None, "one": postures[0], "each": postures}[near]
    got = robot.inverse(poses, near=given_near, report=True, **asked)
    wanted = _singles(robot, poses, given_near, asked)
    assert [part.dtype for part in got] == [np.float64, np.int64, np.bool_, np.bool_]
    assert got[3].shape == (40,)
    for part, whole in zip(got, wanted, strict=True):
        np.testing.assert_array_equal(part, whole)
    assert set(np.unique(got[1])).isdisjoint(range(2, 40, 5))
    q, frame = robot.inverse(poses, near=given_near, **asked)
    np.testing.assert_array_equal(q, got[0])
    np.testing.assert_array_equal(frame, got[1])


@given(count=st.integers(0, 70), seed=st.integers(0, 2**32), name=st.sampled_from(["wrist", "parallel"]))
@settings(max_examples=15, deadline=None)
def test_any_number_of_poses(count: int, seed: int, name: str) -> None:
    robot = ROBOTS[name]
    poses = _poses(robot, count, seed)
    q, frame = robot.inverse(poses)
    assert q.shape == (len(frame), 6)
    assert (np.diff(frame) >= 0).all()
    for i, pose in enumerate(poses):
        np.testing.assert_array_equal(q[frame == i], robot.inverse(pose))


def test_no_pose() -> None:
    q, frame, singular, complete = IRB120.inverse(np.empty((0, 4, 4)), near=np.empty((0, 6)), report=True)
    assert (q.shape, frame.shape, singular.shape, complete.shape) == ((0, 6), (0,), (0,), (0,))


def test_one_pose_of_a_batch_is_not_a_single_one() -> None:
    q, frame = IRB120.inverse(POSE[None])
    np.testing.assert_array_equal(q, IRB120.inverse(POSE))
    np.testing.assert_array_equal(frame, np.zeros(len(q)))


POSES = _poses(IRB120, 12, 1)
FORMS: dict[str, Callable[[F64], Any]] = {
    "list": lambda poses: poses.tolist(),
    "read-only": lambda poses: np.frombuffer(poses.tobytes()).reshape(-1, 4, 4),
    "fortran": np.asfortranarray,
    "strided": lambda poses: np.repeat(np.repeat(poses, 2, axis=0), 3, axis=2)[::2, :, ::3],
    "reversed": lambda poses: poses[::-1].copy()[::-1],
    "transposed": lambda poses: poses.transpose(0, 2, 1).copy().transpose(0, 2, 1),
    "swapped": lambda poses: poses.astype(">f8"),
    "objects": lambda poses: poses.astype(object),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_the_same_poses(form: str) -> None:
    for got, wanted in zip(IRB120.inverse(FORMS[form](POSES)), IRB120.inverse(POSES), strict=True):
        np.testing.assert_array_equal(got, wanted)


def _with(pose: int, row: int, column: int, value: float) -> F64:
    poses = POSES.copy()
    poses[pose, row, column] = value
    return poses


@pytest.mark.parametrize("far", [1e6, 1e15, 1e300])
def test_near_a_posture_far_away(far: float) -> None:
    in_line = IRB120.fk([0.1, 0.2, -0.3, 0.4, 0.0, 0.6])
    for robot, pose in ((IRB120, POSE), (IRB120, in_line), (UR5E, UR5E.fk([0.1, -1.0, 1.0, 0.4, 0.0, 0.6]))):
        for limits, turns in ((False, False), (True, False), (False, True)):
            assert np.isfinite(robot.inverse(pose, near=np.full(6, far), limits=limits, turns=turns)).all()


Q = np.zeros(6)
WRONG: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "3 x 4": (lambda: IRB120.inverse(POSES[:, :3]), rd.ShapeError, r"pose.*\(12, 3, 4\).*\(N, 4, 4\)"),
    "NaN": (lambda: IRB120.inverse(_with(7, 1, 2, np.nan)), rd.NonFiniteError, r"pose\[7\]\[6\] is NaN"),
    "no rotation": (lambda: IRB120.inverse(_with(5, 0, 0, 0.3)), rd.InvalidValueError, r"pose\[5\].*rotation"),
    "last row": (lambda: IRB120.inverse(_with(0, 3, 0, 0.3)), rd.InvalidValueError, r"pose\[0\].*last row"),
    "near of another number": (
        lambda: IRB120.inverse(POSES, near=np.zeros((11, 6))),
        rd.ShapeError,
        r"near.*\(11, 6\).*\(6,\) or \(12, 6\)",
    ),
    "near too short": (lambda: IRB120.inverse(POSES, near=Q[:5]), rd.ShapeError, r"near.*\(5,\)"),
    "one near too short": (lambda: IRB120.inverse(POSE, near=Q[:5]), rd.ShapeError, r"near.*\(5,\).*\(6,\)"),
    "many near to one": (lambda: IRB120.inverse(POSE, near=np.zeros((1, 6))), rd.ShapeError, r"near.*\(1, 6\).*\(6,\)"),
    "near of NaN": (lambda: IRB120.inverse(POSES, near=Q + np.nan), rd.NonFiniteError, r"near\[0\] is NaN"),
    "one near of infinity": (lambda: IRB120.inverse(POSE, near=Q + np.inf), rd.NonFiniteError, r"near\[0\] is inf"),
    "seven joints": (lambda: KUKA.inverse(POSE7[None]), rd.InvalidValueError, "task takes 6"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(case: str) -> None:
    call, error, message = WRONG[case]
    with pytest.raises(error, match=message):
        call()
