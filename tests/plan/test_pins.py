"""Postures and spins that are held along a path."""

from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from click.testing import CliRunner
from redundancy.cli.commands import main
from redundancy.planning import PlanSettings, core_path

from tests.reference.chain import F64, PUMA
from tests.reference.plans import KAPPA, ROBOT, check, circle, helix

TURNING = PUMA.robot().with_limits(q_min=np.full(6, -8.0), q_max=np.full(6, 8.0), qd_max=np.full(6, 2.0))


def across(points: int = 41, duration: float | None = None) -> rd.Toolpath:
    """A straight line in front of the arm, the tool pointing down."""
    line = np.linspace([0.45, -0.2, 0.05], [0.45, 0.2, 0.05], points)
    time = None if duration is None else np.linspace(0.0, duration, points)
    return rd.Toolpath(line, np.tile([0.0, 0.0, -1.0], (points, 1)), time=time)


def spins(robot: rd.Robot, path: rd.Toolpath, q: F64) -> F64:
    return core_path(path).spins(robot, rd.Task.axisymmetric(), q)


def turn(angle: F64 | float) -> F64:
    """An angle up to whole turns."""
    return np.asarray((np.asarray(angle) + np.pi) % (2.0 * np.pi) - np.pi)


@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
def test_postures_and_spins_come_back_digit_for_digit(criterion: str) -> None:
    path = across()
    free = rd.plan(TURNING, path, objective=rd.ConditionNumber(0.3), criterion="integral")
    other = rd.plan(TURNING, path, objective=rd.ConditionNumber(0.3), criterion="motion", pins={20: free.q[20]})
    pins = {10: float(spins(TURNING, path, free.q)[10]) + 0.3, 30: other.q[30]}
    plan = rd.plan(
        TURNING,
        path,
        objective=rd.ConditionNumber(0.3),
        criterion=criterion,
        start=other.q[0],
        end=other.q[-1],
        pins=pins,
    )
    assert plan.failure is None
    assert plan.refined
    for point, posture in ((0, other.q[0]), (40, other.q[-1]), (30, other.q[30])):
        assert (plan.q[point] == posture).all()
    assert abs(turn(spins(TURNING, path, plan.q)[10] - pins[10])) < 1e-9
    for q, position, axis in zip(plan.q, path.position, path.axis, strict=True):
        tool = PUMA.fk(q)
        assert np.abs(tool[:3, 3] - position).max() < 1e-9
        assert np.abs(tool[:3, 2] - axis).max() < 1e-9


def test_pins_on_the_optimum_cost_nothing_and_others_do() -> None:
    path = helix()
    free = rd.plan(ROBOT, path, objective=KAPPA, criterion="integral", smoothness=0.01)
    held = rd.plan(
        ROBOT, path, objective=KAPPA, criterion="integral", smoothness=0.01, pins={25: free.q[25], 60: free.q[60]}
    )
    check(held)
    assert held.cost == pytest.approx(free.cost, rel=1e-9)
    assert np.abs(held.q - free.q).max() < 1e-4
    spin = spins(ROBOT, path, free.q)
    costs = [
        rd.plan(
            ROBOT, path, objective=KAPPA, criterion="integral", smoothness=0.01, pins={60: float(spin[60]) + by}
        ).cost
        for by in (0.0, 0.1, 0.2)
    ]
    assert costs[0] == pytest.approx(free.cost, rel=1e-9)
    assert costs[0] < costs[1] < costs[2]


def test_the_parts_beside_a_pin_are_best_by_themselves() -> None:
    """Bellman: what lies before a pin and what lies behind it do not know of each other."""
    path = helix()
    free = rd.plan(ROBOT, path, criterion="motion")
    pinned = rd.plan(ROBOT, path, criterion="motion", pins={40: float(spins(ROBOT, path, free.q)[40]) + 0.25})
    here = pinned.q[40]
    first = rd.plan(ROBOT, rd.Toolpath(path.position[:41], path.axis[:41]), criterion="motion", end=here)
    second = rd.plan(ROBOT, rd.Toolpath(path.position[40:], path.axis[40:]), criterion="motion", start=here)
    shares = core_path(path).shares
    total = first.motion / shares[:40].sum() + second.motion / shares[40:].sum()
    assert pinned.motion == pytest.approx(total, rel=1e-8)
    assert (first.q[-1] == here).all()
    assert (second.q[0] == here).all()


