"""Weights of joints in the motion, and the user's own cost of a step, beside plain dynamic programming and scipy."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from redundancy.cli import read_job
from redundancy.planning import PlanSettings, core_path

from tests.cli.jobs import JOB, job
from tests.reference.chain import F64
from tests.reference.plans import KAPPA, ROBOT, check, circle, helix
from tests.reference.spins import SpinSearch

WEIGHTS = np.array([4.0, 3.0, 2.0, 1.0, 1.0, 0.5])
SINE, COSINE = np.sin(np.pi / 4.0), np.cos(np.pi / 4.0)
ARM = rd.robots.get("abb_irb120").with_tool(
    np.array([[COSINE, 0.0, SINE, 0.02], [0.0, 1.0, 0.0, 0.0], [-SINE, 0.0, COSINE, 0.06], [0.0, 0.0, 0.0, 1.0]])
)


def roll(points: int, degrees: float = 20.0) -> rd.Toolpath:
    """A line across, along which the tool rolls from one side to the other."""
    angle = np.deg2rad(np.linspace(-degrees, degrees, points))
    axis = np.stack([0.2 + 0.0 * angle, np.sin(angle), -np.cos(angle)], axis=1)
    return rd.Toolpath(np.linspace([0.35, -0.1, 0.1], [0.35, 0.1, 0.1], points), axis)


def searched(path: rd.Toolpath, step_cost: Callable[[F64, F64], F64] | None = None) -> SpinSearch:
    """The path as the reference has it: weighted motion, and what is added to it."""
    shares = core_path(path).shares

    def cost(before: F64, after: F64, step: int) -> F64:
        motion: F64 = (after - before) ** 2 @ WEIGHTS / shares[step]
        return motion if step_cost is None else motion + step_cost(before, after)

    return SpinSearch(ARM, path.position, path.axis, cost)


def length(before: F64, after: F64) -> F64:
    """The way of all joints [rad], nearly: smooth, for the sake of scipy."""
    way: F64 = np.sqrt(1e-4 + (after - before) ** 2).sum(axis=1)
    return way


def distance(before: F64, after: F64) -> F64:
    """The way of all joints [rad]."""
    way: F64 = np.abs(after - before).sum(axis=1)
    return way


def along(cost: Callable[[F64, F64], F64], plan: rd.Plan) -> float:
    return float(cost(plan.q[:-1], plan.q[1:]).sum())


def test_weighted_motion_is_the_least() -> None:
    path = roll(6)
    plan = rd.plan(ARM, path, criterion="motion", joint_weights=WEIGHTS)
    check(plan)
    assert plan.refined
    least = searched(path).optimum(72)
    assert plan.motion == pytest.approx(least, rel=1e-8)
    assert plan.cost == pytest.approx(plan.motion, rel=1e-14)
    shares = core_path(path).shares
    assert plan.motion == pytest.approx(float(((np.diff(plan.q, axis=0) ** 2) @ WEIGHTS / shares).sum()), rel=1e-12)


@pytest.mark.parametrize("factor", [1e-3, 7.0, 1e4])
def test_a_factor_of_all_weights_is_one_of_the_motion(factor: float) -> None:
    path = roll(21, 40.0)
    plans = [rd.plan(ARM, path, criterion="motion", joint_weights=w) for w in (WEIGHTS, factor * WEIGHTS)]
    assert plans[1].motion == pytest.approx(factor * plans[0].motion, rel=1e-8)
    np.testing.assert_allclose(plans[1].q, plans[0].q, atol=1e-8)


def test_weights_of_one_are_none() -> None:
    plans = [rd.plan(ROBOT, helix(21), objective=KAPPA, joint_weights=w) for w in (None, np.ones(6))]
    np.testing.assert_array_equal(plans[0].q, plans[1].q)


@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
@pytest.mark.parametrize("weights", [[1.0, 1.0, 1.0, 100.0, 1.0, 1.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
def test_a_plan_for_some_weights_is_the_better_one_by_them(criterion: str, weights: list[float]) -> None:
    path, objective, smoothness = roll(21, 40.0), rd.ConditionNumber(0.2), 0.1
    shares, points = core_path(path).shares, core_path(path).weights
    own, even = (
        rd.plan(ARM, path, objective=objective, criterion=criterion, smoothness=smoothness, joint_weights=w)
        for w in (weights, None)
    )

    def cost(plan: rd.Plan) -> float:
        check(plan)
        assert plan.failure is None
        motion = float((np.diff(plan.q, axis=0) ** 2 @ np.array(weights) / shares).sum())
        if criterion == "motion":
            return motion
        value = objective.evaluate_many(ARM, plan.q, 0)[0]
        return float(value.max() if criterion == "minimax" else points @ value) + smoothness * motion

    assert own.cost == pytest.approx(cost(own), rel=1e-5)
    assert cost(own) < cost(even)


@pytest.mark.parametrize(
    ("weights", "words"),
    [
        ([1.0] * 5, r"joint_weights"),
        ([[1.0] * 6], r"joint_weights"),
        ([1.0, 1.0, -2.0, 1.0, 1.0, 1.0], r"joint_weights\[2\] is -2.0"),
        ([1.0, np.nan, 1.0, 1.0, 1.0, 1.0], r"joint_weights\[1\] is nan"),
        ([0.0] * 6, "joint_weights is all of them 0"),
        ([np.inf] + [1.0] * 5, r"joint_weights\[0\] is inf"),
        ("heavy", "joint_weights"),
    ],
)
def test_weights_that_are_none_are_told(weights: object, words: str) -> None:
    with pytest.raises(rd.RedundancyError, match=words):
        rd.plan(ARM, roll(3), criterion="motion", joint_weights=weights)  # type: ignore[arg-type]


def test_a_job_file_has_weights(tmp_path: Path) -> None:
    table = read_job(job(tmp_path, f"{JOB}[plan]\njoint_weights = [4, 3, 2, 1, 1, 0.5]\n")).plan
    assert table.settings == PlanSettings(bound=True, joint_weights=WEIGHTS)
    assert table.settings.joint_weights == WEIGHTS.tolist()
    for words in ("[1, 1]", "[0, 0, 0, 0, 0, 0]", "[1, 1, 1, 1, 1, -1]", "2"):
        with pytest.raises(rd.RedundancyError, match="joint_weights"):
            read_job(job(tmp_path, f"{JOB}[plan]\njoint_weights = {words}\n"))


def test_cost_of_steps_beside_motion_is_the_least() -> None:
    path = roll(6)
    plan = rd.plan(ARM, path, criterion="motion", joint_weights=WEIGHTS, edge_cost=length, n_angles=96)
    check(plan)
    assert plan.refined
    assert plan.edge_cost == pytest.approx(along(length, plan), rel=1e-12)
    assert plan.cost == pytest.approx(plan.motion + plan.edge_cost, rel=1e-12)
    assert plan.cost == pytest.approx(searched(path, length).optimum(72), rel=1e-6)


@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
def test_a_plan_is_no_worse_for_what_steps_cost(criterion: str) -> None:
    path, objective = roll(21, 40.0), rd.ConditionNumber(0.2)
    free = rd.plan(ARM, path, objective=objective, criterion=criterion)
    plan = rd.plan(ARM, path, objective=objective, criterion=criterion, edge_cost=distance)
    check(plan)
    assert plan.failure is None
    steps = along(distance, plan)
    assert plan.edge_cost == pytest.approx(steps, rel=1e-12)
    if criterion == "minimax":
        assert plan.value.max() == pytest.approx(free.value.max(), rel=1e-5)
        assert plan.cost == pytest.approx(plan.value.max() + plan.smoothness * (plan.motion + steps), rel=1e-12)
        assert plan.motion + steps <= free.motion + along(distance, free) + 1e-9
    else:
        assert plan.cost <= free.cost + along(distance, free) + 1e-9
        assert steps < along(distance, free)


def test_steps_of_a_closed_path_cost_too() -> None:
    ring = circle((1.3, 0.0, 0.6), 0.2, 31)
    plan = rd.plan(ROBOT, ring, criterion="motion", closed=True, edge_cost=distance)
    check(plan)
    assert plan.failure is None
    np.testing.assert_allclose(plan.q[-1], plan.q[0], atol=1e-9)
    free = rd.plan(ROBOT, ring, criterion="motion", closed=True)
    assert plan.cost <= free.cost + along(distance, free) + 1e-9


def test_a_spare_joint_follows_the_cost_of_steps() -> None:
    arm = rd.robots.get("kuka_iiwa14")
    frames = arm.fk(np.linspace([0.2, 0.6, 0.1, -1.2, 0.3, 0.9, 0.2], [0.5, 0.7, 0.2, -1.3, 0.2, 0.8, 0.1], 9))
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], rotation=frames[:, :3, :3])
    task = rd.Task.full()
    plan = rd.plan(arm, path, task, criterion="motion", edge_cost=distance)
    assert plan.failure is None
    free = rd.plan(arm, path, task, criterion="motion")
    assert plan.cost <= free.cost + along(distance, free) + 1e-9


def test_forbidden_steps_are_not_taken() -> None:
    path = roll(21, 40.0)
    free = rd.plan(ARM, path, criterion="motion")
    wall = float(np.median(free.q[:, 4]))
    asked = []

    def fence(before: F64, after: F64) -> F64:
        asked.append(len(before))
        return np.where((before[:, 4] - wall) * (after[:, 4] - wall) < 0.0, np.inf, 0.0)

    plan = rd.plan(ARM, path, criterion="motion", edge_cost=fence)
    check(plan)
    assert plan.failure is None
    side = np.sign(plan.q[:, 4] - wall)
    assert (side[1:] * side[:-1] >= 0.0).all()
    # Many steps at once.
    assert sum(asked) > 40 * len(asked)


def test_where_every_step_is_forbidden_the_failure_says_so() -> None:
    def forbidden(before: F64, after: F64) -> F64:
        return np.full(len(before), np.inf)

    plan = rd.plan(ARM, roll(9), criterion="motion", edge_cost=forbidden)
    assert plan.failure is not None
    assert (plan.failure.point, plan.failure.cause) == (1, "edge cost")
    assert "infinite for every step" in str(plan.failure)


@pytest.mark.parametrize("window", [1, 24])
def test_only_steps_within_bounds_are_asked_of(window: int) -> None:
    path = roll(9)
    largest = 0.0

    def near(before: F64, after: F64) -> F64:
        nonlocal largest
        largest = max(largest, float(np.abs(after - before).max()))
        return np.zeros(len(before))

    plan = rd.plan(
        ARM, path, criterion="motion", edge_cost=near, max_step=0.2, layers=len(path), max_spin_step=window * np.pi / 24
    )
    assert plan.failure is None
    assert np.abs(np.diff(plan.q, axis=0)).max() <= 0.2 + 1e-9
    # The search may look further where its grid is too coarse to keep to the bounds, and never beyond half a turn.
    assert largest <= np.pi + 1e-9


def test_errors_of_the_cost_reach_the_caller() -> None:
    def broken(before: F64, after: F64) -> F64:
        raise RuntimeError("no model")

    with pytest.raises(RuntimeError, match="no model"):
        rd.plan(ARM, roll(5), criterion="motion", edge_cost=broken)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda b, a: np.zeros(len(b) + 1), r"expected floats of shape \("),
        (lambda b, a: 0.0, r"expected floats of shape \("),
        (lambda b, a: np.zeros((len(b), 1)), r"expected floats of shape \("),
        (lambda b, a: np.full(len(b), np.nan), "is nan, expected a number of at least 0"),
        (lambda b, a: -np.ones(len(b)), "is -1.0, expected a number of at least 0"),
        (lambda b, a: None, "what edge_cost returned"),
        (lambda b, a: ["far"] * len(b), "what edge_cost returned"),
    ],
)
def test_costs_that_are_none_are_told(answer: Callable[[F64, F64], F64], words: str) -> None:
    with pytest.raises(rd.RedundancyError, match=words):
        rd.plan(ARM, roll(5), criterion="motion", edge_cost=answer)
