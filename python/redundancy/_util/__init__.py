"""What every room needs: checks of arrays, whose joints are meant, rotations, progress on the terminal."""

from .arrays import F64, checked
from .joints import JOINTS, Joints, checked_joints, coordinates_of, kinds_of, limits_of, names_of
from .progress import progress_bar
from .rotations import axis_angle, between, checked_pose, turns

__all__ = [
    "F64",
    "JOINTS",
    "Joints",
    "axis_angle",
    "between",
    "checked",
    "checked_joints",
    "checked_pose",
    "coordinates_of",
    "kinds_of",
    "limits_of",
    "names_of",
    "progress_bar",
    "turns",
]
