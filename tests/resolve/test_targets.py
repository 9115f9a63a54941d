"""Targets in both forms, a task's own numbers and a pose of the tool, from every solver; ticks along a path."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from scipy.spatial.transform import Rotation

from tests.reference.chain import F64
from tests.resolve.rates import METHODS

ARM = rd.robots.get("kuka_iiwa14")
Q = np.array([0.3, 0.5, -0.2, -1.1, 0.4, 0.9, 0.1])
TASKS = {
    "full": rd.Task.full(),
    "axisymmetric": rd.Task.axisymmetric((1.0, -2.0, 2.0)),
    "position": rd.Task.position(),
    "base": rd.Task(("line", (1, 2, 3)), ("plane", (0, 1, 1)), "base"),
}
ALL = ["QuadraticProgram", "OrthogonalSQP", *METHODS]


def solver(method: str, task: rd.Task, **more: Any) -> Any:
    if method in METHODS:
        return METHODS[method](ARM, task, rd.JointLimits(), **more)
    if method == "OrthogonalSQP":
        return rd.OrthogonalSQP(ARM, task, rd.JointLimits(), gain=1.0, **more)
    return rd.QuadraticProgram(ARM, task, rd.JointLimits(), stiffness=1e7, **more)


def numbers(task: rd.Task, pose: F64) -> F64:
    """The task's own numbers of a pose."""
    turn = pose[:3, :3] @ task.axis if task.target_size == 6 else pose[:3, :3].ravel()
    out: F64 = np.concatenate([pose[:3, 3], turn])[: task.target_size]
    return out


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("method", ALL)
def test_a_pose_is_a_target(method: str, task: str) -> None:
    one = solver(method, TASKS[task])
    poses = ARM.fk(Q + 0.05 * np.random.default_rng(0).uniform(-1.0, 1.0, (5, 7)))
    rows = np.array([numbers(one.task, pose) for pose in poses])
    for pose, row in zip(poses, rows, strict=True):
        for layout in (pose, np.asfortranarray(pose), pose.tolist(), np.repeat(pose, 2, axis=1)[:, ::2]):
            np.testing.assert_allclose(one.error(Q, layout), one.error(Q, row), rtol=0, atol=1e-14)
        np.testing.assert_allclose(one.twist_to(Q, pose), one.error(Q, row) / one.dt, rtol=0, atol=1e-11)
    found, wanted = one.solve(poses[0], Q), one.solve(rows[0], Q)
    np.testing.assert_allclose(found.q, wanted.q, rtol=0, atol=1e-7)
    assert found.status == wanted.status
    assert found.status in ("on target", "converged")
    np.testing.assert_allclose(one.follow_chunk(poses, Q).q, one.follow_chunk(rows, Q).q, rtol=0, atol=1e-6)
    assert one.follow_chunk(poses[0], Q).q.shape == (1, 7)
    # Many postures, each with its own target.
    np.testing.assert_array_equal(one.error(np.tile(Q, (5, 1)), rows), [one.error(Q, row) for row in rows])


