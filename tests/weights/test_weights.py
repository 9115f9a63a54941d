"""Weights that tune themselves: closed-form surfaces, the rule and the cases of the thesis, whole runs on a robot."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray
from redundancy import weights as rw

from evidence.huo import cases as huo

F64 = NDArray[np.float64]
FANUC = rd.robots.get("fanuc_m710ic50")
TASK = rd.Task.axisymmetric()


def performance(limit: float = -0.5, singularity: float = 3.0, **more: Any) -> rw.Performance:
    return rw.Performance(limit, singularity, **more)


def arm(degrees: float) -> rd.Robot:
    """The FANUC with a tool of 250 mm at an angle to the axis of joint 6."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    tool = np.array([[c, 0.0, s, 0.25 * s], [0.0, 1.0, 0.0, 0.0], [-s, 0.0, c, 0.25 * c], [0.0, 0.0, 0.0, 1.0]])
    return FANUC.with_tool(tool)


def cylinders(points: int = 60) -> rd.Toolpath:
    """Where cylinders of radius 250 and 400 mm meet, the tool directed to where their axes do (section 3.5.1)."""
    u = np.linspace(0.0, 2.0 * np.pi, points)
    around = 0.25 * np.stack([np.cos(u), np.sin(u)])
    p = np.stack([*around, np.sqrt(0.4**2 - around[1] ** 2)], axis=1)
    return rd.Toolpath(p + np.array([1.15, 0.2, -0.2]), -p, time=np.linspace(0.0, 133.0, points))


def postures(robot: rd.Robot, count: int = 20) -> F64:
    return np.random.default_rng(4).uniform(-1.0, 1.0, (count, robot.n))


# The rule.


@pytest.mark.parametrize(
    ("new", "old", "expected"),
    [
        # Out of the limits only they count.
        (performance(0.1, 90.0), performance(0.2, 3.0), True),
        (performance(-0.3, 90.0), performance(0.2, 3.0), True),
        (performance(0.01, 3.0), performance(-0.3, 90.0), False),
        # Close to them they count where the singularity parameters are alike.
        (performance(-0.03, 3.4), performance(-0.02, 3.0), True),
        (performance(-0.03, 3.6), performance(-0.02, 3.0), False),
        (performance(-0.01, 2.4), performance(-0.02, 3.0), True),
        # Far from them the singularity parameter counts.
        (performance(-0.1, 2.9), performance(-0.4, 3.0), True),
        (performance(-0.4, 3.0), performance(-0.1, 3.0), False),
        # At a singularity.
        (performance(-0.1, 9.0), performance(-0.1, math.inf), True),
        (performance(-0.1, math.inf), performance(-0.1, 9.0), False),
        (performance(-0.03, math.inf), performance(-0.02, math.inf), True),
        # Without limits.
        (performance(-math.inf, 2.0), performance(-math.inf, 3.0), True),
        # A path that is not followed is worth nothing.
        (performance(-0.4, 1.0, unreachable=1), performance(0.2, 90.0), False),
    ],
)
def test_rule(new: rw.Performance, old: rw.Performance, expected: bool) -> None:
    assert rw.better(new, old) is expected
    assert not rw.better(new, new)
    if expected:
        assert not rw.better(old, new)


def test_rule_is_no_order() -> None:
    a, b, c = performance(-0.01, 3.0), performance(-0.02, 3.4), performance(-0.03, 3.8)
    assert rw.better(b, a)
    assert rw.better(c, b)
    assert rw.better(a, c)


def test_performance_of_a_trajectory() -> None:
    q = np.zeros((3, 6))
    q[:, 4] = [-0.5, 0.0, 0.5]
    q[:, 5] = [0.0, 1.0, 5.0]
    q[:, 1] = FANUC.q_max[1] + np.array([-0.2, -0.1, 0.3])
    found = rw.Performance.of(FANUC, q, [0.0, 1.0, 3.0])
    assert found.limit_distance == pytest.approx(0.3 / (FANUC.q_max[1] - FANUC.q_min[1]), rel=1e-12)
    assert not found.within_limits
    # The wrist is straight at the second point.
    assert found.singularity > 1e6
    assert found.manipulability < 1e-12
    np.testing.assert_allclose(found.ranges, [0.0, 0.5, 0.0, 0.0, 1.0, 5.0], rtol=1e-12)
    assert found.speeds is not None
    np.testing.assert_allclose(found.speeds, [0.0, 0.2, 0.0, 0.0, 0.5, 2.0], rtol=1e-12)
    assert rw.Performance.of(FANUC, q).speeds is None


