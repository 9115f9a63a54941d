"""Steps from point to point: flips, leaps, singular points, the ways that are compared, and the bound over them."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]
KAPPA = rd.ConditionNumber(0.4)


def stretched(beside: float, points: int) -> tuple[rd.Robot, rd.Toolpath]:
    """Return a line whose middle, but for an offset [m], has the wrist of a robot stretched."""
    tool = np.eye(4)
    tool[2, 3] = 0.2
    robot = rd.robots.get("abb_irb2400").with_tool(tool)
    middle = robot.fk(np.array([0.0, 0.3, 0.2, 0.0, 0.0, 0.0]))
    line = middle[:3, 3] + np.outer(np.linspace(-0.25, 0.25, points), [0, 1, 0]) + np.array([beside, 0, 0])
    return robot, rd.Toolpath(line, np.tile(middle[:3, 2], (points, 1)))


def bent(angle: float, offset: tuple[float, float, float]) -> F64:
    """Return a tool whose axis is turned about y by an angle [rad]."""
    tool = np.eye(4)
    tool[:3, :3] = about_y(angle)
    tool[:3, 3] = offset
    return tool


def about_y(angle: float) -> F64:
    """Return a rotation about y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


@pytest.mark.parametrize("settings", [{}, {"criterion": "motion"}, {"criterion": "integral"}, {"branch_changes": True}])
def test_a_stretched_wrist_is_passed_without_a_flip(settings: dict[str, Any]) -> None:
    """By own kinematics 0.28 deg a point and 0.4746 rad^2 are enough; on one branch joint 4 jumps by 90 deg, twice."""
    robot, path = stretched(0.0, 101)
    plan = rd.plan(robot, path, objective=KAPPA, progress=False, **settings)
    assert plan.failure is None
    assert np.rad2deg(np.abs(np.diff(plan.q, axis=0)).max()) == pytest.approx(0.28, abs=0.01)
    assert plan.motion == pytest.approx(0.4746, abs=1e-4)
    if settings.get("criterion") != "motion":
        assert np.isinf(plan.value[50])
        assert np.isfinite(np.delete(plan.value, 50)).all()
    assert np.isinf(plan.condition_number[50])
    assert any("singularity" in note for note in plan.notes)


@pytest.mark.parametrize("beside", [1e-6, 1e-3, 5e-3])
@pytest.mark.parametrize("criterion", ["minimax", "motion"])
def test_a_flip_is_a_failure_that_names_it(beside: float, criterion: str) -> None:
    robot, path = stretched(beside, 101)
    plan = rd.plan(robot, path, objective=KAPPA, criterion=criterion, progress=False)
    steps = np.abs(np.diff(plan.q, axis=0))
    assert plan.failure is not None
    assert plan.failure.cause == "step limit"
    first = np.argmax(steps.max(axis=1) > 0.25)
    assert plan.failure.point == first + 1
    assert plan.failure.joint == steps[first].argmax()
    assert plan.failure.excess == pytest.approx(steps[first].max() / 0.25, rel=1e-6)
    assert not plan.unreachable


def test_a_line_far_enough_beside_is_planned() -> None:
    robot, path = stretched(0.1, 101)
    plan = rd.plan(robot, path, objective=KAPPA, progress=False)
    assert plan.failure is None
    assert np.abs(np.diff(plan.q, axis=0)).max() < 0.1


@pytest.mark.parametrize("points", [1, 2])
def test_a_path_of_singular_points_alone_has_a_plan(points: int) -> None:
    robot, path = stretched(0.0, 101)
    path = rd.Toolpath(path.position[50 : 50 + points], path.axis[50 : 50 + points])
    plan = rd.plan(robot, path, objective=KAPPA, progress=False)
    assert plan.failure is None
    assert plan.q.shape == (points, 6)
    np.testing.assert_allclose(robot.fk(plan.q[0])[:3, 3], path.position[0], atol=1e-9)


