"""The table ``[plan]`` of job files."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from .._core import PlanSettings, Robot
from ..files import Table
from .pins import PIN_KEYS, read_pins, read_posture

CRITERIA: Final = ("minimax", "integral", "motion", "speed")
KEYS: Final = (
    *(
        "criterion",
        "smoothness",
        "joint_weights",
        "n_angles",
        "layers",
        "effort",
        "spin_range_deg",
        "max_spin_step_deg",
        "max_step",
    ),
    *("spare", "n_spare", "branches", "branch_changes", "closed", "limits", "bound", "max_iterations", "warm_start"),
    *("reconfigurations", "lift_off_mm", *PIN_KEYS),
)
OLD_NAMES: Final = {"angles": "n_angles", "spare_values": "n_spare"}
"""Keys of older job files."""
_MOVING: Final = "RRRRRR"


@dataclass(frozen=True)
class PlanTable:
    """What a job file says about planning.

    Attributes
    ----------
    settings : PlanSettings
        As for `redundancy.plan`.
    warm_start : Path or None
        The file of an earlier trajectory.
    """

    settings: PlanSettings = field(default_factory=lambda: PlanSettings(bound=True))
    warm_start: Path | None = None


def read_plan(table: Table, robot: Robot, folder: Path) -> PlanTable:
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
    PlanTable
        In SI units, joints counted from 0.

    Raises
    ------
    RedundancyError
        If a key is unknown or wrong; of the table's kind.
    """
    table.only(*KEYS, *OLD_NAMES)
    for old, new in OLD_NAMES.items():
        if old in table and new in table:
            raise table.error(old, f"{new} alone, of which it is the old name")
    default = PlanSettings()
    settings = PlanSettings(
        table.text("criterion", default.criterion, CRITERIA),
        table.flag("limits", default.limits),
        smoothness=_smoothness(table),
        joint_weights=_joint_weights(table, robot),
        n_angles=_count(table, "n_angles", "angles"),
        layers=_count(table, "layers"),
        spin_range=_spin_range(table),
        max_spin_step=_max_spin_step(table),
        max_step=_max_step(table),
        spare=_spare(table, robot),
        n_spare=_count(table, "n_spare", "spare_values"),
        branches=_branches(table),
        branch_changes=table.flag("branch_changes", default.branch_changes),
        closed=table.flag("closed", default.closed),
        bound=table.flag("bound", True),
        effort=_count(table, "effort"),
        max_iterations=_count(table, "max_iterations"),
        start=read_posture(table, "start", robot),
        end=read_posture(table, "end", robot),
        pins=read_pins(table, robot),
        reconfigurations=table.flag("reconfigurations", default.reconfigurations),
        lift_off=_lift_off(table),
    )
    return PlanTable(settings, _warm_start(table, folder))


def _count(table: Table, *names: str) -> int | None:
    """Return a number of at least 1 under the first of some names that the table has."""
    name = next((name for name in names if name in table), None)
    return None if name is None else table.integer(name, least=1)


def _lift_off(table: Table) -> float | None:
    if "lift_off_mm" not in table:
        return None
    lift = table.number("lift_off_mm")
    if lift < 0.0:
        raise table.error("lift_off_mm", "a number of at least 0")
    return 1e-3 * lift


def _max_spin_step(table: Table) -> float | None:
    if "max_spin_step_deg" not in table:
        return None
    step = table.number("max_spin_step_deg")
    if not 0.0 < step <= 180.0:
        raise table.error("max_spin_step_deg", "an angle above 0, at most 180 deg")
    return min(float(np.deg2rad(step)), np.pi)


def _max_step(table: Table) -> float | None:
    if "max_step" not in table:
        return None
    step = table.number("max_step")
    if not step > 0.0:
        raise table.error("max_step", "a number above 0")
    return step


def _branches(table: Table) -> tuple[int, ...] | None:
    if "branches" not in table:
        return None
    branches = table.data["branches"]
    if not (isinstance(branches, list) and all(type(branch) is int and branch >= 0 for branch in branches)):
        raise table.error("branches", "a list of branches, counted from 0")
    return tuple(branches)


def _smoothness(table: Table) -> float | None:
    if "smoothness" not in table:
        return None
    smoothness = table.number("smoothness")
    if smoothness < 0.0:
        raise table.error("smoothness", "a number of at least 0")
    return smoothness


def _joint_weights(table: Table, robot: Robot) -> NDArray[np.float64] | None:
    if "joint_weights" not in table:
        return None
    weights = table.array("joint_weights", (robot.n,))
    if not ((weights >= 0.0).all() and weights.any()):
        raise table.error("joint_weights", "a number of at least 0 for every joint, not all of them 0")
    return weights


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
