"""Time `redundancy.redundancy_map` by the number of cells: ``python benches/python/map_scaling.py [picture]``.

Prints a Markdown table and draws docs/img/map_scaling.svg, or another picture. A cell is a spin at a point on a branch;
of a cell without a posture only the cause is found.
"""

import sys
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Final

import numpy as np
import redundancy as rd

PICTURE: Final = Path(__file__).resolve().parents[2] / "docs" / "img" / "map_scaling.svg"
POINTS: Final = (250, 500, 1000, 2000)
ANGLES: Final = (90, 180, 360)
ROUNDS: Final = 5


def seconds(points: int, angles: int) -> tuple[int, float]:
    """Return how many cells a map of the milled helix has, and the least time that it took [s]."""
    robot = rd.robots.get("fanuc_m710ic50_milling")
    path = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0, np.pi / 2, offset=np.pi, center=(1.3, 1, 0), points=points)
    objective = rd.ConditionNumber(0.4855933)
    times = []
    for _ in range(ROUNDS):
        begin = perf_counter()
        chart = rd.redundancy_map(robot, path, objective=objective, n_angles=angles, progress=False)
        times.append(perf_counter() - begin)
    return chart.value.size, min(times)


def draw(rows: list[tuple[int, int, int, float]], picture: Path) -> None:
    """Draw time over cells, both logarithmic, and the line of a constant time a cell."""
    from redundancy import plots
    from redundancy.plots.style import BLUE, GREEN, GREY, ORANGE, STYLE, Figure, mpl

    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.0, 3.2), layout="constrained")
        axes = figure.subplots()
        ends = 1e-6 * np.array([min(row[2] for row in rows), max(row[2] for row in rows)])
        each = float(np.median([time / cells for _, _, cells, time in rows]))
        axes.plot(ends, 1e6 * each * ends, color=GREY, linewidth=1.0, label=f"slope 1: {1e9 * each:.0f} ns a cell")
        for angles, color, marker in zip(ANGLES, (BLUE, ORANGE, GREEN), "osD", strict=True):
            own = [(1e-6 * cells, time) for _, a, cells, time in rows if a == angles]
            # Hollow: different maps with as many cells lie on each other.
            axes.plot(*zip(*own, strict=True), marker, color=color, fillstyle="none", label=f"{angles} spins")
        axes.set(xscale="log", yscale="log", xlabel="million cells (points, spins, 8 branches)", ylabel="time [s]")
        axes.set_xticks([0.2, 0.5, 1.0, 2.0, 5.0], labels=["0.2", "0.5", "1", "2", "5"])
        axes.set_yticks([0.02, 0.05, 0.1, 0.2, 0.5, 1.0], labels=["0.02", "0.05", "0.1", "0.2", "0.5", "1"])
        axes.minorticks_off()
        axes.legend()
    plots.save(figure, picture)


def main(arguments: list[str]) -> int:
    """Print the table and draw the picture."""
    if rd.build_profile != "release":
        sys.stderr.write(f"a {rd.build_profile} build is not worth timing\n")
        return 1
    rows = [(points, angles, *seconds(points, angles)) for points, angles in product(POINTS, ANGLES)]
    lines = ["| points | spins | cells | time [s] | million cells/s |", "|--:|--:|--:|--:|--:|"]
    lines += [f"| {p} | {a} | {cells} | {time:.3f} | {1e-6 * cells / time:.1f} |" for p, a, cells, time in rows]
    sys.stdout.write("\n".join(lines) + "\n")
    draw(rows, Path(arguments[0]) if arguments else PICTURE)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
