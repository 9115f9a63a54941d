"""Files of toolpaths: columns in, columns out."""

from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from .._util import F64
from ..errors import ToolpathError
from .text import fault_in, parse_json, read_text
from .whole import write_atomically

METRES: Final = ("x", "y", "z")
MILLIMETRES: Final = ("x_mm", "y_mm", "z_mm")
AXIS: Final = ("i", "j", "k")
TIME: Final = "t"
ROTATION: Final = tuple(f"r{row}{column}" for row in "123" for column in "123")
KNOWN: Final = (*METRES, *MILLIMETRES, *AXIS, TIME, *ROTATION)


@dataclass(frozen=True)
class ToolpathColumns:
    """What a file holds, in SI units, and where each point stands in it."""

    file: Path
    values: dict[str, F64]
    lines: Sequence[int] | None = None

    def _stack(self, names: Sequence[str]) -> F64:
        return np.stack([self.values[name] for name in names], axis=1)

    @property
    def position(self) -> F64:
        """Positions [m], shape (N, 3)."""
        # A division rounds once: 1300 mm is the same number as 1.3 m.
        return self._stack(METRES) if METRES[0] in self.values else self._stack(MILLIMETRES) / 1000.0

    @property
    def axis(self) -> F64:
        """Axes, shape (N, 3)."""
        return self._stack(AXIS)

    @property
    def rotation(self) -> F64 | None:
        """Rotations, shape (N, 3, 3), if there are any."""
        return self._stack(ROTATION).reshape(-1, 3, 3) if ROTATION[0] in self.values else None

    @property
    def time(self) -> F64 | None:
        """Times [s], shape (N,), if there are any."""
        return self.values.get(TIME)

    def fail(self, point: int, message: str) -> ToolpathError:
        """Make the exception for a point."""
        return ToolpathError(message, self.file, None if self.lines is None else self.lines[point])


def read_toolpath(file: Path) -> ToolpathColumns:
    """Read a CSV or JSON file.

    Parameters
    ----------
    file : Path
        The file.

    Returns
    -------
    ToolpathColumns
        Complete, of equal length, at least one point, finite.

    Raises
    ------
    OSError
        If it cannot be opened.
    ToolpathError
        If it is malformed.
    """
    readers = {".csv": _read_csv, ".json": _read_json}
    reader = readers.get(file.suffix.lower())
    if reader is None:
        raise ToolpathError(f"unknown format {file.suffix!r}, expected .csv, .json or .toml", file)
    return reader(file, read_text(file, fault_in(file), "utf-8-sig"))


def _check_names(file: Path, names: Sequence[str], line: int | None) -> None:
    """Refuse unknown, repeated and missing columns."""
    for name in names:
        if name not in KNOWN:
            raise ToolpathError(f"unknown column {name!r}, expected {', '.join(METRES + AXIS)} and {TIME}", file, line)
        if names.count(name) > 1:
            raise ToolpathError(f"column {name!r} stands there twice", file, line)
    position = MILLIMETRES if MILLIMETRES[0] in names else METRES
    for name in (*position, *AXIS, *(ROTATION if set(ROTATION) & set(names) else ())):
        if name not in names:
            raise ToolpathError(f"column {name!r} is missing", file, line)
    if set(METRES) & set(names) and set(MILLIMETRES) & set(names):
        raise ToolpathError("columns in m and in mm, expected one of them", file, line)


def _read_csv(file: Path, text: str) -> ToolpathColumns:
    rows = [(number, line) for number, line in enumerate(text.split("\n"), 1) if line.strip()]
    rows = [(number, line) for number, line in rows if not line.lstrip().startswith("#")]
    if not rows:
        raise ToolpathError("no header, expected one that names the columns", file, 1, 1)
    header, *points = rows
    names = [name.strip().lower() for name in header[1].split(",")]
    _check_names(file, names, header[0])
    if not points:
        raise ToolpathError("no points after the header", file, header[0])
    numbers = np.array([_csv_row(file, number, line, names) for number, line in points])
    values = {name: np.ascontiguousarray(column) for name, column in zip(names, numbers.T, strict=True)}
    return ToolpathColumns(file, values, [number for number, _ in points])


def _csv_row(file: Path, number: int, line: str, names: Sequence[str]) -> list[float]:
    fields = line.split(",")
    if len(fields) != len(names):
        raise ToolpathError(f"{len(fields)} fields, expected {len(names)}, as in the header", file, number)
    values, column = [], 1
    for name, field in zip(names, fields, strict=True):
        value = _number(field)
        if not np.isfinite(value):
            start = column + len(field) - len(field.lstrip())
            raise ToolpathError(f"{name} is {field.strip()!r}, expected a finite number", file, number, start)
        values.append(value)
        column += len(field) + 1
    return values


def _read_json(file: Path, text: str) -> ToolpathColumns:
    content = parse_json(text, fault_in(file))
    if not isinstance(content, dict):
        raise ToolpathError("expected an object of columns", file)
    _check_names(file, list(content), None)
    values = {name: _json_column(file, name, column) for name, column in content.items()}
    sizes = {name: len(column) for name, column in values.items()}
    if len(set(sizes.values())) > 1 or 0 in sizes.values():
        raise ToolpathError(f"columns of {sizes} numbers, expected equally many, and at least 1", file)
    return ToolpathColumns(file, values)


def _json_column(file: Path, name: str, column: Any) -> F64:  # noqa: ANN401  (whatever stands in the file)
    if not isinstance(column, list):
        raise ToolpathError(f"{name} is no array", file)
    values = np.array([_number(value) if isinstance(value, int | float) else np.nan for value in column])
    if not np.isfinite(values).all():
        index = int(np.argmin(np.isfinite(values)))
        raise ToolpathError(f"{name}[{index}] is {column[index]!r:.40}, expected a finite number", file)
    return values


def _number(value: str | float) -> float:
    """Convert to a float; NaN for what is none (True, and the underscores that Python allows between digits)."""
    if isinstance(value, bool) or (isinstance(value, str) and "_" in value):
        return np.nan
    try:
        return float(value)
    except (ValueError, OverflowError):
        return np.nan


def write_toolpath(file: str | Path, position: F64, axis: F64, rotation: F64 | None, time: F64 | None) -> None:
    """Write columns in m and s, every digit kept.

    Parameters
    ----------
    file : path-like
        The file.
    position, axis, rotation, time
        As in `redundancy.Toolpath`.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    names, parts = [*METRES, *AXIS], [position, axis]
    if time is not None:
        names, parts = [*names, TIME], [*parts, time[:, None]]
    if rotation is not None:
        names, parts = [*names, *ROTATION], [*parts, rotation.reshape(-1, 9)]
    out = StringIO()
    out.write(",".join(names) + "\n")
    for row in np.hstack(parts).tolist():
        out.write(",".join(map(repr, row)) + "\n")
    write_atomically(file, out.getvalue())
