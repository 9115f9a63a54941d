"""Toolpaths: the thesis' helix by its formulas, files read back bit for bit, malformed files named with their place."""

import json
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.reference.chain import random_frame

F64 = NDArray[np.float64]

CSV = "x,y,z,i,j,k,t\n0.1,0.2,0.3,0,0,2,0\n0.1,0.2,0.4,0,0.5,0,1.5\n# note\n\n0.1,0.2,0.5,1,1,0,2\n"


def path(points: int, seed: int = 0, rotations: bool = True) -> rd.Toolpath:
    rng = np.random.default_rng(seed)
    rotation = np.stack([random_frame(rng)[:3, :3] for _ in range(points)])
    time = np.cumsum(rng.uniform(0.01, 1, points))
    return rd.Toolpath(
        rng.normal(size=(points, 3)), rng.normal(size=(points, 3)), rotation if rotations else None, time
    )


def test_helix_by_its_formulas() -> None:
    helix = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.1, 1.4, np.pi, (1.3, 1.0, 0.2), 27, duration=5.0)
    phi = np.linspace(0.1, 1.4, 27)
    angle = np.pi - phi
    position = np.stack([1.3 + 0.25 * np.cos(angle), 1.0 + 0.5 / np.pi * phi, 0.2 + 0.25 * np.sin(angle)], axis=1)
    np.testing.assert_allclose(helix.position, position, atol=1e-15)
    np.testing.assert_allclose(helix.axis, np.stack([-np.cos(angle), 0 * angle, -np.sin(angle)], axis=1), atol=1e-15)
    speed = np.hypot(0.25, 0.5 / np.pi) * 1.3 / 5.0
    assert helix.speed is not None
    np.testing.assert_allclose(helix.speed, speed, rtol=1e-3)
    assert helix.length == pytest.approx(speed * 5.0, rel=1e-3)
    assert helix.duration == 5.0


def test_axes_are_kept_as_unit_vectors() -> None:
    rng = np.random.default_rng(3)
    axis = rng.normal(size=(50, 3)) * 10.0 ** rng.uniform(-6, 6, (50, 1))
    got = rd.Toolpath(np.zeros((50, 3)), axis).axis
    np.testing.assert_allclose(got, axis / np.linalg.norm(axis, axis=1, keepdims=True), rtol=1e-14)


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e160, 1e300])
def test_axes_of_extreme_length(size: float) -> None:
    got = rd.Toolpath([[0.0, 0, 0]], [[3 * size, 0.0, -4 * size]]).axis
    np.testing.assert_allclose(got, [[0.6, 0.0, -0.8]], rtol=1e-14)


def test_arrays_are_copies_that_cannot_be_written() -> None:
    position = np.zeros((3, 3))
    made = rd.Toolpath(position, np.ones((3, 3)))
    position += 1.0
    assert (made.position == 0.0).all()
    for array in (made.position, made.axis):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1.0


def test_targets_are_what_each_task_asks_for() -> None:
    made = path(4)
    np.testing.assert_array_equal(made.targets(), np.hstack([made.position, made.axis]))
    np.testing.assert_array_equal(made.targets(rd.Task.position()), made.position)
    assert made.rotation is not None
    full = made.targets(rd.Task.full())
    np.testing.assert_array_equal(full[2, 3:].reshape(3, 3), made.rotation[2])
    with pytest.raises(rd.InvalidValueError, match="rotations"):
        path(4, rotations=False).targets(rd.Task.full())


def test_without_spin_never_turns_about_the_axis() -> None:
    helix = rd.Toolpath.helix(0.25, 0.1, 0.0, 3.0, points=2001)
    first = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    first *= np.linalg.det(first)
    first = _onto(first[:, 2], helix.axis[0]) @ first
    rotation = helix.without_spin(first).rotation
    assert rotation is not None
    np.testing.assert_allclose(rotation[:, :, 2], helix.axis, atol=1e-12)
    np.testing.assert_allclose(
        rotation @ rotation.transpose(0, 2, 1), np.broadcast_to(np.eye(3), (2001, 3, 3)), atol=1e-12
    )
    # Angular velocity of the frame has no component along the axis.
    relative = rotation[1:] @ rotation[:-1].transpose(0, 2, 1)
    spin = np.stack(
        [
            relative[:, 2, 1] - relative[:, 1, 2],
            relative[:, 0, 2] - relative[:, 2, 0],
            relative[:, 1, 0] - relative[:, 0, 1],
        ],
        axis=1,
    )
    assert np.abs((spin * helix.axis[:-1]).sum(axis=1)).max() < 1e-12


def _onto(start: F64, end: F64) -> F64:
    normal = np.cross(start, end)
    cross = np.cross(np.eye(3), -normal)
    cross = -cross
    rotation: F64 = np.eye(3) + cross + cross @ cross / (1 + start @ end)
    return rotation


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


@pytest.mark.parametrize(
    ("change", "kind", "message"),
    [
        ({"position": np.zeros((0, 3)), "axis": np.zeros((0, 3))}, rd.InvalidValueError, "no points"),
        ({"position": np.zeros((2, 2))}, rd.ShapeError, "position"),
        ({"axis": np.ones((3, 3))}, rd.ShapeError, "axis"),
        ({"axis": [[0, 0, 1], [0, 0, 0]]}, rd.InvalidValueError, r"axis\[1\]"),
        ({"axis": [[0, 0, 1], [0, np.nan, 0]]}, rd.NonFiniteError, "axis"),
        ({"position": [[0, 0, np.inf], [0, 0, 0]]}, rd.NonFiniteError, "position"),
        ({"time": [1.0, 1.0]}, rd.InvalidValueError, r"time\[1\]"),
        ({"time": [1.0, 0.5]}, rd.InvalidValueError, r"time\[1\] is 0.5"),
        ({"time": [1.0]}, rd.ShapeError, "time"),
        ({"rotation": np.stack([np.eye(3), -np.eye(3)])}, rd.InvalidValueError, r"rotation\[1\]"),
        ({"rotation": np.stack([2 * np.eye(3), np.eye(3)])}, rd.InvalidValueError, r"rotation\[0\]"),
        ({"position": "text"}, rd.InvalidValueError, "position"),
        ({"position": None}, rd.RedundancyError, "position"),
    ],
)
def test_wrong_arrays(change: dict[str, object], kind: type[Exception], message: str) -> None:
    good: dict[str, object] = {"position": np.zeros((2, 3)), "axis": np.ones((2, 3))}
    with pytest.raises(kind, match=message):
        rd.Toolpath(**(good | change))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.0}, "radius is 0"),
        ({"radius": np.nan}, "."),
        ({"points": 1}, "points is 1"),
        ({"duration": 0.0}, "duration is 0"),
        ({"duration": np.inf}, "duration is inf"),
    ],
)
def test_wrong_helix(change: dict[str, float], message: str) -> None:
    good = {"radius": 1.0, "pitch": 0.1, "start": 0.0, "stop": 1.0}
    with pytest.raises(rd.RedundancyError, match=message):
        rd.Toolpath.helix(**(good | change))  # type: ignore[arg-type]
