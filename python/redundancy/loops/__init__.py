"""Loops along a path: from point to point, from several starts, tick by tick."""

from .dynamics import Dynamics, PinocchioDynamics, TorqueFunction, checked_limit
from .following import Solver, first_posture, follow, follow_without_spin, joined
from .start import CyclicStart, StartSearch, best_start, cyclic_start
from .timing import ConstantSpeed, Motion, SpeedLimit, constant_speed, torques_of
from .tracking import Tracking, stiffness_profile, track

__all__ = [
    "ConstantSpeed",
    "CyclicStart",
    "Dynamics",
    "Motion",
    "PinocchioDynamics",
    "Solver",
    "SpeedLimit",
    "StartSearch",
    "TorqueFunction",
    "Tracking",
    "best_start",
    "checked_limit",
    "constant_speed",
    "cyclic_start",
    "first_posture",
    "follow",
    "follow_without_spin",
    "joined",
    "stiffness_profile",
    "torques_of",
    "track",
]
