"""What counts beside the task of a quadratic programme: a posture, and tasks of other frames of the arm."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64
from tests.resolve.test_quadratic import QUICK, TASKS, TWIST, Q, posture

ELBOW = np.array([[1.0, 0, 0, 0.05], [0, 0, -1, -0.1], [0, 1, 0, 0.02], [0, 0, 0, 1.0]])
"""A frame in that of a link."""


def place(robot: rd.Robot, q: F64, link: int, frame: F64) -> F64:
    """A frame of a link in the base frame."""
    out: F64 = robot.link_frames(q)[link] @ frame
    return out


def jacobian(robot: rd.Robot, q: F64, link: int, frame: F64) -> F64:
    """The Jacobian [omega; v] of a frame of a link, by differences of second order."""
    out, h = np.zeros((6, robot.n)), 1e-6
    here = place(robot, q, link, frame)
    for i in range(robot.n):
        step = h * np.eye(robot.n)[i]
        turn = (place(robot, q + step, link, frame) - place(robot, q - step, link, frame)) / (2.0 * h)
        spin = turn[:3, :3] @ here[:3, :3].T
        out[:, i] = np.r_[spin[2, 1], spin[0, 2], spin[1, 0], turn[:3, 3]]
    return out


def projector(task: rd.Task, pose: F64) -> F64:
    """T of a task of a frame at a pose: that of an arm whose tool it is."""
    dummy = rd.Robot.from_dh([0.0], [0.0], [0.0], [0.0]).with_tool(pose)
    return task.projector(dummy, [0.0])


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("robot", ["panda", "stanford_arm"])
def test_the_minimiser_is_that_of_all_terms(robot: str, task: str) -> None:
    arm, rng, length = rd.robots.get(robot), np.random.default_rng(1), 0.4
    metric = np.diag([length**2] * 3 + [1.0] * 3)
    for _ in range(5):
        q, t, elbow, camera = posture(arm, rng), *rng.uniform(-1.0, 1.0, (3, 6))
        rest, weights = posture(arm, rng), rng.uniform(0.1, 3.0, arm.n)
        links = rng.choice(arm.n, 2)
        beside: list[rd.PostureTask | rd.FrameTask] = [
            rd.FrameTask(int(links[0]), TASKS[task], ELBOW, weight=30.0),
            rd.PostureTask(rest, weights, gain=0.7),
            rd.FrameTask(int(links[1]), rd.Task.full(), weight=5.0),
        ]
        solver = rd.QuadraticProgram(arm, TASKS[task], length=length, limits=False, stiffness=200.0, beside=beside)
        rates = solver.step(q, t, twists=[elbow, camera])
        h, g = np.eye(arm.n) + np.diag(weights), weights * 0.7 * (rest - q)
        T = TASKS[task].projector(arm, q)
        terms = [(200.0, T @ arm.jacobian(q), T @ t)]
        for weight, link, frame, what, twist in (
            (30.0, links[0], ELBOW, TASKS[task], elbow),
            (5.0, links[1], np.eye(4), rd.Task.full(), camera),
        ):
            T = projector(what, place(arm, q, link, frame))
            terms.append((weight, T @ jacobian(arm, q, link, frame), T @ twist))
        for weight, rows, wanted in terms:
            h, g = h + weight * rows.T @ metric @ rows, g + weight * rows.T @ metric @ wanted
        np.testing.assert_allclose(rates, np.linalg.solve(h, g), rtol=0, atol=1e-7 * (1.0 + np.abs(rates).max()))
        left = solver.deviations
        np.testing.assert_allclose(left[0], terms[1][2] - terms[1][1] @ rates, rtol=0, atol=1e-7)
        np.testing.assert_allclose(left[1], 0.7 * (rest - q) - rates, rtol=0, atol=1e-12)
        np.testing.assert_allclose(left[2], terms[2][2] - terms[2][1] @ rates, rtol=0, atol=1e-7)
        # Without twists the frames do not count, the posture does.
        plain = rd.QuadraticProgram(arm, TASKS[task], length=length, limits=False, stiffness=200.0, beside=beside[1:2])
        np.testing.assert_allclose(solver.step(q, t), plain.step(q, t), rtol=0, atol=1e-12)
        np.testing.assert_array_equal(solver.deviations[0], np.zeros(6))


def test_two_frames_are_held_at_once() -> None:
    # The hand goes to a point and the elbow to another that some posture has, so that both can be reached.
    there = Q + np.array([0.2, -0.15, 0.25, 0.2, -0.2, 0.1, 0.3])
    elbow = rd.FrameTask(3, rd.Task.position(), ELBOW, weight=1e5)
    solver = rd.QuadraticProgram(QUICK, rd.Task.full(), stiffness=1e5, dt=1e-2, beside=[elbow])
    hand, point, q = QUICK.fk(there), place(QUICK, there, 3, ELBOW), Q.copy()
    for _ in range(600):
        twist = 0.05 * solver.twist_to(q, hand)
        q = q + 0.01 * solver.step(q, twist, twists=[0.05 * solver.twist_to(q, point, beside=0)])
        assert solver.status != "infeasible"
    np.testing.assert_allclose(QUICK.fk(q), hand, rtol=0, atol=1e-5)
    np.testing.assert_allclose(place(QUICK, q, 3, ELBOW)[:3, 3], point[:3, 3], rtol=0, atol=1e-5)


def test_the_freedom_goes_to_the_posture_and_rests() -> None:
    rest = Q + np.array([0.3, 0.0, -0.3, 0.0, 0.2, 0.0, 0.0])
    solver = rd.QuadraticProgram(
        QUICK, rd.Task.full(), stiffness=1e6, dt=1e-2, beside=[rd.PostureTask(rest, 5.0, gain=3.0)], rate_weights=0.1
    )
    hand, q = QUICK.fk(Q), Q.copy()
    for _ in range(1500):
        rates = solver.step(q, 0.1 * solver.twist_to(q, hand))
        q = q + 0.01 * rates
    assert np.abs(rates).max() < 1e-6
    assert np.linalg.norm(QUICK.fk(q)[:3, 3] - hand[:3, 3]) < 1e-4
    # At the nearest posture: nothing of the way that is left lies in the null space.
    null = np.linalg.svd(QUICK.jacobian(q))[2][6]
    assert abs(null @ (rest - q)) < 1e-3
    assert abs(null @ (rest - Q)) > 0.05
    # Alone it is the posture that is reached.
    alone = rd.QuadraticProgram(
        QUICK, rd.Task("free", "free"), dt=1e-2, beside=[rd.PostureTask(rest, 1e3, gain=1e9)], limits=False
    )
    np.testing.assert_allclose(Q + 0.01 * alone.step(Q, np.zeros(6)), rest, rtol=0, atol=1e-3)


def test_obstacles_memory_and_python_objectives_do_not_matter() -> None:
    elbow = rd.FrameTask(3, rd.Task.position(), ELBOW)
    plain = rd.QuadraticProgram(QUICK, rd.Task.full(), beside=[elbow])
    index = rd.CustomIndex(lambda q: (0.0, np.zeros(7), np.zeros((7, 7))))
    other = rd.QuadraticProgram(QUICK, rd.Task.full(), 1.0 * index, beside=[elbow])
    for _ in range(3):
        np.testing.assert_allclose(
            plain.step(Q, TWIST, twists=[TWIST]), other.step(Q, TWIST, twists=[TWIST]), rtol=0, atol=1e-12
        )
    np.testing.assert_allclose(plain.deviations, other.deviations, rtol=0, atol=1e-12)
    plain.reset()
    assert plain.deviations == []


@pytest.mark.parametrize(
    ("beside", "error", "match"),
    [
        ([rd.PostureTask(Q[:6])], rd.ShapeError, "posture"),
        ([rd.PostureTask(Q, np.ones(6))], rd.ShapeError, "weight"),
        ([rd.PostureTask(Q, -1.0)], rd.InvalidValueError, "weight"),
        ([rd.PostureTask(Q, 1.0, np.nan)], rd.InvalidValueError, "gain"),
        ([rd.PostureTask(Q * np.nan)], rd.NonFiniteError, "posture"),
        ([rd.FrameTask(7, rd.Task.full())], rd.InvalidValueError, "link"),
        ([rd.FrameTask(2, rd.Task.full(), weight=0.0)], rd.InvalidValueError, "weight"),
        ([Q], rd.InvalidValueError, "beside"),
    ],
)
def test_bad_tasks(beside: Any, error: type[Exception], match: str) -> None:
    with pytest.raises(error, match=match):
        rd.QuadraticProgram(QUICK, rd.Task.full(), beside=beside)


def test_bad_calls() -> None:
    with pytest.raises(rd.InvalidValueError, match="orthogonal"):
        rd.FrameTask(2, rd.Task.full(), 2.0 * np.eye(4) - np.diag([0, 0, 0, 1.0]))
    with pytest.raises(rd.ShapeError, match="frame"):
        rd.FrameTask(2, rd.Task.full(), np.eye(3))
    beside: list[rd.PostureTask | rd.FrameTask] = [rd.PostureTask(Q), rd.FrameTask(2, rd.Task.position())]
    solver = rd.QuadraticProgram(QUICK, rd.Task.full(), beside=beside)
    for wrong in (np.zeros(6), np.zeros((2, 6)), np.zeros((1, 5))):
        with pytest.raises(rd.ShapeError, match="twists"):
            solver.step(Q, TWIST, twists=wrong)
    with pytest.raises(rd.NonFiniteError, match="twists"):
        solver.step(Q, TWIST, twists=np.full((1, 6), np.nan))
    for k in (0, 2):
        with pytest.raises(rd.InvalidValueError, match="beside"):
            solver.twist_to(Q, QUICK.fk(Q), beside=k)
    with pytest.raises(rd.ShapeError, match=r"\(3,\) or \(4, 4\)"):
        solver.twist_to(Q, np.zeros(6), beside=1)
    assert rd.QuadraticProgram(QUICK, rd.Task.full(), beside=[]).deviations == []
