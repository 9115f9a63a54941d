"""Ticks come to rest in front of goals out of reach: at the nearest posture, not to and fro over it."""

import numpy as np
import pytest
import redundancy as rd

from tests.reference.rest import LOOPS, ROBOTS, SAME_COST, STILL, Goal, cost_left, loop, random_goal, send, within

UR5E = rd.robots.get("ur5e")


@pytest.mark.parametrize("method", LOOPS)
@pytest.mark.parametrize("name", ROBOTS)
def test_at_rest_at_a_minimum(name: str, method: str) -> None:
    rng = np.random.default_rng(7)
    for k in range(4):
        goal = random_goal(rng, name, behind_limits=k % 2 == 0)
        q, fastest = send(goal, method, rng.uniform(*within(goal.robot)))
        if loop(goal, method).task != goal.task:
            continue  # without resolution every component counts
        left = cost_left(goal, q)
        assert np.isnan(left) or (fastest < STILL and left < SAME_COST), (k, goal.task, goal.dt, fastest, left)
        assert (q >= goal.robot.q_min - 1e-12).all()
        assert (q <= goal.robot.q_max + 1e-12).all()


@pytest.mark.parametrize("method", ["QuadraticProgram", "OrthogonalSQP", "TwistDecomposition"])
def test_slower_gains_come_to_rest_at_the_same_minimum(method: str) -> None:
    rng = np.random.default_rng(5)
    for k in range(6):
        goal = random_goal(rng, ROBOTS[k % 4], behind_limits=False, slow=True)
        q, fastest = send(goal, method, rng.uniform(*within(goal.robot)))
        # Where the cost bends little the error falls more slowly than the gain says.
        left = cost_left(goal, q)
        assert np.isnan(left) or (fastest < 10.0 * STILL and left < SAME_COST), (k, fastest, left)


def test_a_third_of_a_metre_beyond_reach() -> None:
    """The twist is cut to 0.25 m/s and 1 rad/s, as a loop would."""
    q = np.array([0.2, -1.2, 1.5, -1.9, -1.57, 0.3])
    goal = UR5E.fk(q)
    goal[:3, 3] = -1.2, -0.3, 0.3
    program = rd.QuadraticProgram(UR5E, rd.Task.full(), stiffness=1e6, dt=1e-3, tolerance=0.01)
    for k in range(12_000):
        error = program.error(q, goal)
        size = np.linalg.norm(error.reshape(2, 3), axis=1)
        rates = program.step(q, np.repeat(np.minimum(15.0, (1.0, 0.25) / np.maximum(size, 1e-9)), 3) * error)
        if k > 6000:
            # It alternated between plus and minus the speed limit, pi, for ever.
            assert np.abs(rates).max() < 2e-3
        q = q + 1e-3 * rates
    assert np.abs(rates).max() < 1e-3
    # A loop of another programme, of ticks of 4 ms and stiffness 1e4, rests there.
    assert 1e3 * np.linalg.norm(program.error(q, goal)[3:]) == pytest.approx(331.24, abs=0.05)


@pytest.mark.parametrize("method", ["QuadraticProgram", "OrthogonalSQP", "TwistDecomposition", "GradientProjection"])
def test_goals_within_reach_are_reached(method: str) -> None:
    rng = np.random.default_rng(1)
    for name in ROBOTS:
        robot = rd.robots.get(name)
        low, high = within(robot)
        there = rng.uniform(0.5 * low, 0.5 * high)
        q = there + rng.uniform(-0.2, 0.2, robot.n)
        solver = loop(Goal(robot, rd.Task.full(), robot.fk(there), 2e-3, 1e6, 10.0), method)
        goal = robot.fk(there)
        for _ in range(2000):
            q = q + 2e-3 * solver.step(q, 10.0 * solver.error(q, goal))
        assert np.abs(solver.error(q, goal)).max() < 1e-6, name


def test_a_robot_that_brakes_rests_at_the_end_of_a_path_out_of_reach() -> None:
    panda = rd.robots.get("panda")
    q0 = np.array([0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.8])
    pose = panda.fk(q0)
    path = rd.Toolpath(
        np.linspace(pose[:3, 3], [0.9, 0.4, 0.9], 5), np.tile(pose[:3, 2], (5, 1)), time=np.linspace(0.0, 3.0, 5)
    )
    run = rd.track(rd.QuadraticProgram(panda, rd.Task.axisymmetric(), dt=2e-3), path, q0, hold=5.0, progress=False)
    assert np.abs(run.rates[-50:]).max() < 1e-2
    assert (np.abs(np.diff(run.rates, axis=0)) <= panda.qdd_max * 2e-3 * (1.0 + 1e-9)).all()
