"""A grid search over spins and branches, written without the planner, for docs/compare_plan.py.

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
import redundancy as rd
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from redundancy._core import Lattice

F64 = NDArray[np.float64]
Bool = NDArray[np.bool_]
Int = NDArray[np.intp]

SPINS: Final = 1440
JUMP: Final = 0.5
"""Longest motion of a joint from point to point of a path without times [rad]."""
LARGEST_WINDOW: Final = np.pi / 4.0
"""Largest change of the spin from point to point [rad]; less where the speed limits together allow no more."""
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
TURN: Final = 2.0 * np.pi
_CHUNK: Final = 64


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


@dataclass(frozen=True, eq=False)
class Branch:
    """States of a branch: joints (N, 6, C, A), C turns of a joint, and values (N, C, A), infinite where none is.

    Joints that are ``wide`` are compared up to whole turns; those ``turned`` have every turn as a state.
    """

    q: F64 = field(repr=False)
    value: F64 = field(repr=False)
    wide: Bool
    turned: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Grid:
    """All states of a path, and what may follow what.

    Attributes
    ----------
    robot : Robot
        Robot.
    branches : list of Branch
        Those on which every point has a posture.
    shares : ndarray, shape (N - 1,)
        Share of the path from point to point.
    largest : ndarray, shape (N - 1, 6)
        Largest motions [rad].
    window : int
        Spins that may be crossed from point to point, either way.
    closed : bool
        Whether the last state is the first.
    """

    robot: rd.Robot
    branches: list[Branch] = field(repr=False)
    shares: F64
    largest: F64
    window: int
    closed: bool

    @property
    def weights(self) -> F64:
        """Share of the path that each point stands for, by the trapezoidal rule."""
        weights: F64 = 0.5 * (np.append(self.shares, 0.0) + np.append(0.0, self.shares))
        return weights

    def minimax(self) -> Found | None:
        """Return the way of the lowest worst value, and of the least motion among those; None if there is none."""
        if not self.branches:
            return None
        floor = float(np.min([b.value.min(axis=(1, 2)) for b in self.branches], axis=0).max())
        for factor in CEILINGS:
            # Few states are below a low ceiling; a way below it is the best of all.
            found = self._minimax_below(factor * floor)
            if found is not None:
                return found
        return None

    def integral(self, smoothness: float) -> Found | None:
        """Return the way of the least integral of value and smoothness times squared speed; None if there is none."""
        weights = self.weights[:, None, None]
        least = [float((weights[:, 0, 0] * b.value.min(axis=(1, 2))).sum()) for b in self.branches]
        best: Found | None = None
        bound = np.inf
        for i in np.argsort(least):
            if best is not None and least[i] >= best.objective:
                break
            branch = self.branches[i]
            found = self._within_limits(branch, weights * branch.value, smoothness)
            if found is not None:
                bound = min(bound, found.bound)
                best = found if best is None or found.objective < best.objective else best
        return None if best is None else replace(best, bound=bound)

    def _minimax_below(self, ceiling: float) -> Found | None:
        levels = []
        for i, branch in enumerate(self.branches):
            value = np.where(branch.value <= ceiling, branch.value, np.inf)
            level, _ = self._sweep(branch, value, None, None)
            if np.isfinite(level):
                levels.append((level, i))
        best: Found | None = None
        bound = np.inf
        for level, i in sorted(levels):
            if best is not None and level > best.objective:
                break
            branch = self.branches[i]
            found, lower = self._lowest(branch, level, min(ceiling, np.inf if best is None else best.objective))
            bound = min(bound, lower)
            if found is None:
                continue
            states = branch.value.min(axis=1)[np.arange(len(found.spin)), found.spin]
            now = replace(found, objective=float(states.max()))
            if best is None or (now.objective, self.motion(now.q)) < (best.objective, self.motion(best.q)):
                best = now
        return None if best is None else replace(best, bound=min(bound, best.objective))

    def _lowest(self, branch: Branch, level: float, ceiling: float) -> tuple[Found | None, float]:
        """Return the way on a branch under the lowest ceiling, and the ceiling under which there is none.

        Ceilings start at a level, that of a way that need not close, and that may need more turns than there are.
        """
        lower = level
        while level <= ceiling:
            cost = np.where(branch.value <= level, 0.0, np.inf)
            found = self._closed(branch, cost, 1.0) if self.closed else self._open(branch, cost, 1.0)
            if found is None and not self.closed:
                break
            if found is None:
                lower, level = self._closing_level(branch, level, ceiling)
                continue
            q, joint = _turned(found.q, branch.wide, self.robot)
            if joint is None:
                return replace(found, q=q), lower
            branch, _ = _with_turns(branch, joint, self.robot)
            level, _ = self._sweep(branch, np.where(branch.value <= ceiling, branch.value, np.inf), None, None)
            lower = level
        return None, ceiling

    def _closing_level(self, branch: Branch, level: float, ceiling: float) -> tuple[float, float]:
        """Return ceilings next to each other: under the first no way closes, under the second one does."""

        def closes(level: float) -> bool:
            return len(self._closing(branch, np.where(branch.value <= level, 0.0, np.inf))) > 0

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

    def motion(self, q: F64) -> float:
        """Return the integral of the squared joint speed over the path's share."""
        return float((np.diff(q, axis=0) ** 2).sum(axis=1) @ (1.0 / self.shares))

    def _within_limits(self, branch: Branch, cost: F64, smoothness: float) -> Found | None:
        """Return the best way on a branch; joints that do not fit in their limits get their turns as states."""
        while True:
            found = self._closed(branch, cost, smoothness) if self.closed else self._open(branch, cost, smoothness)
            if found is None:
                return None
            q, joint = _turned(found.q, branch.wide, self.robot)
            if joint is None:
                return replace(found, q=q)
            branch, copies = _with_turns(branch, joint, self.robot)
            cost = np.repeat(cost, copies, axis=1)
            cost = np.where(np.isfinite(branch.value), cost, np.inf)

    def _open(self, branch: Branch, cost: F64, smoothness: float, start: Bool | None = None) -> Found | None:
        objective, states = self._sweep(branch, cost, smoothness, start)
        if states is None:
            return None
        spins = branch.value.shape[2]
        copy, spin = np.divmod(states, spins)
        q = branch.q[np.arange(len(states)), :, copy, spin]
        return Found(q, spin, objective, objective)

    def _closed(self, branch: Branch, cost: F64, smoothness: float) -> Found | None:
        """Search over sets of starts, the one with the lowest bound first."""
        spins = branch.value.shape[2]
        best: Found | None = None
        both = np.isfinite(cost[0]).any(axis=0) & np.isfinite(cost[-1]).any(axis=0)
        if not both.any():
            return None
        heap: list[tuple[float, int, Int]] = [(-np.inf, 0, self._closing(branch, cost))]
        searches, tie = 0, 0
        while heap and searches < MAX_SEARCHES:
            if best is not None and heap[0][0] >= best.objective * (1.0 - CLOSE):
                break
            _, _, starts = heapq.heappop(heap)
            if not len(starts):
                continue
            found = self._open(branch, cost, smoothness, _marked(starts, spins))
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
                    tried = self._open(branch, cost, smoothness, _marked(np.array([spin]), spins))
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

    def _closing(self, branch: Branch, cost: F64) -> Int:
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
                    columns = self._near(branch, t, c, np.isfinite(cost[t, c]), other, alive)
                    if not len(columns):
                        continue
                    step = _windows(np.where(alive, 0.0, np.inf), self.window)[:, columns]
                    for j in range(6):
                        apart = np.abs(
                            _windows(branch.q[t - 1, j, other], self.window)[:, columns] - branch.q[t, j, c, columns]
                        )
                        if branch.wide[j]:
                            apart = np.minimum(apart, TURN - apart)
                        step[apart > self.largest[t - 1, j]] = np.inf
                    for shift, row in zip(range(-self.window, self.window + 1), step, strict=True):
                        chosen = columns[row == 0.0]
                        if len(chosen):
                            now[c, chosen] |= before[other, (chosen + shift) % spins]
            before = now
        back = np.unpackbits(np.bitwise_or.reduce(before, axis=0).view(np.uint8), axis=1, bitorder="little")
        return np.flatnonzero(back[np.arange(spins), np.arange(spins)])

    def _near(self, branch: Branch, t: int, copy: int, wanted: Bool, other: int, alive: Bool) -> Int:
        """Return the spins of a copy that no turned joint keeps from all live states of another copy before."""
        wanted = wanted & alive.any()
        turned = branch.turned if wanted.any() else ()
        for j in turned:
            there, here = branch.q[t - 1, j, other][alive], branch.q[t, j, copy]
            bound = self.largest[t - 1, j]
            wanted = wanted & (here >= there.min() - bound) & (here <= there.max() + bound)
        return np.flatnonzero(wanted)

    def _sweep(
        self, branch: Branch, cost: F64, smoothness: float | None, start: Bool | None
    ) -> tuple[float, Int | None]:
        """Run dynamic programming once: sum of cost and motion, or, without a smoothness, the largest cost.

        `start` are the spins at which the way may start and end. Returns the best, and the states of the way (none for
        the largest cost).
        """
        points, copies, spins = cost.shape
        label = cost[0] if start is None else np.where(start, cost[0], np.inf)
        back = np.zeros((points, copies, spins), dtype=np.int32)
        shifts = np.arange(-self.window, self.window + 1)
        for t in range(1, points):
            own = cost[t] if t < points - 1 or start is None else np.where(start, cost[t], np.inf)
            reached = np.full((copies, spins), np.inf)
            if not np.isfinite(label).any():
                return np.inf, None
            before = [_windows(label[c], self.window) for c in range(copies)]
            joints = [[_windows(branch.q[t - 1, j, c], self.window) for j in range(6)] for c in range(copies)]
            factor = 0.0 if smoothness is None else smoothness / self.shares[t - 1]
            for c in range(copies):
                for other in range(copies):
                    columns = self._near(branch, t, c, np.isfinite(own[c]), other, np.isfinite(label[other]))
                    if not len(columns):
                        continue
                    step = before[other][:, columns]
                    square = np.zeros_like(step)
                    for j in range(6):
                        apart = np.abs(joints[other][j][:, columns] - branch.q[t, j, c, columns])
                        if branch.wide[j]:
                            apart = np.minimum(apart, TURN - apart)
                        step[apart > self.largest[t - 1, j]] = np.inf
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


