"""Pictures of a redundancy map: the value of an objective over path and spin."""

from collections.abc import Sequence
from itertools import cycle
from typing import Any, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._util import F64
from ..errors import InvalidValueError
from .colours import BLACK, LINE_COLORS, WHITE
from .map_data import (
    BY_BADNESS,
    CAUSE_COLORS,
    CAUSES,
    U8,
    Int,
    MapData,
    MapLine,
    Polyline,
    edges_of,
    is_log,
    log_ticks,
)
from .map_data import prepared as prepared_map
from .style import STYLE, Axes, Figure, mpl

Bool: TypeAlias = NDArray[np.bool_]

# Bright is good; the dark end stays off the black of a singularity.
_COLORMAP: Final = "viridis_r"


def redundancy_map_figure(
    value: ArrayLike,
    cause: ArrayLike,
    angles: ArrayLike,
    distance: ArrayLike | None = None,
    *,
    lines: Sequence[MapLine] = (),
    branch: int | None = None,
    panels: Literal["best", "branches"] = "best",
    name: str = r"condition number $\kappa_F$",
    title: str = "",
    distance_label: str | None = None,
    angle_name: str = "spin",
) -> Figure:
    """Draw a redundancy map: what every spin at every point of a path is worth, and why some are not possible.

    Parameters
    ----------
    value : array_like, shape (N, A, B)
        Objective over points, angles and branches, the less the better; NaN or infinite where infeasible.
    cause : array_like of int, shape (N, A, B)
        Why a cell is not feasible: 0 feasible, 1 unreachable, 2 joint limit, 3 singular, 4 predicate. A cell that is
        said to be feasible without a finite value is singular.
    angles : array_like, shape (A,)
        Spin [rad], different angles of one turn.
    distance : array_like, shape (N,), optional
        Distance along the path [m], not descending; the numbers of the points if not given.
    lines : sequence of MapLine
        Spins along the path to draw over the map. Over a single branch a line is solid where it is on that branch,
        dotted elsewhere; it breaks, with a dot at either side, where it changes its branch.
    branch : int, optional
        The branch to draw; the best at every cell if not given.
    panels : {"best", "branches"}
        One panel, or one for every branch.
    name : str
        What the value is.
    title : str
        Title of the picture.
    distance_label : str, optional
        What the distance is, if not metres along the path.
    angle_name : str
        What the angles are: the spin of the tool, or a joint that is held.

    Returns
    -------
    Figure
        Value by colour, infeasible cells in the colour of the cause. Where branches are infeasible for different
        causes it is the cause of the one that came closest: predicate, then joint limit, singular, unreachable.

    Raises
    ------
    ShapeError
        If the arrays do not fit together.
    InvalidValueError
        If a cause or a branch is unknown, an angle comes twice, or the path goes back.
    NonFiniteError
        If an angle or a distance is not finite.
    """
    data = prepared_map(value, cause, angles, distance, lines, distance_label, angle_name)
    if panels not in ("best", "branches"):
        raise InvalidValueError(f"panels: got {panels!r}, expected 'best' or 'branches'")
    if branch is not None and not 0 <= branch < data.branches:
        raise InvalidValueError(f"branch: got {branch}, expected 0 to {data.branches - 1}")
    if branch is not None and panels == "branches":
        raise InvalidValueError("branch: a picture of every branch has no single one")
    with mpl.rc_context(STYLE):
        if panels == "branches":
            figure = _draw_branches(data, name)
        else:
            figure = Figure(figsize=(7.5, 4.0), layout="constrained")
            axes = figure.subplots()
            _draw_map(axes, data, branch)
            axes.set(xlabel=data.x_label, ylabel=f"{data.angle_name} [deg]", yticks=np.arange(-180, 181, 60))
            _write_scale(figure, [axes], data, [branch], name)
        heading = title or ("" if branch is None else f"branch {branch}")
        if heading:
            figure.suptitle(heading, fontsize="large")
    return figure


