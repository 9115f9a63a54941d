"""All inverse solutions: postures that poses were made from, a search that knows no geometry, special postures."""

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings

from tests.reference.arms import (
    PLACES,
    TWO_PI,
    angles,
    check_solutions,
    distance,
    random_arm,
    search,
    smallest_singular_value,
)
from tests.reference.chain import F64, Chain, chains, random_frame

SIX = [name for name in rd.robots.names() if rd.robots.get(name).joints == "RRRRRR"]
SEVEN = {"kuka_iiwa14": (0, 2, 4), "panda": (4, 6), "baxter_left": (1, 2, 4)}
"""Joints to hold: what is left has a wrist, or parallel axes, or nothing."""
IRB120, UR5E, KUKA = (rd.robots.get(name) for name in ("abb_irb120", "ur5e", "kuka_iiwa14"))
Q = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
Q7 = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6, 0.7])
POSE, POSE7 = IRB120.fk(Q), KUKA.fk(Q7)
REGULAR = 1e-4
"""Smallest singular value from which rounding of the pose moves a posture by less than 1e-10 rad."""


def _recovered(robot: rd.Robot, postures: F64, tolerance: float = 1e-9) -> None:
    """Each posture is among the solutions of its pose; those next to a singularity are left to the soak."""
    postures = postures[smallest_singular_value(robot, postures) > REGULAR]
    for q, pose in zip(postures, robot.fk(postures), strict=True):
        solutions = robot.inverse(pose)
        check_solutions(robot, pose, solutions)
        assert distance(solutions, q).min(initial=np.inf) < tolerance


@pytest.mark.parametrize("name", SIX)
def test_library_robots(name: str) -> None:
    robot = rd.robots.get(name)
    assert robot.structure == ("parallel" if name.startswith("ur") else "wrist")
    rng = np.random.default_rng(1)
    _recovered(robot, angles(rng, 300, 6))
    _recovered(robot.with_tool(random_frame(rng)).with_base(random_frame(rng)), angles(rng, 50, 6))


@pytest.mark.parametrize(("kind", "place"), [(kind, place) for kind in PLACES for place in range(PLACES[kind])])
def test_random_arms(kind: str, place: int) -> None:
    rng = np.random.default_rng(place)
    for _ in range(40):
        robot = random_arm(rng, kind, place).robot()
        if kind == "general":
            assert robot.structure == "general"
        elif kind == "wrist":
            assert robot.structure == "wrist"
        _recovered(robot, angles(rng, 12, 6), 1e-7 if kind == "general" else 1e-9)


@pytest.mark.parametrize("name", ["abb_irb120", "puma500", "ur5e"])
def test_none_is_missing_in_the_library(name: str) -> None:
    robot, rng = rd.robots.get(name), np.random.default_rng(2)
    assert _missing(robot, robot.fk(angles(rng, 20, 6)), rng, 300) == []


@pytest.mark.parametrize(("kind", "place"), [(kind, place) for kind in PLACES for place in range(PLACES[kind])])
def test_none_is_missing_of_random_arms(kind: str, place: int) -> None:
    rng = np.random.default_rng(10 + place)
    for _ in range(3):
        robot = random_arm(rng, kind, place).robot()
        assert _missing(robot, robot.fk(angles(rng, 5, 6)), rng, 150) == []


def _missing(robot: rd.Robot, poses: F64, rng: np.random.Generator, starts: int) -> list[F64]:
    """Postures that a search from random starts finds and `Robot.inverse` does not."""
    missing: list[F64] = []
    searched, ours = 0, 0
    for pose, found in zip(poses, search(robot, poses, angles(rng, len(poses), starts, 6)), strict=True):
        solutions, _, complete = robot.inverse(pose, report=True)
        assert complete
        missing += [q for q in found if not distance(solutions, q).min(initial=np.inf) < 1e-7]
        ours += int((smallest_singular_value(robot, solutions) > REGULAR).sum())
        searched += len(found)
    # The search is no oracle unless it finds nearly all there is.
    assert searched > 0.9 * ours
    return missing