def test_a_path_that_begins_in_a_singular_point_is_planned() -> None:
    robot, path = stretched(0.0, 101)
    path = rd.Toolpath(path.position[50:], path.axis[50:])
    for way in (path, rd.Toolpath(path.position[::-1], path.axis[::-1])):
        plan = rd.plan(robot, way, objective=KAPPA, progress=False)
        assert plan.failure is None
        assert np.abs(np.diff(plan.q, axis=0)).max() < 0.01


def ring(points: int) -> tuple[rd.Robot, rd.Toolpath]:
    """Return the outside of a cylinder, where the best way passes from a valley of spins to another."""
    robot = rd.robots.get("abb_irb2400").with_tool(bent(np.pi / 4, (0.05, 0.0, 0.3)))
    t = np.linspace(-1.2, 1.2, points)
    out = np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    return robot, rd.Toolpath(np.array([0.75, 0.1, 0.55]) + 0.25 * out, -out)


def test_the_largest_step_halves_with_the_spacing() -> None:
    largest = []
    for points in (60, 119, 237):
        robot, path = ring(points)
        plan = rd.plan(robot, path, objective=KAPPA, progress=False)
        assert plan.failure is None
        largest.append(np.abs(np.diff(plan.q, axis=0)).max())
    assert largest[0] / largest[1] == pytest.approx(2.0, rel=0.25)
    assert largest[1] / largest[2] == pytest.approx(2.0, rel=0.25)


def raster(rows: int, points: int) -> tuple[rd.Robot, rd.Toolpath]:
    """Return a raster on the cap of a ball, whose best postures at single points are not connected."""
    robot = rd.robots.get("fanuc_m710ic50").with_tool(bent(np.pi / 2, (0.15, 0.0, 0.12)))
    position, axis = [], []
    for i, u in enumerate(np.linspace(-0.6, 0.6, rows)):
        for v in np.linspace(-0.6, 0.6, points)[:: 1 if i % 2 == 0 else -1]:
            out = np.array([np.sin(u), np.sin(v) * np.cos(u), np.cos(u) * np.cos(v)])
            position.append(np.array([1.4, 0, 0.3]) + 0.3 * out)
            axis.append(-out)
    return robot, rd.Toolpath(position, axis)


def test_the_bound_over_connected_ways_is_met() -> None:
    """The least values of single points are 0.12 below."""
    robot, path = raster(20, 25)
    plan = rd.plan(robot, path, objective=KAPPA, progress=False)
    assert plan.failure is None
    assert plan.value.max() == pytest.approx(2.486460, abs=1e-6)
    assert 0.0 <= plan.gap < 1e-3
    finer = rd.plan(robot, path, objective=KAPPA, n_angles=240, effort=1, bound=False, progress=False)
    assert plan.bound <= finer.value.max() * (1.0 + 1e-9)


@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
def test_ways_are_told_the_best_first(criterion: str) -> None:
    robot, path = raster(6, 20)
    plan = rd.plan(robot, path, objective=KAPPA, criterion=criterion, effort=1, progress=False)
    assert len(plan.ways) > 1
    values = [way.value for way in plan.ways]
    assert values == sorted(values)
    assert all(way.motion > 0.0 and way.largest_step > 0.0 for way in plan.ways)
    reached = plan.value.max() if criterion == "minimax" else plan.cost
    assert reached <= values[0] * (1.0 + 1e-2)


def test_long_paths_are_planned_from_few_points_to_many() -> None:
    robot, few = raster(12, 40)
    _, many = raster(12, 320)
    plans = [rd.plan(robot, path, objective=KAPPA, progress=False) for path in (few, many)]
    assert [plan.failure for plan in plans] == [None, None]
    assert [plan.refined for plan in plans] == [True, True]
    # The finer raster passes the points of the coarser one.
    assert plans[1].value.max() >= plans[0].value.max() * (1.0 - 1e-9)
    assert plans[1].value.max() == pytest.approx(plans[0].value.max(), rel=1e-3)
