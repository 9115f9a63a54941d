"""The examples of Huo (2009), as `evidence.huo` computes them: what the page docs/reproduction_huo.md claims."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd

from evidence.huo import cases as huo
from evidence.huo import runs

CASES = ("puma_pipe", "m16ib_sphere_edge", "m710_cylinders", "m710_tilted", "m710_rectangle", "m16ib_oblique")
METHODS = (
    rd.TwistDecomposition,
    rd.GradientProjection,
    rd.VirtualJoint,
    rd.TaskPriority,
    rd.WeightedInverse,
    rd.Householder,
    rd.Elimination,
)


@pytest.fixture(scope="module")
def cases() -> dict[str, Any]:
    return {build.__name__: build() for build in huo.BUILDERS}


# --- PUMA -------------------------------------------------------------------------------------------------------------


def test_without_resolution_joint_6_winds_up(cases: dict[str, Any]) -> None:
    case = cases["puma_pipe"]
    found = runs.unresolved(case)
    assert not found.unreachable
    q, points = found.q, len(found) // 2
    # A whole turn of the joint for each of the tool.
    np.testing.assert_allclose(q[points:, 5] - q[: points + 1, 5], -2.0 * np.pi, rtol=0, atol=1e-9)
    np.testing.assert_allclose(q[points:, :5], q[: points + 1, :5], rtol=0, atol=1e-9)
    assert found.limit_margin < -np.pi


def test_twist_decomposition_repeats_bounded_turns(cases: dict[str, Any]) -> None:
    case = cases["puma_pipe"]
    found = runs.run(runs.puma_solver(case, rd.TwistDecomposition), case, runs.pipe(case, 100, turns=3))
    assert not found.unreachable
    one, two, three = (found.q[100 * i : 100 * i + 101] for i in range(3))
    # The first turn leads from the start, chosen arbitrarily, to what all others repeat.
    np.testing.assert_allclose(three, two, rtol=0, atol=1e-10)
    np.testing.assert_allclose(two[50:], one[50:], rtol=0, atol=5e-3)
    assert np.ptp(two, axis=0).max() < 3.3
    # Fast only in the first turn.
    assert np.abs(np.diff(one, axis=0)).max() > 1.0
    assert np.abs(np.diff(two, axis=0)).max() < 0.35


def test_virtual_joint_is_fast_in_every_turn(cases: dict[str, Any]) -> None:
    case = cases["puma_pipe"]
    found = runs.run(runs.puma_solver(case, rd.VirtualJoint), case)
    assert not found.unreachable
    for turn in (found.q[:101], found.q[100:]):
        assert np.abs(np.diff(turn, axis=0)).max() > 1.0


def test_refined_path_is_the_path_of_the_case(cases: dict[str, Any]) -> None:
    case = cases["puma_pipe"]
    path: Any = runs.pipe(case, 100)
    np.testing.assert_allclose(path.position, case.path.position, rtol=0, atol=1e-14)
    np.testing.assert_allclose(path.rotation, case.path.rotation, rtol=0, atol=1e-14)
    np.testing.assert_allclose(path.time, case.path.time, rtol=1e-14)


PRINTED = np.array([9.4712e-8, 9.2936e-6])  # Table 3.2, mean errors of position [m] and orientation [rad]


def test_errors_of_table_3_2(cases: dict[str, Any]) -> None:
    case = cases["puma_pipe"]
    # Exactly 20 iterations for each segment, no correction.
    both, _ = runs.mean_errors(case, rd.TwistDecomposition, 2000, 0.1)
    assert (both <= PRINTED).all()
    # With the whole pull the second turn keeps them.
    _, second = runs.mean_errors(case, rd.TwistDecomposition, 400, 1.0)
    assert (second <= PRINTED).all()
    _, virtual = runs.mean_errors(case, rd.VirtualJoint, 400, 1.0)
    assert (virtual > 10.0 * second).all()


# --- paths ------------------------------------------------------------------------------------------------------------


def followed(name: str, case: Any, method: Any) -> rd.Trajectory:
    """20 iterations where the pull is strong and the path passes singularities, else 3; then corrections."""
    if name == "puma_pipe":
        # The limits of the file are not those of the thesis: weights that keep them cannot follow.
        given = {"weights": np.ones(6)} if method is rd.WeightedInverse else {}
        solver = method(case.robot, case.task, runs.puma_pull(case), iterations=20, **given)
    else:
        solver = method(case.robot, case.task, rd.PosturePull(runs.EVEN), iterations=3)
    trajectory: rd.Trajectory = runs.run(solver, case)
    return trajectory


REACHED = [(name, method) for name in CASES for method in METHODS]


@pytest.mark.parametrize(("name", "method"), REACHED, ids=lambda value: getattr(value, "__name__", value))
def test_paths_are_followed(cases: dict[str, Any], name: str, method: Any) -> None:
    case = cases[name]
    found = followed(name, case, method)
    assert not found.unreachable
    # Measured here, not by the solver.
    poses = case.robot.fk(found.q)
    assert np.linalg.norm(poses[:, :3, 3] - case.path.position, axis=1).max() < 1e-8
    assert np.linalg.norm(np.cross(poses[:, :3, 2], case.path.axis), axis=1).max() < 1e-8
    assert ((poses[:, :3, 2] * case.path.axis).sum(axis=1) > 0.0).all()


def test_methods_that_lose_their_way_find_the_target(cases: dict[str, Any]) -> None:
    # Task priority does not spin the tool if it can help it, and the PUMA's path without spin is out of reach: the
    # damped Newton behind it spins as much as is needed.
    case = cases["puma_pipe"]
    path = case.path.without_spin(case.robot.fk(case.start)[:3, :3])
    solver = rd.OrthogonalSQP(case.robot, rd.Task.full(), rd.JointLimits(), limits=False)
    assert rd.follow(solver, path, case.start, progress=False).unreachable
    assert not followed("puma_pipe", case, rd.TaskPriority).unreachable
    assert not rd.follow(
        rd.TwistDecomposition(case.robot, case.task), case.path, case.start, progress=False
    ).unreachable


def test_methods_of_the_same_least_squares_problem_agree(cases: dict[str, Any]) -> None:
    case = cases["m16ib_sphere_edge"]
    q = followed(case.name, case, rd.GradientProjection).q
    for method in (rd.Householder, rd.Elimination):
        np.testing.assert_allclose(followed(case.name, case, method).q, q, rtol=0, atol=1e-9)


# --- limits and weights -----------------------------------------------------------------------------------------------


def test_sphere_edge_stays_within_limits_with_twist_decomposition(cases: dict[str, Any]) -> None:
    case = cases["m16ib_sphere_edge"]
    assert runs.unresolved(case).limit_margin < -3.0
    found = runs.run(rd.TwistDecomposition(case.robot, case.task, runs.SPHERE), case)
    assert found.limit_margin > 0.3


# --- Tests I to IV ----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def measured() -> dict[str, runs.Measures]:
    return {name: runs.Measures.of(found) for name, found in runs.welding().items()}


def test_weld_stays_within_limits(cases: dict[str, Any]) -> None:
    for name, found in runs.welding().items():
        assert not found.unreachable, name
        assert (found.limit_margin > 0.0) == (name != "no resolution"), name
    start = [runs.welding()[f"Test {i}"].q[0] for i in ("I", "II", "III")]
    np.testing.assert_allclose(start, np.broadcast_to(cases["m710_cylinders"].start, (3, 6)), rtol=0, atol=1e-9)


def test_printed_weights_have_both_gains_of_test_iv(measured: dict[str, runs.Measures]) -> None:
    share, times = measured["Test IV, printed weights"].against(measured["Test II"])
    assert share <= 0.25  # 1.157 / 8.77 = 13 % in print
    assert times >= 2.35  # 2.479 in print


def test_self_adapted_weights_have_both_gains_of_test_iv(measured: dict[str, runs.Measures]) -> None:
    share, times = measured["Test IV, `self_adapt`"].against(measured["Test II"])
    assert share <= 0.25
    assert times >= 2.35


def test_every_printed_improvement_appears(measured: dict[str, runs.Measures]) -> None:
    one, two, three = (measured[f"Test {i}"] for i in ("I", "II", "III"))
    four = measured["Test IV, printed weights"]
    assert four.range_6 < three.range_6 < two.range_6 < one.range_6
    assert four.singularity < three.singularity < two.singularity < one.singularity
    assert four.manipulability > three.manipulability > two.manipulability > one.manipulability
    assert two.speed_4 < 0.5 * one.speed_4  # 74 to 22 deg/s in print


PRINTED_RANGES = {"Test I": 9.77, "Test II": 8.77, "Test III": 5.69, "Test IV, printed weights": 1.157}
PRINTED_KAPPAS = {"Test I": 163.0, "Test II": 56.0, "Test III": 31.0}


def test_sizes_are_those_of_table_4_1(measured: dict[str, runs.Measures]) -> None:
    for name, printed in PRINTED_RANGES.items():
        assert measured[name].range_6 == pytest.approx(printed, rel=0.15), name
    for name, printed in PRINTED_KAPPAS.items():
        assert measured[name].kappa == pytest.approx(printed, rel=0.3), name
    assert measured["Test IV, printed weights"].manipulability == pytest.approx(0.0732, rel=0.05)


def test_turns_of_test_iv_repeat() -> None:
    q = runs.welding()["Test IV, printed weights"].q
    np.testing.assert_allclose(q[133:], q[:134], rtol=0, atol=1e-3)


def test_a_stop_of_algorithm_3_1_leaves_orientation_errors_as_printed(cases: dict[str, Any]) -> None:
    # 0.0013 rad in print, for a threshold that is not; with one of 0.002 rad the errors are of that size.
    case = cases["m710_cylinders"]
    pull = rd.PosturePull(runs.EVEN)
    stopped = rd.TwistDecomposition(case.robot, case.task, pull, iterations=200, stop=2e-3, correct=False)
    found = runs.from_start(stopped, case)
    assert 3e-4 < found.axis_error.max() < 3e-3
    assert found.iterations < 30 * len(found)


# --- tools ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "lie", "joints", "improved"),
    [
        ("m710_rectangle", "perpendicular", {3, 4}, 3),
        ("m710_cylinders", "parallel", {3, 5}, 5),
        ("m16ib_oblique", "oblique", {3, 5}, 3),
    ],
)
def test_three_lies_of_the_tool(name: str, lie: str, joints: set[int], improved: int) -> None:
    found = runs.adapt(getattr(huo, name))
    before, after = found.history[0].performance, found.performance
    assert found.sensitivity.case == lie
    assert set(found.sensitivity.joints) == joints
    assert after.within_limits
    # The thesis starts outside in its first and third example.
    assert before.within_limits == (lie == "parallel")
    assert after.ranges[improved] < 0.75 * before.ranges[improved]
    assert after.singularity < before.singularity
    assert after.manipulability > before.manipulability


def test_pairs_of_weights_that_are_named() -> None:
    # Test 2 of Table 5.1.
    found = runs.adapt(huo.m16ib_oblique, joints=(4, 5))
    before, after = found.history[0].performance, found.performance
    assert found.sensitivity.joints == (4, 5)
    assert not before.within_limits
    assert after.within_limits
    assert after.manipulability > 2.0 * before.manipulability


def test_tests_a_to_c() -> None:
    found = runs.tilted().found
    a, b, c, adapted = (found[name] for name in ("A", "B", "C", "`dynamic_adapt`"))
    assert a.margins.min(axis=0).argmin() == 4  # joint 5, as in section 6.3.1
    assert a.limit_margin < 0.0
    assert abs(runs.tilted().critical - 84) < 10
    two, three, four = (runs.Measures.of(x) for x in (b, c, adapted))
    assert two.speed_4 > 70.0
    assert two.speed_6 > 50.0
    for slower, trajectory in ((three, c), (four, adapted)):
        assert slower.speed_4 < 0.5 * two.speed_4
        assert slower.speed_6 < 0.25 * two.speed_6
        assert slower.singularity < two.singularity
        assert trajectory.limit_margin > 0.2
    assert b.limit_margin > 0.2


def test_parts_of_test_c() -> None:
    c, solver = runs.tilted().found["C"], runs.tilted().solver
    norms = runs.parts(runs.tilted())[1:]
    assert np.isfinite(norms).all()
    assert (norms[:, :2] > 0.0).all()
    singular = rd.SingularityParameter(1.0).evaluate_many(c.robot, c.q, 0)[0][:-1] >= 5.0
    # Where the threshold is passed the robot is at the posture that it holds.
    passed = singular & ~np.concatenate([[False], singular[:-1]])
    np.testing.assert_array_equal(norms[:, 2] > 0.0, singular & ~passed)
    np.testing.assert_array_equal(np.isnan(solver.held[1:, 0]), ~singular)


# --- iterations -------------------------------------------------------------------------------------------------------


def test_iterations_of_table_3_4() -> None:
    # About 4400 points: each is within 1 mm and 0.01 rad after one iteration.
    case = huo.m16ib_sphere_edge(2200)
    for method in (rd.TwistDecomposition, rd.VirtualJoint):
        found = runs.until_accurate(method, case)
        assert len(found) <= found.iterations <= 4809
        assert found.position_error.max() < 1e-3
        assert found.axis_error.max() < 1e-2
        assert runs.until_still(method, case, 1e-3).iterations > 2 * len(found)
