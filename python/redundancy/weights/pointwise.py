"""Following a path with weights that vary from point to point (Huo 2009, section 6.2)."""

import numpy as np
from numpy.typing import ArrayLike

from .._core import (
    Manipulability,
    Objective,
    PathSolution,
    PosturePull,
    RateSolver,
    Robot,
    SingularityParameter,
    Solution,
    Task,
)
from .._util import F64
from ..loops import joined
from .dynamic_weights import WeightFunctions
from .performance import limit_distances
from .sensitivity import axis_cosines
from .setting import Setting


class PointwiseSolver:
    """A solver for `follow` whose weights depend on the posture at the point before.

    Once the parameter of singularity passes the threshold, the posture q_Ts is kept from point to point until it falls
    below. The two pulls of (4.9), W (middle - q) + K w_ps (q_Ts - q), are handed over as one, with w_ps of the point
    before: its weights are W + K w_ps, its middle is the mean of both postures with these weights. It never pulls
    further than to that mean: weights above 1 would overshoot it, and with k = m = 0.25 of (6.10) they are where
    w_ps > 4.
    """

    def __init__(self, setting: Setting, functions: WeightFunctions, c_joint: F64, c_sing: F64) -> None:
        robot = setting.robot
        self.w, self.k = np.zeros((2, len(setting.path), robot.n))
        self.held = np.full((len(setting.path), robot.n), np.nan)
        self._setting, self._functions = setting, functions
        self._c_joint, self._c_sing = c_joint, c_sing
        self._middle = robot.middle
        rows = robot.rows_in_use()
        self._singularity = SingularityParameter(1.0, rows=rows)
        self._manipulability = Manipulability(1.0, rows=rows)
        self._held: F64 | None = None
        self._point = 0
        self._solver: RateSolver = setting.solver(PosturePull(np.zeros(robot.n)))

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self._setting.robot

    @property
    def task(self) -> Task:
        """The task."""
        return self._setting.task

    @property
    def objective(self) -> Objective | PosturePull | None:
        """The pull at the last point."""
        return self._solver.objective

    def solve(self, target: ArrayLike, q0: ArrayLike | None = None, starts: int = 24, seed: int = 0) -> Solution:
        """Find a posture on a target."""
        return self._solver.solve(target, q0, starts, seed)

    def follow_chunk(self, targets: ArrayLike, q0: ArrayLike) -> PathSolution:
        """Follow the next targets of the path from a posture, one by one."""
        q = np.asarray(q0, dtype=np.float64)
        parts = []
        for target in np.asarray(targets, dtype=np.float64):
            self._solver = self._solver.with_objective(self._pull(q))
            parts.append(self._solver.follow_chunk(target[None], q))
            q = parts[-1].q[-1]
        return joined(parts)

    def _pull(self, q: F64) -> PosturePull:
        """Set the weights of the next point and return what pulls there."""
        robot, point = self.robot, self._point
        self._point += 1
        w, k = self._functions.weights(
            axis_cosines(robot, self.task, q[None])[0],
            limit_distances(robot, q),
            self._manipulability.evaluate(robot, q, 0),
            float(self._c_joint[point]),
            float(self._c_sing[point]),
        )
        self.w[point], self.k[point] = w, k
        singularity = self._singularity.evaluate(robot, q, 0)
        if singularity < self._setting.threshold:
            self._held = None
            return PosturePull(np.minimum(w, 1.0), middle=self._middle)
        if self._held is None:
            self._held = q
        self.held[point] = self._held
        # Beyond 1 / eps a pull to q_Ts is all there is, and infinity times 0 must not become NaN.
        held = k * min(singularity, 1.0 / np.finfo(np.float64).eps)
        both = w + held
        share = np.divide(held, both, out=np.zeros_like(both), where=both > 0.0)
        return PosturePull(np.minimum(both, 1.0), middle=self._middle + share * (self._held - self._middle))
