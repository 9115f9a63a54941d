"""Job files: a robot, an objective, a task and a path in one TOML file.

::

    robot = "fanuc_m710ic50_milling"     # a packaged robot, or a .toml or .urdf file beside the job file
    # tip = "tool0"                      # of a .urdf file the last link, and base the first; or all of it in one table:
    # robot = { file = "ur5.urdf", tip = "tool0", base = "base_link", limits = { elbow = [-3.0, 3.0] } }

    [objective]
    length_mm = 485.5933                 # characteristic length (or length, in m); the robot's own if left out
    rows = [0, 1, 2, 3, 4, 5]            # of the Jacobian, [omega; v] in the base frame; found if left out
    weights = { condition_number_squared = 1.0 }

    [task]
    kind = "axisymmetric"                # or "position"; "full" needs a path with rotations
    axis = [0, 0, 1]                     # the tool's axis in the tool frame
    # kind = "cone"                      # or "line_x", "line_y": tilted from the path's frame by no more than
    # tilt_deg = 10
    # spin_deg = [-30, 30]               # the spin that is left to a volume; any if left out
    # kind = "pyramid"                   # or "square": about the frame's x and y axis
    # tilt_x_deg = 10
    # tilt_y_deg = 5

    [path]
    helix = { radius_mm = 250, pitch_mm_per_rad = 159.155, start_deg = 0, stop_deg = 90, center_mm = [1300, 1000, 0] }
    # or: file = "path.csv"

    [plan]                               # for ``redundancy plan`` and ``map``; all of it may be left out
    criterion = "minimax"                # or "integral", "motion", "speed"
    smoothness = 1e-3                    # weight of the motion; next to nothing if left out
    joint_weights = [2, 2, 1, 1, 1, 1]   # weights of the joints in the motion; 1 each if left out
    n_angles = 48                        # grid of the search: spins, points of the path, values of each spare joint
    layers = 32
    n_spare = 24                         # chosen by how many are held if left out
    spin_range_deg = [-90, 90]           # a whole turn if left out
    spare = [7]                          # joints on the grid, counted from 1; chosen if left out
    closed = false
    limits = true
    branch_changes = false
    warm_start = "out/trajectory.csv"    # an earlier plan, beside the job file
    start_deg = [0, -30, 60, 0, 90, 0]   # postures in which the path begins and ends (or start, in rad and m)
    end_deg = [10, -30, 60, 0, 90, 0]    # deg, mm where a joint slides
    pins_deg = [[30, 45], [60, -20]]     # points and the spins, or the postures, that are held there (or pins, in rad)
    reconfigurations = false             # whether the path may be left and entered again where no single way exists
    lift_off_mm = 50

    [output]
    frame = "tool"                       # whose poses RobotMaster gets; or "flange"
    joints = "robot"                     # whose joints columns and pictures have; or "controller"
"""

from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from typing import Final, Literal, TypeAlias, cast

import numpy as np

from .. import robots
from .._core import (
    Objective,
    OrientationVolume,
    OrthogonalSQP,
    Robot,
    Task,
)
from .._util import JOINTS, Joints
from ..design import minimum_condition_posture
from ..errors import InvalidValueError, RedundancyError
from ..files import FRAMES, Table, read_document
from ..paths import Toolpath, path_of_table
from .freedom import mixed, possible, rows_for
from .plan_table import PlanTable, read_plan

Frame: TypeAlias = Literal["tool", "flange"]
_VOLUMES: Final = {
    "cone": ("tilt_deg",),
    "pyramid": ("tilt_x_deg", "tilt_y_deg"),
    "square": ("tilt_x_deg", "tilt_y_deg"),
    "line_x": ("tilt_deg",),
    "line_y": ("tilt_deg",),
}
"""Volumes of orientations, with the keys of their tilts."""
_KINDS: Final = Objective.kinds()
_WEIGHTS: Final = (*_KINDS, *(f"{name}_squared" for name, of_jacobian in _KINDS.items() if of_jacobian))


@dataclass(frozen=True)
class Job:
    """What a job file asks for; ``objective_name`` is the objective in words, ``frame`` what poses are written of."""

    file: Path
    robot: Robot
    objective: Objective
    objective_name: str
    task: Task
    path: Toolpath
    plan: PlanTable
    frame: Frame
    rows: list[int]
    joints: Joints = "robot"

    def solver(self) -> OrthogonalSQP:
        """Return the solver of the job: for that part of its task that the joints change."""
        return OrthogonalSQP(self.robot, possible(self.task, self.robot), self.objective)


