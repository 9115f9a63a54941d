"""A grid search over spins and branches, written without the planner, for `evidence.planner.compare`.

Only inverse solutions and their values come from the package. At each point of a path the tool takes every spin of a
grid of 0.25 degrees; the states are these spins on each branch. A step from point to point stays on its branch, turns
the spin by no more than a window and keeps every joint's speed limit; where the path has no times it moves no joint by
more than `JUMP`, as the planner does by default. The best way is found by dynamic programming (Bellman 1957), exactly.

Joints that turn more than once are compared up to whole turns; the way that is found is made continuous and shifted
into the limits as a whole. Where it does not fit, the search is repeated with the turns of the joint in the way as
states.

A closed path has to end in the spin it starts from. This is a search over sets of starts: the best way from a set to
itself bounds what is closed within it, and sets are halved until the best way is closed (branch and bound).
`Found.bound` tells what was left when the number of searches ran out.
"""

import heapq
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from evidence.planner.grid import TURN, Branch, Grid, with_turns, within_turns

F64 = NDArray[np.float64]
Bool = NDArray[np.bool_]
Int = NDArray[np.intp]

MAX_SEARCHES: Final = 16
"""Searches over sets of starts for a closed path, at most."""
CLOSE: Final = 1e-7
"""Part of the objective up to which a closed path has to be the best."""
FIRST_RAISE: Final = 1e-3
"""Part by which a ceiling is raised at first under which no way closes."""
CEILING_STEP: Final = 2e-4
"""Part to which the lowest ceiling of such a way is told."""
CEILINGS: Final = (1.02, 1.3, np.inf)
"""Ceilings of a worst value that are tried, as multiples of the least one that a single point allows."""


@dataclass(frozen=True, eq=False)
class Found:
    """A way through the grid.

    Attributes
    ----------
    q : ndarray, shape (N, 6)
        Joints [rad].
    spin : ndarray of int, shape (N,)
        Spins of the grid.
    objective : float
        Worst value, or integral of value and smoothness times squared speed.
    bound : float
        No way through the grid is better than this.
    """

    q: F64 = field(repr=False)
    spin: Int = field(repr=False)
    objective: float
    bound: float


def minimax(grid: Grid) -> Found | None:
    """Return the way of the lowest worst value, and of the least motion among those; None if there is none."""
    if not grid.branches:
        return None
    floor = float(np.min([b.value.min(axis=(1, 2)) for b in grid.branches], axis=0).max())
    for factor in CEILINGS:
        # Few states are below a low ceiling; a way below it is the best of all.
        found = _minimax_below(grid, factor * floor)
        if found is not None:
            return found
    return None


def integral(grid: Grid, smoothness: float) -> Found | None:
    """Return the way of the least integral of value and smoothness times squared speed; None if there is none."""
    weights = grid.weights[:, None, None]
    least = [float((weights[:, 0, 0] * b.value.min(axis=(1, 2))).sum()) for b in grid.branches]
    best: Found | None = None
    bound = np.inf
    for i in np.argsort(least):
        if best is not None and least[i] >= best.objective:
            break
        branch = grid.branches[i]
        found = _within_limits(grid, branch, weights * branch.value, smoothness)
        if found is not None:
            bound = min(bound, found.bound)
            best = found if best is None or found.objective < best.objective else best
    return None if best is None else replace(best, bound=bound)


def _minimax_below(grid: Grid, ceiling: float) -> Found | None:
    levels = []
    for i, branch in enumerate(grid.branches):
        value = np.where(branch.value <= ceiling, branch.value, np.inf)
        level, _ = _sweep(grid, branch, value, None, None)
        if np.isfinite(level):
            levels.append((level, i))
    best: Found | None = None
    bound = np.inf
    for level, i in sorted(levels):
        if best is not None and level > best.objective:
            break
        branch = grid.branches[i]
        found, lower = _lowest(grid, branch, level, min(ceiling, np.inf if best is None else best.objective))
        bound = min(bound, lower)
        if found is None:
            continue
        states = branch.value.min(axis=1)[np.arange(len(found.spin)), found.spin]
        now = replace(found, objective=float(states.max()))
        if best is None or (now.objective, grid.motion(now.q)) < (best.objective, grid.motion(best.q)):
            best = now
    return None if best is None else replace(best, bound=min(bound, best.objective))


