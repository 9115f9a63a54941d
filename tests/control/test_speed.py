"""The largest constant speed of a path, its times, and the fastest motion within a tolerance."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy.errors import InvalidValueError, NonFiniteError, ShapeError
from redundancy.paths import differences, length_along

from tests.reference.chain import F64

FREE = np.full(6, np.inf)
FRAME = np.array([[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.1], [0.0, 0.0, 0.0, 1.0]])
INERTIA = np.array([4.0, 5.0, 2.0, 0.3, 0.2, 0.1])
LIMIT = np.array([40.0, 60.0, 30.0, 5.0, 4.0, 3.0])


def torque(q: F64, qd: F64, qdd: F64) -> F64:
    """Return torques of a made-up mechanism with coupled inertias, quadratic in rates, with gravity."""
    coupled = INERTIA * qdd + 0.3 * np.cos(q) * np.roll(qdd, 1, axis=-1)
    weight: F64 = 6.0 * INERTIA / INERTIA[0] * np.cos(q + 0.3)
    return coupled + np.sin(q) * qd * np.roll(qd, -1, axis=-1) + weight


@cache
def ur5e() -> rd.Trajectory:
    path = rd.Toolpath.raster((0.2, 0.3), 3, 0.05, 0.005, frame=FRAME)
    return rd.plan(rd.robots.get("ur5e"), path, rd.Task.full(), criterion="motion", progress=False)


def along(points: F64, q: F64) -> rd.Trajectory:
    """Return a trajectory of three joints, whatever robot that is."""
    robot = rd.robots.get("planar_3r")
    path = rd.Toolpath(points, np.broadcast_to([0.0, 0.0, 1.0], points.shape))
    zero = np.zeros(len(points))
    return rd.Trajectory(robot, path, q, zero, zero, zero, zero, ["on target"] * len(points))


@pytest.mark.parametrize("count", [2, 3, 4, 40])
def test_differences_of_polynomials(count: int) -> None:
    rng = np.random.default_rng(count)
    s = np.cumsum(rng.uniform(0.1, 1.0, count))
    first, second = differences(s).of(np.stack([s, s**2], axis=1))
    np.testing.assert_allclose(first[:, 0], 1.0, rtol=1e-9)
    np.testing.assert_allclose(second[:, 0], 0.0, atol=1e-9)
    if count > 2:
        np.testing.assert_allclose(first[:, 1], 2.0 * s, rtol=1e-9)
        np.testing.assert_allclose(second[:, 1], 2.0, rtol=1e-8)


def test_differences_are_of_second_order_at_equal_distances() -> None:
    worst = []
    for count in (100, 200):
        s = np.linspace(0.0, 3.0, count + 1)
        first, second = differences(s).of(np.sin(s)[:, None])
        worst.append([np.abs(first[:, 0] - np.cos(s)).max(), np.abs(second[:, 0] + np.sin(s)).max()])
    assert (np.array(worst[0]) > 3.6 * np.array(worst[1])).all()


def test_a_gantry_on_a_circle_in_closed_form() -> None:
    """Joints that are the position: rates v, accelerations v^2/R, torques m v^2/R about their weight."""
    radius, angle = 0.4, np.linspace(0.0, 2.0 * np.pi, 2001)
    points = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    motion = along(points, points)
    rate, most = np.array([2.0, 3.0, 1.0]), np.array([9.0, 5.0, 1.0])
    mass, weight, limit = np.array([2.0, 3.0, 4.0]), np.array([1.0, -2.0, 5.0]), np.array([8.0, 9.0, 6.0])
    found = rd.constant_speed(
        motion.robot,
        motion,
        lambda q, qd, qdd: mass * qdd + weight,
        torque_limit=limit,
        rate=rate,
        acceleration=most,
    )
    for name, expected in {
        "rate": rate[:2],
        "acceleration": np.sqrt(most[:2] * radius),
        # The side on which the weight is in the way.
        "torque": np.sqrt((limit - np.abs(weight))[:2] * radius / mass[:2]),
    }.items():
        np.testing.assert_allclose(found.criteria[name].joint_speed[:2], expected, rtol=1e-5)
        assert np.isinf(found.criteria[name].joint_speed[2])
    assert found.criterion == "torque"
    assert found.joint == 1
    assert found.speed == found.criteria["torque"].speed
    assert abs(motion.q[found.point or 0, 1]) == pytest.approx(radius, rel=1e-4)


def test_speeds_against_bisection() -> None:
    """What limits a speed is met there and nowhere exceeded, whichever of three criteria."""
    motion = ur5e()
    robot, (first, second) = motion.robot, differences(length_along(motion.path.position)).of(motion.q)
    acceleration = np.array([9.0, 9.0, 9.0, 15.0, 15.0, 15.0])
    found = rd.constant_speed(robot, motion, torque, torque_limit=LIMIT, acceleration=acceleration)
    demands: dict[str, Callable[[float], F64]] = {
        "rate": lambda v: np.abs(first) * v / robot.qd_max,
        "acceleration": lambda v: np.abs(second) * v**2 / acceleration,
        "torque": lambda v: np.abs(torque(motion.q, first * v, second * v**2)) / LIMIT,
    }
    for name, demand in demands.items():
        for joint in range(6):
            low, high = 0.0, 1e3
            for _ in range(70):
                middle = 0.5 * (low + high)
                low, high = (middle, high) if demand(middle)[:, joint].max() <= 1.0 else (low, middle)
            assert min(found.criteria[name].joint_speed[joint], 1e3) == pytest.approx(low, rel=1e-9)
        limit = found.criteria[name]
        assert demand(limit.speed)[limit.point, limit.joint] == pytest.approx(1.0)
    assert found.speed == min(limit.speed for limit in found.criteria.values())
    assert repr(found).startswith(f"ConstantSpeed({found.speed:.6g} m/s")


def test_no_limit_and_no_rest() -> None:
    motion = ur5e()
    free = rd.constant_speed(motion.robot, motion, rate=FREE)
    assert (free.speed, free.joint, free.point, free.criterion) == (np.inf, None, None, None)
    heavy = rd.constant_speed(motion.robot, motion, torque, torque_limit=np.full(6, 0.1), rate=FREE)
    assert heavy.speed == 0.0


class Weak:
    """Dynamics with limits of their own."""

    limit = LIMIT

    def torque(self, q: F64, qd: F64, qdd: F64) -> F64:
        return torque(q, qd, qdd)


def test_dynamics_bring_their_limits() -> None:
    motion = ur5e()
    own = rd.constant_speed(motion.robot, motion, Weak())
    given = rd.constant_speed(motion.robot, motion, torque, torque_limit=LIMIT)
    assert own.speed == given.speed


@pytest.mark.parametrize(
    ("wrong", "error", "told"),
    [
        ({"torque": torque}, InvalidValueError, "expected torque_limit"),
        ({"torque_limit": LIMIT}, InvalidValueError, "without torque"),
        ({"torque": torque, "torque_limit": LIMIT[:5]}, ShapeError, "torque_limit"),
        ({"torque": 3.0, "torque_limit": LIMIT}, InvalidValueError, "torque is 3.0"),
        ({"torque": torque, "torque_limit": -LIMIT}, InvalidValueError, r"torque_limit\[0\] is -40"),
        ({"torque": lambda q, qd, qdd: qd, "torque_limit": LIMIT}, InvalidValueError, "not quadratic"),
        ({"torque": lambda q, qd, qdd: q[0], "torque_limit": LIMIT}, ShapeError, "torque"),
        ({"torque": lambda q, qd, qdd: np.nan * q, "torque_limit": LIMIT}, NonFiniteError, "torque"),
        ({"rate": np.full(6, np.nan)}, InvalidValueError, r"rate\[0\] is nan"),
        ({"rate": "fast"}, InvalidValueError, "no array"),
        ({"acceleration": np.zeros(6)}, InvalidValueError, r"acceleration\[0\] is 0"),
    ],
)
def test_bad_criteria(wrong: dict[str, Any], error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        rd.constant_speed(ur5e().robot, ur5e(), **wrong)


def test_bad_trajectories() -> None:
    motion = ur5e()
    with pytest.raises(InvalidValueError, match="6 joints, expected 3"):
        rd.constant_speed(rd.robots.get("planar_3r"), motion)
    point = np.zeros((1, 3))
    with pytest.raises(InvalidValueError, match="single point"):
        rd.constant_speed(rd.robots.get("planar_3r"), along(point, point))
    still = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    with pytest.raises(InvalidValueError, match=r"position\[2\] is position\[1\]"):
        rd.constant_speed(rd.robots.get("planar_3r"), along(still, still))


def test_times_at_a_constant_speed() -> None:
    timed = ur5e().timed(0.5)
    assert isinstance(timed, rd.Plan)
    assert timed.path.duration == pytest.approx(timed.path.length / 0.5)
    assert timed.path.speed is not None
    np.testing.assert_allclose(timed.path.speed, 0.5, rtol=1e-2)
    for wrong, told in (
        ({"speed": 0.0}, "speed is 0"),
        ({}, "speed is None"),
        ({"method": "best"}, "method is 'best'"),
    ):
        with pytest.raises(InvalidValueError, match=told):
            ur5e().timed(**wrong)


def test_least_times_keep_the_limits_and_are_never_slower() -> None:
    pytest.importorskip("toppra")
    motion = ur5e()
    robot, acceleration = motion.robot, np.full(6, 12.0)
    limits: dict[str, Any] = {"torque": torque, "torque_limit": LIMIT, "acceleration": acceleration}
    constant = rd.constant_speed(robot, motion, **limits)
    ends: dict[str, Any] = {"start_speed": 0.98 * constant.speed, "end_speed": 0.98 * constant.speed}
    best = motion.timed(method="toppra", **limits, **ends)
    assert best.time is not None
    assert best.path.duration is not None
    assert best.path.duration <= motion.path.length / (0.98 * constant.speed)
    rest = motion.timed(method="toppra", **limits)
    assert rest.path.duration is not None
    assert rest.path.duration > best.path.duration
    for timed in (best, rest):
        assert timed.time is not None
        step = np.diff(timed.time)
        # Between points the way along the path has one acceleration: the middle of each has its mean speed.
        rate = np.diff(timed.q, axis=0) / step[:, None]
        assert (np.abs(rate) <= robot.qd_max * 1.01).all()
        first, second = differences(timed.time).of(timed.q)
        inner = slice(2, -2)
        assert (np.abs(second[inner]) <= 1.1 * acceleration).all()
        assert (np.abs(torque(timed.q, first, second)[inner]) <= 1.1 * LIMIT).all()
    by_rates = motion.timed(method="toppra")
    assert (by_rates.max_joint_speed or 0.0) == pytest.approx(robot.qd_max.min(), rel=1e-2)


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"speed": 1.0}, "expected none"),
        ({"rate": FREE}, "no limit is finite"),
        ({"start_speed": -1.0}, "start_speed is -1"),
        ({"start_speed": 100.0}, "no motion from 100"),
        ({"torque": torque, "torque_limit": np.full(6, 0.1)}, "no motion"),
    ],
)
def test_bad_least_times(wrong: dict[str, Any], told: str) -> None:
    pytest.importorskip("toppra")
    with pytest.raises(InvalidValueError, match=told):
        ur5e().timed(method="toppra", **wrong)


class Cone:
    """Orientations within a tilt of the path's, free to spin."""

    def __init__(self, tilt: float, spin: float = np.inf) -> None:
        self.tilt, self.spin = tilt, spin

    def signed_distance(self, rotation: F64) -> F64:
        tilt: F64 = np.arctan2(np.hypot(rotation[:, 0, 2], rotation[:, 1, 2]), rotation[:, 2, 2]) - self.tilt
        twist = np.arctan2(rotation[:, 1, 0] - rotation[:, 0, 1], rotation[:, 0, 0] + rotation[:, 1, 1])
        return np.maximum(tilt, np.abs(twist) - self.spin)


