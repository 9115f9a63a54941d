"""Floating-point operations of kappa_F^2, its gradient and its Hessian for a 6R robot: ``python -m evidence.flops``.

The routines below say in Python what rust/src/index/condition.rs, rust/src/linalg and rust/src/kinematics do for six
rows and six joints, loop by loop, with numbers that count what is done to them. An operation is an addition, a
subtraction, a multiplication or a division; adding to a fresh zero and changing a sign are none. The Jacobian is given,
as in the count of Leger (2014, 3.1.2 and 3.1.4). The results are compared with the package's own, so that what is
counted is what is computed.
"""

import sys
from typing import Any

import numpy as np
import redundancy as rd

from evidence import pages

N = 6
LENGTH = 0.4855933
THESIS = {"gradient": 1763, "Hessian": 23796}
"""Leger (2014), eq. (3.36) and (3.48a)."""


class Number:
    """A float that counts the operations in which it takes part."""

    count = 0

    def __init__(self, value: float) -> None:
        self.value = float(value)

    def _with(self, other: Any, value: float) -> "Number":  # noqa: ANN401
        Number.count += 1
        return Number(value)

    def __add__(self, other: "Number") -> "Number":
        return self._with(other, self.value + other.value)

    def __sub__(self, other: "Number") -> "Number":
        return self._with(other, self.value - other.value)

    def __mul__(self, other: "Number") -> "Number":
        return self._with(other, self.value * other.value)

    def __truediv__(self, other: "Number") -> "Number":
        return self._with(other, self.value / other.value)

    def __neg__(self) -> "Number":
        return Number(-self.value)


Vector = list[Number]
Matrix = list[list[Number]]

ONE, TWO = Number(1.0), Number(2.0)


def total(terms: list[Number]) -> Number:
    """Add some numbers."""
    result = terms[0]
    for term in terms[1:]:
        result = result + term
    return result


def dot(a: Vector, b: Vector) -> Number:
    """Multiply two vectors."""
    return total([x * y for x, y in zip(a, b, strict=True)])


def cross(a: Vector, b: Vector) -> Vector:
    """Return a x b."""
    return [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]


def add(a: Vector, b: Vector) -> Vector:
    """Return a + b."""
    return [x + y for x, y in zip(a, b, strict=True)]


def sub(a: Vector, b: Vector) -> Vector:
    """Return a - b."""
    return [x - y for x, y in zip(a, b, strict=True)]


def scale(s: Number, a: Vector) -> Vector:
    """Return s a."""
    return [s * x for x in a]


def transposed(a: Matrix) -> Matrix:
    """Return a'."""
    return [list(row) for row in zip(*a, strict=True)]


def normalised(a: Matrix) -> Matrix:
    """Multiply the angular rows by the length."""
    return [scale(Number(LENGTH), row) if r < 3 else row for r, row in enumerate(a)]


def pseudo_inverse(a: Matrix) -> Matrix:
    """Return the columns of the inverse by Gram-Schmidt without square roots, every row orthogonalised twice."""
    o = [list(row) for row in a]
    square: Vector = []
    reciprocal: Vector = []
    u = [[Number(0.0)] * N for _ in range(N)]
    for k in range(N):
        vector = list(o[k])
        for j in range(k):
            factor = dot(o[j], vector) * reciprocal[j]
            u[j][k] = u[j][k] + factor
            o[k] = sub(o[k], scale(factor, o[j]))
        square.append(dot(o[k], o[k]))
        reciprocal.append(ONE / square[k])
        for c in range(k + 1, N):
            u[k][c] = dot(o[k], o[c]) * reciprocal[k]
            o[c] = sub(o[c], scale(u[k][c], o[k]))
    p = o
    for k in reversed(range(N)):
        p[k] = [x / square[k] for x in p[k]]
        for j in range(k + 1, N):
            p[k] = sub(p[k], scale(u[k][j], p[j]))
    return p


def gram(a: Matrix) -> Matrix:
    """Return a a', computed once above the diagonal."""
    upper = [[dot(a[r], a[c]) if c >= r else ONE for c in range(N)] for r in range(N)]
    return [[upper[min(r, c)][max(r, c)] for c in range(N)] for r in range(N)]


