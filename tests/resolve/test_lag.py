"""`OrthogonalSQP.step` beside a minimum that moves: (4.20) with the motion of the task in full."""

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64

ROBOT = rd.robots.get("fanuc_m710ic50_milling").with_limits([-np.inf] * 6, [np.inf] * 6, [np.inf] * 6)
KAPPA = rd.ConditionNumber(0.4855933, squared=True)
TASK = rd.Task.axisymmetric()
FINE = rd.OrthogonalSQP(ROBOT, TASK, KAPPA)


def helix(phi: float, speed: float) -> tuple[F64, F64]:
    """Return position and axis, and the twist, on the helix of Table 4-3 at an angle, for a speed of it [rad/s]."""
    c, s = np.cos(phi), np.sin(phi)
    velocity = speed * np.array([0.25 * s, 0.5 / np.pi, 0.25 * c])
    place = np.array([1.3 - 0.25 * c, 1.0 + 0.5 / np.pi * phi, 0.25 * s, c, 0.0, -s])
    return place, np.r_[0.0, speed, 0.0, velocity]


@pytest.fixture(scope="module")
def start() -> F64:
    path = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.0, np.pi / 2, offset=np.pi, center=(1.3, 1.0, 0.0))
    best = rd.follow(rd.OrthogonalSQP(rd.robots.get("fanuc_m710ic50_milling"), TASK, KAPPA), path, progress=False).q[0]
    start: F64 = FINE.solve(helix(0.0, 1.0)[0], best).q
    return start


def lag(q: F64, duration: float, dt: float) -> float:
    """Return how far a loop at the default gain is behind the pointwise minima at most [deg]."""
    solver = rd.OrthogonalSQP(ROBOT, TASK, KAPPA, dt=dt, limits=False)
    count, speed, worst = round(duration / dt), 0.5 * np.pi / duration, 0.0
    for k in range(count):
        place, twist = helix(speed * k * dt, speed)
        q = q + dt * solver.step(q, twist + solver.twist_to(q, place))
        if k % (count // 50) == 0:
            best = FINE.solve(helix(speed * (k + 1) * dt, speed)[0], q).q
            worst = max(worst, float(np.rad2deg(np.abs(q - best).max())))
    return worst


@pytest.mark.parametrize(("duration", "bar"), [(2.0, 0.002), (0.5, 0.03)])
def test_behind_the_minima_of_the_helix(start: F64, duration: float, bar: float) -> None:
    assert lag(start, duration, 1e-3) < 0.05 * bar


def test_of_second_order_in_the_tick(start: F64) -> None:
    coarse, fine, finest = (lag(start, 0.5, dt) for dt in (4e-3, 2e-3, 1e-3))
    assert coarse / fine == pytest.approx(4.0, rel=0.1)
    assert fine / finest == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("gain", [0.0, 10.0, 1000.0])
def test_the_free_rate_is_that_of_the_minimum(start: F64, gain: float) -> None:
    q, speed = start, np.pi
    for phi in np.linspace(0.0, 0.7, 200):
        q = FINE.solve(helix(float(phi), speed)[0], q).q
    ahead, behind = (FINE.solve(helix(0.7 + sign * 1e-4, speed)[0], q).q for sign in (1.0, -1.0))
    rates = rd.OrthogonalSQP(ROBOT, TASK, KAPPA, gain=gain, limits=False).step(q, helix(0.7, speed)[1])
    np.testing.assert_allclose(rates, (ahead - behind) / 2e-4 * speed, atol=1e-5)


def test_several_freedoms_keep_up_too() -> None:
    """A seven-axis arm whose tool may spin: two freedoms."""
    robot = rd.robots.get("kuka_iiwa14").with_limits([-np.inf] * 7, [np.inf] * 7, [np.inf] * 7)
    index = rd.ConditionNumber(0.4, squared=True)
    fine, loop = (rd.OrthogonalSQP(robot, TASK, index, dt=1e-3, limits=False) for _ in range(2))
    q = fine.solve(robot.fk(np.array([0.2, 0.6, -0.3, -1.3, 0.4, 1.0, 0.1]))).q
    first = robot.fk(q)

    def place(t: float) -> F64:
        position: F64 = first[:3, 3] + np.array([0.0, 0.1 * np.sin(t), 0.05 * t])
        return np.concatenate([position, first[:3, 2]])

    q, worst = fine.solve(place(0.0), q).q, 0.0
    for k in range(600):
        q = q + 1e-3 * loop.step_along(q, place(1e-3 * k), place(1e-3 * (k + 1)))
        if k % 60 == 59:
            worst = max(worst, float(np.abs(q - fine.solve(place(1e-3 * (k + 1)), q).q).max()))
    assert worst < 2e-5


def test_a_task_at_rest_closes_the_distance_by_the_gain(start: F64) -> None:
    solver = rd.OrthogonalSQP(ROBOT, TASK, KAPPA, gain=10.0, dt=1e-3, limits=False)
    place = helix(0.0, 1.0)[0]
    null = solver.constraint(start, place).null[:, 0]
    q = FINE.solve(place, start).q + 0.01 * null
    rates = solver.step(q, np.zeros(6))
    assert rates @ null == pytest.approx(-0.1, rel=0.05)
