"""Trajectories from the files that `Trajectory.write` makes."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from ._core import Robot
from .errors import RedundancyError, ToolpathError
from .toolpath import Toolpath
from .trajectory import Trajectory

_POINT = ("x_m", "y_m", "z_m", "i", "j", "k")
_WORTH = ("condition_number", "objective", "position_error_m", "axis_error_rad")
_TIME = "t_s"


def read_trajectory(file: Path, robot: Robot) -> Trajectory:
    """Read a trajectory that was written as ``.csv`` or ``.json``.

    Parameters
    ----------
    file : Path
        The file.
    robot : Robot
        Whose trajectory it is.

    Returns
    -------
    Trajectory
        As it was written, but for rotations of the path and the length; what JSON has as null is NaN.

    Raises
    ------
    OSError
        If the file cannot be opened.
    ToolpathError
        If it is none of a trajectory of such a robot.
    """
    try:
        text = file.read_bytes().decode()
    except UnicodeDecodeError:
        raise ToolpathError("not UTF-8 text", file) from None
    columns, status = _from_json(file, text) if file.suffix.lower() == ".json" else _from_csv(file, text)
    joints = [f"q{i}_{'rad' if kind == 'R' else 'm'}" for i, kind in enumerate(robot.joints, 1)]
    have = [name for name in columns if name.startswith("q")]
    if have != joints:
        raise ToolpathError(f"joints are {', '.join(have) or 'none'}, expected {', '.join(joints)}", file)
    for name in (*_POINT, *_WORTH):
        if name not in columns:
            raise ToolpathError(f"column {name!r} is missing", file)
    try:
        values = {name: np.array(column, dtype=np.float64) for name, column in columns.items()}
        q = np.stack([values[name] for name in joints], axis=1)
        points = np.stack([values[name] for name in _POINT], axis=1)
        path = Toolpath(points[:, :3], points[:, 3:], time=values.get(_TIME))
    except RedundancyError as error:
        raise ToolpathError(str(error), file) from None
    except (TypeError, ValueError):  # texts, or columns of different lengths
        raise ToolpathError("expected columns of equally many numbers", file) from None
    worth = [values[name] for name in _WORTH]
    if not np.isfinite(q).all() or {len(status), *map(len, worth)} != {len(q)}:
        raise ToolpathError("expected columns of equally many numbers, finite ones for the joints", file)
    condition, value, position_error, axis_error = worth
    return Trajectory(robot, path, q, condition, value, position_error, axis_error, status)


def _from_csv(file: Path, text: str) -> tuple[dict[str, list[Any]], list[str]]:
    """Return the columns of numbers, and the last one, the status."""
    header, *lines = [line.strip().split(",") for line in text.splitlines() if line.strip()] or [[""]]
    if header[0] != "point" or header[-1] != "status":
        raise ToolpathError("no trajectory, expected columns from point to status", file, 1)
    rows = []
    for number, fields in enumerate(lines, 2):
        if len(fields) != len(header):
            raise ToolpathError(f"{len(fields)} fields, expected {len(header)}, as in the header", file, number)
        try:
            rows.append([float(field) for field in fields[:-1]])
        except ValueError as error:
            raise ToolpathError(str(error), file, number) from None
    if not rows:
        raise ToolpathError("no points after the header", file, 1)
    columns = dict(zip(header[:-1], map(list, zip(*rows, strict=True)), strict=True))
    return columns, [fields[-1] for fields in lines]


def _from_json(file: Path, text: str) -> tuple[dict[str, list[Any]], list[str]]:
    """Return the object of columns, and the status."""
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ToolpathError(error.msg, file, error.lineno, error.colno) from None
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, brackets thousands deep
        raise ToolpathError(str(error), file) from None
    columns = content.get("columns") if isinstance(content, dict) else None
    status = content.get("status") if isinstance(content, dict) else None
    if not isinstance(columns, dict) or not isinstance(status, list):
        raise ToolpathError("no trajectory, expected an object with columns and status", file)
    if not all(isinstance(column, list) for column in columns.values()):
        raise ToolpathError("expected columns of equally many numbers", file)
    return columns, [str(state) for state in status]
