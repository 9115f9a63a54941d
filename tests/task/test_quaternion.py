"""Quaternions against matrices of numpy and scipy, half turns and bad input."""

import numpy as np
import pytest
import redundancy as rd
from redundancy import quaternion
from scipy.spatial.transform import Rotation

from tests.task.volumes import F64, random_orientations

ROUNDING = 2e-15


def matrices(q: F64) -> F64:
    found: F64 = Rotation.from_quat(np.roll(q, -1, axis=-1)).as_matrix()
    return found


@pytest.fixture
def a() -> F64:
    return random_orientations(np.random.default_rng(1), 200)


@pytest.fixture
def b() -> F64:
    return random_orientations(np.random.default_rng(2), 200)


def test_against_matrices(a: F64, b: F64) -> None:
    v = np.random.default_rng(3).normal(size=(200, 3))
    np.testing.assert_allclose(quaternion.matrix(a), matrices(a), rtol=0.0, atol=ROUNDING)
    np.testing.assert_allclose(
        quaternion.matrix(quaternion.product(a, b)), matrices(a) @ matrices(b), rtol=0.0, atol=ROUNDING
    )
    np.testing.assert_allclose(
        quaternion.matrix(quaternion.conjugate(a)), matrices(a).swapaxes(1, 2), rtol=0.0, atol=ROUNDING
    )
    np.testing.assert_allclose(quaternion.rotate(a, v), (matrices(a) @ v[..., None])[..., 0], rtol=0.0, atol=1e-14)
    angles = np.linalg.norm(Rotation.from_matrix(matrices(a).swapaxes(1, 2) @ matrices(b)).as_rotvec(), axis=1)
    np.testing.assert_allclose(quaternion.angle(a, b), angles, rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(quaternion.angle(a, -b), quaternion.angle(a, b), rtol=0.0, atol=ROUNDING)


def test_to_and_fro(a: F64) -> None:
    again = quaternion.from_matrix(quaternion.matrix(a))
    np.testing.assert_allclose(quaternion.angle(again, a), 0.0, atol=2e-15)
    axis, angle = quaternion.axis_angle(a)
    np.testing.assert_allclose(np.linalg.norm(axis, axis=1), 1.0, rtol=0.0, atol=ROUNDING)
    assert ((angle >= 0.0) & (angle <= np.pi)).all()
    np.testing.assert_allclose(quaternion.angle(quaternion.about(3.0 * axis, angle), a), 0.0, atol=2e-15)


def test_half_turns_and_small_ones() -> None:
    axes = np.concatenate([np.eye(3), np.random.default_rng(4).normal(size=(50, 3))])
    for angle in (np.pi, np.pi - 1e-9, np.pi + 1e-9, 1e-9, 1e-300, 0.0):
        turns = quaternion.about(axes, angle)
        np.testing.assert_allclose(quaternion.matrix(turns), matrices(turns), rtol=0.0, atol=ROUNDING)
        np.testing.assert_allclose(quaternion.angle(quaternion.from_matrix(matrices(turns)), turns), 0.0, atol=3e-15)
        assert quaternion.axis_angle(turns)[1] == pytest.approx(min(angle, 2.0 * np.pi - angle), rel=1e-15, abs=1e-15)
    assert quaternion.axis_angle([-1.0, 0.0, 0.0, 0.0])[0].tolist() == [0.0, 0.0, 1.0]


def test_shapes(a: F64) -> None:
    many = a.reshape(4, 50, 4)
    assert quaternion.product(many, a[0]).shape == quaternion.product(a[0], many).shape == (4, 50, 4)
    assert quaternion.rotate(a[0], np.zeros((7, 3))).shape == (7, 3)
    assert quaternion.rotate(many, [0.0, 0.0, 1.0]).shape == (4, 50, 3)
    assert quaternion.about([0, 0, 1], np.zeros((3, 2))).shape == (3, 2, 4)
    assert isinstance(quaternion.angle(a[0], a[1]), float)
    assert quaternion.matrix(np.zeros((0, 4))).shape == (0, 3, 3)
    assert quaternion.angle(many, quaternion.matrix(many)).shape == (4, 50)


def test_bad_input(a: F64) -> None:
    with pytest.raises(rd.ShapeError, match=r"b: got shape leading \(3,\), expected that of a, \(200,\)"):
        quaternion.product(a, a[:3])
    with pytest.raises(rd.ShapeError, match=r"v: got shape \(4,\), expected \(\.\.\., 3\)"):
        quaternion.rotate(a[0], np.zeros(4))
    with pytest.raises(rd.ShapeError):
        quaternion.from_matrix(a[0])
    with pytest.raises(rd.InvalidValueError, match="axis is"):
        quaternion.about([0.0, 0.0, 0.0], 1.0)
    with pytest.raises(rd.InvalidValueError, match="length 1"):
        quaternion.conjugate([1.0, 1.0, 0.0, 0.0])
    with pytest.raises(rd.NonFiniteError):
        quaternion.about([0.0, 0.0, 1.0], np.inf)
