"""Pictures of redundancy maps: what they show, by their images and by the page's own data."""

import base64
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from redundancy.errors import InvalidValueError, NonFiniteError, ShapeError
from redundancy.plots import map_data as md

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]


def _map(n: int, a: int, b: int) -> tuple[F64, U8, F64]:
    """Smooth values with forbidden regions; the last branch is out of reach."""
    angles = -np.pi + 2.0 * np.pi * np.arange(a) / a
    t, g, k = np.meshgrid(np.linspace(0.0, 1.0, n), angles, np.arange(b), indexing="ij")
    value = 1.2 + 1.0 / np.maximum(np.abs(np.sin(g + 3.0 * t + k)), 1e-3)
    cause = np.zeros(value.shape, dtype=np.uint8)
    cause[np.cos(g - t + 2.0 * k) > 0.6] = 2
    cause[:, :, b - 1] = 1
    return np.where(cause == 0, value, np.nan), cause, angles


def _colors(figure: Any) -> tuple[F64, U8]:
    """Return the values and the colours of the causes in a picture of one panel."""
    values, causes = (image.get_array() for image in figure.axes[0].images[:2])
    return np.ma.filled(values, np.nan), np.asarray(causes)


def test_cell_has_the_cause_of_the_branch_that_came_closest() -> None:
    pytest.importorskip("matplotlib")
    from redundancy.plots.map import redundancy_map_figure

    cause = np.array([[[1, 1], [1, 3], [3, 2], [2, 4], [4, 1], [4, 0]]], dtype=np.uint8)
    value = np.where(cause == 0, 1.5, np.nan)
    values, colors = _colors(redundancy_map_figure(value, cause, -np.pi + np.arange(6) * np.pi / 3.0))
    expected = [1, 3, 2, 4, 4, 0, 1]  # The first angle again: half a cell at either end of the turn.
    for row, code in enumerate(expected):
        assert np.isfinite(values[row, 0]) == (code == 0)
        shown = "" if colors[row, 0, 3] == 0 else "#" + bytes(colors[row, 0, :3]).hex().upper()
        assert shown == md.CAUSE_COLORS[code]


def test_best_branch_is_the_least_value_and_rounding_does_not_choose() -> None:
    value = np.array([[[3.0, 2.0, 1.0], [2.0 * (1.0 + 1e-13), 2.0, 2.0], [np.inf, 5.0, np.nan]]])
    cause = np.array([[[0, 0, 2], [0, 0, 0], [0, 0, 0]]], dtype=np.uint8)
    data = md.prepared(value, cause, np.array([-3.0, 0.0, 1.0]), None, (), None)
    assert data.pick.tolist() == [[1, 0, 1]]
    np.testing.assert_array_equal(data.layer(None)[0], [[2.0, value[0, 1, 0], 5.0]])
    # Feasible without a value: singular.
    assert data.cause[0, 2].tolist() == [3, 0, 3]


def test_angles_are_sorted_into_one_turn() -> None:
    value, cause, angles = _map(3, 12, 2)
    turned = md.prepared(value[:, ::-1], cause[:, ::-1], angles[::-1] + 4.0 * np.pi, None, (), None)
    straight = md.prepared(value, cause, angles, None, (), None)
    np.testing.assert_allclose(turned.degrees, straight.degrees, atol=1e-9)
    np.testing.assert_array_equal(turned.value, straight.value)