def test_whole_turns_are_those_that_were_asked_for() -> None:
    path = across()
    free = rd.plan(TURNING, path, criterion="motion")
    whole = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 2.0 * np.pi])
    start, end = free.q[0].copy(), free.q[-1].copy()
    start[5], end[5] = turn(start[5]), turn(end[5])
    near = start[5] - end[5]
    for turned in (-whole, 0.0 * whole):
        plan = rd.plan(TURNING, path, criterion="motion", start=start + turned, end=end, max_step=0.6)
        assert plan.failure is None
        assert (plan.q[0] == start + turned).all()
        assert (plan.q[-1] == end).all()
        assert np.abs(np.diff(plan.q, axis=0)).max() <= 0.6 + 1e-9
        # The joint passes all angles between: the tool spins a turn more.
        assert plan.q[0, 5] - plan.q[-1, 5] == pytest.approx(near + turned[5])


def test_a_seven_axis_arm_keeps_spin_and_posture() -> None:
    tool = np.eye(4)
    tool[:3, 3] = 0.05, 0.0, 0.15
    arm = rd.robots.get("kuka_iiwa14").with_tool(tool)
    known = np.linspace([0.2, 0.5, 0.3, -1.2, 0.2, 0.8, 0.1], [0.4, 0.7, 0.1, -1.0, 0.4, 0.9, 0.3], 21)
    frames = arm.fk(known)
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2])
    spin = float(spins(arm, path, known)[12])
    plan = rd.plan(arm, path, objective=rd.ConditionNumber(0.3), start=known[0], pins={12: spin + 0.1})
    check(plan)
    assert plan.failure is None
    assert plan.refined
    assert (plan.q[0] == known[0]).all()
    assert abs(turn(spins(arm, path, plan.q)[12] - spin - 0.1)) < 1e-9
    # The elbow of the point whose spin is held is still free.
    assert np.abs(plan.q[12] - known[12]).max() > 0.01


def test_pins_of_known_motions_are_followed() -> None:
    """Postures and spins of a motion within limits and steps: there is a way, so one has to be found."""
    rng = np.random.default_rng(7)
    robot, span = ROBOT, ROBOT.q_max - ROBOT.q_min
    for case in range(12):
        points = int(rng.integers(12, 40))
        s = np.linspace(0.0, 1.0, points)[:, None]
        start = robot.q_min + span * rng.uniform(0.3, 0.7, 6)
        known = start + np.clip(rng.normal(size=6), -2, 2) * 0.05 * span * s
        frames = robot.fk(known)
        path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2])
        held = sorted(rng.choice(points, 3, replace=False).tolist())
        pins = {point: known[point] for point in held}
        largest = max(0.25, 1.2 * float(np.abs(np.diff(known, axis=0)).max()))
        plan = rd.plan(robot, path, criterion="motion", pins=pins, max_step=largest)
        assert plan.failure is None, (case, plan.failure)
        check(plan)
        assert all((plan.q[point] == posture).all() for point, posture in pins.items())
        assert np.abs(np.diff(plan.q, axis=0)).max() <= largest + 1e-9


def test_speed_limits_hold_at_pins_and_infeasible_ones_are_named() -> None:
    path = across(41, 4.0)
    free = rd.plan(TURNING, path, criterion="motion")
    spin = spins(TURNING, path, free.q)
    plan = rd.plan(TURNING, path, criterion="motion", pins={20: float(spin[20]) + 1.0})
    assert plan.failure is None
    assert plan.joint_speed is not None
    assert np.abs(plan.joint_speed).max() <= 2.0 + 1e-9
    # In a tenth of a second no joint turns by a radian.
    wrong = rd.plan(TURNING, path, criterion="motion", pins={20: free.q[20], 21: float(spin[21]) + 1.0})
    assert wrong.failure is not None
    assert wrong.failure.point == 21
    assert wrong.failure.pins == (21,)
    assert wrong.failure.cause == "speed limit"
    assert str(wrong.failure).startswith("pin at point 21: it cannot be reached from point 20 within the speed limit")


def test_a_closed_path_starts_where_it_is_told() -> None:
    path = circle((1.3, 0.0, 0.6), 0.2, 61)
    free = rd.plan(ROBOT, path, objective=KAPPA, criterion="integral", smoothness=1e-3, closed=True)
    spin = float(spins(ROBOT, path, free.q)[0])
    moved = rd.plan(
        ROBOT, path, objective=KAPPA, criterion="integral", smoothness=1e-3, closed=True, pins={0: spin + 0.2}
    )
    assert moved.failure is None
    again = rd.plan(ROBOT, path, objective=KAPPA, criterion="integral", smoothness=1e-3, closed=True, start=moved.q[0])
    check(again)
    assert again.failure is None
    assert (again.q[0] == moved.q[0]).all()
    assert np.abs(turn(again.q[-1] - again.q[0])).max() <= 1e-12
    assert again.cost == pytest.approx(moved.cost, rel=1e-7)


