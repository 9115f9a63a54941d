"""The table ``[path]`` of job files."""

from pathlib import Path
from typing import Any, Final

import numpy as np

from ..errors import InvalidValueError, ToolpathError
from .text import fault_in
from .toml import Table, parse_toml

_HELIX: Final = (
    *("radius", "radius_mm", "pitch", "pitch_mm_per_rad", "start", "start_deg", "stop", "stop_deg"),
    *("offset", "offset_deg", "center", "center_mm", "points", "duration_s"),
)


def read_document(file: Path) -> Table:
    """Read a job file as a table, whose faults name the file.

    Raises
    ------
    OSError
        If the file cannot be opened.
    ToolpathError
        If it is malformed.
    """
    return Table(parse_toml(file, fault_in(file)), lambda message: InvalidValueError(f"{file}: {message}"))


def path_source(table: Table, file: Path) -> Path | dict[str, Any]:
    """Return what a table ``[path]`` names: a file, or the arguments of a helix.

    Parameters
    ----------
    table : Table
        The table.
    file : Path
        The job file that it stands in.

    Returns
    -------
    Path or dict
        The file; or the arguments of `redundancy.Toolpath.helix`, in SI units.

    Raises
    ------
    ToolpathError
        If a key is missing, unknown or wrong.
    """
    table = Table(table.data, lambda message: ToolpathError(message, file), "path")
    table.only("helix", "file")
    if ("helix" in table) == ("file" in table):
        raise table.fail("path: expected either helix or file")
    if "helix" in table:
        return _helix(table.table("helix"))
    other = file.parent / table.text("file")
    # A job file as its own path would never end.
    if other.suffix.lower() == ".toml":
        raise table.error("file", "a .csv or .json file")
    return other


def _helix(table: Table) -> dict[str, Any]:
    table.only(*_HELIX)
    needed = {
        "radius": table.length("radius"),
        "pitch": table.either("pitch", "pitch_mm_per_rad", lambda millimetres: millimetres / 1000.0),
        "start": table.angle("start"),
        "stop": table.angle("stop"),
    }
    for key, value in needed.items():
        if value is None:
            raise table.error(key, "a number, or the same with its unit in the key")
    center = table.array("center_mm", (3,)) / 1000.0 if "center_mm" in table else np.zeros(3)
    return needed | {
        "offset": table.angle("offset") or 0.0,
        "center": table.array("center", (3,)) if "center" in table else center,
        "points": table.integer("points", 101, least=2),
        "duration": table.number("duration_s") if "duration_s" in table else None,
    }
