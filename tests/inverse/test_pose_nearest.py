"""`Robot.solve_pose` where the pose is out of reach: the nearest posture, told as such."""

from collections.abc import Callable

import numpy as np
import pytest
import redundancy as rd
from scipy.optimize import minimize

from tests.inverse.test_pose import angle, elbow, of
from tests.reference.chain import F64

SHORT = ("unreachable", "stationary")


def length(robot: rd.Robot) -> float:
    """Return a third of the links in line."""
    ends = [*robot.links[1:], robot.flange @ robot.tool]
    return sum(float(np.linalg.norm(end[:3, 3])) for end in ends) / 3.0


def cost_of(robot: rd.Robot, pose: F64) -> Callable[[F64], float]:
    """Return the cost as the documentation has it."""
    weight = 0.5 * length(robot) ** 2

    def cost(q: F64) -> float:
        tool = robot.fk(q)
        return float(((tool[:3, 3] - pose[:3, 3]) ** 2).sum() + weight * ((tool[:3, :3] - pose[:3, :3]) ** 2).sum())

    return cost


def slope(robot: rd.Robot, cost: Callable[[F64], float], q: F64) -> float:
    """Return the largest component of the gradient of a cost that limits leave, by differences."""
    worst, h = 0.0, 1e-5
    for i in range(robot.n):
        step = np.eye(robot.n)[i] * h
        gradient = (cost(q + step) - cost(q - step)) / (2.0 * h)
        # A joint that turns once round is not stopped.
        once_round = robot.periodic[i] and robot.q_max[i] - robot.q_min[i] >= 2.0 * np.pi - 1e-9
        held = (q[i] <= robot.q_min[i] + 1e-9 and gradient > 0.0) or (q[i] >= robot.q_max[i] - 1e-9 and gradient < 0.0)
        if once_round or not held:
            worst = max(worst, abs(gradient))
    return worst


def out_of_reach(robot: rd.Robot, kind: str, seed: int) -> F64:
    """Return a pose that the robot does not reach."""
    rng = np.random.default_rng(seed)
    pose = robot.fk(robot.random_postures(1, seed=seed)[0])
    size = 3.0 * length(robot)
    if kind == "far":
        pose[:3, 3] = pose[:3, 3] * 20.0 + size
    elif kind == "just":
        direction = rng.normal(size=3)
        pose[:3, 3] = robot.links[0][:3, 3] + 1.05 * size * direction / np.linalg.norm(direction)
    else:
        # Towards the base from beside it, at the end of the reach.
        pose[:3, 3] += 0.4 * size * (pose[:3, 3] - robot.links[0][:3, 3]) / np.linalg.norm(pose[:3, 3])
    return pose


@pytest.mark.parametrize("kind", ["far", "just", "outwards"])
@pytest.mark.parametrize(
    "name",
    ["ur5e", "fanuc_m710ic50", "panda", "stanford_arm", "general", "five", "eight", "PPPRR", "rail", "planar_3r"],
)
def test_the_nearest_posture_is_stationary_and_not_called_converged(name: str, kind: str) -> None:
    robot = of(name)
    for seed in range(12):
        pose = out_of_reach(robot, kind, seed)
        found = robot.solve_pose(pose)
        cost = cost_of(robot, pose)
        assert found.position_error == pytest.approx(np.linalg.norm(robot.fk(found.q)[:3, 3] - pose[:3, 3]), abs=1e-9)
        assert found.orientation_error == pytest.approx(angle(robot.fk(found.q)[:3, :3], pose[:3, :3]), abs=1e-7)
        assert found.cost == pytest.approx(cost(found.q), rel=1e-9, abs=1e-15)
        assert robot.within_limits(found.q)
        if found.position_error <= 1e-4 and found.orientation_error <= 1e-3:
            assert found.status == "converged"
            continue
        assert found.status in SHORT, (seed, found)
        square = length(robot) ** 2
        assert slope(robot, cost, found.q) <= 1e-6 * square * (1.0 + np.sqrt(found.cost / square))


@pytest.mark.parametrize("name", ["ur5e", "panda", "stanford_arm"])
def test_no_other_optimiser_does_better_from_there_and_hardly_from_elsewhere(name: str) -> None:
    robot = of(name)
    beaten = 0
    for seed in range(3):
        pose = out_of_reach(robot, "just", 100 + seed)
        cost, found = cost_of(robot, pose), robot.solve_pose(pose)
        bounds = list(zip(robot.q_min, robot.q_max, strict=True))
        again = minimize(cost, found.q, bounds=bounds, method="L-BFGS-B")
        assert again.fun >= found.cost - 1e-9
        others = [minimize(cost, q, bounds=bounds, method="L-BFGS-B").fun for q in robot.random_postures(4, seed=seed)]
        beaten += min(others) < found.cost - 1e-6
    assert beaten <= 1


def test_what_is_known_to_be_out_of_reach_is_called_so() -> None:
    robot = rd.robots.get("ur5e")
    far = out_of_reach(robot, "far", 1)
    assert robot.solve_pose(far).status == "unreachable"
    assert rd.robots.get("panda").solve_pose(far).status == "unreachable"
    # Within reach of the arm, but for its limits.
    pose = robot.fk(np.full(6, 0.5))
    assert robot.with_limits(q_min=[1.0] * 6, q_max=[1.5] * 6).solve_pose(pose).status == "unreachable"


@pytest.mark.parametrize("far", [1e3, 1e6, 1e100, 1e300])
def test_poses_at_the_end_of_the_world(far: float) -> None:
    pose = np.eye(4)
    pose[:3, 3] = far, -far, far
    for name in ("ur5e", "panda", "stanford_arm"):
        robot = rd.robots.get(name)
        found = robot.solve_pose(pose)
        assert found.status != "converged"
        assert np.isfinite(found.q).all()
        assert robot.within_limits(found.q)


@pytest.mark.parametrize("task", [rd.Task.axisymmetric(), rd.Task.position(), rd.Task(("line", [0, 0, 1.0]))])
def test_tasks_out_of_reach(task: rd.Task) -> None:
    robot = rd.robots.get("ur5e")
    pose = out_of_reach(robot, "just", 3)
    found = robot.solve_pose(pose, task=task)
    assert found.status in SHORT
    # Nearer than the whole pose lets it come.
    assert found.position_error <= robot.solve_pose(pose).position_error + 1e-6


def test_a_volume_comes_nearer_than_its_middle() -> None:
    robot = rd.robots.get("panda")
    for seed in range(10):
        pose = out_of_reach(robot, "just", seed)
        found = robot.solve_pose(pose, task=rd.Task.within(rd.OrientationVolume.cone(0.5)))
        assert found.status in SHORT
        assert found.cost <= robot.solve_pose(pose).cost + 1e-9


@pytest.mark.parametrize("method", ["newton", "hybrid", "closed", "auto"])
def test_limits_on_combinations_hold_out_of_reach(method: str) -> None:
    robot = elbow(coupled=[({1: 1.0, 2: 1.0}, -1.0, 1.0)])
    for seed in range(10):
        found = robot.solve_pose(out_of_reach(robot, "outwards", seed), method=method)
        assert robot.within_limits(found.q)
        assert found.status in (*SHORT, "converged")
