"""The methods at the level of rates along a path and onto a target."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.resolve.rates import AXIAL, F64, METHODS, TORCH, Q, circle

START = np.array([0.3, 0.4, -0.5, 0.6, 0.9, 0.2])


@pytest.mark.parametrize("name", METHODS)
def test_follow(name: str) -> None:
    path = circle()
    solver = METHODS[name](TORCH, AXIAL, rd.JointLimits(), relaxation=0.1)
    trajectory = rd.follow(solver, path, progress=False)
    assert trajectory.q.shape == (60, 6)
    assert trajectory.unreachable == []
    assert set(trajectory.status) == {"on target"}
    poses = TORCH.fk(trajectory.q)
    # Iterations end below 1e-12; products of frames add a few roundings of numbers up to 2.
    np.testing.assert_allclose(poses[:, :3, 3], path.position, rtol=0, atol=1e-11)
    np.testing.assert_allclose(poses[:, :3, 2], path.axis, rtol=0, atol=1e-11)
    if name == "ResolvedRate":
        assert path.rotation is not None
        assert solver.task == rd.Task.full()
        np.testing.assert_allclose(poses[:, :3, :3], path.rotation, rtol=0, atol=1e-11)
    index = rd.JointLimits().evaluate_many(TORCH, trajectory.q, 0)[0]
    np.testing.assert_allclose(trajectory.value, index, rtol=1e-12)


@pytest.mark.parametrize("name", METHODS)
def test_follow_without_correction(name: str) -> None:
    path = circle()
    solver = METHODS[name](TORCH, AXIAL, rd.JointLimits(), relaxation=0.1, correct=False, iterations=5)
    start = METHODS[name](TORCH, AXIAL).solve(path.targets(solver.task)[0])[0]
    trajectory = rd.follow(solver, path, start, progress=False)
    assert trajectory.iterations == 5 * 60
    # The last motion d spoils what is of second order: at most half of (sum |d|)^2 times the longest arm, here 3 m. At
    # the point reached it is less, but not by half.
    still = METHODS[name](TORCH, AXIAL, rd.JointLimits(), gain=0.1, limits=False)
    last = np.array([np.abs(still.step(q, np.zeros(6))).sum() for q in trajectory.q])
    worst = np.maximum(trajectory.position_error, trajectory.axis_error)
    assert (worst <= 0.5 * 3.0 * (2.0 * last) ** 2 + 1e-9).all()
    assert trajectory.unreachable == np.flatnonzero(worst > 1e-9).tolist()
    errors = np.linalg.norm(TORCH.fk(trajectory.q)[:, :3, 3] - path.position, axis=1)
    np.testing.assert_allclose(trajectory.position_error, errors, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", METHODS)
def test_stop_of_algorithm_3_1(name: str) -> None:
    """Lines 9 to 11: the first motion shorter than epsilon ends the iterations and is not made."""
    pull, epsilon = rd.PosturePull(np.full(6, 0.1)), 1e-3
    target = circle().targets(METHODS[name](TORCH, AXIAL).task)[0]

    def after(iterations: int, **stop: float) -> Any:
        solver = METHODS[name](TORCH, AXIAL, pull, iterations=iterations, correct=False, **stop)
        return solver.solve(target, START)

    q = np.stack([START, *(after(i).q for i in range(1, 120))])
    motions = np.linalg.norm(np.diff(q, axis=0), axis=1)
    short = int(np.argmax(motions < epsilon))
    assert motions[short] < epsilon <= motions[:short].min()
    found = after(119, stop=epsilon)
    # The motion that was too short counts as an iteration: it had to be found.
    assert found.iterations == short + 1
    np.testing.assert_allclose(found.q, q[short], rtol=0, atol=1e-13)
    # Where no motion is so short, and without a stop, all of them are made.
    assert after(short, stop=epsilon).iterations == short
    assert after(119, stop=0.0).iterations == after(119).iterations == 119


def test_corrections_follow_a_stop() -> None:
    pull, target = rd.PosturePull(np.full(6, 0.1)), circle().targets()[0]
    found = rd.TwistDecomposition(TORCH, AXIAL, pull, iterations=500, stop=0.05).solve(target, START)
    assert found.status == "on target"
    assert found.iterations < 60


def test_gain_is_for_step_and_relaxation_for_iterations() -> None:
    index, target = rd.JointLimits(), circle().targets()[0]
    start = rd.TwistDecomposition(TORCH, AXIAL).solve(target)[0]

    def moved(gain: float, relaxation: float) -> tuple[F64, F64]:
        settings: dict[str, Any] = {"gain": gain, "relaxation": relaxation, "limits": False}
        solver = rd.TwistDecomposition(TORCH, AXIAL, index, **settings, iterations=1, correct=False)
        return solver.step(start, np.zeros(6)), solver.solve(target, start)[0] - start

    (step, iteration), (half, same), (again, quarter) = moved(0.4, 0.4), moved(0.2, 0.4), moved(0.4, 0.1)
    # On target one iteration is one step. The target is met to 1e-12, and a difference of joints costs a few roundings.
    np.testing.assert_allclose(iteration, step, rtol=0, atol=1e-10)
    np.testing.assert_allclose(half, 0.5 * step, rtol=1e-12)
    np.testing.assert_allclose(quarter, 0.25 * iteration, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(same, iteration)
    np.testing.assert_array_equal(again, step)


def test_secondary_task_lowers_the_objective_along_a_path() -> None:
    path, start = circle(), rd.follow(rd.ResolvedRate(TORCH, AXIAL), circle(), progress=False).q[0]
    index = rd.JointLimits()
    none = rd.follow(rd.TwistDecomposition(TORCH, AXIAL), path, start, progress=False)
    least = rd.follow(rd.OrthogonalSQP(TORCH, AXIAL, index), path, start, progress=False)
    for name in ("TwistDecomposition", "GradientProjection", "Householder", "Elimination", "VirtualJoint"):
        some = rd.follow(METHODS[name](TORCH, AXIAL, index, relaxation=0.1), path, start, progress=False)
        # Towards the pointwise minimum, never below it.
        assert (some.value >= least.value - 1e-9).all()
        assert some.value[-1] < index.evaluate(TORCH, none.q[-1], 0)
        assert some.value[-1] == pytest.approx(least.value[-1], abs=0.05)
    assert np.isnan(none.value).all()


def test_solve() -> None:
    target = np.r_[1.2, 0.1, 0.3, 0.0, 0.0, -1.0]
    solver = rd.TwistDecomposition(TORCH, AXIAL, rd.JointLimits(), relaxation=0.1)
    q, value, status, iterations = solver.solve(target)
    assert status == "on target"
    assert iterations >= 20
    assert value == rd.JointLimits().evaluate(TORCH, q, 0)
    assert ((TORCH.q_min <= q) & (q <= TORCH.q_max)).all()
    np.testing.assert_allclose(TORCH.fk(q)[:3, 2:], np.stack([target[3:], target[:3]], axis=1), rtol=0, atol=1e-11)
    np.testing.assert_array_equal(solver.solve(target, seed=0)[0], q)
    far, value, status, _ = solver.solve([9.0, 0, 0, 0, 0, -1.0])
    assert status == "unreachable"
    assert np.isnan(far).all()
    assert np.isnan(value)
    near, _, status, _ = solver.solve([9.0, 0, 0, 0, 0, -1.0], Q)
    assert status == "unreachable"
    assert np.isfinite(near).all()
