"""Paths without a single way: the fewest segments, and the ways from one to the next."""

import json
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from redundancy.cli.job import read_job
from redundancy.cli.plan_report import plan_table, write_plan
from redundancy.planning import core_path
from rich.console import Console

from evidence.planner import iklink
from tests.reference.chain import F64, PUMA, RIGHT, Chain
from tests.reference.plans import KAPPA, ROBOT, helix

STEP = 0.25
ARM = PUMA.robot().with_limits(q_min=np.full(6, -3.0), q_max=np.full(6, 3.0), qd_max=np.full(6, 2.0))
PANDA = Chain(
    np.array([0.0, 0.0, 0.0, 0.0825, -0.0825, 0.0, 0.088]),
    np.array([0.333, 0.0, 0.316, 0.0, 0.384, 0.0, 0.0]),
    np.array([0.0, -RIGHT, RIGHT, RIGHT, -RIGHT, RIGHT, RIGHT]),
    np.zeros(7),
    "RRRRRRR",
    "modified",
)


def knife(turns: float, points: int, tilt: float = 0.3) -> rd.Toolpath:
    """A blade that looks along a circle and leans, all of its orientation given."""
    t = np.linspace(0.0, turns * 2.0 * np.pi, points)
    along = np.stack([-np.sin(t), np.cos(t), 0.0 * t], axis=1)
    inwards = np.stack([-np.cos(t), -np.sin(t), 0.0 * t], axis=1)
    axis = np.sin(tilt) * inwards - np.cos(tilt) * np.array([0.0, 0.0, 1.0])
    position = np.array([0.45, 0.05, 0.1]) - 0.08 * inwards
    return rd.Toolpath(position, axis, np.stack([along, np.cross(axis, along), axis], axis=2))


def postures(path: rd.Toolpath) -> list[F64]:
    """Every inverse solution within limits, at every point."""
    return [ARM.inverse(frame, limits=True, turns=True) for frame in core_path(path).frames(rd.Task.full())]


def fewest(states: list[F64], step: float = STEP) -> tuple[int, float]:
    """The fewest segments, and the least sum of squared motions of ways with as few, by going through all of them."""
    best = np.stack([np.ones(len(states[0])), np.zeros(len(states[0]))])
    for before, now in pairwise(states):
        order = np.lexsort(best[::-1])[0]
        # Another posture at the point before: a segment more.
        afresh = best[:, order] + [1.0, 0.0]
        start = np.stack([np.minimum(best[0], afresh[0]), np.where(best[0] <= afresh[0], best[1], afresh[1])])
        equal = best[0] == afresh[0]
        start[1, equal] = np.minimum(best[1, equal], afresh[1])
        apart = np.abs(now[:, None] - before[None])
        motion = np.where(apart.max(axis=2) <= step, (apart**2).sum(axis=2), np.inf)
        count = np.where(np.isfinite(motion), start[0], np.inf).min(axis=1)
        total = np.where(start[0][None] == count[:, None], start[1] + motion, np.inf).min(axis=1)
        best = np.stack([count, total])
    least = best[0].min()
    return int(least), float(best[1, best[0] == least].min())


@pytest.mark.parametrize(("turns", "points"), [(0.4, 61), (1.0, 91), (2.3, 161), (3.6, 241)])
def test_there_are_no_fewer_segments_and_none_as_few_with_less_motion(turns: float, points: int) -> None:
    path = knife(turns, points)
    segments, motion = fewest(postures(path))
    plan = rd.plan(
        ARM, path, rd.Task.full(), criterion="motion", max_step=STEP, branch_changes=True, reconfigurations=True
    )
    assert plan.failure is None
    assert len(plan.segments) == segments
    walked = [np.diff(plan.segment(i), axis=0) for i in range(segments)]
    assert sum(float((steps**2).sum()) for steps in walked) == pytest.approx(motion, rel=1e-9)
    # Of a path of even steps the integral over its share is the sum times the number of steps.
    assert plan.motion == pytest.approx(motion * (points - 1), rel=1e-3)
    assert plan.cost == pytest.approx(plan.motion, rel=1e-12)
    assert plan.segments[0][0] == 0
    assert plan.segments[-1][1] == points - 1
    for number, (first, last) in enumerate(plan.segments):
        if number:
            assert first == plan.segments[number - 1][1]
        for q, frame in zip(
            plan.segment(number), core_path(path).frames(rd.Task.full())[first : last + 1], strict=True
        ):
            assert np.abs(PUMA.fk(q) - frame).max() < 1e-8
        assert all(np.abs(steps).max() <= STEP + 1e-9 for steps in walked if len(steps))


