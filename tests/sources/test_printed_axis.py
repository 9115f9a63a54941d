"""First posture of the thesis' trajectory, (4.37), with the tool axis as its appendix A prints it.

That axis is built from the axes of joints 5 and 6 only, so that it does not turn with joint 6; no tool fixed to a
flange has it, hence a formulation of its own here. The printed posture has to be on the target (4.36) to within its
printed digits. It is no optimum, neither of kappa_F along the postures that hold the printed axis there nor along the
null direction (4.12).
"""

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray

from evidence.leger.cases import printed_axis

F64 = NDArray[np.float64]

FANUC = rd.robots.get("fanuc_m710ic50_milling")
LENGTH = 0.4855933
POSITION, AXIS = np.array([1.05, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])  # (4.36)
PRINTED = np.array([29.9052, 23.2777, 0.9907, -56.6009, -83.3305, 102.7566])  # (4.37)


def constraints(q: F64) -> F64:
    """Position error, and the two components of the axis across the target."""
    return np.concatenate([FANUC.fk(q)[:3, 3] - POSITION, printed_axis(q)[1:]])


def slopes(q: F64) -> F64:
    step = 1e-6
    return np.stack([(constraints(q + h) - constraints(q - h)) / (2 * step) for h in step * np.eye(6)], axis=1)


def nearest_on_target(q: F64) -> F64:
    for _ in range(10):
        q = q - np.linalg.pinv(slopes(q)) @ constraints(q)
    assert np.abs(constraints(q)).max() < 1e-14
    assert printed_axis(q) @ AXIS > 0
    return q


def test_axis_is_that_of_the_appendix() -> None:
    """The turn is about a direction across e_6, so it stays in the plane of e_6 and e_5 x e_6."""
    for q in np.random.default_rng(0).uniform(-2.0, 2.0, (20, 6)):
        e5, e6 = (FANUC.link_frames(q)[i, :3, 2] for i in (4, 5))
        normal = np.cross(e5, e6)
        expected = 0.5 * e6 - np.sqrt(0.75) * normal / np.linalg.norm(normal)
        np.testing.assert_allclose(printed_axis(q), expected, rtol=0, atol=1e-12)


def test_printed_posture_is_reproduced() -> None:
    q = nearest_on_target(np.deg2rad(PRINTED))
    np.testing.assert_allclose(np.rad2deg(q), PRINTED, rtol=0, atol=1e-3)


def test_printed_posture_is_no_optimum() -> None:
    q = nearest_on_target(np.deg2rad(PRINTED))
    value, gradient = rd.ConditionNumber(LENGTH, squared=True).evaluate(FANUC, q, order=1)
    along_the_target = np.linalg.svd(slopes(q))[2][-1]
    along_4_12 = np.linalg.solve(FANUC.jacobian(q), np.append(printed_axis(q), np.zeros(3)))
    along_4_12 /= np.linalg.norm(along_4_12)
    print(f"kappa_F {np.sqrt(value):.6f}, slopes {along_the_target @ gradient:.3f}, {along_4_12 @ gradient:.3f}")
    # What 1e-4 degrees in every joint change of the slopes is a thousandth of them.
    assert abs(along_the_target @ gradient) > 0.1
    assert abs(along_4_12 @ gradient) > 0.1


def test_fixed_to_the_flange_the_printed_posture_points_elsewhere() -> None:
    tool = FANUC.fk(np.deg2rad(PRINTED))
    assert np.rad2deg(np.arccos(tool[:3, 2] @ AXIS)) == pytest.approx(85.2, abs=0.05)
