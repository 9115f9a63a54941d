"""Indices of conditioning with their derivatives, one posture a call."""

from collections.abc import Callable

import pytest

from .contender import PER_POSTURE
from .ours import INDICES

pytestmark = pytest.mark.benchmark(**PER_POSTURE)


@pytest.mark.parametrize("library", ["redundancy", "CasADi C"])
@pytest.mark.parametrize("quantity", INDICES)
def test_index(race: Callable[[str, str], None], quantity: str, library: str) -> None:
    race(quantity, library)