def test_sixteen_solutions() -> None:
    # Manseur and Doty, A robot manipulator with 16 real inverse kinematic solution sets (1989).
    a, d = np.array([0.3, 1.0, 0.0, 1.5, 0.0, 0.0]), np.array([0.0, 0.0, 0.2, 0.0, 0.0, 0.0])
    alpha = np.deg2rad([90.0, 1.0, 90.0, 1.0, 90.0, 1.0])
    robot = rd.Robot.from_dh(a, d, alpha, np.zeros(6))
    pose = np.eye(4)
    pose[:3] = [
        [-0.760117, -0.641689, 0.102262, -1.140175],
        [0.133333, 0.0, 0.991071, 0.0],
        [-0.635959, 0.766965, 0.085558, 0.0],
    ]
    u, _, vt = np.linalg.svd(pose[:3, :3])
    pose[:3, :3] = u @ vt
    solutions, _, complete = robot.inverse(pose, report=True)
    check_solutions(robot, pose, solutions)
    assert complete
    assert len(solutions) == 16


@settings(max_examples=150)
@given(drawn=chains(6, 6, "R"))
def test_every_solution_of_any_chain_reproduces_the_pose(drawn: tuple[Chain, F64]) -> None:
    chain, q = drawn
    robot, pose = chain.robot(), chain.fk(q)
    solutions, singular, complete = robot.inverse(pose, report=True)
    assert singular.shape == (len(solutions),)
    assert singular.dtype == np.bool_
    for row in solutions:
        np.testing.assert_allclose(chain.fk(row), pose, rtol=0, atol=2e-9)
    if complete and smallest_singular_value(robot, q) > REGULAR:
        assert distance(solutions, q).min(initial=np.inf) < 1e-7


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
    with pytest.raises(rd.InvalidValueError, match='"RPRRRR"'):
        robot.inverse(robot.fk(q), fixed={0: q[0]})


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


def _in_every_turn(robot: rd.Robot, solutions: F64) -> list[list[list[float]]]:
    """For each solution and joint, what is within the limits, nearest to the middle of the range first."""
    return [
        [
            sorted(
                (x + TWO_PI * k for k in range(-4, 5) if low <= x + TWO_PI * k <= high),
                key=lambda x, middle=(low + high) / 2: abs(x - middle),  # type: ignore[misc]
            )
            for x, low, high in zip(row, robot.q_min, robot.q_max, strict=True)
        ]
        for row in solutions
    ]


def _same_sets(got: F64, wanted: list[Any]) -> None:
    assert len(got) == len(wanted)
    unmatched = np.array(wanted).reshape(len(got), got.shape[1])
    for row in got:
        assert np.abs(unmatched - row).max(axis=1).min() < 1e-9
    for row in unmatched:
        assert np.abs(got - row).max(axis=1).min() < 1e-9


RANGES: dict[str, tuple[list[float], list[float]]] = {
    "data sheet": ([-165, -110, -110, -160, -120, -400], [165, 110, 70, 160, 120, 400]),
    "wide": ([-200, -170, -400, -180, -360, -180], [200, 300, 200, 500, 360, 540]),
    "off centre": ([0, -360, 90, 0, -90, 1000], [360, 0, 450, 720, 270, 1400]),
    "tight": ([-90, -90, -90, -90, -90, -90], [90, 90, 90, 90, 90, 90]),
}


@pytest.mark.parametrize("ranges", RANGES)
def test_limits_and_turns(ranges: str) -> None:
    robot = IRB120.with_limits(*np.deg2rad(RANGES[ranges]))
    free = IRB120.with_limits([-np.inf] * 6, [np.inf] * 6)
    found = 0
    for q in angles(np.random.default_rng(5), 30, 6):
        pose = robot.fk(q)
        everything = free.inverse(pose)
        assert (np.abs(everything) <= np.pi).all()
        inside = [row for row in _in_every_turn(robot, everything) if all(row)]
        _same_sets(robot.inverse(pose, limits=True), [[joint[0] for joint in row] for row in inside])
        in_every_way = [turned for row in inside for turned in itertools.product(*row)]
        for limits in (False, True):
            turned, singular, complete = robot.inverse(pose, limits=limits, turns=True, report=True)
            _same_sets(turned, in_every_way)
            assert singular.shape == (len(turned),)
            assert complete
        near = robot.inverse(pose)
        assert len(near) == len(everything)
        assert (np.abs(near - (robot.q_min + robot.q_max) / 2) <= np.pi + 1e-12).all()
        found += len(inside)
    assert found