def omega_of(dj: Matrix, p: Matrix, k: int) -> Matrix:
    """Return dJ_k P; the angular part of dJ_i/dq_k vanishes for i <= k."""
    zero = Number(0.0)
    columns = [range(k + 1, N) if r < 3 else range(N) for r in range(N)]
    return [
        [total([dj[r][i] * p[c][i] for i in columns[r]]) if columns[r] else zero for c in range(N)] for r in range(N)
    ]


def pull_back(w: Matrix, v: Matrix, y: Matrix) -> Vector:
    """Return <Y, dJ/dq_k> for every k, by running sums."""
    inner, outer = [Number(0.0)] * 3, [Number(0.0)] * 3
    gradient = []
    for k in range(N):
        turned = cross(y[k][3:], w[k])
        inner = add(inner, turned) if k else turned
        gradient.append(dot(v[k], inner))
    for k in reversed(range(N)):
        if k < N - 1:
            gradient[k] = gradient[k] + dot(w[k], outer)
        turned = add(cross(w[k], y[k][:3]), cross(v[k], y[k][3:]))
        outer = add(outer, turned) if k < N - 1 else turned
    return gradient


def accumulate(m: Matrix | None, a: Vector, b: Vector) -> Matrix:
    """Return m + a b'."""
    product = [scale(x, b) for x in a]
    return product if m is None else [add(p, q) for p, q in zip(m, product, strict=True)]


def trace(m: Matrix) -> Number:
    """Return the trace."""
    return total([m[i][i] for i in range(len(m))])


def pull_back_second(w: Matrix, v: Matrix, y: Matrix, hessian: Matrix) -> None:
    """Add <Y, d2J/dq_k dq_l> to the upper triangle."""
    middle: Matrix | None = None
    inner: Vector | None = None
    left, full, traces = [], [], []
    for k in range(N):
        middle = accumulate(middle, w[k], y[k][3:])
        turned = cross(y[k][3:], w[k])
        inner = add(inner, turned) if inner else turned
        traces.append(trace(middle))
        left.append(add([dot(row, w[k]) for row in transposed(middle)], cross(inner, w[k])))
        full.append([dot(row, v[k]) for row in middle])
    outer: Matrix | None = None
    for l in reversed(range(N)):  # noqa: E741
        against = sub(scale(traces[l], v[l]), full[l])
        if outer is not None:
            turned = sub([dot(row, w[l]) for row in transposed(outer)], scale(trace(outer), w[l]))
            against = sub(add(turned, scale(traces[l], v[l])), full[l])
        for k in range(l + 1):
            entry = dot(w[k], against) - traces[k] * dot(w[k], v[l]) + dot(left[k], v[l])
            hessian[k][l] = hessian[k][l] + entry
        outer = accumulate(accumulate(outer, y[l][:3], w[l]), y[l][3:], v[l])


class Ledger:
    """What each part of the computation cost."""

    def __init__(self) -> None:
        self.parts: list[tuple[str, str, int]] = []
        Number.count = 0

    def note(self, order: str, part: str) -> None:
        """Put down what was counted since the last note."""
        self.parts.append((order, part, Number.count))
        Number.count = 0

    def upto(self, *orders: str) -> int:
        """Sum what some orders cost."""
        return sum(count for order, _, count in self.parts if order in orders)


