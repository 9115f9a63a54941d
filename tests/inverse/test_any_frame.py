"""Arms without a closed form in frames that are special against their base, and arms that are singular everywhere."""

import numpy as np
import pytest
import redundancy as rd

from tests.reference.arms import angles, check_solutions, distance, search, smallest_singular_value
from tests.reference.special import (
    DEGREE,
    crx_10ia,
    general_arm,
    paired_arm,
    product_of_exponentials,
    real_arms,
    special_postures,
)
from tests.soak.frames import Row

DOWN = np.array(
    [
        [np.cos(35 * DEGREE), np.sin(35 * DEGREE), 0.0, 0.55],
        [np.sin(35 * DEGREE), -np.cos(35 * DEGREE), 0.0, 0.12],
        [0.0, 0.0, -1.0, 0.15],
        [0.0, 0.0, 0.0, 1.0],
    ]
)


def test_a_crx_points_straight_down_in_twelve_postures() -> None:
    """Twelve by Newton from 1500 random starts, with kinematics of its own; one of them by hand."""
    crx = crx_10ia()
    found, singular, complete = crx.inverse(DOWN, report=True)
    check_solutions(crx, DOWN, found)
    assert len(found) == 12
    assert complete
    assert not singular.any()
    by_hand = DEGREE * np.array([-152.23833, -5.61196, -160.70583, -180.0, -65.09387, 7.23833])
    assert distance(found, by_hand).min() < 1e-6


def test_a_path_that_points_straight_down_is_planned() -> None:
    """The worst condition number over the path is about 1.8."""
    crx = crx_10ia()
    path = rd.Toolpath(np.linspace([0.5, -0.15, 0.1], [0.5, 0.15, 0.1], 21), np.tile([0.0, 0.0, -1.0], (21, 1)))
    plan = rd.plan(crx, path, objective=rd.ConditionNumber(0.3), progress=False)
    assert plan.failure is None
    assert plan.condition_number.max() == pytest.approx(1.8, abs=0.1)


def test_an_even_number_is_found() -> None:
    """Eight postures, as 1e-12 m beside this frame; elimination alone finds seven."""
    crx = real_arms()[1]
    made_from = [
        *(0.5631310252903541, 2.582947304144498, -2.5383190696790185),
        *(-1.4749534121306103, -2.477718053089004, -1.9056397081774699),
    ]
    pose = crx.fk(np.array(made_from))
    found, _, complete = crx.inverse(pose, report=True)
    check_solutions(crx, pose, found)
    assert (len(found), complete) == (8, True)
    own_search = [
        *(0.4441090377745, 1.0123837657285, -0.5751496600243),
        *(2.0729218544517, 0.7203898367771, -2.5201284736142),
    ]
    assert distance(found, np.array(own_search)).min() < 1e-9


RIGHT = np.pi / 2.0


def _bent() -> rd.Robot:
    return rd.Robot.from_dh(
        [0.2951, 0.4270, 0, 0, 0, 0.1680],
        [0, 0.9954, 0.6455, 0, 0, 0],
        RIGHT * np.array([-1, 1, 1, 1, 1, -1]),
        np.zeros(6),
        name="bent",
    )


def _four_parallel(tilt: float) -> rd.Robot:
    def link(a: float, d: float, twist: float) -> np.ndarray:
        frame = np.eye(4)
        frame[1:3, 1:3] = [[np.cos(twist), -np.sin(twist)], [np.sin(twist), np.cos(twist)]]
        frame[:3, 3] = a, 0.0, d
        return frame

    rows = [(0, 0.2, 0), (0.3, 0.1, tilt), (0.25, 0.05, -tilt), (0.2, 0.1, tilt), (0.1, 0.1, 1.2), (0.05, 0.1, -1.3)]
    return rd.Robot.from_links(np.array([link(*row) for row in rows]), link(0.03, 0.1, 0.4), "RRRRRR")


def _coaxial(off: float) -> rd.Robot:
    return rd.Robot.from_dh(
        [off, 0.4, 0.1, 0.05, 0.2, 0.1], [0.3, 0.1, 0.2, 0.4, 0.1, 0.1], [off, 1.0, -0.7, 1.3, 0.9, 0.0], np.zeros(6)
    )


def _two_spheres() -> rd.Robot:
    x, y, z = np.eye(3)
    points = np.array([[0, 0, 0.3], [0, 0, 0], [0, 0, 0], [0, 0, 0.5], [0, 0, 0], [0, 0, 0]])
    return product_of_exponentials(np.array([z, y, x, z, y, x]), points, "two spherical joints")


def _elbow_held() -> rd.Robot:
    return rd.robots.get("kuka_iiwa14").with_fixed({3: 0.9})


EVERYWHERE = {
    "rank five": _bent(),
    "four axes parallel": _four_parallel(0.0),
    "four axes parallel to rounding": _four_parallel(1e-16),
    "coaxial": _coaxial(0.0),
    "coaxial to rounding": _coaxial(1e-16),
    "two spherical joints": _two_spheres(),
    "seven axes, the elbow held": _elbow_held(),
}


@pytest.mark.parametrize("name", EVERYWHERE)
def test_an_arm_that_is_singular_everywhere_has_some_postures(name: str) -> None:
    """They are flagged, and never said to be all."""
    robot = EVERYWHERE[name]
    for q in angles(np.random.default_rng(0), 50, 6):
        pose = robot.fk(q)
        found, singular, complete = robot.inverse(pose, report=True)
        assert len(found) >= 1
        assert singular.all()
        assert not complete
        assert np.abs(robot.fk(found) - pose).max() < 1e-9


def test_what_an_arm_that_is_singular_everywhere_cannot_reach() -> None:
    """Frames beside those that it reaches, and far away."""
    robot = _bent()
    far = np.eye(4)
    far[:3, 3] = 100.0, 0.0, 0.0
    assert len(robot.inverse(far)) == 0


FAMILIES = {robot.name: [robot] for robot in real_arms()}
FAMILIES["any six axes"] = [general_arm(np.random.default_rng([1, i])) for i in range(6)]
FAMILIES["pairs of axes"] = [paired_arm(np.random.default_rng([2, i])) for i in range(10)]


@pytest.mark.parametrize("name", FAMILIES)
def test_special_frames(name: str) -> None:
    """A fixed sample of what `python -m tests.soak frames` tries."""
    rng = np.random.default_rng(5)
    row = Row(name)
    for robot in FAMILIES[name]:
        row.add(robot, special_postures(robot, 180 // len(FAMILIES[name]), rng), rng, 1, lambda _: None)
    assert row.passed, row


def test_nearness_to_a_closed_form_does_not_tell() -> None:
    """An arm whose wrist is off by a micrometre to a centimetre has all postures that searches find."""
    rng = np.random.default_rng(8)
    ideal = rd.robots.get("fanuc_m710ic50")
    for off in (1e-6, 1e-5, 1e-4, 1e-3, 1e-2):
        links = ideal.links
        links[1:, :3, 3] += off * rng.standard_normal((5, 3))
        robot = rd.Robot.from_links(links, ideal.flange, ideal.joints)
        q = angles(rng, 12, 6)
        q[6:, 4] *= np.geomspace(1e-4, 1e-1, 6)
        poses = robot.fk(q)
        for pose, made_from, others in zip(poses, q, search(robot, poses, angles(rng, 12, 60, 6)), strict=True):
            found, _, complete = robot.inverse(pose, report=True)
            assert distance(found, made_from).min() < 1e-7
            if complete and smallest_singular_value(robot, found).min() > 1e-4:
                assert all(distance(found, other).min() < 1e-5 for other in others)
