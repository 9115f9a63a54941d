"""Which joints turn the tool about its axis: by the angle of the tool, by probes, by pseudo-inverses."""

import math

import numpy as np
import pytest
import redundancy as rd
from redundancy import weights as rw

from tests.weights.cylinders import FANUC, TASK, arm, postures


@pytest.mark.parametrize(
    ("degrees", "case", "joints"),
    [
        (0.0, "parallel", (5, 3)),
        (180.0, "parallel", (5, 3)),
        (4.0, "parallel", (5, 3)),
        (90.0, "perpendicular", (4, 3)),
        (86.0, "perpendicular", (4, 3)),
    ],
)
def test_sensitivity_by_angle(degrees: float, case: str, joints: tuple[int, ...]) -> None:
    robot = arm(degrees)

    def probe(joint: int) -> float:
        raise AssertionError(joint)

    found = rw.sensitivity(robot, TASK, postures(robot), probe)
    assert (found.case, found.joints) == (case, joints)
    assert found.angle == pytest.approx(math.radians(min(degrees, 180.0 - degrees)), abs=1e-7)


@pytest.mark.parametrize("degrees", [6.0, 60.0, 84.0, 120.0])
def test_sensitivity_of_oblique_tools(degrees: float) -> None:
    robot = arm(degrees)
    scores = {3: 2.0, 4: 1.0, 5: 3.0}
    asked: list[int] = []

    def probe(joint: int) -> float:
        asked.append(joint)
        return scores[joint]

    found = rw.sensitivity(robot, TASK, postures(robot), probe)
    assert found.case == "oblique"
    assert sorted(asked) == [3, 4, 5]
    assert found.joints == (5, 3)
    assert found.scores == (3.0, 2.0)
    assert rw.sensitivity(robot, TASK, postures(robot), keep=3).joints != ()
    assert rw.sensitivity(robot, TASK, postures(robot), probe, tolerance=0.0, keep=1).joints == (5,)


@pytest.mark.parametrize("degrees", [0.0, 60.0, 90.0])
def test_cosines_are_what_a_weight_can_do(degrees: float) -> None:
    """The redundant part of (3.8) spins the tool by (e_i . e_t) h_i, whichever joint i is."""
    robot = arm(degrees)
    for q in postures(robot):
        jacobian, axis = robot.jacobian(q), robot.fk(q)[:3, 2]
        spin = np.zeros((6, 6))
        spin[:3, :3] = np.outer(axis, axis)
        motion = np.linalg.pinv(jacobian) @ spin @ jacobian
        one = np.linalg.pinv(jacobian) @ np.concatenate([axis, np.zeros(3)])
        expected = np.linalg.norm(motion, axis=0) / np.linalg.norm(one)
        np.testing.assert_allclose(rw.axis_cosines(robot, TASK, q[None])[0], expected, atol=1e-9)


def test_bad_sensitivity() -> None:
    q = np.zeros((1, 6))
    with pytest.raises(rd.InvalidValueError, match="task is 'full'"):
        rw.sensitivity(FANUC, rd.Task.full(), q)
    slide = rd.Robot.from_dh(np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4), joints="RRRP")
    with pytest.raises(rd.InvalidValueError, match="joints 'RRRP'"):
        rw.sensitivity(slide, TASK, np.zeros((1, 4)))
    with pytest.raises(rd.InvalidValueError, match=r"tolerance is 2\.0"):
        rw.sensitivity(FANUC, TASK, q, tolerance=2.0)
    with pytest.raises(rd.InvalidValueError, match="keep is 4"):
        rw.sensitivity(FANUC, TASK, q, keep=4)
    with pytest.raises(rd.InvalidValueError, match="no points"):
        rw.sensitivity(FANUC, TASK, np.zeros((0, 6)))
    with pytest.raises(rd.InvalidValueError, match="probe of joint 5 is nan"):
        rw.sensitivity(arm(60.0), TASK, q, lambda joint: math.nan)
