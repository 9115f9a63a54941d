"""Pictures of a control loop."""

import numpy as np

from .colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY
from .style import STYLE, Axes, Figure, legend_beside, mpl
from .subject import Ticks

_STATUS_COLORS = {
    "relaxed": ORANGE,
    "limited": PURPLE,
    "returning": SKY,
    "damped": BLUE,
    "task only": GREY,
    "infeasible": BLACK,
    "not convex": GREY,
}


def tracking_figure(tracking: Ticks) -> Figure:
    """Draw the joints, the error, the objective and the distance over time.

    Parameters
    ----------
    tracking : Tracking
        What came of the loop.

    Returns
    -------
    Figure
        A panel each; those of the objective and the distance only where there are some. The strip below tells of every
        step how it ended.
    """
    has_value, has_distance = np.isfinite(tracking.value).any(), np.isfinite(tracking.distance).any()
    panels = [_joints, _errors, *([_value] if has_value else []), *([_distance] if has_distance else [])]
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 1.5 + 1.7 * len(panels)), layout="constrained")
        ratios = [1.0] * len(panels) + [0.12]
        *axes, strip = figure.subplots(len(panels) + 1, 1, sharex=True, height_ratios=ratios)
        for draw, axis in zip(panels, axes, strict=True):
            draw(axis, tracking)
        _strip(strip, tracking)
        figure.align_ylabels()
    return figure


def _joints(axes: Axes, tracking: Ticks) -> None:
    for i, column in enumerate(tracking.q.T):
        axes.plot(tracking.time, column, label=f"$q_{{{i + 1}}}$", linewidth=1.2)
    axes.set(ylabel="joints [rad or m]")
    legend_beside(axes, fontsize="small")


def _errors(axes: Axes, tracking: Ticks) -> None:
    axes.plot(tracking.time, 1e3 * tracking.position_error, color=BLUE, label="position [mm]")
    axes.plot(tracking.time, np.degrees(tracking.axis_error), color=ORANGE, label="angle [deg]")
    axes.set(ylabel="off the path")
    axes.set_ylim(bottom=0.0)
    legend_beside(axes, fontsize="small")


def _value(axes: Axes, tracking: Ticks) -> None:
    axes.plot(tracking.time, tracking.value, color=GREEN)
    axes.set(ylabel="objective")


def _distance(axes: Axes, tracking: Ticks) -> None:
    axes.plot(tracking.time, 1e3 * tracking.distance, color=BLUE)
    axes.axhline(0.0, color=BLACK, linewidth=1.0, linestyle=":")
    axes.set(ylabel="distance [mm]")


def _strip(axes: Axes, tracking: Ticks) -> None:
    status = np.array(tracking.status)
    for name in sorted(set(tracking.status)):
        color = _STATUS_COLORS.get(name, GREEN)
        axes.fill_between(
            tracking.time[:-1], 0.0, 1.0, where=status == name, step="post", color=color, label=name, linewidth=0
        )
    axes.set(xlabel="time [s]", yticks=[], ylim=(0.0, 1.0))
    legend_beside(axes, fontsize="small")
