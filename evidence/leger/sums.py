"""The operations of Leger (2014, 3.1.2 and 3.1.4), added up again from the terms that are printed."""

from itertools import pairwise

import numpy as np

from evidence import pages
from evidence.flops import THESIS, Matrix, N, Number, Vector

PAIRS = [(k, l) for k in range(1, N + 1) for l in range(k, N + 1)]  # noqa: E741
"""The 21 second derivatives."""
CROSS = 9


def lu(a: Matrix) -> None:
    """Factor a matrix in place, as L with ones on its diagonal and U."""
    for k in range(N):
        for r in range(k + 1, N):
            a[r][k] = a[r][k] / a[k][k]
            for c in range(k + 1, N):
                a[r][c] = a[r][c] - a[r][k] * a[k][c]


def backwards(u: Matrix, b: Vector) -> Vector:
    """Solve u x = b, u upper triangular."""
    x = list(b)
    for r in reversed(range(N)):
        for c in range(r + 1, N):
            x[r] = x[r] - u[r][c] * x[c]
        x[r] = x[r] / u[r][r]
    return x


def counted() -> tuple[int, int]:
    """Count every operation of the factors (3.24) and of one triangular system (3.26)."""
    rng = np.random.default_rng(0)
    matrix = [[Number(x) for x in row] for row in rng.normal(size=(N, N))]
    Number.count = 0
    lu(matrix)
    factors, Number.count = Number.count, 0
    backwards(matrix, [Number(1.0)] * N)
    triangle, Number.count = Number.count, 0
    return factors, triangle


def second_derivative(l: int) -> int:  # noqa: E741
    """Add up (3.43): by (3.41) a column beyond l costs five cross products, one before it three."""
    return sum((5 if i > l else 3) * CROSS for i in range(1, N + 1))


def sums() -> str:
    """Return the sums that are printed beside those of their own terms, as a Markdown table."""
    lu_factors, triangle = (2 * N - 1) * (N - 1), N * (N + 1) // 2  # (3.24), (3.26)
    all_factors, all_triangle = counted()
    tr1 = 2 * N**2 - 1  # (3.25)
    lower = 2 * N * tr1 + sum((3 if i > k else 2) * CROSS for k in range(2, N + 1) for i in range(1, N + 1))  # (3.35)

    def upper(factors: int, system: int, sides: int) -> int:
        """(3.31): X by four triangular systems (3.28) and its trace, Y by two (3.30), and tr1."""
        return factors + 6 * sides * system + N - 1 + tr1

    costs = [second_derivative(l) for l in range(1, N + 1)]  # noqa: E741
    (fall,) = {a - b for a, b in pairwise(costs)}
    second = sum(second_derivative(l) for _, l in PAIRS)  # noqa: E741
    tr5 = len(PAIRS) * 2 * tr1
    tr6 = len(PAIRS) * (tr1 + 2 * N**3 + N**2 - 1 + 5 * N**2 // 2 + N - 1)
    once = upper(lu_factors, triangle, 1) + lower
    rows = [
        ("(3.24)", "LU factors, multiplications alone", lu_factors, f"{all_factors} with subtractions and divisions"),
        ("(3.26)", "a triangular system, multiplications and divisions", triangle, f"{all_triangle} with subtractions"),
        ("(3.36)", "gradient, its terms as printed", THESIS["gradient"], once + 24),
        ("(3.36)", "the same, six right-hand sides for X and for Y", "", upper(lu_factors, triangle, N) + lower + 24),
        ("(3.36)", "the same, every operation", "", upper(all_factors, all_triangle, N) + lower + 24),
        ("(3.44)", "a second derivative of J", "270 - 27 l", f"{costs[0] + fall} - {fall} l"),
        ("(3.45)", "21 second derivatives of J", 5761, second),
        ("(3.46)", "21 of tr5", 2982, tr5),
        ("(3.47a)", "21 of tr6", 13314, tr6),
        ("(3.48a)", "Hessian, the terms as printed", THESIS["Hessian"], once + 5761 + 2982 + 13314 + 210),
        ("(3.48a)", "the same with (3.45), (3.47a) added up right", "", once + second + tr5 + tr6 + 210),
    ]
    return pages.table(("where", "operations, six revolute joints", "printed", "by its own terms"), rows)
