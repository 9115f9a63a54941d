"""Random volumes, their members by definition, and the oracles of the source."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy import quaternion

F64 = NDArray[np.float64]
Volume = rd.OrientationVolume

DATA = Path(__file__).parents[1] / "data" / "from_gravdahl_volumes.json"
X, Y, Z = np.eye(3)
TURN = 2.0 * np.pi


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


def random_volume(rng: np.random.Generator, kind: str) -> Volume:
    """Draw a volume of a kind; tilts are often small, and at times 0 or the largest allowed."""

    def tilt(most: float) -> float:
        return float(rng.choice([rng.uniform(0.0, most), rng.uniform(0.0, 0.3), most, 0.0], p=[0.5, 0.4, 0.05, 0.05]))

    if kind == "product":
        free = (-np.pi, np.pi)
        axes: list[F64] = [
            rng.normal(size=3) if rng.random() < 0.5 else np.eye(3)[rng.integers(3)] for _ in range(rng.integers(1, 4))
        ]
        return Volume.product([(axis, *(random_range(rng) or free)) for axis in axes])
    most = np.pi if kind != "square" and rng.random() < 0.3 else np.pi / 2.0
    tilts = [tilt(most) for _ in range(1 if kind in ("cone", "line_x", "line_y") else 2)]
    made: Volume = getattr(Volume, kind)(*tilts, spin=random_range(rng))
    return made


def ends_too(rng: np.random.Generator, low: float, high: float, n: int) -> F64:
    """Draw angles of a range, three in ten of them its ends."""
    if high - low >= TURN - 1e-12:
        return rng.uniform(-np.pi, np.pi, n)
    x, which = rng.uniform(low, high, n), rng.random(n)
    return np.where(which < 0.15, low, np.where(which > 0.85, high, x))


def members(rng: np.random.Generator, volume: Volume, n: int) -> F64:
    """Return members as the definitions make them, in the volume's own frame."""
    if volume.kind == "product":
        made = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
        for axis, low, high in volume.factors:
            made = quaternion.product(made, quaternion.about(axis, ends_too(rng, low, high, n)))
        return made
    spun = quaternion.about(Z, ends_too(rng, *(volume.spin or (-np.pi, np.pi)), n))
    if volume.kind == "cone":
        tilt, heading = ends_too(rng, 0.0, volume.tilts[0], n), rng.uniform(-np.pi, np.pi, n)
    elif volume.kind == "square":
        sines = np.sin(volume.tilts)
        x, y = ends_too(rng, -sines[1], sines[1], n), ends_too(rng, -sines[0], sines[0], n)
        tilt, heading = np.arcsin(np.minimum(np.hypot(x, y), 1.0)), np.arctan2(x, -y)
    else:
        a, b = (ends_too(rng, -tilt, tilt, n) for tilt in volume.tilts)
        return quaternion.product(quaternion.product(quaternion.about(X, a), quaternion.about(Y, b)), spun)
    across = np.stack([np.cos(heading), np.sin(heading), np.zeros(n)], axis=-1)
    return quaternion.product(quaternion.about(across, tilt), spun)


def within(volume: Volume, q: F64, slack: float) -> NDArray[np.bool_]:
    """Tell membership by the angles of the definitions (scipy's matrices), ranges wider by a slack; no products."""
    from scipy.spatial.transform import Rotation

    seen = Rotation.from_quat(np.roll(q, -1, axis=-1)).as_matrix()
    low, high = volume.spin or (-np.pi, np.pi)
    half, middle = (np.inf if high - low >= TURN - 1e-12 else 0.5 * (high - low) + slack), 0.5 * (high + low)

    def turned(angle: F64, centre: float = 0.0) -> F64:
        return np.abs((angle - centre + np.pi) % TURN - np.pi)

    x, y, z = seen[..., :, 2].T
    tilt = np.arctan2(np.hypot(x, y), z)
    twist = turned(np.arctan2(seen[..., 1, 0] - seen[..., 0, 1], seen[..., 0, 0] + seen[..., 1, 1]), middle)
    if volume.kind == "cone":
        return np.asarray((tilt <= volume.tilts[0] + slack) & (twist <= half))
    about_x, about_y = np.asarray(volume.tilts) + slack
    if volume.kind == "square":
        shadow = (np.abs(np.arcsin(x)) <= about_y) & (np.abs(np.arcsin(y)) <= about_x) & (z >= -slack)
        return np.asarray(shadow & (twist <= half))
    a, b = np.arctan2(-y, z), np.arctan2(x, np.hypot(y, z))
    c = np.arctan2(-seen[..., 0, 1], seen[..., 0, 0])
    near = (np.abs(a) <= about_x) & (np.abs(b) <= about_y) & (turned(c, middle) <= half)
    far = (turned(a + np.pi) <= about_x) & (turned(np.pi - b) <= about_y) & (turned(c + np.pi, middle) <= half)
    return np.asarray(near | far)
