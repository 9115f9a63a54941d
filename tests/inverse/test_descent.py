"""Coordinate descent on robots, goals and terms of any kind: what it never does, and what it says."""

import warnings
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64, Chain, random_frame

MONOTONE: list[dict[str, Any]] = [
    *({"algorithm": 1, "order": order} for order in ("end_to_base", "base_to_end", "double")),
    *({"algorithm": k, "weights": weights} for k in (2, 3) for weights in ("whole", "parts")),
    {"algorithm": 5},
]
UR5E = rd.robots.get("ur5e")


class Problem:
    """A random robot with limits, a goal and terms, and the cost by forward kinematics alone."""

    def __init__(self, seed: int) -> None:
        """Draw everything."""
        rng = self.rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 10))
        joints = "".join(rng.choice(["R", "R", "R", "P"], n))
        (a, d), (alpha, theta) = rng.uniform(-0.5, 0.5, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
        chain = Chain(a, d, alpha, theta, joints, base=random_frame(rng), tool=random_frame(rng))
        low, high = -rng.uniform(0.05, 5.0, n), rng.uniform(0.05, 5.0, n)
        free = (rng.random(n) < 0.3) & np.array([kind == "R" for kind in joints])
        low[free], high[free & (rng.random(n) < 0.5)] = -np.inf, np.inf
        self.robot, self.n = chain.robot().with_limits(low, high), n
        self.turns = np.array([kind == "R" for kind in joints])
        self.q0 = np.clip(rng.uniform(-3.0, 3.0, n), low, high)
        self.target = random_frame(rng) if rng.random() < 0.3 else self.robot.fk(rng.uniform(-1.0, 1.0, n))
        tilt = rng.uniform(0.05, 1.0)
        volume = rd.OrientationVolume.cone(tilt, spin=0.5 if rng.random() < 0.5 else None)
        axis = rng.normal(size=3)
        self.task, self.axis = rng.choice(4), axis / np.linalg.norm(axis)
        tasks = [rd.Task.full(), rd.Task.axisymmetric(axis), rd.Task.position(), rd.Task.within(volume)]
        self.volume = volume.reoriented(self.target[:3, :3]) if self.task == 3 else None
        self.quaternion = bool(rng.random() < 0.3) and self.task in (0, 3)
        self.w_p, self.w_o = 10 ** rng.uniform(-1, 1, 2)
        count = int(rng.integers(0, 3))
        self.points = [
            (int(rng.integers(1, n + 1)), rng.normal(size=3) / 4, rng.normal(size=3) / 2, float(rng.uniform(-0.4, 0.6)))
            for _ in range(count)
        ]
        self.centring = rng.uniform(0.0, 0.1, n) if rng.random() < 0.3 else np.zeros(n)
        self.middle = rng.uniform(-1.0, 1.0, n)
        self.settings = {
            "task": tasks[self.task],
            "w_p": self.w_p,
            "w_o": self.w_o,
            "orientation_metric": "quaternion" if self.quaternion else "frobenius",
            "points": self.points,
            "centring": self.centring,
            "middle": self.middle,
        }

    def descent(self, algorithm: int = 1, weights: Any = None, **settings: Any) -> rd.CoordinateDescent:
        """Return the package's solver."""
        if isinstance(weights, str):
            weights = self.rng.uniform(0.1, 1.0, self.n) if weights == "parts" else None
        return rd.CoordinateDescent(
            self.robot, self.target, algorithm=algorithm, weights=weights, **self.settings, **settings
        )

    def cost(self, q: F64) -> float:
        """Return the cost as it is defined."""
        frames = self.robot.link_frames(q)
        tool, c, d = frames[-1], frames[-1][:3, :3], self.target[:3, :3]
        if self.volume is not None:
            d = self.volume.nearest(c).orientation
        orientation = [((c - d) ** 2).sum(), (((c - d) @ self.axis) ** 2).sum(), 0.0, ((c - d) ** 2).sum()][self.task]
        if self.quaternion:
            angle = rd.quaternion.angle(*map(rd.quaternion.from_matrix, (c, d)))
            orientation = 4 * np.sin(angle / 4) ** 2
        cost = self.w_p * ((tool[:3, 3] - self.target[:3, 3]) ** 2).sum() + self.w_o * orientation
        for joints, at, goal, weight in self.points:
            frame = frames[joints - 1]
            cost += weight * ((frame[:3, :3] @ at + frame[:3, 3] - goal) ** 2).sum()
        off = q - self.middle
        return float(cost + (self.centring * np.where(self.turns, 1 - np.cos(off), off**2 / 2)).sum())


@pytest.mark.parametrize("settings", MONOTONE, ids=str)
@pytest.mark.parametrize("seed", range(12))
def test_never_uphill(settings: dict[str, Any], seed: int) -> None:
    problem = Problem(seed)
    descent = problem.descent(**settings)
    assert descent.monotone
    trace = descent.trace(problem.q0, 15)
    assert (np.diff(trace.cost) <= 0).all()
    low, high = problem.robot.q_min, problem.robot.q_max
    assert ((trace.q >= low) & (trace.q <= high)).all()
    for q, cost in zip(trace.q[::5], trace.cost[::5], strict=True):
        assert abs(cost - problem.cost(q)) <= 1e-12 * (1 + abs(cost))
        assert descent.cost(q) == cost


@pytest.mark.parametrize("seed", range(40))
def test_gradient_beside_differences(seed: int) -> None:
    problem = Problem(seed)
    descent, q, h = problem.descent(), problem.q0, 1e-3
    slope = np.zeros(problem.n)
    for i, e in enumerate(np.eye(problem.n) * h):
        near, far = (problem.cost(q + k * e) - problem.cost(q - k * e) for k in (1, 2))
        slope[i] = (8 * near - far) / (12 * h)
    assert np.abs(descent.gradient(q) - slope).max() <= 1e-8 * (1 + np.abs(slope).max())


@pytest.mark.parametrize("seed", range(20))
def test_a_sweep_leaves_its_last_joint_at_the_minimum(seed: int) -> None:
    problem = Problem(seed)
    if problem.volume is not None:
        return  # the goal moves with the tool
    for order, joint in (("end_to_base", 0), ("base_to_end", -1)):
        q, cost = problem.descent(order=order).sweep(problem.q0)
        low, high = problem.robot.q_min[joint], problem.robot.q_max[joint]
        for x in np.linspace(max(low, -7.0), min(high, 7.0), 60):
            other = q.copy()
            other[joint] = x
            assert problem.cost(other) >= cost - 1e-12 * (1 + abs(cost))


def test_five_as_printed_and_four_are_no_descent() -> None:
    start, goal = [0.1, -1.2, 1.4, -0.5, 0.8, 0.1], UR5E.fk([1.5, -0.6, 0.4, 0.9, -1.2, 2.0])
    with pytest.warns(RuntimeWarning, match=r"step is above 2 / sum\(W\) = 0.6896"):
        four = rd.CoordinateDescent(UR5E, goal, algorithm=4, step=1.0)
    assert not four.monotone
    assert (np.diff(four.trace(start, 20).cost) > 0).any()
    for rule in ("printed", "normalised"):
        assert not rd.CoordinateDescent(UR5E, goal, algorithm=5, rule=rule).monotone
    # One joint at its own minimum and the printed step is zero.
    printed = rd.CoordinateDescent(UR5E, goal, algorithm=5, rule="printed", limits=False)
    at_minimum, _ = rd.CoordinateDescent(UR5E, goal, order="base_to_end", limits=False).sweep(start)
    moved, _ = printed.sweep(at_minimum)
    assert np.abs(moved - at_minimum).max() < 1e-9


def test_four_is_safe_unless_it_is_told_otherwise() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        q = np.array([0.1, -1.2, 1.4, -0.5, 0.8, 0.1])
        trace = rd.CoordinateDescent(UR5E, UR5E.fk(q + 0.05), algorithm=4).trace(q, 200)
    assert trace.cost[-1] < 1e-2 * trace.cost[0]


def test_a_cone_is_reached_from_everywhere_tried() -> None:
    robot, rng = rd.robots.get("ur5e"), np.random.default_rng(5)
    cone = rd.OrientationVolume.cone(np.deg2rad(10))
    task = rd.Task.within(cone)
    sweeps = []
    for q in rng.uniform(-1.5, 1.5, (20, 6)):
        goal = robot.fk(q + rng.uniform(-0.3, 0.3, 6))
        found = rd.CoordinateDescent(robot, goal, task, w_o=0.1).solve(q, 2000)
        assert found.status == "converged"
        assert (np.diff(found.costs) <= 0).all()
        assert cone.distance(goal[:3, :3].T @ robot.fk(found.q)[:3, :3]) <= 1e-3
        sweeps.append(found.iterations)
    assert np.median(sweeps) <= 60


def test_why_it_stopped() -> None:
    q, goal = np.array([0.1, -1.2, 1.4, -0.5, 0.8, 0.1]), np.eye(4)
    goal[:3, 3] = 5.0, 0.0, 0.0
    assert rd.CoordinateDescent(UR5E, UR5E.fk(q)).solve(q).status == "converged"
    far = rd.CoordinateDescent(UR5E, [5.0, 0.0, 0.0])
    found = far.solve(q, 2000, gradient_tolerance=1e-6)
    assert found.status == "stationary"
    assert np.abs(far.gradient(found.q)).max() <= 1e-6
    assert far.solve(q, 3).status == "out of sweeps"
    assert far.solve(q, 5000, gradient_tolerance=0.0).status == "stalled"
    four = rd.CoordinateDescent(UR5E, goal, algorithm=5, rule="printed")
    assert four.solve(q, 5000, gradient_tolerance=0.0).status in ("stalled", "out of sweeps")
    assert found.position_error == pytest.approx(np.linalg.norm(UR5E.fk(found.q)[:3, 3] - [5, 0, 0]))
    assert found.cost == found.costs[-1]
    assert len(found.costs) == found.iterations + 1


def test_an_elbow_is_drawn_to_a_place_and_kept_off_one() -> None:
    arm, rng = rd.robots.get("kuka_iiwa14"), np.random.default_rng(2)
    q0 = rng.uniform(-1, 1, 7)
    goal, elbow = arm.fk(q0), arm.link_frames(q0)[3][:3, 3]
    for weight, sign in ((0.05, 1), (-0.05, -1)):
        place = elbow + np.array([0.1, 0.1, 0.05])
        q = rd.CoordinateDescent(arm, goal, w_o=0.1, points=[(4, [0, 0, 0], place, weight)]).solve(q0, 200).q
        # Nothing is reached that ends it: the elbow may have more to gain.
        before, after = np.linalg.norm(elbow - place), np.linalg.norm(arm.link_frames(q)[3][:3, 3] - place)
        assert sign * (before - after) > 0.01


def test_limits_on_combinations_hold() -> None:
    robot = UR5E.with_limits(coupled=[({1: 1.0, 2: 1.0}, -0.5, 0.4)])
    goal = UR5E.fk([1.5, -0.2, 1.9, 0.9, -1.2, 2.0])
    for k in range(1, 6):
        trace = rd.CoordinateDescent(robot, goal, algorithm=k).trace([0.1, -1.2, 1.4, -0.5, 0.8, 0.1], 30)
        value = trace.q[:, 1] + trace.q[:, 2]
        assert value.max() <= 0.4 + 1e-12
        assert value.min() >= -0.5 - 1e-12


def test_a_start_beyond_its_limits_is_put_onto_them() -> None:
    robot = UR5E.with_limits(q_min=[-1.0] * 6, q_max=[1.0] * 6)
    trace = rd.CoordinateDescent(robot, UR5E.fk(np.zeros(6))).trace([2.0, -3.0, 0.5, 0.0, 0.0, 9.0], 0)
    assert trace.q.tolist() == [[1.0, -1.0, 0.5, 0.0, 0.0, 1.0]]
    assert trace.picks.shape == (0, 0)


def test_half_turns_are_left() -> None:
    q = np.array([0.1, -1.2, 1.4, -0.5, 0.8, 0.1])
    flipped = UR5E.fk(q) @ np.diag([1.0, -1.0, -1.0, 1.0])
    trace = rd.CoordinateDescent(UR5E, flipped, w_o=0.1).trace(q, 60)
    assert trace.cost[-1] < 1e-2 * trace.cost[0]


COUPLED = rd.Robot.from_dh(
    [0.3] * 3, [0.0] * 3, [0.0] * 3, [0.0] * 3, q_min=[-2] * 3, q_max=[2] * 3, mimic={2: (1, 1.0, 0.0)}
)


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"robot": COUPLED}, rd.InvalidValueError, "joints that follow"),
        ({"algorithm": 6}, rd.InvalidValueError, "algorithm"),
        ({"order": "sideways"}, rd.InvalidValueError, "order"),
        ({"rule": "newton"}, rd.InvalidValueError, "rule"),
        ({"orientation_metric": "angle"}, rd.InvalidValueError, "orientation_metric"),
        ({"w_p": -1.0}, rd.InvalidValueError, "w_p"),
        ({"w_o": np.nan}, rd.InvalidValueError, "w_o"),
        ({"target": np.ones((4, 4))}, rd.InvalidValueError, "target"),
        ({"target": [np.nan, 0, 0]}, rd.NonFiniteError, "target"),
        ({"target": [0.0, 0.0]}, rd.ShapeError, "target"),
        ({"task": rd.Task("free", ("line", (0, 0, 1)))}, rd.InvalidValueError, "task"),
        ({"algorithm": 2, "weights": [1.0] * 5}, rd.ShapeError, "weights"),
        ({"algorithm": 3, "weights": [2.0] * 6}, rd.InvalidValueError, "weights"),
        ({"algorithm": 4, "weights": [-1.0] * 6}, rd.InvalidValueError, "weights"),
        ({"algorithm": 4, "step": 0.0}, rd.InvalidValueError, "step"),
        ({"points": [(7, [0, 0, 0], [0, 0, 0], 1.0)]}, rd.InvalidValueError, "points"),
        ({"points": [(0, [0, 0, 0], [0, 0, 0], 1.0)]}, rd.InvalidValueError, "points"),
        ({"points": [(1, [0, 0], [0, 0, 0], 1.0)]}, rd.ShapeError, "points"),
        ({"points": [(1, [0, 0, 0], [0, 0, np.inf], 1.0)]}, rd.NonFiniteError, "points"),
        ({"points": [(1, [0, 0, 0], [0, 0, 0], 1.0)] * 9}, rd.InvalidValueError, "points"),
        ({"points": 3}, rd.InvalidValueError, "points"),
        ({"points": [1, 2]}, rd.InvalidValueError, "points"),
        ({"centring": [1.0, 2.0]}, rd.ShapeError, "centring"),
        ({"centring": np.nan}, rd.NonFiniteError, "centring"),
    ],
    ids=str,
)
def test_what_is_refused(change: dict[str, Any], error: type[Exception], words: str) -> None:
    settings: dict[str, Any] = {"robot": UR5E, "target": np.eye(4), **change}
    with pytest.raises(error, match=words):
        rd.CoordinateDescent(**settings)


