"""From a route to the continuous optimum of a stretch of the path."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from ._core import refine_path
from ._path_frames import point_weights, shares
from ._plan_result import PlanFailure
from ._plan_setup import ON_PATH, Points, Setup
from ._util import F64
from .errors import InvalidValueError
from .maps import Predicate
from .paths import Trajectory

_PROVEN: Final = 1e-7
"""A worst value this near to its lower bound, relative, is the least."""
_TIE: Final = 1e-7
"""Costs this near to each other, relative, are equal: the lesser motion wins."""


_TRIAL: Final = 40
"""Newton steps that are enough unless a path creeps."""
_STEADY: Final = 1e-3
"""Weight of the motion beside the mean, relative, where that is a start for a worst value."""
_SLOW: Final = 0.8
"""Share of the largest step below which a route is refined without it."""


@dataclass
class Part:
    """What is known of a stretch of the path."""

    first: int
    q: F64
    value: F64
    cost: float
    motion: float
    residual: float
    smoothness: float
    refined: bool
    failure: PlanFailure | None = None

    @property
    def worst(self) -> float:
        """Largest value."""
        return float(self.value.max())

    def is_at(self, bound: float) -> bool:
        """Return whether this is an optimum whose worst value is at a lower bound."""
        return self.refined and self.failure is None and self.worst <= bound * (1.0 + _PROVEN)


def refined_part(setup: Setup, points: Points, q: F64, feasible: Predicate | None) -> Part:
    """Refine postures of neighbouring points; keep them as they are where that fails."""
    part = tried_part(setup, points, q, feasible)
    if part.refined or part.failure is not None or setup.max_iterations <= _TRIAL:
        return part
    return best_part(setup, [part, _refined_once(setup, points, part.q, feasible)])


def tried_part(setup: Setup, points: Points, q: F64, feasible: Predicate | None) -> Part:
    """Refine postures of neighbouring points, with a few steps only.

    A worst value that creeps is tried again from the optimum of the mean, which is next to it and reached at once.
    """
    setup = replace(setup, max_iterations=min(_TRIAL, setup.max_iterations))
    part = _refined_once(setup, points, q, feasible)
    if setup.criterion == "minimax" and not part.refined and part.failure is None:
        smoothness = _STEADY * float(np.abs(part.value).mean())
        mean = _refined_once(replace(setup, criterion="integral", smoothness=smoothness), points, q, feasible)
        if mean.refined and mean.failure is None:
            part = best_part(setup, [part, _refined_once(setup, points, mean.q, feasible)])
    return part


def _refined_once(setup: Setup, points: Points, q: F64, feasible: Predicate | None) -> Part:
    if setup.steps_only and _largest_share(setup, points, q) < _SLOW:
        # Far from the largest step: the path is refined without it and most likely keeps it.
        part = _refined_within(setup.without_steps(), points, q, feasible)
        if part.failure is None and _largest_share(setup, points, part.q) < 1.0:
            return part
    return _refined_within(setup, points, q, feasible)


def _largest_share(setup: Setup, points: Points, q: F64) -> float:
    """Return the largest motion between points as a share of what it may be."""
    bounds = setup.data.bounds[points[0] : points[-1]]
    return float((np.abs(np.diff(q, axis=0)) / bounds).max(initial=0.0))


def _refined_within(setup: Setup, points: Points, q: F64, feasible: Predicate | None) -> Part:
    closing = setup.closed and len(points) == len(setup.path) > 2
    turns = 2.0 * np.pi * np.round((q[-1] - q[0]) / (2.0 * np.pi)) if closing else None
    restored = setup.restored(points, q)
    start = restored if np.isfinite(restored).all() else q
    smoothness = setup.weight_of_motion(setup.values(start))
    first, last = int(points[0]), int(points[-1])
    steps = setup.data.steps[first:last]
    total = steps.sum() if len(steps) else 1.0
    kept = len(points) - (turns is not None)
    rows, value, cost, residual, _, _, status, tightest = refine_path(
        setup.robot,
        setup.task,
        setup.targets[first : first + kept],
        start[:kept],
        setup.objective,
        setup.core_criterion,
        smoothness,
        point_weights(steps / total, turns is not None)[:kept],
        steps / total,
        setup.data.bounds[first:last],
        setup.limits,
        turns,
        setup.length,
        setup.max_iterations,
        setup.spin(slice(first, first + kept)),
    )
    if turns is not None:
        rows, value = np.vstack([rows, rows[0] + turns]), np.append(value, value[0])
    usable = status != "singular" and (feasible is None or bool(np.asarray(feasible(rows)).all()))
    if not usable:
        rows, value = start, setup.values(start)
    part = Part(
        first, rows, value, cost, setup.motion(first, rows), residual, smoothness, usable and status == "converged"
    )
    if status == "infeasible" and tightest is not None:
        part.failure = _failure(setup, points, rows, tightest)
    return part


def best_part(setup: Setup, parts: list[Part]) -> Part:
    """Return the best of several: whole before broken, then by cost; among equals refined first, then by motion."""
    rivals = [part for part in parts if part.failure is None] or parts
    costs = [part.worst if setup.criterion == "minimax" else part.cost for part in rivals]
    # What broke off has no cost.
    costs = [cost if np.isfinite(cost) else np.inf for cost in costs]
    limit = min(costs) + _TIE * abs(min(costs))
    equals = [part for part, cost in zip(rivals, costs, strict=True) if cost <= limit]
    return min(equals, key=lambda part: (not part.refined, part.motion))


def better_parts(setup: Setup, old: list[Part], new: list[Part]) -> list[Part]:
    """Return the better of two ways to follow a path: the one that reaches more of it, else the better one."""
    if not old or not new:
        return old or new
    reach = [(sum(len(part.q) for part in parts), -len(parts)) for parts in (old, new)]
    if reach[0] != reach[1]:
        return old if reach[0] > reach[1] else new
    return [best_part(setup, [old[0], new[0]])] if len(old) == 1 else old


def from_warm_start(setup: Setup, feasible: Predicate | None, earlier: Trajectory | None) -> list[Part]:
    """Refine an earlier plan, carried over by the share of the path; nothing if that does not lead to an optimum."""
    if earlier is None:
        return []
    if earlier.robot.n != setup.robot.n:
        raise InvalidValueError(f"warm_start has {earlier.robot.n} joints, expected {setup.robot.n}")
    places = [np.concatenate([[0.0], np.cumsum(shares(path))]) for path in (earlier.path, setup.path)]
    q = np.stack([np.interp(places[1], places[0], column) for column in earlier.q.T], axis=1)
    part = refined_part(setup, np.arange(len(q)), q, feasible)
    on_path = max(error.max() for error in setup.errors(np.arange(len(q)), part.q)) <= ON_PATH
    return [part] if part.refined and part.failure is None and on_path else []


def _failure(setup: Setup, points: Points, q: F64, tightest: tuple[str, int, int]) -> PlanFailure:
    """Say which limit leaves no path: where, and by how much."""
    kind, at, joint = tightest
    point = int(points[at])
    if kind == "joint limit":
        beyond = np.maximum(setup.robot.q_min - q, q - setup.robot.q_max)[at, joint]
        return PlanFailure(point, kind, joint, float(beyond))
    if kind == "speed limit":
        following = min(at + 1, len(q) - 1)
        excess = abs(q[following, joint] - q[at, joint]) / setup.data.bounds[point, joint]
        return PlanFailure(point + 1, setup.motion_limit, joint, float(excess))
    return PlanFailure(point, kind)
