"""Plans and maps of any robot for any task: optima of planar arms, seven axes, random robots with random tasks."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64

POINTS, DURATION = 180, 8.95
"""The circle of Kazerounian and Wang (1988), at times of our own."""
Directions: TypeAlias = Literal["free", "full"] | tuple[Literal["line", "plane"], F64]


def circle(*, oriented: bool, points: int = POINTS) -> rd.Toolpath:
    """Return a circle of radius 4 m about (6, 4), the last link at -60 degrees."""
    a = np.linspace(0, 2 * np.pi, points)
    position = np.stack([6 + 4 * np.cos(a), 4 + 4 * np.sin(a), 0 * a], axis=1)
    cosine, sine = np.cos(-np.pi / 3), np.sin(-np.pi / 3)
    rotation = np.tile(np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]]), (points, 1, 1))
    time = np.linspace(0, DURATION, points)
    return rd.Toolpath(position, np.tile([0, 0, 1.0], (points, 1)), rotation if oriented else None, time)


def energy(plan: rd.Plan) -> float:
    """Return the sum of the squared motions over the time of each."""
    return float(((np.diff(plan.q, axis=0) ** 2).sum(axis=1) / np.diff(np.linspace(0, DURATION, POINTS))).sum())


def test_planar_arm_with_orientation() -> None:
    robot, path = rd.robots.get("planar_4r"), circle(oriented=True)
    plan = rd.plan(robot, path, rd.Task.full(), criterion="motion", progress=False)
    assert plan.failure is None
    assert plan.refined
    # An own dynamic programme over 1440 values of joint 1, then Gauss-Newton; the other elbow has 1.9308138310.
    assert energy(plan) == pytest.approx(1.9306300516, abs=1e-9)
    tools = robot.fk(plan.q)
    assert np.abs(tools[:, :3, 3] - path.position).max() < 1e-9
    assert path.rotation is not None
    assert np.abs(tools[:, :3, :3] - path.rotation).max() < 1e-9


@pytest.mark.parametrize("task", [rd.Task.position(), rd.Task("free", ("plane", (0.0, 0.0, 1.0)), "base")])
def test_planar_arm_with_position_alone(task: rd.Task) -> None:
    robot, path = rd.robots.get("planar_4r"), circle(oriented=False)
    plan = rd.plan(robot, path, task, criterion="motion", progress=False)
    assert plan.failure is None
    assert plan.refined
    # An own dynamic programme over 72 x 72 values of joints 1 and 2 at 19 points, its best routes of different starts
    # brought to their optima by an own Newton method in all joints: 1.09581, 1.09885, 1.16447, 1.16917, 1.17787, ...
    assert energy(plan) == pytest.approx(1.095810540743492, abs=1e-9)
    assert np.abs(robot.fk(plan.q)[:, :2, 3] - path.position[:, :2]).max() < 1e-9
    assert plan.axis_error.max() == 0.0


def test_a_pointing_tool_of_a_planar_arm_has_the_spin_that_the_arm_gives_it() -> None:
    robot = rd.robots.get("planar_3r")
    frames = robot.fk(np.linspace([0.3, 0.5, 0.4], [0.6, 0.9, 0.1], 12))
    # The last link along the path's axis, in the plane: nothing is said of its spin, and none but one is possible.
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 0])
    plan = rd.plan(robot, path, rd.Task.axisymmetric((1.0, 0.0, 0.0)), criterion="motion", progress=False)
    assert plan.failure is None
    assert np.abs(robot.fk(plan.q)[:, :3, 0] - path.axis).max() < 1e-9


def test_rotations_and_axes_of_one_point() -> None:
    robot = rd.robots.get("puma500")
    frames = robot.fk(np.linspace([0.3, -0.6, 0.4, 0.2, 0.9, 0.1], [0.5, -0.5, 0.5, 0.2, 0.8, 0.3], 9))
    # Each rounded for itself, as in a file.
    axis, rotation = frames[:, :3, 2].round(6), frames[:, :3, :3]
    path = rd.Toolpath(frames[:, :3, 3], axis, rotation)
    plan = rd.plan(robot, path, criterion="motion", progress=False)
    assert plan.failure is None
    assert np.abs(robot.fk(plan.q)[:, :3, 2] - path.axis).max() < 1e-9
    with pytest.raises(
        rd.InvalidValueError, match=r"rotation\[0\] is one that has the tool's axis 90 deg from axis\[0\]"
    ):
        rd.plan(robot, path, rd.Task.axisymmetric((0.0, 1.0, 0.0)), criterion="motion", progress=False)


def known_motion(robot: rd.Robot, seed: int, direction: Callable[[F64], F64]) -> rd.Toolpath:
    """Return a path with a fixed orientation that damped Newton with null-space steps follows within the limits."""
    rng = np.random.default_rng(seed)
    middle, half = 0.5 * (robot.q_min + robot.q_max), 0.5 * (robot.q_max - robot.q_min)
    while True:
        q = rng.uniform(robot.q_min, robot.q_max)
        start = robot.fk(q)
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        position = start[:3, 3] + np.array([turn @ direction(t) for t in np.linspace(0, 1, 40)])
        rows = []
        for place in position:
            for step in range(30):
                tool = robot.fk(q)
                away = start[:3, :3] @ tool[:3, :3].T
                w = 0.5 * np.array([away[2, 1] - away[1, 2], away[0, 2] - away[2, 0], away[1, 0] - away[0, 1]])
                error = np.concatenate([w, place - tool[:3, 3]])
                if step and np.abs(error).max() < 1e-11:
                    break
                jacobian = robot.jacobian(q)
                inverse = jacobian.T @ np.linalg.inv(jacobian @ jacobian.T + 1e-10 * np.eye(6))
                inward = 0.02 * (q - middle) / half**2 if step == 0 else np.zeros(robot.n)
                q = q + inverse @ error - (inward - inverse @ (jacobian @ inward))
            rows.append(q)
        known = np.array(rows)
        inside = ((known > robot.q_min) & (known < robot.q_max)).all()
        if inside and np.abs(np.diff(known, axis=0)).max() < 0.1 and np.abs(error).max() < 1e-11:
            rotation = np.tile(start[:3, :3], (40, 1, 1))
            return rd.Toolpath(position, rotation[:, :, 2], rotation)


SHAPES = {
    "line": lambda t: 0.25 * np.array([t, 0, 0]),
    "circle": lambda t: 0.1 * np.array([np.cos(2 * np.pi * t) - 1, np.sin(2 * np.pi * t), 0]),
}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("name", ["panda", "kuka_iiwa14", "baxter_left"])
def test_seven_axes_find_a_way_where_there_is_one(name: str, shape: str) -> None:
    robot = rd.robots.get(name)
    for seed in range(4):
        path = known_motion(robot, seed, SHAPES[shape])
        plan = rd.plan(robot, path, rd.Task.full(), criterion="motion", progress=False)
        assert plan.failure is None
        assert plan.refined
        assert np.abs(np.diff(plan.q, axis=0)).max() < 0.25
        assert ((plan.q >= robot.q_min) & (plan.q <= robot.q_max)).all()


def test_the_joint_that_hardly_moves_is_not_held() -> None:
    robot = rd.robots.get("panda")
    q = np.array([2.5862, 0.9178, -2.1299, -0.6219, 1.9878, 1.3162, 0.065])
    frames = robot.fk(np.array([q, q + 1e-3]))
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], frames[:, :3, :3])
    settings: list[dict[str, Any]] = [{}, {"n_spare": 96}, {"spare": (6,)}]
    for more in settings:
        assert rd.plan(robot, path, rd.Task.full(), criterion="motion", progress=False, **more).failure is None
    chart = rd.redundancy_map(robot, path, rd.Task.full(), progress=False)
    # The mean share of the null space by joint is .33 .24 .43 .07 .47 .21 .31.
    assert chart.spare == (4,)
    assert chart.value.shape[:3] == (2, 120, 1)


def test_maps_of_spare_joints() -> None:
    robot = rd.robots.get("planar_4r")
    whole, position = circle(oriented=True, points=6), circle(oriented=False, points=6)
    chart = rd.redundancy_map(robot, whole, rd.Task.full(), rd.JointLimits(), progress=False)
    assert (chart.value.shape, len(chart.spare), chart.spins) == ((6, 120, 1, 16), 1, False)
    for i, held in enumerate(chart.spare_values[:, 0]):
        for k, point in enumerate(whole.position):
            frame = np.eye(4)
            assert whole.rotation is not None
            frame[:3, :3], frame[:3, 3] = whole.rotation[k], point
            found = robot.inverse(frame, task=rd.Task.full(), fixed={chart.spare[0]: held}, limits=True)
            assert chart.feasible[k, i].sum() == len(found)
    chart = rd.redundancy_map(robot, position, rd.Task.position(), rd.JointLimits(), progress=False)
    assert (chart.value.shape, len(chart.spare)) == ((6, 576, 1, 16), 2)
    assert chart.feasible.reshape(6, -1).any(axis=1).all()
    with pytest.raises(rd.InvalidValueError, match="no spin"):
        chart.plot()


@dataclass
class Job:
    """A random robot, a random task, and the path of a motion within the limits."""

    robot: rd.Robot
    angular: Directions
    linear: Directions
    frame: Literal["tool", "base"] | F64
    q: F64
    path: rd.Toolpath

    @property
    def task(self) -> rd.Task:
        """The task."""
        return rd.Task(self.angular, self.linear, self.frame)

    def error(self, q: F64, point: int) -> float:
        """Return how far a posture is off what the task asks for [m, rad], from the definition of the task."""
        target, tool = self.robot.fk(self.q[point]), self.robot.fk(q)
        turn, place = target[:3, :3], target[:3, 3]
        part = None if isinstance(self.frame, str) else self.frame
        axes = part[:3, :3] if part is not None else (tool[:3, :3] if self.frame == "tool" else np.eye(3))
        errors: list[Any] = [0.0]
        if self.angular == "full":
            errors.append(np.linalg.norm(turn - tool[:3, :3]))
        elif not isinstance(self.angular, str):
            kind, axis = self.angular[0], axes @ self.angular[1]
            if kind == "line":
                errors.append(abs(rotation_vector(turn @ tool[:3, :3].T) @ axis))
            elif part is None and self.frame == "tool":
                errors.append(np.linalg.norm(axis - turn @ self.angular[1]))
            else:
                errors.append(np.linalg.norm(tool[:3, :3].T @ axis - turn.T @ axis))
                if part is not None:
                    # The target may be turned about the part's axis.
                    place = part[:3, 3] + tool[:3, :3] @ turn.T @ (place - part[:3, 3])
        if not isinstance(self.linear, str):
            axis = axes @ self.linear[1]
            seen = axis[None] if self.linear[0] == "line" else np.linalg.svd(axis[None])[2][1:]
            errors.append(np.abs(seen @ (place - tool[:3, 3])).max())
        elif self.linear == "full":
            errors.append(np.linalg.norm(place - tool[:3, 3]))
        return float(max(errors))


def rotation_vector(rotation: F64) -> F64:
    """Return the axis of a rotation times its angle."""
    w = 0.5 * np.array(
        [rotation[2, 1] - rotation[1, 2], rotation[0, 2] - rotation[2, 0], rotation[1, 0] - rotation[0, 1]]
    )
    sine = np.linalg.norm(w)
    return w * (np.arctan2(sine, 0.5 * (np.trace(rotation) - 1)) / sine if sine > 1e-14 else 1.0)


def drawn(seed: int) -> Job:
    """Return a job."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 10))
    letters = "".join(rng.choice(["R", "R", "R", "P"], n))
    planar, square = rng.random() < 0.25, rng.random() < 0.5
    alpha = np.zeros(n) if planar else rng.choice([0, np.pi / 2, -np.pi / 2], n) if square else rng.uniform(-3, 3, n)
    d = np.zeros(n) if planar else rng.choice([0, 0.2, 0.4], n)
    high = np.where(np.array(list(letters)) == "R", rng.choice([1.5, 3.0, 7.0]), 0.5)
    a = rng.choice([0.2, 0.3, 0.5], n)
    robot = rd.Robot.from_dh(a, d, alpha, rng.choice([0, np.pi / 2], n), joints=letters, q_min=-high, q_max=high)
    part = np.eye(4)
    part[:3, :3], part[:3, 3] = np.linalg.qr(rng.normal(size=(3, 3)))[0], rng.normal(size=3)
    part[:3, 0] *= np.linalg.det(part[:3, :3])
    tool_axis = np.eye(3)[2]
    fixed: list[tuple[Directions, Directions, Literal["tool", "base"] | F64]] = [
        ("full", "full", "tool"),
        ("free", "full", "tool"),
        (("plane", tool_axis), "full", "tool"),
    ]
    kind = int(rng.integers(6))
    frame: Literal["tool", "base"] | F64 = part if kind == 5 else ("tool", "base")[kind % 2]
    angular, linear, frame = fixed[kind] if kind < 3 else (directions(rng), directions(rng), frame)
    points = int(rng.integers(1, 16))
    low = np.maximum(-high, -3.0)
    start = rng.uniform(0.8 * low, -0.8 * low)
    end = np.clip(start + rng.uniform(-0.5, 0.5, n), low, -low)
    q = np.linspace(start, end, points)
    frames = robot.fk(q)
    axis = frames[:, :3, 2] if isinstance(angular, str) or angular[0] == "line" else frames[:, :3, :3] @ angular[1]
    return Job(robot, angular, linear, frame, q, rd.Toolpath(frames[:, :3, 3], axis, frames[:, :3, :3]))


