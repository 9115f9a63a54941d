"""Routes through a path: over more of its points until they hold, and several of them where one may not be the best."""

from collections.abc import Callable
from itertools import pairwise
from typing import Final

import numpy as np

from ._core import OrthogonalSQP
from ._layers import Layers, Segment, spread
from ._plan_bound import is_proven
from ._plan_refine import Part, best_part, refined_part, tried_part
from ._plan_result import PlanFailure
from ._plan_setup import ON_PATH, Setup
from ._util import F64
from .maps import Predicate

_ROUNDS: Final = 8
"""Times that points are added to the search."""
_WANDERED: Final = 0.5
"""A posture this far from where its neighbours' interpolation put it [rad] is on another route."""
_BEYOND: Final = 0.02
"""How far in-between postures may be beyond a limit [rad or m]: the refinement brings them back."""
_SLACKS: Final = (0.1, 0.02, 0.0)
"""What the worst value of a route may exceed its minimum by: a grid's worst cell can force detours.

The smoothest route comes first: if it leads to the bound, no other is better."""
_HASTES: Final = (2.0, 4.0, np.inf)
"""By what speed limits are multiplied where a grid knows no way: its cells are coarser than a path's steps."""
_STARTS: Final = 64
"""Random postures from which the first point is solved for a greedy walk."""
_SMALL_GAP: Final = 8
"""Points between two of the search that are all added at once."""


def searched_parts(
    setup: Setup, known: Layers, feasible: Predicate | None, layers: int, advance: Callable[[int], None]
) -> list[Part]:
    """Find routes through the path, as far as they lead, and refine them.

    Parameters
    ----------
    setup : Setup
        The problem.
    known : Layers
        Gathers the cells that are computed.
    feasible : callable, optional
        The user's predicate.
    layers : int
        Points to begin with.
    advance : callable
        Told of points that are done.

    Returns
    -------
    list of Part
        The stretches that can be followed, in order; each the best that was found.
    """
    n = len(setup.path)
    wanted = sorted({round(x) for x in np.linspace(0, n - 1, min(n, layers))})
    found: list[list[Segment]] = []
    for _ in range(_ROUNDS):
        known.add(wanted, advance)
        runs = _open_runs(known, wanted)
        whole = len(runs) == 1 and len(runs[0]) == len(wanted)
        found = [rivals for run in runs for rivals in _routes(setup, known, run, whole)]
        more = _where_more_is_needed(setup, known, wanted, [rivals[0] for rivals in found])
        if not more:
            break
        wanted = sorted({*wanted, *more})
    parts = [_best_of(setup, known, rivals, feasible) for rivals in found]
    if known.settings.spare and setup.objective is not None:
        parts = _or_followed(setup, parts, feasible)
    return parts


def _open_runs(known: Layers, points: list[int]) -> list[list[int]]:
    """Return the runs of points that have postures."""
    runs: list[list[int]] = [[]]
    for point in points:
        if known.is_open(point):
            runs[-1].append(point)
        elif runs[-1]:
            runs.append([])
    return [run for run in runs if run]


def _routes(setup: Setup, known: Layers, points: list[int], whole: bool) -> list[list[Segment]]:
    """Return the rival routes of a run of points, or of its parts where there is no way from one to the next."""
    closed = setup.closed and whole
    for haste in (1.0, *_HASTES) if np.isfinite(setup.data.bounds).any() else (1.0,):
        slacks = _SLACKS if setup.criterion == "minimax" else (0.0,)
        first = known.route(points, closed, slacks[0], haste)
        if len(first.points) == len(points):
            rivals = [first, *(known.route(points, closed, slack, haste) for slack in slacks[1:])]
            if np.isfinite(setup.data.bounds).any():
                # Cells are coarse beside what a joint may move: the refinement can slow down what a grid cannot.
                rivals.append(known.route(points, closed, slacks[0], np.inf))
            return [[route for i, route in enumerate(rivals) if not _repeated(rivals, i)]]
    routes = []
    rest = points
    while rest:
        segment = known.route(rest, False)
        routes.append([segment])
        rest = rest[len(segment.points) :] if segment.points else []
    return routes


