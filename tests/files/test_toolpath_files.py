"""Files of toolpaths: read back bit for bit, written by hand, malformed ones named with their place."""

import json
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st

from tests.reference.chain import random_frame

CSV = "x,y,z,i,j,k,t\n0.1,0.2,0.3,0,0,2,0\n0.1,0.2,0.4,0,0.5,0,1.5\n# note\n\n0.1,0.2,0.5,1,1,0,2\n"


def path(points: int, seed: int = 0, rotations: bool = True) -> rd.Toolpath:
    rng = np.random.default_rng(seed)
    rotation = np.stack([random_frame(rng)[:3, :3] for _ in range(points)])
    time = np.cumsum(rng.uniform(0.01, 1, points))
    return rd.Toolpath(
        rng.normal(size=(points, 3)), rng.normal(size=(points, 3)), rotation if rotations else None, time
    )


@given(points=st.integers(1, 12), seed=st.integers(0, 2**32 - 1), rotations=st.booleans())
def test_written_path_reads_back_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, points: int, seed: int, rotations: bool
) -> None:
    made = path(points, seed, rotations)
    file = tmp_path_factory.mktemp("path") / "path.csv"
    made.write(file)
    again = rd.Toolpath.read(file)
    np.testing.assert_array_equal(again.position, made.position)
    np.testing.assert_array_equal(again.axis, made.axis)
    assert made.time is not None
    assert again.time is not None
    np.testing.assert_array_equal(again.time, made.time)
    assert (again.rotation is None) == (made.rotation is None)
    if made.rotation is not None and again.rotation is not None:
        np.testing.assert_array_equal(again.rotation, made.rotation)


def test_csv_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "path.csv"
    for text in (CSV, "\ufeff" + CSV, CSV.replace("\n", "\r\n"), CSV.replace(",", " , "), CSV.replace("x,y", "X,Y")):
        file.write_text(text, encoding="utf-8", newline="")
        got = rd.Toolpath.read(file)
        np.testing.assert_array_equal(got.position, [[0.1, 0.2, 0.3], [0.1, 0.2, 0.4], [0.1, 0.2, 0.5]])
        np.testing.assert_allclose(got.axis, [[0, 0, 1], [0, 1, 0], [0.5**0.5, 0.5**0.5, 0]], rtol=1e-15)
        assert got.time is not None
        np.testing.assert_array_equal(got.time, [0, 1.5, 2])
    file.write_text("x_mm,y_mm,z_mm,i,j,k\n870,1,2,0,0,1\n", encoding="utf-8")
    np.testing.assert_array_equal(rd.Toolpath.read(file).position, [[0.87, 0.001, 0.002]])


def test_json_by_hand(tmp_path: Path) -> None:
    file = tmp_path / "path.json"
    columns = {"x": [1, 2], "y": [0.5, 0], "z": [0, 0], "i": [0, 1], "j": [0, 0], "k": [1, 0]}
    file.write_text(json.dumps(columns), encoding="utf-8")
    np.testing.assert_array_equal(rd.Toolpath.read(file).position, [[1, 0.5, 0], [2, 0, 0]])


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("0.1,0.2,0.4", "0.1,nan,0.4", ":3:5: "),
        ("0.1,0.2,0.4", "0.1,  x,0.4", ":3:7: "),
        ("0.1,0.2,0.5", "0.1,inf,0.5", ":6:5: "),
        ("0.1,0.2,0.4,", "0.1,0.2,", ":3"),
        ("0,0.5,0,1.5", "0,0,0,1.5", ":3"),
        (",1.5", ",0", ":3"),
        ("x,y,z", "x,y,w", ":1"),
        ("x,y,z", "x,y,y", ":1"),
        ("x,y,z,i,j,k,t", "x,y,z,i,j,t", ":1"),
        ("x,y,z", "x,y_mm,z", ":1"),
        (CSV, "", ":1"),
        (CSV, "x,y,z,i,j,k\n", ":1"),
        ("0.1,0.2,0.4", "1_0,0.2,0.4", ":3:1: "),
        ("0.1,0.2,0.4", ",0.2,0.4", ":3:1: "),
        ("0.1,0.2,0.4", "1e999,0.2,0.4", ":3:1: "),
    ],
)
def test_malformed_csv_is_named_with_its_place(tmp_path: Path, old: str, new: str, place: str) -> None:
    file = tmp_path / "path.csv"
    file.write_text(CSV.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(rd.ToolpathError) as caught:
        rd.Toolpath.read(file)
    assert str(caught.value).startswith(f"{file}{place}")
    assert caught.value.line == int(place.split(":")[1])


def test_bytes_that_are_no_text(tmp_path: Path) -> None:
    file = tmp_path / "path.csv"
    file.write_bytes(CSV.encode().replace(b"0.4", b"\xff\xfe"))
    with pytest.raises(rd.ToolpathError, match=":3:9: "):
        rd.Toolpath.read(file)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('{"x": [1,\n 2', ":2:"),
        ("[1, 2]", "object"),
        ('{"x": 1, "y": [1], "z": [1], "i": [1], "j": [1], "k": [1]}', "x"),
        ('{"x": [1, 2], "y": [1], "z": [1], "i": [1], "j": [1], "k": [1]}', "equally many"),
        ('{"x": [NaN], "y": [1], "z": [1], "i": [1], "j": [1], "k": [1]}', r"x\[0\]"),
        ('{"x": [true], "y": [1], "z": [1], "i": [1], "j": [1], "k": [1]}', r"x\[0\]"),
        ('{"x": [1], "y": [1], "z": [1], "i": [0], "j": [0], "k": [0]}', r"axis\[0\]"),
        ('{"y": [1], "z": [1], "i": [0], "j": [0], "k": [0]}', "'x' is missing"),
        ("[" * 100000, "."),
        ("", ":1:1: "),
    ],
)
def test_malformed_json(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "path.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(rd.ToolpathError, match=message) as caught:
        rd.Toolpath.read(file)
    assert str(file) in str(caught.value)


@given(st.text(alphabet="xyzijkt,.0123456789-eE \n#\"'naif_m", max_size=80), st.sampled_from([".csv", ".json"]))
def test_arbitrary_text_is_a_path_or_an_error(tmp_path_factory: pytest.TempPathFactory, text: str, ending: str) -> None:
    file = tmp_path_factory.mktemp("fuzz") / f"path{ending}"
    file.write_text("x,y,z,i,j,k\n" + text if ending == ".csv" else text, encoding="utf-8")
    try:
        outcome = f"{file}: {len(rd.Toolpath.read(file))} points"
    except rd.ToolpathError as error:
        outcome = str(error)
    assert outcome.startswith(str(file))
    assert ": 0 points" not in outcome
