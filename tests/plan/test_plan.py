"""Plans of whole paths: the reference of the thesis' helix, and what every plan has to keep."""

from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

from evidence.planner import cases
from tests.reference.chain import F64
from tests.reference.files import read_json
from tests.reference.plans import KAPPA, ROBOT, check, circle, helix, line, speed_share

REFERENCE = read_json("leger_fanuc.json")["helix"]


def test_helix_of_the_thesis() -> None:
    plan = rd.plan(ROBOT, helix(), objective=KAPPA)
    check(plan)
    assert plan.refined
    assert plan.failure is None
    assert plan.value.max() <= 2.54226
    assert abs(plan.value.max() - REFERENCE["minimax_over_continuous_paths"]) < 1e-6
    assert 0.0 <= plan.gap < 1e-4
    assert plan.residual < 1e-8
    # The bound against the reference's own minima, found point by point without this package.
    assert plan.bound <= max(REFERENCE["pointwise_minimum_kappa"]) + 1e-7
    # The family of the reference's posture: shoulder, elbow and wrist on the same sides.
    first = np.deg2rad(REFERENCE["first_point_q_deg"])
    assert np.abs(plan.q[0, :3] - first[:3]).max() < 0.2


def test_every_branch_family_of_the_helix() -> None:
    worst = sorted(
        float(rd.plan(ROBOT, helix(), objective=KAPPA, branches=(branch,), limits=False).value.max())
        for branch in range(8)
    )
    np.testing.assert_allclose(worst, sorted(REFERENCE["minimax_per_branch"]), atol=1e-3)
    # The reference is that of a grid that was refined: it may be worse, not better.
    assert (np.array(worst) < np.array(sorted(REFERENCE["minimax_per_branch"])) + 1e-6).all()


def test_integral_is_stationary_by_differences() -> None:
    weight = 1e-3
    plan = rd.plan(ROBOT, helix(41), objective=KAPPA, criterion="integral", smoothness=weight, bound=True)
    check(plan)
    assert plan.refined

    def cost(q: F64) -> float:
        steps = np.full(40, 1.0 / 40.0)
        weights = np.convolve(steps, [0.5, 0.5])
        value = KAPPA.evaluate_many(ROBOT, q, 0)[0]
        return float(weights @ value + weight * (np.diff(q, axis=0) ** 2).sum(axis=1) @ (1.0 / steps))

    assert cost(plan.q) == pytest.approx(plan.cost, rel=1e-9)
    for point in (0, 7, 20, 40):
        # The tool turned a little about its axis: every other posture is worse, by the square of the turn.
        rises = []
        for turn in (-2e-3, 2e-3):
            frame = ROBOT.fk(plan.q[point])
            c, s = np.cos(turn), np.sin(turn)
            frame[:3, :3] = frame[:3, :3] @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            solutions = ROBOT.inverse(frame)
            q = plan.q.copy()
            q[point] = solutions[np.abs(solutions - plan.q[point]).max(axis=1).argmin()]
            rises.append(cost(q) - cost(plan.q))
        assert min(rises) > 0.0
        assert abs(rises[0] - rises[1]) < 0.05 * max(rises)


def test_motion_is_least_between_two_fixed_spins() -> None:
    # Nothing but motion counts: no plan with another spin moves less than the one found.
    robot = rd.robots.get("abb_irb2400")
    path = line((0.85, -0.4, 0.8), (0.85, 0.4, 0.8), 50)
    plan = rd.plan(robot, path, criterion="motion")
    check(plan)
    assert plan.refined
    chart = rd.redundancy_map(robot, path, n_angles=72)
    assert chart.feasible.any(axis=(1, 2)).all()
    follow = rd.follow(rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(0.45, squared=True)), path)
    assert plan.motion <= ((np.diff(follow.q, axis=0) ** 2).sum() * 49.0) + 1e-9
    straight = rd.follow(
        rd.OrthogonalSQP(robot, rd.Task.full(), rd.ConditionNumber(0.45)),
        path.without_spin(robot.fk(plan.q[0])[:3, :3]),
        plan.q[0],
    )
    assert plan.motion <= (np.diff(straight.q, axis=0) ** 2).sum() * 49.0 + 1e-9


