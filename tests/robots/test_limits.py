"""Limits on combinations of joints: the model, files, cells, distances, whole turns, random postures."""

import pickle
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference.chain import F64

UR5E, PANDA = rd.robots.get("ur5e"), rd.robots.get("panda")
ELBOW = ({1: 1.0, 2: 1.0}, -2.0, 0.5)
TURN = 2.0 * np.pi


def test_they_are_part_of_the_robot(tmp_path: Path) -> None:
    assert UR5E.coupled_limits == []
    robot = UR5E.with_limits(coupled=[ELBOW, ({0: -0.5}, -np.inf, 1.0)])
    assert robot.coupled_limits == [ELBOW, ({0: -0.5}, -np.inf, 1.0)]
    assert robot != UR5E
    assert pickle.loads(pickle.dumps(robot)) == robot
    assert robot.with_limits(qd_max=np.ones(6)).coupled_limits == robot.coupled_limits
    assert robot.with_limits(coupled=[]) == UR5E
    rd.robots.save(robot, tmp_path / "arm.toml")
    assert rd.robots.load(tmp_path / "arm.toml") == robot
    assert UR5E.dh is not None
    table = {key: UR5E.dh[key] for key in ("a", "d", "alpha", "theta")}
    assert rd.Robot.from_dh(**table, coupled=[ELBOW]).coupled_limits == [ELBOW]
    assert rd.Robot.from_links(UR5E.links, UR5E.flange, "RRRRRR", coupled=[ELBOW]).coupled_limits == [ELBOW]


@pytest.mark.parametrize(
    ("coupled", "message"),
    [
        (5, "coupled is 5, expected"),
        ([(1, 2)], r"coupled\[0\] is \(1, 2\), expected"),
        ([ELBOW, ({6: 1.0}, 0.0, 1.0)], r"coupled\[1\] is joint 6, expected joints from 0 to 5"),
        ([({1: 0.0}, 0.0, 1.0)], "a coefficient other than 0"),
        ([({1: np.inf}, 0.0, 1.0)], r"coupled\[0\]\[1\] is inf"),
        ([({1: -1.0, 2: 1.0}, 1.0, 0.5)], r"the limits of joint 3 - joint 2 is 1 to 0.5, expected a lower limit below"),
        ([({1: 1.0}, np.nan, 0.5)], "NaN to 0.5"),
        ([({1: 1.0}, -np.inf, np.inf)], "one of them finite"),
        ([ELBOW] * 9, "9 combinations, expected at most 8"),
    ],
)
def test_what_is_none_is_refused(coupled: Any, message: str) -> None:
    with pytest.raises(rd.RedundancyError, match=message):
        UR5E.with_limits(coupled=coupled)


def test_held_joints_move_the_limits() -> None:
    robot = UR5E.with_limits(coupled=[ELBOW, ({2: 1.0}, -1.0, 1.0)])
    assert robot.with_fixed({2: 0.25}).coupled_limits == [({1: 1.0}, -2.25, 0.25)]
    assert robot.with_fixed({0: 0.25}).coupled_limits == [({0: 1.0, 1: 1.0}, -2.0, 0.5), ({1: 1.0}, -1.0, 1.0)]


def test_cells_count_their_own_joint_first() -> None:
    robot = UR5E.with_limits(coupled=[ELBOW])
    shifted = [({2: 1.0, 3: 1.0}, -2.0, 0.5)]
    assert rd.robots.on_rail(robot, (1.0, 0.0, 0.0), 0.0, 2.0).coupled_limits == shifted
    assert rd.robots.with_turntable(robot, np.eye(4), -1.0, 1.0).coupled_limits == shifted


def test_files_in_degrees_and_millimetres(tmp_path: Path) -> None:
    arm = rd.robots.on_rail(UR5E, (1.0, 0.0, 0.0), 0.0, 2.0)
    rd.robots.save(arm, tmp_path / "arm.toml")
    text = (tmp_path / "arm.toml").read_text()

    def limits(entry: str) -> rd.Robot:
        (tmp_path / "coupled.toml").write_text(text.replace("[limits]", f"[limits]\ncoupled = [{entry}]"))
        return rd.robots.load(tmp_path / "coupled.toml")

    assert limits("{row = [0, 0, 1, 1, 0, 0, 0], high = 2}").coupled_limits == [({2: 1.0, 3: 1.0}, -np.inf, 2.0)]
    text = text.replace('length = "m"\nangle = "rad"', 'length = "mm"\nangle = "deg"')
    assert 'angle = "deg"' in text
    (got,) = limits("{row = [0, 0, -1, 1, 0, 0, 0], low = -90, high = 45}").coupled_limits
    assert got[0] == {2: -1.0, 3: 1.0}
    np.testing.assert_allclose(got[1:], [-np.pi / 2.0, np.pi / 4.0], rtol=1e-15)
    # 500 mm + 10 mm a degree: counted in the unit of the rail.
    (got,) = limits("{row = [1, 10, 0, 0, 0, 0, 0], low = -500, high = 500}").coupled_limits
    np.testing.assert_allclose([got[0][0], got[0][1], *got[1:]], [1.0, 0.01 * 180.0 / np.pi, -0.5, 0.5], rtol=1e-15)
    for entry, message in (
        ("{row = [0, 1], low = 0}", "7 finite numbers"),
        ("{row = [0, 0, 0, 0, 0, 0, 0], low = 0}", "a coefficient other than 0"),
        ("{row = [0, 1, 0, 0, 0, 0, 0], lower = 0}", "did you mean low"),
        ("3", "a list of tables"),
    ):
        with pytest.raises(rd.ModelError, match=message):
            limits(entry)


