"""Where a tool has to go, and what a robot does there."""

from .toolpath import PointError, Toolpath, path_of_table
from .trajectory import Trajectory

__all__ = ["PointError", "Toolpath", "Trajectory", "path_of_table"]