@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
def test_closed_paths_close(criterion: str) -> None:
    plan = rd.plan(ROBOT, circle((1.2, 0.2, 0.3), 0.25, 81), objective=KAPPA, criterion=criterion, closed=True)
    check(plan)
    assert plan.refined
    turns = (plan.q[-1] - plan.q[0]) / (2.0 * np.pi)
    assert np.abs(turns - np.round(turns)).max() < 1e-12
    # No corner at the seam: the step across it is like its neighbours.
    steps = np.diff(plan.q, axis=0)
    assert np.abs(steps[0] - steps[-1]).max() < 3.0 * np.abs(np.diff(steps, axis=0)).max()


def test_a_closed_path_that_winds_keeps_its_limits_where_it_ends() -> None:
    # The last point is the first, a whole turn of the fifth joint or the fourth away.
    case = cases.case("star", "abb_irb2400")
    objective = rd.ConditionNumber(case.length)
    plan = rd.plan(case.robot, case.path, objective=objective, criterion="integral", closed=True, effort=1)
    check(plan)
    turns = (plan.q[-1] - plan.q[0]) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-9)
    assert np.abs(np.round(turns)).max() == 1.0


def test_speed_limits_bind_and_hold() -> None:
    free = rd.plan(ROBOT, circle((1.2, 0.2, 0.3), 0.25, 121, duration=10.0), objective=KAPPA)
    tight = rd.plan(ROBOT, circle((1.2, 0.2, 0.3), 0.25, 121, duration=0.6), objective=KAPPA)
    check(tight)
    assert tight.refined
    assert speed_share(free).max() * 10.0 / 0.6 > 1.2  # what it would take as it is
    assert 0.99 < speed_share(tight).max() <= 1.0
    assert tight.value.max() >= free.value.max() - 1e-9


def test_spin_range_holds() -> None:
    free = rd.plan(ROBOT, helix(), objective=KAPPA)
    chart = rd.redundancy_map(ROBOT, helix(), objective=KAPPA, n_angles=8)
    spin = np.unwrap(chart.spin_of(free))
    low, high = float(spin.min() - 1.0), float(spin.max() - 0.1)
    plan = rd.plan(ROBOT, helix(), objective=KAPPA, spin_range=(low, high))
    check(plan)
    assert plan.failure is None
    middle = 0.5 * (low + high)
    held = middle + np.angle(np.exp(1j * (chart.spin_of(plan) - middle)))
    assert low - 1e-9 <= held.min()
    assert held.max() <= high + 1e-9
    assert plan.value.max() >= free.value.max() - 1e-9


def test_predicate_is_heeded() -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 61)
    free = rd.plan(ROBOT, path, objective=KAPPA)
    ceiling = float(free.q[:, 4].max() - 0.05)
    plan = rd.plan(ROBOT, path, objective=KAPPA, feasible=lambda q: q[:, 4] < ceiling)
    if plan.failure is None:
        assert (plan.q[:, 4] < ceiling).all()
    refused = rd.plan(ROBOT, path, objective=KAPPA, feasible=lambda q: np.zeros(len(q), dtype=bool))
    assert refused.failure is not None
    assert (refused.failure.point, refused.failure.cause) == (0, "predicate")
    with pytest.raises(rd.InvalidValueError, match="expected bool of shape"):
        rd.plan(ROBOT, path, objective=KAPPA, feasible=lambda q: q[:, 0])


def test_warm_start_after_an_edit() -> None:
    before = rd.plan(ROBOT, helix(), objective=KAPPA)
    edited = rd.Toolpath(helix().position + np.array([0.0, 0.0, 0.01]), helix().axis)
    cold, warm = (rd.plan(ROBOT, edited, objective=KAPPA, warm_start=start) for start in (None, before))
    check(warm)
    assert warm.refined
    assert warm.value.max() == pytest.approx(cold.value.max(), rel=1e-6)
    finer = rd.plan(ROBOT, helix(151), objective=KAPPA, warm_start=before)
    check(finer)
    # An earlier plan that leads nowhere is no harm.
    far = rd.plan(ROBOT, circle((1.2, 0.2, 0.3), 0.25, 61), objective=KAPPA, warm_start=before)
    assert far.failure is None
    with pytest.raises(rd.InvalidValueError, match="7 joints"):
        rd.plan(
            ROBOT,
            helix(),
            objective=KAPPA,
            warm_start=rd.plan(
                rd.robots.get("kuka_iiwa14"),
                line((0.5, -0.1, 0.4), (0.5, 0.1, 0.4), 5),
                objective=rd.ConditionNumber(0.4),
                n_angles=12,
                n_spare=6,
            ),
        )


