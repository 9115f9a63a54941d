"""Names of branches and of singularities: against the determinant of the Jacobian, heights, singular values."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inverse.arms import CLOSED, IRB120, KUKA, UR5E, Q
from tests.inverse.test_inverse_singular import SINGULAR
from tests.reference.arms import angles, random_arm, smallest_singular_value
from tests.reference.chain import F64, random_frame

IRB2400 = rd.robots.get("abb_irb2400")
REGULAR = 1e-4


def _size(robot: rd.Robot) -> float:
    """The links in line."""
    ends = [*robot.links[1:, :3, 3], (robot.flange @ robot.tool)[:3, 3]]
    return float(sum(np.linalg.norm(end) for end in ends))


def _sign(name: str) -> int:
    """The product of the signs that three words stand for."""
    shoulder, elbow, wrist = name.split(", ")
    first = {"right": 1, "left": -1, "front": 1, "back": -1}[shoulder]
    # "up" is told with the wrist ahead: what turns with the shoulder is not the elbow's own factor.
    return first * (first if elbow == "up" else -first) * (1 if wrist == "no flip" else -1)


@pytest.mark.parametrize("name", CLOSED)
def test_words_are_the_signs_of_the_determinant(name: str) -> None:
    rng = np.random.default_rng(1)
    robot = rd.robots.get(name).with_base(random_frame(rng)).with_tool(random_frame(rng))
    q = angles(rng, 500, 6)
    q = q[smallest_singular_value(robot, q) > REGULAR]
    signs = np.sign(np.linalg.det(robot.jacobian(q))) * [_sign(robot.branch(row)) for row in q]
    assert (signs == signs[0]).all()


@pytest.mark.parametrize("name", CLOSED)
def test_postures_of_a_pose_have_names_of_their_own_in_one_order(name: str) -> None:
    robot, orders = rd.robots.get(name), set()
    for q in angles(np.random.default_rng(2), 100, 6):
        postures, singular, _ = robot.inverse(robot.fk(q), report=True)
        names = [robot.branch(posture) for posture in postures]
        assert singular.any() or len(set(names)) == len(names)
        assert robot.branch(q) in names
        if len(names) == 8:
            orders.add(tuple(names))
    assert len(orders) == 1


@given(seed=st.integers(0, 2**32), name=st.sampled_from(CLOSED))
@settings(max_examples=30, deadline=None)
def test_words_change_at_singularities_alone(seed: int, name: str) -> None:
    robot = rd.robots.get(name)
    first, last = angles(np.random.default_rng(seed), 2, 6)
    path = first + np.linspace(0.0, 1.0, 400)[:, None] * (last - first)
    names = [robot.branch(q) for q in path]
    for i in [i for i in range(399) if names[i] != names[i + 1]]:
        low, high = path[i], path[i + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if robot.branch(middle) == names[i] else (low, middle)
        assert smallest_singular_value(robot, low) < 1e-9
        kind = robot.singularity(low).kind.split(", ")
        changed = [a != b for a, b in zip(robot.branch(low).split(", "), robot.branch(high).split(", "), strict=True)]
        # With the wrist behind, what was above the line is below it.
        told = {"shoulder": changed[0], "elbow": changed[1] != changed[0], "wrist": changed[2]}
        assert [word for word, there in told.items() if there] == kind


def test_elbow_and_shoulder_are_where_the_words_say() -> None:
    for robot in (IRB120, IRB2400):
        for q in angles(np.random.default_rng(3), 200, 6):
            frames = robot.link_frames(q)
            shoulder, elbow, wrist = (frames[i, :3, 3] for i in (1, 2, 4))
            ahead = np.array([wrist[0], wrist[1], 0.0]) / np.hypot(wrist[0], wrist[1])
            along = (wrist - shoulder) @ ahead
            if abs(along) < 1e-3 or smallest_singular_value(robot, q) < REGULAR:
                continue
            # Height of the elbow above the line from shoulder to wrist, the way that the line leads outwards.
            share = ((elbow - shoulder) @ ahead) / along
            above = (elbow[2] - shoulder[2] - share * (wrist[2] - shoulder[2])) * np.sign(along)
            words = robot.branch(q).split(", ")
            assert words[1] == ("up" if above > 0.0 else "down")
            if robot is IRB2400:
                assert words[0] == ("front" if ahead @ frames[1, :3, 3] > 0.0 else "back")
            # Both have joint 5 at 0 in line.
            assert words[2] == ("no flip" if np.sin(q[4]) > 0.0 else "flip")


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_words_do_not_hang_on_the_sense_of_an_axis(axis: int) -> None:
    turn, links = np.diag([1.0, -1.0, -1.0, 1.0]), IRB2400.links.copy()
    links[axis] = links[axis] @ turn
    links[axis + 1] = turn @ links[axis + 1]
    other = rd.Robot.from_links(links, IRB2400.flange, IRB2400.joints, tool=IRB2400.tool, base=IRB2400.base)
    for q in angles(np.random.default_rng(5), 50, 6):
        back = q.copy()
        back[axis] *= -1.0
        np.testing.assert_allclose(other.fk(back), IRB2400.fk(q), atol=1e-12)
        assert other.branch(back) == IRB2400.branch(q)


def test_branches_without_names() -> None:
    arm = random_arm(np.random.default_rng(9), "general").robot()
    assert arm.branch(Q) == "none"
    assert KUKA.branch(np.zeros(7)) == "none"
    assert random_arm(np.random.default_rng(1), "wrist", 0).robot().branch(Q) == "none"
    for wrong in (Q[:5], Q[None]):
        with pytest.raises(rd.ShapeError, match="q"):
            IRB120.branch(wrong)


@pytest.mark.parametrize("case", SINGULAR)
def test_names_of_singularities(case: str) -> None:
    robot, constraints = SINGULAR[case]
    kinds = {"wrist": "wrist", "axis 6": "wrist", "elbow": "elbow", "shoulder": "shoulder", "all three": "all"}
    wanted = {kind for words, kind in kinds.items() if words in case}
    wanted = {"shoulder", "elbow", "wrist"} if "all" in wanted else wanted
    for q in np.random.default_rng(4).uniform(-1.2, 1.2, (40, 6)):
        assert robot.singularity(q).kind == "regular"
        for constraint in constraints:
            q = constraint(q)
        found = robot.singularity(q)
        assert wanted <= set(found.kind.split(", "))
        assert found.value < 1e-14
        assert found.joints is not None
        assert np.linalg.norm(robot.jacobian(q) @ found.joints) < 1e-14


@pytest.mark.parametrize("name", [*rd.robots.names(), "general"])
def test_value_and_directions(name: str) -> None:
    robot = random_arm(np.random.default_rng(9), "general").robot() if name == "general" else rd.robots.get(name)
    size, n = _size(robot), robot.n
    unit = np.array([1.0, 1.0, 1.0, 1.0 / size, 1.0 / size, 1.0 / size])
    counted = np.where(np.array(list(robot.joints)) == "P", size, 1.0)
    for q in robot.random_postures(20, 1):
        j: F64 = unit[:, None] * robot.jacobian(q) * counted
        found = robot.singularity(q)
        np.testing.assert_allclose(found.value, np.linalg.svd(j, compute_uv=False)[-1], rtol=1e-9, atol=1e-14)
        if n >= 6:
            assert found.twist is not None
            np.testing.assert_allclose(np.linalg.norm(found.twist), 1.0, rtol=1e-12)
            np.testing.assert_allclose(np.linalg.norm(found.twist @ j), found.value, rtol=1e-9, atol=1e-14)
        else:
            assert found.twist is None
        if n <= 6:
            assert found.joints is not None
            np.testing.assert_allclose(np.linalg.norm(found.joints), 1.0, rtol=1e-12)
            np.testing.assert_allclose(np.linalg.norm(j @ found.joints), found.value, rtol=1e-9, atol=1e-14)
        else:
            assert found.joints is None


def test_singular_where_words_mean_nothing() -> None:
    straight = np.array([0.3, 0.5, 0.1, 0.0, 0.2, 0.0, 0.4])
    found = KUKA.singularity(straight)
    assert found.kind == "singular"
    assert found.twist is not None
    assert KUKA.singularity(straight + 0.4).kind == "regular"
    # With the arm straight and the wrist in line a motion of the tool is lost.
    j = np.vstack([KUKA.jacobian(straight)[:3], KUKA.jacobian(straight)[3:] / _size(KUKA)])
    np.testing.assert_allclose(found.twist @ j, 0.0, atol=1e-14)


def test_tolerance_of_a_singularity() -> None:
    q = Q.copy()
    q[4] = 1e-4
    assert IRB120.singularity(q).kind == "regular"
    assert IRB120.singularity(q, tolerance=1e-3).kind == "wrist"
    for wrong in (0.0, -1.0, np.nan):
        with pytest.raises(rd.InvalidValueError, match="tolerance"):
            IRB120.singularity(q, tolerance=wrong)
    with pytest.raises(rd.NonFiniteError, match="q"):
        UR5E.singularity(Q + np.nan)
