"""Where a tool has to go, and what a robot does there."""

from .motion import differences, length_along
from .toolpath import PointError, Toolpath, path_of_table
from .trajectory import Trajectory

__all__ = ["PointError", "Toolpath", "Trajectory", "differences", "length_along", "path_of_table"]