@pytest.mark.parametrize("points", [1, 2, 3])
def test_few_points(points: int) -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 121)
    plan = rd.plan(ROBOT, rd.Toolpath(path.position[:points], path.axis[:points]), objective=KAPPA)
    check(plan)
    assert plan.refined
    assert plan.gap < 1e-6


def test_repeated_points() -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 121)
    plan = rd.plan(
        ROBOT,
        rd.Toolpath(np.repeat(path.position[:20], 3, axis=0), np.repeat(path.axis[:20], 3, axis=0)),
        objective=KAPPA,
    )
    check(plan)
    assert plan.failure is None


def test_whole_turns_stay_within_limits() -> None:
    # Six times round: joint 6 or the spin has to give way before a limit of 400 deg.
    robot = rd.robots.get("abb_irb120").with_tool(
        np.array([[0.8, 0, 0.6, 0.05], [0, 1, 0, 0], [-0.6, 0, 0.8, 0.1], [0, 0, 0, 1.0]])
    )
    s = np.linspace(0.0, 12.0 * np.pi, 241)
    axis = np.stack([-0.5 * np.cos(s), -0.5 * np.sin(s), np.full(241, -np.sqrt(0.75))], axis=1)
    path = rd.Toolpath(np.array([0.35, 0.0, 0.2]) + 0.05 * np.stack([np.cos(s), np.sin(s), 0 * s], axis=1), axis)
    plan = rd.plan(robot, path, objective=rd.ConditionNumber(0.2))
    check(plan)
    assert plan.failure is None
    assert np.abs(np.diff(plan.q, axis=0)).max() < 0.5


SEVEN = {
    "kuka_iiwa14": circle((0.55, 0.0, 0.35), 0.1, 41, 0.3),
    "panda": circle((0.4, 0.0, 0.2), 0.1, 41, 0.2),
}


@pytest.mark.parametrize("name", SEVEN)
def test_two_freedoms(name: str) -> None:
    robot, path = rd.robots.get(name), SEVEN[name]
    objective = rd.ConditionNumber(0.4)
    plan = rd.plan(robot, path, objective=objective, n_angles=24, n_spare=12, layers=24)
    check(plan)
    assert plan.failure is None
    assert np.abs(np.diff(plan.q, axis=0)).max() < 0.5
    follow = rd.follow(rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(0.4, squared=True)), path)
    assert not follow.unreachable
    assert plan.value.max() <= follow.condition_number.max() * (1.0 + 1e-6)


def test_seven_axes_with_a_fixed_orientation() -> None:
    robot = rd.robots.get("kuka_iiwa14")
    points = 31
    flat = line((0.55, -0.2, 0.4), (0.55, 0.2, 0.4), points)
    path = rd.Toolpath(flat.position, flat.axis, np.tile(np.diag([1.0, -1.0, -1.0]), (points, 1, 1)))
    plan = rd.plan(robot, path, rd.Task.full(), rd.ConditionNumber(0.4))
    check(plan)
    assert plan.refined
    assert path.rotation is not None
    np.testing.assert_allclose(robot.fk(plan.q)[:, :3, :3], path.rotation, atol=1e-9)


def test_a_rail_helps() -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 61)
    alone = rd.plan(ROBOT, path, objective=KAPPA)
    rail = rd.on_rail(ROBOT, (0.0, 1.0, 0.0), -1.0, 1.0)
    np.testing.assert_allclose(
        rail.fk(np.r_[0.3, alone.q[0]])[:3, 3], ROBOT.fk(alone.q[0])[:3, 3] + [0.0, 0.3, 0.0], atol=1e-12
    )
    carried = rd.plan(rail, path, objective=KAPPA, n_angles=24, n_spare=12, layers=24)
    check(carried)
    assert carried.failure is None


def test_a_turntable_turns_the_part() -> None:
    table = np.eye(4)
    table[:3, 3] = [1.2, 0.2, 0.3]
    robot = rd.with_turntable(ROBOT, table, -np.pi, np.pi)
    q = np.array([0.2, 0.3, 0.1, 0.4, 0.5, 0.6])
    for angle in (0.0, 0.7, -2.0):
        c, s = np.cos(angle), np.sin(angle)
        turned = table @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
        np.testing.assert_allclose(turned @ robot.fk(np.r_[angle, q]), ROBOT.fk(q), atol=1e-12)
    plan = rd.plan(robot, circle((0.0, 0.0, 0.0), 0.25, 61), objective=KAPPA, n_angles=24, n_spare=12, layers=24)
    check(plan)
    assert plan.failure is None