def test_transfers_lead_off_the_work_and_down_again() -> None:
    path = knife(2.3, 161)
    plan = rd.plan(ARM, path, rd.Task.full(), criterion="motion", max_step=STEP, reconfigurations=True, lift_off=0.03)
    assert len(plan.transfers) == len(plan.segments) - 1 > 0
    assert plan.reconfigurations in repr(plan)
    for number, transfer in enumerate(plan.transfers):
        last, first = transfer.points
        assert (last, first) == (plan.segments[number][1], plan.segments[number + 1][0])
        assert (transfer.q[0] == plan.q[last]).all()
        assert (transfer.q[-1] == plan.segment(number + 1)[0]).all()
        assert np.abs(np.diff(transfer.q, axis=0)).max() <= STEP + 1e-12
        assert (np.abs(transfer.q) <= 3.0).all()
        assert transfer.lift == pytest.approx((0.03, 0.03))
        for rows, lift in ((transfer.q, transfer.lift[0]), (transfer.q[::-1], transfer.lift[1])):
            tools = [PUMA.fk(q) for q in rows]
            back = -tools[0][:3, 2]
            ways = [float(back @ (tool[:3, 3] - tools[0][:3, 3])) for tool in tools]
            up = 1 + next(i for i, way in enumerate(ways) if way > lift - 1e-9)
            for tool, way in zip(tools[:up], ways[:up], strict=True):
                assert np.abs(tool[:3, :3] - tools[0][:3, :3]).max() < 1e-8
                assert np.abs(tool[:3, 3] - tools[0][:3, 3] - way * back).max() < 1e-8
            assert (np.diff(ways[:up]) > 0.0).all()
        assert transfer.allowed
        assert len(transfer.time) == len(transfer)
        rate = np.abs(np.diff(transfer.q, axis=0)) / np.diff(transfer.time)[:, None]
        assert rate.max() == pytest.approx(2.0)


def test_a_limit_ends_the_lift() -> None:
    path = knife(2.3, 161)
    plan = rd.plan(ARM, path, rd.Task.full(), criterion="motion", max_step=STEP, reconfigurations=True, lift_off=5.0)
    assert all(0.0 < lift < 1.5 for transfer in plan.transfers for lift in transfer.lift)
    assert all((np.abs(transfer.q) <= 3.0).all() for transfer in plan.transfers)


def test_a_whole_way_is_not_cut_and_a_point_out_of_reach_stays_a_failure() -> None:
    path = helix(31)
    plain = rd.plan(ROBOT, path, objective=KAPPA)
    asked = rd.plan(ROBOT, path, objective=KAPPA, reconfigurations=True)
    assert (plain.q == asked.q).all()
    assert asked.segments == plain.segments == [(0, 30)]
    assert asked.transfers == []
    assert asked.reconfigurations == "no reconfigurations"
    far = rd.Toolpath(path.position + 2.0 * np.eye(3)[1], path.axis)
    lost = rd.plan(ROBOT, far, objective=KAPPA, reconfigurations=True)
    assert lost.failure is not None
    assert lost.transfers == []


def test_a_predicate_judges_transfers() -> None:
    path = knife(2.3, 161)
    highest = 0.15
    plan = rd.plan(
        ARM,
        path,
        rd.Task.full(),
        criterion="motion",
        max_step=STEP,
        reconfigurations=True,
        feasible=lambda q: ARM.fk(q)[:, 2, 3] < highest,
        lift_off=0.1,
    )
    assert plan.failure is None
    assert not any(transfer.allowed for transfer in plan.transfers)


