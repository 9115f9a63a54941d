"""Inverse solutions within limits, in every whole turn."""

import itertools
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.inverse.arms import IRB120, KUKA, POSE, POSE7, Q7
from tests.reference.arms import (
    TWO_PI,
    angles,
)
from tests.reference.chain import F64


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