def test_performance_in_the_middle_and_without_limits() -> None:
    middle = 0.5 * (FANUC.q_min + FANUC.q_max)
    assert rw.Performance.of(FANUC, middle[None]).limit_distance == pytest.approx(-0.5, abs=1e-12)
    assert rw.Performance.of(FANUC, middle[None], [0.0]).speeds == (0.0,) * 6
    free = FANUC.with_limits(q_min=np.full(6, -np.inf), q_max=np.full(6, np.inf))
    assert rw.Performance.of(free, middle[None]).limit_distance == -math.inf


# The search.


def _bowl(w: float, k: float, coupling: float = 0.5) -> float:
    x, y = (w - 0.048) / 0.02, (k - 0.026) / 0.02
    return x * x + y * y + coupling * x * y


@pytest.mark.parametrize("coupling", [0.0, 0.5, -1.0])
@pytest.mark.parametrize("start", [(0.01, 0.01), (0.2, 0.1), (0.0, 0.05), (1.0, 0.0)])
def test_search_finds_the_bottom_of_a_bowl(start: tuple[float, float], coupling: float) -> None:
    calls = 0

    def evaluate(w: float, k: float) -> rw.Performance:
        nonlocal calls
        calls += 1
        assert w >= 0.0
        assert k >= 0.0
        return performance(-0.3, 1.0 + _bowl(w, k, coupling))

    found = rw.direct_search(evaluate, *start, tolerance=1e-5, min_step=1e-5, max_evaluations=300)
    assert found.status == "converged"
    assert found.performance.singularity < 1.0 + 1e-3
    assert abs(found.w - 0.048) < 1e-3
    assert abs(found.k - 0.026) < 1e-3
    assert calls <= 300
    taken = [step for step in found.history if step.accepted]
    assert all(rw.better(new.performance, old.performance) for old, new in pairwise(taken))
    assert taken[-1].performance == found.performance
    assert (taken[-1].w, taken[-1].k) == (found.w, found.k)


def test_search_in_the_limit_distance() -> None:
    def evaluate(w: float, k: float) -> rw.Performance:
        return performance(0.5 + _bowl(w, k), 100.0 * w)

    found = rw.direct_search(evaluate, 0.01, 0.01, tolerance=1e-5, min_step=1e-5, max_evaluations=300)
    assert found.performance.limit_distance < 0.5 + 1e-3


def test_order_of_directions_and_steps() -> None:
    found = rw.direct_search(lambda w, k: performance(-0.3, 1.0 + _bowl(w, k)), 0.01, 0.01, max_evaluations=300)
    order: list[str] = []
    for step in found.history[1:]:
        if not order or order[-1] != step.direction:
            order.append(step.direction)
    assert order[:4] == ["d1", "d2", "d3", "d2"]
    # The first step is the mean of both weights, the same in both.
    assert (found.history[1].w, found.history[1].k) == (0.02, 0.02)
    moved = {"d2": "w", "d3": "k"}
    for i, step in enumerate(found.history[1:], 1):
        if step.direction in moved:
            base = next(s for s in reversed(found.history[:i]) if s.accepted)
            assert getattr(step, moved[step.direction]) == getattr(base, moved[step.direction])


@pytest.mark.parametrize("most", [1, 2, 7, 25])
def test_search_is_bounded(most: int) -> None:
    calls = 0

    def evaluate(w: float, k: float) -> rw.Performance:
        nonlocal calls
        calls += 1
        return performance(-0.3, 1.0 / (1.0 + w + k))  # better for ever

    found = rw.direct_search(evaluate, 0.01, 0.01, tolerance=0.0, max_evaluations=most)
    assert calls == most
    assert found.status == "evaluations used up"


