"""Closed paths: no drift, and no seam where the path starts."""

from dataclasses import replace

import numpy as np
import pytest
import redundancy as rd
from redundancy.planning import core_path

from tests.reference.chain import F64
from tests.reference.plans import KAPPA, ROBOT, check

TURN = 2.0 * np.pi
N = 81


def ring(first: int, duration: float | None = 20.0, leaning: bool = True) -> rd.Toolpath:
    """An oval beside the robot that starts at one of its points; even times."""
    around = np.linspace(0.0, TURN, N)[:-1]
    s = np.append(np.roll(around, -first), around[first])
    lean = 0.5 if leaning else 0.0
    position = np.stack([1.3 + 0.25 * np.cos(s), 0.4 + 0.2 * np.sin(s), 0.6 + 0.05 * np.cos(3 * s)], axis=1)
    axis = np.stack([lean * np.cos(s), lean * np.sin(s), -np.ones(N)], axis=1)
    return rd.Toolpath(position, axis, time=None if duration is None else np.linspace(0.0, duration, N))


def around(q: F64, first: int) -> F64:
    """The postures of the points of the oval, whatever point the path starts from."""
    return np.roll(q[:-1], first, axis=0)


def rolled(plan: rd.Plan, first: int) -> rd.Plan:
    """The same plan from another point on."""
    q = np.vstack([np.roll(plan.q[:-1], -first, axis=0), plan.q[first]])
    q[N - 1 - first :] += plan.q[-1] - plan.q[0]
    return replace(plan, path=ring(first, plan.path.duration), q=q)


@pytest.mark.parametrize("duration", [20.0, None])
@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
def test_it_does_not_matter_where_a_closed_path_starts(criterion: str, duration: float | None) -> None:
    smoothness = 1e-3 if criterion == "integral" else None
    costs: list[float] = []
    known: rd.Plan | None = None
    for first in (0, 13) if criterion == "minimax" else (0, 13, 41):
        path = ring(first, duration)
        plan = rd.plan(
            *(ROBOT, path, None, KAPPA, criterion), closed=True, effort=1, smoothness=smoothness, warm_start=known
        )
        check(plan)
        assert plan.failure is None
        assert plan.refined
        drift = plan.q[-1] - plan.q[0]
        assert np.abs(drift - TURN * np.round(drift / TURN)).max() <= 1e-12
        costs.append(plan.cost)
        # A worst value has several optima near to each other: a search may end in one or the other.
        known = rolled(plan, 13) if criterion == "minimax" and first == 0 else None
    assert np.ptp(costs) <= 1e-6 * abs(costs[0])


def test_the_weight_of_the_motion_does_not_hang_on_where_the_path_starts() -> None:
    weights = {
        rd.plan(
            ROBOT, ring(first), objective=KAPPA, criterion="integral", closed=True, effort=1, n_angles=24
        ).smoothness
        for first in (0, 13, 41)
    }
    assert len(weights) == 1


def test_the_seam_is_an_edge_as_any_other() -> None:
    """Speed and acceleration at the seam are those at the same place of a path that starts elsewhere."""
    here = rd.plan(ROBOT, ring(0), criterion="motion", closed=True)
    there = rd.plan(ROBOT, ring(40), criterion="motion", closed=True, warm_start=rolled(here, 40))
    assert there.motion == pytest.approx(here.motion, rel=1e-10)
    ways = [around(here.q, 0), around(there.q, 40)]
    ways = [np.vstack([q[-1:], q, q[:1]]) for q in ways]
    steps = [np.diff(q, axis=0) - TURN * np.round(np.diff(q, axis=0) / TURN) for q in ways]
    assert np.abs(steps[0] - steps[1]).max() < 1e-8
    accelerations = np.abs(np.diff(steps[0], axis=0)).max(axis=1)
    assert accelerations[0] < 2.0 * np.median(accelerations)


def test_motion_is_stationary_at_the_seam() -> None:
    """By differences: no posture, the first among them, can be moved along its free motion for less."""
    plan = rd.plan(ROBOT, ring(0), criterion="motion", closed=True)
    turns = plan.q[-1] - plan.q[0]
    shares = core_path(plan.path).shares

    def motion(q: F64) -> float:
        closed = np.vstack([q[:-1], q[0] + turns])
        return float(((np.diff(closed, axis=0) ** 2).sum(axis=1) / shares).sum())

    assert motion(plan.q) == pytest.approx(plan.motion, rel=1e-12)
    for point in (0, 1, N - 2):
        tool = ROBOT.fk(plan.q[point])
        for angle in (-1e-4, 1e-4):
            spun = tool.copy()
            c, s = np.cos(angle), np.sin(angle)
            spun[:3, :3] = tool[:3, :3] @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
            near = ROBOT.inverse(spun, near=plan.q[point])
            moved = plan.q.copy()
            moved[point] = near[0]
            assert np.abs(near[0] - plan.q[point]).max() < 1e-2
            assert motion(moved) > plan.motion


def test_whole_turns_round_a_closed_path_are_exact() -> None:
    """A tool that is made to spin once on the way round: the last joint ends a turn away."""
    tool = np.eye(4)
    tool[2, 3] = 0.1
    arm = rd.robots.get("abb_irb2400").with_tool(tool)
    s = np.append(np.linspace(0.0, TURN, N)[:-1], 0.0)
    position = np.stack([0.9 + 0.1 * np.cos(s), 0.1 * np.sin(s), 0.5 + 0.0 * s], axis=1)
    path = rd.Toolpath(position, np.tile([0.0, 0.0, -1.0], (N, 1)))
    pins = {point: TURN * point / 80.0 for point in (0, 20, 40, 60)}
    plan = rd.plan(arm, path, criterion="motion", closed=True, pins=pins)
    assert plan.failure is None
    drift = (plan.q[-1] - plan.q[0]) / TURN
    assert np.abs(drift - np.round(drift)).max() <= 1e-12
    assert np.abs(drift).max() > 0.5


def test_speed_limits_hold_across_the_seam() -> None:
    slow = ROBOT.with_limits(qd_max=np.full(6, 0.2))
    plan = rd.plan(slow, ring(0), objective=KAPPA, criterion="integral", smoothness=1e-3, closed=True, n_angles=24)
    assert plan.failure is None
    assert plan.joint_speed is not None
    assert np.abs(plan.joint_speed).max() <= 0.2 + 1e-9
    assert np.abs(plan.joint_speed).max() > 0.199
