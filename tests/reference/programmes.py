"""Random quadratic programmes with known properties, and what a claimed answer is worth by the numbers alone.

Everything is judged by the optimality conditions: no solver's own word counts.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from tests.reference.chain import F64

KINDS = ("generic", "degenerate", "infeasible", "tight")
SHARES = (0.4, 0.25, 0.15, 0.2)
SLIGHTEST = 1e-4
"""How far, at least, a combination of the rows of an infeasible programme is out of reach."""


@dataclass(frozen=True)
class Programme:
    """Minimise ``x'Hx/2 + g'x`` within ``lower <= x <= upper`` and ``row_lower <= A x <= row_upper``."""

    kind: str
    h: F64
    g: F64
    lower: F64
    upper: F64
    rows: F64
    row_lower: F64
    row_upper: F64

    @property
    def n(self) -> int:
        """Number of variables."""
        return len(self.g)

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `redundancy.solve_qp`."""
        names = ("h", "g", "lower", "upper", "rows", "row_lower", "row_upper")
        return {name: getattr(self, name) for name in names}

    def stacked(self) -> tuple[F64, F64, F64]:
        """Return all normals, those of the bounds first, with their limits."""
        normals = np.vstack([np.eye(self.n), self.rows])
        return normals, np.r_[self.lower, self.row_lower], np.r_[self.upper, self.row_upper]


