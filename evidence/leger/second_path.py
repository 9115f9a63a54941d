"""The path of the program in appendix A: a helix of 50 mm radius close to the robot, `examples/helix_small.toml`."""

import numpy as np
import redundancy as rd
from redundancy.cli import Job, read_job
from redundancy.loops import follow_without_spin

from evidence import pages
from evidence.leger.cases import FANUC, SECOND_START, Row, angle_to, in_degrees, printed_axis


def start() -> list[Row]:
    """Compare the printed start with the first point of the path."""
    job = read_job(pages.SMALL_HELIX_JOB)
    here, point, axis = FANUC.fk(SECOND_START), job.path.position[0], job.path.axis[0]
    missed = 1000.0 * np.linalg.norm(here[:3, 3] - point)
    printed, fixed = angle_to(printed_axis(SECOND_START), axis), angle_to(here[:3, 2], axis)
    kappa = rd.ConditionNumber(job.objective.length or 1.0).evaluate(FANUC, SECOND_START, order=0)
    return [
        ("appendix A", f"start `x0`, {in_degrees(SECOND_START)} deg: off the first point [mm]", "", f"{missed:.0e}"),
        ("appendix A", "error of the axis there [deg], axis as printed", "", f"{printed:.0e}"),
        ("appendix A", "error of the axis there [deg], tool fixed to the flange", "", f"{fixed:.2f}"),
        ("appendix A", "kappa_F there", "", f"{kappa:.4f}"),
    ]


def runs(job: Job) -> dict[str, rd.Trajectory]:
    """Follow the path from the printed start, without a spin and with the best one, and plan it as a whole."""
    followed = rd.follow(job.solver(), job.path, SECOND_START, progress=False)
    ways = {
        "from point to point, spin fixed": follow_without_spin(followed, job.objective, progress=False),
        "from point to point, best spin": followed,
    }
    for criterion in ("minimax", "integral"):
        ways[f"planned, {criterion}"] = rd.plan(
            FANUC, job.path, job.task, job.objective, criterion=criterion, progress=False
        )
    return ways


def small_helix() -> str:
    """Return what the whole path is worth, as a Markdown table."""
    rows = []
    for name, found in runs(read_job(pages.SMALL_HELIX_JOB)).items():
        assert not found.unreachable
        kappa = found.condition_number
        speed = np.abs(found.joint_speed if found.joint_speed is not None else np.nan) / FANUC.qd_max
        limit, share = np.rad2deg(found.limit_margin), 100.0 * speed.max()
        rows.append((name, f"{kappa.max():.5f}", f"{kappa.mean():.5f}", f"{limit:.2f}", f"{share:.1f}"))
    head = (
        "way",
        "kappa_F, largest",
        "mean",
        "to the nearest joint limit [deg]",
        "largest joint speed [% of its limit]",
    )
    return pages.table(head, rows)
