"""Random robots, goals and terms for coordinate descent, the cost as it is defined, and what no sweep may do."""

from typing import Any

import numpy as np
import redundancy as rd

from tests.reference.chain import F64, Chain, random_frame

MONOTONE: list[dict[str, Any]] = [
    *({"algorithm": 1, "order": order} for order in ("end_to_base", "base_to_end", "double")),
    *({"algorithm": k, "weights": weights} for k in (2, 3) for weights in ("whole", "parts")),
    {"algorithm": 5},
]


class Problem:
    """A random robot with limits, a goal and terms, and the cost by forward kinematics alone."""

    def __init__(self, seed: int) -> None:
        """Draw everything."""
        rng = self.rng = np.random.default_rng(seed)
        n = int(rng.integers(1, 10))
        joints = "".join(rng.choice(["R", "R", "R", "P"], n))
        (a, d), (alpha, theta) = rng.uniform(-0.5, 0.5, (2, n)), rng.uniform(-np.pi, np.pi, (2, n))
        chain = Chain(a, d, alpha, theta, joints, base=random_frame(rng), tool=random_frame(rng))
        low, high = -rng.uniform(0.05, 5.0, n), rng.uniform(0.05, 5.0, n)
        free = (rng.random(n) < 0.3) & np.array([kind == "R" for kind in joints])
        low[free], high[free & (rng.random(n) < 0.5)] = -np.inf, np.inf
        self.robot, self.n = chain.robot().with_limits(low, high), n
        self.turns = np.array([kind == "R" for kind in joints])
        self.q0 = np.clip(rng.uniform(-3.0, 3.0, n), low, high)
        self.target = random_frame(rng) if rng.random() < 0.3 else self.robot.fk(rng.uniform(-1.0, 1.0, n))
        tilt = rng.uniform(0.05, 1.0)
        volume = rd.OrientationVolume.cone(tilt, spin=0.5 if rng.random() < 0.5 else None)
        axis = rng.normal(size=3)
        self.task, self.axis = rng.choice(4), axis / np.linalg.norm(axis)
        tasks = [rd.Task.full(), rd.Task.axisymmetric(axis), rd.Task.position(), rd.Task.within(volume)]
        self.volume = volume.reoriented(self.target[:3, :3]) if self.task == 3 else None
        self.quaternion = bool(rng.random() < 0.3) and self.task in (0, 3)
        self.w_p, self.w_o = 10 ** rng.uniform(-1, 1, 2)
        count = int(rng.integers(0, 3))
        self.points = [
            (int(rng.integers(1, n + 1)), rng.normal(size=3) / 4, rng.normal(size=3) / 2, float(rng.uniform(-0.4, 0.6)))
            for _ in range(count)
        ]
        self.centring = rng.uniform(0.0, 0.1, n) if rng.random() < 0.3 else np.zeros(n)
        self.middle = rng.uniform(-1.0, 1.0, n)
        self.settings = {
            "task": tasks[self.task],
            "w_p": self.w_p,
            "w_o": self.w_o,
            "orientation_metric": "quaternion" if self.quaternion else "frobenius",
            "points": self.points,
            "centring": self.centring,
            "middle": self.middle,
        }

    def descent(self, algorithm: int = 1, weights: Any = None, **settings: Any) -> rd.CoordinateDescent:
        """Return the package's solver."""
        if isinstance(weights, str):
            weights = self.rng.uniform(0.1, 1.0, self.n) if weights == "parts" else None
        return rd.CoordinateDescent(
            self.robot, self.target, algorithm=algorithm, weights=weights, **self.settings, **settings
        )

    def cost(self, q: F64) -> float:
        """Return the cost as it is defined."""
        frames = self.robot.link_frames(q)
        tool, c, d = frames[-1], frames[-1][:3, :3], self.target[:3, :3]
        if self.volume is not None:
            d = self.volume.nearest(c).orientation
        orientation = [((c - d) ** 2).sum(), (((c - d) @ self.axis) ** 2).sum(), 0.0, ((c - d) ** 2).sum()][self.task]
        if self.quaternion:
            angle = rd.quaternion.angle(*map(rd.quaternion.from_matrix, (c, d)))
            orientation = 4 * np.sin(angle / 4) ** 2
        cost = self.w_p * ((tool[:3, 3] - self.target[:3, 3]) ** 2).sum() + self.w_o * orientation
        for joints, at, goal, weight in self.points:
            frame = frames[joints - 1]
            cost += weight * ((frame[:3, :3] @ at + frame[:3, 3] - goal) ** 2).sum()
        off = q - self.middle
        return float(cost + (self.centring * np.where(self.turns, 1 - np.cos(off), off**2 / 2)).sum())


def uphill(problem: Problem, settings: dict[str, Any], sweeps: int = 15) -> str | None:
    """Return what is wrong with some sweeps of a monotone algorithm: a cost that rises or is another, a limit left."""
    descent = problem.descent(**settings)
    trace = descent.trace(problem.q0, sweeps)
    if (np.diff(trace.cost) > 0).any():
        return f"uphill: {np.diff(trace.cost).max():.1e}"
    if not ((trace.q >= problem.robot.q_min) & (trace.q <= problem.robot.q_max)).all():
        return "beyond a limit"
    for q, cost in zip(trace.q[::5], trace.cost[::5], strict=True):
        if abs(cost - problem.cost(q)) > 1e-12 * (1 + abs(cost)) or descent.cost(q) != cost:
            return f"a cost of {cost} for {problem.cost(q)}"
    return None


def slope_misses(problem: Problem) -> float:
    """Return how far the gradient is from differences of fourth order, relative to it."""
    q, h, slope = problem.q0, 1e-3, np.zeros(problem.n)
    for i, e in enumerate(np.eye(problem.n) * h):
        near, far = (problem.cost(q + k * e) - problem.cost(q - k * e) for k in (1, 2))
        slope[i] = (8 * near - far) / (12 * h)
    return float(np.abs(problem.descent().gradient(q) - slope).max() / (1 + np.abs(slope).max()))
