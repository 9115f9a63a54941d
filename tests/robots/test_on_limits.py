"""One rule for limits: postures on a limit, off it by rounding, whole turns away have one verdict everywhere."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64

TURN = 2.0 * np.pi
FULL, KAPPA = rd.Task.full(), rd.ConditionNumber(0.5, squared=True)
NAMES = ("ur5e", "abb_irb120", "puma500", "fanuc_m710ic50_milling")
SOLVERS: tuple[Any, ...] = (rd.OrthogonalSQP, rd.TwistDecomposition, rd.QuadraticProgram)


def limited(rng: np.random.Generator, name: str) -> rd.Robot:
    """Limits on both sides, on one, on none; narrower than a turn, as wide, wider."""
    low, high = np.full(6, -np.inf), np.full(6, np.inf)
    for i, kind in enumerate(rng.integers(5, size=6)):
        start, width = rng.uniform(-7.0, 7.0), rng.choice([rng.uniform(0.5, 6.0), TURN, rng.uniform(6.4, 20.0)])
        if kind != 1:
            low[i] = start if kind != 2 else -np.inf
        if kind not in (0, 2):
            high[i] = start + width
    return rd.robots.get(name).with_limits(low, high, coupled=[])


def on_limits(rng: np.random.Generator, robot: rd.Robot) -> F64:
    """A posture of which one to three joints are exactly on limits; regular."""
    low, high = robot.q_min, robot.q_max
    start = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 8.0, -4.0))
    end = np.where(np.isfinite(high), high, start + 8.0)
    while True:
        q: F64 = rng.uniform(start, end)
        for i in rng.permutation(6)[: rng.integers(1, 4)]:
            ends = [x for x in (low[i], high[i]) if np.isfinite(x)]
            q[i] = rng.choice(ends) if ends else q[i]
        scaled = robot.jacobian(q) * np.array([0.5, 0.5, 0.5, 1.0, 1.0, 1.0])[:, None]
        if np.linalg.svd(scaled, compute_uv=False)[-1] > 0.02:
            return q


def exact(robot: rd.Robot, q: F64) -> bool:
    inside = ((q >= robot.q_min) & (q <= robot.q_max)).all()
    return bool(inside and np.all(robot.within_limits(q)))


def coupled(rng: np.random.Generator, q: F64) -> list[tuple[dict[int, float], float, float]]:
    """A limit on a combination that the posture is exactly on."""
    i, j = (int(x) for x in rng.choice(6, 2, replace=False))
    row = {i: float(rng.choice([1.0, -1.0])), j: float(rng.choice([1.0, -1.0, 0.5]))}
    value, width = sum(c * q[k] for k, c in row.items()), rng.uniform(0.3, 12.0)
    return [(row, value, value + width) if rng.random() < 0.5 else (row, value - width, value)]


@pytest.mark.parametrize("together", [False, True])
@pytest.mark.parametrize("seed", range(20))
def test_every_method_has_the_same_verdict(seed: int, together: bool) -> None:
    rng = np.random.default_rng(seed)
    robot = limited(rng, NAMES[seed % 4])
    q = on_limits(rng, robot)
    if together:
        robot = robot.with_limits(coupled=coupled(rng, q))
    made = q + rng.choice([0.0, 1e-12, -1e-12]) * rng.choice([-1.0, 1.0], 6) + TURN * rng.integers(-2, 3, 6)
    pose = robot.fk(made)
    target = np.r_[pose[:3, 3], pose[:3, :3].ravel()]

    def has(found: F64, turned: bool = False) -> bool:
        away = found - q
        away = np.where(turned, away, (away + np.pi) % TURN - np.pi)
        return bool((np.abs(away).max(axis=1) < 1e-9).any())

    inside = robot.inverse(pose, limits=True)
    assert has(inside)
    assert exact(robot, inside)
    verdicts = [bool(robot.within_limits(robot.turned(x))) for x in robot.inverse(pose)]
    assert sum(verdicts) == len(inside)
    if np.isfinite(robot.q_max - robot.q_min).all():
        every = robot.inverse(pose, turns=True)
        assert has(every, turned=True)
        assert exact(robot, every)
    assert exact(robot, robot.turned(made))
    for kind in SOLVERS:
        solver = kind(robot, FULL, KAPPA)
        best = solver.solve(target, starts=48, seed=1)
        assert best.status != "unreachable"
        assert exact(robot, best.q)
        if kind is not rd.TwistDecomposition:
            near = solver.solve(target, q0=q)
            assert near.status != "unreachable"
            assert exact(robot, near.q)
    line = q + np.linspace(0.05, 0.0, 5)[:, None] * np.sign(np.nan_to_num(robot.middle) - q)
    if not np.all(robot.within_limits(line)):
        return
    frames = np.array([robot.fk(x) for x in line])
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], rotation=frames[:, :3, :3])
    plan = rd.plan(robot, path, FULL, KAPPA, progress=False)
    assert plan.failure is None
    assert exact(robot, plan.q)
    followed = rd.follow(rd.OrthogonalSQP(robot, FULL, KAPPA), path, line[0], progress=False)
    assert len(followed.unreachable) == 0
    assert exact(robot, followed.q)
    assert followed.limit_margin >= 0.0 or bool(together)
    assert rd.redundancy_map(robot, path, FULL, KAPPA).feasible.any(axis=(1, 2)).all()


def turned_about_z(angle: float, frame: F64) -> F64:
    out = np.eye(4)
    out[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return out @ frame


@pytest.mark.parametrize(("end", "beyond"), [(164.9, None), (165.0, None), (165.1, "about 0.1 deg beyond it")])
def test_a_path_that_ends_on_a_limit_is_planned(end: float, beyond: str | None) -> None:
    robot = rd.robots.get("abb_irb120")
    start = robot.fk(np.array([0.0, 0.3, -0.1, 0.0, 0.9, 0.0]))
    frames = np.array([turned_about_z(a, start) for a in np.radians(np.linspace(0.0, end, 24))])
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], rotation=frames[:, :3, :3])
    plan = rd.plan(robot, path, objective=rd.ConditionNumber(0.3), progress=False)
    if beyond is None:
        assert plan.failure is None
        assert exact(robot, plan.q)
        assert plan.q[-1, 0] == pytest.approx(np.radians(end), abs=1e-9)
    else:
        assert plan.failure is not None
        assert str(plan.failure).startswith(f"point 23: joint limit of joint 1, which would have to go {beyond}")


def test_one_limit_beyond_half_a_turn() -> None:
    """Joint 1 of a UR turns nothing that counts: any coordinate below its limit is as good."""
    low, high = np.full(6, -np.inf), np.full(6, np.inf)
    high[0] = -4.0
    robot = rd.robots.get("ur5e").with_limits(low, high)
    pose = robot.fk(np.array([-5.0, -1.0, 1.0, 0.3, 0.8, 0.2]))
    target = np.r_[pose[:3, 3], pose[:3, :3].ravel()]
    assert robot.inverse(pose, limits=True)[:, 0].max() <= -4.0
    for kind in SOLVERS:
        q, _, status, _ = kind(robot, FULL, KAPPA).solve(target)
        assert status != "unreachable"
        assert exact(robot, q)
    best = rd.minimum_condition_posture(robot, starts=4)
    free = rd.minimum_condition_posture(rd.robots.get("ur5e"), starts=4)
    assert best.within_limits
    assert best.q[0] <= -4.0
    assert best.condition_number == pytest.approx(free.condition_number, rel=1e-6)


def test_a_plan_is_shifted_to_where_one_limit_wants_it() -> None:
    arm = rd.robots.get("ur5e")
    line = np.array([0.3, -1.2, 1.4, -0.8, -1.3, 0.4]) + np.linspace(0.0, 0.2, 6)[:, None]
    frames = np.array([arm.fk(x) for x in line])
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], rotation=frames[:, :3, :3])
    for joint, low, high in ((0, -np.inf, -9.0), (3, 11.0, np.inf), (5, -np.inf, 0.6)):
        q_min, q_max = np.full(6, -np.inf), np.full(6, np.inf)
        q_min[joint], q_max[joint] = low, high
        robot = arm.with_limits(q_min, q_max)
        plan = rd.plan(robot, path, FULL, KAPPA, progress=False)
        assert plan.failure is None
        assert exact(robot, plan.q)
        # No farther than it has to: a turn back would be beyond.
        back = TURN if np.isfinite(high) else -TURN
        if not (low <= 0.0 <= high):
            assert not exact(robot, plan.q + back * np.eye(6)[joint])
