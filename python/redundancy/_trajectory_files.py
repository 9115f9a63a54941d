"""Formats of trajectories."""

import json
from collections.abc import Callable
from io import StringIO
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from ._arrays import F64

if TYPE_CHECKING:
    from .trajectory import Trajectory


def to_csv(trajectory: "Trajectory") -> str:
    """Return a header with units, then one line a point."""
    columns = _columns(trajectory)
    out = StringIO()
    out.write(",".join(["point", *columns, "status"]) + "\n")
    rows = np.stack(list(columns.values()), axis=1).tolist()
    for point, (row, status) in enumerate(zip(rows, trajectory.status, strict=True)):
        out.write(f"{point},{','.join(map(repr, row))},{status}\n")
    return out.getvalue()


def to_json(trajectory: "Trajectory") -> str:
    """Return an object of columns with units, and what sums them up; null where a number is not finite."""
    content: dict[str, Any] = {
        "robot": trajectory.robot.name,
        "joints": trajectory.robot.joints,
        "points": len(trajectory),
        "length_m": trajectory.length,
        "max_condition_number": _finite(trajectory.max_condition_number),
        "mean_condition_number": _finite(trajectory.mean_condition_number),
        "limit_margin": _finite(trajectory.limit_margin),
        "max_joint_speed": trajectory.max_joint_speed,
        "columns": {name: [_finite(x) for x in column.tolist()] for name, column in _columns(trajectory).items()},
        "status": trajectory.status,
    }
    return json.dumps(content, indent=1, allow_nan=False) + "\n"


def to_pathx(trajectory: "Trajectory") -> str:
    """Return the path file of RobotMaster (Leger 2014, appendix A); see `Trajectory.write`."""
    tools = trajectory.robot.fk(trajectory.q)
    angles = np.round(180.0 / np.pi * euler_xyz(tools[:, :3, :3]), 6)
    # One name for a half turn, whichever side of it rounding falls on; and no "-0".
    angles = np.where(angles == -180.0, 180.0, angles) + 0.0
    position = np.round(1000.0 * tools[:, :3, 3], 6) + 0.0
    speed = trajectory.path.speed
    feed = np.zeros(len(trajectory)) if speed is None else 1000.0 * speed
    out = StringIO()
    out.write('<pathData>\n <operation id="1">\n')
    for point, (x, abc, f) in enumerate(zip(position.tolist(), angles.tolist(), feed.tolist(), strict=True)):
        numbers = " ".join(f"{number:.6f}" for number in (*x, *abc))
        out.write(f"<m>{'lc' if point else 'jc'} {numbers} 0 {f:.3f}</m>\n")
    out.write(" </operation>\n</pathData>\n")
    return out.getvalue()


def euler_xyz(rotation: F64) -> F64:
    """Return the angles a, b, c of R = Rx(a) Ry(b) Rz(c).

    Parameters
    ----------
    rotation : ndarray, shape (N, 3, 3)
        Rotation matrices.

    Returns
    -------
    ndarray, shape (N, 3)
        Angles [rad] in (-pi, pi], b within a quarter turn. Where b is a quarter turn, a and c turn about one axis: a is
        then that of the nearest regular matrix, an earlier one first, so that it does not jump; 0 if there is none.
    """
    r = rotation.transpose(1, 2, 0)
    cosine = np.hypot(r[0, 0], r[0, 1])
    a, b, c = np.arctan2(-r[1, 2], r[2, 2]), np.arctan2(r[0, 2], cosine), np.arctan2(-r[0, 1], r[0, 0])
    regular = np.flatnonzero(cosine > 1e-9)
    for i in np.flatnonzero(cosine <= 1e-9):
        a[i] = a[regular[np.argmin(np.abs(regular - i))]] if regular.size else 0.0
        # Only c + a, or c - a where b is minus a quarter turn, counts.
        angle = np.arctan2(r[1, 0, i], r[1, 1, i]) - np.sign(b[i]) * a[i]
        c[i] = np.arctan2(np.sin(angle), np.cos(angle))
    return np.stack([a, b, c], axis=1)


def _columns(trajectory: "Trajectory") -> dict[str, F64]:
    units = ["rad" if letter == "R" else "m" for letter in trajectory.robot.joints]
    columns: dict[str, F64] = {} if trajectory.time is None else {"t_s": trajectory.time}
    columns |= {f"q{i + 1}_{unit}": trajectory.q[:, i] for i, unit in enumerate(units)}
    columns |= {
        "condition_number": trajectory.condition_number,
        "objective": trajectory.value,
        "position_error_m": trajectory.position_error,
        "axis_error_rad": trajectory.axis_error,
    }
    columns |= {f"{name}_m": trajectory.path.position[:, i] for i, name in enumerate("xyz")}
    return columns | {name: trajectory.path.axis[:, i] for i, name in enumerate("ijk")}


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


FORMATS: Final[dict[str, Callable[["Trajectory"], str]]] = {".csv": to_csv, ".json": to_json, ".pathx": to_pathx}