def make_grid(
    robot: rd.Robot,
    path: rd.Toolpath,
    objective: rd.Objective,
    shares: F64,
    closed: bool = False,
    spins: int = SPINS,
    window: float | None = None,
) -> Grid:
    """Return the states of a path.

    Parameters
    ----------
    robot : Robot
        Six revolute joints.
    path : Toolpath
        N points; with times, speed limits hold.
    objective : Objective
        What states are worth.
    shares : ndarray, shape (N - 1,)
        Share of the path from point to point.
    closed : bool
        Whether the last state is the first.
    spins : int
        Spins of the grid.
    window : float, optional
        Largest change of the spin from point to point [rad].
    """
    n = len(path)
    frames = unspun(path, closed)
    angles = np.linspace(-np.pi, np.pi, spins, endpoint=False)
    lattice = Lattice(robot, frames, np.array([0.0, 0.0, 1.0]), angles, [], np.zeros((1, 0)), objective, True)
    count = lattice.shape[2]
    alive = np.ones(count, dtype=bool)
    for first in range(0, n, _CHUNK):
        _, cause = lattice.survey(first, min(_CHUNK, n - first))
        alive &= (cause.reshape(-1, spins, count) == 0).any(axis=1).all(axis=0)
    kept = np.flatnonzero(alive)
    wide = robot.q_max - robot.q_min >= TURN
    branches = [Branch(np.empty((n, 6, 1, spins)), np.full((n, 1, spins), np.inf), wide) for _ in kept]
    for first in range(0, n, _CHUNK) if len(kept) else ():
        part = slice(first, min(first + _CHUNK, n))
        rows = part.stop - first
        cells = lattice.postures(first, rows)
        q, value = cells[0].reshape(rows, spins, count, 6), cells[1].reshape(rows, spins, count)
        cause = cells[2].reshape(rows, spins, count)
        for b, branch in zip(kept, branches, strict=True):
            branch.q[part, :, 0] = np.nan_to_num(q[:, :, b].transpose(0, 2, 1))
            branch.value[part, 0] = np.where(cause[:, :, b] == 0, value[:, :, b], np.inf)
    largest = np.full((n - 1, 6), JUMP)
    if path.time is not None:
        largest = np.minimum(np.pi, np.diff(path.time)[:, None] * robot.qd_max)
    if window is None:
        # A joint turns the tool by no more than itself.
        window = min(LARGEST_WINDOW, float(largest.sum(axis=1).max()))
    return Grid(robot, branches, shares, largest, max(1, int(np.ceil(window * spins / TURN))), closed)