def test_search_ends_on_a_plane() -> None:
    found = rw.direct_search(lambda w, k: performance(), 0.01, 0.02)
    assert found.status == "converged"
    assert (found.w, found.k) == (0.01, 0.02)
    assert len(found.history) < 15


def test_search_ends_where_the_rule_goes_round() -> None:
    # Of three kinds of points, each is better than the one before.
    kinds = [performance(-0.01, 3.0), performance(-0.02, 3.4), performance(-0.03, 3.8)]
    found = rw.direct_search(lambda w, k: kinds[round(1000 * (w + k)) % 3], 0.01, 0.01, max_evaluations=50)
    assert len(found.history) <= 50
    assert len({(step.w, step.k) for step in found.history}) == len(found.history)


# Sensitivity.


@pytest.mark.parametrize(
    ("degrees", "case", "joints"),
    [
        (0.0, "parallel", (5, 3)),
        (180.0, "parallel", (5, 3)),
        (4.0, "parallel", (5, 3)),
        (90.0, "perpendicular", (4, 3)),
        (86.0, "perpendicular", (4, 3)),
    ],
)
def test_sensitivity_by_angle(degrees: float, case: str, joints: tuple[int, ...]) -> None:
    robot = arm(degrees)

    def probe(joint: int) -> float:
        raise AssertionError(joint)

    found = rw.sensitivity(robot, TASK, postures(robot), probe)
    assert (found.case, found.joints) == (case, joints)
    assert found.angle == pytest.approx(math.radians(min(degrees, 180.0 - degrees)), abs=1e-7)


@pytest.mark.parametrize("degrees", [6.0, 60.0, 84.0, 120.0])
def test_sensitivity_of_oblique_tools(degrees: float) -> None:
    robot = arm(degrees)
    scores = {3: 2.0, 4: 1.0, 5: 3.0}
    asked: list[int] = []

    def probe(joint: int) -> float:
        asked.append(joint)
        return scores[joint]

    found = rw.sensitivity(robot, TASK, postures(robot), probe)
    assert found.case == "oblique"
    assert sorted(asked) == [3, 4, 5]
    assert found.joints == (5, 3)
    assert found.scores == (3.0, 2.0)
    assert rw.sensitivity(robot, TASK, postures(robot), keep=3).joints != ()
    assert rw.sensitivity(robot, TASK, postures(robot), probe, tolerance=0.0, keep=1).joints == (5,)


@pytest.mark.parametrize("degrees", [0.0, 60.0, 90.0])
def test_cosines_are_what_a_weight_can_do(degrees: float) -> None:
    """The redundant part of (3.8) spins the tool by (e_i . e_t) h_i, whichever joint i is."""
    robot = arm(degrees)
    for q in postures(robot):
        jacobian, axis = robot.jacobian(q), robot.fk(q)[:3, 2]
        spin = np.zeros((6, 6))
        spin[:3, :3] = np.outer(axis, axis)
        motion = np.linalg.pinv(jacobian) @ spin @ jacobian
        one = np.linalg.pinv(jacobian) @ np.concatenate([axis, np.zeros(3)])
        expected = np.linalg.norm(motion, axis=0) / np.linalg.norm(one)
        np.testing.assert_allclose(rw.axis_cosines(robot, TASK, q[None])[0], expected, atol=1e-9)


# Weights along the path.


