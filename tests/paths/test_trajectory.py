"""Trajectories: derived figures by numpy, spins, starts."""

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray

from tests.reference.helix import PATH, ROBOT

F64 = NDArray[np.float64]


def test_figures(trajectory: rd.Trajectory) -> None:
    assert len(trajectory) == 11
    assert trajectory.time is PATH.time
    np.testing.assert_allclose(trajectory.condition_number, _kappa(trajectory.q), rtol=1e-11)
    assert trajectory.max_condition_number == trajectory.condition_number.max()
    assert trajectory.mean_condition_number == pytest.approx(trajectory.condition_number.mean())
    margins = np.minimum(trajectory.q - ROBOT.q_min, ROBOT.q_max - trajectory.q)
    assert trajectory.limit_margin == margins.min()
    assert trajectory.joint_speed is not None
    np.testing.assert_allclose(trajectory.joint_speed[:-1], np.diff(trajectory.q, axis=0), rtol=1e-9)
    assert trajectory.max_joint_speed == pytest.approx(np.abs(np.diff(trajectory.q, axis=0)).max())
    assert trajectory.unreachable == []
    tools = ROBOT.fk(trajectory.q)
    np.testing.assert_allclose(
        np.linalg.norm(tools[:, :3, 3] - PATH.position, axis=1), trajectory.position_error, atol=1e-14
    )


def _kappa(q: F64) -> F64:
    scale = np.repeat([0.4855933, 1.0], 3)[:, None]
    sigma = np.linalg.svd(scale * ROBOT.jacobian(q), compute_uv=False)
    kappa: F64 = np.sqrt((sigma**2).sum(axis=1) * (sigma**-2.0).sum(axis=1)) / 6.0
    return kappa


def test_spin_is_the_turn_about_the_axis(trajectory: rd.Trajectory) -> None:
    spin = trajectory.spin
    assert spin[0] == 0.0
    # Integrated from the angular velocity between points of a fine path.
    fine = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.0, np.pi / 2, np.pi, (1.3, 1.0, 0.0), 1001)
    solver = rd.OrthogonalSQP(ROBOT, rd.Task.axisymmetric(), rd.ConditionNumber(0.4855933, squared=True))
    followed = rd.follow(solver, fine, trajectory.q[0])
    middle = 0.5 * (followed.q[1:] + followed.q[:-1])
    turn = np.einsum("prk,pk->pr", ROBOT.jacobian(middle)[:, :3], np.diff(followed.q, axis=0))
    axis = ROBOT.fk(middle)[:, :3, 2]
    integrated = np.append(0.0, np.cumsum((turn * axis).sum(axis=1)))
    np.testing.assert_allclose(followed.spin, integrated, atol=1e-4)
    np.testing.assert_allclose(spin, followed.spin[::100], atol=1e-6)


def test_follow_checks_its_start() -> None:
    solver = rd.OrthogonalSQP(ROBOT, rd.Task.axisymmetric(), rd.ConditionNumber(0.5))
    with pytest.raises(rd.ShapeError, match="q0"):
        rd.follow(solver, PATH, np.zeros(5))
    with pytest.raises(rd.NonFiniteError, match="q0"):
        rd.follow(solver, PATH, np.full(6, np.nan))
    with pytest.raises(rd.InvalidValueError, match="rotations"):
        rd.follow(rd.OrthogonalSQP(ROBOT, rd.Task.full(), rd.ConditionNumber(0.5)), PATH)


def test_fixed_spin_is_full_inverse_kinematics(trajectory: rd.Trajectory) -> None:
    first = ROBOT.fk(trajectory.q[0])[:3, :3]
    fixed = PATH.without_spin(first)
    solver = rd.OrthogonalSQP(ROBOT, rd.Task.full(), rd.ConditionNumber(0.4855933, squared=True))
    followed = rd.follow(solver, fixed, trajectory.q[0])
    assert fixed.rotation is not None
    np.testing.assert_allclose(ROBOT.fk(followed.q)[:, :3, :3], fixed.rotation, atol=2e-9)
    np.testing.assert_allclose(followed.spin, 0.0, atol=1e-8)
    assert (followed.condition_number >= trajectory.condition_number - 1e-9).all()
