"""Weights that adapt themselves along the path (Huo 2009, algorithm 6.1)."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from .. import plots
from .._core import Robot, Task
from .._util import F64, progress_bar
from ..errors import InvalidValueError
from ..loops import follow
from ..paths import Toolpath, Trajectory
from .criteria import Criteria, Failure, Problem
from .dynamic_weights import WeightFunctions
from .performance import Performance
from .pointwise import PointwiseSolver
from .setting import DEFAULT_WEIGHT, THRESHOLD, Setting, setting

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHANGE = 0.25
"""First change of a damping scalar."""

SMALLEST_CHANGE = 0.03
"""Where a change does not help, half of it is tried, down to this."""

MOVES: dict[Problem, tuple[tuple[int, float], ...]] = {
    "joint limits": ((0, 1.0),),
    "singularity": ((1, 1.0),),
    "speed": ((1, -1.0), (0, -1.0)),
}
"""What is done about a problem (the principles of section 6.2.4): 0 stands for c_joint, 1 for c_sing; and its sign."""


@dataclass(frozen=True, eq=False)
class Round:
    """One run: damping scalars c_joint and c_sing (N,), what they are worth, where they fail, whether it was kept."""

    c_joint: F64
    c_sing: F64
    performance: Performance
    failure: Failure
    accepted: bool


@dataclass(frozen=True, eq=False)
class DynamicAdaptation:
    """Weights along a path, and how they were found.

    Attributes
    ----------
    w, k : ndarray, shape (N, n)
        Weights of joint limits (6.7) and of singularity (6.8) at each point.
    c_joint, c_sing : ndarray, shape (N,)
        Damping scalars.
    trajectory : Trajectory
        What the robot does with them.
    performance : Performance
        What that is worth.
    history : list of Round
        The runs in order, the first with c_joint = c_sing = 0 (6.13), (6.14).
    status : str
        "fulfilled", "stalled" (no change of a damping scalar helps any more) or "rounds used up".
    """

    w: F64
    k: F64
    c_joint: F64
    c_sing: F64
    trajectory: Trajectory
    performance: Performance
    history: list[Round]
    status: str

    def __repr__(self) -> str:
        return f"DynamicAdaptation({self.status}, {len(self.history)} rounds, w_ps {self.performance.singularity:.4g})"

    def plot(self, path: str | Path | None = None) -> "Figure":
        """Draw the weights of the last three joints and the damping scalars along the path.

        Parameters
        ----------
        path : path-like, optional
            Where to save the picture (``.png``, ``.svg``, ``.pdf``); nowhere if not given.

        Returns
        -------
        matplotlib.figure.Figure
            Three panels with one abscissa.

        Raises
        ------
        ImportError
            If matplotlib is not installed.
        """
        figure = plots.weights_along_path(self.trajectory.time, self.w, self.k, self.c_joint, self.c_sing)
        return plots.saved(figure, path)


def dynamic_adapt(
    robot: Robot,
    path: Toolpath,
    task: Task,
    *,
    q: float = 0.01,
    m: float = 0.25,
    l: float = 1.0,  # noqa: E741 - the name in (6.11)
    s: float = 1.0,
    beta_threshold: float = 0.5 * np.pi,
    criteria: Criteria | None = None,
    period: float = 0.1,
    start: ArrayLike | None = None,
    threshold: float = THRESHOLD,
    iterations: int = 20,
    max_rounds: int = 20,
    progress: bool = True,
) -> DynamicAdaptation:
    """Follow a path with weights that depend on the posture, and adapt them where the trajectory fails (algorithm 6.1).

    At the critical instant, where the trajectory fails worst, c_joint is raised against joint limits, c_sing against a
    singularity, and one of them is lowered against high speeds. The change is greatest there and fades as a raised
    cosine. It is kept where the trajectory becomes better: fewer points out of reach, then less beyond the limits, then
    farther from singularities, then slower. Otherwise half of it is tried, then what else may help.

    Parameters
    ----------
    robot : Robot
        The robot, n joints, the last three of which turn.
    path : Toolpath
        The path, N points.
    task : Task
        An axisymmetric task.
    q, m, l, s, beta_threshold : float
        Parameters of `WeightFunctions`.
    criteria : Criteria, optional
        What has to be fulfilled.
    period : float
        How far a change reaches to either side of the critical instant, as a share of the whole time (of the points of
        a path without times), above 0, at most 1. The thesis says 0.1 to 0.2.
    start : array_like, shape (n,), optional
        Posture from which the first point is reached [rad or m]; the best of some random ones if not given.
    threshold : float
        Parameter of singularity from which k acts, above 0.
    iterations : int
        Steps of the twist decomposition for each point, at least 1.
    max_rounds : int
        How often the path is followed at most, at least 1.
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    DynamicAdaptation
        The best round.

    Raises
    ------
    ShapeError, NonFiniteError
        If an array has the wrong shape or is not finite.
    InvalidValueError
        If a parameter is outside its domain, or robot or task do not fit.

    Notes
    -----
    The thesis changes the damping scalars by steps that begin and end at once, and by hand. By (3.8) a weight brings
    its joint back only where e_i . e_t and the joint's motion with the spin have one sign; elsewhere it drives it out.
    """
    functions = WeightFunctions(q, m, l, s, beta_threshold)
    if max_rounds < 1:
        raise InvalidValueError(f"max_rounds is {max_rounds}, expected at least 1")
    if not 0.0 < period <= 1.0:
        raise InvalidValueError(f"period is {period}, expected a number above 0, at most 1")
    first = np.full(robot.n, DEFAULT_WEIGHT)
    made = setting(robot, path, task, first, first, start, threshold, iterations)
    adapter = _Adapter(made, functions, Criteria() if criteria is None else criteria, period)
    with progress_bar(max_rounds, "adapting the weights", progress) as advance:
        adapter.run(np.zeros((2, len(path))))
        advance(1)
        while len(adapter.history) < max_rounds and adapter.adapt():
            advance(1)
    return adapter.result()


class _Adapter:
    """The rounds of an adaptation: the best so far, and what to try next."""

    def __init__(self, setting: Setting, functions: WeightFunctions, criteria: Criteria, period: float) -> None:
        self._setting, self._functions, self._criteria, self._period = setting, functions, criteria, period
        self.history: list[Round] = []
        self._best: Round
        self._found: tuple[F64, F64, Trajectory]
        self._move, self._change = 0, CHANGE

    def run(self, c: F64) -> bool:
        """Follow the path with damping scalars (2, N); return whether that is better than the best so far."""
        solver = PointwiseSolver(self._setting, self._functions, c[0], c[1])
        trajectory = follow(solver, self._setting.path, self._setting.start, progress=False)
        failure = self._criteria.check(trajectory)
        kept = not self.history or failure.less_than(self._best.failure)
        self.history.append(Round(c[0], c[1], Performance.of_trajectory(trajectory), failure, kept))
        if kept:
            self._best, self._found = self.history[-1], (solver.w, solver.k, trajectory)
        return kept

    def adapt(self) -> bool:
        """Try one change; return False where there is nothing to change, or nothing left that may help."""
        moves = self._moves()
        if self._move == len(moves):
            return False
        instant, which, sign = moves[self._move]
        c = np.stack([self._best.c_joint, self._best.c_sing])
        c[which] += sign * self._change * self._window(instant)
        if self.run(c):
            self._move, self._change = 0, CHANGE
        else:
            self._change *= 0.5
            if self._change < SMALLEST_CHANGE:
                self._move, self._change = self._move + 1, CHANGE
        return True

    def _moves(self) -> list[tuple[int, int, float]]:
        """Return what may help: the instant, which damping scalar, and the sign of its change."""
        instants = self._best.failure.instants
        return [(instant, which, sign) for problem, instant in instants.items() for which, sign in MOVES[problem]]

    def _window(self, instant: int) -> F64:
        """Return 1 at an instant, falling to 0 within the period to either side."""
        time = self._setting.path.time
        x = np.arange(len(self._setting.path), dtype=np.float64) if time is None else time
        reach = max(self._period * (x[-1] - x[0]), np.finfo(np.float64).tiny)
        distance = np.minimum(np.abs(x - x[instant]) / reach, 1.0)
        window: F64 = 0.5 + 0.5 * np.cos(np.pi * distance)
        return window

    def result(self) -> DynamicAdaptation:
        best, (w, k, trajectory) = self._best, self._found
        if not best.failure.instants and not best.failure.unreachable:
            status = "fulfilled"
        else:
            status = "stalled" if self._move == len(self._moves()) else "rounds used up"
        return DynamicAdaptation(w, k, best.c_joint, best.c_sing, trajectory, best.performance, self.history, status)
