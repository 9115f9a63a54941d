"""Random arms of six revolute joints, by what their axes have in common, and a search for their postures."""

import itertools

import numpy as np
from redundancy import Robot

from tests.reference.chain import F64, Chain, random_frame

TWO_PI = 2.0 * np.pi
PLACES = {"wrist": 4, "parallel": 4, "general": 1}
"""Where along the chain three neighbouring axes may be what the name says."""

_REGULAR = 1e-3
"""Median of the smallest singular value below which a drawn arm lacks a direction everywhere and is drawn again."""


def random_arm(rng: np.random.Generator, kind: str, place: int = 0) -> Chain:
    """Return an arm whose axes `place` to `place + 2` meet in a point or are parallel, or any arm.

    `kind` is "wrist", "parallel" or "general". Lengths are below 0.5 m. Right angles and zeros are common beside
    generic numbers, but for "general".
    """
    while True:
        a, d = rng.uniform(-0.5, 0.5, (2, 6))
        alpha, theta = rng.uniform(-np.pi, np.pi, (2, 6))
        if kind != "general":
            for lengths in (a, d):
                lengths[rng.random(6) < 0.3] = 0.0
            right = rng.random(6) < 0.5
            alpha[right] = rng.integers(-1, 3, int(right.sum())) * np.pi / 2
        if kind == "wrist":
            a[place : place + 2], d[place + 1] = 0.0, 0.0
            if np.abs(np.sin(alpha[place : place + 2])).min() < 0.3:
                continue
        elif kind == "parallel":
            alpha[place : place + 2] = rng.integers(0, 2, 2) * np.pi
            if np.abs(a[place : place + 2]).min() < 0.05:
                continue
        chain = Chain(a, d, alpha, theta, "RRRRRR", base=random_frame(rng), tool=random_frame(rng))
        jacobians = chain.robot().jacobian(rng.uniform(-np.pi, np.pi, (25, 6)))
        if np.median(np.linalg.svd(jacobians, compute_uv=False)[:, -1]) > _REGULAR:
            return chain


def distance(solutions: F64, q: F64) -> F64:
    """Return how far each solution is from a posture [rad], whole turns apart: the largest joint."""
    apart = solutions - q
    largest: F64 = np.abs(apart - TWO_PI * np.round(apart / TWO_PI)).max(axis=-1, initial=0.0)
    return largest


def smallest_singular_value(robot: Robot, q: F64) -> F64:
    """Return the smallest singular value of the Jacobian in SI units, of one posture or of each."""
    return np.asarray(np.linalg.svd(robot.jacobian(q), compute_uv=False)[..., -1], dtype=np.float64)


def pose_error(wanted: F64, got: F64) -> F64:
    """Return rotation vectors and differences in place from `got` to `wanted`, (N, 6)."""
    turn = wanted[:, :3, :3] @ got[:, :3, :3].transpose(0, 2, 1)
    axis = 0.5 * np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], 1
    )
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0))
    factor = np.where(sine > 1e-8, angle / np.maximum(sine, 1e-300), 1.0)
    return np.hstack([axis * factor[:, None], wanted[:, :3, 3] - got[:, :3, 3]])


def search(robot: Robot, poses: F64, starts: F64, rounds: int = 80) -> list[F64]:
    """Return the distinct postures that damped Newton searches end in, for each of N poses; starts (N, m, 6).

    No geometry of the arm is used but the Jacobian. Postures at singularities, where the search converges slowly if at
    all, are left out.
    """
    count, each = starts.shape[:2]
    q, wanted = starts.reshape(-1, 6).copy(), np.repeat(poses, each, axis=0)
    running, closed = np.arange(len(q)), np.zeros(len(q), dtype=bool)
    for _ in range(rounds):
        error = pose_error(wanted[running], robot.fk(q[running]))
        size = np.abs(error).max(axis=1)
        closed[running] = size < 1e-13
        running, error, size = running[size >= 1e-13], error[size >= 1e-13], size[size >= 1e-13]
        if not running.size:
            break
        j = robot.jacobian(q[running])
        transposed = j.transpose(0, 2, 1)
        damping = np.minimum(1e-2, size**2)[:, None, None] * np.eye(6) + 1e-13 * np.eye(6)
        step = (transposed @ np.linalg.solve(j @ transposed + damping, error[:, :, None]))[:, :, 0]
        q[running] += step * np.minimum(1.0, 0.7 / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
    closed |= np.abs(pose_error(wanted, robot.fk(q))).max(axis=1) < 1e-11
    closed &= smallest_singular_value(robot, q) > 1e-4
    found = []
    for i in range(count):
        distinct: list[F64] = []
        for row in q[i * each : (i + 1) * each][closed[i * each : (i + 1) * each]]:
            if not distinct or distance(np.array(distinct), row).min() > 1e-6:
                distinct.append(row)
        found.append(np.array(distinct).reshape(-1, 6))
    return found


def angles(rng: np.random.Generator, *shape: int) -> F64:
    """Return joint angles between -pi and pi."""
    return rng.uniform(-np.pi, np.pi, shape)


def check_solutions(robot: Robot, pose: F64, solutions: F64) -> None:
    """Every solution takes the tool to the pose, and none comes twice."""
    assert solutions.dtype == np.float64
    assert solutions.shape == (len(solutions), robot.n)
    if len(solutions):
        assert np.abs(pose_error(np.broadcast_to(pose, (len(solutions), 4, 4)), robot.fk(solutions))).max() < 1e-9
    for one, other in itertools.combinations(solutions, 2):
        assert distance(one, other) > 1e-7