def _draw_branches(data: MapData, name: str) -> Figure:
    columns = min(2, data.branches)
    rows = -(-data.branches // columns)
    figure = Figure(figsize=(8.0, 1.7 * rows + 1.1), layout="constrained")
    grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    panels = list(grid[: data.branches])
    for i, panel in enumerate(panels):
        _draw_map(panel, data, i)
        panel.set_title(f"branch {i}", loc="left", fontsize="medium", pad=3.0)
        panel.set(yticks=np.arange(-180, 181, 90))
        if i >= data.branches - columns:
            panel.tick_params(labelbottom=True)
            panel.set_xlabel(data.x_label)
    for panel in grid[data.branches :]:
        panel.set_visible(False)
    figure.supylabel(f"{data.angle_name} [deg]", fontsize="medium")
    _write_scale(figure, panels, data, list(range(data.branches)), name)
    return figure


def _draw_map(axes: Axes, data: MapData, branch: int | None) -> None:
    value, cause = data.layer(branch)
    rows, y = _whole_turn(data.degrees)
    x = edges_of(data.x)
    low, high = data.limits() or (0.0, 1.0)
    # Images, not a polygon a cell, whatever the format of the file.
    norm = "log" if is_log((low, high)) else "linear"
    shown = np.ma.masked_invalid(value.T[rows])
    axes.pcolorfast(x, y, shown, cmap=_COLORMAP, norm=norm, vmin=low, vmax=high)
    colors = [(0, 0, 0, 0), *((*bytes.fromhex(color[1:]), 255) for color in CAUSE_COLORS[1:])]
    axes.pcolorfast(x, y, np.array(colors, dtype=np.uint8)[cause.T[rows]])
    if branch is None:
        best = np.where(cause == 0, data.pick, -1).T[rows]
        across, up = _outlines(best, x, y)
        axes.plot(across, up, color=WHITE, linewidth=1.4, alpha=0.6)
        axes.plot(across, up, color=BLACK, linewidth=0.6)
        # One branch alone has no borders, and a legend without them would leave its number a riddle.
        if len(np.unique(best[best >= 0])) > 1:
            _number_regions(axes, best, x, y)
    for line, color in zip(data.lines, cycle(LINE_COLORS)):
        _draw_line(axes, line, color, branch)
    axes.grid(False)
    axes.spines[:].set_visible(True)
    axes.set(xlim=(x[0], x[-1]), ylim=(-180.0, 180.0))
    whole = bool((data.x == np.round(data.x)).all())
    axes.xaxis.set_major_locator(mpl.ticker.MaxNLocator("auto", integer=whole, steps=[1, 2, 2.5, 5, 10]))


def _whole_turn(degrees: F64) -> tuple[Int, F64]:
    """Return rows of the angles, and their borders, which fill -180 to 180 deg: the turn goes on at its ends."""
    around = np.concatenate([degrees[-1:] - 360.0, degrees, degrees[:1] + 360.0])
    borders = np.clip(0.5 * (around[1:] + around[:-1]), -180.0, 180.0)
    borders = np.concatenate([[-180.0], borders, [180.0]])
    rows = np.concatenate([[len(degrees) - 1], np.arange(len(degrees)), [0]])
    seen = np.diff(borders) > 1e-6
    return rows[seen], np.append(borders[:-1][seen], 180.0)


def _outlines(best: Int, x: F64, y: F64) -> tuple[F64, F64]:
    """Return the borders between feasible cells of different branches as one line with breaks (NaN)."""
    both = (best[:, 1:] >= 0) & (best[:, :-1] >= 0)
    column, low, high = _runs(((best[:, 1:] != best[:, :-1]) & both).T)
    both = (best[1:] >= 0) & (best[:-1] >= 0)
    row, left, right = _runs((best[1:] != best[:-1]) & both)
    xs = np.concatenate([np.stack([x[column + 1]] * 2, axis=1), np.stack([x[left], x[right]], axis=1)])
    ys = np.concatenate([np.stack([y[low], y[high]], axis=1), np.stack([y[row + 1]] * 2, axis=1)])
    gap = np.full((len(xs), 1), np.nan)
    return np.hstack([xs, gap]).ravel(), np.hstack([ys, gap]).ravel()


def _runs(marked: Bool) -> tuple[Int, Int, Int]:
    """Return row, start and end of every run of marked cells in a row."""
    step = np.diff(marked.astype(np.int8), axis=1, prepend=0, append=0)
    row, start = np.nonzero(step == 1)
    return row, start, np.nonzero(step == -1)[1]


def _number_regions(axes: Axes, best: Int, x: F64, y: F64) -> None:
    """Write the number of the best branch into every region that has the room for it."""
    # On a coarse grid with cells about as wide as high on paper.
    width, height = 90, 48
    columns = np.searchsorted(x, np.linspace(x[0], x[-1], 2 * width + 1)[1::2]) - 1
    rows = np.searchsorted(y, np.linspace(y[0], y[-1], 2 * height + 1)[1::2]) - 1
    coarse = best[np.ix_(rows, columns)]
    for branch in np.unique(coarse[coarse >= 0]):
        left = coarse == branch
        depth = _depth(left)
        while depth.max() >= 3:
            row, column = np.unravel_index(depth.argmax(), depth.shape)
            at = (x[0] + (column + 0.5) / width * (x[-1] - x[0]), y[0] + (row + 0.5) / height * (y[-1] - y[0]))
            box = {"boxstyle": "circle,pad=0.25", "facecolor": WHITE, "edgecolor": "none", "alpha": 0.75}
            axes.text(*at, str(branch), ha="center", va="center", fontsize="small", bbox=box)
            region = np.zeros_like(left)
            region[row, column] = True
            while (grown := _neighbours(region).any(axis=0) & left).sum() > region.sum():
                region = grown
            left &= ~region
            depth[region] = 0


def _neighbours(cells: Bool) -> Bool:
    """Return cells and their four neighbours, False beyond the border; shape (5, rows, columns)."""
    padded = np.pad(cells, 1)
    return np.stack([cells, padded[2:, 1:-1], padded[:-2, 1:-1], padded[1:-1, 2:], padded[1:-1, :-2]])


def _depth(cells: Bool) -> Int:
    """Return how many steps it is from a cell to the border of its region."""
    depth = np.zeros(cells.shape, dtype=np.intp)
    while cells.any():
        depth += cells
        cells = np.asarray(_neighbours(cells).all(axis=0))
    return depth


def _draw_line(axes: Axes, line: Polyline, color: str, branch: int | None) -> None:
    x, y = line.x, line.y
    marker: dict[str, Any] = {"marker": "o", "markersize": 5.0} if len(x) == 1 else {}
    if branch is not None:
        for ink, width in ((BLACK, 2.2), (color, 1.0)):
            axes.plot(x, y, linestyle=(0, (1.0, 1.5)), color=ink, linewidth=width, **marker)
        y = np.where(line.branch == branch, y, np.nan)
    axes.plot(x, y, color=BLACK, linewidth=3.2, solid_capstyle="butt")
    axes.plot(x, y, color=color, linewidth=1.6, markeredgecolor=BLACK, **marker)
    axes.plot(x[line.changes], y[line.changes], "o", color=color, markeredgecolor=BLACK, markersize=5.0)


def _write_scale(figure: Figure, panels: list[Axes], data: MapData, shown: Sequence[int | None], name: str) -> None:
    """Write what colours and lines mean."""
    layers = [data.layer(branch) for branch in shown]
    limits = data.limits()
    if limits is not None:
        finite = np.concatenate([value[cause == 0] for value, cause in layers])
        beyond = (bool((finite < limits[0]).any()), bool((finite > limits[1]).any()))
        extend = {(True, True): "both", (True, False): "min", (False, True): "max"}.get(beyond, "neither")
        bar = figure.colorbar(panels[0].images[0], ax=panels, label=name, extend=extend, pad=0.01, aspect=30)
        bar.minorticks_off()
        if is_log(limits):
            ticks = log_ticks(limits)
            bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    _write_legend(figure, panels[0], data, layers, None in shown)


def _write_legend(figure: Figure, axes: Axes, data: MapData, layers: list[tuple[F64, U8]], best: bool) -> None:
    entries: list[tuple[Any, str]] = []
    present = {int(code) for _, cause in layers for code in np.unique(cause)}
    for code in BY_BADNESS[1:]:
        if code in present:
            square = axes.plot([], [], "s", color=CAUSE_COLORS[code], markersize=9.0)
            entries.append((square[0], CAUSES[code]))
    if best and len(np.unique(data.pick[layers[0][1] == 0])) > 1:
        entries.append((axes.plot([], [], color=BLACK, linewidth=0.6)[0], "borders of the best branch, numbered"))
    for line, color in zip(data.lines, cycle(LINE_COLORS)):
        border = axes.plot([], [], color=BLACK, linewidth=3.2, solid_capstyle="butt")[0]
        entries.append(((border, axes.plot([], [], color=color, linewidth=1.6)[0]), line.label))
    if any(line.changes.size for line in data.lines):
        dot = axes.plot([], [], "o", color=LINE_COLORS[0], markeredgecolor=BLACK, markersize=5.0)
        entries.append((dot[0], "change of branch"))
    if entries:
        handles, labels = zip(*entries, strict=True)
        columns = len(entries) if len(entries) <= 5 else -(-len(entries) // 2)
        figure.legend(handles, labels, loc="outside lower center", ncols=columns, handlelength=1.5, columnspacing=1.5)
