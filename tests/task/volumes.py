"""Random volumes, their members by definition, and the oracles of the source."""

import json
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy import quaternion
from scipy.spatial.transform import Rotation

F64 = NDArray[np.float64]
Volume = rd.OrientationVolume

DATA = Path(__file__).parents[1] / "data" / "from_gravdahl_volumes.json"
X, Y, Z = np.eye(3)
TURN = 2.0 * np.pi

VAGUE = 1e-12
"""How near half a turn of the axis or a gimbal (cosine or sine) an angle is not defined."""


def oracles() -> tuple[dict[str, Volume], list[dict[str, Any]]]:
    """Return the volumes of the oracles by name, and their cases."""
    data = json.loads(DATA.read_text(encoding="utf-8"))
    return {name: built(of) for name, of in data["definitions"].items()}, data["cases"]


def built(of: dict[str, Any]) -> Volume:
    """Make a volume of its definition in the oracles."""
    spin = tuple(of["spin"]) if "spin" in of else None
    sizes = {"cone": ["tilt"], "line_x": ["tx"], "line_y": ["ty"]}.get(of["kind"], ["tx", "ty"])
    if of["kind"] == "product":
        volume = Volume.product([(axis, low, high) for axis, low, high in of["rotations"]])
    else:
        volume = getattr(Volume, of["kind"])(*(of[size] for size in sizes), spin=spin)
    return volume.reoriented(of["reference"]) if "reference" in of else volume


def random_orientations(rng: np.random.Generator, n: int) -> F64:
    q = rng.normal(size=(n, 4))
    unit: F64 = q / np.linalg.norm(q, axis=1, keepdims=True)
    return unit


def random_range(rng: np.random.Generator) -> tuple[float, float] | None:
    """Draw a free range, or a wide, narrow or single one anywhere, wider than a turn at times."""
    low = rng.uniform(-4.0, 4.0)
    width = [None, rng.uniform(0.0, 7.0), rng.uniform(0.0, 1.0), 0.0][rng.integers(4)]
    return None if width is None else (low, low + width)


def random_volume(rng: np.random.Generator, kind: str, euler: bool = False) -> Volume:
    """Draw a volume of a kind; tilts are often small, and at times 0 or the largest allowed.

    Products have one to three rotations about any axes or, if asked, three about axes of the frame.
    """

    def tilt(most: float) -> float:
        return float(rng.choice([rng.uniform(0.0, most), rng.uniform(0.0, 0.3), most, 0.0], p=[0.5, 0.4, 0.05, 0.05]))

    if kind == "product":
        free, axes = (-np.pi, np.pi), list[F64]()
        if euler:
            names = [np.eye(3)[i] for i in rng.permutation(3)]
            axes = [*names[:2], names[rng.choice([0, 2])]]
            return Volume.product([(axis, *(random_range(rng) or free)) for axis in axes])
        axes = [
            rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)] for _ in range(rng.integers(1, 4))
        ]
        return Volume.product([(axis, *(random_range(rng) or free)) for axis in axes])
    most = np.pi if kind != "square" and rng.random() < 0.3 else np.pi / 2.0
    tilts = [tilt(most) for _ in range(1 if kind in ("cone", "line_x", "line_y") else 2)]
    volume: Volume = getattr(Volume, kind)(*tilts, spin=random_range(rng))
    return volume


def ends_too(rng: np.random.Generator, low: float, high: float, n: int) -> F64:
    """Draw angles of a range, three in ten of them its ends."""
    if high - low >= TURN - 1e-12:
        return rng.uniform(-np.pi, np.pi, n)
    x, which = rng.uniform(low, high, n), rng.random(n)
    return np.where(which < 0.15, low, np.where(which > 0.85, high, x))


def box(volume: Volume) -> list[tuple[float, float]]:
    """Return the ranges of what its definition counts members by: angles, but of squares the sines of their shadow."""
    spin = volume.spin or (-np.pi, np.pi)
    if volume.kind == "product":
        return [(low, high) for _, low, high in volume.factors]
    if volume.kind == "cone":
        return [(0.0, volume.tilts[0]), (-np.pi, np.pi), spin]
    if volume.kind == "square":
        about_x, about_y = np.sin(volume.tilts)
        return [(-about_y, about_y), (-about_x, about_x), spin]
    return [*((-tilt, tilt) for tilt in volume.tilts), spin]