def test_weight_functions() -> None:
    functions = rw.WeightFunctions()
    free = np.full(6, -0.5)
    w, k = functions.weights(np.ones(6), free, 0.0)
    np.testing.assert_allclose(w, [0.01] * 3 + [0.02] * 3, rtol=1e-14)
    np.testing.assert_allclose(k, [0.01] * 3 + [0.25] * 3, rtol=1e-14)
    w, k = functions.weights(np.ones(6), free, 0.3, c_joint=0.5, c_sing=0.5)
    np.testing.assert_allclose(w[3:], 0.02 + 0.5 * math.exp(-1.0), rtol=1e-14)
    np.testing.assert_allclose(k[3:], (0.25 + 0.5) * math.exp(-0.6), rtol=1e-14)
    # A joint perpendicular to the tool.
    w, k = functions.weights(np.zeros(6), free, 0.0)
    np.testing.assert_allclose(w[3:], 0.01, rtol=1e-14)
    np.testing.assert_allclose(k[3:], 0.0, atol=1e-14)
    # Beyond the threshold angle nothing is adapted.
    w, k = rw.WeightFunctions(beta_threshold=0.5).weights(np.full(6, math.cos(0.6)), free, 0.0, 1.0, 1.0)
    np.testing.assert_array_equal([w, k], 0.01)


def test_weight_functions_at_and_beyond_limits() -> None:
    functions = rw.WeightFunctions()
    for distance in (-1e-9, 0.0, 0.3):
        beyond = np.array([-0.5, -0.5, -0.5, -0.5, -0.5, distance])
        w, _ = functions.weights(np.ones(6), beyond, 0.0)
        np.testing.assert_allclose(w[3:], [0.02, 0.02, 1.0], rtol=1e-12)
    # A joint of the arm stands for those of the wrist (6.4).
    w, _ = functions.weights(np.ones(6), np.array([-0.5, -0.1, -0.5, -0.5, -0.2, -0.5]), 0.0)
    np.testing.assert_allclose(w[3:], 0.1, rtol=1e-14)
    # Without limits, as in the middle.
    w, _ = functions.weights(np.ones(6), np.full(6, -np.inf), 0.0)
    np.testing.assert_allclose(w[3:], 0.02, rtol=1e-14)
    # Never a push.
    w, k = functions.weights(np.ones(6), np.full(6, -0.5), 0.0, -3.0, -0.5)
    assert (w[3:] == 0.0).all()
    assert (k[3:] == 0.0).all()


# Whole runs.


@pytest.mark.parametrize("degrees", [0.0, 60.0, 90.0])
def test_self_adaptation(degrees: float) -> None:
    robot = arm(degrees)
    found = rw.self_adapt(robot, cylinders(), TASK, max_runs=30, progress=False)
    assert found.trajectory.unreachable == []
    taken = [record.performance for record in found.history if record.accepted]
    assert all(rw.better(new, old) for old, new in pairwise(taken))
    assert taken[-1] == found.performance == rw.Performance.of_trajectory(found.trajectory)
    assert (found.w >= 0.0).all()
    assert (found.k >= 0.0).all()
    assert len(found.history) <= 60
    untouched = [i for i in range(6) if i not in found.sensitivity.joints]
    np.testing.assert_array_equal(found.w[untouched], 0.01)
    if degrees == 0.0:
        # The tool is on the axis of joint 6: its spin is joint 6 alone, and changes no index.
        assert found.performance.singularity == pytest.approx(taken[0].singularity, rel=1e-9)


def test_starts_side_by_side() -> None:
    robot, path = arm(60.0), cylinders(30)
    start = rw.self_adapt(robot, path, TASK, max_runs=1, progress=False).trajectory.q[0]
    several = rw.self_adapt(robot, path, TASK, start=start, max_runs=12, starts=3, progress=False)
    again = rw.self_adapt(robot, path, TASK, start=start, max_runs=12, starts=3, progress=False)
    np.testing.assert_array_equal(several.w, again.w)
    np.testing.assert_array_equal(several.trajectory.q, again.trajectory.q)
    one = rw.self_adapt(robot, path, TASK, start=start, max_runs=12, progress=False)
    assert not rw.better(one.performance, several.performance)


