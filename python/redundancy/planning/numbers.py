"""Toolpaths as the core takes them."""

from .._core import PathData
from ..paths import Toolpath


def core_path(path: Toolpath) -> PathData:
    """Return a toolpath in numbers: its shares, its frames at spin 0, the spins along it."""
    return PathData(path.position, path.axis, path.rotation, path.time)
