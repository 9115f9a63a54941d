"""A dynamic programme over the values of one held joint of a seven-axis arm, written without the planner.

Only inverse solutions come from the package. At each point of a path one joint is held at each value of a grid; the
states are the inverse solutions of the others within their limits. A step from point to point keeps every joint's
largest motion and changes the held joint by no more than a window of the grid; the sum of squared motions over the
shares of the path is least (Bellman 1957), exactly on that grid.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Index = NDArray[np.intp]

VALUES: Final = 1440
WINDOW: Final = 8
"""Values that the held joint may cross from point to point at first, either way; doubled while the best way does."""
WIDEST: Final = 64


@dataclass(frozen=True, eq=False)
class Way:
    """The best way of a grid: joints (N, 7), the integral of the squared joint speed, and the joint that was held."""

    q: F64 = field(repr=False)
    motion: float
    held: int


def least_motion(
    robot: rd.Robot, frames: F64, shares: F64, largest: F64, held: int, values: int = VALUES
) -> Way | None:
    """Return the way of the least motion with a joint on a grid, or None if there is none.

    Parameters
    ----------
    robot : Robot
        Seven joints.
    frames : ndarray, shape (N, 4, 4)
        Poses of the tool.
    shares : ndarray, shape (N - 1,)
        Share of the path from point to point.
    largest : ndarray, shape (N - 1, 7)
        Largest motions [rad].
    held : int
        The joint on the grid, counted from 0.
    values : int
        Values of the grid.
    """
    q = _states(robot, frames, held, values)
    window = WINDOW
    while True:
        way, crossed = _best(q, shares, largest, window)
        if crossed < window or window >= WIDEST:
            break
        window *= 2
    if way is None:
        return None
    return Way(way, float(((np.diff(way, axis=0) ** 2).sum(axis=1) / shares).sum()), held)


def _states(robot: rd.Robot, frames: F64, held: int, values: int) -> F64:
    """Return the postures (N, B, values, 7) within limits, those that are near each other in the same of B places."""
    count = len(frames)
    grid = np.linspace(robot.q_min[held], robot.q_max[held], values)
    rows: list[tuple[Index, F64]] = []
    for value in grid:
        q, frame = robot.inverse(frames, fixed={held: float(value)}, limits=True)
        rows.append((frame, q))
    most = max((int(np.bincount(frame, minlength=1).max()) for frame, _ in rows if len(frame)), default=1)
    states = np.full((count, most, values, robot.n), np.inf)
    for v, (frame, q) in enumerate(rows):
        place = np.arange(len(frame)) - np.searchsorted(frame, frame)
        states[frame, place, v] = q
    return states


def _best(q: F64, shares: F64, largest: F64, window: int) -> tuple[F64 | None, int]:
    """Return the best way, and the most values that it crosses from point to point."""
    points, places, values, n = q.shape
    alive = np.isfinite(q[..., 0])
    label = np.where(alive[0], 0.0, np.inf)
    back = np.zeros((points, places, values), dtype=np.int32)
    for t in range(1, points):
        if not np.isfinite(label).any():
            return None, 0
        padded = np.full((places, values + 2 * window, n), np.inf)
        padded[:, window : window + values] = np.where(np.isfinite(label)[..., None], q[t - 1], np.inf)
        costs = np.full((places, values + 2 * window), np.inf)
        costs[:, window : window + values] = label
        label = np.full((places, values), np.inf)
        for place in range(places):
            columns = np.flatnonzero(alive[t, place])
            now = q[t, place, columns]
            for other in range(places):
                for shift in range(2 * window + 1):
                    before = padded[other, columns + shift]
                    near = np.flatnonzero(np.abs(before[:, 0] - now[:, 0]) <= largest[t - 1, 0])
                    if not len(near):
                        continue
                    apart = np.abs(before[near] - now[near])
                    good = (apart <= largest[t - 1]).all(axis=1)
                    near, apart = near[good], apart[good]
                    cost = costs[other, columns[near] + shift] + (apart**2).sum(axis=1) / shares[t - 1]
                    better = cost < label[place, columns[near]]
                    chosen = columns[near[better]]
                    label[place, chosen] = cost[better]
                    back[t, place, chosen] = other * values + chosen + shift - window
    if not np.isfinite(label).any():
        return None, 0
    state = int(label.argmin())
    way, crossed = np.empty((points, n)), 0
    for t in range(points - 1, -1, -1):
        place, value = divmod(state, values)
        way[t] = q[t, place, value]
        if t:
            state = int(back[t, place, value])
            crossed = max(crossed, abs(state % values - value))
    return way, crossed
