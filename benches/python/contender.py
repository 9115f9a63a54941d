"""What is timed: one library computing one quantity."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from .chains import F64, POSTURES

Clock = Callable[[], float]


@dataclass(frozen=True)
class Contender:
    """`sweep` is timed; `result` tells what it made of the last posture, in this package's layout."""

    sweep: Callable[[Sequence[F64]], None]
    result: Callable[[], tuple[F64, ...]]
    keep: object = None
    """What has to live as long."""

    def value(self, q: F64) -> tuple[F64, ...]:
        """Compute for one posture."""
        self.sweep([q])
        return tuple(np.array(part, dtype=np.float64) for part in self.result())


def per(calls: int) -> Clock:
    """Return a clock on which one timed sweep of so many calls lasts as long as one call."""
    return lambda: perf_counter() / calls


PER_POSTURE = {"timer": per(POSTURES), "min_time": 2e-3 / POSTURES, "max_time": 1.0 / POSTURES, "min_rounds": 25}
"""Settings of pytest-benchmark: rounds of at least 2 ms, for a second."""


def assert_agree(ours: tuple[F64, ...], theirs: tuple[F64, ...], tolerance: float = 1e-10) -> None:
    """Fail unless every part agrees, relative to its largest element or 1."""
    assert len(ours) == len(theirs)
    for a, b in zip(ours, theirs, strict=True):
        assert a.shape == b.shape
        assert np.abs(a - b).max() <= tolerance * max(1.0, np.abs(a).max())