def random_programme(rng: np.random.Generator, kind: str | None = None, n: int | None = None) -> Programme:
    """Return a strictly convex programme of 2 to 20 variables and 0 to 40 rows.

    H = V diag(10^-u) V' with V orthonormal and u uniform in [0, c], c uniform in [0, 4]; g is H times a vector of
    length about 3. Every row is standard normal. Around a feasible point x0 each side of a limit is there with
    probability 1/2 for the bounds and 0.7 for the rows; up to n/3 of the rows are equalities.

    - generic: the slack at x0 of every limit is uniform in [0, 1].
    - degenerate: integer rows, a third of them copies, sums or multiples of others; two thirds of all slacks are zero,
      and for half the programmes x0 is the minimiser itself, with most multipliers zero.
    - infeasible: generic, and a row that is a combination of up to four sides with positive weights, asked to be beyond
      what these sides allow by 1e-4 to 1.
    - tight: slacks between -0.05 and 0.3 about x0 without regard to whether any point is left.
    """
    kind = str(rng.choice(KINDS, p=SHARES)) if kind is None else kind
    n = int(rng.integers(2, 21)) if n is None else n
    m = int(rng.integers(0, 41)) if kind != "infeasible" else int(rng.integers(2, 41))
    basis, _ = np.linalg.qr(rng.standard_normal((n, n)))
    h = (basis * 10.0 ** -rng.uniform(0.0, rng.uniform(0.0, 4.0) + 1e-300, n)) @ basis.T
    h = 0.5 * (h + h.T)
    g = h @ rng.standard_normal(n) * 3.0
    x0 = rng.uniform(-1.0, 1.0, n)
    rows = rng.standard_normal((m, n))
    slack = rng.uniform(0.0, 1.0, (2, n + m))
    if kind == "degenerate":
        rows = rng.integers(-2, 3, (m, n)).astype(np.float64)
        for k in range(1, m):
            if rng.random() < 1.0 / 3.0:
                rows[k] = (
                    rng.choice((-1.0, 1.0, 2.0)) * rows[rng.integers(k)] + rng.integers(0, 2) * rows[rng.integers(k)]
                )
        x0 = np.round(4.0 * x0) / 4.0
        slack[rng.random((2, n + m)) < 2.0 / 3.0] = 0.0
    elif kind == "tight":
        slack = rng.uniform(-0.05, 0.3, (2, n + m))
    normals = np.vstack([np.eye(n), rows])
    there = np.r_[rng.random(n) < 0.5, rng.random(m) < 0.7], np.r_[rng.random(n) < 0.5, rng.random(m) < 0.7]
    limits = np.where(there[0], normals @ x0 - slack[0], -np.inf), np.where(there[1], normals @ x0 + slack[1], np.inf)
    equal = n + rng.permutation(m)[: int(rng.integers(0, n // 3 + 1))]
    for limit in limits:
        limit[equal] = normals[equal] @ x0
    if kind == "tight":
        # Crossed limits are another matter.
        crossed = limits[0] > limits[1]
        limits[0][crossed] = limits[1][crossed]
    if kind == "degenerate" and rng.random() < 0.5:
        # Few digits, so that g is exact and x0 the minimiser to the last bit.
        h = np.round(h * 2.0**20) / 2.0**20
        weights = np.where(rng.random((2, n + m)) < 0.3, np.round(16.0 * rng.uniform(0.0, 2.0, (2, n + m))) / 16.0, 0.0)
        weights[0][limits[0] < normals @ x0] = 0.0
        weights[1][limits[1] > normals @ x0] = 0.0
        g = normals.T @ (weights[0] - weights[1]) - h @ x0
    lower, upper = limits
    if kind == "infeasible":
        finite = np.flatnonzero(np.isfinite(lower[: n + m - 1]))
        if not len(finite):
            lower[0], finite = x0[0] - 0.5, np.array([0])
        chosen = rng.permutation(finite)[: int(rng.integers(1, 5))]
        weights = rng.uniform(0.2, 1.0, len(chosen))
        # w'(C x) >= w'l for every x that keeps the sides chosen: less is out of reach.
        rows[-1] = weights @ normals[chosen]
        lower[-1] = -np.inf
        upper[-1] = weights @ lower[chosen] - 10.0 ** rng.uniform(np.log10(SLIGHTEST), 0.0)
    return Programme(kind, h, g, lower[:n], upper[:n], rows, lower[n:], upper[n:])


def residual(programme: Programme, x: F64, multipliers: F64) -> float:
    """Return the largest violation of the optimality conditions, relative to the numbers that they are made of.

    Multipliers are positive at lower limits and negative at upper ones, bounds first.
    """
    normals, lower, upper = programme.stacked()
    value, size = normals @ x, np.abs(normals) @ np.abs(x) + 1.0
    short = np.maximum(np.maximum(lower - value, value - upper), 0.0) / size
    left = np.abs(programme.h @ x + programme.g - normals.T @ multipliers)
    made_of = np.abs(programme.h) @ np.abs(x) + np.abs(programme.g) + np.abs(normals).T @ np.abs(multipliers)
    # A multiplier belongs to a limit that is met: either of them is small.
    to_limit = np.where(multipliers > 0.0, value - lower, upper - value) / size
    slack = np.minimum(np.abs(multipliers) / max(1.0, np.abs(multipliers).max(initial=0.0)), np.abs(to_limit))
    return float(max(short.max(), left.max() / max(1.0, made_of.max()), slack.max()))


@dataclass(frozen=True)
class Proof:
    """A minimiser to twice the digits, or nearly, and how far from it the true one can be."""

    x: F64
    error: float
    """Bound of ``|x - x*|_H / max(1, |x|_H)``."""

    def distance(self, programme: Programme, x: F64) -> float:
        """Return the distance of another point, in the same measure."""
        return _length(programme, x - self.x) / max(1.0, _length(programme, self.x))


def _length(programme: Programme, x: F64) -> float:
    return float(np.sqrt(max(float(x @ programme.h @ x), 0.0)))


_BITS = 192
"""Of fractions, in fixed point."""


def _fixed(a: F64) -> Any:
    """Return whole numbers of 2^-_BITS."""
    numbers = [int(Fraction(float(value)) * 2**_BITS) for value in np.ravel(a)]
    return np.array(numbers, dtype=object).reshape(np.shape(a))


def _times(a: Any, b: Any) -> Any:
    return (a @ b) >> _BITS if a.size and b.size else np.zeros(len(a), dtype=object)


def _float(a: Any) -> F64:
    return np.array([float(Fraction(int(value), 2**_BITS)) for value in a], dtype=np.float64)


def prove(programme: Programme, multipliers: F64) -> Proof:
    """Solve the optimality conditions for the limits whose multipliers are not zero, and see how well all others hold.

    With Hx + g = C'y + r, y of the right signs, and violations d of the limits,
    ``|x - x*|_H <= |r|_{H^-1} + sqrt(y'|Cx - limits| + y*'d)``. Because of the root everything is computed with 192
    bits after the point. Wrong signs are taken out of y, so that they are part of r; y* counts as the largest of y.
    """
    normals, lower, upper = programme.stacked()
    n, active = programme.n, np.flatnonzero(multipliers)
    limits = np.where(multipliers > 0.0, lower, upper)[active]
    size = n + len(active)
    system = np.zeros((size, size))
    system[:n, :n], system[:n, n:], system[n:, :n] = programme.h, -normals[active].T, normals[active]
    right = np.r_[-programme.g, limits]
    nothing = Proof(np.full(n, np.nan), np.inf)
    if not np.isfinite(right).all():
        return nothing
    try:
        inverse = np.linalg.inv(system)
    except np.linalg.LinAlgError:
        return nothing
    exact, wanted, found = _fixed(system), _fixed(right), np.zeros(size, dtype=object)
    for _ in range(20):
        missing = wanted - _times(exact, found)
        # Scaled up, so that small numbers keep their digits.
        largest = max(abs(int(value)) for value in missing)
        if largest <= size:
            break
        shift = max(_BITS - largest.bit_length(), 0)
        found = found + (_fixed(inverse @ _float(missing << shift)) >> shift)
    x, y = found[:n], np.zeros(len(lower), dtype=object)
    y[active] = found[n:]
    wrong = (_float(y) * multipliers < 0.0) & (lower != upper)
    y[wrong] = 0
    value, slack = _times(_fixed(normals), x), 4 * size
    rest = _float(_times(_fixed(programme.h), x) + _fixed(programme.g) - _times(_fixed(normals.T.copy()), y))
    off = np.zeros(len(lower))
    for side, limit in ((1, lower), (-1, upper)):
        there = np.isfinite(limit)
        short = side * (_fixed(limit[there]) - value[there])
        # Last places of the fixed point are no violation.
        short[short <= slack] = 0
        off[there] = np.maximum(off[there], _float(short))
    apart = np.abs(_float(value[active] - wanted[n:]))
    largest_y = np.abs(_float(y))
    gap = float(largest_y[active] @ apart + largest_y.max(initial=0.0) * off.sum())
    error = float(np.sqrt(max(float(rest @ np.linalg.solve(programme.h, rest)), 0.0)) + np.sqrt(gap) + off.max())
    minimiser = _float(x)
    return Proof(minimiser, error / max(1.0, _length(programme, minimiser)))


def out_of_reach(programme: Programme, multipliers: F64) -> float:
    """Return the largest |x| (sum norm over the certificate's remainder) up to which a certificate excludes every x.

    Zero if it proves nothing; infinite if the combination of normals vanishes exactly.
    """
    normals, lower, upper = programme.stacked()
    push, pull = np.maximum(multipliers, 0.0), np.maximum(-multipliers, 0.0)
    if np.isneginf(lower[push > 0.0]).any() or np.isposinf(upper[pull > 0.0]).any():
        return 0.0
    asked = push @ np.where(push > 0.0, lower, 0.0) - pull @ np.where(pull > 0.0, upper, 0.0)
    # Rounding of this very product is no contradiction.
    asked -= 1e-14 * (push @ np.where(push > 0.0, np.abs(lower), 0.0) + pull @ np.where(pull > 0.0, np.abs(upper), 0.0))
    left = float(np.abs(normals.T @ multipliers).max())
    if asked <= 0.0:
        return 0.0
    return float(asked / left) if left > 0.0 else np.inf
