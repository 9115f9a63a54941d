"""The least cost of one joint by a scan: the whole cost at rotated poses, polished where its derivative changes sign.

Nothing here knows that the cost has a closed form: positions, orientations and points are moved by a rotation matrix or
a quaternion product, a grid over the range is searched, and the derivative, from that of the rotation, is bisected
around the lowest points of the grid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import redundancy as rd

F64: TypeAlias = npt.NDArray[np.float64]
GRID = 121
"""Points of the scan: the cost has no more than four extrema a turn."""
LOWEST = 3
"""Lowest points of the grid that are polished."""
HALVINGS = 54


@dataclass
class Cases:
    """Many joints with what they carry; every field has one row a case."""

    turns: npt.NDArray[np.bool_]
    axis: F64
    origin: F64
    position: tuple[F64, F64]
    orientation: tuple[F64, F64]
    quaternion_metric: npt.NDArray[np.bool_]
    by_axis: npt.NDArray[np.bool_]
    w_p: F64
    w_o: F64
    low: F64
    high: F64
    point: tuple[F64, F64]
    w_point: F64
    from_middle: F64
    w_middle: F64

    @cached_property
    def matrices(self) -> tuple[F64, F64]:
        """Return the rotation matrices of the present and the wanted orientations."""
        now, goal = (matrix(q) for q in self.orientation)
        return now, goal

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self.turns)

    def found(self, i: int) -> tuple[float, float]:
        """Return what the package says of case `i`."""
        keywords: dict[str, Any] = {}
        if self.by_axis[i]:
            z, wanted = (r[i, :, 2] for r in self.matrices)
            keywords |= {"current_axis": z, "desired_axis": wanted}
        else:
            keywords |= dict(
                zip(("current_orientation", "desired_orientation"), (q[i] for q in self.orientation), strict=True)
            )
        if self.w_point[i]:
            keywords["points"] = [(*(p[i] for p in self.point), self.w_point[i])]
        change, value = rd.one_joint_minimum(
            "R" if self.turns[i] else "P",
            self.axis[i],
            self.origin[i],
            current_position=self.position[0][i],
            desired_position=self.position[1][i],
            w_p=self.w_p[i],
            w_o=self.w_o[i],
            orientation_metric="quaternion" if self.quaternion_metric[i] else "frobenius",
            change_min=self.low[i],
            change_max=self.high[i],
            centring=(self.from_middle[i], self.w_middle[i]),
            **keywords,
        )
        return change, value

    def cost(self, x: F64) -> tuple[F64, F64]:
        """Return the cost and its derivative at changes x (N, M)."""
        turn = np.where(self.turns[:, None], x, 0.0)
        g, slope = np.zeros_like(x), np.zeros_like(x)
        for (now, goal), weight in ((self.position, self.w_p), (self.point, self.w_point)):
            arm = now - self.origin
            r = rotated(self.axis, turn, arm)
            slide = np.where(self.turns[:, None], 0.0, x)[..., None] * self.axis[:, None]
            miss = r + slide + (self.origin - goal)[:, None]
            velocity = np.where(self.turns[:, None, None], np.cross(self.axis[:, None], r), self.axis[:, None])
            g += weight[:, None] * (miss**2).sum(-1)
            slope += 2 * weight[:, None] * (miss * velocity).sum(-1)
        value, derivative = self._orientation(turn)
        g += self.w_o[:, None] * value
        slope += np.where(self.turns[:, None], self.w_o[:, None] * derivative, 0.0)
        off, w = self.from_middle[:, None] + x, self.w_middle[:, None]
        g += w * np.where(self.turns[:, None], 2 * np.sin(off / 2) ** 2, off**2 / 2)
        slope += w * np.where(self.turns[:, None], np.sin(off), off)
        return g, slope

    def _orientation(self, turn: F64) -> tuple[F64, F64]:
        now, goal = self.matrices
        u = self.axis[:, None]
        value, derivative = np.zeros_like(turn), np.zeros_like(turn)
        for k in range(3):
            seen = np.where(self.by_axis, k == 2, ~self.quaternion_metric)[:, None]
            r = rotated(self.axis, turn, now[:, :, k])
            miss = r - goal[:, None, :, k]
            value += np.where(seen, (miss**2).sum(-1), 0.0)
            derivative += np.where(seen, 2 * (miss * np.cross(u, r)).sum(-1), 0.0)
        c, d = (q[:, None] for q in self.orientation)
        turned, rate = product(quaternion(u, turn / 2), c), product(quaternion(u, (turn + np.pi) / 2), c) / 2
        nearer = np.where((turned * d).sum(-1) < 0, -1.0, 1.0)[..., None] * d
        seen = (self.quaternion_metric & ~self.by_axis)[:, None]
        # 2 - 2 |<c, d>| is the squared distance to the nearer sign.
        value += np.where(seen, ((turned - nearer) ** 2).sum(-1), 0.0)
        derivative += np.where(seen, -2 * (rate * nearer).sum(-1), 0.0)
        return value, derivative

    def change_of_sign(self, low: F64) -> F64:
        """Return the first change from `low` on at which both signs of the quaternion are as near."""
        c, d = self.orientation
        at_zero, at_half = (
            (product(quaternion(self.axis, np.full(len(self), x)), c) * d).sum(1) for x in (0, np.pi / 2)
        )
        kink = 2 * np.arctan2(-at_zero, at_half)
        first: F64 = kink + 2 * np.pi * np.ceil((low - kink) / (2 * np.pi))
        return first

    def least(self) -> F64:
        """Return the least cost over each range."""
        low, high = self.low.copy(), self.high.copy()
        whole = self.turns & (high - low >= 2 * np.pi)
        low[whole], high[whole] = -np.pi, np.pi
        # A slide is a parabola: around its vertex, where the slopes at two places lead to, and at the ends.
        _, slope = self.cost(np.tile([0.0, 1.0], (len(self), 1)))
        bend = np.diff(slope)[:, 0]
        vertex = -slope[:, 0] / np.where(bend == 0, 1.0, bend)
        ends = np.stack([np.where(np.isfinite(end), end, 0.0) for end in (low, high)], axis=1)
        bounded = np.isfinite(self.low) & np.isfinite(self.high)
        ends = np.where(bounded[:, None], ends, np.clip(vertex, low, high)[:, None])
        around = np.clip(vertex[:, None] + [-1.0, 1.0], low[:, None], high[:, None])
        low, high = np.where(self.turns, [low, high], around.T)
        x = low[:, None] + (high - low)[:, None] * np.linspace(0.0, 1.0, GRID)
        g, _ = self.cost(x)
        order = np.argsort(g, axis=1)[:, :LOWEST]
        below = np.take_along_axis(x, np.maximum(order - 1, 0), axis=1)
        above = np.take_along_axis(x, np.minimum(order + 1, GRID - 1), axis=1)
        # On each side of where the nearer sign of the quaternion changes there may be one of its own.
        kink, cell = self.change_of_sign(low)[:, None], ((high - low) / GRID)[:, None]
        below = np.clip(np.concatenate([below, kink - cell, kink], axis=1), low[:, None], high[:, None])
        above = np.clip(np.concatenate([above, kink, kink + cell], axis=1), low[:, None], high[:, None])
        for _ in range(HALVINGS):
            middle = 0.5 * (below + above)
            rising = self.cost(middle)[1] > 0
            below, above = np.where(rising, below, middle), np.where(rising, middle, above)
        at_ends = np.where(self.turns[:, None], np.inf, self.cost(ends)[0])
        values = np.concatenate([self.cost(below)[0], self.cost(above)[0], g, at_ends], axis=1)
        return np.asarray(values.min(axis=1))


def quaternion(u: F64, half: F64) -> F64:
    """Return the quaternions of rotations about u by twice an angle."""
    joined: F64 = np.concatenate([np.cos(half)[..., None], np.sin(half)[..., None] * u], axis=-1)
    return joined


def product(p: F64, q: F64) -> F64:
    """Return Hamilton's product."""
    w = p[..., :1] * q[..., :1] - (p[..., 1:] * q[..., 1:]).sum(-1, keepdims=True)
    v = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    joined: F64 = np.concatenate([w, v], axis=-1)
    return joined


