"""The grid of `evidence.planner.grid_search`: at each point of a path every spin of a ring, on each branch.

Only inverse solutions and their values come from the package.
"""

from dataclasses import dataclass, field
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy._core import Lattice

F64 = NDArray[np.float64]
Bool = NDArray[np.bool_]

SPINS: Final = 1440
JUMP: Final = 0.25
"""Longest motion of a joint from point to point of a path without times [rad]."""
LARGEST_WINDOW: Final = np.pi / 4.0
"""Largest change of the spin from point to point [rad]; less where the speed limits together allow no more."""
TURN: Final = 2.0 * np.pi
_CHUNK: Final = 64


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

    def motion(self, q: F64) -> float:
        """Return the integral of the squared joint speed over the path's share."""
        return float((np.diff(q, axis=0) ** 2).sum(axis=1) @ (1.0 / self.shares))


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
    lattice = Lattice(robot, frames, rd.Task.axisymmetric(), angles, [], np.zeros((1, 0)), objective, True)
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


def within_turns(q: F64, wide: Bool, robot: rd.Robot) -> tuple[F64, int | None]:
    """Return joints made continuous and within limits, and the first joint for which there are no such turns."""
    q = q.copy()
    for joint in np.flatnonzero(wide):
        column = np.unwrap(q[:, joint])
        turns = np.ceil((robot.q_min[joint] - column.min()) / TURN)
        q[:, joint] = column + TURN * turns
        if q[:, joint].max() > robot.q_max[joint]:
            return q, int(joint)
    return q, None


def with_turns(branch: Branch, joint: int, robot: rd.Robot) -> tuple[Branch, int]:
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
