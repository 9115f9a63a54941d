"""What ``redundancy plan`` and ``redundancy map`` tell and leave behind."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

from .. import plots
from .._util import F64
from ..files import whole_files
from ..planning import Plan, RedundancyMap, core_path, plan_by, redundancy_map
from ..plots import BY_BADNESS, CAUSES, MapData, MapLine, prepared
from .job import Job
from .results import ROWS, save_figures, write_formats

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..paths import Trajectory


def plan_job(job: Job, criterion: str | None, warm_start: "Trajectory | None") -> Plan:
    """Plan what a job file asks for, by another criterion if one is given."""
    settings = job.plan.settings if criterion is None else job.plan.settings.with_criterion(criterion)
    return plan_by(settings, job.robot, job.path, job.task, job.objective, warm_start=warm_start)


def map_job(job: Job, angles: int) -> RedundancyMap:
    """Map what a job file asks for, over a whole turn."""
    asked = job.plan.settings
    return redundancy_map(
        job.robot,
        job.path,
        job.task,
        job.objective,
        angles,
        spare=asked.spare,
        n_spare=asked.n_spare,
        limits=asked.limits,
    )


def plan_table(planned: Plan, objective: str, seconds: float) -> Table:
    """Sum up a plan.

    Parameters
    ----------
    planned : Plan
        The plan.
    objective : str
        What was minimised, in words.
    seconds : float
        What planning took [s].

    Returns
    -------
    Table
        In deg, mm and ms.
    """
    title = f"{planned.robot.name}, {planned.path.length:.3f} m of path"
    table = Table(title=title, title_justify="left")
    table.add_column()
    table.add_column(planned.criterion, justify="right")
    # Points that are not reached hold postures of others: what those are worth says nothing.
    labels = ["points reached"] if planned.unreachable else list(ROWS)
    rows = {label: ROWS[label](planned) for label in labels}
    table.add_row(labels[0], rows.pop(labels[0]))
    for label, text in (_values(planned, objective) | rows).items():
        table.add_row(label, text)
    table.add_row("planned in", f"{1000.0 * seconds:.1f} ms")
    if planned.notes:
        table.caption, table.caption_justify = "\n".join(planned.notes), "left"
    return table


def _values(planned: Plan, objective: str) -> dict[str, str]:
    """Return what was minimised; how good that is where the plan is whole."""
    rows: dict[str, str] = {}
    reached = ~np.isnan(planned.value)
    if planned.criterion == "speed" and planned.failure is None:
        rows["tool speed"] = f"{1000.0 * planned.speed:.1f} mm/s"
    if planned.tilt is not None and planned.failure is None:
        tilt = np.rad2deg(planned.tilt)
        rows["tilt"] = f"{tilt.max():.2f} deg at most, {tilt.mean():.2f} deg in the mean"
    if planned.objective is not None and reached.any():
        weights = core_path(planned.path).weights[reached]
        rows[f"worst {objective}"] = f"{planned.value[reached].max():.5f}"
        rows[f"mean {objective}"] = f"{_mean(planned.value[reached], weights):.5f}"
    if planned.transfers:
        rows["segments"] = f"{len(planned.segments)}\n{planned.reconfigurations}"
    if planned.failure is not None:
        return rows
    if not np.isnan(planned.bound):
        rows["lower bound" if planned.robot.n == 6 else "lower bound on the grid"] = f"{planned.bound:.5f}"
        rows["gap"] = f"{planned.gap:.1e}"
    units = {"R": "rad^2", "P": "m^2"}
    rows["motion"] = f"{planned.motion:.5f} {' + '.join(units[kind] for kind in units if kind in planned.robot.joints)}"
    compared = f", best of {len(planned.ways)} ways" if len(planned.ways) > 1 and np.isnan(planned.bound) else ""
    rows["optimum"] = ("reached" if planned.refined else "best route of the grid") + compared
    return rows


def _mean(values: F64, weights: F64) -> float:
    """Return the weighted mean; infinite where a value is, whatever its weight."""
    return float(np.average(values, weights=weights)) if np.isfinite(values).all() else float(values.max())


def write_plan(folder: Path, planned: Plan, chart: RedundancyMap | None, job: Job, pictures: bool) -> list[str]:
    """Write a plan in every format, and its pictures.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    planned : Plan
        What is written.
    chart : RedundancyMap or None
        Drawn, with the spin of the plan, if there is one.
    job : Job
        What was asked for.
    pictures : bool
        Whether to draw.

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
        write_formats(temporary, planned, job.frame, job.joints)
        if planned.transfers:
            (temporary / "transfers.json").write_text(_transfers(planned))
        if pictures:
            figures = {
                "condition": plots.condition_along_path(planned),
                "joints": plots.joints_against_limits(planned, job.joints),
            }
            if chart is not None:
                figures["spin"] = plots.spin_along_path(planned)
                figures["map"] = _figure(chart, job.objective_name, chart.lines_of(planned))
            save_figures(temporary, figures)
    return names


