"""Weights along a path, and whole runs of both adaptations on a robot."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy import weights as rw

from evidence.huo import cases as huo
from tests.weights.cylinders import FANUC, TASK, arm, cylinders


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


def test_joints_that_are_named() -> None:
    robot, path = arm(60.0), cylinders(30)
    found = rw.self_adapt(robot, path, TASK, joints=[0, 4], max_runs=60, progress=False)
    assert found.sensitivity.joints == (0, 4)
    assert found.sensitivity.case == "oblique"
    # The first of them first, without probes.
    assert [record.element for record in found.history[:2]] == [-1, 0]
    assert {record.element for record in found.history} == {-1, 0, 4}
    np.testing.assert_array_equal(found.w[[1, 2, 3, 5]], 0.01)
    np.testing.assert_array_equal(found.k[[1, 2, 3, 5]], 0.01)
    mean = rw.axis_cosines(robot, TASK, rw.self_adapt(robot, path, TASK, max_runs=1, progress=False).trajectory.q)
    np.testing.assert_allclose(found.sensitivity.scores, mean.mean(axis=0)[[0, 4]], rtol=1e-12)
    # Those that are picked, named in the same order, come to the same.
    picked = rw.self_adapt(arm(0.0), path, TASK, max_runs=40, progress=False)
    named = rw.self_adapt(arm(0.0), path, TASK, joints=picked.sensitivity.joints, max_runs=40, progress=False)
    np.testing.assert_array_equal([named.w, named.k], [picked.w, picked.k])


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
    case = huo.m710_tilted()
    tuned = rw.self_adapt(case.robot, case.path, case.task, start=case.start, max_runs=40, progress=False)
    assert rw.better(tuned.performance, tuned.history[0].performance)
    assert tuned.performance.within_limits
    assert tuned.performance.unreachable == 0
    adapted = rw.dynamic_adapt(case.robot, case.path, case.task, start=case.start, progress=False)
    assert adapted.performance.within_limits
    assert adapted.performance.unreachable == 0
    assert not adapted.history[0].failure.less_than(rw.Criteria().check(adapted.trajectory))


def test_pictures() -> None:
    pytest.importorskip("matplotlib")
    robot, path = arm(60.0), cylinders(20)
    assert len(rw.self_adapt(robot, path, TASK, max_runs=4, progress=False).plot().axes) == 3
    assert len(rw.dynamic_adapt(robot, path, TASK, max_rounds=1, progress=False).plot().axes) == 3


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
        ({"joints": []}, rd.InvalidValueError, r"joints is \[\]"),
        ({"joints": [5, 5]}, rd.InvalidValueError, r"joints is \[5, 5\]"),
        ({"joints": (3, 6)}, rd.InvalidValueError, r"joints is \[3, 6\], expected different numbers from 0 to 5"),
        ({"joints": [-1]}, rd.InvalidValueError, r"joints is \[-1\]"),
        ({"joints": [2.5]}, rd.InvalidValueError, r"joints is \[2\.5\]"),
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