@pytest.mark.parametrize(
    ("volume", "limits"),
    [
        (Cone(0.2), {}),
        (Cone(0.15), {"rate": FREE, "acceleration": np.full(6, 10.0)}),
        (Cone(0.15, 0.2), {"rate": FREE, "torque": torque, "torque_limit": LIMIT}),
    ],
)
def test_the_fastest_motion_within_a_tolerance(volume: Cone, limits: dict[str, Any]) -> None:
    pytest.importorskip("scipy")
    start = ur5e()
    found = rd.fastest(start.robot, start.path, volume, start=start, max_iterations=8, **limits)
    before = rd.constant_speed(start.robot, start, **limits)
    assert list(found.start_speeds) == pytest.approx([before.speed])
    assert found.speed.speed > 1.1 * before.speed
    again = rd.constant_speed(start.robot, found.trajectory, **limits)
    assert again.speed == pytest.approx(found.speed.speed)
    assert start.path.rotation is not None
    tool = start.robot.fk(found.trajectory.q)
    relative = start.path.rotation.transpose(0, 2, 1) @ tool[:, :3, :3]
    assert volume.signed_distance(relative).max() <= 1e-9
    np.testing.assert_allclose(tool[:, :3, 3], start.path.position, atol=1e-9)
    assert found.trajectory.path.rotation is not None
    np.testing.assert_allclose(tool[:, :3, :3], found.trajectory.path.rotation, atol=1e-9)