def _transfers(planned: Plan) -> str:
    """Return the ways from segment to segment: points, lift-off [m], postures [rad or m] and least times [s]."""
    ways = [
        {"points": way.points, "lift_m": way.lift, "q": way.q.tolist(), "time_s": way.time.tolist()}
        for way in planned.transfers
    ]
    return json.dumps(ways, indent=1) + "\n"


def map_table(chart: RedundancyMap, objective: str) -> Table:
    """Sum up a redundancy map.

    Parameters
    ----------
    chart : RedundancyMap
        The map.
    objective : str
        What its values are, in words.

    Returns
    -------
    Table
        Shares of the causes, and the points where the best value is least and largest.
    """
    data = _prepared(chart)
    best, cause = data.layer(None)
    table = Table(title=f"{chart.robot.name}, {chart.path.length:.3f} m of path", title_justify="left")
    table.add_column()
    table.add_column("best branch", justify="right")
    table.add_column("all branches", justify="right")
    if chart.spare:
        joints = ", ".join(str(joint + 1) for joint in chart.spare)
        table.add_row("spare joints", joints, f"{len(chart.spare_values)} places")
    table.add_row("cells", str(cause.size), str(chart.cause.size))
    for code in BY_BADNESS:
        if (chart.cause == code).any() or code == 0:
            table.add_row(CAUSES[code], *(f"{100.0 * np.mean(cells == code):.2f} %" for cells in (cause, chart.cause)))
    least = np.where(np.isnan(best), np.inf, best).min(axis=1)
    open_points = np.flatnonzero(np.isfinite(least))
    table.add_section()
    table.add_row("points with a posture", f"{len(open_points)} of {len(least)}")
    if len(open_points) < len(least):
        table.add_row("first point without", str(int(np.argmax(~np.isfinite(least)))))
    if len(open_points):
        for label, choose in (("best", np.argmin), ("worst", np.argmax)):
            point = int(open_points[choose(least[open_points])])
            # What rounding left beside 0 is no "-0".
            spin = round(float(data.degrees[int(np.nanargmin(best[point]))]), 1) + 0.0
            place = f", {chart.angle_name} {spin} deg" if chart.has_angles else ""
            table.add_row(f"{label} point", f"{least[point]:.5f}\npoint {point}{place}")
        what = f"the best {chart.angle_name} of the point" if chart.has_angles else "the best posture of the point"
        table.caption, table.caption_justify = f"value: {objective}, at {what}", "left"
    return table


def write_map(folder: Path, chart: RedundancyMap, objective: str, pictures: bool, page: bool) -> list[str]:
    """Write a redundancy map as arrays, as pictures and as a page.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    chart : RedundancyMap
        The map.
    objective : str
        What its values are, in words.
    pictures, page : bool
        Whether to draw and whether to write the page.

    Returns
    -------
    list of str
        Names of the files.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    ImportError
        If there is no matplotlib or no plotly.
    """
    with whole_files(folder) as (temporary, names):
        np.savez_compressed(
            temporary / "map.npz",
            value=chart.value,
            cause=chart.cause,
            angles=chart.angles,
            causes=np.array(CAUSES),
            spare=np.array(chart.spare, dtype=np.int64) + 1,
            spare_values=chart.spare_values,
        )
        if pictures:
            save_figures(temporary, {"map": _figure(chart, objective)})
        if page:
            chart.write_html(temporary / "map.html", name=objective)
    return names


def _prepared(chart: RedundancyMap) -> MapData:
    return prepared(*chart.planes(), None, (), None)


def _figure(chart: RedundancyMap, objective: str, lines: Sequence[MapLine] = ()) -> "Figure":
    title, angle = chart.robot.name, chart.angle_name
    return plots.redundancy_map_figure(*chart.planes(), lines=lines, name=objective, title=title, angle_name=angle)
