"""What every room needs: checks of arrays, rotations, progress on the terminal."""

from .arrays import F64, checked
from .progress import progress_bar
from .rotations import axis_angle, between, perpendicular, turns

__all__ = ["F64", "axis_angle", "between", "checked", "perpendicular", "progress_bar", "turns"]
