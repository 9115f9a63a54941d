"""Forward kinematics, Jacobian and its derivative, one posture a call."""

from collections.abc import Callable

import pytest

from .contender import PER_POSTURE

pytestmark = pytest.mark.benchmark(**PER_POSTURE)


@pytest.mark.parametrize("library", ["redundancy", "pinocchio", "CasADi C"])
@pytest.mark.parametrize("quantity", ["fk", "jacobian", "jacobian_derivative"])
def test_kinematics(race: Callable[[str, str], None], quantity: str, library: str) -> None:
    race(quantity, library)
