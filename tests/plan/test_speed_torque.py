"""Plans for the largest constant speed by accelerations and torques, within a volume."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy.errors import InvalidValueError

from tests.reference.chain import F64

pytest.importorskip("scipy")

FRAME = np.array([[1.0, 0.0, 0.0, 0.5], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.1], [0.0, 0.0, 0.0, 1.0]])
ROBOT = rd.robots.get("ur5e")
PATH = rd.Toolpath.raster((0.1, 0.15), 2, 0.04, 0.01, frame=FRAME)
CONE = rd.OrientationVolume.cone(0.15)
TASK = rd.Task.within(CONE)


def torque(q: F64, qd: F64, qdd: F64) -> F64:
    weight: F64 = 3.0 * qdd + qd * np.roll(qd, 1, axis=-1) + 5.0 * np.cos(q)
    return weight


def test_accelerations_and_torques_count() -> None:
    given: dict[str, Any] = {"torque": torque, "torque_limit": [30.0] * 6, "acceleration": np.full(6, 10.0)}
    by_rates = rd.plan(ROBOT, PATH, TASK, criterion="speed", progress=False)
    plan = rd.plan(ROBOT, PATH, TASK, criterion="speed", warm_start=by_rates, progress=False, **given)
    before, after = (rd.constant_speed(ROBOT, p, **given) for p in (by_rates, plan))
    assert after.speed > 1.05 * before.speed
    assert 1.0 / plan.value.max() == pytest.approx(after.speed)
    assert plan.cost == pytest.approx(plan.value.max())
    tool = ROBOT.fk(plan.q)
    assert PATH.rotation is not None
    assert CONE.signed_distance(PATH.rotation.transpose(0, 2, 1) @ tool[:, :3, :3]).max() <= 1e-9
    np.testing.assert_allclose(tool[:, :3, 3], PATH.position, atol=1e-9)


def test_where_they_do_not_belong() -> None:
    most = np.full(6, 10.0)
    with pytest.raises(InvalidValueError, match="criterion 'speed' alone"):
        rd.plan(ROBOT, PATH, TASK, criterion="motion", acceleration=most, progress=False)
    with pytest.raises(InvalidValueError, match=r"expected Task\.within"):
        rd.plan(ROBOT, PATH, rd.Task.full(), criterion="speed", acceleration=most, progress=False)