def unspun(path: rd.Toolpath, closed: bool) -> F64:
    """Return tool frames with z along the axes that turn as little as possible; where the path closes, so do they."""
    frames = np.tile(np.eye(4), (len(path), 1, 1))
    frames[:, :3, 3] = path.position
    x = np.cross([0.3, 0.8, 0.5], path.axis[0])
    for i, z in enumerate(path.axis):
        x = x - (x @ z) * z
        x = x / np.linalg.norm(x)
        frames[i, :3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    if closed:
        x, y = frames[0, :3, 0], frames[0, :3, 1]
        angle = np.arctan2(frames[-1, :3, 0] @ y, frames[-1, :3, 0] @ x)
        for i, back in enumerate(np.linspace(0.0, -angle, len(path))):
            cosine, sine = np.cos(back), np.sin(back)
            frames[i, :3, :3] = frames[i, :3, :3] @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]])
        frames[-1] = frames[0]
    return frames


def _windows(row: F64, window: int) -> F64:
    """Return row i + j - window of a ring at (j, i)."""
    ring = np.concatenate([row[len(row) - window :], row, row[:window]])
    return sliding_window_view(ring, len(row))


def _marked(places: Int, count: int) -> Bool:
    marks = np.zeros(count, dtype=bool)
    marks[places] = True
    return marks