def test_what_cannot_be_held_is_refused() -> None:
    path = helix()
    posture = rd.plan(ROBOT, path, criterion="motion").q[0]

    def refused(words: str, **settings: object) -> None:
        with pytest.raises(rd.errors.RedundancyError, match=words):
            rd.plan(ROBOT, path, criterion="motion", **settings)  # type: ignore[arg-type]

    refused(
        r"start is a posture .* m and .* rad off point 0 of the path, expected one within 1e-6", start=posture + 0.01
    )
    refused(r"end is a posture .* off point 100", end=posture)
    refused(r"start: got shape \(5,\), expected \(6,\)", start=posture[:5])
    refused("joint 2.*expected one within its limits", start=posture + 9.0 * np.eye(6)[1])
    refused(r"pins\[0\] is a second one at point 0", start=posture, pins={0: 0.1})
    refused("at point 101, expected points from 0 to 100", pins={101: 0.1})
    refused(r"pins\[3\]\[0\] is NaN", pins={3: np.nan})
    refused("pins is .*expected points, counted from 0, with a spin", pins={"a": 1.0})
    refused("pins is .*expected points", pins=[1.0])
    refused("one within spin_range", pins={3: 0.5}, spin_range=(-0.3, 0.3))
    ring = circle((1.3, 0.0, 0.6), 0.2, 61)
    with pytest.raises(
        rd.errors.InvalidValueError, match="end is given, expected none at the last point of a closed path"
    ):
        rd.plan(ROBOT, ring, criterion="motion", closed=True, end=posture)
    scara = rd.robots.get("stanford_arm")
    frames = scara.fk(np.linspace([0.1, 0.8, 0.5, 0.4, 0.5, 0.3], [0.2, 0.7, 0.5, 0.4, 0.5, 0.3], 5))
    full = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], frames[:, :3, :3])
    with pytest.raises(rd.errors.InvalidValueError, match=r"the task leaves .* no spin, expected a posture"):
        rd.plan(scara, full, rd.Task.full(), criterion="motion", pins={2: 0.1})


def test_settings_show_what_is_held() -> None:
    settings = PlanSettings(start=[1, 2, 3], pins={4: 0.5, 2: [3, 2, 1]})
    assert settings.start is not None
    assert settings.start.tolist() == [1, 2, 3]
    assert settings.end is None
    assert settings.pins is not None
    assert settings.pins[4] == 0.5
    assert PlanSettings().pins is None
    assert np.asarray(settings.pins[2]).tolist() == [3, 2, 1]
    assert settings == PlanSettings(start=[1, 2, 3], pins={4: 0.5, 2: [3, 2, 1]})
    assert settings != PlanSettings(start=[1, 2, 3])


JOB = """
robot = "fanuc_m710ic50_milling"
[path]
helix = {{ radius_mm = 250, pitch_mm_per_rad = 159.15494309189535, start_deg = 0, stop_deg = 90, offset_deg = 180,
          center_mm = [1300, 1000, 0], points = 31 }}
[plan]
criterion = "motion"
{plan}
"""


def run(folder: Path, plan: str) -> tuple[int, str]:
    job = folder / "job.toml"
    job.write_text(JOB.format(plan=plan).replace("\n          ", " "))
    result = CliRunner().invoke(main, ["plan", str(job), "--out", str(folder / "out"), "--no-pictures"])
    return result.exit_code, result.output


def test_job_files_hold_postures_and_spins(tmp_path: Path) -> None:
    path = helix(31)
    free = rd.plan(ROBOT, path, criterion="motion")
    degrees = ", ".join(repr(float(x)) for x in np.rad2deg(free.q[0]))
    spin = float(np.rad2deg(spins(ROBOT, path, free.q)[15])) + 5.0
    code, output = run(tmp_path, f"start_deg = [{degrees}]\npins_deg = [[15, {spin}]]")
    assert code == 0, output
    read = rd.Trajectory.read(tmp_path / "out" / "trajectory.csv", ROBOT)
    assert np.abs(read.q[0] - free.q[0]).max() < 1e-9
    assert abs(turn(spins(ROBOT, path, read.q)[15] - np.deg2rad(spin))) < 1e-9
    code, output = run(tmp_path, "pins = [[15, 45.0]]")
    assert code == 2
    assert "pins_deg" in output
    code, output = run(tmp_path, "start = [0, 0, 0, 0, 0, 0]\nstart_deg = [0, 0, 0, 0, 0, 0]")
    assert code == 2
    assert "start or start_deg, not both" in output
    code, output = run(tmp_path, "pins = [[15, 0.1], [15, 0.2]]")
    assert code == 2
