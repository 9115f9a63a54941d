"""A search over spins of a six-axis arm by plain dynamic programming, and its continuous optimum by scipy."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from scipy.optimize import minimize

from .chain import F64


@dataclass(frozen=True, eq=False)
class SpinSearch:
    """A path, and what its postures and steps cost.

    Attributes
    ----------
    robot : Robot
        Six joints.
    position, axis : ndarray, shape (N, 3)
        The path.
    step_cost : callable
        Cost of the step from each posture to the next, the step's number last.
    max_step : float
        Largest motion of a joint from point to point [rad].
    """

    robot: rd.Robot
    position: F64
    axis: F64
    step_cost: Callable[[F64, F64, int], F64]
    max_step: float = 0.5

    def postures(self, point: int, spin: float) -> F64:
        """Return every posture at a point within the limits, shape (k, 6)."""
        z = self.axis[point]
        x = np.cross(z, [1.0, 0.0, 0.0])
        x /= np.linalg.norm(x)
        y = np.cross(z, x)
        frame = np.eye(4)
        frame[:3, 0] = np.cos(spin) * x + np.sin(spin) * y
        frame[:3, 1] = np.cos(spin) * y - np.sin(spin) * x
        frame[:3, 2], frame[:3, 3] = z, self.position[point]
        found = self.robot.inverse(frame)
        # Whole turns of a joint within limits, each a posture of its own.
        turns = 2.0 * np.pi * np.array([-1.0, 0.0, 1.0])[:, None] * np.eye(6)[:, None, :]
        found = np.unique((found + turns.reshape(-1, 1, 6)).reshape(-1, 6), axis=0)
        within = (found >= self.robot.q_min) & (found <= self.robot.q_max)
        return found[within.all(axis=1)]

    def grid(self, count: int) -> tuple[float, F64, F64]:
        """Return the least cost over a grid of spins, the spins and the postures of the best way."""
        spins = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        layers = []
        for point in range(len(self.position)):
            rows = [self.postures(point, spin) for spin in spins]
            layers.append((np.concatenate(rows), np.repeat(spins, [len(row) for row in rows])))
        label, back = np.zeros(len(layers[0][0])), []
        for step, ((before, _), (after, _)) in enumerate(pairwise(layers)):
            apart = np.abs(after[:, None] - before[None])
            far = (apart > self.max_step).any(axis=2)
            cost = np.full(far.shape, np.inf)
            to, origin = np.nonzero(~far)
            cost[to, origin] = self.step_cost(before[origin], after[to], step)
            cost += label
            back.append(cost.argmin(axis=1))
            label = cost.min(axis=1)
        at = [int(label.argmin())]
        for origins in reversed(back):
            at.append(int(origins[at[-1]]))
        at.reverse()
        way = list(zip(layers, at, strict=True))
        return float(label.min()), np.array([s[i] for (_, s), i in way]), np.array([q[i] for (q, _), i in way])

    def optimum(self, count: int) -> float:
        """Return the least cost over all spins, from the best way of a grid."""
        _, start, near = self.grid(count)

        def way(spins: NDArray[np.float64]) -> F64:
            rows = [self.postures(i, spin) for i, spin in enumerate(spins)]
            return np.array([row[np.abs(row - q).max(axis=1).argmin()] for row, q in zip(rows, near, strict=True)])

        def cost(spins: NDArray[np.float64]) -> float:
            q = way(spins)
            return sum(float(self.step_cost(q[i : i + 1], q[i + 1 : i + 2], i)[0]) for i in range(len(q) - 1))

        found = minimize(cost, start, method="BFGS", options={"gtol": 1e-9})
        return float(found.fun)