@pytest.mark.parametrize("n", [1, 2, 30])
@pytest.mark.parametrize("b", [1, 3])
def test_every_picture_of_any_size(n: int, b: int, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from redundancy.plots.map import redundancy_map_figure
    from redundancy.plots.style import save

    value, cause, angles = _map(n, 24, b)
    lines = [md.MapLine(np.linspace(0.0, 9.0, n), np.zeros(n, dtype=int)), md.MapLine(np.zeros(n), label="fixed")]
    distance = np.linspace(0.0, 0.7, n)
    best = redundancy_map_figure(value, cause, angles, distance, lines=lines, title="map")
    single = redundancy_map_figure(value, cause, angles, branch=b - 1, lines=lines)
    every = redundancy_map_figure(value, cause, angles, distance, panels="branches")
    assert np.isnan(_colors(single)[0]).all()
    assert len([axes for axes in every.axes if axes.images]) == b
    for name, figure in (("best", best), ("single", single), ("every", every)):
        save(figure, tmp_path / f"{name}.pdf")
        assert (tmp_path / f"{name}.pdf").stat().st_size > 0


def test_single_branch_shows_its_own_values() -> None:
    pytest.importorskip("matplotlib")
    from redundancy.plots.map import redundancy_map_figure

    value, cause, angles = _map(9, 24, 3)
    figure = redundancy_map_figure(value, cause, angles, branch=1)
    np.testing.assert_array_equal(_colors(figure)[0][:-1], value[:, :, 1].T)


def test_nothing_feasible_has_causes_but_no_scale(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    from redundancy.plots.map import redundancy_map_figure
    from redundancy.plots.style import save

    cause = np.full((4, 12, 2), 2, dtype=np.uint8)
    value = np.full(cause.shape, np.nan)
    figure = redundancy_map_figure(value, cause, -np.pi + np.arange(12) * np.pi / 6.0)
    save(figure, tmp_path / "map.png")
    assert len(figure.axes) == 1
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["joint limit"]


def test_extreme_tail_does_not_take_the_colours() -> None:
    pytest.importorskip("matplotlib")
    from redundancy.plots.map import redundancy_map_figure

    value = np.linspace(1.0, 3.0, 50 * 36).reshape(50, 36, 1)
    angles = -np.pi + np.arange(36) * np.pi / 18.0
    cause = np.zeros(value.shape, dtype=np.uint8)
    assert _scale(redundancy_map_figure(value, cause, angles)) == ("neither", 1.0, 3.0)
    value[7, 7] = 1e9
    extend, low, high = _scale(redundancy_map_figure(value, cause, angles))
    assert (extend, low) == ("max", 1.0)
    assert high < 3.1


def _scale(figure: Any) -> tuple[str, float, float]:
    image = figure.axes[0].images[0]
    return (image.colorbar.extend, *image.get_clim())


def test_line_breaks_where_it_wraps_and_where_the_branch_changes() -> None:
    value, cause, angles = _map(5, 36, 2)
    wrapped = np.deg2rad([170.0, -170.0, -100.0, 100.0, 50.0])
    distance = np.array([0.0, 2.0, 3.0, 4.0, 5.0])
    for spin in (wrapped, np.unwrap(wrapped)):
        line = md.prepared(value, cause, angles, distance, [md.MapLine(spin)], None).lines[0]
        np.testing.assert_allclose(line.x, [0, 1, 1, 1, 2, 3, 3.5, 3.5, 3.5, 4, 5])
        np.testing.assert_allclose(line.y, [170, 180, np.nan, -180, -170, -100, -180, np.nan, 180, 100, 50], atol=1e-9)
        assert line.changes.size == 0
    chosen = md.MapLine(wrapped, [0, 1, 1, 1, 1])
    line = md.prepared(value, cause, angles, distance, [chosen], None).lines[0]
    np.testing.assert_allclose(line.y, [170, np.nan, -170, -100, -180, np.nan, 180, 100, 50], atol=1e-9)
    assert line.changes.tolist() == [0, 2]
    assert line.branch.tolist() == [0, -1, 1, 1, 1, -1, 1, 1, 1]


def test_line_has_gaps_where_there_is_no_spin() -> None:
    value, cause, angles = _map(3, 36, 2)
    line = md.prepared(value, cause, angles, None, [md.MapLine([0.1, np.nan, 0.2])], None).lines[0]
    np.testing.assert_allclose(np.deg2rad(line.y), [0.1, np.nan, 0.2])


def test_bad_input_is_named() -> None:
    pytest.importorskip("matplotlib")
    from redundancy.plots.map import redundancy_map_figure

    value, cause, angles = _map(3, 12, 2)
    with pytest.raises(ShapeError, match="value"):
        redundancy_map_figure(value[0], cause, angles)
    with pytest.raises(ShapeError, match="cause"):
        redundancy_map_figure(value, cause[:2], angles)
    with pytest.raises(InvalidValueError, match="cause"):
        redundancy_map_figure(value, cause + 4, angles)
    with pytest.raises(InvalidValueError, match="angles"):
        redundancy_map_figure(value, cause, np.linspace(-np.pi, np.pi, 12))
    with pytest.raises(NonFiniteError, match="angles"):
        redundancy_map_figure(value, cause, angles * np.nan)
    with pytest.raises(InvalidValueError, match="distance"):
        redundancy_map_figure(value, cause, angles, [0.0, 2.0, 1.0])
    with pytest.raises(InvalidValueError, match="branch"):
        redundancy_map_figure(value, cause, angles, branch=2)
    with pytest.raises(InvalidValueError, match="branch"):
        redundancy_map_figure(value, cause, angles, branch=1, panels="branches")
    with pytest.raises(ShapeError, match="spin of 'chosen spin'"):
        redundancy_map_figure(value, cause, angles, lines=[md.MapLine([0.0, 1.0])])
    with pytest.raises(InvalidValueError, match="branch of 'chosen spin'"):
        redundancy_map_figure(value, cause, angles, lines=[md.MapLine([0.0, 1.0, 2.0], [0, 1, 2])])


def _page_data(page: str, name: str) -> Any:
    found = re.search(f'<script type="application/json" id="{name}">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    return json.loads(found[1])


def _unpacked(text: str) -> U8:
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype=np.uint8)


@pytest.mark.parametrize("n", [1, 40])
def test_page_holds_the_map(n: int, tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    from redundancy.plots.map_page import write_map_html

    value, cause, angles = _map(n, 36, 3)
    line = md.MapLine(np.linspace(3.0, 4.0, n), np.ones(n, dtype=int), "<chosen> & spin")
    write_map_html(tmp_path / "map.html", value, cause, angles, lines=[line], title="</script> @MAP@ & more")
    page = (tmp_path / "map.html").read_text(encoding="utf-8")
    held = _page_data(page, "map")
    assert held["shape"] == [n, 36, 3]
    assert held["branches"] == [0, 1]
    np.testing.assert_array_equal(_unpacked(held["cause"]).reshape(3, 36, n), cause.transpose(2, 1, 0))
    planes = _unpacked(held["value"]).reshape(3, 3, 36, n).astype(np.uint32)
    code = np.cumsum(planes[0] + (planes[1] << 8) + (planes[2] << 16), axis=2, dtype=np.uint32) & 0xFFFFFF
    decoded = (code << held["dropped"]).astype(np.uint32).view(np.float32).transpose(2, 1, 0)
    np.testing.assert_allclose(decoded[cause == 0], value[cause == 0], rtol=7e-5)
    pick = np.frombuffer(_unpacked(held["pick"]).tobytes(), dtype="<u2").reshape(36, n).T
    np.testing.assert_array_equal(pick, md.prepared(value, cause, angles, None, (), None).pick)
    figure = _page_data(page, "figure")
    assert [trace["type"] for trace in figure["data"][:2]] == ["heatmap", "heatmap"]
    assert "&lt;chosen&gt; &amp; spin" in [trace.get("name") for trace in figure["data"]]
    assert page.count("&lt;/script&gt; @MAP@ &amp; more") == 2


def test_page_loads_nothing(tmp_path: Path) -> None:
    offline = pytest.importorskip("plotly.offline")
    from redundancy.plots.map_page import write_map_html

    write_map_html(tmp_path / "map.html", *_map(5, 12, 2))
    page = (tmp_path / "map.html").read_text(encoding="utf-8")
    library = offline.get_plotlyjs()
    assert library in page
    # The library names addresses for geographic maps, which are not used.
    own = page.replace(library, "")
    assert "https:" not in own
    assert "http:" not in own
    assert not re.search(r"<(script|link|img|iframe)[^>]*\b(src|href)=", own)


def test_page_of_nothing_feasible(tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    from redundancy.plots.map_page import write_map_html

    cause = np.ones((4, 12, 2), dtype=np.uint8)
    write_map_html(tmp_path / "map.html", np.full(cause.shape, np.nan), cause, np.arange(12) * np.pi / 6.0)
    page = (tmp_path / "map.html").read_text(encoding="utf-8")
    assert _page_data(page, "map")["branches"] == []
    assert _page_data(page, "figure")["data"][0]["showscale"] is False
