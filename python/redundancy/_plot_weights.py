"""Pictures of weights that tune themselves."""

from pathlib import Path

import numpy as np

from ._arrays import F64
from ._plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, STYLE, Axes, Figure, mpl, save
from .weights.dynamic_adaptation import DynamicAdaptation
from .weights.self_adaptation import WeightSearch

_COLORS = (BLUE, ORANGE, GREEN)


def search_history(search: WeightSearch) -> Figure:
    """Draw how weights and performance changed from run to run.

    Parameters
    ----------
    search : WeightSearch
        What `self_adapt` returned.

    Returns
    -------
    Figure
        Three panels: the weights that were tuned, limit distance, singularity parameter; dots are runs that were tried,
        lines the best so far.
    """
    history = search.history
    runs = np.arange(len(history), dtype=np.float64)
    best = _latest_accepted([record.accepted for record in history])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 6.5), layout="constrained")
        weights, limits, singularity = figure.subplots(3, 1, sharex=True)
        for joint, color in zip(search.sensitivity.joints, _COLORS, strict=False):
            # Both are often equal, so that the dashes of one lie on the pale line of the other.
            for name, look in (("w", {"linewidth": 3.5, "alpha": 0.4}), ("k", {"linestyle": "--"})):
                values = np.array([getattr(record, name)[joint] for record in history])
                label = f"${name}_{{{joint + 1}}}$"
                weights.step(runs, values[best], where="post", color=color, label=label, **look)
        weights.set(ylabel="weight of the best so far")
        weights.set_ylim(bottom=0.0)
        weights.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        beyond = np.array([record.performance.limit_distance for record in history])
        _runs(limits, runs, 100.0 * np.where(np.isfinite(beyond), beyond, np.nan), best)
        limits.axhline(0.0, color=BLACK, linewidth=1.0, linestyle=":")
        limits.set(ylabel="greatest distance\nbeyond a limit [% of range]")
        worst = np.array([record.performance.singularity for record in history])
        _runs(singularity, runs, np.where(np.isfinite(worst), worst, np.nan), best)
        _log_if_long(singularity, worst)
        singularity.set(xlabel="run", ylabel=r"worst singularity parameter $w_{ps}$")
        singularity.xaxis.set_major_locator(mpl.ticker.MaxNLocator("auto", integer=True))
        limits.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        figure.align_ylabels()
    return figure


def weights_along_path(adaptation: DynamicAdaptation) -> Figure:
    """Draw the weights of the last three joints and the damping scalars along a path.

    Parameters
    ----------
    adaptation : DynamicAdaptation
        What `dynamic_adapt` returned.

    Returns
    -------
    Figure
        Three panels: weights w, weights k, damping scalars.
    """
    trajectory = adaptation.trajectory
    x = np.arange(len(trajectory), dtype=np.float64) if trajectory.time is None else trajectory.time
    n = trajectory.robot.n
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 6.5), layout="constrained")
        panels = figure.subplots(3, 1, sharex=True)
        for panel, weights, name in ((panels[0], adaptation.w, "w"), (panels[1], adaptation.k, "k")):
            for joint, color in zip(range(n - 3, n), _COLORS, strict=True):
                _line(panel, x, weights[:, joint], color, f"joint {joint + 1}")
            panel.set(ylabel=f"weight ${name}$")
            _log_if_long(panel, weights[:, n - 3 :])
        _line(panels[2], x, adaptation.c_joint, PURPLE, r"$c_\mathrm{joint}$")
        _line(panels[2], x, adaptation.c_sing, BLACK, r"$c_\mathrm{sing}$")
        panels[2].set(xlabel="point of the path" if trajectory.time is None else "time [s]", ylabel="damping scalar")
        for panel in (panels[0], panels[2]):
            panel.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        if len(x) > 1:
            panels[2].set_xlim(x[0], x[-1])
        figure.align_ylabels()
    return figure


def write(figure: Figure, path: str | Path | None) -> Figure:
    """Save a picture, if there is a file to save it to, and return it."""
    if path is not None:
        save(figure, path)
    return figure


def _latest_accepted(accepted: list[bool]) -> list[int]:
    best: list[int] = []
    for run, taken in enumerate(accepted):
        best.append(run if taken else best[-1])
    return best


def _runs(axes: Axes, runs: F64, values: F64, best: list[int]) -> None:
    axes.plot(runs, values, ".", color=GREY, markersize=4.0, label="tried")
    axes.step(runs, values[best], where="post", color=BLUE, label="best so far")


def _line(axes: Axes, x: F64, y: F64, color: str, label: str) -> None:
    axes.plot(x, y, marker="o" if len(x) == 1 else "", color=color, label=label)


def _log_if_long(axes: Axes, values: F64) -> None:
    """Take a logarithmic scale where the values span more than a decade and none is 0."""
    finite = values[np.isfinite(values)]
    if finite.size and finite.max() > 10.0 * finite.min() > 0.0:
        axes.set_yscale("log")