def test_distance_is_that_to_the_plane_of_the_limit() -> None:
    rng = np.random.default_rng(0)
    row = np.array([0.0, 2.0, -1.0, 0.5, 0.0, 0.0])
    robot = UR5E.with_limits(
        np.full(6, -np.inf), np.full(6, np.inf), coupled=[({j: row[j] for j in (1, 2, 3)}, -1.0, np.inf)]
    )
    normal = row / np.linalg.norm(row)
    postures = rng.uniform(-3.0, 3.0, (50, 6))
    margins = robot.limit_margin(postures)
    on_the_plane = postures - margins[:, None] * normal
    np.testing.assert_allclose(on_the_plane @ row, -1.0, atol=1e-14)
    np.testing.assert_array_equal(robot.within_limits(postures), margins >= -1e-9)
    assert robot.limit_margin(postures[0]) == margins[0]
    assert bool(robot.within_limits(on_the_plane[0] - 0.9e-9 * normal))
    assert not robot.within_limits(on_the_plane[0] - 1.1e-9 * normal)
    narrow = UR5E.with_limits(coupled=[({1: 1.0}, -10.0, 10.0)])
    np.testing.assert_array_equal(narrow.limit_margin(postures), UR5E.limit_margin(postures))


@pytest.mark.parametrize("width", [1.0, 1e-2, 1e-6])
def test_random_postures_are_within(width: float) -> None:
    robot = PANDA.with_limits(coupled=[({1: 1.0, 3: 1.0}, -1.0, width - 1.0), ({0: 1.0, 2: -1.0, 4: 1.0}, 2.0, np.inf)])
    postures = robot.random_postures(300, seed=1)
    assert robot.within_limits(postures).all()
    assert ((postures >= robot.q_min) & (postures <= robot.q_max)).all()
    np.testing.assert_array_equal(postures, robot.random_postures(300, seed=1))


def copies(robot: rd.Robot, q: F64) -> F64:
    """All copies of a posture by whole turns within its limits, by trying each."""
    turns = [TURN * np.arange(-4, 5)] * robot.n
    each = [x + shift[(x + shift >= low) & (x + shift <= high)] for x, shift, low, high in
            zip(q, turns, robot.q_min, robot.q_max, strict=True)]  # fmt: skip
    every = np.array(list(product(*each))).reshape(-1, robot.n)
    for row, low, high in robot.coupled_limits:
        value = sum(c * every[:, j] for j, c in row.items())
        every = every[(value >= low) & (value <= high)]
    return every


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_whole_turns_are_those_within_all_limits(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wide = np.array([1.6, 0.4, 1.2, 0.9, 1.4, 0.6]) * TURN
    middle = rng.uniform(-3.0, 3.0, 6)
    q = rng.uniform(middle - 0.5 * wide, middle + 0.5 * wide)
    i, j = rng.choice(6, 2, replace=False)
    value = q[i] - q[j]
    coupled = [({int(i): 1.0, int(j): -1.0}, value - rng.uniform(0.1, 4.0), value + rng.uniform(0.1, 4.0))]
    robot = UR5E.with_limits(middle - 0.5 * wide, middle + 0.5 * wide, coupled=coupled)
    pose = robot.fk(q)
    got = robot.inverse(pose, turns=True)
    expected = np.vstack([copies(robot, x) for x in robot.inverse(pose)])
    assert len(got) == len(expected)
    for x in expected:
        assert np.abs(got - x).max(axis=1).min() < 1e-12
    # Of each posture the copy nearest to the middle, where there is one.
    nearest = robot.inverse(pose, limits=True)
    every = [copies(robot, x) for x in robot.inverse(pose)]
    best = [x[np.square(x - middle).sum(axis=1).argmin()] for x in every if len(x)]
    assert len(nearest) == len(best)
    np.testing.assert_allclose(nearest, best, atol=1e-12)
    for x, other in zip(best, [x for x in every if len(x)], strict=True):
        np.testing.assert_allclose(robot.turned(other[-1]), x, atol=1e-12)


def test_a_joint_without_end_is_bounded_by_its_combination() -> None:
    low, high = UR5E.q_min.copy(), UR5E.q_max.copy()
    low[5], high[5], low[4], high[4] = -np.inf, np.inf, -1.0, 1.0
    robot = UR5E.with_limits(low, high, coupled=[({4: 1.0, 5: 1.0}, 10.0, 10.0 + 1.5 * TURN)])
    q = np.array([0.3, -1.2, 1.5, -0.9, 0.7, 11.0])
    found = robot.inverse(robot.fk(q), turns=True)
    assert robot.within_limits(found).all()
    assert np.abs(found - q).max(axis=1).min() < 1e-12
    assert np.ptp(found[:, 5]) > 6.0


def test_postures_chosen_for_their_own_sake_prefer_those_within() -> None:
    free = rd.minimum_condition_posture(UR5E, starts=8)
    # Two postures of the same condition, elbow up and down: one of them is refused, in every whole turn.
    rest = UR5E.with_limits(np.full(6, -np.pi), np.full(6, np.pi))
    sign = 1.0 if rest.turned(free.q)[2] > 0.0 else -1.0
    robot = rest.with_limits(coupled=[({2: -sign, 3: 1e-9}, 0.05, np.inf)])
    found = rd.minimum_condition_posture(robot, starts=24)
    assert found.within_limits
    assert robot.within_limits(found.q)
    assert found.condition_number == pytest.approx(free.condition_number, rel=1e-6)
    tight = UR5E.with_limits(coupled=[({2: 1.0, 3: 1e-3}, 0.0, 1e-3)])
    assert not rd.minimum_condition_posture(tight, starts=3).within_limits