def made(volume: Volume, numbers: F64) -> F64:
    """Return the members of such numbers, shape (N, k), in the volume's own frame."""
    if volume.kind == "product":
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (len(numbers), 1))
        for (axis, _, _), angle in zip(volume.factors, numbers.T, strict=True):
            turned = quaternion.product(turned, quaternion.about(axis, angle))
        return turned
    first, second, spin = numbers.T
    if volume.kind == "cone":
        tilt, heading = first, second
    elif volume.kind == "square":
        tilt, heading = np.arcsin(np.minimum(np.hypot(first, second), 1.0)), np.arctan2(first, -second)
    else:
        leaning = quaternion.product(quaternion.about(X, first), quaternion.about(Y, second))
        return quaternion.product(leaning, quaternion.about(Z, spin))
    across = np.stack([np.cos(heading), np.sin(heading), np.zeros(len(numbers))], axis=-1)
    return quaternion.product(quaternion.about(across, tilt), quaternion.about(Z, spin))


def members(rng: np.random.Generator, volume: Volume, n: int) -> F64:
    """Draw members as the definitions make them, many of them on the bounds, in the volume's own frame."""
    return made(volume, np.stack([ends_too(rng, low, high, n) for low, high in box(volume)], axis=-1))


def within(volume: Volume, q: F64, slack: float) -> NDArray[np.bool_]:
    """Tell membership by the angles of the definitions (scipy's matrices and Euler angles), ranges wider by a slack.

    Of products those of three rotations about axes of the frame, neighbours different. Where an angle is not defined
    (half turns of the axis, gimbals) the answer is True of a wider range and False of a narrower one.
    """
    turn = Rotation.from_quat(np.roll(q, -1, axis=-1))
    seen = turn.as_matrix()
    spin = volume.spin or (-np.pi, np.pi)
    if volume.kind == "product":
        name = "".join("XYZ"[int(np.argmax(axis))] for axis, _, _ in volume.factors)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # gimbal lock: the last angle is then zero
            first = turn.as_euler(name)
        middle = -first[:, 1] if name[0] == name[2] else np.pi - first[:, 1]
        second = np.stack([first[:, 0] + np.pi, middle, first[:, 2] + np.pi], axis=-1)
        ranges = [(low, high) for _, low, high in volume.factors]
        each = [[_in(angle, of, slack) for angle, of in zip(way.T, ranges, strict=True)] for way in (first, second)]
        vague = np.abs(np.sin(first[:, 1]) if name[0] == name[2] else np.cos(first[:, 1])) < VAGUE
        return _told(np.all(each, axis=1).any(axis=0), vague, slack)
    x, y, z = seen[..., :, 2].T
    twist = np.arctan2(seen[..., 1, 0] - seen[..., 0, 1], seen[..., 0, 0] + seen[..., 1, 1])
    reversed_ = z < VAGUE - 1.0
    if volume.kind == "cone":
        inside = np.arctan2(np.hypot(x, y), z) <= volume.tilts[0] + slack
        return _told(inside & _in(twist, spin, slack), inside & reversed_, slack)
    about_x, about_y = volume.tilts
    if volume.kind == "square":
        along_x, along_y = (np.abs(np.arcsin(np.clip(part, -1.0, 1.0))) for part in (x, y))
        shadow = (along_x <= about_y + slack) & (along_y <= about_x + slack) & (z >= -slack)
        return _told(shadow & _in(twist, spin, slack), reversed_ & False, slack)
    a, b = np.arctan2(-y, z), np.arctan2(x, np.hypot(y, z))
    c = np.arctan2(-seen[..., 0, 1], seen[..., 0, 0])
    ways = [
        _in(a + turned, (-about_x, about_x), slack)
        & _in(abs(turned - b), (-about_y, about_y), slack)
        & _in(c + turned, spin, slack)
        for turned in (0.0, np.pi)
    ]
    return _told(ways[0] | ways[1], np.abs(x) > 1.0 - VAGUE, slack)


def _told(inside: NDArray[np.bool_], vague: NDArray[np.bool_], slack: float) -> NDArray[np.bool_]:
    return np.asarray(inside | vague if slack > 0.0 else inside & ~vague)


def _in(angle: F64, of: tuple[float, float], slack: float) -> NDArray[np.bool_]:
    """Tell whether angles are in a range, but for whole turns."""
    low, high = of
    if high - low >= TURN - 1e-12:
        return np.full(np.shape(angle), True)
    offset = (angle - 0.5 * (low + high) + np.pi) % TURN - np.pi
    return np.asarray(np.abs(offset) <= 0.5 * (high - low) + slack)
