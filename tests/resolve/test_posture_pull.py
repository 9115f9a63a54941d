"""The pull to a posture: (4.9) along a trajectory, and whose memory it is."""

from collections.abc import Callable

import numpy as np
import pytest
import redundancy as rd

from tests.resolve.rates import AXIAL, F64, FANUC, TWIST, WRIST, Q


def test_posture_pull_keeps_what_it_was_given() -> None:
    pull = rd.PosturePull([1, 2, 3], k=[4, 5, 6], threshold=7.0, length=0.5)
    np.testing.assert_array_equal(pull.w, [1, 2, 3])
    assert pull.k is not None
    np.testing.assert_array_equal(pull.k, [4, 5, 6])
    assert (pull.threshold, pull.length) == (7.0, 0.5)
    assert rd.PosturePull([1]).k is None
    pull.w[0] = 9.0
    assert pull.w[0] == 1.0
    solver = rd.TwistDecomposition(FANUC, AXIAL, rd.PosturePull(np.ones(6)))
    assert isinstance(solver.objective, rd.PosturePull)
    # Without a posture given it pulls to the middle of the ranges.
    middle = 0.5 * (FANUC.q_min + FANUC.q_max)
    given_middle = rd.TwistDecomposition(FANUC, AXIAL, rd.PosturePull(np.ones(6), middle=middle))
    np.testing.assert_array_equal(solver.step(Q, TWIST), given_middle.step(Q, TWIST))


class Pull:
    """(4.9): the anchor is where w_ps (4.6) reached its threshold, forgotten below it."""

    def __init__(self, w: F64, k: F64, middle: F64, threshold: float, length: float) -> None:
        self.w, self.k, self.middle, self.threshold, self.length = w, k, middle, threshold, length
        self.anchor: F64 | None = None

    def __call__(self, robot: rd.Robot, q: F64) -> F64:
        sigma = np.linalg.svd(np.diag([self.length] * 3 + [1.0] * 3) @ robot.jacobian(q), compute_uv=False)
        parameter = min(np.sqrt(sigma[0] / sigma[5] / np.prod(sigma)), 1e6)
        h: F64 = self.w * (self.middle - q)
        if parameter >= self.threshold:
            self.anchor = q.copy() if self.anchor is None else self.anchor
            h = h + self.k * parameter * (self.anchor - q)
        else:
            self.anchor = None
        longest = np.abs(h).max()
        return h * (0.3 / longest) if longest > 0.3 else h


def walk(step: Callable[[F64, F64], F64], ticks: int, dt: float) -> F64:
    """Postures of a robot whose tool swings to and fro past the singularity of the wrist."""
    q = np.array([0.2, 0.1, -0.3, 0.4, 0.8, 0.5])
    visited = [q]
    for tick in range(ticks):
        # Joint 5 would swing between 0.8 and 0.08.
        wanted = np.array([0.1, 0.05, 0.0, 0.0, -0.36 * np.pi * np.sin(np.pi * tick * dt), 0.0])
        q = q + dt * step(q, WRIST.jacobian(q) @ wanted)
        visited.append(q)
    return np.array(visited)


@pytest.mark.parametrize("length", [1.0, 0.3])
def test_posture_pull_is_the_printed_one_along_a_trajectory(length: float) -> None:
    rng = np.random.default_rng(7)
    w, k, middle = rng.uniform(0.0, 0.1, 6), rng.uniform(0.01, 0.1, 6), rng.uniform(-0.3, 0.3, 6)
    threshold = 6.0 if length == 1.0 else 50.0
    solver = rd.TwistDecomposition(WRIST, AXIAL, rd.PosturePull(w, k, middle, threshold, length), limits=False)
    pull = Pull(w, k, middle, threshold, length)
    anchors: list[bytes | None] = []

    def printed(q: F64, t: F64) -> F64:
        J, T = WRIST.jacobian(q), AXIAL.projector(WRIST, q)
        h = pull(WRIST, q)
        anchors.append(None if pull.anchor is None else pull.anchor.tobytes())
        return np.asarray(np.linalg.solve(J, T @ t + (np.eye(6) - T) @ J @ h), np.float64)

    wanted = walk(printed, 300, 0.02)
    np.testing.assert_allclose(walk(solver.step, 300, 0.02), wanted, rtol=0, atol=1e-9)
    assert solver.step_status == "regular"
    # The threshold was crossed three times to and fro, each time with a posture of its own.
    assert len({anchor for anchor in anchors if anchor is not None}) == 3
    assert anchors[0] is None

    # The memory matters: a solver that forgets after each tick goes elsewhere.
    def forgetful(q: F64, t: F64) -> F64:
        solver.reset()
        return solver.step(q, t)

    assert np.abs(walk(forgetful, 300, 0.02) - wanted).max() > 1e-3
    # reset() makes it what it was at first.
    solver.reset()
    np.testing.assert_allclose(walk(solver.step, 300, 0.02), wanted, rtol=0, atol=1e-9)


def test_memory_belongs_to_a_solver() -> None:
    w, k = np.full(6, 0.01), np.full(6, 0.05)
    solver = rd.TwistDecomposition(WRIST, AXIAL, rd.PosturePull(w, k, threshold=1e-3), limits=False)
    other = solver.with_objective(solver.objective)
    away = Q + 0.01
    first = solver.step(Q, TWIST)
    np.testing.assert_array_equal(first, other.step(Q, TWIST))
    remembering = solver.step(away, TWIST)
    fresh = solver.with_objective(solver.objective).step(away, TWIST)
    assert np.abs(remembering - fresh).max() > 1e-4
    np.testing.assert_array_equal(other.step(away, TWIST), remembering)
    solver.reset()
    np.testing.assert_array_equal(solver.step(away, TWIST), fresh)
