"""Tilt and spin as curves, and the linear model of the fastest motion, against what they stand for."""

import numpy as np
import pytest
import redundancy as rd
from redundancy.loops import Motion
from redundancy.paths import differences, length_along
from redundancy.planning.programme import MotionLimits, rows_of
from redundancy.planning.tolerance import Postures, splines, tilt_and_spin, tilted

from tests.reference.chain import F64

pytest.importorskip("scipy")


def test_tilt_and_spin_there_and_back() -> None:
    rng = np.random.default_rng(0)
    angles = rng.uniform(-1.0, 1.0, (400, 3)) * [2.1, 2.1, 3.0]
    angles[:3, :2] = 0.0
    angles[3, :2] = 1e-9, -1e-9
    rotation = tilted(angles)
    np.testing.assert_allclose(np.linalg.det(rotation), 1.0, rtol=1e-12)
    z = rotation[:, :, 2]
    np.testing.assert_allclose(np.arctan2(np.hypot(z[:, 0], z[:, 1]), z[:, 2]), np.hypot(*angles[:, :2].T), atol=1e-12)
    back = np.array([tilt_and_spin(one[None])[0] for one in rotation])
    np.testing.assert_allclose(back, angles, atol=1e-9)


def test_spins_are_continuous() -> None:
    spin = np.linspace(0.0, 20.0, 200)
    rotation = tilted(np.stack([0.1 * np.cos(spin), 0.1 * np.sin(spin), spin], axis=1))
    np.testing.assert_allclose(tilt_and_spin(rotation)[:, 2], spin, atol=1e-12)


@pytest.mark.parametrize("spacing", [0.05, 0.31, 5.0])
def test_splines_hold_cubics(spacing: float) -> None:
    s = np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 60))
    basis = splines(s, spacing).toarray()
    assert (basis >= 0.0).all()
    np.testing.assert_allclose(basis.sum(axis=1), 1.0, rtol=1e-12)
    cubic = 1.0 - s + 3.0 * s**3
    fitted = np.linalg.lstsq(basis, cubic, rcond=None)[0]
    np.testing.assert_allclose(basis @ fitted, cubic, atol=1e-10)


def torque(q: F64, qd: F64, qdd: F64) -> F64:
    """Return torques of a made-up mechanism."""
    result: F64 = (2.0 + np.cos(q)) * qdd + np.sin(np.roll(q, 1, axis=-1)) * qd * np.roll(qd, 2, axis=-1) + np.cos(q)
    return result


def test_the_linear_model_is_that_of_the_limits() -> None:
    """A small change of the angles changes each row as its slopes say, and no row is below what it stands for."""
    robot, frame = rd.robots.get("ur5e"), np.eye(4)
    frame[:3, 3] = 0.5, 0.0, 0.1
    path = rd.Toolpath.raster((0.1, 0.1), 2, 0.04, 0.01, frame=frame)
    plan = rd.plan(robot, path, rd.Task.full(), criterion="motion", progress=False)
    stencil = differences(length_along(path.position))
    assert path.rotation is not None
    postures = Postures(robot, path.position, path.rotation, stencil)
    rng = np.random.default_rng(2)
    angles = 0.1 * rng.normal(size=(len(path), 3))
    q = postures.at(angles, plan.q)
    assert q is not None
    slopes = postures.slopes(angles, q)
    assert slopes is not None
    limits = MotionLimits(
        np.full(6, 2.0), np.full(6, 9.0), np.full(6, 40.0), torque, None, -np.full(6, 9.0), np.full(6, 9.0)
    )
    w = 1.1 * limits.demand(postures.motion(q))
    small, shift = 1e-6 * rng.normal(size=(len(path), 3)), 1e-6 * w
    near = postures.at(angles + small, q)
    assert near is not None
    np.testing.assert_allclose(near - q, np.einsum("ijk,ik->ij", slopes, small), atol=1e-9)
    before, after = rows_of(Motion(q, *stencil.of(q)), limits, w), rows_of(Motion(near, *stencil.of(near)), limits, w)
    change = near - q
    changes = (change, *stencil.of(change))
    assert len(before) == 2 * 3 * 6
    for row, moved in zip(before, after, strict=True):
        assert (row.constant + row.factor * w <= 1e-9).all()
        expected = sum(np.einsum("ij,ij->i", slope, part) for slope, part in zip(row.slopes, changes, strict=True))
        # Rows are linear in w but for the rates, whose tangent it is.
        difference = moved.constant + moved.factor * (w + shift) - row.constant - row.factor * w
        np.testing.assert_allclose(difference, expected + row.factor * shift, atol=2e-8)
