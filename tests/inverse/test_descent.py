"""Coordinate descent on robots, goals and terms of any kind: what it never does, and what it says."""

import warnings
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.descent import MONOTONE, Problem, slope_misses, uphill

UR5E = rd.robots.get("ur5e")


@pytest.mark.parametrize("settings", MONOTONE, ids=str)
@pytest.mark.parametrize("seed", range(12))
def test_never_uphill(settings: dict[str, Any], seed: int) -> None:
    problem = Problem(seed)
    assert problem.descent(**settings).monotone
    assert uphill(problem, settings) is None


@pytest.mark.parametrize("seed", range(40))
def test_gradient_beside_differences(seed: int) -> None:
    assert slope_misses(Problem(seed)) <= 1e-8


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


@pytest.mark.parametrize("algorithm", [2, 3])
def test_a_joint_at_its_minimum_is_not_moved_again(algorithm: int) -> None:
    # Onto a limit, too, where rounding leaves a change whose decrease over it is the slope there.
    for seed in range(120):
        problem = Problem(seed)
        if problem.volume is not None:
            continue  # the goal moves with the tool
        for picks in problem.descent(algorithm).trace(problem.q0, 2).picks:
            again = (picks[1:] == picks[:-1]) & (picks[1:] >= 0)
            assert not again.any(), (seed, picks)


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
        ({"algorithm": -1}, rd.InvalidValueError, "algorithm"),
        ({"algorithm": 1000}, rd.InvalidValueError, "algorithm"),
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


def test_traces_are_refused_that_would_fill_the_memory() -> None:
    descent = rd.CoordinateDescent(UR5E, np.eye(4))
    with pytest.raises(rd.errors.InvalidValueError, match="sweeps is 1000000000000, expected at most 1000000"):
        descent.trace(np.zeros(6), 10**12)
