"""Files: whole or not there, every fault named with its place; columns and tables, no class of the package."""

from .path_table import path_source, read_document
from .text import Fault
from .toml import Table, parse_toml
from .toolpaths import read_toolpath, write_toolpath
from .trajectories import FRAMES, TrajectoryColumns, formatted, read_trajectory
from .whole import whole_files, write_atomically

__all__ = [
    "FRAMES",
    "Fault",
    "Table",
    "TrajectoryColumns",
    "formatted",
    "parse_toml",
    "path_source",
    "read_document",
    "read_toolpath",
    "read_trajectory",
    "whole_files",
    "write_atomically",
    "write_toolpath",
]
