"""The pictures of the documentation: ``python -m evidence.figures [folder]``; the folder is docs/img if left out."""

import sys
from pathlib import Path

import numpy as np
import redundancy as rd
from redundancy import plots
from redundancy.cli import read_job
from redundancy.loops import follow_without_spin
from redundancy.plots.style import BLUE, ORANGE, STYLE, Figure, legend_beside, mpl

from evidence import pages
from evidence.leger.convergence import METHODS, history
from evidence.leger.second_path import runs

SCANNED = 84
"""The 85th point of the helix, counted from 0."""


def helix(folder: Path) -> None:
    """Draw the milled helix: condition number, joints, spin, and the scan of one point."""
    job = read_job(pages.HELIX_JOB)
    optimised = rd.follow(job.solver(), job.path, progress=False)
    fixed = follow_without_spin(optimised, job.objective, progress=False)
    length = job.objective.length
    assert length is not None
    plots.save(plots.condition_along_path(optimised, fixed), folder / "helix_condition.png")
    plots.save(plots.joints_against_limits(optimised), folder / "helix_joints.png")
    plots.save(plots.spin_along_path(optimised), folder / "helix_spin.png")
    plots.save(plots.spin_scan(job.robot, optimised.q[SCANNED], length, points=7201), folder / "spin_scan_85.png")


def small_helix(folder: Path) -> None:
    """Draw the condition number along the path of appendix A: spin fixed, best from point to point."""
    fixed, best, *_ = runs(read_job(pages.SMALL_HELIX_JOB)).values()
    plots.save(plots.condition_along_path(best, fixed), folder / "helix_small_condition.png")
    plots.save(plots.joints_against_limits(best), folder / "helix_small_joints.png")


def convergence(folder: Path) -> None:
    """Draw how both methods come to the posture of minimum condition number, evaluation by evaluation."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.0, 3.2), layout="constrained")
        axes = figure.subplots()
        for method, name, colour in zip(METHODS, ("Newton", "BFGS"), (BLUE, ORANGE), strict=True):
            for eliminate, line in ((True, "-"), (False, "--")):
                way = history(method, eliminate)
                label = f"{name},\nlength {'in closed form' if eliminate else 'a variable'}"
                axes.plot(way.evaluations, way.gradient, line, color=colour, marker="o", markersize=3.0, label=label)
        axes.set_yscale("log")
        axes.set_xlabel("evaluations")
        axes.set_ylabel(r"$|\nabla\kappa_F^2|$")
        legend_beside(axes)
        plots.save(figure, folder / "minimum_convergence.png")


def postures(folder: Path) -> None:
    """Draw the posture of minimum condition number, and the tetrahedron of a planar robot at its own."""
    fanuc = rd.robots.get("fanuc_m710ic50_milling")
    best = rd.minimum_condition_posture(fanuc, np.deg2rad([0.0, 20.0, -20.0, 0.0, -90.0, 0.0]))
    figure = plots.posture_3d(fanuc, best.q)
    figure.set_size_inches(5.0, 4.0)
    plots.save(figure, folder / "minimum_posture.png")
    planar = rd.robots.get("planar_3r")
    best = rd.minimum_condition_posture(planar, np.deg2rad([0.0, 90.0, 120.0]), rows=[2, 3, 4])
    figure = plots.planar_tetrahedron(planar, best.q, best.length)
    figure.set_size_inches(5.0, 3.6)
    plots.save(figure, folder / "planar_tetrahedron.png")


def volumes(folder: Path) -> None:
    """Draw Fig. 1 of From and Gravdahl (2007): a free spin about z, and a cone with the spins about its directions."""
    spin = rd.OrientationVolume.product([((0.0, 0.0, 1.0), -np.pi, np.pi)])
    cone = rd.OrientationVolume.cone(np.deg2rad(30.0), spin=np.deg2rad(90.0))
    plots.save(plots.orientation_volumes(spin, cone), folder / "orientation_volumes.png")


def main(arguments: list[str]) -> int:
    """Draw every picture."""
    folder = pages.folder_of(arguments)
    helix(folder)
    small_helix(folder)
    postures(folder)
    convergence(folder)
    volumes(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
