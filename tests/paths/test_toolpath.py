"""Toolpaths: the thesis' helix by its formulas, arrays, targets, rotations that do not spin, bad input."""

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray

from tests.files.test_toolpath_files import path

F64 = NDArray[np.float64]


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
