"""The planner beside the grid search of evidence/planner: never worse, and smoother, on a few short paths."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
import redundancy as rd
from redundancy.planning import core_path

from evidence.planner import cases as plan_cases
from evidence.planner import compare as compare_plan
from evidence.planner import grid_search, moveit_dp
from evidence.planner.grid import JUMP, make_grid

BETTER = [("fanuc_m710ic50_milling", "cylinder_inside"), ("abb_irb120", "limit_line"), ("ur5e", "limit_line")]
NARROW = [("ur5e", "dash"), ("abb_irb120", "cylinder_outside")]
"""Where the way is narrower than a cell of the planner's first grid, or follows speed limits."""


def verdicts(robot: str, name: str) -> list[tuple[str, bool, bool]]:
    """Fault, never worse, smoother, of both criteria; the grid has to find a way."""
    compared = compare_plan.compare(plan_cases.case(name, robot))
    return [(found.fault, found.grid is not None and found.never_worse, found.smoother) for found in compared]


@pytest.mark.parametrize(("robot", "name"), BETTER, ids=lambda x: x)
def test_a_plan_is_not_worse_than_a_grid_and_smoother(robot: str, name: str) -> None:
    assert verdicts(robot, name) == [("", True, True)] * 2


@pytest.mark.parametrize(("robot", "name"), NARROW, ids=lambda x: x)
def test_further_searches_find_narrower_ways(robot: str, name: str) -> None:
    worst, mean = verdicts(robot, name)
    assert worst == ("", True, True)
    # The best mean may ask for a fast turn.
    assert mean[:2] == ("", True)


@pytest.mark.parametrize("criterion", ["minimax", "integral"])
def test_one_search_alone_misses_a_narrow_way(criterion: Literal["minimax", "integral"]) -> None:
    case = plan_cases.case("cylinder_outside", "abb_irb120")
    objective = rd.ConditionNumber(case.length)
    once, again = (rd.plan(case.robot, case.path, None, objective, criterion, effort=effort) for effort in (1, None))
    assert again.cost < 0.9 * once.cost


@pytest.mark.parametrize("criterion", ["minimax", "integral"])
def test_a_way_at_the_speed_limits_at_some_points_has_to_be_one_at_all(
    criterion: Literal["minimax", "integral"],
) -> None:
    case = plan_cases.case("dash", "abb_irb2400")
    plan = rd.plan(case.robot, case.path, None, rd.ConditionNumber(case.length), criterion)
    assert plan.failure is None
    assert compare_plan.speed_share(case, plan.q) <= 1.0 + 1e-9


def test_a_closed_grid_way_ends_where_it_starts() -> None:
    case = plan_cases.case("circle_tilted", "fanuc_m710ic50_milling")
    grid = make_grid(
        case.robot, case.path, rd.ConditionNumber(case.length), core_path(case.path).shares, case.closed, spins=180
    )
    for found in (grid_search.minimax(grid), grid_search.integral(grid, 1e-6)):
        assert found is not None
        assert found.spin[0] == found.spin[-1]
        assert found.bound <= found.objective
        turns = (found.q[-1] - found.q[0]) / (2.0 * np.pi)
        np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)


def test_the_grid_finds_the_best_of_all_ways() -> None:
    """A grid of 8 spins over 4 points, beside every one of its ways."""
    case = plan_cases.case("limit_line", "fanuc_m710ic50_milling")
    path = rd.Toolpath(case.path.position[30:42:3], case.path.axis[30:42:3])
    objective = rd.ConditionNumber(case.length)
    grid = make_grid(case.robot, path, objective, core_path(path).shares, spins=24, window=0.6)
    smoothness = 1e-3
    best = {"minimax": np.inf, "integral": np.inf}
    for branch in grid.branches:
        spins = np.indices((24,) * 4).reshape(4, -1)
        change = np.abs(np.diff(spins, axis=0))
        spins = spins[:, (np.minimum(change, 24 - change) <= grid.window).all(axis=0)]
        value = np.stack([branch.value[i, 0, spins[i]] for i in range(4)])
        steps = np.diff(np.stack([branch.q[i, :, 0, spins[i]] for i in range(4)]), axis=0)
        steps = np.where(branch.wide, np.angle(np.exp(1j * steps)), steps)
        kept = np.isfinite(value).all(axis=0) & (np.abs(steps) <= JUMP).all(axis=(0, 2))
        motion = ((steps**2).sum(axis=2) / grid.shares[:, None]).sum(axis=0)
        best["minimax"] = min(best["minimax"], value.max(axis=0)[kept].min(initial=np.inf))
        cost = grid.weights @ np.where(np.isfinite(value), value, 0.0) + smoothness * motion
        best["integral"] = min(best["integral"], cost[kept].min(initial=np.inf))
    lowest, least = grid_search.minimax(grid), grid_search.integral(grid, smoothness)
    assert lowest is not None
    assert lowest.objective == pytest.approx(best["minimax"], rel=1e-12)
    assert least is not None
    assert least.objective == pytest.approx(best["integral"], rel=1e-12)


def test_a_plan_is_not_worse_than_the_programme_of_moveit_dp() -> None:
    whole = moveit_dp.circle(180)
    assert whole.path.time is not None
    assert whole.path.rotation is not None
    path, some = whole.path, slice(None, None, 4)
    thin = rd.Toolpath(
        path.position[some], path.axis[some], rotation=whole.path.rotation[some], time=whole.path.time[some]
    )
    benchmark = replace(whole, path=thin, states=whole.states[some])
    way, plan = moveit_dp.rebuilt(benchmark), moveit_dp.planned(benchmark)
    assert plan.failure is None
    for q in (way, plan.q):
        tools = benchmark.robot.fk(q)
        np.testing.assert_allclose(tools[:, :3, 3], benchmark.path.position, atol=1e-9)
        assert benchmark.shares(q)[0] <= 1.0 + 1e-9
    assert benchmark.cost(plan.q) < benchmark.cost(way)
    assert plan.cost / float(benchmark.dt.sum()) == pytest.approx(benchmark.cost(plan.q), rel=1e-9)


def test_the_distance_of_the_elbow_has_its_derivatives() -> None:
    q, step = np.array([[0.3, -1.2, 0.7, 2.0], [1.9, 0.4, -2.0, 0.1]]), 1e-5
    _, gradient, hessian = moveit_dp.elbow_distance(q)
    for k, shift in enumerate(step * np.eye(4)):
        high, low = moveit_dp.elbow_distance(q + shift), moveit_dp.elbow_distance(q - shift)
        np.testing.assert_allclose((high[0] - low[0]) / (2.0 * step), gradient[:, k], atol=1e-6)
        np.testing.assert_allclose((high[1] - low[1]) / (2.0 * step), hessian[:, :, k], atol=1e-6)


def test_the_square_of_the_panda_is_closed_and_its_speed_even() -> None:
    path = moveit_dp.square(3).path
    assert len(path) == 203
    np.testing.assert_allclose(path.position[-1], path.position[0], atol=1e-12)
    assert path.rotation is not None
    np.testing.assert_allclose(
        path.rotation @ path.rotation.transpose(0, 2, 1), np.tile(np.eye(3), (203, 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(path.rotation[102, :, 2], [0.0, 0.0, -1.0], atol=1e-12)
