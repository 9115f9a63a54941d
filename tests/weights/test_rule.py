"""Which performance is better, and what a trajectory performs."""

import math

import numpy as np
import pytest
import redundancy as rd
from redundancy import weights as rw

from tests.weights.cylinders import FANUC, performance


@pytest.mark.parametrize(
    ("new", "old", "expected"),
    [
        # Out of the limits only they count.
        (performance(0.1, 90.0), performance(0.2, 3.0), True),
        (performance(-0.3, 90.0), performance(0.2, 3.0), True),
        (performance(0.01, 3.0), performance(-0.3, 90.0), False),
        # Close to them they count where the singularity parameters are alike.
        (performance(-0.03, 3.4), performance(-0.02, 3.0), True),
        (performance(-0.03, 3.6), performance(-0.02, 3.0), False),
        (performance(-0.01, 2.4), performance(-0.02, 3.0), True),
        # Far from them the singularity parameter counts.
        (performance(-0.1, 2.9), performance(-0.4, 3.0), True),
        (performance(-0.4, 3.0), performance(-0.1, 3.0), False),
        # At a singularity.
        (performance(-0.1, 9.0), performance(-0.1, math.inf), True),
        (performance(-0.1, math.inf), performance(-0.1, 9.0), False),
        (performance(-0.03, math.inf), performance(-0.02, math.inf), True),
        # Without limits.
        (performance(-math.inf, 2.0), performance(-math.inf, 3.0), True),
        # A path that is not followed is worth nothing.
        (performance(-0.4, 1.0, unreachable=1), performance(0.2, 90.0), False),
    ],
)
def test_rule(new: rw.Performance, old: rw.Performance, expected: bool) -> None:
    assert rw.better(new, old) is expected
    assert not rw.better(new, new)
    if expected:
        assert not rw.better(old, new)


def test_rule_is_no_order() -> None:
    a, b, c = performance(-0.01, 3.0), performance(-0.02, 3.4), performance(-0.03, 3.8)
    assert rw.better(b, a)
    assert rw.better(c, b)
    assert rw.better(a, c)


def test_performance_of_a_trajectory() -> None:
    q = np.zeros((3, 6))
    q[:, 4] = [-0.5, 0.0, 0.5]
    q[:, 5] = [0.0, 1.0, 5.0]
    q[:, 1] = FANUC.q_max[1] + np.array([-0.2, -0.1, 0.3])
    found = rw.Performance.of(FANUC, q, [0.0, 1.0, 3.0])
    assert found.limit_distance == pytest.approx(0.3 / (FANUC.q_max[1] - FANUC.q_min[1]), rel=1e-12)
    assert not found.within_limits
    # The wrist is straight at the second point.
    assert found.singularity > 1e6
    assert found.manipulability < 1e-12
    np.testing.assert_allclose(found.ranges, [0.0, 0.5, 0.0, 0.0, 1.0, 5.0], rtol=1e-12)
    assert found.speeds is not None
    np.testing.assert_allclose(found.speeds, [0.0, 0.2, 0.0, 0.0, 0.5, 2.0], rtol=1e-12)
    assert rw.Performance.of(FANUC, q).speeds is None


def test_performance_in_the_middle_and_without_limits() -> None:
    middle = 0.5 * (FANUC.q_min + FANUC.q_max)
    assert rw.Performance.of(FANUC, middle[None]).limit_distance == pytest.approx(-0.5, abs=1e-12)
    assert rw.Performance.of(FANUC, middle[None], [0.0]).speeds == (0.0,) * 6
    free = FANUC.with_limits(q_min=np.full(6, -np.inf), q_max=np.full(6, np.inf))
    assert rw.Performance.of(free, middle[None]).limit_distance == -math.inf


def test_bad_trajectories() -> None:
    with pytest.raises(rd.ShapeError, match="q"):
        rw.Performance.of(FANUC, np.zeros(6))
    with pytest.raises(rd.NonFiniteError, match=r"q\[1, 2\] is nan"):
        rw.Performance.of(FANUC, np.where(np.arange(12).reshape(2, 6) == 8, np.nan, 0.0))
    with pytest.raises(rd.InvalidValueError, match="no points"):
        rw.Performance.of(FANUC, np.zeros((0, 6)))
    with pytest.raises(rd.InvalidValueError, match=r"time\[1\] is 0\.0"):
        rw.Performance.of(FANUC, np.zeros((2, 6)), [0.0, 0.0])
    with pytest.raises(rd.ShapeError, match="time"):
        rw.Performance.of(FANUC, np.zeros((2, 6)), [0.0])