def _turned(q: F64, wide: Bool, robot: rd.Robot) -> tuple[F64, int | None]:
    """Return joints made continuous and within limits, and the first joint for which there are no such turns."""
    q = q.copy()
    for joint in np.flatnonzero(wide):
        column = np.unwrap(q[:, joint])
        turns = np.ceil((robot.q_min[joint] - column.min()) / TURN)
        q[:, joint] = column + TURN * turns
        if q[:, joint].max() > robot.q_max[joint]:
            return q, int(joint)
    return q, None


def _with_turns(branch: Branch, joint: int, robot: rd.Robot) -> tuple[Branch, int]:
    """Return the states with every whole turn of a joint within its limits, and how many turns these are at most."""
    low, high = robot.q_min[joint], robot.q_max[joint]
    copies = int((high - low) // TURN) + 1
    first = branch.q[:, joint] + TURN * np.ceil((low - branch.q[:, joint]) / TURN)
    q, value = np.repeat(branch.q, copies, axis=2), np.repeat(branch.value, copies, axis=1)
    turned = np.repeat(first, copies, axis=1) + TURN * np.tile(np.arange(copies), first.shape[1])[None, :, None]
    q[:, joint] = turned
    value = np.where(turned <= high, value, np.inf)
    wide = branch.wide.copy()
    wide[joint] = False
    return Branch(q, value, wide, (*branch.turned, joint)), copies
