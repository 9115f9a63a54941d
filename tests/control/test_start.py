"""Start postures: never worse than the default one, inside, distinct; closed paths that close; bad input."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray
from redundancy.loops import StartSearch, best_start, cyclic_start

from evidence.huo import cases as huo

F64 = NDArray[np.float64]
CASES = {build.__name__: build() for build in huo.BUILDERS}
MILL = rd.robots.get("fanuc_m710ic50_milling")
HELIX = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.0, np.pi / 2, np.pi, (1.3, 1.0, 0.0), 101)
AXIAL = rd.Task.axisymmetric()


def pulled(case: Any, w: float = 0.01, k: float = 0.0) -> rd.TwistDecomposition:
    n = case.robot.n
    return rd.TwistDecomposition(case.robot, case.task, rd.PosturePull(np.full(n, w), np.full(n, k)))


def rank(step: Any, trajectory: rd.Trajectory) -> tuple[int, float, float]:
    """What a start is worth, computed from the trajectory alone."""
    values = trajectory.value if isinstance(step.objective, rd.Objective) else trajectory.condition_number
    worst = float(values.max())
    beyond = max(
        0.0, float((trajectory.q - trajectory.robot.q_max).max()), float((trajectory.robot.q_min - trajectory.q).max())
    )
    return len(trajectory.unreachable), round(beyond, 6), np.inf if np.isnan(worst) else worst


def check_search(found: StartSearch, step: Any, path: rd.Toolpath) -> None:
    """What holds for every search: what it reports is what following the path gives, and nothing else was better."""
    again = rd.follow(step, path, found.q0, progress=False)
    np.testing.assert_array_equal(again.q, found.trajectory.q)
    ranks = [(unreached, violation, cost) for _, unreached, violation, cost in found.candidates]
    assert ranks == sorted(ranks)
    assert ranks[0] == rank(step, found.trajectory)
    np.testing.assert_array_equal(found.q0, found.candidates[0][0])
    default = rank(step, rd.follow(step, path, progress=False))
    assert default in ranks
    assert ranks[0] <= default


SOLVERS: dict[str, Any] = {
    "pull": pulled,
    "pull and singularity": lambda case: pulled(case, k=0.01),
    "barrier": lambda case: rd.OrthogonalSQP(case.robot, case.task, rd.LimitBarrier()),
    "condition": lambda case: rd.GradientProjection(case.robot, case.task, rd.ConditionNumber(0.3), relaxation=0.05),
}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("name", CASES)
def test_start_is_at_least_as_good_as_the_default_one(name: str, solver: str) -> None:
    case = CASES[name]
    step = SOLVERS[solver](case)
    check_search(best_start(step, case.path, starts=24, candidates=4, progress=False), step, case.path)


def test_start_of_the_milled_helix() -> None:
    step = rd.OrthogonalSQP(MILL, AXIAL, rd.ConditionNumber(0.485, squared=True))
    found = best_start(step, HELIX, progress=False)
    check_search(found, step, HELIX)
    assert found.trajectory.unreachable == []
    # The minimum of the first point, where 64 random starts lead to, is a good start here: nothing is to be gained.
    default = rd.follow(step, HELIX, progress=False)
    assert found.trajectory.max_condition_number == pytest.approx(default.max_condition_number, rel=1e-9)


def test_whole_path_counts_and_not_its_first_point() -> None:
    # The minimum of the first point leads to where most of the pipe is out of reach; another branch welds all of it.
    case = CASES["puma_pipe"]
    step = rd.OrthogonalSQP(case.robot, case.task, rd.LimitBarrier())
    assert len(rd.follow(step, case.path, progress=False).unreachable) > 10
    found = best_start(step, case.path, progress=False)
    assert found.trajectory.unreachable == []
    assert found.trajectory.limit_margin > 0.0
    assert max(found.trajectory.position_error.max(), found.trajectory.axis_error.max()) <= 1e-9
    # It is what the start of the thesis, the one that is nearest to the middle, gives, or better.
    given = rd.follow(step, case.path, case.start, progress=False)
    assert rank(step, found.trajectory) <= (len(given.unreachable), 0.0, float(given.value.max()) * (1.0 + 1e-9))


def test_limits_come_before_the_condition_number() -> None:
    case = CASES["m16ib_oblique"]
    step = pulled(case, k=0.01)
    assert rd.follow(step, case.path, progress=False).limit_margin < 0.0
    found = best_start(step, case.path, progress=False)
    assert found.trajectory.unreachable == []
    assert found.trajectory.limit_margin >= 0.0


def test_candidates_are_on_target_inside_and_distinct() -> None:
    case = CASES["m16ib_oblique"]
    step = pulled(case)
    found = best_start(step, case.path, candidates=6, progress=False)
    assert 2 <= len(found.candidates) <= 7
    postures = np.array([q for q, *_ in found.candidates])
    poses = case.robot.fk(postures)
    aimed = np.broadcast_to(case.path.position[0], (len(postures), 3))
    np.testing.assert_allclose(poses[:, :3, 3], aimed, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        poses[:, :3, :3] @ case.task.axis, np.broadcast_to(case.path.axis[0], aimed.shape), atol=1e-9
    )
    assert (postures >= case.robot.q_min - 1e-6).all()
    assert (postures <= case.robot.q_max + 1e-6).all()
    off = postures[:, None] - postures
    off = np.abs(off - 2.0 * np.pi * np.round(off / (2.0 * np.pi))).max(axis=2)
    assert (off[np.triu_indices(len(postures), 1)] > 1e-6).all()


def test_searches_repeat_themselves() -> None:
    case = CASES["m710_cylinders"]
    step = pulled(case, k=0.01)
    first, second = (best_start(step, case.path, starts=16, progress=False) for _ in range(2))
    for one, other in zip(first.candidates, second.candidates, strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:] == other[1:]


def test_whole_turns_are_tried_within_limits() -> None:
    # A tool that follows the rotations winds joint 6 up by two turns: it has to start wound back.
    case = CASES["m710_cylinders"]
    step = rd.ResolvedRate(case.robot, case.task)
    plain = best_start(step, case.path, progress=False)
    assert plain.trajectory.limit_margin < 0.0
    wound = best_start(step, case.path, turns=1, progress=False)
    check_search(wound, step, case.path)
    assert len(wound.candidates) > len(plain.candidates)
    for q, *_ in wound.candidates:
        assert (q >= case.robot.q_min).all()
        assert (q <= case.robot.q_max).all()
    assert rank(step, wound.trajectory) < rank(step, plain.trajectory)


def test_arms_of_seven_and_of_three_joints() -> None:
    panda = rd.robots.get("panda")
    pose = panda.fk([0.1, -0.5, 0.2, -2.0, 0.1, 1.8, 0.4])
    path = rd.Toolpath(
        pose[:3, 3] + np.linspace(0.0, 0.1, 11)[:, None] * [0.0, 1.0, 0.0], np.tile(pose[:3, 2], (11, 1))
    )
    step: Any = rd.OrthogonalSQP(panda, AXIAL, rd.JointLimits())
    found = best_start(step, path, starts=8, progress=False)
    check_search(found, step, path)
    assert found.trajectory.unreachable == []
    planar = rd.robots.get("planar_3r")
    line = rd.Toolpath(np.linspace([1.0, 0.5, 0.0], [1.5, -0.5, 0.0], 21), np.tile([0.0, 0.0, 1.0], (21, 1)))
    task = rd.Task("free", ("plane", [0, 0, 1]), "base")
    step = rd.OrthogonalSQP(planar, task, rd.ConditionNumber(1.0, rows=[2, 3, 4]))
    found = best_start(step, line, starts=8, progress=False)
    check_search(found, step, line)
    assert found.trajectory.unreachable == []


def test_path_out_of_reach_has_a_result() -> None:
    far = rd.Toolpath(HELIX.position + np.array([20.0, 0.0, 0.0]), HELIX.axis)
    step = rd.OrthogonalSQP(MILL, AXIAL, rd.ConditionNumber(0.485))
    found = best_start(step, far, starts=4, progress=False)
    assert len(found.candidates) == 1
    assert found.candidates[0][1] == len(far)


def test_exception_of_an_objective_reaches_the_caller() -> None:
    def fail(q: object) -> float:
        raise LookupError("of the callable")

    step = rd.OrthogonalSQP(MILL, AXIAL, rd.CustomIndex(fail))
    with pytest.raises(LookupError, match="of the callable"):
        best_start(step, HELIX, starts=2, progress=False)


CLOSING = ["m16ib_sphere_edge", "m710_cylinders", "m710_rectangle", "m16ib_oblique"]


@pytest.mark.parametrize("k", [0.0, 0.01])
@pytest.mark.parametrize("name", CLOSING)
def test_pulled_robot_closes_its_path(name: str, k: float) -> None:
    case = CASES[name]
    step = pulled(case, k=k)
    found = cyclic_start(step, case.path, case.start, progress=False)
    assert found.closed
    assert found.gap[0] > 1e-3  # not at once
    assert found.gap[-1] <= 1e-9
    trajectory = found.trajectory
    assert trajectory.unreachable == []
    assert len(trajectory) == len(case.path) == len(trajectory.status)
    np.testing.assert_array_equal(trajectory.q[0], found.q0)
    np.testing.assert_allclose(trajectory.q[-1], found.q0, rtol=0, atol=1e-9)
    poses = case.robot.fk(trajectory.q)
    np.testing.assert_allclose(poses[:, :3, 3], case.path.position, rtol=0, atol=1e-9)
    np.testing.assert_allclose(poses[:, :3, 2], case.path.axis, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        trajectory.condition_number, rd.ConditionNumber(1.0).evaluate_many(case.robot, trajectory.q, 0)[0]
    )
    # What the documentation says: the turn again, and one more behind it.
    targets = case.path.targets()[1:]
    again = pulled(case, k=k)
    once = again.follow_chunk(targets, found.q0)[0]
    np.testing.assert_array_equal(once, trajectory.q[1:])
    again.reset()
    np.testing.assert_allclose(again.follow_chunk(targets, once[-1])[0], once, rtol=0, atol=1e-7)


def test_robot_at_pointwise_minima_closes_its_path() -> None:
    case = CASES["m710_cylinders"]
    step = rd.OrthogonalSQP(case.robot, case.task, rd.LimitBarrier())
    found = cyclic_start(step, case.path, case.start, progress=False)
    assert found.closed
    # Every point is at its minimum: to follow the path from there closes it too.
    q = rd.follow(step, case.path, found.q0, progress=False).q
    np.testing.assert_allclose(q[[0, -1]], [found.q0, found.q0], rtol=0, atol=1e-6)


def test_winding_up_does_not_close() -> None:
    case = CASES["m710_cylinders"]
    found = cyclic_start(rd.ResolvedRate(case.robot, case.task), case.path, case.start, progress=False)
    assert not found.closed
    # Two turns of joint 6, and the search is over.
    assert found.gap == pytest.approx([4.0 * np.pi], abs=1e-9)
    off = found.trajectory.q[-1] - found.trajectory.q[0]
    np.testing.assert_allclose(off[:5], 0.0, atol=1e-9)


def test_shortest_motion_does_not_close() -> None:
    # The least-norm solution is not integrable (Klein and Huang 1983): joints drift from turn to turn.
    case = CASES["m710_rectangle"]
    step = rd.TwistDecomposition(case.robot, case.task)
    found = cyclic_start(step, case.path, case.start, turns=4, progress=False)
    assert not found.closed
    assert len(found.gap) == 4
    assert min(found.gap) > 1e-4
    assert np.abs(found.trajectory.q[-1] - found.q0).max() == found.gap[-1]


def test_tolerance_and_turns_end_the_search() -> None:
    case = CASES["m710_cylinders"]
    one = cyclic_start(pulled(case), case.path, case.start, turns=1, progress=False)
    assert (one.closed, len(one.gap)) == (False, 1)
    wide = cyclic_start(pulled(case), case.path, case.start, tolerance=2.0 * max(one.gap), progress=False)
    assert (wide.closed, len(wide.gap)) == (True, 1)
    np.testing.assert_array_equal(one.q0, wide.q0)


CYLINDERS = CASES["m710_cylinders"]
OPEN = rd.Toolpath(CYLINDERS.path.position[:-1], CYLINDERS.path.axis[:-1])
POINT = rd.Toolpath(CYLINDERS.path.position[:1], CYLINDERS.path.axis[:1])
PULL = pulled(CYLINDERS)
START = CYLINDERS.start
WRONG: dict[str, tuple[Any, type[Exception], str]] = {
    "no starts": (lambda: best_start(PULL, OPEN, starts=0), rd.InvalidValueError, "starts is 0"),
    "no candidates": (lambda: best_start(PULL, OPEN, candidates=-3), rd.InvalidValueError, "candidates is -3"),
    "seed": (lambda: best_start(PULL, OPEN, seed=-1), rd.InvalidValueError, "seed is -1"),
    "negative turns": (lambda: best_start(PULL, OPEN, turns=-2), rd.InvalidValueError, "turns is -2"),
    "no rotations": (
        lambda: best_start(rd.ResolvedRate(MILL, AXIAL), HELIX),
        rd.InvalidValueError,
        "the path has no rotations",
    ),
    "no turns": (lambda: cyclic_start(PULL, CYLINDERS.path, START, turns=0), rd.InvalidValueError, "turns is 0"),
    "tolerance": (
        lambda: cyclic_start(PULL, CYLINDERS.path, START, tolerance=0.0),
        rd.InvalidValueError,
        "tolerance is 0.0",
    ),
    "NaN tolerance": (
        lambda: cyclic_start(PULL, CYLINDERS.path, START, tolerance=np.nan),
        rd.InvalidValueError,
        "tolerance is nan",
    ),
    "open path": (lambda: cyclic_start(PULL, OPEN, START), rd.InvalidValueError, r"path starts at \[.*and ends at \["),
    "one point": (lambda: cyclic_start(PULL, POINT, START), rd.InvalidValueError, "1 points, expected .* at least 2"),
    "no rotations of a closed path": (
        lambda: cyclic_start(rd.ResolvedRate(MILL, AXIAL), OPEN, START),
        rd.InvalidValueError,
        "the path has no rotations",
    ),
    "short q0": (lambda: cyclic_start(PULL, CYLINDERS.path, [0.0] * 5), rd.ShapeError, r"q0: got shape \(5,\)"),
    "NaN q0": (
        lambda: cyclic_start(PULL, CYLINDERS.path, [0, 0, np.nan, 0, 0, 0]),
        rd.NonFiniteError,
        r"q0\[2\] is nan",
    ),
    "text": (lambda: cyclic_start(PULL, CYLINDERS.path, "q0"), rd.InvalidValueError, "q0 is no array"),
}


@pytest.mark.parametrize("case", WRONG)
def test_bad_input(case: str) -> None:
    call, kind, message = WRONG[case]
    with pytest.raises(kind, match=message) as caught:
        call()
    assert type(caught.value) is kind


def test_open_path_is_named_by_both_ends() -> None:
    with pytest.raises(rd.InvalidValueError) as caught:
        cyclic_start(PULL, OPEN, START)
    for target in OPEN.targets()[[0, -1]]:
        assert str(target.tolist()) in str(caught.value)