def test_dynamic_adaptation() -> None:
    robot, path = arm(90.0), cylinders(100)
    criteria = rw.Criteria(singularity=5.0, speed=0.5, margin=0.1)
    found = rw.dynamic_adapt(robot, path, TASK, criteria=criteria, max_rounds=8, progress=False)
    assert found.trajectory.unreachable == []
    assert found.w.shape == found.k.shape == (100, 6)
    assert (found.w >= 0.0).all()
    assert (found.k >= 0.0).all()
    np.testing.assert_array_equal(found.w[:, :3], 0.01)
    assert (found.history[0].c_joint == 0.0).all()
    taken = [record.failure.excess for record in found.history if record.accepted]
    assert taken == sorted(taken, reverse=True)
    assert criteria.check(found.trajectory).excess == taken[-1]
    assert found.status in ("fulfilled", "stalled", "rounds used up")
    assert (found.status == "fulfilled") == (taken[-1] == (0.0, 0.0, 0.0, 0.0))


def test_weights_that_do_not_vary_follow_as_fixed_ones() -> None:
    robot, path = arm(60.0), cylinders(40)
    start = rw.self_adapt(robot, path, TASK, max_runs=1, progress=False).trajectory.q[0]
    # No joint is ever this close to the tool's axis, and no posture this singular.
    given: dict[str, Any] = {"start": start, "threshold": 1e5, "progress": False}
    fixed = rw.self_adapt(robot, path, TASK, max_runs=1, **given).trajectory
    varying = rw.dynamic_adapt(robot, path, TASK, beta_threshold=1e-6, max_rounds=1, **given)
    np.testing.assert_array_equal(varying.w, 0.01)
    np.testing.assert_allclose(varying.trajectory.q, fixed.q, atol=1e-9)


def test_welded_cylinders_of_the_thesis() -> None:
    case = huo.m710_cylinders(math.pi / 3)
    tuned = rw.self_adapt(case.robot, case.path, case.task, start=case.start, max_runs=40, progress=False)
    assert rw.better(tuned.performance, tuned.history[0].performance)
    assert tuned.performance.within_limits
    assert tuned.performance.unreachable == 0
    adapted = rw.dynamic_adapt(case.robot, case.path, case.task, start=case.start, progress=False)
    assert adapted.performance.within_limits
    assert adapted.performance.unreachable == 0
    assert adapted.performance.singularity <= tuned.history[0].performance.singularity * 1.5


def test_pictures() -> None:
    pytest.importorskip("matplotlib")
    robot, path = arm(60.0), cylinders(20)
    assert len(rw.self_adapt(robot, path, TASK, max_runs=4, progress=False).plot().axes) == 3
    assert len(rw.dynamic_adapt(robot, path, TASK, max_rounds=1, progress=False).plot().axes) == 3


# Bad input.


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"w": -0.1}, r"w is -0\.1"),
        ({"k": math.nan}, "k is nan"),
        ({"w": 0.0, "k": 0.0}, "w and k are 0"),
        ({"tolerance": -1.0}, r"tolerance is -1\.0"),
        ({"min_step": 0.0}, r"min_step is 0\.0"),
        ({"max_evaluations": 0}, "max_evaluations is 0"),
        ({"constant": -0.5}, r"k is -0\.5"),
        ({"near": math.inf}, "near is inf"),
    ],
)
def test_bad_search(given: dict[str, Any], message: str) -> None:
    with pytest.raises(rd.InvalidValueError, match=message):
        rw.direct_search(lambda w, k: performance(), **({"w": 0.01, "k": 0.01} | given))


def test_bad_trajectories() -> None:
    with pytest.raises(rd.ShapeError, match="q"):
        rw.Performance.of(FANUC, np.zeros(6))
    with pytest.raises(rd.NonFiniteError, match=r"q\[1, 2\] is nan"):
        rw.Performance.of(FANUC, np.where(np.arange(12).reshape(2, 6) == 8, np.nan, 0.0))
    with pytest.raises(rd.InvalidValueError, match="no points"):
        rw.Performance.of(FANUC, np.zeros((0, 6)))
    with pytest.raises(rd.InvalidValueError, match=r"time\[1\] is 0\.0"):
        rw.Performance.of(FANUC, np.zeros((2, 6)), [0.0, 0.0])
    with pytest.raises(rd.ShapeError, match="time"):
        rw.Performance.of(FANUC, np.zeros((2, 6)), [0.0])