def _repeated(routes: list[Segment], i: int) -> bool:
    return any(np.array_equal(routes[i].q, other.q) for other in routes[:i])


def _where_more_is_needed(setup: Setup, known: Layers, wanted: list[int], found: list[Segment]) -> set[int]:
    """Return points whose cells should be known: where routes end early and where interpolation loses the path."""
    more: set[int] = set()
    for a, b in pairwise(wanted):
        joined = any(a in segment.points and b in segment.points for segment in found)
        if b - a > 1 and not joined and (known.is_open(a) or known.is_open(b)):
            # Halving finds the edge.
            more.update({(a + b) // 2} if b - a > _SMALL_GAP else range(a + 1, b))
    for segment in found:
        if len(segment.points) < 2:
            continue
        points, q = spread(segment)
        restored = setup.restored(points, q)
        lost = ~np.isfinite(restored).all(axis=1) | (np.abs(restored - q).max(axis=1) > _WANDERED)
        if setup.limits:
            lost |= np.maximum(setup.robot.q_min - restored, restored - setup.robot.q_max).max(axis=1) > _BEYOND
        feasible = known.settings.feasible
        if feasible is not None and not lost.all():
            lost[~lost] = ~np.asarray(feasible(restored[~lost]))
        places = np.flatnonzero(lost)
        # Of many neighbours every other one will do: the next round sees whether it did.
        more.update(int(points[i]) for i in (places[::2] if len(places) > 2 * _SMALL_GAP else places))
    return more - set(known.cells)


def _best_of(setup: Setup, known: Layers, rivals: list[Segment], feasible: Predicate | None) -> Part:
    """Refine rival routes and return the best."""
    parts: list[Part] = []
    for segment in rivals:
        parts.append(tried_part(setup, *spread(segment), feasible))
        if len(rivals) > 1 and is_proven(setup, known, parts[-1:]):
            break
    part = best_part(setup, parts)
    if not part.refined and part.failure is None:
        part = refined_part(setup, part.first + np.arange(len(part.q)), part.q, feasible)
    blocked, ended = rivals[0].blocked, rivals[0].points[-1]
    if ended + 1 < len(setup.path) and blocked is not None:
        joint, excess = blocked
        slow = np.isfinite(setup.data.bounds[ended, joint]) and excess > 1.0
        part.failure = (
            PlanFailure(ended + 1, "speed limit", joint, excess) if slow else PlanFailure(ended + 1, "no way")
        )
    return part


def _or_followed(setup: Setup, parts: list[Part], feasible: Predicate | None) -> list[Part]:
    """Return the parts, or what comes of following the path greedily from its first point if that is better.

    With joints to spare the grid is coarse, and a greedy walk that keeps away from limits can be worth more.
    """
    assert setup.objective is not None
    solver = OrthogonalSQP(setup.robot, setup.task, setup.objective, limits=setup.limits)
    start, _, status, _ = solver.solve(setup.targets[0], starts=_STARTS)
    if status == "unreachable":
        return parts
    q, _, position_error, axis_error, _, _ = solver.follow_chunk(setup.targets, start)
    if max(position_error.max(), axis_error.max()) > ON_PATH:
        return parts
    if setup.closed:
        q[-1] = _turned_to(q[0], q[-1])
    followed = refined_part(setup, np.arange(len(q)), q, feasible)
    whole = len(parts) == 1 and len(parts[0].q) == len(q)
    return [best_part(setup, [parts[0], followed])] if whole else [followed]


def _turned_to(q: F64, other: F64) -> F64:
    """Return a posture, each joint by whole turns next to that of another."""
    turns: F64 = q + 2.0 * np.pi * np.round((other - q) / (2.0 * np.pi))
    return turns