def test_a_slide_without_end_that_nothing_holds_is_refused() -> None:
    slide = rd.Robot.from_dh([0, 0], [0, 0], [0, 0], [0, 0], "RP")
    with pytest.raises(rd.InvalidValueError, match="slides without limits"):
        rd.CoordinateDescent(slide, [0.0, 0.0, 0.0], points=[(2, [0, 0, 0], [1, 0, 0], -2.0)])
    with pytest.raises(rd.InvalidValueError, match="slides without limits"):
        rd.one_joint_minimum("P", [0, 0, 1], [0, 0, 0], points=[([0, 0, 1], [0, 0, 0], -1.0)])
    bounded = slide.with_limits([-1, -1], [1, 1])
    q, _ = rd.CoordinateDescent(bounded, [0.0, 0.0, 0.0], points=[(2, [0, 0, 0], [0, 0, 0.1], -2.0)]).sweep([0, 0])
    assert q[1] == -1.0


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        ({"joint": "H"}, rd.InvalidValueError, "joint"),
        ({"axis": [0, 0, 0]}, rd.InvalidValueError, "axis"),
        ({"axis": [0, 0]}, rd.ShapeError, "axis"),
        ({"origin": [0, np.nan, 0]}, rd.NonFiniteError, "origin"),
        ({"current_position": None}, rd.InvalidValueError, "current_position"),
        ({"current_orientation": [1, 0, 0, 0]}, rd.InvalidValueError, "desired_orientation"),
        ({"current_orientation": [2, 0, 0, 0], "desired_orientation": [1, 0, 0, 0]}, rd.InvalidValueError, "length 1"),
        ({"current_orientation": [1, 0, 0], "desired_orientation": [1, 0, 0, 0]}, rd.ShapeError, "current_orient"),
        ({"change_min": 1.0, "change_max": 0.0}, rd.InvalidValueError, "change_min"),
        ({"change_min": np.nan}, rd.InvalidValueError, "change_min"),
        ({"w_p": np.inf}, rd.InvalidValueError, "w_p"),
        ({"points": [([0, 0, 0], [0, 0, 0], np.nan)]}, rd.NonFiniteError, "points"),
        ({"centring": (np.inf, 1.0)}, rd.NonFiniteError, "centring"),
    ],
    ids=str,
)
def test_what_one_joint_refuses(change: dict[str, Any], error: type[Exception], words: str) -> None:
    settings: dict[str, Any] = {"joint": "R", "axis": [0, 0, 1], "origin": [0, 0, 0]}
    settings |= {"current_position": [1, 0, 0], "desired_position": [0, 1, 0]} | change
    with pytest.raises(error, match=words):
        rd.one_joint_minimum(**settings)


