"""Paths for plans, and what a plan has to keep whatever it is for."""

import numpy as np
import redundancy as rd

from tests.reference.chain import F64

ROBOT = rd.robots.get("fanuc_m710ic50_milling")
KAPPA = rd.ConditionNumber(0.4855933)


def helix(points: int = 101) -> rd.Toolpath:
    return rd.Toolpath.helix(
        0.25, 0.15915494309189535, 0.0, np.pi / 2, offset=np.pi, center=(1.3, 1.0, 0.0), points=points
    )


def circle(
    centre: tuple[float, float, float], radius: float, points: int, tilt: float = 0.4, duration: float | None = None
) -> rd.Toolpath:
    """A closed circle, the tool leaning outwards."""
    s = np.linspace(0.0, 2.0 * np.pi, points)
    s[-1] = 0.0
    around = np.stack([np.cos(s), np.sin(s), np.zeros(points)], axis=1)
    axis = np.stack([-np.sin(tilt) * np.cos(s), -np.sin(tilt) * np.sin(s), np.full(points, -np.cos(tilt))], axis=1)
    time = None if duration is None else np.linspace(0.0, duration, points)
    return rd.Toolpath(np.array(centre) + radius * around, axis, time=time)


def line(start: tuple[float, float, float], stop: tuple[float, float, float], points: int) -> rd.Toolpath:
    return rd.Toolpath(np.linspace(start, stop, points), np.tile([0.0, 0.0, -1.0], (points, 1)))


def check(plan: rd.Plan, limits: bool = True) -> None:
    """What holds for every point that a plan says it reaches."""
    good = np.array([status != "unreachable" for status in plan.status])
    tools = plan.robot.fk(plan.q)[good]
    assert np.abs(tools[:, :3, 3] - plan.path.position[good]).max() < 1e-9
    if plan.path.rotation is None:
        assert np.abs(tools[:, :3, 2] - plan.path.axis[good]).max() < 1e-9
    if limits:
        assert (plan.q >= plan.robot.q_min - 1e-12).all()
        assert (plan.q <= plan.robot.q_max + 1e-12).all()


def speed_share(plan: rd.Plan) -> F64:
    assert plan.time is not None
    share: F64 = np.abs(np.diff(plan.q, axis=0)) / np.diff(plan.time)[:, None] / plan.robot.qd_max
    return share
