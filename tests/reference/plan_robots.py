"""The robots of random plans: six and seven axes of the library, planar arms, a SCARA, gantries, arms on rails."""

from collections.abc import Callable
from typing import Final

import numpy as np
import redundancy as rd

QUARTER: Final = np.pi / 2


def _dh(
    lengths: list[list[float]], joints: str, ends: float | list[float], speed: float | list[float], name: str
) -> rd.Robot:
    a, d, alpha, theta = lengths
    high = np.broadcast_to(ends, len(joints))
    low = np.where([letter == "P" for letter in joints], 0.0, -high)
    return rd.Robot.from_dh(
        a, d, alpha, theta, joints, q_min=low, q_max=high, qd_max=np.broadcast_to(speed, len(joints)), name=name
    )


def _slides(hand: int) -> rd.Robot:
    """Return three slides across each other and `hand` turns."""
    a, d = [0.0] * (3 + hand), [0.0] * (2 + hand) + [0.2]
    alpha = [QUARTER, QUARTER, 0, -QUARTER, QUARTER, 0][: 3 + hand]
    theta = [QUARTER, QUARTER, 0, 0, 0, 0][: 3 + hand]
    ends, speeds = [1.5, 1.5, 1.0, 3.0, 2.0, 3.0][: 3 + hand], [1.0, 1.0, 1.0, 3.0, 3.0, 4.0][: 3 + hand]
    return _dh([a, d, alpha, theta], "PPP" + "R" * hand, ends, speeds, f"gantry of {3 + hand}")


def _planar(lengths: list[float]) -> rd.Robot:
    zero = [0.0] * len(lengths)
    return _dh([lengths, zero, zero, zero], "R" * len(lengths), 3.0, 2.0, f"planar {len(lengths)}R")


def _scara() -> rd.Robot:
    table = [[0.4, 0.3, 0, 0], [0.4, 0, 0, 0], [0, np.pi, 0, 0], [0.0] * 4]
    return _dh(table, "RRPR", [2.5, 2.5, 0.4, 6.0], [4.0, 6.0, 1.0, 9.0], "scara")


def _railed(name: str) -> rd.Robot:
    return rd.on_rail(rd.robots.get(name), (0.0, 1.0, 0.0), -1.0, 1.0, 1.0)


ROBOTS: Final[dict[str, Callable[[], rd.Robot]]] = {
    **{
        name: (lambda name=name: rd.robots.get(name))  # type: ignore[misc]
        for name in rd.robots.names()
        if rd.robots.get(name).n in (6, 7)
    },
    "planar 3R": lambda: _planar([0.5, 0.4, 0.3]),
    "planar 4R": lambda: _planar([0.4, 0.4, 0.3, 0.2]),
    "scara": _scara,
    "gantry PPPRRR": lambda: _slides(3),
    "gantry PPPRR": lambda: _slides(2),
    "rail and irb120": lambda: _railed("abb_irb120"),
    "rail and ur5e": lambda: _railed("ur5e"),
    "rail and panda": lambda: _railed("panda"),
}
