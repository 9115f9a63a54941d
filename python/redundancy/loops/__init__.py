"""Loops along a path: from point to point, from several starts, tick by tick."""

from .following import Solver, first_posture, follow, follow_without_spin, joined
from .start import CyclicStart, StartSearch, best_start, cyclic_start
from .timing import ConstantSpeed, Motion, SpeedLimit, constant_speed
from .tracking import Tracking, stiffness_profile, track

__all__ = [
    "ConstantSpeed",
    "CyclicStart",
    "Motion",
    "Solver",
    "SpeedLimit",
    "StartSearch",
    "Tracking",
    "best_start",
    "constant_speed",
    "cyclic_start",
    "first_posture",
    "follow",
    "follow_without_spin",
    "joined",
    "stiffness_profile",
    "track",
]