def test_limit_on_one_side() -> None:
    # 0.1 + 2 pi is within the limits of joint 1, -3.04 + 2 pi too.
    robot = IRB120.with_limits([2.0] + [-np.inf] * 5, [np.inf] * 6)
    solutions = robot.inverse(POSE, limits=True)
    assert len(solutions) == 8
    assert (solutions >= robot.q_min).all()


def test_limits_with_an_arm_angle_that_are_off_centre() -> None:
    robot = KUKA.with_limits(np.zeros(7), np.full(7, TWO_PI))
    solutions = robot.inverse(POSE7, arm_angle=KUKA.arm_angle(Q7))
    assert len(solutions) == 8
    assert (np.abs(solutions - np.pi) <= np.pi).all()
    assert len(robot.inverse(POSE7, arm_angle=KUKA.arm_angle(Q7), limits=True)) == 8


def test_held_joint_is_never_turned() -> None:
    robot = KUKA.with_limits(np.full(7, -TWO_PI), np.full(7, TWO_PI))
    solutions = robot.inverse(POSE7, fixed={2: Q7[2]}, turns=True)
    assert len(solutions) == 8 * 2**6
    np.testing.assert_array_equal(solutions[:, 2], Q7[2])


def test_held_joint_beyond_its_limits() -> None:
    q = Q7.copy()
    q[2] = 3.1
    assert len(KUKA.inverse(KUKA.fk(q), fixed={2: 3.1})) == 8
    assert KUKA.inverse(KUKA.fk(q), fixed={2: 3.1}, limits=True).shape == (0, 7)


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
    "batch": (lambda: IRB120.inverse(POSE[None]), rd.ShapeError, r"pose.*\(1, 4, 4\)"),
    "flat": (lambda: IRB120.inverse(POSE.ravel()), rd.ShapeError, r"pose.*\(16,\)"),
    "text": (lambda: IRB120.inverse("x"), rd.InvalidValueError, "pose is 'x'"),
    "None": (lambda: IRB120.inverse(None), rd.ShapeError, "pose"),  # type: ignore[call-overload]
    "imaginary": (lambda: IRB120.inverse(POSE + 0j), rd.InvalidValueError, "(?s)pose.*real"),
    "NaN": (lambda: IRB120.inverse(_changed(1, 2, np.nan)), rd.NonFiniteError, r"pose\[6\] is NaN"),
    "infinite": (lambda: IRB120.inverse(_changed(0, 3, np.inf)), rd.NonFiniteError, r"pose\[3\] is inf"),
    "skew": (lambda: IRB120.inverse(_changed(0, 0, 0.9)), rd.InvalidValueError, r"pose.*rotation.*off by"),
    "mirror": (lambda: IRB120.inverse(np.diag([1.0, 1.0, -1.0, 1.0])), rd.InvalidValueError, r"pose.*off by -2"),
    "last row": (lambda: IRB120.inverse(_changed(3, 0, 1.0)), rd.InvalidValueError, r"pose.*last row \[1"),
    "three joints": (lambda: rd.robots.get("planar_3r").inverse(POSE), rd.InvalidValueError, '"RRR".*six revolute'),
    "prismatic": (lambda: rd.robots.get("stanford_arm").inverse(POSE), rd.InvalidValueError, '"RRPRRR".*six revolute'),
    "seven joints": (lambda: KUKA.inverse(POSE7), rd.InvalidValueError, '"RRRRRRR".*six revolute'),
    "two held": (lambda: KUKA.inverse(POSE7, fixed={0: 0.0, 1: 0.0}), rd.InvalidValueError, '"RRRRR".*six revolute'),
    "none held": (lambda: KUKA.inverse(POSE7, fixed={}), rd.InvalidValueError, '"RRRRRRR".*six revolute'),
    "held of six": (lambda: IRB120.inverse(POSE, fixed={0: 0.0}), rd.InvalidValueError, '"RRRRR".*six revolute'),
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
    assert rd.robots.get("stanford_arm").structure == "none"
    assert KUKA.with_fixed({2: 0.3}).structure == "wrist"
    assert rd.robots.get("baxter_left").with_fixed({2: 0.3}).structure == "general"
