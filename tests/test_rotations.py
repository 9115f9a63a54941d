"""Rotations about an axis, against scipy's."""

import numpy as np
import pytest
from redundancy._util import F64, axis_angle, between, perpendicular, turns

Rotation = pytest.importorskip("scipy.spatial.transform").Rotation


@pytest.fixture
def axes() -> F64:
    axes: F64 = np.random.default_rng(1).normal(size=(50, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    return axes


def test_turns(axes: F64) -> None:
    angles = np.linspace(-4.0, 4.0, len(axes))
    expected = Rotation.from_rotvec(angles[:, None] * axes).as_matrix()
    np.testing.assert_allclose(turns(7.0 * axes, angles), expected, atol=1e-14)
    about = Rotation.from_rotvec(angles[:, None] * axes[0]).as_matrix()
    np.testing.assert_allclose(turns(axes[0], angles), about, atol=1e-14)
    np.testing.assert_array_equal(turns(np.zeros((1, 3)), np.ones(1)), np.eye(3)[None])


def test_axis_and_angle(axes: F64) -> None:
    angles = np.linspace(0.0, 3.1, len(axes))
    axis, angle = axis_angle(turns(axes, angles))
    np.testing.assert_allclose(angle, angles, atol=1e-13)
    np.testing.assert_allclose(axis, 2.0 * np.sin(angles)[:, None] * axes, atol=1e-13)


def test_between(axes: F64) -> None:
    axis, angle = between(axes[:-1], axes[1:])
    turned = (turns(axis, angle) @ axes[:-1, :, None])[:, :, 0]
    np.testing.assert_allclose(turned, axes[1:], atol=1e-14)


def test_perpendicular(axes: F64) -> None:
    for axis in axes:
        across = perpendicular(axis)
        assert abs(across @ axis) < 1e-15
        assert np.linalg.norm(across) == pytest.approx(1.0, abs=1e-15)