def test_the_error_is_that_of_the_two_poses() -> None:
    pose, there = ARM.fk(Q), ARM.fk(Q + 0.1)
    one = rd.QuadraticProgram(ARM, rd.Task.full(), dt=1e-2)
    turn = Rotation.from_matrix(there[:3, :3] @ pose[:3, :3].T).as_rotvec()
    np.testing.assert_allclose(one.error(Q, there), np.r_[turn, there[:3, 3] - pose[:3, 3]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(one.twist_to(Q, there), 100.0 * one.error(Q, there), rtol=1e-12)


@pytest.mark.parametrize("method", ["QuadraticProgram", "OrthogonalSQP", "TwistDecomposition"])
def test_bad_targets(method: str) -> None:
    one, pose = solver(method, TASKS["full"]), ARM.fk(Q)
    skew, wild = pose.copy(), pose.copy()
    skew[0, 1] += 0.1
    wild[1, 3] = np.nan
    calls: list[Callable[[Any], object]] = [
        lambda t: one.solve(t, Q),
        lambda t: one.error(Q, t),
        lambda t: one.twist_to(Q, t),
        lambda t: one.step_along(Q, t, pose),
        lambda t: one.step_along(Q, pose, t),
    ]
    for call in calls:
        for wrong in (pose[:3], pose[:3, :3], np.zeros(11), np.zeros((2, 12)), 1.0):
            with pytest.raises(rd.ShapeError, match=r"\(12,\) or \(4, 4\)"):
                call(wrong)
        with pytest.raises(rd.InvalidValueError, match="orthogonal rotation"):
            call(skew)
        with pytest.raises(rd.InvalidValueError, match="last row"):
            call(np.ones((4, 4)))
        with pytest.raises(rd.NonFiniteError):
            call(wild)
    for wrong in (np.zeros((2, 11)), np.zeros((2, 3, 4)), 1.0):
        with pytest.raises(rd.ShapeError, match=r"\(N, 12\) or \(N, 4, 4\)"):
            one.follow_chunk(wrong, Q)
    with pytest.raises(rd.InvalidValueError, match="orthogonal rotation"):
        one.follow_chunk([pose, skew], Q)
    with pytest.raises(rd.ShapeError, match="targets"):
        one.error(np.tile(Q, (3, 1)), np.tile(pose, (2, 1, 1)))


@pytest.mark.parametrize("method", ALL)
def test_a_tick_along_a_path(method: str) -> None:
    one, other = solver(method, TASKS["axisymmetric"]), solver(method, TASKS["axisymmetric"])
    now, there = ARM.fk(Q + 1e-3), ARM.fk(Q + 2e-3)
    for share in (1.0, 0.3):
        twist = other.twist_to(Q, there) - (1.0 - share) * other.twist_to(Q, now)
        out = np.empty(7)
        assert one.step_along(Q, now, there, out, share=share) is out
        np.testing.assert_allclose(out, other.step(Q, twist), rtol=1e-7, atol=1e-12)
        assert one.status == other.status
        np.testing.assert_allclose(one.deviation, other.deviation, rtol=0, atol=1e-9)
    before = one.deviation
    for wrong in (0.0, -0.1, 1.1, np.nan):
        with pytest.raises(rd.InvalidValueError, match="share"):
            one.step_along(Q, now, there, share=wrong)
    np.testing.assert_array_equal(one.deviation, before)
    one.reset()
    np.testing.assert_array_equal(one.deviation, np.zeros(6))
    assert one.dt == 1e-3


@pytest.mark.parametrize("method", ALL)
def test_track_with_every_solver(method: str) -> None:
    pose, share = ARM.fk(Q), np.linspace(0.0, 1.0, 21)
    position = pose[:3, 3] + share[:, None] * np.array([-0.04, 0.05, -0.06])
    path = rd.Toolpath(position, np.tile(pose[:3, 2], (21, 1)), np.tile(pose[:3, :3], (21, 1, 1)), 0.6 * share)
    task = rd.Task.full() if method == "ResolvedRate" else rd.Task.axisymmetric()
    one = solver(method, task, dt=5e-3)
    found = rd.track(one, path, Q, progress=False)
    assert found.program is one
    assert found.q.shape == (121, 7)
    np.testing.assert_allclose(np.diff(found.q, axis=0), 5e-3 * found.rates, rtol=0, atol=1e-14)
    assert set(found.status) <= {"regular", "solved"}
    assert found.position_error.max() < 1e-4
    assert found.axis_error.max() < 1e-4
    assert np.abs(found.deviation).max() < 1e-3
    np.testing.assert_allclose(found.value, rd.JointLimits().evaluate_many(ARM, found.q, 0)[0])
    if method != "QuadraticProgram":
        with pytest.raises(rd.InvalidValueError, match="stiffness"):
            rd.track(one, path, Q, stiffness=rd.stiffness_profile, progress=False)
    # What a method remembers of the run before does not count.
    np.testing.assert_array_equal(rd.track(one, path, Q, progress=False).q, found.q)


def test_track_with_a_posture_pull() -> None:
    path = rd.Toolpath(np.tile(ARM.fk(Q)[:3, 3], (50, 1)), np.tile(ARM.fk(Q)[:3, 2], (50, 1)))
    one = rd.TwistDecomposition(ARM, rd.Task.axisymmetric(), rd.PosturePull(np.ones(7), np.ones(7), Q + 0.1), dt=1e-2)
    found = rd.track(one, path, Q, progress=False)
    assert np.isnan(found.value).all()
    assert found.position_error.max() < 1e-6
