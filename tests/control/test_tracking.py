"""Control loops of a quadratic programme: `track`, stiffness profiles, `follow` and `solve`, obstacles on the way."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy.loops.tracking import _ticks
from scipy.spatial.transform import Rotation, Slerp

from tests.reference.chain import F64

PANDA, FANUC = rd.robots.get("panda"), rd.robots.get("fanuc_m710ic50_milling")
Q = np.array([0.1, 0.2, -0.3, -1.4, 0.2, 1.6, 0.4])
FREE = PANDA.with_limits(PANDA.q_min, PANDA.q_max, PANDA.qd_max, np.full(7, np.inf))


def straight(
    q: F64, way: tuple[float, float, float], points: int, duration: float | None, turn: float = 0.0
) -> rd.Toolpath:
    """A line from the tool of a posture, turning about an oblique axis."""
    pose, share = PANDA.fk(q), np.linspace(0.0, 1.0, points)
    turns = Rotation.from_rotvec(turn * share[:, None] * np.array([2.0, 1.0, -2.0]) / 3.0).as_matrix()
    rotation = turns @ pose[:3, :3]
    position = pose[:3, 3] + share[:, None] * np.array(way)
    return rd.Toolpath(position, rotation[:, :, 2], rotation, None if duration is None else duration * share)


def test_profile() -> None:
    share = np.linspace(0.0, 1.0, 1001)
    weights = rd.stiffness_profile(share, 2.0, 5e4, 0.25)
    assert weights.shape == (1001,)
    np.testing.assert_allclose(weights, weights[::-1], rtol=1e-9)
    assert (weights[0], weights[-1]) == (5e4, 5e4)
    np.testing.assert_allclose(weights[(share >= 0.25) & (share <= 0.75)], 2.0, rtol=1e-9)
    assert (np.diff(weights[:251]) <= 1e-9).all()
    assert rd.stiffness_profile(0.125, 2.0, 5e4, 0.25) == pytest.approx(0.5 * (2.0 + 5e4))
    # Flat ends: value, slope and curvature.
    h = 1e-4
    for at in (0.0, 0.25):
        inside = (
            rd.stiffness_profile(np.array([at, at + h, at - h]), 2.0, 5e4, 0.25) - (5e4 if at == 0.0 else 2.0)
        ) / 5e4
        assert np.abs(inside).max() < 20.0 * (h / 0.25) ** 3
    np.testing.assert_array_equal(rd.stiffness_profile([-1.0, 2.0]), [1e4, 1e4])
    assert rd.stiffness_profile(np.zeros((2, 3))).shape == (2, 3)
    assert rd.stiffness_profile(0.5, ramp=0.5) == pytest.approx(1.0)
    # The low weight may be the larger one.
    assert rd.stiffness_profile(0.5, 10.0, 1.0) == pytest.approx(10.0)


@pytest.mark.parametrize(
    "change",
    [{"low": 0.0}, {"low": np.nan}, {"high": np.inf}, {"high": -1.0}, {"ramp": 0.0}, {"ramp": 0.6}, {"ramp": np.nan}],
)
def test_bad_profiles(change: dict[str, float]) -> None:
    with pytest.raises(rd.InvalidValueError, match=next(iter(change))):
        rd.stiffness_profile(0.5, **change)


@pytest.mark.parametrize("turn", [0.0, 1e-9, 0.4, 2.5])
def test_points_in_between_are_those_of_slerp(turn: float) -> None:
    path = straight(Q, (-0.05, -0.08, -0.1), 5, 0.8, turn)
    assert path.time is not None
    assert path.rotation is not None
    program = rd.QuadraticProgram(FREE, rd.Task.full(), dt=0.015)
    targets = _ticks(program, path, 0.0)
    times = np.minimum(0.015 * np.arange(len(targets)), 0.8)
    assert times[-1] == 0.8
    slerp = Slerp(path.time, Rotation.from_matrix(path.rotation))(times).as_matrix()
    np.testing.assert_allclose(targets[:, 3:].reshape(-1, 3, 3), slerp, rtol=0, atol=1e-12)
    for k in range(3):
        np.testing.assert_allclose(targets[:, k], np.interp(times, path.time, path.position[:, k]), atol=1e-15)


def test_axes_in_between_turn_evenly() -> None:
    angle = 1.2
    axis = np.array([[0.0, 0.0, 1.0], [0.0, np.sin(angle), np.cos(angle)], [0.0, np.sin(angle), np.cos(angle)]])
    path = rd.Toolpath(np.tile([0.5, 0.0, 0.4], (3, 1)), axis, time=[0.0, 1.0, 2.0])
    targets = _ticks(rd.QuadraticProgram(FREE, rd.Task.axisymmetric(), dt=0.1), path, 0.0)
    at = np.minimum(0.1 * np.arange(21), 1.0) * angle
    np.testing.assert_allclose(targets[:, 3:], np.c_[0.0 * at, np.sin(at), np.cos(at)], rtol=0, atol=1e-14)


@pytest.mark.parametrize("duration", [None, 0.6])
@pytest.mark.parametrize("task", ["full", "axisymmetric", "position"])
def test_track_follows_the_path(task: str, duration: float | None) -> None:
    path = straight(Q, (-0.05, -0.08, -0.1), 61, duration, 0.3)
    program = rd.QuadraticProgram(FREE, getattr(rd.Task, task)(), rd.ConditionNumber(0.4), weight=0.1, dt=1e-2)
    found = rd.track(program, path, Q, progress=False)
    ticks = 61 if duration is None else 60
    assert found.q.shape == (ticks + 1, 7)
    assert found.rates.shape == (ticks, 7)
    assert len(found.status) == ticks
    np.testing.assert_array_equal(found.q[0], Q)
    np.testing.assert_allclose(np.diff(found.q, axis=0), 1e-2 * found.rates, rtol=0, atol=1e-14)
    np.testing.assert_allclose(found.time, 1e-2 * np.arange(ticks + 1), rtol=0, atol=1e-12)
    assert found.position_error[1:].max() < 5e-4
    assert found.axis_error[1:].max() < 2e-3
    assert np.linalg.norm(FREE.fk(found.q[-1])[:3, 3] - path.position[-1]) == pytest.approx(found.position_error[-1])
    np.testing.assert_allclose(found.value, rd.ConditionNumber(0.4).evaluate_many(FREE, found.q, 0)[0])
    assert np.isinf(found.distance).all()
    assert repr(found).startswith("Tracking(0.6")
    # What is remembered of the run before does not count.
    np.testing.assert_array_equal(rd.track(program, path, Q, progress=False).q, found.q)


def test_a_start_off_the_path_a_hold_and_a_profile() -> None:
    path = straight(Q, (-0.1, -0.1, 0.0), 11, 0.5)
    program = rd.QuadraticProgram(FREE, rd.Task.full(), dt=1e-2)
    seen: list[float] = []
    found = rd.track(
        program, path, Q + 0.05, before=seen.append, hold=0.5, progress=False, stiffness=rd.stiffness_profile
    )
    assert len(found.status) == 100
    np.testing.assert_allclose(seen, found.time, rtol=0, atol=1e-12)
    assert found.position_error[0] > 0.01
    assert found.position_error[-1] < 1e-4
    np.testing.assert_allclose(found.deviation[-1], 0.0, atol=1e-3)
    loose = rd.track(program, path, Q, stiffness=lambda share: np.full(len(share), 1e-3), progress=False)
    assert loose.position_error[-1] > 0.05


def test_a_path_from_rest_with_limits_of_acceleration() -> None:
    s = np.linspace(0.0, 1.0, 101)
    start, way = PANDA.fk(Q), np.array([-0.1, -0.1, 0.0])
    smooth = start[:3, 3] + (s**3 * (10.0 + s * (6.0 * s - 15.0)))[:, None] * way
    path = rd.Toolpath(smooth, np.tile(start[:3, 2], (101, 1)), np.tile(start[:3, :3], (101, 1, 1)), 2.0 * s)
    found = rd.track(rd.QuadraticProgram(PANDA, rd.Task.full()), path, Q, hold=0.1, progress=False)
    assert found.position_error.max() < 1e-3
    assert found.position_error[-1] < 1e-6
    change = np.abs(np.diff(np.vstack([np.zeros(7), found.rates]), axis=0))
    assert (change[1:] <= PANDA.qdd_max * 1e-3 * (1.0 + 1e-9)).all()


@pytest.mark.parametrize("dt", [1e-3, 1e-2])
def test_a_start_off_the_path_with_limits_of_acceleration(dt: float) -> None:
    path = straight(Q, (-0.1, -0.1, 0.0), 11, 0.5)
    found = rd.track(rd.QuadraticProgram(PANDA, rd.Task.full(), dt=dt), path, Q + 0.05, hold=2.0, progress=False)
    assert found.position_error[-100:].max() < 1e-4


def test_paths_without_length() -> None:
    pose = PANDA.fk(Q)
    program = rd.QuadraticProgram(PANDA, rd.Task.axisymmetric(), dt=1e-2)
    for count, time in ((1, None), (1, [3.0]), (4, None), (4, [0.0, 0.01, 0.02, 0.03])):
        path = rd.Toolpath(np.tile(pose[:3, 3], (count, 1)), np.tile(pose[:3, 2], (count, 1)), time=time)
        found = rd.track(program, path, Q, progress=False)
        assert np.abs(found.q - Q).max() < 1e-9
        # A twist of rounding is a twist.
        assert set(found.status) <= {"solved", "relaxed"}
        assert len(found.status) == (max(count - 1, 1) if time else count)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"q0": Q[:6]}, rd.ShapeError),
        ({"q0": Q * np.nan}, rd.NonFiniteError),
        ({"hold": -1.0}, rd.InvalidValueError),
        ({"hold": np.nan}, rd.InvalidValueError),
        ({"hold": 1e6}, rd.InvalidValueError),
        ({"stiffness": lambda share: 0.0 * share}, rd.InvalidValueError),
        ({"stiffness": lambda share: np.ones(3)}, ValueError),
    ],
)
def test_bad_loops(change: dict[str, Any], error: type[Exception]) -> None:
    program = rd.QuadraticProgram(PANDA, rd.Task.full(), dt=1e-3)
    start: dict[str, Any] = {"q0": Q, "progress": False}
    with pytest.raises(error):
        rd.track(program, straight(Q, (0.0, 0.0, 0.1), 5, 0.1), **(start | change))


def test_a_task_that_needs_rotations() -> None:
    program = rd.QuadraticProgram(PANDA, rd.Task.full())
    path = rd.Toolpath([[0.5, 0.0, 0.4], [0.5, 0.1, 0.4]], [[0.0, 0.0, -1.0]] * 2, time=[0.0, 1.0])
    with pytest.raises(rd.InvalidValueError, match="rotation"):
        rd.track(program, path, Q)


def test_solve_and_follow() -> None:
    objective = rd.ConditionNumber(0.4856, squared=True)
    program = rd.QuadraticProgram(FANUC, rd.Task.axisymmetric(), objective, weight=10.0, stiffness=1e5)
    path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0), points=31)
    found = rd.follow(program, path, progress=False)
    assert set(found.status) == {"on target"}
    tools = FANUC.fk(found.q)
    np.testing.assert_allclose(tools[:, :3, 3], path.position, rtol=0, atol=1e-9)
    np.testing.assert_allclose(tools[:, :3, 2], path.axis, rtol=0, atol=1e-9)
    assert np.abs(np.diff(found.q, axis=0)).max() < 0.5
    best = rd.follow(rd.OrthogonalSQP(FANUC, rd.Task.axisymmetric(), objective), path, progress=False)
    assert found.value.max() < 1.5 * best.value.max()
    target = path.targets(program.task)[0]
    q, value, status, steps = program.solve(target, found.q[0])
    assert (status, steps > 0) == ("on target", True)
    assert value == pytest.approx(objective.evaluate(FANUC, q, 0))
    one, other = program.solve(target, starts=4, seed=3), program.solve(target, starts=4, seed=3)
    np.testing.assert_array_equal(one[0], other[0])
    far = np.r_[9.0, 0.0, 0.0, target[3:]]
    assert program.solve(far, found.q[0])[2] == "unreachable"
    assert np.isfinite(program.solve(far, found.q[0])[0]).all()
    q, _, status, _ = program.solve(far, starts=3)
    assert status == "unreachable"
    assert np.isnan(q).all()
    for wrong, error in ((target[:5], rd.ShapeError), (target * np.nan, rd.NonFiniteError)):
        with pytest.raises(error):
            program.solve(wrong, found.q[0])


def test_twist_to() -> None:
    program = rd.QuadraticProgram(PANDA, rd.Task.full(), dt=0.02)
    pose, turn = PANDA.fk(Q), np.array([0.3, -0.2, 0.5])
    rotation = Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3]
    twist = program.twist_to(Q, np.r_[pose[:3, 3] + [0.1, 0.2, -0.1], rotation.ravel()])
    np.testing.assert_allclose(twist, np.r_[turn, 0.1, 0.2, -0.1] / 0.02, rtol=1e-9)


@pytest.mark.parametrize("inside", [False, True])
def test_no_pair_comes_nearer_than_its_security_distance(inside: bool) -> None:
    scene = rd.Scene(FREE, rd.capsules_along_links(FREE, 0.06), {"ball": rd.Shape.sphere(0.08)})
    # A ball across the way of the tool; or one that starts within a link.
    here = FREE.link_frames(Q)[4][:3, 3] if inside else PANDA.fk(Q)[:3, 3] + np.array([0.0, -0.25, 0.05])
    scene.place("ball", here)
    program = rd.QuadraticProgram(FREE, rd.Task.position(), dt=5e-3, scene=scene, influence=0.15, security=0.03)
    found = rd.track(program, straight(Q, (0.0, -0.4, 0.0), 21, 1.0), Q, hold=0.5, progress=False)
    assert (np.abs(found.rates) <= FREE.qd_max).all()
    if inside:
        assert found.distance[0] < 0.0
        # Out, and never deeper in.
        assert (np.diff(found.distance[found.distance < 0.03]) > -1e-6).all()
        assert found.distance[-1] > 0.03 - 1e-6
    else:
        assert found.distance.min() > 0.03 - 1e-6
        assert found.distance.min() < 0.05
        assert "relaxed" in found.status or "solved" in found.status


def test_an_obstacle_that_comes_too_fast_is_named() -> None:
    scene = rd.Scene(FREE, rd.capsules_along_links(FREE, 0.06), {"ball": rd.Shape.sphere(0.1)})
    tool = FREE.fk(Q)[:3, 3]
    scene.place("ball", tool + np.array([0.2, 0.0, 0.0]), [0.0, 0.0, 0.0, -50.0, 0.0, 0.0])
    program = rd.QuadraticProgram(FREE, rd.Task.position(), scene=scene)
    rates = program.step(Q, np.zeros(6))
    assert program.status == "infeasible"
    assert any("ball" in name for name in program.failed)
    assert (np.abs(rates) <= FREE.qd_max).all()
    assert program.distance == pytest.approx(scene.distance(Q))
    assert program.scene is scene
