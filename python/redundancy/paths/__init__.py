"""Where a tool has to go, and what a robot does there."""

from .motion import Differences, differences, length_along
from .toolpath import PointError, Toolpath, path_of_table
from .trajectory import Trajectory

__all__ = ["Differences", "PointError", "Toolpath", "Trajectory", "differences", "length_along", "path_of_table"]