def matrix(q: F64) -> F64:
    """Return the rotation matrices (N, 3, 3) of unit quaternions (N, 4), by the images of the axes."""
    images = [product(product(q, np.array([0.0, *e])), q * [1, -1, -1, -1])[:, 1:] for e in np.eye(3)]
    return np.stack(images, axis=-1)


def rotated(u: F64, angle: F64, v: F64) -> F64:
    """Return vectors v (N, 3) rotated about u (N, 3) by angles (N, M)."""
    k = np.zeros((len(u), 3, 3))
    k[:, 0, 1], k[:, 0, 2], k[:, 1, 2] = -u[:, 2], u[:, 1], -u[:, 0]
    k -= k.transpose(0, 2, 1)
    once = np.einsum("nij,nj->ni", k, v)
    twice = np.einsum("nij,nj->ni", k, once)
    out: F64 = v[:, None] + np.sin(angle)[..., None] * once[:, None] + (1 - np.cos(angle))[..., None] * twice[:, None]
    return out


def random_cases(rng: np.random.Generator, count: int) -> Cases:
    """Return random joints of all kinds; special places, weights and ranges often."""

    def directions(width: int) -> F64:
        v = rng.normal(size=(count, width))
        special = rng.random(count) < 0.2
        v[special] = np.eye(width)[rng.integers(0, width, special.sum())]
        unit: F64 = v / np.linalg.norm(v, axis=1, keepdims=True)
        return unit

    def some(p: float) -> npt.NDArray[np.bool_]:
        return rng.random(count) < p

    turns, axis, origin = some(0.85), directions(3), rng.normal(size=(count, 3))
    now, goal = rng.normal(size=(2, count, 3))
    c, d = directions(4), directions(4)
    near = some(0.2)
    error = 10 ** rng.uniform(-12, 0, near.sum())[:, None]
    goal[near] = now[near] + error * rng.normal(size=(near.sum(), 3))
    d[near] = c[near] + error * rng.normal(size=(near.sum(), 4))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    d[some(0.1)] *= -1.0
    half = some(0.05)
    d[half] = product(quaternion(directions(3)[half], np.full(half.sum(), np.pi / 2)), c[half])
    on_axis = some(0.05)
    goal[on_axis] = origin[on_axis] + rng.normal(size=(on_axis.sum(), 1)) * axis[on_axis]
    opposite = some(0.05)
    arm = now - origin
    along = (arm * axis).sum(1, keepdims=True) * axis
    goal[opposite] = (origin + 2 * along - arm)[opposite]
    low, high = _ranges(rng, count)
    w_p = np.where(some(0.15), 0.0, 10 ** rng.uniform(-2, 1, count))
    w_o = np.where(some(0.15), 0.0, 10 ** rng.uniform(-2, 1, count))
    w_point = np.where(some(0.6), 0.0, rng.uniform(-2.0, 3.0, count))
    # Nothing bounds a slide without limits that is pushed off.
    w_point = np.where(~turns & (w_p + w_point < 0.1) & ~np.isfinite(high - low), 0.2, w_point)
    return Cases(
        turns=turns,
        axis=axis,
        origin=origin,
        position=(now, goal),
        orientation=(c, d),
        quaternion_metric=some(0.4),
        by_axis=some(0.2),
        w_p=w_p,
        w_o=w_o,
        low=low,
        high=high,
        point=(rng.normal(size=(count, 3)), rng.normal(size=(count, 3))),
        w_point=w_point,
        from_middle=rng.uniform(-4, 4, count),
        w_middle=np.where(some(0.7), 0.0, rng.uniform(0.01, 1.0, count)),
    )