def test_an_objective_in_python() -> None:
    plain = rd.plan(ROBOT, helix(21), objective=KAPPA, n_angles=24, layers=8)

    def function(q: F64) -> tuple[float, F64, F64]:
        value, gradient, hessian = KAPPA.evaluate(ROBOT, q, 2)
        return value, gradient, hessian

    own = rd.plan(ROBOT, helix(21), objective=rd.CustomIndex(function), n_angles=24, layers=8)
    assert own.value.max() == pytest.approx(plain.value.max(), rel=1e-6)


def test_plot_and_write(tmp_path: Path) -> None:
    plan = rd.plan(ROBOT, helix(21), objective=KAPPA)
    chart = rd.redundancy_map(ROBOT, helix(21), objective=KAPPA, n_angles=36)
    chart.plot(tmp_path / "map.png", plan)
    plan.write(tmp_path / "plan.csv")
    assert (tmp_path / "map.png").stat().st_size > 10_000
    assert repr(plan).startswith("Plan(fanuc_m710ic50_milling, 21 points, minimax, worst value 2.5")


def test_map_against_single_solutions() -> None:
    path = helix(7)
    chart = rd.redundancy_map(ROBOT, path, objective=KAPPA, n_angles=12)
    follow = rd.plan(ROBOT, path, objective=KAPPA, n_angles=12)
    assert chart.value.shape == (7, 12, 8)
    assert np.isnan(chart.value[~chart.feasible]).all()
    assert np.isfinite(chart.value[chart.feasible]).all()
    spin = chart.spin_of(follow)
    frame = ROBOT.fk(follow.q[3])
    for j, angle in enumerate(chart.angles):
        c, s = np.cos(angle - spin[3]), np.sin(angle - spin[3])
        pose = frame.copy()
        pose[:3, :3] = frame[:3, :3] @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        solutions = ROBOT.inverse(pose, limits=True)
        values = np.sort(KAPPA.evaluate_many(ROBOT, solutions, 0)[0]) if len(solutions) else np.empty(0)
        np.testing.assert_allclose(np.sort(chart.value[3, j][chart.feasible[3, j]]), values, rtol=1e-9)
    assert (np.nanmin(chart.best, axis=1) >= np.array(REFERENCE["pointwise_minimum_kappa"]).min() - 1e-9).all()


def test_map_tells_causes() -> None:
    far = rd.redundancy_map(ROBOT, line((1.2, 0.0, 0.3), (9.0, 0.0, 0.3), 3), objective=KAPPA, n_angles=24)
    names = far.CAUSES
    assert (far.cause[-1] == names.index("unreachable")).all()
    assert far.feasible[0].any()
    narrow = ROBOT.with_limits(q_min=np.r_[0.5, ROBOT.q_min[1:]], q_max=np.r_[0.6, ROBOT.q_max[1:]])
    chart = rd.redundancy_map(narrow, line((1.2, 0.0, 0.3), (1.2, 0.1, 0.3), 2), objective=KAPPA, n_angles=24)
    assert (chart.cause == names.index("joint limit")).any()
    assert not chart.feasible[0].any()
    refused = rd.redundancy_map(
        ROBOT, line((1.2, 0.0, 0.3), (1.2, 0.1, 0.3), 2), objective=KAPPA, n_angles=24, feasible=lambda q: q[:, 0] > 9.0
    )
    assert set(np.unique(refused.cause)) <= {1, 2, names.index("predicate")}


def test_a_rival_without_a_cost_never_wins() -> None:
    from redundancy._plan_refine import Part, best_part
    from redundancy._plan_setup import Setup

    path = helix(3)
    setup = Setup.of(ROBOT, path, rd.Task.axisymmetric(), KAPPA, "integral", None, True, False, None, 9)
    q, value = np.zeros((3, 6)), np.ones(3)
    good = Part(0, q, value, cost=2.0, motion=1.0, residual=0.0, smoothness=0.0, refined=True)
    broken = Part(0, q, value, cost=float("nan"), motion=0.0, residual=0.0, smoothness=0.0, refined=False)
    assert best_part(setup, [broken, good]) is good
    assert best_part(setup, [good, broken]) is good
    assert best_part(setup, [broken]) is broken