def directions(rng: np.random.Generator) -> Directions:
    """Return directions of a motion."""
    axis = rng.normal(size=3)
    axis = axis / np.linalg.norm(axis) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)]
    kinds: list[Directions] = ["free", "full", ("line", axis), ("plane", axis)]
    return kinds[int(rng.integers(4))]


REFUSED = (4, 6, 14, 18, 20, 23, 28, 29, 35, 38, 47, 48, 49, 56, 57)
"""Jobs that ask for more than the robot can do, or for nothing."""


@pytest.mark.parametrize("seed", range(60))
def test_random_robots_and_tasks(seed: int) -> None:
    job = drawn(seed)
    robot = job.robot
    able = np.linalg.matrix_rank(job.task.projector(robot, job.q[0]) @ robot.jacobian(job.q[0]), tol=1e-9)
    settings: dict[str, Any] = {"criterion": "motion", "n_angles": 12, "n_spare": 3, "progress": False}
    if seed in REFUSED:
        assert able < job.task.dimension or able == 0
        with pytest.raises(rd.InvalidValueError, match=r"^task is "):
            rd.plan(robot, job.path, job.task, **settings)
        return
    # Three values of each joint are few, but a motion is known.
    plan = rd.plan(robot, job.path, job.task, **settings)
    assert plan.failure is None
    assert max(job.error(q, point) for point, q in enumerate(plan.q)) < 1e-8
    assert ((plan.q >= robot.q_min) & (plan.q <= robot.q_max)).all()
    chart = rd.redundancy_map(robot, job.path, job.task, n_angles=6, n_spare=2, progress=False)
    assert chart.value.shape[0] == len(job.path)
    assert (np.isfinite(chart.value) == chart.feasible).all()
