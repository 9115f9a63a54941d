"""Calls of inverse kinematics: poses out of reach, forms of a pose, wrong arguments."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.inverse.arms import IRB120, KUKA, POSE, POSE7, SIX, Q
from tests.reference.arms import (
    distance,
    random_arm,
)
from tests.reference.chain import F64


@pytest.mark.parametrize("name", [*SIX, "general"])
@pytest.mark.parametrize("far", [5.0, 1e3, 1e100])
def test_out_of_reach(name: str, far: float) -> None:
    robot = random_arm(np.random.default_rng(9), "general").robot() if name == "general" else rd.robots.get(name)
    pose = np.eye(4)
    pose[:3, 3] = far, -far, far
    assert robot.inverse(pose).shape == (0, 6)
    solutions, singular, _ = robot.inverse(pose, limits=True, turns=True, report=True)
    assert solutions.shape == (0, 6)
    assert singular.shape == (0,)


def test_out_of_reach_with_seven_joints() -> None:
    pose = np.eye(4)
    pose[0, 3] = 9.0
    assert KUKA.inverse(pose, fixed={2: 0.1}).shape == (0, 7)
    solutions, singular, complete = KUKA.inverse(pose, arm_angle=0.1, report=True)
    assert (solutions.shape, singular.shape, complete) == ((0, 7), (0,), True)


FORMS: dict[str, Callable[[F64], Any]] = {
    "list": lambda pose: pose.tolist(),
    "tuple": lambda pose: tuple(map(tuple, pose.tolist())),
    "read-only": lambda pose: np.frombuffer(pose.tobytes()).reshape(4, 4),
    "fortran": np.asfortranarray,
    "transposed view": lambda pose: pose.T.copy().T,
    "strided": lambda pose: np.repeat(np.repeat(pose, 2, axis=0), 3, axis=1)[::2, ::3],
    "reversed": lambda pose: pose[::-1, ::-1].copy()[::-1, ::-1],
    "swapped": lambda pose: pose.astype(">f8"),
    "objects": lambda pose: pose.astype(object),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_the_same_pose(form: str) -> None:
    np.testing.assert_array_equal(IRB120.inverse(FORMS[form](POSE)), IRB120.inverse(POSE))
    turned = POSE.copy()
    turned[:3, 3] = 0.0
    np.testing.assert_array_equal(IRB120.inverse(FORMS[form](turned)), IRB120.inverse(turned))


def test_single_precision_is_a_pose_too() -> None:
    single = IRB120.inverse(POSE.astype(np.float32))
    assert distance(single, Q).min() < 1e-5
    np.testing.assert_array_equal(IRB120.inverse(np.eye(4, dtype=np.int64)), IRB120.inverse(np.eye(4)))


def _changed(row: int, column: int, value: float) -> F64:
    pose = POSE.copy()
    pose[row, column] = value
    return pose


WRONG: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "3 x 3": (lambda: IRB120.inverse(np.eye(3)), rd.ShapeError, r"pose.*\(3, 3\).*\(4, 4\)"),
    "batches": (lambda: IRB120.inverse(POSE[None, None]), rd.ShapeError, r"pose.*\(1, 1, 4, 4\).*\(N, 4, 4\)"),
    "flat": (lambda: IRB120.inverse(POSE.ravel()), rd.ShapeError, r"pose.*\(16,\)"),
    "text": (lambda: IRB120.inverse("x"), rd.InvalidValueError, "pose is 'x'"),
    "None": (lambda: IRB120.inverse(None), rd.ShapeError, "pose"),  # type: ignore[call-overload]
    "imaginary": (lambda: IRB120.inverse(POSE + 0j), rd.InvalidValueError, "(?s)pose.*real"),
    "NaN": (lambda: IRB120.inverse(_changed(1, 2, np.nan)), rd.NonFiniteError, r"pose\[6\] is NaN"),
    "infinite": (lambda: IRB120.inverse(_changed(0, 3, np.inf)), rd.NonFiniteError, r"pose\[3\] is inf"),
    "skew": (lambda: IRB120.inverse(_changed(0, 0, 0.9)), rd.InvalidValueError, r"pose.*rotation.*off by"),
    "mirror": (lambda: IRB120.inverse(np.diag([1.0, 1.0, -1.0, 1.0])), rd.InvalidValueError, r"pose.*off by -2"),
    "last row": (lambda: IRB120.inverse(_changed(3, 0, 1.0)), rd.InvalidValueError, r"pose.*last row \[1"),
    "seven joints": (
        lambda: KUKA.inverse(POSE7),
        rd.InvalidValueError,
        r'"RRRRRRR".*takes 6.*1 of the joints 0, 1, 2, 4, 5, 6 held \(fixed\), an arm_angle',
    ),
    "none held": (lambda: KUKA.inverse(POSE7, fixed={}), rd.InvalidValueError, '"RRRRRRR".*takes 6'),
    "one held of two": (
        lambda: KUKA.inverse(POSE7, fixed={0: 0.0}, task=rd.Task.axisymmetric()),
        rd.InvalidValueError,
        '"RRRRRR".*takes 5.*joint 5 held',
    ),
    "last joint of no use": (
        lambda: rd.robots.get("planar_3r").inverse(POSE, task=rd.Task.position()),
        rd.InvalidValueError,
        '"RRR".*takes 2.*1 of the joints 0, 1, 2 held',
    ),
    "task and angle": (
        lambda: KUKA.inverse(POSE7, task=rd.Task.position(), arm_angle=0.1),
        rd.InvalidValueError,
        "arm_angle is given beside a task",
    ),
    "joint 7": (lambda: KUKA.inverse(POSE7, fixed={7: 0.0}), rd.InvalidValueError, "fixed is 7.*0 to 6"),
    "joint -1": (lambda: KUKA.inverse(POSE7, fixed={-1: 0.0}), rd.InvalidValueError, r"fixed is \{-1: 0.0\}"),
    "joint a": (lambda: KUKA.inverse(POSE7, fixed={"a": 0.0}), rd.InvalidValueError, r"\{a: 0.0\}"),  # type: ignore[dict-item]
    "held at x": (lambda: KUKA.inverse(POSE7, fixed={0: "x"}), rd.InvalidValueError, r"\{0: x\}"),  # type: ignore[dict-item]
    "held at NaN": (lambda: KUKA.inverse(POSE7, fixed={0: np.nan}), rd.NonFiniteError, "fixed.*NaN"),
    "held list": (lambda: KUKA.inverse(POSE7, fixed=[(0, 0.0)]), TypeError, "dict"),  # type: ignore[call-overload]
    "held and angle": (
        lambda: KUKA.inverse(POSE7, fixed={2: 0.0}, arm_angle=0.1),
        rd.InvalidValueError,
        "arm_angle.*fixed",
    ),
    "angle NaN": (lambda: KUKA.inverse(POSE7, arm_angle=np.nan), rd.NonFiniteError, "arm_angle.*NaN"),
    "angle x": (lambda: KUKA.inverse(POSE7, arm_angle="x"), TypeError, "str"),  # type: ignore[call-overload]
    "angle of few": (lambda: KUKA.arm_angle(Q), rd.ShapeError, r"q.*\(6,\).*\(7,\)"),
    "angle of NaN": (lambda: KUKA.arm_angle(np.full(7, np.nan)), rd.NonFiniteError, r"q\[0\] is NaN"),
    "with joint 6": (lambda: IRB120.with_fixed({6: 0.0}), rd.InvalidValueError, "fixed is 6.*0 to 5"),
    "with all": (lambda: IRB120.with_fixed(dict.fromkeys(range(6), 0.0)), rd.InvalidValueError, "0"),
    "with infinite": (lambda: IRB120.with_fixed({0: np.inf}), rd.NonFiniteError, "fixed.*inf"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input(case: str) -> None:
    call, kind, message = WRONG[case]
    with pytest.raises(kind, match=message) as caught:
        call()
    assert type(caught.value) is kind


def test_structure() -> None:
    assert KUKA.structure == "none"
    assert rd.robots.get("stanford_arm").structure == "wrist"
    assert KUKA.with_fixed({2: 0.3}).structure == "wrist"
    assert rd.robots.get("baxter_left").with_fixed({2: 0.3}).structure == "general"
