"""Direct search for one weight of each kind (Huo 2009, section 5.3.4, Fig. 5.2)."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain, cycle

import numpy as np

from ..errors import InvalidValueError
from .performance import NEAR, SINGULARITY_CONSTANT, Performance, improvement

SHRINK = 0.4
"""Factor of a finer step: it is reduced by 60 %."""

PATIENCE = 3
"""Changes below the tolerance in a row that end the search (algorithm 4.1, step 7)."""

TOLERANCE = 1e-3
"""Change of the performance that does not count, unless a caller says otherwise."""

Evaluate = Callable[[float, float], Performance]


@dataclass(frozen=True)
class SearchStep:
    """One evaluation: the two weights, what they are worth, the direction tried and whether the step was taken."""

    w: float
    k: float
    performance: Performance
    direction: str
    accepted: bool


@dataclass(frozen=True)
class SearchResult:
    """What a search has found.

    Attributes
    ----------
    w, k : float
        The best weights.
    performance : Performance
        What they are worth.
    history : list of SearchStep
        Every evaluation in order, the starting point first. Each accepted one is better than the accepted one before.
    status : str
        "converged" (little change along three directions in a row), or "evaluations used up".
    """

    w: float
    k: float
    performance: Performance
    history: list[SearchStep]
    status: str


def direct_search(
    evaluate: Evaluate,
    w: float,
    k: float,
    *,
    tolerance: float = TOLERANCE,
    min_step: float | None = None,
    max_evaluations: int = 60,
    constant: float = SINGULARITY_CONSTANT,
    near: float = NEAR,
) -> SearchResult:
    """Search two weights, first both by equal steps (d1), then k alone (d2), w alone (d3), d2, d3 and so on.

    Along a direction steps are taken as long as they make the performance better, never to a point that was tried. The
    first step is the mean of the two weights; where neither a step forward nor one back helps, it shrinks by 60 %,
    until it is below ``min_step`` or three steps in a row changed little. A step never makes a weight negative: it ends
    at 0.

    Parameters
    ----------
    evaluate : callable
        Takes w and k, returns a `Performance`.
    w, k : float
        Where to start, at least 0, not both 0 (the first step would have no length).
    tolerance : float
        Change of the performance, as `improvement` measures it, that does not count; at least 0.
    min_step : float, optional
        Shortest step, above 0; a hundredth of the mean of ``w`` and ``k`` if not given.
    max_evaluations : int
        How often ``evaluate`` is called at most, at least 1.
    constant, near : float
        Parameters k and near of `improvement`.

    Returns
    -------
    SearchResult
        The best weights found. The search finds the minimum of a surface that is smooth and convex in the chosen
        criterion; elsewhere it finds a point from where no step along an axis helps.

    Raises
    ------
    InvalidValueError
        If a parameter is outside its domain.

    Notes
    -----
    The thesis steps forward only; back is tried here too, for otherwise a weight could never decrease. As `improvement`
    is no order, a point that was left could be better than the best again, and the search go round in circles.
    """
    step = _checked(w, k, tolerance, min_step, max_evaluations)
    search = _Search(evaluate, max_evaluations, constant, near, tolerance)
    search.begin(float(w), float(k))
    quiet = 0
    for name, direction in chain([("d1", (1.0, 1.0))], cycle([("d2", (0.0, 1.0)), ("d3", (1.0, 0.0))])):
        before = search.best
        gain = search.line(name, direction, step)
        quiet = quiet + 1 if gain < tolerance or search.best is before else 0
        if quiet == PATIENCE or search.exhausted:
            break
    best = search.best
    status = "evaluations used up" if search.exhausted and quiet < PATIENCE else "converged"
    return SearchResult(best.w, best.k, best.performance, search.history, status)


def _checked(w: float, k: float, tolerance: float, min_step: float | None, max_evaluations: int) -> float:
    for name, value in (("w", w), ("k", k), ("tolerance", tolerance)):
        if not 0.0 <= value < np.inf:
            raise InvalidValueError(f"{name} is {value}, expected a finite number of at least 0")
    if w == 0.0 and k == 0.0:
        raise InvalidValueError("w and k are 0, expected one of them above 0 to take the length of the first step from")
    if max_evaluations < 1:
        raise InvalidValueError(f"max_evaluations is {max_evaluations}, expected at least 1")
    if min_step is None:
        return 0.005 * (float(w) + float(k))
    if not 0.0 < min_step < np.inf:
        raise InvalidValueError(f"min_step is {min_step}, expected a finite number above 0")
    return float(min_step)


class _Search:
    """The state of a search: what was evaluated, and the best so far."""

    def __init__(self, evaluate: Evaluate, most: int, constant: float, near: float, tolerance: float) -> None:
        self._evaluate, self._most = evaluate, most
        self._constant, self._near, self._tolerance = constant, near, tolerance
        self._known: set[tuple[float, float]] = set()
        self.history: list[SearchStep] = []
        self.best: SearchStep
        self.exhausted = False

    def begin(self, w: float, k: float) -> None:
        self._known.add((w, k))
        self.best = SearchStep(w, k, self._evaluate(w, k), "start", True)
        self.history.append(self.best)

    def line(self, name: str, direction: tuple[float, float], shortest: float) -> float:
        """Search along a direction, finer and finer; return the gain altogether."""
        step = max(0.5 * (self.best.w + self.best.k), shortest)
        total, quiet = 0.0, 0
        while step >= shortest and quiet < PATIENCE and not self.exhausted:
            for sign in (1.0, -1.0):
                moved = False
                while quiet < PATIENCE:
                    gain = self._try(name, direction, sign * step)
                    if gain is None:
                        break
                    quiet = quiet + 1 if abs(gain) < self._tolerance else 0
                    if not gain > 0.0:
                        break
                    moved, total = True, total + gain
                if moved or self.exhausted:
                    break
            step *= SHRINK
        return total

    def _try(self, name: str, direction: tuple[float, float], step: float) -> float | None:
        """Evaluate a step from the best point; return its gain, or None if there is nothing to try."""
        w = max(self.best.w + step * direction[0], 0.0)
        k = max(self.best.k + step * direction[1], 0.0)
        if (w, k) in self._known:
            return None
        if len(self._known) >= self._most:
            self.exhausted = True
            return None
        self._known.add((w, k))
        performance = self._evaluate(w, k)
        gain = improvement(performance, self.best.performance, self._constant, self._near)
        taken = SearchStep(w, k, performance, name, gain > 0.0)
        self.history.append(taken)
        if taken.accepted:
            self.best = taken
        return gain
