"""Pictures of weights that tune themselves."""

from collections.abc import Sequence

import numpy as np

from .._util import F64
from .colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE
from .style import STYLE, Axes, Figure, legend_beside, log_if_long, marker, mpl

_COLORS = (BLUE, ORANGE, GREEN)


def search_history(
    joints: Sequence[int], w: F64, k: F64, limit_distance: F64, singularity: F64, accepted: Sequence[bool]
) -> Figure:
    """Draw how weights and performance changed from run to run.

    Parameters
    ----------
    joints : sequence of int
        Joints whose weights were tuned, counted from 0.
    w, k : ndarray, shape (R, n)
        Weights of joint limits and of singularity in R runs.
    limit_distance, singularity : ndarray, shape (R,)
        Greatest distance beyond a limit (share of the range) and worst singularity parameter of each run.
    accepted : sequence of bool
        Whether each run was the best so far.

    Returns
    -------
    Figure
        Three panels: the weights that were tuned, limit distance, singularity parameter; dots are runs that were tried,
        lines the best so far.
    """
    runs = np.arange(len(accepted), dtype=np.float64)
    best = _latest_accepted(accepted)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 6.5), layout="constrained")
        weights, limits, singular = figure.subplots(3, 1, sharex=True)
        for joint, color in zip(joints, _COLORS, strict=False):
            # Both are often equal, so that the dashes of one lie on the pale line of the other.
            looks = (("w", w, {"linewidth": 3.5, "alpha": 0.4}), ("k", k, {"linestyle": "--"}))
            for name, values, look in looks:
                label = f"${name}_{{{joint + 1}}}$"
                weights.step(runs, values[best, joint], where="post", color=color, label=label, **look)
        weights.set(ylabel="weight of the best so far")
        weights.set_ylim(bottom=0.0)
        legend_beside(weights)
        _runs(limits, runs, 100.0 * np.where(np.isfinite(limit_distance), limit_distance, np.nan), best)
        limits.axhline(0.0, color=BLACK, linewidth=1.0, linestyle=":")
        limits.set(ylabel="greatest distance\nbeyond a limit [% of range]")
        _runs(singular, runs, np.where(np.isfinite(singularity), singularity, np.nan), best)
        log_if_long(singular, singularity)
        singular.set(xlabel="run", ylabel=r"worst singularity parameter $w_{ps}$")
        singular.xaxis.set_major_locator(mpl.ticker.MaxNLocator("auto", integer=True))
        legend_beside(limits)
        figure.align_ylabels()
    return figure


def weights_along_path(time: F64 | None, w: F64, k: F64, c_joint: F64, c_sing: F64) -> Figure:
    """Draw the weights of the last three joints and the damping scalars along a path.

    Parameters
    ----------
    time : ndarray, shape (N,), optional
        Times of the points [s].
    w, k : ndarray, shape (N, n)
        Weights of joint limits and of singularity.
    c_joint, c_sing : ndarray, shape (N,)
        Damping scalars.

    Returns
    -------
    Figure
        Three panels: weights w, weights k, damping scalars.
    """
    points, n = w.shape
    x = np.arange(points, dtype=np.float64) if time is None else time
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 6.5), layout="constrained")
        panels = figure.subplots(3, 1, sharex=True)
        for panel, weights, name in ((panels[0], w, "w"), (panels[1], k, "k")):
            for joint, color in zip(range(n - 3, n), _COLORS, strict=True):
                _line(panel, x, weights[:, joint], color, f"joint {joint + 1}")
            panel.set(ylabel=f"weight ${name}$")
            log_if_long(panel, weights[:, n - 3 :])
        _line(panels[2], x, c_joint, PURPLE, r"$c_\mathrm{joint}$")
        _line(panels[2], x, c_sing, BLACK, r"$c_\mathrm{sing}$")
        panels[2].set(xlabel="point of the path" if time is None else "time [s]", ylabel="damping scalar")
        for panel in (panels[0], panels[2]):
            legend_beside(panel)
        if len(x) > 1:
            panels[2].set_xlim(x[0], x[-1])
        figure.align_ylabels()
    return figure


def _latest_accepted(accepted: Sequence[bool]) -> list[int]:
    best: list[int] = []
    for run, taken in enumerate(accepted):
        best.append(run if taken else best[-1])
    return best


def _runs(axes: Axes, runs: F64, values: F64, best: list[int]) -> None:
    axes.plot(runs, values, ".", color=GREY, markersize=4.0, label="tried")
    axes.step(runs, values[best], where="post", color=BLUE, label="best so far")


def _line(axes: Axes, x: F64, y: F64, color: str, label: str) -> None:
    axes.plot(x, y, marker=marker(x), color=color, label=label)