def test_a_closed_path_that_cannot_close_is_led_back() -> None:
    path = knife(1.0, 91)
    plan = rd.plan(ARM, path, rd.Task.full(), criterion="motion", max_step=STEP, closed=True, reconfigurations=True)
    assert plan.failure is None
    assert len(plan.transfers) == len(plan.segments)
    assert plan.transfers[-1].points == (90, 0)
    assert (plan.transfers[-1].q[-1] == plan.q[0]).all()


def test_speeds_are_those_of_the_segments() -> None:
    path = replace_time(knife(2.3, 161), 30.0)
    plan = rd.plan(ARM, path, rd.Task.full(), criterion="motion", reconfigurations=True)
    assert plan.failure is None
    assert plan.joint_speed is not None
    assert len(plan.segments) > 1
    assert np.abs(plan.joint_speed).max() <= 2.0 + 1e-9
    # The postures of the points alone would tell of a jump.
    assert np.abs(np.diff(plan.q, axis=0)).max() / (30.0 / 160) > 2.0


def replace_time(path: rd.Toolpath, duration: float) -> rd.Toolpath:
    return replace(path, time=np.linspace(0.0, duration, len(path)))


def test_the_path_of_iklink() -> None:
    """Two reconfigurations, as its authors find; every pose exactly, by products of matrices."""
    path, arm = iklink.path(), iklink.robot()
    plan = iklink.plan()
    assert plan.failure is None
    assert len(plan.segments) == 3
    assert plan.reconfigurations.startswith("2 reconfigurations, at points ")
    half = 0.5**0.5
    hand = np.array([[half, half, 0, 0], [-half, half, 0, 0], [0, 0, 1, 0.107], [0, 0, 0, 1]])
    chain = replace(PANDA, tool=hand)
    for number, (first, last) in enumerate(plan.segments):
        q = plan.segment(number)
        assert path.time is not None
        speed = np.abs(np.diff(q, axis=0)) / np.diff(path.time)[first:last, None]
        assert (speed <= arm.qd_max + 1e-9).all()
        assert (q >= arm.q_min - 1e-12).all()
        assert (q <= arm.q_max + 1e-12).all()
        for row, point in zip(q[::20], range(first, last + 1, 20), strict=True):
            tool = chain.fk(row)
            assert np.abs(tool[:3, 3] - path.position[point]).max() < 1e-8
            assert path.rotation is not None
            assert np.abs(tool[:3, :3] - path.rotation[point]).max() < 1e-8


def test_what_the_command_line_tells_and_writes(tmp_path: Path) -> None:
    job_file = tmp_path / "job.toml"
    job_file.write_text(
        'robot = "fanuc_m710ic50_milling"\n[path]\nhelix = { radius_mm = 250, pitch_mm_per_rad = 159, start_deg = 0, '
        "stop_deg = 60, offset_deg = 180, center_mm = [1300, 1000, 0], points = 11 }\n"
        "[plan]\nreconfigurations = true\nlift_off_mm = 30\n"
    )
    job = read_job(job_file)
    assert job.plan.settings.reconfigurations
    assert job.plan.settings.lift_off == pytest.approx(0.03)
    path = knife(2.3, 161)
    plan = rd.plan(ARM, path, rd.Task.full(), criterion="motion", max_step=STEP, reconfigurations=True)
    console = Console(width=120, record=True, quiet=False)
    console.print(plan_table(plan, "motion", 0.1))
    assert plan.reconfigurations in console.export_text()
    assert "transfers.json" in write_plan(tmp_path / "out", plan, None, job, False)
    written = json.loads((tmp_path / "out" / "transfers.json").read_text())
    assert [tuple(way["points"]) for way in written] == [way.points for way in plan.transfers]
    assert np.abs(np.array(written[0]["q"]) - plan.transfers[0].q).max() == 0.0
