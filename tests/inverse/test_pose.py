"""`Robot.solve_pose`: reached from one start, held to limits, near the start, the same in batches."""

import _thread
import threading
import time
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference.chain import F64

POSITION, ORIENTATION = 1e-4, 1e-3
NAMES = rd.robots.names()


def angle(a: F64, b: F64) -> float:
    """Return the angle between two rotations, from the norm of their difference."""
    return float(2.0 * np.arcsin(min(1.0, np.linalg.norm(a - b) / np.sqrt(8.0))))


def errors(robot: rd.Robot, q: F64, pose: F64) -> tuple[float, float]:
    """Return how far the tool at a posture is from a pose [m, rad]."""
    tool = robot.fk(q)
    return float(np.linalg.norm(tool[:3, 3] - pose[:3, 3])), angle(tool[:3, :3], pose[:3, :3])


def general(seed: int, n: int = 6, half: float = np.pi) -> rd.Robot:
    """Return a robot of n revolute joints with any DH table."""
    rng = np.random.default_rng(seed)
    (a, d), (alpha, theta) = rng.uniform(-0.4, 0.4, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    return rd.Robot.from_dh(a, d, alpha, theta, q_min=[-half] * n, q_max=[half] * n)


def narrow() -> rd.Robot:
    """Return a Panda whose joints move over a tenth of their ranges."""
    panda = rd.robots.get("panda")
    middle, half = panda.middle, 0.05 * (panda.q_max - panda.q_min)
    return panda.with_limits(q_min=middle - half, q_max=middle + half)


def gantry(joints: str = "PPPRR") -> rd.Robot:
    """Return three slides across each other and turning joints behind them."""
    quarter, n = np.pi / 2, len(joints)
    alpha = [quarter, quarter, 0.0, quarter, -quarter, 0.0][:n]
    theta = [0.0, quarter, 0.0, 0.0, 0.0, 0.0][:n]
    low, high = [0.0] * 3 + [-3.0] * (n - 3), [1.0] * 3 + [3.0] * (n - 3)
    return rd.Robot.from_dh([0.0] * n, [0.1] * n, alpha, theta, joints=joints, q_min=low, q_max=high)


def elbow(**more: Any) -> rd.Robot:
    """Return an arm with an elbow and a wrist, within three radians."""
    lengths = [0.0, 0.4, 0.05, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.4, 0.0, 0.1]
    alpha = np.array([1, 0, 1, -1, 1, 0]) * np.pi / 2
    return rd.Robot.from_dh(*lengths, alpha, [0.0] * 6, **{"q_min": [-3.0] * 6, "q_max": [3.0] * 6, **more})


def rail() -> rd.Robot:
    """Return a UR5e on a rail of four metres."""
    frame = np.eye(4)
    frame[:3, :3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    arm = rd.robots.get("ur5e")
    links = [frame, frame.T @ arm.links[0], *arm.links[1:]]
    low, high = np.r_[-2.0, arm.q_min], np.r_[2.0, arm.q_max]
    return rd.Robot.from_links(links, joints="P" + arm.joints, flange=arm.flange, q_min=low, q_max=high)


OTHERS = {
    "general": general(0),
    "general, other": general(1),
    "general, half turns": general(2, half=1.5),
    "seven": general(3, 7, 2.0),
    "eight": general(4, 8, 2.0),
    "sixteen": general(5, 16, 1.0),
    "five": general(6, 5),
    "two": general(7, 2),
    "narrow": narrow(),
    "PPPRR": gantry(),
    "PPPRRR": gantry("PPPRRR"),
    "rail": rail(),
}


def of(name: str) -> rd.Robot:
    """Return a robot by its name here or in the package."""
    return OTHERS.get(name) or rd.robots.get(name)


@pytest.mark.parametrize("name", [*NAMES, *OTHERS])
@pytest.mark.parametrize("method", ["auto", "newton"])
def test_reachable_poses_are_reached_from_the_middle_within_limits(name: str, method: str) -> None:
    robot = of(name)
    poses = robot.fk(robot.random_postures(300, seed=21))
    found = robot.solve_pose(poses, None, method)
    missed = [k for k, status in enumerate(found.status) if status != "converged"]
    # Damped Newton alone may overlook a posture behind a fold; "auto" has elimination behind it.
    assert len(missed) <= (0 if method == "auto" else 1)
    assert robot.within_limits(found.q).all()
    for k, pose in enumerate(poses):
        position, orientation = errors(robot, found.q[k], pose)
        assert abs(position - found.position_error[k]) < 1e-9
        assert abs(orientation - found.orientation_error[k]) < 1e-7
        assert k in missed or (position <= POSITION and orientation <= ORIENTATION)


@pytest.mark.parametrize("name", ["ur5e", "panda", "stanford_arm", "general", "fanuc_crx10ia"])
def test_poses_next_to_a_start_are_reached_next_to_it(name: str) -> None:
    robot, rng = of(name), np.random.default_rng(3)
    for q in robot.random_postures(100, seed=4):
        start = np.clip(q + rng.uniform(-0.03, 0.03, robot.n), robot.q_min, robot.q_max)
        found = robot.solve_pose(robot.fk(q), start)
        assert found.status == "converged"
        # Next to a singular posture others are as near.
        if np.linalg.svd(robot.jacobian(q), compute_uv=False)[-1] > 0.05:
            assert np.abs(found.q - start).max() < 0.3


@pytest.mark.parametrize("name", ["ur5e", "panda", "kuka_iiwa14", "puma500", "general", "stanford_arm", "eight"])
def test_postures_on_limits_and_singular_ones(name: str) -> None:
    robot, rng = of(name), np.random.default_rng(5)
    for q in robot.random_postures(60, seed=6):
        ends = np.where(rng.random(robot.n) < 0.5, robot.q_min, robot.q_max)
        on_limits = np.where((rng.random(robot.n) < 0.4) & np.isfinite(ends), ends, q)
        for posture in (on_limits, np.where(rng.random(robot.n) < 0.5, np.clip(0.0, robot.q_min, robot.q_max), q)):
            pose = robot.fk(posture)
            found = robot.solve_pose(pose)
            position, orientation = errors(robot, found.q, pose)
            assert found.status == "converged", (name, posture)
            assert robot.within_limits(found.q)
            assert position <= POSITION
            assert orientation <= ORIENTATION


def test_ranges_beyond_a_turn_give_the_turn_nearest_to_the_start() -> None:
    robot = rd.robots.get("ur5e")  # +- a whole turn
    for q in robot.random_postures(50, seed=7):
        start = np.where(np.abs(q + np.sign(q) * 3.0) < 6.2, q + np.sign(q) * 3.0, q)
        for method in ("auto", "newton"):
            found = robot.solve_pose(robot.fk(q), start, method)
            assert found.status == "converged"
            for k in range(6):
                turns = found.q[k] + 2 * np.pi * np.arange(-2, 3)
                inside = turns[(turns >= robot.q_min[k]) & (turns <= robot.q_max[k])]
                assert np.abs(found.q[k] - start[k]) <= np.abs(inside - start[k]).min() + 1e-9


def test_the_nearest_of_all_postures_is_taken_where_all_are_known() -> None:
    robot = rd.robots.get("abb_irb120")
    for q, start in zip(robot.random_postures(50, seed=8), robot.random_postures(50, seed=9), strict=True):
        pose = robot.fk(q)
        nearest = robot.inverse(pose, near=start, limits=True)[0]
        assert np.linalg.norm(robot.solve_pose(pose, start).q - start) <= np.linalg.norm(nearest - start) + 1e-9


@pytest.mark.parametrize("name", ["ur5e", "panda", "general", "stanford_arm"])
def test_batches_are_the_same_as_single_poses(name: str) -> None:
    robot = of(name)
    poses, starts = robot.fk(robot.random_postures(40, seed=10)), robot.random_postures(40, seed=11)
    for start in (None, starts[0], starts):
        many = robot.solve_pose(poses, start)
        assert len(many) == 40
        for k, pose in enumerate(poses):
            one = robot.solve_pose(pose, start if start is None or start.ndim == 1 else start[k])
            assert np.array_equal(one.q, many.q[k])
            assert (one.status, one.iterations, one.restarts) == (many.status[k], many.iterations[k], many.restarts[k])
            assert (one.cost, one.position_error) == (many.cost[k], many.position_error[k])
    assert robot.solve_pose(np.empty((0, 4, 4))).q.shape == (0, robot.n)


def test_the_same_seed_gives_the_same_answer() -> None:
    robot = general(8)
    for pose in robot.fk(robot.random_postures(20, seed=12)):
        first, again = (robot.solve_pose(pose, method="newton", seed=5) for _ in range(2))
        assert np.array_equal(first.q, again.q)


@pytest.mark.parametrize("method", ["newton", "hybrid", "descent"])
def test_the_trace_ends_at_the_least_cost_and_a_descent_never_climbs(method: str) -> None:
    robot = rd.robots.get("puma500")
    for q in robot.random_postures(30, seed=13):
        start = np.clip(q + 0.2, robot.q_min, robot.q_max)
        found = robot.solve_pose(robot.fk(q), start, method, trace=True, restarts=0)
        assert found.cost <= found.trace.min() + 1e-12
        if method == "descent":
            assert (np.diff(found.trace) <= 1e-12).all()
    assert robot.solve_pose(robot.fk(q)).trace.shape == (0,)


def test_descent_is_slower_than_newton_and_says_so() -> None:
    robot = rd.robots.get("puma500")
    statuses = set()
    for q in robot.random_postures(50, seed=14):
        found = robot.solve_pose(robot.fk(q), np.clip(q + 0.1, robot.q_min, robot.q_max), "descent", iterations=20)
        reached = found.position_error <= POSITION and found.orientation_error <= ORIENTATION
        assert (found.status == "converged") == reached
        statuses.add(found.status)
    assert "out of iterations" in statuses


def test_joints_that_follow_others_and_limits_on_combinations() -> None:
    for robot in (elbow(mimic={2: (1, -1.0, 0.5)}), elbow(coupled=[({1: 1.0, 2: 1.0}, -1.0, 1.0)])):
        poses = robot.fk(robot.random_postures(100, seed=15))
        found = robot.solve_pose(poses)
        assert found.status == ["converged"] * 100
        assert robot.within_limits(found.q).all()
        assert max(errors(robot, q, pose)[0] for q, pose in zip(found.q, poses, strict=True)) <= POSITION


def test_without_limits() -> None:
    robot = narrow()
    pose = robot.fk(robot.middle + 1.0)
    free = robot.solve_pose(pose, limits=False)
    assert (free.status, bool(robot.within_limits(free.q))) == ("converged", False)
    assert robot.solve_pose(pose).status != "converged"
    rail_only = rd.Robot.from_dh([0.0], [0.0], [0.0], [0.0], joints="P")
    assert rail_only.solve_pose(rail_only.fk([7.0])).q.round(3).tolist() == [7.0]


TASKS = {
    "axisymmetric": rd.Task.axisymmetric(),
    "position": rd.Task.position(),
    "line": rd.Task(("line", [0, 0, 1.0])),
}


@pytest.mark.parametrize("kind", TASKS)
@pytest.mark.parametrize("name", ["ur5e", "panda", "five", "planar_4r", "PPPRR"])
def test_tasks(kind: str, name: str) -> None:
    robot = of(name)
    task = TASKS[kind]
    for q in robot.random_postures(50, seed=16):
        pose = robot.fk(q)
        rows = {6: np.r_[pose[:3, 3], pose[:3, 2]], 3: pose[:3, 3], 12: np.r_[pose[:3, 3], pose[:3, :3].ravel()]}
        for target in (pose, rows[task.target_size]):
            found = robot.solve_pose(target, task=task)
            assert found.status == "converged"
            tool = robot.fk(found.q)
            assert np.linalg.norm(tool[:3, 3] - pose[:3, 3]) <= POSITION
            if kind == "axisymmetric":
                assert np.linalg.norm(tool[:3, 2] - pose[:3, 2]) <= ORIENTATION


VOLUMES = {
    "cone": lambda: rd.OrientationVolume.cone(0.2),
    "cone, spin": lambda: rd.OrientationVolume.cone(0.2, (-0.5, 0.5)),
    "pyramid": lambda: rd.OrientationVolume.pyramid(0.2, 0.1, (-0.3, 0.3)),
    "line": lambda: rd.OrientationVolume.line_x(0.3, (-0.5, 0.5)),
}


@pytest.mark.parametrize("volume", VOLUMES)
@pytest.mark.parametrize("name", ["ur5e", "panda", "five", "general"])
def test_volumes(volume: str, name: str) -> None:
    robot, allowed = of(name), VOLUMES[volume]()
    members = np.asarray(allowed.sample(60, seed=1))
    for k, (q, member) in enumerate(zip(robot.random_postures(60, seed=17), members, strict=True)):
        tool = robot.fk(q)
        # A frame for which the tool at q is a member: one that is reached.
        pose = tool.copy()
        pose[:3, :3] = tool[:3, :3] @ rotation(member).T
        found = robot.solve_pose(pose, task=rd.Task.within(allowed), method="newton" if k % 2 else "auto")
        assert found.status == "converged"
        got = robot.fk(found.q)
        assert np.linalg.norm(got[:3, 3] - pose[:3, 3]) <= POSITION
        assert allowed.contains(pose[:3, :3].T @ got[:3, :3], tolerance=ORIENTATION)


def rotation(q: F64) -> F64:
    """Return the matrix of a quaternion, scalar first, or what is one already."""
    if q.shape == (3, 3):
        return q
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


POSE = rd.robots.get("ur5e").fk(np.full(6, 0.3))
WRONG: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "no pose": ({"target": np.eye(3)}, rd.errors.ShapeError, "target"),
    "one number": ({"target": 1.0}, rd.errors.ShapeError, "target"),
    "words": ({"target": "pose"}, rd.errors.InvalidValueError, "target"),
    "no numbers": ({"target": POSE * np.nan}, rd.errors.NonFiniteError, "target"),
    "no rotation": ({"target": 2.0 * POSE}, rd.errors.InvalidValueError, "target"),
    "a row for a pose": ({"target": np.zeros(6)}, rd.errors.ShapeError, "target"),
    "no axis": ({"target": np.zeros(6), "task": rd.Task.axisymmetric()}, rd.errors.InvalidValueError, "axis"),
    "infinite batch": ({"target": np.full((2, 4, 4), np.inf)}, rd.errors.NonFiniteError, "target"),
    "short start": ({"q0": [0.0] * 5}, rd.errors.ShapeError, "q0"),
    "no start": ({"q0": [np.nan] * 6}, rd.errors.NonFiniteError, "q0"),
    "starts of one pose": ({"q0": np.zeros((2, 6))}, rd.errors.ShapeError, "q0"),
    "starts of another number": ({"target": np.stack([POSE] * 3), "q0": np.zeros((2, 6))}, rd.errors.ShapeError, "q0"),
    "method": ({"method": "magic"}, rd.errors.InvalidValueError, "method"),
    "tolerance": ({"position_tolerance": 0.0}, rd.errors.InvalidValueError, "position_tolerance"),
    "tolerance, none": ({"orientation_tolerance": float("nan")}, rd.errors.InvalidValueError, "orientation_tolerance"),
    "iterations": ({"iterations": 0}, rd.errors.InvalidValueError, "iterations"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_arguments_are_refused_by_name(case: str) -> None:
    arguments, error, name = WRONG[case]
    with pytest.raises(error, match=name):
        rd.robots.get("ur5e").solve_pose(**{"target": POSE, **arguments})


@pytest.mark.parametrize(
    "form",
    [
        lambda x: x.tolist(),
        np.asfortranarray,
        lambda x: x.astype(np.float32).astype(float),
        lambda x: np.flip(np.flip(x)),
    ],
)
def test_forms_of_a_pose(form: Any) -> None:
    robot = rd.robots.get("ur5e")
    pose = POSE.copy()
    pose[:3, :3] = np.linalg.qr(pose[:3, :3])[0] * np.sign(np.diag(np.linalg.qr(pose[:3, :3])[1]))
    pose.flags.writeable = False
    assert robot.solve_pose(form(pose)).status == "converged"


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 9), st.sampled_from(["auto", "newton", "hybrid"]))
def test_random_robots_of_any_joints(seed: int, n: int, method: str) -> None:
    rng = np.random.default_rng(seed)
    joints = "".join(rng.choice(list("RRRP"), n))
    low = rng.uniform(-4.0, 0.0, n)
    high = low + rng.uniform(0.5, 7.0, n)
    (a, d), (alpha, theta) = rng.uniform(-0.5, 0.5, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
    robot = rd.Robot.from_dh(a, d, alpha, theta, joints=joints, q_min=low, q_max=high)
    poses = robot.fk(robot.random_postures(5, seed=seed))
    found = robot.solve_pose(poses, method=method)
    assert robot.within_limits(found.q).all()
    assert np.isfinite(found.q).all()
    reached = (found.position_error <= POSITION) & (found.orientation_error <= ORIENTATION)
    assert [status == "converged" for status in found.status] == reached.tolist()
    assert method != "auto" or reached.all()


@pytest.mark.parametrize("name", ["ur5e", "fanuc_m710ic50", "general", "panda"])
def test_poses_whose_postures_are_beyond_a_limit_by_less_than_the_tolerance(name: str) -> None:
    robot = of(name)
    for k, q in enumerate(robot.random_postures(40, seed=18)):
        q[k % robot.n] = robot.q_max[k % robot.n] + 2e-5
        found = robot.solve_pose(robot.fk(q), np.clip(q, robot.q_min, robot.q_max))
        assert found.status == "converged"
        assert robot.within_limits(found.q)


def test_a_batch_stops_when_asked_to() -> None:
    robot = of("kuka_iiwa14")
    poses = robot.fk(robot.random_postures(200_000, seed=19))
    poses[:, :3, 3] *= 3.0  # out of reach, which takes the longest
    timer, start = threading.Timer(0.2, _thread.interrupt_main), time.monotonic()
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        robot.solve_pose(poses)
    assert time.monotonic() - start < 20.0
    timer.join()