def read_job(file: str | Path, base: str | None = None, tip: str | None = None) -> Job:
    """Read a job file.

    Parameters
    ----------
    file : path-like
        The file; its keys are those of this module's docstring.
    base, tip : str, optional
        The first and last link of its ``.urdf`` file, in place of those that it names.

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
    document = read_document(file)
    document.only("robot", "base", "tip", "objective", "task", "path", "plan", "output")
    robot = _robot(document, file.parent, base, tip)
    task = _task(document.table("task"))
    path = path_of_table(document.table("path"), file)
    length, weights, rows = _objective(document.table("objective"))
    plan = read_plan(document.table("plan"), robot, file.parent)
    frame, joints = _output(document.table("output"))
    try:
        rows = rows_for(robot, path.axis.mean(axis=0), rows)
        objective = weighted_sum(weights, length, robot, rows)
        job = Job(file, robot, objective, _in_words(weights), task, path, plan, frame, rows, joints)
        # What does not fit together shows here, while the file is known.
        if task.volume is None:
            job.solver()
            path.targets(job.solver().task)
    except RedundancyError as error:
        raise document.fail(str(error)) from error
    return job


def _robot(document: Table, folder: Path, base: str | None, tip: str | None) -> Robot:
    """Return the robot: a name or a file, or a table with the links and limits of a ``.urdf`` file."""
    named = document.data.get("robot")
    table = document.table("robot") if isinstance(named, dict) else document
    key = "file" if isinstance(named, dict) else "robot"
    if isinstance(named, dict):
        table.only("file", "base", "tip", "limits")
        for link in ("base", "tip"):
            if link in document:
                raise document.error(link, "none beside a table robot, which has its own")
    text = table.text(key)
    base, tip = (
        given if given is not None or link not in table else table.text(link)
        for link, given in (("base", base), ("tip", tip))
    )
    try:
        if key == "file" and "limits" in table:
            return Robot.from_urdf(folder / text, base, tip, limits=table.table("limits").data)
        return robots.find(text, folder, base, tip)
    except InvalidValueError as error:
        raise document.fail(str(error)) from error


def weighted_sum(
    weights: dict[str, float], length: float | None, robot: Robot, rows: list[int] | None = None
) -> Objective:
    """Return the weighted sum of indices by their names in job files.

    Parameters
    ----------
    weights : dict
        Weight of each index.
    length : float or None
        Characteristic length [m]; the robot's own if None.
    robot : Robot
        The robot.
    rows : list of int, optional
        Rows of the Jacobian that count; those in use if not given.

    Returns
    -------
    Objective
        What is minimised.

    Raises
    ------
    InvalidValueError
        If the length is not positive, or the indices are not defined for the robot.
    """
    rows = robot.rows_in_use() if rows is None else rows
    if length is None and not mixed(rows):
        length = 1.0
    if length is None:
        length = minimum_condition_posture(robot, starts=16, rows=rows).length
    return reduce(add, (weight * _term(name, length, rows) for name, weight in weights.items()))


def _in_words(weights: dict[str, float]) -> str:
    """Return a weighted sum as people read it: "condition number squared + 0.1 limit barrier"."""
    terms = [(weight, name.replace("_", " ")) for name, weight in weights.items() if weight != 0.0]
    return " + ".join(name if weight == 1.0 else f"{weight:g} {name}" for weight, name in terms) or "0"


def _objective(table: Table) -> tuple[float | None, dict[str, float], list[int] | None]:
    table.only("length", "length_mm", "rows", "weights")
    weights = table.table("weights")
    weights.only(*_WEIGHTS)
    rows = table.data.get("rows")
    if rows is not None and not (isinstance(rows, list) and all(type(row) is int for row in rows)):
        raise table.error("rows", "a list of rows from 0 to 5")
    read = {key: weights.number(key) for key in weights.data}
    return table.length("length"), read or {"condition_number_squared": 1.0}, rows


def _output(table: Table) -> tuple[Frame, Joints]:
    table.only("frame", "joints")
    return cast("Frame", table.text("frame", FRAMES[0], FRAMES)), cast(
        "Joints", table.text("joints", JOINTS[0], JOINTS)
    )


def _term(name: str, length: float, rows: list[int]) -> Objective:
    base = name.removesuffix("_squared")
    return Objective.named(base, length, rows, squared=base != name)


def _task(table: Table) -> Task:
    kind = table.text("kind", "axisymmetric", ("axisymmetric", "position", "full", *_VOLUMES))
    if kind in _VOLUMES:
        return Task.within(_volume(table, kind))
    table.only("kind", "axis")
    if kind == "axisymmetric":
        axis = table.array("axis", (3,)) if "axis" in table else np.array([0.0, 0.0, 1.0])
        if not axis.any():
            raise table.error("axis", "a vector that is not zero")
        return Task.axisymmetric(axis)
    if "axis" in table:
        raise table.error("axis", f'nothing with kind = "{kind}"')
    return Task.full() if kind == "full" else Task.position()


def _volume(table: Table, kind: str) -> OrientationVolume:
    """Return a volume of orientations, angles in degrees."""
    tilts = _VOLUMES[kind]
    table.only("kind", *tilts, "spin_deg")
    angles = [float(np.deg2rad(table.number(key))) for key in tilts]
    spin = None
    if "spin_deg" in table:
        low, high = (float(end) for end in np.deg2rad(table.array("spin_deg", (2,))))
        spin = low, high
    try:
        volume: OrientationVolume = getattr(OrientationVolume, kind)(*angles, spin=spin)
    except InvalidValueError as error:
        raise table.fail(str(error)) from error
    return volume
