"""What is held along a path, as the table ``[plan]`` of job files has it."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from .._core import Robot
from .._util import F64
from ..files import Table

PIN_KEYS: Final = ("start", "start_deg", "end", "end_deg", "pins", "pins_deg")
_TURN: Final = 2.0 * np.pi


def read_posture(table: Table, key: str, robot: Robot) -> F64 | None:
    """Read a posture under ``key`` [rad or m] or ``key_deg`` [deg; mm where a joint slides].

    Raises
    ------
    RedundancyError
        If it is not one number a joint, or both keys are there; of the table's kind.
    """
    name = _one_of(table, key)
    if name is None:
        return None
    posture: F64 = table.array(name, (robot.n,)) * _units(robot, name)
    return posture


def read_pins(table: Table, robot: Robot) -> dict[int, float | F64]:
    """Read the pins, ``[[point, spin], ...]`` or ``[[point, q1, ..., qn], ...]``, under ``pins`` or ``pins_deg``.

    Raises
    ------
    RedundancyError
        If one is neither, a point is held twice, or a spin in radians is beyond a turn; of the table's kind.
    """
    name = _one_of(table, "pins")
    pins: dict[int, float | F64] = {}
    if name is None:
        return pins
    expected = f"a list of [point, spin] or [point, {robot.n} joints], points counted from 0, one a point"
    rows = table.data[name]
    if not isinstance(rows, list):
        raise table.error(name, expected)
    for row in rows:
        plain = isinstance(row, list) and all(type(x) in (int, float) for x in row)
        if not plain or len(row) not in (2, 1 + robot.n) or type(row[0]) is not int or row[0] < 0 or row[0] in pins:
            raise table.error(name, expected)
        if len(row) == 2:
            if name == "pins" and abs(row[1]) > _TURN:
                raise table.error(name, "spins in rad within a turn; degrees under pins_deg")
            pins[row[0]] = float(np.deg2rad(row[1])) if name.endswith("_deg") else float(row[1])
        else:
            pins[row[0]] = np.array(row[1:], dtype=np.float64) * _units(robot, name)
    return pins


def _one_of(table: Table, key: str) -> str | None:
    """Return which of ``key`` and ``key_deg`` the table has."""
    names = [name for name in (key, f"{key}_deg") if name in table]
    if len(names) > 1:
        raise table.error(names[1], f"{key} or {names[1]}, not both")
    return names[0] if names else None


def _units(robot: Robot, name: str) -> NDArray[np.float64]:
    """Return what one of a file's numbers is in rad or m, for every joint."""
    if not name.endswith("_deg"):
        return np.ones(robot.n)
    return np.array([1e-3 if kind == "P" else np.pi / 180.0 for kind in robot.joints])