def _ranges(rng: np.random.Generator, count: int) -> tuple[F64, F64]:
    """Return ranges: around zero, beside it, wider than a turn, far off, one-sided, without end."""
    kinds: list[Callable[[], tuple[float, float]]] = [
        lambda: (-rng.uniform(0, 3), rng.uniform(0, 3)),
        lambda: (-(10 ** rng.uniform(-6, 0)), 10 ** rng.uniform(-6, 0)),
        lambda: (rng.uniform(0, 2), rng.uniform(2, 5)),
        lambda: (-rng.uniform(4, 9), -rng.uniform(0, 4)),
        lambda: (-rng.uniform(3, 9), rng.uniform(3, 9)),
        lambda: (-np.inf, rng.uniform(-3, 3)),
        lambda: (rng.uniform(-3, 3), np.inf),
        lambda: (-np.inf, np.inf),
        lambda: (0.0, rng.uniform(0, 3)),
    ]
    return tuple(np.array([kinds[k]() for k in rng.integers(0, len(kinds), count)]).T)


def misses(cases: Cases) -> tuple[F64, F64]:
    """Return, in units of 1 + |g|, how far values are from the scan, and from the cost at the change that is returned.

    A change outside its range counts as infinitely far.
    """
    found = np.array([cases.found(i) for i in range(len(cases))])
    change, value = found.T
    least, size = cases.least(), 1 + np.abs(value)
    inside = (change >= cases.low) & (change <= cases.high)
    there = cases.cost(change[:, None])[0][:, 0]
    return np.where(inside, np.abs(value - least) / size, np.inf), np.abs(there - value) / size
