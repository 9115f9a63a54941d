"""Paths that cannot be followed: the first bad point and the cause; and input that is refused."""

import numpy as np
import pytest
import redundancy as rd

from tests.reference.plans import KAPPA, ROBOT, check, circle, helix, line, speed_share


def test_impossible_speed_names_joint_and_point() -> None:
    path = circle((1.2, 0.2, 0.3), 0.25, 121, duration=0.2)
    plan = rd.plan(ROBOT, path, objective=KAPPA)
    assert plan.failure is not None
    assert plan.failure.cause == "speed limit"
    assert plan.failure.joint is not None
    assert plan.failure.excess > 1.0
    share = speed_share(plan)
    assert share[plan.failure.point - 1, plan.failure.joint] == pytest.approx(plan.failure.excess, rel=1e-6)
    assert f"joint {plan.failure.joint + 1}" in str(plan.failure)


def reachable(robot: rd.Robot, path: rd.Toolpath, point: int) -> bool:
    """Whether a point can be reached within the limits at any of 720 spins."""
    z = path.axis[point]
    x = np.cross(z, [0.3, 0.5, 0.7])
    x /= np.linalg.norm(x)
    for spin in np.linspace(0.0, 2.0 * np.pi, 720, endpoint=False):
        pose = np.eye(4)
        turned = np.cos(spin) * x + np.sin(spin) * np.cross(z, x)
        pose[:3, :3] = np.stack([turned, np.cross(z, turned), z], axis=1)
        pose[:3, 3] = path.position[point]
        if len(robot.inverse(pose, limits=True)):
            return True
    return False


def test_unreachable_stretch_names_its_first_point() -> None:
    s = np.linspace(0.0, 1.0, 201)
    position = np.stack([1.0 + 1.8 * np.sin(np.pi * s), -0.3 + 0.6 * s, np.full(201, 0.3)], axis=1)
    path = rd.Toolpath(position, np.tile([0.0, 0.0, -1.0], (201, 1)))
    plan = rd.plan(ROBOT, path, objective=KAPPA)
    check(plan)
    bad = plan.unreachable
    assert plan.failure is not None
    assert plan.failure.point == bad[0]
    assert plan.failure.cause in ("unreachable", "joint limit")
    assert bad == list(range(bad[0], bad[-1] + 1))
    for point, expected in ((bad[0] - 1, True), (bad[0], False), (bad[-1], False), (bad[-1] + 1, True)):
        assert reachable(ROBOT, path, point) is expected
    # What is reached is planned: values everywhere but there.
    assert np.isnan(plan.value[bad]).all()
    assert np.isfinite(np.delete(plan.value, bad)).all()


def test_wholly_unreachable() -> None:
    plan = rd.plan(ROBOT, line((9.0, 0.0, 0.3), (9.0, 1.0, 0.3), 20), objective=KAPPA)
    assert plan.failure is not None
    assert (plan.failure.point, plan.failure.cause) == (0, "unreachable")
    assert len(plan.unreachable) == 20
    assert np.isfinite(plan.q).all()


def test_joint_limit_in_the_way() -> None:
    narrow = ROBOT.with_limits(q_min=np.r_[-0.1, ROBOT.q_min[1:]], q_max=np.r_[0.1, ROBOT.q_max[1:]])
    plan = rd.plan(narrow, circle((1.2, 0.2, 0.3), 0.25, 61), objective=KAPPA)
    assert plan.failure is not None
    assert plan.failure.cause == "joint limit"
    assert plan.failure.joint is not None
    assert plan.failure.excess > 0.0
    assert not reachable(narrow, plan.path, plan.failure.point)


def test_closed_needs_a_closed_path() -> None:
    with pytest.raises(rd.InvalidValueError, match="closed is True"):
        rd.plan(ROBOT, helix(), objective=KAPPA, closed=True)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"criterion": "best"}, "criterion is 'best'"),
        ({"objective": None}, "objective is None"),
        ({"layers": 0}, "layers is 0"),
        ({"n_angles": 0}, "n_angles is 0"),
        ({"n_spare": 0}, "n_spare is 0"),
        ({"max_iterations": 0}, "max_iterations is 0"),
        ({"smoothness": -1.0}, "smoothness is -1.0"),
        ({"smoothness": np.nan}, "smoothness is nan"),
        ({"max_spin_step": 0.0}, "max_spin_step is 0.0"),
        ({"max_step": 0.0}, "max_step is 0.0"),
        ({"spin_range": (1.0, 0.0)}, "spin_range is"),
        ({"spare": (1, 2)}, "spare is"),
        ({"task": rd.Task(("line", (0.0, 0.0, 1.0)))}, "no rotations"),
        ({"task": rd.Task("free", "free")}, "asks for a motion"),
        ({"task": rd.Task.full()}, "no rotations"),
        ({"robot": rd.robots.get("planar_3r")}, "rows is .* at most 3 rows"),
        ({"robot": ROBOT.with_fixed({1: 0.3, 2: 0.3})}, "task is axisymmetric of 5 components for 4 joints"),
    ],
)
def test_bad_input(arguments: dict[str, object], message: str) -> None:
    good: dict[str, object] = {"robot": ROBOT, "path": helix(5), "objective": KAPPA}
    with pytest.raises(rd.InvalidValueError, match=message):
        rd.plan(**(good | arguments))  # type: ignore[arg-type]
