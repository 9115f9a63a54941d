"""The pictures of the documentation: ``python -m evidence.figures [folder]``; the folder is docs/img if left out."""

import sys
from pathlib import Path

import numpy as np
import redundancy as rd
from redundancy import plots
from redundancy.cli import read_job
from redundancy.loops import follow_without_spin

from evidence import pages

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


def main(arguments: list[str]) -> int:
    """Draw every picture."""
    folder = pages.folder_of(arguments)
    helix(folder)
    postures(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
