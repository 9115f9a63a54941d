"""All inverse solutions of six joints: postures that poses were made from, and a search that knows no geometry."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings

from tests.inverse.arms import SIX
from tests.reference.arms import (
    PLACES,
    angles,
    check_solutions,
    distance,
    random_arm,
    search,
    smallest_singular_value,
)
from tests.reference.chain import F64, Chain, chains, random_frame

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
    if name.startswith("fanuc_crx"):
        assert robot.structure != "wrist"
    else:
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
