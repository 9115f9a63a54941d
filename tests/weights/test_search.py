"""The search over two weights on closed-form surfaces."""

import math
from itertools import pairwise
from typing import Any

import pytest
import redundancy as rd
from redundancy import weights as rw

from tests.weights.cylinders import performance


def _bowl(w: float, k: float, coupling: float = 0.5) -> float:
    x, y = (w - 0.048) / 0.02, (k - 0.026) / 0.02
    return x * x + y * y + coupling * x * y


@pytest.mark.parametrize("coupling", [0.0, 0.5, -1.0])
@pytest.mark.parametrize("start", [(0.01, 0.01), (0.2, 0.1), (0.0, 0.05), (1.0, 0.0)])
def test_search_finds_the_bottom_of_a_bowl(start: tuple[float, float], coupling: float) -> None:
    calls = 0

    def evaluate(w: float, k: float) -> rw.Performance:
        nonlocal calls
        calls += 1
        assert w >= 0.0
        assert k >= 0.0
        return performance(-0.3, 1.0 + _bowl(w, k, coupling))

    found = rw.direct_search(evaluate, *start, tolerance=1e-5, min_step=1e-5, max_evaluations=300)
    assert found.status == "converged"
    assert found.performance.singularity < 1.0 + 1e-3
    assert abs(found.w - 0.048) < 1e-3
    assert abs(found.k - 0.026) < 1e-3
    assert calls <= 300
    taken = [step for step in found.history if step.accepted]
    assert all(rw.better(new.performance, old.performance) for old, new in pairwise(taken))
    assert taken[-1].performance == found.performance
    assert (taken[-1].w, taken[-1].k) == (found.w, found.k)


def test_search_in_the_limit_distance() -> None:
    def evaluate(w: float, k: float) -> rw.Performance:
        return performance(0.5 + _bowl(w, k), 100.0 * w)

    found = rw.direct_search(evaluate, 0.01, 0.01, tolerance=1e-5, min_step=1e-5, max_evaluations=300)
    assert found.performance.limit_distance < 0.5 + 1e-3


def test_order_of_directions_and_steps() -> None:
    found = rw.direct_search(lambda w, k: performance(-0.3, 1.0 + _bowl(w, k)), 0.01, 0.01, max_evaluations=300)
    order: list[str] = []
    for step in found.history[1:]:
        if not order or order[-1] != step.direction:
            order.append(step.direction)
    assert order[:4] == ["d1", "d2", "d3", "d2"]
    # The first step is the mean of both weights, the same in both.
    assert (found.history[1].w, found.history[1].k) == (0.02, 0.02)
    moved = {"d2": "w", "d3": "k"}
    for i, step in enumerate(found.history[1:], 1):
        if step.direction in moved:
            base = next(s for s in reversed(found.history[:i]) if s.accepted)
            assert getattr(step, moved[step.direction]) == getattr(base, moved[step.direction])


@pytest.mark.parametrize("most", [1, 2, 7, 25])
def test_search_is_bounded(most: int) -> None:
    calls = 0

    def evaluate(w: float, k: float) -> rw.Performance:
        nonlocal calls
        calls += 1
        return performance(-0.3, 1.0 / (1.0 + w + k))  # better for ever

    found = rw.direct_search(evaluate, 0.01, 0.01, tolerance=0.0, max_evaluations=most)
    assert calls == most
    assert found.status == "evaluations used up"


def test_search_ends_on_a_plane() -> None:
    found = rw.direct_search(lambda w, k: performance(), 0.01, 0.02)
    assert found.status == "converged"
    assert (found.w, found.k) == (0.01, 0.02)
    assert len(found.history) < 15


def test_search_ends_where_the_rule_goes_round() -> None:
    # Of three kinds of points, each is better than the one before.
    kinds = [performance(-0.01, 3.0), performance(-0.02, 3.4), performance(-0.03, 3.8)]
    found = rw.direct_search(lambda w, k: kinds[round(1000 * (w + k)) % 3], 0.01, 0.01, max_evaluations=50)
    assert len(found.history) <= 50
    assert len({(step.w, step.k) for step in found.history}) == len(found.history)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"w": -0.1}, r"w is -0\.1"),
        ({"k": math.nan}, "k is nan"),
        ({"w": 0.0, "k": 0.0}, "w and k are 0"),
        ({"tolerance": -1.0}, r"tolerance is -1\.0"),
        ({"min_step": 0.0}, r"min_step is 0\.0"),
        ({"max_evaluations": 0}, "max_evaluations is 0"),
        ({"constant": -0.5}, r"k is -0\.5"),
        ({"near": math.inf}, "near is inf"),
    ],
)
def test_bad_search(given: dict[str, Any], message: str) -> None:
    with pytest.raises(rd.InvalidValueError, match=message):
        rw.direct_search(lambda w, k: performance(), **({"w": 0.01, "k": 0.01} | given))
