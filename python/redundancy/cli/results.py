"""What ``redundancy solve`` tells and leaves behind, and what the other commands have in common with it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from rich.table import Table

from .. import plots
from .._util import Joints, progress_bar
from ..files import whole_files
from ..paths import Trajectory
from .job import Frame

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def results_table(optimised: Trajectory, fixed: Trajectory | None, seconds: Sequence[float]) -> Table:
    """Sum up a trajectory beside the one of fixed spin.

    Parameters
    ----------
    optimised : Trajectory
        With the spin that was chosen.
    fixed : Trajectory or None
        The same path without spin, where the task has one.
    seconds : sequence of float
        What solving took [s]: optimised, then fixed.

    Returns
    -------
    Table
        One column each, in deg, mm and ms.
    """
    table = Table(title=f"{optimised.robot.name}, {optimised.path.length:.3f} m of path", title_justify="left")
    table.add_column()
    trajectories = [optimised] if fixed is None else [fixed, optimised]
    for header in ("optimised",) if fixed is None else ("fixed spin", "optimised spin"):
        table.add_column(header, justify="right")
    for label, describe in ROWS.items():
        table.add_row(label, *(describe(trajectory) for trajectory in trajectories))
    times = list(seconds[:1]) if fixed is None else list(seconds[1::-1])
    table.add_row("solved in", *(f"{1000.0 * time:.1f} ms" for time in times))
    return table


def _reached(trajectory: Trajectory) -> str:
    return f"{len(trajectory) - len(trajectory.unreachable)} of {len(trajectory)}"


def _margin(trajectory: Trajectory) -> str:
    margins = trajectory.margins
    least = trajectory.limit_margin
    if not np.isfinite(least):
        return "no limits"
    if least < margins.min():
        return f"{np.rad2deg(least):.2f} deg, a combination of joints"
    joint = int(np.argmin(margins.min(axis=0)))
    margin = margins[:, joint].min()
    if trajectory.robot.joints[joint] == "P":
        return f"{1000.0 * margin:.2f} mm, {trajectory.robot.joint_label(joint)}"
    return f"{np.rad2deg(margin):.2f} deg, {trajectory.robot.joint_label(joint)}"


def _speed(trajectory: Trajectory) -> str:
    if trajectory.joint_speed is None:
        return "no times"
    speed = np.abs(trajectory.joint_speed).max(axis=0)
    limited = np.isfinite(trajectory.robot.qd_max).any()
    joint = int(np.argmax(speed / trajectory.robot.qd_max if limited else speed))
    unit = "m/s" if trajectory.robot.joints[joint] == "P" else "rad/s"
    share = f"{100.0 * speed[joint] / trajectory.robot.qd_max[joint]:.1f} % of its limit\n" if limited else ""
    return f"{share}{speed[joint]:.3f} {unit}, {trajectory.robot.joint_label(joint)}"


def _step(trajectory: Trajectory) -> str:
    return trajectory.largest_step_told.replace(", from", "\nfrom").replace("; ", "\n")


ROWS: Final[dict[str, Callable[[Trajectory], str]]] = {
    "points reached": _reached,
    "max condition number": lambda t: f"{t.max_condition_number:.5f}",
    "mean condition number": lambda t: f"{t.mean_condition_number:.5f}",
    "limit margin": _margin,
    "largest joint speed": _speed,
    "largest step": _step,
    "max position error": lambda t: f"{1000.0 * t.position_error.max():.1e} mm",
    "max axis error": lambda t: f"{np.rad2deg(t.axis_error.max()):.1e} deg",
}


def write_results(
    folder: Path,
    optimised: Trajectory,
    fixed: Trajectory | None,
    frame: Frame,
    pictures: bool,
    joints: Joints = "robot",
) -> list[str]:
    """Write the trajectory in every format, and its pictures.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    optimised : Trajectory
        What is written.
    fixed : Trajectory or None
        Drawn beside it.
    frame : {"tool", "flange"}
        Whose poses the files of poses hold.
    pictures : bool
        Whether to draw.
    joints : {"robot", "controller"}
        Whose joints columns and pictures have.

    Returns
    -------
    list of str
        Names of the files.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    ImportError
        If there is no matplotlib to draw with.
    """
    with whole_files(folder) as (temporary, names):
        write_formats(temporary, optimised, frame, joints)
        if pictures:
            _draw(temporary, optimised, fixed, joints)
    return names


def write_formats(folder: Path, trajectory: Trajectory, frame: Frame, joints: Joints = "robot") -> None:
    """Write a trajectory in every format, poses as those of a frame, joints as the robot or its controller has them."""
    for ending in ("csv", "json"):
        trajectory.write(folder / f"trajectory.{ending}", joints=joints)
    trajectory.write(folder / "trajectory.pathx", frame)


def save_figures(folder: Path, figures: dict[str, "Figure"]) -> None:
    """Save pictures by their names, each as ``.png`` and ``.svg``."""
    with progress_bar(len(figures), "drawing") as advance:
        for name, figure in figures.items():
            plots.save(figure, folder / f"{name}.png", folder / f"{name}.svg")
            advance(1)


def _draw(folder: Path, optimised: Trajectory, fixed: Trajectory | None, joints: Joints) -> None:
    figures = {
        "condition": plots.condition_along_path(optimised, fixed),
        "joints": plots.joints_against_limits(optimised, joints),
    }
    if fixed is not None:
        figures["spin"] = plots.spin_along_path(optimised)
    save_figures(folder, figures)
