"""Rasters: lines, fillets and equal distances, against plane geometry."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st
from redundancy.errors import InvalidValueError, NonFiniteError, ShapeError


def pose(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    frame = np.eye(4)
    frame[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame[:3, 0] *= np.linalg.det(frame[:3, :3])
    frame[:3, 3] = rng.normal(size=3)
    return frame


@given(
    width=st.floats(0.05, 2.0),
    height=st.floats(0.05, 2.0),
    rows=st.integers(1, 9),
    share=st.floats(0.0, 1.0),
    along=st.sampled_from(["x", "y"]),
    seed=st.integers(0, 99),
)
@settings(max_examples=60, deadline=None)
def test_lines_fillets_and_equal_distances(
    width: float, height: float, rows: int, share: float, along: Any, seed: int
) -> None:
    frame = pose(seed)
    long, across = (width, height) if along == "x" else (height, width)
    apart = across / (rows - 1) if rows > 1 else np.inf
    fillet = share * min(0.5 * apart, long if rows == 2 else 0.5 * long) if rows > 1 else share
    spacing = 0.003 * max(width, height)
    path = rd.Toolpath.raster((width, height), rows, fillet, spacing, along, frame, speed=2.0)
    length = rows * long + (rows > 1) * across - 2.0 * (rows - 1) * (2.0 - 0.5 * np.pi) * fillet
    assert path.duration == pytest.approx(0.5 * length, rel=1e-9)
    assert path.time is not None
    np.testing.assert_allclose(np.diff(path.time), np.diff(path.time)[0], rtol=1e-6)
    assert 2.0 * np.diff(path.time)[0] <= spacing * (1.0 + 1e-9)
    local = (path.position - frame[:3, 3]) @ frame[:3, :3]
    assert np.abs(local[:, 2]).max() < 1e-12
    assert (np.abs(local[:, :2]) <= 0.5 * np.array([width, height]) * (1.0 + 1e-12)).all()
    if rows > 1:
        corner = -0.5 * np.array([width, height])
        np.testing.assert_allclose(local[0, :2], corner, atol=1e-12)
        chord = np.linalg.norm(np.diff(path.position, axis=0), axis=1)
        # A chord of an arc of that radius, or of a line, whole or in part.
        step = 2.0 * np.diff(path.time)[0]
        if fillet > step:
            least = 2.0 * fillet * np.sin(0.5 * step / fillet)
            assert (chord >= least * (1.0 - 1e-9)).all()
        assert (chord <= step * (1.0 + 1e-9)).all()


def test_a_raster_of_half_circles_by_hand() -> None:
    path = rd.Toolpath.raster((1.0, 0.2), 2, 0.1, 0.05, speed=1.0)
    line, arc = 0.9, 0.1 * np.pi
    assert path.duration == pytest.approx(2.0 * line + arc)
    middle = path.position[len(path) // 2]
    assert np.hypot(middle[0] - 0.4, middle[1]) == pytest.approx(0.1, abs=1e-12)
    np.testing.assert_allclose(path.position[-1], [-0.5, 0.1, 0.0], atol=1e-12)
    # The tool looks at the surface, its frame after a half turn about y.
    assert path.rotation is not None
    np.testing.assert_array_equal(path.rotation[0], np.diag([-1.0, 1.0, -1.0]))
    np.testing.assert_array_equal(path.axis[3], [0.0, 0.0, -1.0])


def test_one_row_is_a_line_through_the_middle() -> None:
    path = rd.Toolpath.raster((1.0, 0.2), 1, 0.0, 0.3, along="y")
    np.testing.assert_allclose(path.position[[0, -1]], [[0.0, -0.1, 0.0], [0.0, 0.1, 0.0]])
    assert len(path) == 2


GOOD: dict[str, Any] = {"size": (1.0, 0.4), "rows": 3, "fillet": 0.05, "spacing": 0.01}


@pytest.mark.parametrize(
    ("wrong", "error", "told"),
    [
        ({"fillet": 0.11}, InvalidValueError, "at most 0.1 m"),
        ({"size": (0.1, 0.4), "fillet": 0.06}, InvalidValueError, "at most 0.05 m"),
        ({"size": (0.1, 4.0), "rows": 2, "fillet": 0.2}, InvalidValueError, "at most 0.1 m"),
        ({"fillet": -0.01}, InvalidValueError, "fillet is -0.01"),
        ({"rows": 0}, InvalidValueError, "rows is 0"),
        ({"rows": 2.5}, InvalidValueError, "whole number"),
        ({"spacing": 0.0}, InvalidValueError, "spacing is 0"),
        ({"spacing": 1e-12}, InvalidValueError, "at most 10000000 points"),
        ({"spacing": 1e-320}, InvalidValueError, "at most 10000000 points"),
        ({"size": (1.0, -0.4)}, InvalidValueError, "size"),
        ({"size": (1.0, 0.4, 1.0)}, ShapeError, "size"),
        ({"spacing": np.nan}, NonFiniteError, "spacing"),
        ({"along": "z"}, InvalidValueError, "along is 'z'"),
        ({"speed": 0.0}, InvalidValueError, "speed is 0"),
        ({"frame": np.eye(3)}, ShapeError, "frame"),
        ({"frame": np.diag([1.0, 1.0, -1.0, 1.0])}, InvalidValueError, "orthogonal"),
        ({"frame": np.ones((4, 4))}, InvalidValueError, r"frame\[3\]"),
    ],
)
def test_bad_rasters(wrong: dict[str, Any], error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        rd.Toolpath.raster(**(GOOD | wrong))