def condition(jacobian: np.ndarray) -> tuple[Ledger, Number, Vector, Matrix]:
    """Return costs, kappa_F^2, its gradient and its Hessian."""
    columns = [[Number(x) for x in column] for column in jacobian.T]
    w, v = [c[:3] for c in columns], [c[3:] for c in columns]
    ledger = Ledger()

    jn = normalised(transposed(columns))
    ledger.note("value", "J_n")
    p = pseudo_inverse(jn)
    ledger.note("value", "P = J_n^-1: orthogonal factors, back substitution")
    weight = gram(p)
    ledger.note("value", "W = P'P")
    a, b = total([dot(row, row) for row in jn]), trace(weight)
    factor = ONE / Number(N * N)
    value = factor * a * b
    ledger.note("value", "a = tr J_n J_n', b = tr W, kappa^2 = a b / 36")

    w_pt = [[dot(weight[r], [p[j][i] for j in range(N)]) for i in range(N)] for r in range(N)]
    ledger.note("gradient", "W P'")
    twice_factor = TWO * factor
    for_jn, for_p = twice_factor * b, twice_factor * a
    y = []
    for i in range(N):
        column = [for_jn * jn[r][i] - for_p * w_pt[r][i] for r in range(N)]
        y.append([Number(LENGTH) * x if r < 3 else x for r, x in enumerate(column)])
    ledger.note("gradient", "Y = d(kappa^2)/dJ")
    gradient = pull_back(w, v, y)
    ledger.note("gradient", "sweep to the joints")

    dj = [[(cross(w[k], w[i]) + cross(w[k], v[i])) if i > k else cross(w[i], v[k]) for i in range(N)] for k in range(N)]
    dj = [transposed([column if len(column) == 6 else [Number(0.0)] * 3 + column for column in part]) for part in dj]
    ledger.note("Hessian", "dJ/dq")
    dj = [normalised(part) for part in dj]
    omega = [omega_of(part, p, k) for k, part in enumerate(dj)]
    ledger.note("Hessian", "Omega_k = dJ_k P, k = 1..6")
    product = [[[dot(weight[r], column) for column in transposed(part)] for r in range(N)] for part in omega]
    twice = [[add(row, column) for row, column in zip(m, transposed(m), strict=True)] for m in product]
    db = [-(TWO * trace(m)) for m in product]
    ledger.note("Hessian", "W Omega_k, its symmetric part and trace")
    second = [[Number(0.0)] * N for _ in range(N)]
    da = [TWO * total([dot(jn[r], part[r]) for r in range(N)]) for part in dj]
    ledger.note("Hessian", "da_k = 2 <J_n, dJ_k>")
    for k in range(N):
        for l in range(k, N):  # noqa: E741
            turned = transposed(product[l])
            pairs = [(twice[k][r][c], omega[l][r][c]) for r in range(N) for c in range(N)]
            pairs += [(turned[r][c], omega[k][r][c]) for r in range(N) for c in range(N)]
            curvature = total([x * z for x, z in pairs])
            norms = total([dot(dj[k][r], dj[l][r]) for r in range(N)])
            mixed = da[k] * db[l] + da[l] * db[k]
            second[k][l] = factor * (TWO * (a * curvature + b * norms) + mixed)
    ledger.note("Hessian", "second derivative along dJ_k, dJ_l, k <= l")
    pull_back_second(w, v, y, second)
    ledger.note("Hessian", "curvature of J, by a sweep")
    return ledger, value, gradient, second


def check(value: Number, gradient: Vector, hessian: Matrix, robot: rd.Robot, q: np.ndarray) -> None:
    """Compare with the package."""
    index = rd.ConditionNumber(LENGTH, squared=True)
    wanted = index.evaluate(robot, q)
    upper = np.triu([[x.value for x in row] for row in hessian])
    np.testing.assert_allclose(value.value, wanted[0], rtol=1e-12)
    np.testing.assert_allclose([x.value for x in gradient], wanted[1], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(upper, np.triu(wanted[2]), rtol=1e-10, atol=1e-10)


def count() -> Ledger:
    """Count, and check that what was counted is right."""
    robot = rd.robots.get("fanuc_m710ic50_milling")
    q = np.array([0.3, 0.7, -0.4, 0.9, -1.1, 0.5])
    ledger, value, gradient, hessian = condition(robot.jacobian(q))
    check(value, gradient, hessian, robot, q)
    return ledger


def table(ledger: Ledger) -> str:
    """Return the counts as a Markdown table."""
    gradient, hessian = ledger.upto("value", "gradient"), ledger.upto("value", "gradient", "Hessian")
    ratio = THESIS["Hessian"] / THESIS["gradient"]
    sums = [
        (f"**value and gradient** (thesis: {THESIS['gradient']})", f"**{gradient}**"),
        (f"**value, gradient and Hessian** (thesis: {THESIS['Hessian']})", f"**{hessian}**"),
        (f"Hessian over gradient (thesis: {ratio:.1f})", f"{hessian / gradient:.1f}"),
    ]
    return pages.table(("order", "part", "operations"), [*ledger.parts, *(("", *row) for row in sums)])


if __name__ == "__main__":
    sys.stdout.write(table(count()) + "\n")
