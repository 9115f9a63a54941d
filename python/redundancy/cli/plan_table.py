"""The table ``[plan]`` of job files."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from .._core import Robot
from ..files import Table

CRITERIA: Final = ("minimax", "integral", "motion")
_MOVING: Final = "RRRRRR"


@dataclass(frozen=True)
class PlanSettings:
    """What a job file says about planning; as for `redundancy.plan`, joints counted from 0, angles in radians.

    Attributes
    ----------
    warm_start : Path or None
        The file of an earlier trajectory.
    """

    criterion: str = "minimax"
    smoothness: float | None = None
    angles: int = 48
    layers: int = 32
    effort: int | None = None
    spin_range: tuple[float, float] | None = None
    spare: tuple[int, ...] | None = None
    spare_values: int = 24
    closed: bool = False
    limits: bool = True
    branch_changes: bool = False
    warm_start: Path | None = None


def read_plan(table: Table, robot: Robot, folder: Path) -> PlanSettings:
    """Read the table ``[plan]``.

    Parameters
    ----------
    table : Table
        The table; an empty one is that of the defaults.
    robot : Robot
        Whose joints it names.
    folder : Path
        Where the files are that it names.

    Returns
    -------
    PlanSettings
        In SI units, joints counted from 0.

    Raises
    ------
    RedundancyError
        If a key is unknown or wrong; of the table's kind.
    """
    table.only(
        *("criterion", "smoothness", "angles", "layers", "effort", "spin_range_deg", "spare", "spare_values"),
        *("closed", "limits", "branch_changes", "warm_start"),
    )
    default = PlanSettings()
    return PlanSettings(
        criterion=table.text("criterion", default.criterion, CRITERIA),
        smoothness=_smoothness(table),
        angles=table.integer("angles", default.angles, least=1),
        layers=table.integer("layers", default.layers, least=1),
        effort=table.integer("effort", least=1) if "effort" in table.data else None,
        spin_range=_spin_range(table),
        spare=_spare(table, robot),
        spare_values=table.integer("spare_values", default.spare_values, least=1),
        closed=table.flag("closed", default.closed),
        limits=table.flag("limits", default.limits),
        branch_changes=table.flag("branch_changes", default.branch_changes),
        warm_start=_warm_start(table, folder),
    )


def _smoothness(table: Table) -> float | None:
    if "smoothness" not in table:
        return None
    smoothness = table.number("smoothness")
    if smoothness < 0.0:
        raise table.error("smoothness", "a number of at least 0")
    return smoothness


def _spin_range(table: Table) -> tuple[float, float] | None:
    if "spin_range_deg" not in table:
        return None
    low, high = (float(end) for end in table.array("spin_range_deg", (2,)))
    if not low < high <= low + 360.0:
        raise table.error("spin_range_deg", "two increasing angles at most 360 deg apart")
    # From 360 deg apart rounding must not make more than a turn.
    return float(np.deg2rad(low)), float(min(np.deg2rad(high), np.deg2rad(low) + 2.0 * np.pi))


def _spare(table: Table, robot: Robot) -> tuple[int, ...] | None:
    if "spare" not in table:
        return None
    joints = table.data["spare"]
    known = isinstance(joints, list) and all(type(joint) is int and 1 <= joint <= robot.n for joint in joints)
    left = "".join(kind for i, kind in enumerate(robot.joints, 1) if i not in joints) if known else ""
    if left != _MOVING or len(set(joints)) < len(joints):
        raise table.error("spare", f"joints of {robot.joints}, counted from 1, that leave six revolute ones")
    return tuple(joint - 1 for joint in joints)


def _warm_start(table: Table, folder: Path) -> Path | None:
    if "warm_start" not in table:
        return None
    file = folder / table.text("warm_start")
    if file.suffix.lower() not in (".csv", ".json"):
        raise table.error("warm_start", "a .csv or .json file")
    return file
