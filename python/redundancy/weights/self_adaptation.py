"""Weights that tune themselves and stay the same along the path (Huo 2009, algorithm 4.1)."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .. import plots
from .._core import Robot, Task
from .._util import F64, progress_bar
from ..errors import InvalidValueError
from ..paths import Toolpath, Trajectory
from .performance import Performance, better, improvement
from .search import TOLERANCE, direct_search
from .sensitivity import Sensitivity, axis_cosines, sensitivity
from .setting import THRESHOLD, Setting, checked_weights, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PROBE = 2.0
"""Factor of a weight that is tried alone, to see what it does."""


@dataclass(frozen=True, eq=False)
class WeightRecord:
    """One run: weights w and k (n,), what they are worth, the joint that was tuned (-1 at the start), taken or not."""

    w: F64
    k: F64
    performance: Performance
    element: int
    accepted: bool


@dataclass(frozen=True, eq=False)
class WeightSearch:
    """Weights that were found, and how.

    Attributes
    ----------
    w, k : ndarray, shape (n,)
        Weights of joint limits and of singularity (5.3).
    trajectory : Trajectory
        What the robot does with them.
    performance : Performance
        What that is worth.
    sensitivity : Sensitivity
        Which weights were tuned, and why: where a caller has named the joints, its scores are means of |e_i . e_t|.
    history : list of WeightRecord
        The runs in order, the starting weights first. Each accepted one is better than the accepted one before.
    status : str
        "converged" or "runs used up".
    """

    w: F64
    k: F64
    trajectory: Trajectory
    performance: Performance
    sensitivity: Sensitivity
    history: list[WeightRecord]
    status: str

    def __repr__(self) -> str:
        return f"WeightSearch({self.status}, {len(self.history)} runs, w_ps {self.performance.singularity:.4g})"

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw how performance and weights changed from run to run.

        Parameters
        ----------
        path : path-like, optional
            Where to save the picture (``.png``, ``.svg``, ``.pdf``); nowhere if not given.

        Returns
        -------
        matplotlib.figure.Figure
            Three panels: the weights that were tuned, limit distance, singularity parameter.

        Raises
        ------
        ImportError
            If matplotlib is not installed.
        """
        runs = self.history
        w, k = np.array([run.w for run in runs]), np.array([run.k for run in runs])
        beyond = np.array([run.performance.limit_distance for run in runs])
        singularity = np.array([run.performance.singularity for run in runs])
        accepted = [run.accepted for run in runs]
        figure = plots.search_history(self.sensitivity.joints, w, k, beyond, singularity, accepted)
        return plots.saved(figure, path)