def test_no_step_is_taken_that_does_not_pay() -> None:
    start = ur5e()
    found = rd.fastest(start.robot, start.path, Cone(1e-9, 1e-9), start=[start], max_iterations=3)
    assert found.speed.speed == pytest.approx(found.start_speeds[0])


def test_bad_tolerances() -> None:
    start = ur5e()
    cases: list[tuple[rd.Robot, dict[str, Any], str]] = [
        (rd.robots.get("planar_3r"), {}, "3 joints, expected 6"),
        (start.robot, {"rate": FREE}, "no limit is finite"),
        (start.robot, {"knots": 0.0}, "knots is 0"),
        (start.robot, {"max_iterations": -1}, "max_iterations is -1"),
        (start.robot, {"start": start.timed(1.0), "path": rd.Toolpath.raster((0.1, 0.1), 2, 0.05, 0.01)}, "postures"),
    ]
    for robot, wrong, told in cases:
        arguments: dict[str, Any] = {"start": start, "path": start.path} | wrong
        with pytest.raises(InvalidValueError, match=told):
            rd.fastest(robot, volume=Cone(0.1), **arguments)


def test_pinocchio_beside_a_pendulum() -> None:
    """One link: tau = (m c^2 + I) qdd + m g c cos q, about a horizontal axis."""
    pinocchio = pytest.importorskip("pinocchio")
    model = pinocchio.Model()
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    joint = model.addJoint(0, pinocchio.JointModelRZ(), pinocchio.SE3(turn, np.zeros(3)), "pendulum")
    body = pinocchio.Inertia(2.0, np.array([0.3, 0.0, 0.0]), np.diag([0.01, 0.02, 0.05]))
    model.appendBodyToJoint(joint, body, pinocchio.SE3.Identity())
    dynamics = rd.PinocchioDynamics(model, [5.0])
    q, qd, qdd = np.random.default_rng(0).normal(size=(3, 7, 1))
    expected = (2.0 * 0.3**2 + 0.05) * qdd + 2.0 * 9.81 * 0.3 * np.cos(q)
    np.testing.assert_allclose(dynamics.torque(q, qd, qdd), expected, rtol=1e-12)
    np.testing.assert_allclose(dynamics.torque(q[0], qd[0], qdd[0]), expected[0], rtol=1e-12)
    in_q, in_rate, mass = dynamics.derivatives(q, qd, qdd)
    np.testing.assert_allclose(in_q[:, 0], -2.0 * 9.81 * 0.3 * np.sin(q), rtol=1e-12)
    np.testing.assert_allclose(in_rate, 0.0, atol=1e-12)
    np.testing.assert_allclose(mass[:, 0], 2.0 * 0.3**2 + 0.05, rtol=1e-12)
    with pytest.raises(ShapeError, match="qdd"):
        dynamics.torque(q, qd, qdd[:3])
    with pytest.raises(NonFiniteError, match="q"):
        dynamics.torque([np.nan], [0.0], [0.0])
    with pytest.raises(ShapeError, match="limit"):
        rd.PinocchioDynamics(model, [1.0, 2.0])


def test_postures_alone_are_no_trajectory() -> None:
    with pytest.raises(InvalidValueError, match=r"trajectory is a ndarray, expected a Trajectory or a Plan"):
        rd.constant_speed(rd.robots.get("ur5e"), np.zeros((3, 6)))  # type: ignore[arg-type]
