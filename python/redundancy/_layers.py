"""From a path to a route: a search over some of its points, more of them where more is needed."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ._core import Lattice, find_route
from ._path_frames import point_weights
from ._plan_setup import Points, Setup
from ._util import F64
from .maps import Predicate, apply_predicate
from .plots import CAUSES

_FULL_TURN: Final = 2.0 * np.pi
_BRANCH_STEP: Final = 0.5
"""Largest motion of a joint where the branch changes [rad]: it is at a singularity, where it is small."""
_MOST_LAYERS: Final = 1000
"""Points of a search at most: what is between them is known well enough."""
_CELLS: Final = 2.0
"""Cells of the spin by which every joint has to be able to move from layer to layer."""
_NAMELESS_STEP: Final = 1.5
"""The same where branches have no names, so that motion alone tells which follows which."""


@dataclass(frozen=True)
class SearchSettings:
    """How routes are searched; as for `redundancy.plan`."""

    angles: F64
    around: bool
    max_spin_step: float
    spare: tuple[int, ...]
    spare_values: F64
    branches: tuple[int, ...] | None
    branch_changes: bool
    feasible: Predicate | None


@dataclass(frozen=True)
class Cells:
    """Postures of one layer."""

    q: F64
    value: F64
    cause: NDArray[np.uint8]


@dataclass(frozen=True)
class Segment:
    """A stretch of layers with a route: the layers' points, their postures, the cost and what ended it, if anything."""

    points: list[int]
    q: F64
    cost: float
    blocked: tuple[int, float] | None = None


@dataclass
class Layers:
    """The points of a path whose cells are known."""

    setup: Setup
    settings: SearchSettings
    cells: dict[int, Cells] = field(default_factory=dict)
    shape: tuple[int, int, int] = (1, 1, 1)
    named: bool = True

    def add(self, points: list[int], advance: Callable[[int], None]) -> None:
        """Compute the cells of some points."""
        new = [point for point in points if point not in self.cells]
        if not new:
            return
        settings = self.settings
        lattice = self._lattice(new)
        self.shape, self.named = lattice.shape, lattice.named
        chunk = max(1, 2_000_000 // (int(np.prod(self.shape)) * self.setup.robot.n))
        for first in range(0, len(new), chunk):
            count = min(chunk, len(new) - first)
            q, value, cause = lattice.postures(first, count)
            if settings.feasible is not None:
                apply_predicate(settings.feasible, q, value, cause)
            if settings.branches is not None:
                barred = ~np.isin(np.arange(cause.shape[1]) % self.shape[2], settings.branches)
                cause[(cause == 0) & barred] = CAUSES.index("predicate")
            for i in range(count):
                self.cells[new[first + i]] = Cells(q[i], value[i], cause[i])
            advance(count)

    def _lattice(self, points: list[int]) -> Lattice:
        settings = self.settings
        return Lattice(
            self.setup.robot,
            self.setup.data.frames[points],
            self.setup.task.axis,
            settings.angles,
            list(settings.spare),
            settings.spare_values,
            self.setup.objective,
            self.setup.limits,
        )

    def nearest_to_limits(self, point: int) -> tuple[int, float] | None:
        """Return the joint that is least beyond its limit at a point, and by how much."""
        return self._lattice([point]).nearest_to_limits(0)

    def is_open(self, point: int) -> bool:
        """Return whether a point has any feasible cell."""
        return bool((self.cells[point].cause == 0).any())

    def route(self, points: list[int], closed: bool, slack: float = 0.0, haste: float = 1.0) -> Segment:
        """Return the best route through some points, or the part of it that there is.

        Parameters
        ----------
        points : list of int
            Points whose cells are known.
        closed : bool
            Whether the last is the first.
        slack : float
            What the worst value may exceed its minimum by, relative, for the sake of motion (minimax).
        haste : float
            By what the speed limits are multiplied.
        """
        setup, settings, data = self.setup, self.settings, self.setup.data
        layers = [self.cells[point] for point in points]
        spans = list(pairwise(points))
        steps = np.array([data.steps[a:b].sum() for a, b in spans])
        steps = steps / steps.sum() if len(steps) else steps
        bounds = np.array([data.bounds[a:b].sum(axis=0) for a, b in spans]).reshape(-1, setup.robot.n)
        q, cells, cost, blocked = find_route(
            setup.robot,
            np.stack([layer.q for layer in layers]),
            np.stack([layer.value for layer in layers]),
            np.stack([layer.cause for layer in layers]),
            self.shape,
            self.named,
            point_weights(steps, False),
            steps,
            haste * bounds,
            setup.core_criterion,
            setup.weight_of_motion(np.concatenate([layer.value[layer.cause == 0] for layer in layers])),
            max(1, round(settings.max_spin_step / self._spin_step)),
            self._slice_window(),
            settings.around,
            (_BRANCH_STEP if settings.branch_changes else 0.0) if self.named else _NAMELESS_STEP,
            slack,
            setup.limits,
            closed,
        )
        return Segment(points[: len(cells)], q, cost, blocked)

    @property
    def _spin_step(self) -> float:
        angles = self.settings.angles
        return float(angles[1] - angles[0]) if len(angles) > 1 else _FULL_TURN

    def most_layers(self) -> int:
        """Return at how many points a search is worth while: joints have to be able to follow a change of the spin."""
        reach = float(self.setup.data.bounds.min(axis=1).sum())
        most = min(len(self.setup.path), _MOST_LAYERS)
        return int(max(2, min(most, reach / (_CELLS * self._spin_step))))

    def _slice_window(self) -> int:
        """Return how many values a spare joint may pass from layer to layer: an eighth of its range.

        Several joints are one after another in the grid, so neighbours lie far apart in it: all are looked at.
        """
        return max(1, self.shape[0] // 8) if len(self.settings.spare) == 1 else self.shape[0]


def spread(segment: Segment) -> tuple[Points, F64]:
    """Return all points of a segment and postures in between by interpolation."""
    points = np.arange(segment.points[0], segment.points[-1] + 1)
    q = np.stack([np.interp(points, segment.points, column) for column in segment.q.T], axis=1)
    return points, q