def self_adapt(
    robot: Robot,
    path: Toolpath,
    task: Task,
    w0: ArrayLike = 0.01,
    k0: ArrayLike = 0.01,
    *,
    joints: Sequence[int] | None = None,
    start: ArrayLike | None = None,
    threshold: float = THRESHOLD,
    iterations: int = 20,
    tolerance: float = TOLERANCE,
    max_runs: int = 100,
    starts: int = 1,
    progress: bool = True,
) -> WeightSearch:
    """Tune the weights of joint limits and of singularity for a path (algorithm 4.1).

    The sensitive joints are tuned one after the other, each in two dimensions, and again until a whole pass changes
    little. Which of two trajectories is better, `better` tells.

    Parameters
    ----------
    robot : Robot
        The robot, n joints, the last three of which turn.
    path : Toolpath
        The path, N points.
    task : Task
        An axisymmetric task.
    w0, k0 : array_like, shape (n,) or ()
        Weights to start from, at least 0, for no joint that is tuned both 0.
    joints : sequence of int, optional
        Joints whose weights are tuned, counted from 0, in this order (the tests of Table 5.1); those that `sensitivity`
        picks if not given.
    start : array_like, shape (n,), optional
        Posture from which the first point is reached [rad or m]; the best of some random ones if not given.
    threshold : float
        Parameter of singularity from which k acts, above 0.
    iterations : int
        Steps of the twist decomposition for each point, at least 1.
    tolerance : float
        Change of the performance that does not count, see `improvement`; at least 0.
    max_runs : int
        How often the path is followed at most for each of the ``starts``, and once more at the end; at least 1.
    starts : int
        How many starting weights are tuned side by side: the given ones, twice, half, four times them, and so on; at
        least 1. The best result is returned.
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    WeightSearch
        The best weights, their trajectory and the way there.

    Raises
    ------
    ShapeError, NonFiniteError
        If an array has the wrong shape or is not finite.
    InvalidValueError
        If a parameter is outside its domain, or robot or task do not fit.
    """
    w, k = checked_weights("w0", w0, robot.n), checked_weights("k0", k0, robot.n)
    if not 0.0 <= tolerance < np.inf:
        raise InvalidValueError(f"tolerance is {tolerance}, expected a finite number of at least 0")
    for name, count in (("max_runs", max_runs), ("starts", starts)):
        if count < 1:
            raise InvalidValueError(f"{name} is {count}, expected at least 1")
    chosen = None if joints is None else _checked_joints(joints, robot.n)
    made = setting(robot, path, task, w, k, start, threshold, iterations)
    scales = [2.0 ** (-((-1) ** i) * ((i + 1) // 2)) for i in range(starts)]
    with progress_bar(starts * max_runs, "tuning the weights", progress) as advance:
        tuners = [_Tuner(made, chosen, tolerance, max_runs, advance) for _ in scales]
        with ThreadPoolExecutor(max_workers=starts) as pool:
            jobs = [pool.submit(tuner.tune, scale * w, scale * k) for tuner, scale in zip(tuners, scales, strict=True)]
            found = [job.result() for job in jobs]
    best = found[0]
    for candidate in found[1:]:
        if better(candidate.performance, best.performance):
            best = candidate
    return best


@dataclass(eq=False)
class _Tuner:
    """The runs for one set of starting weights."""

    setting: Setting
    joints: tuple[int, ...] | None
    tolerance: float
    max_runs: int
    advance: Callable[[int], None]
    history: list[WeightRecord] = field(default_factory=list)
    runs: int = 0

    def tune(self, w: F64, k: F64) -> WeightSearch:
        first = self.setting.run(w, k)
        performance = self._judge(first)
        self.history.append(WeightRecord(w, k, performance, -1, True))
        chosen = self._choose(first.q, lambda i: self._probe(i, w, k, performance))
        for i in chosen.joints:
            if w[i] == 0.0 and k[i] == 0.0:
                raise InvalidValueError(
                    f"w0[{i}] and k0[{i}] are 0, expected one of them above 0: they are to be tuned"
                )
        status = "converged"
        while True:
            before = performance
            for element in chosen.joints:
                if self.runs >= self.max_runs:
                    status = "runs used up"
                    break
                if w[element] == 0.0 and k[element] == 0.0:
                    continue  # A search has brought both to 0, and would not know how far to step from there.
                w, k, performance = self._tune_element(element, w, k, performance)
            if status != "converged" or improvement(performance, before) < self.tolerance:
                break
        self.advance(self.max_runs - self.runs)
        return WeightSearch(w, k, self.setting.run(w, k), performance, chosen, self.history, status)

    def _choose(self, q: F64, probe: Callable[[int], float]) -> Sensitivity:
        robot, task = self.setting.robot, self.setting.task
        if self.joints is None:
            return sensitivity(robot, task, q, probe)
        mean = axis_cosines(robot, task, q).mean(axis=0)
        scores = tuple(float(mean[i]) for i in self.joints)
        return replace(sensitivity(robot, task, q), joints=self.joints, scores=scores)

    def _tune_element(self, i: int, w: F64, k: F64, known: Performance) -> tuple[F64, F64, Performance]:
        """Search w_i and k_i, the others as they are."""
        at = (float(w[i]), float(k[i]))

        def evaluate(w_i: float, k_i: float) -> Performance:
            # The search begins where the one before has ended.
            return known if (w_i, k_i) == at else self._measure(_with(w, i, w_i), _with(k, i, k_i))

        # One more than the runs that are left: the first costs none.
        found = direct_search(evaluate, *at, tolerance=self.tolerance, max_evaluations=self.max_runs - self.runs + 1)
        for step in found.history[1:]:
            self.history.append(
                WeightRecord(_with(w, i, step.w), _with(k, i, step.k), step.performance, i, step.accepted)
            )
        return _with(w, i, found.w), _with(k, i, found.k), found.performance

    def _probe(self, i: int, w: F64, k: F64, known: Performance) -> float:
        """Tell how much the performance changes with the weights of one joint alone."""
        if self.runs >= self.max_runs:
            return 0.0
        w, k = _with(w, i, PROBE * w[i]), _with(k, i, PROBE * k[i])
        changed = self._measure(w, k)
        self.history.append(WeightRecord(w, k, changed, i, False))
        return abs(improvement(changed, known))

    def _measure(self, w: F64, k: F64) -> Performance:
        return self._judge(self.setting.run(w, k))

    def _judge(self, trajectory: Trajectory) -> Performance:
        self.runs += 1
        self.advance(1)
        return Performance.of_trajectory(trajectory)


def _checked_joints(joints: Sequence[int], n: int) -> tuple[int, ...]:
    chosen = tuple(joints)
    if not chosen or len(set(chosen)) < len(chosen) or not all(i in range(n) for i in chosen):
        raise InvalidValueError(f"joints is {list(joints)}, expected different numbers from 0 to {n - 1}, at least one")
    return tuple(int(i) for i in chosen)


def _with(weights: F64, i: int, value: float) -> F64:
    changed = weights.copy()
    changed[i] = value
    changed.setflags(write=False)
    return changed
