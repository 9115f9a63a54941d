"""Twist and axis rate of a path against closed forms: screw motions exactly, others with errors of second order."""

import numpy as np
import pytest
import redundancy as rd
from scipy.linalg import expm

from tests.reference.chain import F64


def skew(w: F64) -> F64:
    return np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])


def motion(path: rd.Toolpath) -> tuple[F64, F64, F64]:
    """Twist, axis rate and speed of a path with times."""
    twist, rate, speed = path.twist, path.axis_rate, path.speed
    assert twist is not None
    assert rate is not None
    assert speed is not None
    return twist, rate, speed


def uneven(points: int, end: float, seed: int = 0) -> F64:
    """Times whose distances differ by up to three, the same profile however many there are."""
    s = np.linspace(0.0, 1.0, points)
    times: F64 = end * (s + 0.15 * np.sin(2.0 * np.pi * s + seed) - 0.15 * np.sin(seed))
    return times


@pytest.mark.parametrize("points", [2, 3, 4, 40])
def test_helix_of_the_thesis_is_exact(points: int) -> None:
    """(4.25) to (4.28) with the angular velocity about the cylinder's axis, at uneven times."""
    time = uneven(points, 10.0)
    radius, pitch, rate = 0.25, 0.5 / np.pi, np.deg2rad(9.0)
    angle = np.pi - rate * time
    cosine, sine, zero = np.cos(angle), np.sin(angle), np.zeros(points)
    position = np.stack([1.3 + radius * cosine, 1.0 + pitch * rate * time, radius * sine], axis=1)
    path = rd.Toolpath(position, np.stack([-cosine, zero, -sine], axis=1), time=time)
    omega = np.tile([0.0, rate, 0.0], (points, 1))
    v = np.stack([rate * radius * sine, zero + pitch * rate, -rate * radius * cosine], axis=1)
    twist, axis_rate, speed = motion(path)
    np.testing.assert_allclose(twist, np.hstack([omega, v]), rtol=0, atol=1e-14)
    np.testing.assert_allclose(axis_rate, rate * np.stack([-sine, zero, cosine], axis=1), rtol=0, atol=1e-14)
    np.testing.assert_allclose(speed, rate * np.hypot(radius, pitch), rtol=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_screw_motions_are_exact(seed: int) -> None:
    rng = np.random.default_rng(seed)
    omega, v = rng.normal(size=3), rng.normal(size=3)
    generator = np.zeros((4, 4))
    generator[:3, :3], generator[:3, 3] = skew(omega), v
    start = np.eye(4)
    start[:3, :3], start[:3, 3] = expm(skew(rng.normal(size=3))), rng.normal(size=3)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 0.9, 9))])
    frames = np.stack([expm(t * generator) @ start for t in time])
    rotation, position = frames[:, :3, :3], frames[:, :3, 3]
    path = rd.Toolpath(position, rotation[:, :, 2], rotation, time)
    wanted = np.hstack([np.tile(omega, (10, 1)), v + np.cross(omega, position)])
    np.testing.assert_allclose(motion(path)[0], wanted, rtol=0, atol=1e-12)


def errors(points: int, rotations: bool) -> F64:
    """Largest errors of omega, v and axis rate, inside and at both ends, on a path that is no screw motion."""
    t = uneven(points, 2.0)
    a, b = t**2, 0.3 + 0.5 * np.sin(t)
    da, db = 2.0 * t, 0.5 * np.cos(t)
    zero, one = np.zeros(points), np.ones(points)
    turned = np.stack([np.cos(a), -np.sin(a), zero, np.sin(a), np.cos(a), zero, zero, zero, one], 1).reshape(-1, 3, 3)
    tilted = np.stack([np.cos(b), zero, np.sin(b), zero, one, zero, -np.sin(b), zero, np.cos(b)], 1).reshape(-1, 3, 3)
    rotation = turned @ tilted
    axis = rotation[:, :, 2]
    # Rz(a) Ry(b): the first about z, the second about the y that the first has turned.
    omega = da[:, None] * [0.0, 0.0, 1.0] + db[:, None] * turned[:, :, 1]
    rate = np.cross(omega, axis)
    position = np.stack([np.sin(t), t**3 / 8.0, np.cos(2.0 * t)], axis=1)
    v = np.stack([np.cos(t), 3.0 * t**2 / 8.0, -2.0 * np.sin(2.0 * t)], axis=1)
    path = rd.Toolpath(position, axis, rotation if rotations else None, t)
    if not rotations:
        omega = np.cross(axis, rate)
    twist, axis_rate, _ = motion(path)
    if not rotations:
        np.testing.assert_allclose((twist[:, :3] * axis).sum(axis=1), 0.0, atol=1e-13)
    np.testing.assert_allclose((axis_rate * axis).sum(axis=1), 0.0, atol=1e-13)
    wrong = [twist[:, :3] - omega, twist[:, 3:] - v, axis_rate - rate]
    sizes = [np.linalg.norm(difference, axis=1) for difference in wrong]
    return np.array([[size[1:-1].max(), size[0], size[-1]] for size in sizes])


@pytest.mark.parametrize("rotations", [True, False])
def test_errors_are_of_second_order(rotations: bool) -> None:
    coarse, fine = errors(200, rotations), errors(399, rotations)
    assert (coarse < 1e-2).all()
    assert (coarse > 3.5 * fine).all()


def test_without_times_there_are_none() -> None:
    path = rd.Toolpath.helix(0.25, 0.1, 0.0, 1.0)
    assert path.twist is None
    assert path.axis_rate is None
    assert path.speed is None


def test_one_point_stands_still() -> None:
    path = rd.Toolpath([[1.0, 2.0, 3.0]], [[0.0, 0.0, 1.0]], time=[4.0])
    for got in motion(path):
        assert len(got) == 1
        assert not got.any()


def test_a_constant_axis_does_not_turn() -> None:
    path = rd.Toolpath(np.linspace([0.0, 0, 0], [1.0, 2, 3], 4), [[0, 0.6, 0.8]] * 4, time=[0.0, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(motion(path)[0], np.tile([0, 0, 0, 1 / 3, 2 / 3, 1.0], (4, 1)), rtol=1e-15)