def test_bad_sensitivity() -> None:
    q = np.zeros((1, 6))
    with pytest.raises(rd.InvalidValueError, match="task is 'full'"):
        rw.sensitivity(FANUC, rd.Task.full(), q)
    slide = rd.Robot.from_dh(np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4), joints="RRRP")
    with pytest.raises(rd.InvalidValueError, match="joints 'RRRP'"):
        rw.sensitivity(slide, TASK, np.zeros((1, 4)))
    with pytest.raises(rd.InvalidValueError, match=r"tolerance is 2\.0"):
        rw.sensitivity(FANUC, TASK, q, tolerance=2.0)
    with pytest.raises(rd.InvalidValueError, match="keep is 4"):
        rw.sensitivity(FANUC, TASK, q, keep=4)
    with pytest.raises(rd.InvalidValueError, match="no points"):
        rw.sensitivity(FANUC, TASK, np.zeros((0, 6)))
    with pytest.raises(rd.InvalidValueError, match="probe of joint 5 is nan"):
        rw.sensitivity(arm(60.0), TASK, q, lambda joint: math.nan)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"q": -1.0}, r"q is -1\.0"),
        ({"m": math.inf}, "m is inf"),
        ({"beta_threshold": 0.0}, r"beta_threshold is 0\.0"),
        ({"beta_threshold": 2.0}, r"beta_threshold is 2\.0"),
        ({"period": 0.0}, r"period is 0\.0"),
        ({"max_rounds": 0}, "max_rounds is 0"),
        ({"iterations": 0}, "iterations is 0"),
        ({"threshold": math.nan}, "threshold is nan"),
        ({"start": np.zeros(5)}, "start"),
    ],
)
def test_bad_dynamic_adaptation(given: dict[str, Any], message: str) -> None:
    with pytest.raises((rd.InvalidValueError, rd.ShapeError), match=message):
        rw.dynamic_adapt(FANUC, cylinders(3), TASK, progress=False, **given)


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ({"w0": np.zeros(5)}, rd.ShapeError, "w0"),
        ({"k0": [0.0, 0.0, -2.0, 0.0, 0.0, 0.0]}, rd.InvalidValueError, r"k0\[2\] is -2\.0"),
        ({"w0": math.nan}, rd.NonFiniteError, "w0"),
        ({"tolerance": math.nan}, rd.InvalidValueError, "tolerance is nan"),
        ({"max_runs": 0}, rd.InvalidValueError, "max_runs is 0"),
        ({"starts": 0}, rd.InvalidValueError, "starts is 0"),
        ({"task": rd.Task.position()}, rd.InvalidValueError, "task is 'position'"),
    ],
)
def test_bad_self_adaptation(given: dict[str, Any], error: type[Exception], message: str) -> None:
    arguments: dict[str, Any] = {"robot": FANUC, "path": cylinders(3), "task": TASK, "progress": False} | given
    with pytest.raises(error, match=message):
        rw.self_adapt(**arguments)


def test_bad_weights_and_criteria() -> None:
    with pytest.raises(rd.InvalidValueError, match="margin"):
        rw.Criteria(margin=0.5)
    with pytest.raises(rd.InvalidValueError, match="singularity is nan"):
        rw.Criteria(singularity=math.nan)
    with pytest.raises(rd.InvalidValueError, match="speed"):
        rw.Criteria(speed=0.0)
    with pytest.raises(rd.InvalidValueError, match="manipulability is -1"):
        rw.WeightFunctions().weights(np.ones(6), np.full(6, -0.5), -1.0)
    with pytest.raises(rd.ShapeError, match="limit_distances"):
        rw.WeightFunctions().weights(np.ones(6), np.full(5, -0.5), 0.0)
    with pytest.raises(rd.NonFiniteError, match="cosines"):
        rw.WeightFunctions().weights(np.full(6, np.nan), np.full(6, -0.5), 0.0)
    with pytest.raises(rd.NonFiniteError, match="limit_distances"):
        rw.WeightFunctions().weights(np.ones(6), np.full(6, np.nan), 0.0)
