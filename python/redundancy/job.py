"""Job files: a robot, an objective, a task and a path in one TOML file.

::

    robot = "fanuc_m710ic50_milling"     # a packaged robot, or a .toml or .urdf file beside the job file

    [objective]
    length_mm = 485.5933                 # characteristic length (or length, in m); the robot's own if left out
    weights = { condition_number_squared = 1.0 }

    [task]
    kind = "axisymmetric"                # or "position"; "full" needs a path with rotations
    axis = [0, 0, 1]                     # the tool's axis in the tool frame

    [path]
    helix = { radius_mm = 250, pitch_mm_per_rad = 159.155, start_deg = 0, stop_deg = 90, center_mm = [1300, 1000, 0] }
    # or: file = "path.csv"

    [plan]                               # for ``redundancy plan`` and ``map``; all of it may be left out
    criterion = "minimax"                # or "integral", "motion"
    smoothness = 1e-3                    # weight of the motion; next to nothing if left out
    angles = 48                          # grid of the search: spins, points of the path, values of each spare joint
    layers = 48
    spare_values = 24
    spin_range_deg = [-90, 90]           # a whole turn if left out
    spare = [7]                          # joints on the grid, counted from 1; chosen if left out
    closed = false
    limits = true
    branch_changes = false
    warm_start = "out/trajectory.csv"    # an earlier plan, beside the job file
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from typing import Any, Final

import numpy as np

from . import robots
from ._core import (
    Objective,
    OrthogonalSQP,
    Robot,
    Task,
)
from ._plan_job import PlanSettings, read_plan
from ._toml import Table, parse
from .errors import InvalidValueError, RedundancyError, ToolpathError
from .posture import minimum_condition_posture
from .toolpath import Toolpath

_KINDS: Final = Objective.kinds()
_WEIGHTS: Final = (*_KINDS, *(f"{name}_squared" for name, of_jacobian in _KINDS.items() if of_jacobian))
_HELIX: Final = (
    *("radius", "radius_mm", "pitch", "pitch_mm_per_rad", "start", "start_deg", "stop", "stop_deg"),
    *("offset", "offset_deg", "center", "center_mm", "points", "duration_s"),
)


@dataclass(frozen=True)
class Job:
    """What a job file asks for; ``objective_name`` is the objective in words."""

    file: Path
    robot: Robot
    objective: Objective
    objective_name: str
    task: Task
    path: Toolpath
    plan: PlanSettings

    def solver(self) -> OrthogonalSQP:
        """Return the solver of the job."""
        return OrthogonalSQP(self.robot, self.task, self.objective)


def read_job(file: str | Path) -> Job:
    """Read a job file.

    Parameters
    ----------
    file : path-like
        The file; its keys are those of this module's docstring.

    Returns
    -------
    Job
        In SI units.

    Raises
    ------
    OSError
        If the file or one that it names cannot be opened.
    ToolpathError
        If it is malformed (``file:line:column: ...``), or the path in it is wrong.
    InvalidValueError
        If another key is missing, unknown or wrong (``file: key: ...``).
    UnknownRobotError, ModelError
        If its robot does not exist or is wrong.
    """
    file = Path(file)
    document = _document(file)
    document.only("robot", "objective", "task", "path", "plan")
    robot = robots.find(document.text("robot"), file.parent)
    task = _task(document.table("task"))
    path = _path(document.table("path"), file)
    length, weights = _objective(document.table("objective"))
    plan = read_plan(document.table("plan"), robot, file.parent)
    try:
        job = Job(file, robot, weighted_sum(weights, length, robot), _in_words(weights), task, path, plan)
        # What does not fit together shows here, while the file is known.
        job.solver()
        path.targets(task)
    except RedundancyError as error:
        raise document.fail(str(error)) from error
    return job


def read_path(file: str | Path) -> Toolpath:
    """Read the path of a job file, its table ``[path]``.

    Parameters
    ----------
    file : path-like
        The file.

    Returns
    -------
    Toolpath
        The path.

    Raises
    ------
    OSError
        If the file or one that it names cannot be opened.
    ToolpathError
        If it is malformed.
    """
    file = Path(file)
    return _path(_document(file).table("path"), file)


def _document(file: Path) -> Table:
    content = parse(file, lambda message, line, column: ToolpathError(message, file, line, column))
    return Table(content, lambda message: InvalidValueError(f"{file}: {message}"))


def weighted_sum(weights: dict[str, float], length: float | None, robot: Robot) -> Objective:
    """Return the weighted sum of indices by their names in job files.

    Parameters
    ----------
    weights : dict
        Weight of each index.
    length : float or None
        Characteristic length [m]; the robot's own if None.
    robot : Robot
        The robot.

    Returns
    -------
    Objective
        What is minimised.

    Raises
    ------
    InvalidValueError
        If the length is not positive, or the indices are not defined for the robot.
    """
    rows = robot.rows_in_use()
    if length is None:
        length = minimum_condition_posture(robot, starts=16, rows=rows).length
    return reduce(add, (weight * _term(name, length, rows) for name, weight in weights.items()))


def _in_words(weights: dict[str, float]) -> str:
    """Return a weighted sum as people read it: "condition number squared + 0.1 limit barrier"."""
    terms = [(weight, name.replace("_", " ")) for name, weight in weights.items() if weight != 0.0]
    return " + ".join(name if weight == 1.0 else f"{weight:g} {name}" for weight, name in terms) or "0"


def _objective(table: Table) -> tuple[float | None, dict[str, float]]:
    table.only("length", "length_mm", "weights")
    weights = table.table("weights")
    weights.only(*_WEIGHTS)
    return _length(table, "length"), {key: weights.number(key) for key in weights.data} or {
        "condition_number_squared": 1.0
    }


def _term(name: str, length: float, rows: list[int]) -> Objective:
    base = name.removesuffix("_squared")
    return Objective.named(base, length, rows, squared=base != name)


def _task(table: Table) -> Task:
    table.only("kind", "axis")
    kind = table.text("kind", "axisymmetric", ("axisymmetric", "position", "full"))
    if kind == "axisymmetric":
        axis = table.array("axis", (3,)) if "axis" in table else np.array([0.0, 0.0, 1.0])
        if not axis.any():
            raise table.error("axis", "a vector that is not zero")
        return Task.axisymmetric(axis)
    if "axis" in table:
        raise table.error("axis", f'nothing with kind = "{kind}"')
    return Task.full() if kind == "full" else Task.position()


def _path(table: Table, file: Path) -> Toolpath:
    table = Table(table.data, lambda message: ToolpathError(message, file), "path")
    table.only("helix", "file")
    if ("helix" in table) == ("file" in table):
        raise table.fail("path: expected either helix or file")
    if "file" in table:
        other = file.parent / table.text("file")
        # A job file as its own path would never end.
        if other.suffix.lower() == ".toml":
            raise table.error("file", "a .csv or .json file")
        return Toolpath.read(other)
    helix = _helix(table.table("helix"))
    try:
        return Toolpath.helix(**helix)
    except RedundancyError as error:
        raise table.fail(f"path.helix: {error}") from error


def _helix(table: Table) -> dict[str, Any]:
    table.only(*_HELIX)
    needed = {
        "radius": _length(table, "radius"),
        "pitch": _either(table, "pitch", "pitch_mm_per_rad", lambda mm: mm / 1000.0),
        "start": _angle(table, "start"),
        "stop": _angle(table, "stop"),
    }
    for key, value in needed.items():
        if value is None:
            raise table.error(key, "a number, or the same with its unit in the key")
    center = table.array("center_mm", (3,)) / 1000.0 if "center_mm" in table else np.zeros(3)
    return needed | {
        "offset": _angle(table, "offset") or 0.0,
        "center": table.array("center", (3,)) if "center" in table else center,
        "points": table.integer("points", 101, least=2),
        "duration": table.number("duration_s") if "duration_s" in table else None,
    }


def _either(table: Table, key: str, other: str, convert: Callable[[float], float]) -> float | None:
    """Read a number from its key in SI units, or from the other one; None if there is neither."""
    if key in table and other in table:
        raise table.error(other, f"only one of {key} and {other}")
    if key in table:
        return table.number(key)
    return convert(table.number(other)) if other in table else None


def _length(table: Table, key: str) -> float | None:
    return _either(table, key, f"{key}_mm", lambda mm: mm / 1000.0)


def _angle(table: Table, key: str) -> float | None:
    return _either(table, key, f"{key}_deg", lambda degrees: float(np.deg2rad(degrees)))