def _lowest(grid: Grid, branch: Branch, level: float, ceiling: float) -> tuple[Found | None, float]:
    """Return the way on a branch under the lowest ceiling, and the ceiling under which there is none.

    Ceilings start at a level, that of a way that need not close, and that may need more turns than there are.
    """
    lower = level
    while level <= ceiling:
        cost = np.where(branch.value <= level, 0.0, np.inf)
        found = _closed(grid, branch, cost, 1.0) if grid.closed else _open(grid, branch, cost, 1.0)
        if found is None and not grid.closed:
            break
        if found is None:
            lower, level = _closing_level(grid, branch, level, ceiling)
            continue
        q, joint = within_turns(found.q, branch.wide, grid.robot)
        if joint is None:
            return replace(found, q=q), lower
        branch, _ = with_turns(branch, joint, grid.robot)
        level, _ = _sweep(grid, branch, np.where(branch.value <= ceiling, branch.value, np.inf), None, None)
        lower = level
    return None, ceiling


def _closing_level(grid: Grid, branch: Branch, level: float, ceiling: float) -> tuple[float, float]:
    """Return ceilings next to each other: under the first no way closes, under the second one does."""

    def closes(level: float) -> bool:
        return len(_closing(grid, branch, np.where(branch.value <= level, 0.0, np.inf))) > 0

    ceiling = min(ceiling, float(branch.value[np.isfinite(branch.value)].max()))
    lower, upper, raised = level, (1.0 + FIRST_RAISE) * level, FIRST_RAISE
    while not closes(min(upper, ceiling)):
        if upper >= ceiling:
            return ceiling, np.inf
        raised *= 3.0
        lower, upper = upper, (1.0 + raised) * level
    while upper - lower > CEILING_STEP * level:
        middle = 0.5 * (lower + upper)
        lower, upper = (lower, middle) if closes(middle) else (middle, upper)
    return lower, min(upper, ceiling)


def _within_limits(grid: Grid, branch: Branch, cost: F64, smoothness: float) -> Found | None:
    """Return the best way on a branch; joints that do not fit in their limits get their turns as states."""
    while True:
        found = _closed(grid, branch, cost, smoothness) if grid.closed else _open(grid, branch, cost, smoothness)
        if found is None:
            return None
        q, joint = within_turns(found.q, branch.wide, grid.robot)
        if joint is None:
            return replace(found, q=q)
        branch, copies = with_turns(branch, joint, grid.robot)
        cost = np.repeat(cost, copies, axis=1)
        cost = np.where(np.isfinite(branch.value), cost, np.inf)


def _open(grid: Grid, branch: Branch, cost: F64, smoothness: float, start: Bool | None = None) -> Found | None:
    objective, states = _sweep(grid, branch, cost, smoothness, start)
    if states is None:
        return None
    spins = branch.value.shape[2]
    copy, spin = np.divmod(states, spins)
    q = branch.q[np.arange(len(states)), :, copy, spin]
    return Found(q, spin, objective, objective)


def _closed(grid: Grid, branch: Branch, cost: F64, smoothness: float) -> Found | None:
    """Search over sets of starts, the one with the lowest bound first."""
    spins = branch.value.shape[2]
    best: Found | None = None
    both = np.isfinite(cost[0]).any(axis=0) & np.isfinite(cost[-1]).any(axis=0)
    if not both.any():
        return None
    heap: list[tuple[float, int, Int]] = [(-np.inf, 0, _closing(grid, branch, cost))]
    searches, tie = 0, 0
    while heap and searches < MAX_SEARCHES:
        if best is not None and heap[0][0] >= best.objective * (1.0 - CLOSE):
            break
        _, _, starts = heapq.heappop(heap)
        if not len(starts):
            continue
        found = _open(grid, branch, cost, smoothness, _marked(starts, spins))
        searches += 1
        if found is None or (best is not None and found.objective >= best.objective):
            continue
        first, last = found.spin[0], found.spin[-1]
        if first == last:
            best = found
            continue
        if best is None or searches % 4 == 0:
            # What closes at either end is an upper bound; without one everything has to be looked at.
            for spin in (first, last):
                tried = _open(grid, branch, cost, smoothness, _marked(np.array([spin]), spins))
                searches += 1
                if tried is not None and (best is None or tried.objective < best.objective):
                    best = tried
        place = int(np.searchsorted(starts, 0.5 * (first + last)))
        for part in (starts[:place], starts[place:]):
            tie += 1
            heapq.heappush(heap, (found.objective, tie, part))
    if best is None:
        return None
    return replace(best, bound=min([best.objective, *(bound for bound, _, _ in heap)]))


