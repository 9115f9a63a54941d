"""Derivatives of m by differences and by BFGS beside exact ones, for docs/reproduction_dufour.md."""

import numpy as np
from numpy.typing import NDArray

from evidence.dufour import cases as duf
from evidence.dufour.runs import INDEX

F64 = NDArray[np.float64]


def differences(q: F64, step: float) -> tuple[F64, F64]:
    """Return the gradients (17) and the Hessians (19) of m at postures (N, 7)."""
    robot, unit = duf.robot(), step * np.eye(7)

    def m(postures: F64) -> F64:
        values: F64 = INDEX.evaluate_many(robot, postures, 0)[0]
        return values

    gradient = np.stack([m(q + e) - m(q - e) for e in unit], axis=1) / (2.0 * step)
    hessian = np.empty((len(q), 7, 7))
    for i, a in enumerate(unit):
        for j, b in enumerate(unit):
            forth, back = m(q + a + b) - m(q + a - b), m(q - a + b) - m(q - a - b)
            hessian[:, i, j] = (forth - back) / (4.0 * step**2)
    return gradient, hessian


def bfgs(q: F64, as_printed: bool = False) -> tuple[F64, float]:
    """Return what BFGS makes of the Hessian of -m along a motion, and the share of ticks at which it learns.

    The direct update, or (20) as printed; both learn only where s'y > 0.
    """
    gradient = INDEX.evaluate_many(duf.robot(), q, 1)[1]
    assert gradient is not None
    matrix, out, learnt = np.zeros((7, 7)), [np.zeros((7, 7))], 0
    for k in range(1, len(q)):
        s, y = q[k] - q[k - 1], gradient[k - 1] - gradient[k]
        if s @ y > 1.5e-8 * np.linalg.norm(s) * np.linalg.norm(y):
            learnt += 1
            if not matrix.any():
                matrix = (s @ y) / (y @ y) * np.eye(7) if as_printed else (y @ y) / (s @ y) * np.eye(7)
            if as_printed:
                left = np.eye(7) - np.outer(s, y) / (s @ y)
                matrix = left @ matrix @ left.T + np.outer(s, s) / (s @ y)
            else:
                hs = matrix @ s
                matrix = matrix + np.outer(y, y) / (s @ y) - np.outer(hs, hs) / (s @ hs)
        out.append(matrix)
    return np.array(out), learnt / (len(q) - 1)


def relative(found: F64, exact: F64) -> F64:
    """Return the errors of vectors or matrices (N, ...) as parts of their lengths."""
    axes = tuple(range(1, exact.ndim))
    off: F64 = np.sqrt(((found - exact) ** 2).sum(axis=axes) / (exact**2).sum(axis=axes))
    return off
