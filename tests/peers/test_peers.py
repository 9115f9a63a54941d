"""Kinematics against pinocchio (two URDF chains, live) and the Robotics Toolbox for Python 1.5.0 (`data/rtb.json`)."""

import json
from typing import Any

import numpy as np
import pytest
from redundancy import Manipulability, Robot

from tests.reference.files import DATA

ANGULAR_FIRST = [3, 4, 5, 0, 1, 2]
CHAINS = {"ur5": ("base_link", "tool0"), "panda": ("panda_link0", "panda_link8")}
ROBOTS: list[dict[str, Any]] = json.loads((DATA / "rtb.json").read_text(encoding="utf-8"))["robots"]


@pytest.mark.parametrize("name", CHAINS)
def test_urdf_chain_equals_pinocchio(name: str) -> None:
    pin = pytest.importorskip("pinocchio")
    file = DATA / f"{name}.urdf"
    base, tip = CHAINS[name]
    robot = Robot.from_urdf(file, base=base, tip=tip)
    model = pin.buildModelFromUrdf(str(file))
    data = model.createData()
    frame = model.getFrameId(tip)
    nv = model.nv
    assert robot.n == nv
    np.testing.assert_array_equal(robot.q_min, model.lowerPositionLimit)
    np.testing.assert_array_equal(robot.q_max, model.upperPositionLimit)
    np.testing.assert_array_equal(robot.qd_max, model.velocityLimit)
    rng = np.random.default_rng(41)
    for _ in range(50):
        q = rng.uniform(-3, 3, nv)
        rates = rng.uniform(-1, 1, nv)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        pin.computeJointKinematicHessians(model, data)
        np.testing.assert_allclose(robot.fk(q), data.oMf[frame].homogeneous, rtol=0, atol=1e-13)
        jacobian = pin.getFrameJacobian(model, data, frame, world)[ANGULAR_FIRST]
        np.testing.assert_allclose(robot.jacobian(q), jacobian, rtol=0, atol=1e-13)
        # The bindings hand out the column-major tensor under the shape of a row-major one.
        raw = pin.getFrameKinematicHessian(model, data, frame, world)
        hessian = np.asarray(raw).ravel().reshape((6, nv, nv), order="F")[ANGULAR_FIRST]
        np.testing.assert_allclose(robot.jacobian_derivative(q), hessian, rtol=0, atol=1e-13)
        pin.computeJointJacobiansTimeVariation(model, data, q, rates)
        pin.updateFramePlacements(model, data)
        variation = pin.getFrameJacobianTimeVariation(model, data, frame, world)[ANGULAR_FIRST]
        np.testing.assert_allclose(robot.jacobian_rate(q, rates), variation, rtol=0, atol=1e-13)


@pytest.mark.parametrize("description", ROBOTS, ids=lambda robot: str(robot["name"]))
def test_dh_robot_equals_the_robotics_toolbox(description: dict[str, Any]) -> None:
    given = {key: description[key] for key in ("a", "d", "alpha", "theta", "joints", "convention", "base", "tool")}
    robot = Robot.from_dh(**given)
    for posture in description["postures"]:
        q = posture["q"]
        np.testing.assert_allclose(robot.fk(q), posture["fk"], rtol=0, atol=1e-13)
        np.testing.assert_allclose(robot.jacobian(q), posture["jacobian"], rtol=0, atol=1e-13)
        np.testing.assert_allclose(robot.jacobian_derivative(q), posture["derivative"], rtol=0, atol=1e-13)
        value, gradient = Manipulability().evaluate(robot, q, order=1)
        np.testing.assert_allclose(value, posture["manipulability"], rtol=1e-12)
        np.testing.assert_allclose(gradient, posture["gradient"], rtol=0, atol=1e-12)
