"""The example tasks of Huo's thesis, `evidence.huo.cases`, checked from outside: geometry, starts and reach."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from evidence.huo import cases as huo

F64 = NDArray[np.float64]

CASES: dict[str, Any] = {build.__name__: build() for build in huo.BUILDERS}
WELDS = ("m710_cylinders", "m710_tilted")
MIDDLES = {"puma_pipe": np.deg2rad([90.0, -60.0, 180.0, 45.0, 60.0, 180.0])}  # (3.18)


def turn(case: Any) -> int:
    """Points of one turn."""
    assert len(case.path) % 2 == 1
    return len(case.path) // 2


@pytest.fixture(params=list(CASES.values()), ids=list(CASES))
def case(request: pytest.FixtureRequest) -> Any:
    return request.param


def test_paths_do_two_closed_turns(case: Any) -> None:
    n = turn(case)
    for points in (case.path.position, case.path.rotation):
        np.testing.assert_allclose(points[n:], points[: n + 1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(np.diff(case.path.time), case.dt, rtol=1e-9)
    assert np.linalg.norm(np.diff(case.path.position, axis=0), axis=1).min() > 1e-4


def test_rotations_are_orthonormal_with_z_along_the_axis(case: Any) -> None:
    rotation = case.path.rotation
    products = rotation @ rotation.transpose(0, 2, 1)
    np.testing.assert_allclose(products, np.broadcast_to(np.eye(3), rotation.shape), rtol=0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, rtol=1e-14)
    np.testing.assert_allclose(rotation[:, :, 2], case.path.axis, rtol=0, atol=1e-15)
    assert case.task.kind == "axisymmetric"
    np.testing.assert_array_equal(case.task.axis, [0.0, 0.0, 1.0])
    # No frame turns by more than a sixth of a turn from one point to the next.
    steps = rotation[1:].transpose(0, 2, 1) @ rotation[:-1]
    assert np.trace(steps, axis1=1, axis2=2).min() > 2.0


def test_start_is_on_the_first_pose_within_limits(case: Any) -> None:
    pose = case.robot.fk(case.start)
    np.testing.assert_allclose(pose[:3, 3], case.path.position[0], rtol=0, atol=1e-11)
    np.testing.assert_allclose(pose[:3, :3], case.path.rotation[0], rtol=0, atol=1e-11)
    assert (case.start > case.robot.q_min).all()
    assert (case.start < case.robot.q_max).all()


@pytest.mark.parametrize("name", [name for name in CASES if name not in WELDS])
def test_no_posture_of_the_first_pose_is_nearer_to_the_middle(name: str) -> None:
    case = CASES[name]
    robot, task = case.robot, rd.Task.full()
    middle = MIDDLES.get(case.name, 0.5 * (robot.q_min + robot.q_max))
    solver = rd.OrthogonalSQP(robot, task, rd.JointLimits(), limits=False)
    target = case.path.targets(task)[0]
    rng = np.random.default_rng(1)
    distances = []
    for _ in range(100):
        q, _, status, _ = solver.solve(target, q0=rng.uniform(-np.pi, np.pi, 6))
        # Whole turns towards the middle.
        q = q - 2.0 * np.pi * np.round((q - middle) / (2.0 * np.pi))
        if status != "unreachable" and (q > robot.q_min).all() and (q < robot.q_max).all():
            distances.append(np.linalg.norm(q - middle))
    assert distances
    assert np.linalg.norm(case.start - middle) == pytest.approx(min(distances), abs=1e-7)


def test_every_point_is_reached_within_limits(case: Any) -> None:
    solver = rd.OrthogonalSQP(case.robot, case.task, rd.LimitBarrier())
    trajectory = rd.follow(solver, case.path, case.start, progress=False)
    assert set(trajectory.status) <= {"converged", "on target"}
    assert trajectory.limit_margin > np.deg2rad(9.0)
    poses = case.robot.fk(trajectory.q)
    np.testing.assert_allclose(poses[:, :3, 3], case.path.position, rtol=0, atol=1e-10)
    np.testing.assert_allclose(poses[:, :3, 2], case.path.axis, rtol=0, atol=1e-10)


def leaving(case: Any, points: int | None = None) -> list[int]:
    """Joints, counted from 1, that leave their limits when the tool follows the rotations."""
    task = rd.Task.full()
    solver = rd.OrthogonalSQP(case.robot, task, rd.JointLimits(), limits=False)
    q, _, _, _, statuses, _ = solver.follow_chunk(case.path.targets(task)[:points], case.start)
    assert "unreachable" not in statuses
    outside = (q < case.robot.q_min) | (q > case.robot.q_max)
    return [int(joint) + 1 for joint in np.flatnonzero(outside.any(axis=0))]


@pytest.mark.parametrize("name", ["puma_pipe", "m16ib_sphere_edge", "m710_cylinders", "m16ib_oblique"])
def test_joint_6_winds_up_without_resolution(name: str) -> None:
    assert leaving(CASES[name]) == [6]


def test_puma_does_the_first_turn_without_resolution() -> None:
    case = CASES["puma_pipe"]
    assert leaving(case, turn(case) + 1) == []


def test_joint_4_leaves_its_narrow_limits_on_the_rectangle() -> None:
    case = CASES["m710_rectangle"]
    assert leaving(case) == [4]
    assert case.robot.q_max[3] == -case.robot.q_min[3] == 0.78
    assert np.ptp(case.path.position[:, 2]) == 0.0
    np.testing.assert_array_equal(case.path.axis, np.broadcast_to([0.0, 0.0, -1.0], case.path.axis.shape))
    # Corners are points of the path.
    for corner in ([1.35, 0.5], [1.05, 0.5], [1.05, -0.5], [1.35, -0.5]):
        assert np.abs(case.path.position[:, :2] - corner).max(axis=1).min() < 1e-12


@pytest.mark.parametrize(
    ("name", "degrees"),
    [
        ("puma_pipe", 30.0),
        ("m16ib_sphere_edge", np.rad2deg(0.4398)),
        ("m710_cylinders", 0.0),
        ("m710_tilted", 60.0),
        ("m710_rectangle", 90.0),
        ("m16ib_oblique", np.rad2deg(0.4398)),
    ],
)
def test_angle_of_the_tool_from_axis_6(name: str, degrees: float) -> None:
    robot = CASES[name].robot
    sixth = robot.jacobian(np.zeros(6))[:3, 5]
    axis = robot.fk(np.zeros(6))[:3, 2]
    across = np.linalg.norm(np.cross(sixth, axis))
    # Joint 6 of the M-710iC turns about -z of its flange.
    assert np.rad2deg(np.arctan2(across, abs(sixth @ axis))) == pytest.approx(degrees, abs=1e-9)


def test_puma_path_is_the_printed_one() -> None:
    case = CASES["puma_pipe"]
    omega, beta = 2.0 * np.pi / 285.0, -3.0 * np.pi / 4.0
    for t, position, rotation in zip(case.path.time, case.path.position, case.path.rotation, strict=True):
        ca, sa, cb, sb = np.cos(0.5 * np.pi + omega * t), np.sin(0.5 * np.pi + omega * t), np.cos(beta), np.sin(beta)
        p = [0.1 * np.cos(omega * t), 0.6 + 0.1 * np.sin(omega * t), -0.59]
        Q = [[ca, -sa * cb, sa * sb], [sa, ca * cb, -ca * sb], [0.0, sb, cb]]  # (3.15), row 2 corrected
        np.testing.assert_allclose(position, p, rtol=0, atol=1e-14)
        np.testing.assert_allclose(rotation, Q, rtol=0, atol=1e-14)


def cylinder_axes() -> tuple[F64, F64]:
    """The branch leans by 31.8 deg in the heading of 157.5 deg, and crosses the main axis at 52.83 deg."""
    lean, heading, crossing = np.deg2rad([31.8, 157.5, 52.83])
    around = np.array([-np.sin(heading), np.cos(heading), 0.0])
    branch, main = (Rotation.from_rotvec(angle * around).apply([0.0, 0.0, 1.0]) for angle in (lean, lean + crossing))
    return branch, main


@pytest.mark.parametrize("name", WELDS)
def test_weld_is_on_both_cylinders_and_points_at_the_part(name: str) -> None:
    path = CASES[name].path
    branch, main = cylinder_axes()
    assert np.rad2deg(np.arccos(branch @ main)) == pytest.approx(52.83)
    away = path.position - [1.15, 0.2, -0.2]  # (3.30)
    np.testing.assert_allclose(np.linalg.norm(np.cross(away, branch), axis=1), 0.25, rtol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(np.cross(away, main), axis=1), 0.4, rtol=1e-13)
    np.testing.assert_allclose(path.axis, -away / np.linalg.norm(away, axis=1, keepdims=True), rtol=0, atol=1e-14)
    # On the side of the branch that stands up, and counter-clockwise about it.
    assert (away @ branch).min() > 0.0
    assert (np.cross(away[:-1], away[1:]) @ branch).min() > 0.0
    # The tool keeps its spin against the motion, as far as the axis allows.
    across = path.rotation[:-1].transpose(0, 2, 1) @ np.diff(path.position, axis=0)[:, :, None]
    spin = np.unwrap(np.arctan2(across[:, 1, 0], across[:, 0, 0]))
    assert np.ptp(spin) < np.deg2rad(5.0)


def test_joint_6_starts_at_the_printed_upper_end() -> None:
    assert CASES["m710_cylinders"].start[5] == pytest.approx(4.17, abs=5e-3)  # Table 4.1


def length_of_intersection(crossing: float) -> float:
    """Length of the curve where cylinders of 250 and 400 mm meet whose axes cross at an angle [m], by quadrature."""
    c, s = np.cos(crossing), np.sin(crossing)

    def slope(t: float) -> float:
        # (x, y) on the circle of the branch; across the other axis: y^2 + (z s - x c)^2 = 0.16.
        y = 0.25 * np.sin(t)
        dz = (-0.25 * np.sin(t) * c - 0.25 * np.cos(t) * y / np.sqrt(0.16 - y * y)) / s
        return float(np.hypot(0.25, dz))

    return float(quad(slope, 0.0, 2.0 * np.pi)[0])


def test_weld_is_1829_mm_long() -> None:
    assert length_of_intersection(np.pi / 2.0) == pytest.approx(1.6181, abs=1e-4)
    length = length_of_intersection(np.deg2rad(52.83))
    assert length == pytest.approx(1.829, abs=1e-4)  # 3.5.1
    case = CASES["m710_cylinders"]
    # Chords fall short of the curve by a few parts in ten thousand, and are nearly equal.
    assert case.path.length / 2.0 == pytest.approx(length, rel=3e-4)
    chords = np.linalg.norm(np.diff(case.path.position, axis=0), axis=1)
    assert np.ptp(chords) < 1e-3 * chords.mean()
    # A turn takes 133 s: 61 and 194 s are of the same passage.
    assert 60.0 * length / (194.0 - 61.0) == pytest.approx(0.825, abs=1e-3)


def test_sphere_edges_are_great_circles_with_a_sine_of_speed() -> None:
    path = CASES["m16ib_sphere_edge"].path
    normal = (path.position - [1.0, 0.0, 0.6]) / 0.3
    np.testing.assert_allclose(path.axis, -normal, rtol=0, atol=1e-14)
    for first in range(0, 200, 25):
        edge = normal[first : first + 26]
        pole = np.cross(edge[0], edge[-1])
        np.testing.assert_allclose(edge @ pole, 0.0, atol=1e-15)
        way = np.arctan2(np.cross(edge[0], edge) @ pole / np.linalg.norm(pole), edge @ edge[0])
        expected = 0.5 * (1.0 - np.cos(np.pi * np.arange(26) / 25.0))
        np.testing.assert_allclose(way / way[-1], expected, rtol=0, atol=1e-12)
    motion = np.diff(path.position, axis=0)
    heading = (motion * path.rotation[:-1, :, 0]).sum(axis=1) / np.linalg.norm(motion, axis=1)
    assert heading.min() > np.cos(np.deg2rad(45.0))


def test_oblique_axis_leans_inward_along_the_circle() -> None:
    path = CASES["m16ib_oblique"].path
    away = path.position - [1.1, 0.0, 0.4]
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.2, rtol=1e-14)
    np.testing.assert_allclose(path.axis[:, 2], -np.cos(np.deg2rad(20.0)), rtol=1e-14)
    np.testing.assert_allclose((path.axis * away).sum(axis=1), -0.2 * np.sin(np.deg2rad(20.0)), rtol=1e-13)