def test_one_joint_at_special_places() -> None:
    def change(goal: Any, **keywords: Any) -> float:
        place = {"current_position": [1, 0, 0], "desired_position": goal}
        return float(rd.one_joint_minimum("R", [0, 0, 1], [0, 0, 0], **place, **keywords).change)

    assert change([-1, 0, 0]) == np.pi
    assert change([-1, 0, 0], change_min=-4.0, change_max=-1.0) == -np.pi
    assert abs(change([-1, 0, 0], change_min=-0.5, change_max=0.5)) == 0.5
    assert change([0, 0, 3]) == 0.0
    assert change([0, 0, 3], change_min=0.2, change_max=1.0) == 0.2
    assert change([1, 0, 0], change_min=10.0, change_max=20.0) == pytest.approx(4 * np.pi)
    assert change([1, 0, 0], change_min=0.5) == pytest.approx(2 * np.pi)
    # The value is exact next to the goal.
    near = rd.one_joint_minimum("R", [0, 0, 1], [0, 0, 0], current_position=[1, 0, 0], desired_position=[1, 0, 1e-12])
    assert near.value == pytest.approx(1e-24, rel=1e-12)


def test_arrays_that_are_not_plain() -> None:
    q = np.array([0.1, -1.2, 1.4, -0.5, 0.8, 0.1])
    descent = rd.CoordinateDescent(UR5E, np.asfortranarray(UR5E.fk(q + 0.2)))
    expected, _ = descent.sweep(q)
    strided, fixed = np.repeat(q, 2)[::2], q.copy()
    fixed.flags.writeable = False
    others: list[Any] = [strided, fixed, list(q), q.astype(object)]
    for other in others:
        assert np.array_equal(descent.sweep(other)[0], expected)
    wrongs: list[Any] = [[], q[:5], [q, q], [np.nan] * 6, "text", None]
    for wrong in wrongs:
        with pytest.raises(rd.RedundancyError):
            descent.sweep(wrong)
