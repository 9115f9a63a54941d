"""How good a plan can be at best."""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

from ._core import least_value
from ._layers import Layers
from ._path_frames import point_weights
from ._plan_refine import Part
from ._plan_result import Plan
from ._plan_setup import Setup
from ._util import F64

_POINTS: Final = 3
"""Points of the search at which the lower bound of a worst value is looked for."""


def least(setup: Setup, known: Layers, point: int, q: F64 | None = None) -> float:
    """Return the least value at a point, from the cells of the search there and from a posture of one's own."""
    if setup.objective is None:
        return 0.0
    known.add([point], lambda _: None)
    cells = known.cells[point]
    postures, values = cells.q[cells.cause == 0], cells.value[cells.cause == 0]
    if q is not None:
        postures, values = np.vstack([postures, q]), np.append(values, setup.values(q[None]))
    return least_value(
        setup.robot,
        setup.task,
        setup.targets[point],
        postures,
        values,
        setup.objective,
        setup.limits,
        setup.length,
        setup.spin(slice(point, point + 1)),
    )


def hardest(known: Layers) -> list[int]:
    """Return the points of the search whose best cell is worst: no path passes below them."""
    best = {p: float(cells.value[cells.cause == 0].min()) for p, cells in known.cells.items() if known.is_open(p)}
    return sorted(best, key=lambda point: -best[point])[:_POINTS]


def lower_bound(setup: Setup, known: Layers, part: Part) -> float:
    """Return what no path's worst value is below: the least value at the worst points of the search and of a plan."""
    worst = int(np.argmax(part.value))
    least_there = least(setup, known, part.first + worst, part.q[worst])
    return max(least_there, *(least(setup, known, point) for point in hardest(known)))


def is_proven(setup: Setup, known: Layers, parts: list[Part]) -> bool:
    """Return whether the worst value of a whole path is at its lower bound, so that no search finds a better one."""
    if setup.criterion != "minimax" or setup.objective is None or len(parts) != 1 or len(parts[0].q) != len(setup.path):
        return False
    return parts[0].is_at(lower_bound(setup, known, parts[0]))


def with_bound(setup: Setup, known: Layers, result: Plan, advance: Callable[[int], None]) -> Plan:
    """Add what no path can do better than.

    Parameters
    ----------
    setup, known, result
        The problem, the cells that are known, the plan.
    advance : callable
        Told of points that are done.

    Returns
    -------
    Plan
        With ``bound``: for the worst value the least value at the worst point of the plan and at those points of the
        search whose best cell is worst; for an integral that of the least values of all points.
    """
    finite = np.isfinite(result.value)
    if setup.objective is None or not finite.any():
        return result
    if setup.criterion == "integral":
        known.add(list(range(len(result))), advance)
        values = np.array([least(setup, known, point, result.q[point]) for point in range(len(result))])
        return replace(result, bound=float(point_weights(setup.data.steps, setup.closed) @ values))
    worst = int(np.argmax(np.where(finite, result.value, -np.inf)))
    points = [point for point in {worst, *hardest(known)} if finite[point]]
    return replace(result, bound=max(least(setup, known, point, result.q[point]) for point in points))