def _closing(grid: Grid, branch: Branch, cost: F64) -> Int:
    """Return the spins from which a way leads back to the same spin: each state carries the set of its starts."""
    points, copies, spins = cost.shape
    starts = np.zeros((spins, -(-spins // 64) * 64), dtype=bool)
    starts[:, :spins] = np.eye(spins, dtype=bool)
    words = np.packbits(starts, axis=1, bitorder="little").view(np.uint64)
    before = np.where(np.isfinite(cost[0])[:, :, None], words, np.uint64(0))
    for t in range(1, points):
        now = np.zeros_like(before)
        for c in range(copies):
            for other in range(copies):
                alive = before[other].any(axis=1)
                columns = _near(grid, branch, t, c, np.isfinite(cost[t, c]), other, alive)
                if not len(columns):
                    continue
                step = _windows(np.where(alive, 0.0, np.inf), grid.window)[:, columns]
                for j in range(6):
                    apart = np.abs(
                        _windows(branch.q[t - 1, j, other], grid.window)[:, columns] - branch.q[t, j, c, columns]
                    )
                    if branch.wide[j]:
                        apart = np.minimum(apart, TURN - apart)
                    step[apart > grid.largest[t - 1, j]] = np.inf
                for shift, row in zip(range(-grid.window, grid.window + 1), step, strict=True):
                    chosen = columns[row == 0.0]
                    if len(chosen):
                        now[c, chosen] |= before[other, (chosen + shift) % spins]
        before = now
    back = np.unpackbits(np.bitwise_or.reduce(before, axis=0).view(np.uint8), axis=1, bitorder="little")
    return np.flatnonzero(back[np.arange(spins), np.arange(spins)])


def _near(grid: Grid, branch: Branch, t: int, copy: int, wanted: Bool, other: int, alive: Bool) -> Int:
    """Return the spins of a copy that no turned joint keeps from all live states of another copy before."""
    wanted = wanted & alive.any()
    turned = branch.turned if wanted.any() else ()
    for j in turned:
        there, here = branch.q[t - 1, j, other][alive], branch.q[t, j, copy]
        bound = grid.largest[t - 1, j]
        wanted = wanted & (here >= there.min() - bound) & (here <= there.max() + bound)
    return np.flatnonzero(wanted)


def _sweep(
    grid: Grid, branch: Branch, cost: F64, smoothness: float | None, start: Bool | None
) -> tuple[float, Int | None]:
    """Run dynamic programming once: sum of cost and motion, or, without a smoothness, the largest cost.

    `start` are the spins at which the way may start and end. Returns the best, and the states of the way (none for
    the largest cost).
    """
    points, copies, spins = cost.shape
    label = cost[0] if start is None else np.where(start, cost[0], np.inf)
    back = np.zeros((points, copies, spins), dtype=np.int32)
    shifts = np.arange(-grid.window, grid.window + 1)
    for t in range(1, points):
        own = cost[t] if t < points - 1 or start is None else np.where(start, cost[t], np.inf)
        reached = np.full((copies, spins), np.inf)
        if not np.isfinite(label).any():
            return np.inf, None
        before = [_windows(label[c], grid.window) for c in range(copies)]
        joints = [[_windows(branch.q[t - 1, j, c], grid.window) for j in range(6)] for c in range(copies)]
        factor = 0.0 if smoothness is None else smoothness / grid.shares[t - 1]
        for c in range(copies):
            for other in range(copies):
                columns = _near(grid, branch, t, c, np.isfinite(own[c]), other, np.isfinite(label[other]))
                if not len(columns):
                    continue
                step = before[other][:, columns]
                square = np.zeros_like(step)
                for j in range(6):
                    apart = np.abs(joints[other][j][:, columns] - branch.q[t, j, c, columns])
                    if branch.wide[j]:
                        apart = np.minimum(apart, TURN - apart)
                    step[apart > grid.largest[t - 1, j]] = np.inf
                    if smoothness is not None:
                        square += apart * apart
                if smoothness is not None:
                    step += factor * square
                at = step.argmin(axis=0)
                least = step[at, np.arange(len(columns))]
                better = least < reached[c, columns]
                chosen = columns[better]
                reached[c, chosen] = least[better]
                back[t, c, chosen] = other * spins + (chosen + shifts[at[better]]) % spins
        label = np.maximum(reached, own) if smoothness is None else reached + own
    best = float(label.min())
    if smoothness is None or not np.isfinite(best):
        return best, None
    states = np.zeros(points, dtype=np.intp)
    states[-1] = int(label.argmin())
    for t in range(points - 1, 0, -1):
        states[t - 1] = back[t].reshape(-1)[states[t]]
    return best, states


def _windows(row: F64, window: int) -> F64:
    """Return row i + j - window of a ring at (j, i)."""
    ring = np.concatenate([row[len(row) - window :], row, row[:window]])
    return sliding_window_view(ring, len(row))


def _marked(places: Int, count: int) -> Bool:
    marks = np.zeros(count, dtype=bool)
    marks[places] = True
    return marks
