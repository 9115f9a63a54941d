"""Derivatives by central differences of fourth order, with a sweep over the step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

F64: TypeAlias = npt.NDArray[np.float64]

STEPS = tuple(10.0 ** (-0.5 * k) for k in range(3, 11))


def difference(function: Callable[[F64], F64 | float], x: F64, step: float) -> F64:
    """Return the derivative of ``function`` at ``x``; the last axis is that of the variable."""
    columns = []
    for k in range(x.size):

        def at(times: float, k: int = k) -> F64:
            moved = x.copy()
            moved[k] += times * step
            return np.asarray(function(moved), dtype=np.float64)

        columns.append((8.0 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12.0 * step))
    return np.stack(columns, axis=-1)


def sweep(function: Callable[[F64], F64 | float], x: F64, got: F64, steps: Sequence[float] = STEPS) -> float:
    """Return the least error of ``got`` over the steps, relative to its largest entry and 1e-3 of the function.

    One step serves all entries: a wrong entry cannot find a step of its own that hides it.
    """
    value = np.abs(np.asarray(function(x), dtype=np.float64)).max()
    # The floor is for derivatives that are nothing but rounding.
    scale = max(float(np.abs(got).max()), 1e-3 * float(value), 1e-6)
    return min(float(np.abs(difference(function, x, step) - got).max()) for step in steps) / scale
