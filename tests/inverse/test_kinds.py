"""Robots that are not six revolute joints: prismatic joints, fewer joints, tasks that leave some of the frame free."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference.arms import search
from tests.reference.chain import F64, Chain, random_frame

AXIS, POSITION, FULL = rd.Task.axisymmetric(), rd.Task.position(), rd.Task.full()
STANFORD = rd.robots.get("stanford_arm")
QUARTER = np.pi / 2
REGULAR = 1e-3
"""Least singular value of a posture that has to be found."""


def wrist_chain(rng: np.random.Generator, arm: str, place: int, special: bool) -> Chain:
    """Return six joints with a spherical wrist as joints `place` to `place + 2` among the three of `arm`."""
    joints = arm[:place] + "RRR" + arm[place:]
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    alpha, theta = rng.uniform(-np.pi, np.pi, (2, 6))
    if special:
        a[rng.random(6) < 0.5], d[rng.random(6) < 0.5] = 0.0, 0.0
        right = rng.random(6) < 0.7
        alpha[right] = rng.integers(-1, 3, int(right.sum())) * np.pi / 2
        theta[rng.random(6) < 0.5] = 0.0
    a[place : place + 2], d[place + 1] = 0.0, 0.0
    for i in (place, place + 1):
        if abs(np.sin(alpha[i])) < 0.3:
            alpha[i] = np.pi / 2
    return Chain(a, d, alpha, theta, joints, base=random_frame(rng), tool=random_frame(rng))


def any_posture(rng: np.random.Generator, joints: str, special: bool = False) -> F64:
    """Return angles within half a turn and slides within half a metre; right angles and zeros often if special."""
    q = np.where(
        [kind == "R" for kind in joints], rng.uniform(-np.pi, np.pi, len(joints)), rng.uniform(-0.5, 0.5, len(joints))
    )
    if special:
        rare = rng.random(len(joints)) < 0.5
        angles = rng.integers(-1, 2, len(joints)) * np.pi / 2
        q = np.where(rare, np.where([kind == "R" for kind in joints], angles, 0.0), q)
    return q


def apart(postures: F64, q: F64, joints: str) -> F64:
    """Return how far postures are from another one, whole turns of revolute joints apart: the largest coordinate."""
    difference = postures - q
    turning = np.array([kind == "R" for kind in joints])
    difference[..., turning] -= 2 * np.pi * np.round(difference[..., turning] / (2 * np.pi))
    largest: F64 = np.abs(difference).max(axis=-1, initial=0.0)
    return largest


def task_rows(chain: Chain, q: F64, pose: F64, kind: str) -> tuple[F64, F64]:
    """Return what is missing to a pose and the Jacobian of it, as far as a task looks at it."""
    tool, jacobian = chain.fk(q), chain.derivatives(q)[0]
    turn = pose[:3, :3] @ tool[:3, :3].T
    w = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    v = pose[:3, 3] - tool[:3, 3]
    if kind == "position":
        return v, jacobian[3:]
    if kind == "full":
        return np.append(w, v), jacobian
    across = np.eye(3) - np.outer(tool[:3, 2], tool[:3, 2])
    return np.append(np.cross(tool[:3, 2], pose[:3, 2]), v), np.vstack([across @ jacobian[:3], jacobian[3:]])


def smallest(chain: Chain, q: F64, pose: F64, kind: str) -> float:
    """Return the smallest singular value of a posture for its task, one for each joint."""
    sigma = np.linalg.svd(task_rows(chain, q, pose, kind)[1], compute_uv=False)
    return float(sigma[chain.n - 1]) if len(sigma) >= chain.n else 0.0


def does(chain: Chain, q: F64, pose: F64, kind: str, tolerance: float = 1e-8) -> bool:
    """Whether a posture does the task, by products of matrices."""
    tool = chain.fk(q)
    turned = {"full": tool[:3, :3] - pose[:3, :3], "axis": tool[:3, 2] - pose[:3, 2], "position": np.zeros(1)}[kind]
    return bool(np.abs(turned).max() < tolerance and np.abs(tool[:3, 3] - pose[:3, 3]).max() < tolerance)


@settings(max_examples=150, deadline=None)
@given(st.text("RP", min_size=3, max_size=3), st.integers(0, 3), st.integers(0, 2**32 - 1), st.booleans())
def test_wrist_with_any_arm(arm: str, place: int, seed: int, special: bool) -> None:
    rng = np.random.default_rng(seed)
    chain = wrist_chain(rng, arm, place, special)
    robot = chain.robot()
    q = any_posture(rng, chain.joints, special)
    pose = chain.fk(q)
    if robot.structure == "none":
        with pytest.raises(rd.InvalidValueError, match="of which the task takes"):
            robot.inverse(pose)
        return
    solutions, singular, complete = robot.inverse(pose, report=True)
    assert robot.structure in ("sliding" if arm == "PPP" else "wrist", "parallel")
    assert all(does(chain, x, pose, "full") for x in solutions)
    if smallest(chain, q, pose, "full") > REGULAR:
        assert apart(solutions, q, chain.joints).min(initial=np.inf) < 1e-7
        assert complete or singular.any() or arm == "RRR"
    elif arm != "RRR":
        assert len(solutions)


@pytest.mark.parametrize("arm", ["RRP", "RPR", "PRR", "RPP", "PRP", "PPR", "PPP"])
def test_none_is_missing(arm: str) -> None:
    rng = np.random.default_rng(5)
    for place in range(4):
        chain = wrist_chain(rng, arm, place, special=place % 2 == 1)
        robot = chain.robot()
        if robot.structure == "none":
            continue
        poses = np.stack([chain.fk(any_posture(rng, chain.joints)) for _ in range(2)])
        starts = np.stack([any_posture(rng, chain.joints) for _ in range(600)]).reshape(2, 300, 6)
        for pose, found in zip(poses, search(robot, poses, starts), strict=True):
            solutions, _, complete = robot.inverse(pose, report=True)
            assert complete
            assert all(apart(solutions, x, chain.joints).min(initial=np.inf) < 1e-6 for x in found)
            assert len(solutions) % 2 == 0


def test_an_offset_wrist_with_a_slide_is_searched() -> None:
    rng = np.random.default_rng(6)
    for joints in ("RRPRRR", "RPRPRR", "PRRRRR"):
        a, d = rng.uniform(-0.5, 0.5, (2, 6))
        alpha, theta = rng.uniform(-np.pi, np.pi, (2, 6))
        chain = Chain(a, d, alpha, theta, joints)
        robot = chain.robot()
        assert robot.structure == "search"
        for _ in range(10):
            q = any_posture(rng, joints)
            solutions, _, complete = robot.inverse(chain.fk(q), report=True)
            assert not complete
            assert all(does(chain, x, chain.fk(q), "full") for x in solutions)
            assert apart(solutions, q, joints).min(initial=np.inf) < 1e-6


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(["full", "axis", "position"]), st.integers(0, 2**32 - 1), st.booleans())
def test_as_many_joints_as_the_task_takes_or_fewer(kind: str, seed: int, special: bool) -> None:
    rng = np.random.default_rng(seed)
    task = {"full": FULL, "axis": AXIS, "position": POSITION}[kind]
    n = int(rng.integers(1, task.dimension + 1))
    joints = "".join(rng.choice(["R", "P"], n, p=[0.7, 0.3]))
    a, d = rng.uniform(-0.5, 0.5, (2, n))
    alpha, theta = rng.uniform(-np.pi, np.pi, (2, n))
    if special:
        a[rng.random(n) < 0.5], d[rng.random(n) < 0.5] = 0.0, 0.0
        alpha = rng.integers(-1, 3, n) * np.pi / 2
    chain = Chain(a, d, alpha, theta, joints, tool=random_frame(rng))
    q = any_posture(rng, joints, special)
    pose = chain.fk(q)
    # What the task leaves free may be anything.
    spin = np.eye(4)
    spin[:2, :2] = np.array([[0.6, -0.8], [0.8, 0.6]])
    pose = {"full": pose, "axis": pose @ spin, "position": np.vstack([np.c_[np.eye(3), pose[:3, 3]], [0, 0, 0, 1]])}[
        kind
    ]
    ranks = [np.linalg.matrix_rank(task_rows(chain, x, pose, kind)[1], 1e-9) for x in rng.uniform(-1, 1, (4, n))]
    if max(ranks) < n and joints != "RRRRRR":
        with pytest.raises(rd.InvalidValueError, match="of which the task takes"):
            chain.robot().inverse(pose, task=task)
        return
    solutions = chain.robot().inverse(pose, task=task)
    assert all(does(chain, x, pose, kind, 1e-7) for x in solutions)
    if smallest(chain, q, pose, kind) > REGULAR:
        assert apart(solutions, q, joints).min(initial=np.inf) < 1e-6
    elif n < 6:
        assert len(solutions)


@pytest.mark.parametrize(
    ("joints", "kind"), [("RRRRR", "axis"), ("RRPPP", "axis"), ("RRR", "position"), ("RPR", "position")]
)
def test_none_is_missing_for_a_task(joints: str, kind: str) -> None:
    rng = np.random.default_rng(8)
    n = len(joints)
    a, d = rng.uniform(-0.5, 0.5, (2, n))
    alpha, theta = rng.uniform(-np.pi, np.pi, (2, n))
    chain = Chain(a, d, alpha, theta, joints, tool=random_frame(rng))
    pose = chain.fk(any_posture(rng, joints))
    solutions, _, complete = chain.robot().inverse(pose, task=AXIS if kind == "axis" else POSITION, report=True)
    assert complete
    assert len(solutions) % 2 == 0
    for _ in range(25):
        q = any_posture(rng, joints)
        for _ in range(60):
            error, jacobian = task_rows(chain, q, pose, kind)
            damping = min(1e-2, float(error @ error)) + 1e-14
            step = np.linalg.solve(jacobian.T @ jacobian + damping * np.eye(n), jacobian.T @ error)
            q = q + step / max(1.0, np.abs(step).max() / 0.7)
            if np.abs(error).max() < 1e-12:
                break
        if does(chain, q, pose, kind, 1e-11) and smallest(chain, q, pose, kind) > REGULAR:
            assert apart(solutions, q, joints).min(initial=np.inf) < 1e-6


@pytest.mark.parametrize("order", ["RRRP", "RRPR", "RPRR", "PRRR"])
def test_scara(order: str) -> None:
    # Two links, a turn and a quill, all along z; the quill may be anywhere.
    l1, l2 = 0.4, 0.3
    a = {"RRRP": [l1, l2, 0, 0], "RRPR": [l1, l2, 0, 0], "RPRR": [l1, 0, l2, 0], "PRRR": [0, l1, l2, 0]}[order]
    robot = rd.Robot.from_dh(a, [0.0] * 4, [0.0] * 4, [0.0] * 4, order)
    pose = np.eye(4)
    x, y, z, angle = 0.35, 0.25, -0.1, 0.7
    c, s = np.cos(angle), np.sin(angle)
    pose[:3] = [[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z]]
    solutions, singular, complete = robot.inverse(pose, report=True)
    # By the law of cosines.
    elbow = np.arccos((x * x + y * y - l1 * l1 - l2 * l2) / (2 * l1 * l2))
    wanted = []
    for q2 in (elbow, -elbow):
        q1 = np.arctan2(y, x) - np.arctan2(l2 * np.sin(q2), l1 + l2 * np.cos(q2))
        turns = iter([q1, q2, angle - q1 - q2])
        wanted.append([next(turns) if kind == "R" else z for kind in order])
    assert complete
    assert not singular.any()
    assert solutions.shape == (2, 4)
    assert all(apart(solutions, np.array(q), order).min() < 1e-12 for q in wanted)
    tilted = pose.copy()
    tilted[:3, :3] = pose[:3, :3] @ [[1, 0, 0], [0, np.cos(0.1), -np.sin(0.1)], [0, np.sin(0.1), np.cos(0.1)]]
    assert len(robot.inverse(tilted)) == 0
    # The tool's axis alone leaves the last turn to spare.
    with pytest.raises(rd.InvalidValueError, match="takes 3"):
        robot.inverse(pose, task=AXIS)
    last = order.rindex("R")
    assert robot.inverse(pose, task=AXIS, fixed={last: 0.3}).shape == (2, 4)


def gantry() -> tuple[Chain, F64]:
    """Return slides along x, y and z, then turns about z, y and z; and the reach of the hand beyond the wrist [m]."""
    q = np.pi / 2
    # Rows: x along the base's x, then y, then z.
    chain = Chain(
        np.zeros(6),
        np.array([0, 0, 0, 0, 0, 0.2]),
        np.array([q, q, 0, -q, q, 0]),
        np.array([q, q, 0, 0, 0, 0]),
        "PPPRRR",
    )
    return chain, np.array([0.0, 0.0, 0.2])


def test_gantry_by_hand() -> None:
    chain, reach = gantry()
    robot = chain.robot()
    assert robot.structure == "sliding"
    slides = np.array([chain.fk(np.eye(6)[i])[:3, 3] - chain.fk(np.zeros(6))[:3, 3] for i in range(3)]).T
    assert np.linalg.matrix_rank(slides) == 3
    q = np.array([0.3, -0.2, 0.5, 0.7, 0.9, -1.1])
    pose = chain.fk(q)
    solutions, singular, complete = robot.inverse(pose, report=True)
    # The wrist's flip, and the slides that put its centre there.
    flipped = np.array([*q[:3], q[3] + np.pi, -q[4], q[5] + np.pi])
    assert complete
    assert not singular.any()
    assert len(solutions) == 2
    for wanted in (q, flipped):
        assert apart(solutions, wanted, "PPPRRR").min() < 1e-12
    centre = pose[:3, 3] - pose[:3, :3] @ reach
    base = chain.fk(np.zeros(6))[:3, 3] - chain.fk(np.zeros(6))[:3, :3] @ reach
    np.testing.assert_allclose(np.linalg.solve(slides, centre - base), q[:3], atol=1e-12)
    # Straight: the outer turns of the wrist are one.
    solutions, singular, complete = robot.inverse(chain.fk(np.array([0.3, -0.2, 0.5, 0.7, 0.0, -1.1])), report=True)
    assert len(solutions) == 1
    assert singular.all()
    assert not complete
    np.testing.assert_allclose(solutions[0, 3] + solutions[0, 5], -0.4, atol=1e-9)


def test_stanford_arm() -> None:
    rng = np.random.default_rng(9)
    assert STANFORD.structure == "wrist"
    low, high = STANFORD.q_min, STANFORD.q_max
    for q in rng.uniform(low, high, (200, 6)):
        solutions, _, complete = STANFORD.inverse(STANFORD.fk(q), report=True)
        assert complete
        assert apart(solutions, q, "RRPRRR").min() < 1e-9
        inside = STANFORD.inverse(STANFORD.fk(q), limits=True)
        assert ((inside >= low) & (inside <= high)).all()
        assert 1 <= len(inside) <= len(solutions)
        turned = STANFORD.inverse(STANFORD.fk(q), turns=True)
        assert len(turned) >= len(inside)


def test_singular_places_of_polar_and_cylindrical_arms() -> None:
    polar = rd.Robot.from_dh(
        [0.0] * 6, [0.4, 0, 0, 0, 0, 0.1], [-QUARTER, QUARTER, 0, -QUARTER, QUARTER, 0], [0.0] * 6, "RRPRRR"
    )
    # The wrist's centre on axis 1: the first turn is free.
    q = np.array([0.4, 0.0, 0.5, 0.3, 0.6, -0.2])
    solutions, singular, complete = polar.inverse(polar.fk(q), report=True)
    assert len(solutions)
    assert singular.any()
    assert not complete
    assert np.abs(polar.fk(solutions) - polar.fk(q)).max() < 1e-9
    # The wrist in the shoulder: two are free.
    q[2] = 0.0
    solutions, singular, _ = polar.inverse(polar.fk(q), report=True)
    assert len(solutions)
    assert singular.any()
    # A cylindrical arm whose slide is drawn in: the wrist on axis 1 again.
    cylinder = rd.Robot.from_dh(
        [0.0] * 6, [0, 0, 0, 0, 0, 0.1], [0, -QUARTER, 0, -QUARTER, QUARTER, 0], [0.0] * 6, "RPPRRR"
    )
    for reach, flagged in [(0.3, False), (0.0, True)]:
        q = np.array([0.4, 0.2, reach, 0.3, 0.6, -0.2])
        solutions, singular, complete = cylinder.inverse(cylinder.fk(q), report=True)
        assert len(solutions)
        assert bool(singular.any()) == flagged
        assert complete == (not flagged)


@pytest.mark.parametrize("joints", ["RRRPRR", "RRPRRR"])
@pytest.mark.parametrize("down", [0.0, np.pi])
def test_a_slide_along_the_axis_of_its_neighbour_may_stand_in_a_wrist(joints: str, down: float) -> None:
    # A SCARA whose quill carries two more turns: the axes of the last three turns meet, wherever the slide is.
    rng = np.random.default_rng(11)
    a, d = np.array([0.4, 0.3, 0, 0, 0, 0]), np.array([0.2, 0, 0, 0, 0, 0.1])
    alpha = np.array([0, down, 0 if joints == "RRPRRR" else down, QUARTER, -QUARTER, 0])
    chain = Chain(a, d, alpha, rng.uniform(-1, 1, 6), joints)
    robot = chain.robot()
    assert robot.structure == "wrist"
    for _ in range(20):
        q = any_posture(rng, joints)
        solutions, _, complete = robot.inverse(chain.fk(q), report=True)
        assert complete
        assert len(solutions) == 4
        assert apart(solutions, q, joints).min() < 1e-9


def test_a_whole_frame_is_the_default_for_five_joints() -> None:
    rng = np.random.default_rng(10)
    chain = Chain(
        np.array([0, 0.4, 0.3, 0, 0]),
        np.array([0.3, 0, 0, 0, 0.1]),
        np.array([1, 0, 0, -1, 0]) * np.pi / 2,
        np.zeros(5),
        "RRRRR",
    )
    robot, q = chain.robot(), rng.uniform(0.2, 1.0, 5)
    pose = chain.fk(q)
    assert apart(robot.inverse(pose), q, "RRRRR").min() < 1e-9
    turned = pose @ random_frame(rng)
    assert len(robot.inverse(turned)) == 0
    # About the axis of the last joint that joint does it.
    spun = pose.copy()
    spun[:3, :3] = pose[:3, :3] @ [[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]]
    assert apart(robot.inverse(spun)[:, :4], q[:4], "RRRR").min() < 1e-9
    with pytest.raises(rd.InvalidValueError, match="takes 4"):
        robot.inverse(pose, task=AXIS)
    # A tool that leans against the last axis takes all five for its own axis.
    lean = np.eye(4)
    lean[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    leaning = robot.with_tool(lean)
    solutions, _, complete = leaning.inverse(leaning.fk(q), task=AXIS, report=True)
    assert complete
    assert apart(solutions, q, "RRRRR").min() < 1e-9
    np.testing.assert_allclose(
        leaning.fk(solutions)[:, :3, 2], np.tile(leaning.fk(q)[:3, 2], (len(solutions), 1)), atol=1e-9
    )


def test_planar_arms() -> None:
    planar = rd.robots.get("planar_3r")
    q = np.array([0.3, 0.8, -0.4])
    solutions, _, complete = planar.inverse(planar.fk(q), report=True)
    assert complete
    assert len(solutions) == 2
    assert apart(solutions, q, "RRR").min() < 1e-12
    two = planar.with_fixed({2: -0.4})
    assert two.inverse(two.fk(q[:2]), task=POSITION).shape == (2, 2)
    raised = planar.fk(q)
    raised[2, 3] += 0.01
    assert len(planar.inverse(raised)) == 0
    # A task of the plane alone does not look at the height; its free motion is no joint's at the tool.
    assert apart(planar.inverse(raised, task=rd.Task(("line", (0, 0, 1)), ("plane", (0, 0, 1)))), q, "RRR").min() < 1e-9


def test_rails_and_held_joints() -> None:
    rail = rd.on_rail(rd.robots.get("abb_irb120"), (1, 0, 0), -1.0, 1.0)
    assert rail.joints == "PRRRRRR"
    q = rail.random_postures(1, 3)[0]
    assert apart(rail.inverse(rail.fk(q), fixed={0: q[0]}), q, rail.joints).min() < 1e-9
    # The last axis is that of the tool: the five joints before it bring the tool's axis where it has to be.
    solutions = rail.inverse(rail.fk(q), fixed={0: q[0], 6: 0.2}, task=AXIS)
    wanted = np.append(q[:6], 0.2)
    assert apart(solutions, wanted, rail.joints).min() < 1e-9
    # The rail for the first turn: one joint slides, five turn.
    solutions = rail.inverse(rail.fk(q), fixed={1: q[1]})
    assert apart(solutions, q, rail.joints).min() < 1e-9
