"""The figures of Leger (2014) beside those of this package: ``python -m evidence.leger.reproduce [--write] [--check]``.

Prints the tables of docs/reproduction_leger.md. With --write it puts them into the page; with --check it also tells, by
its exit status, whether the pages show what their programs print.
"""

import sys
from collections.abc import Callable

import numpy as np
import redundancy as rd
from redundancy import plots
from redundancy.cli import read_job

from evidence import flops, pages
from evidence.leger import second_path
from evidence.leger.cases import (
    F64,
    FANUC,
    FIRST_POINT,
    QUASI_NEWTON,
    QUASI_NEWTON_LENGTH,
    START,
    START_LENGTH,
    Row,
    angle_to,
    bound,
    in_degrees,
    printed_axis,
)
from evidence.leger.convergence import METHODS, convergence, history
from evidence.leger.sums import sums

PAGE = pages.DOCS / "reproduction_leger.md"
SCANNED = 84
"""The 85th point, counted from 0."""


def minimum_posture() -> list[Row]:
    """Compare Table 4-2 and the lengths of Section 4.1."""
    newton = rd.minimum_condition_posture(FANUC, START, length0=START_LENGTH)
    variable = rd.minimum_condition_posture(FANUC, START, length0=START_LENGTH, eliminate=False)
    bfgs = rd.minimum_condition_posture(FANUC, START, length0=START_LENGTH, method="bfgs")
    angles = ", ".join(f"{x:.7f}" for x in np.rad2deg(newton.q[[1, 2, 4]]))
    kappa = newton.condition_number
    there, here = slope(QUASI_NEWTON, QUASI_NEWTON_LENGTH), slope(newton.q, newton.length)
    first, last = (f"{1000.0 * rd.rms_length(FANUC, q):.3f}" for q in (START, QUASI_NEWTON))
    return [
        ("Table 4-2", "angles 2, 3, 5 [deg], Newton-Raphson", "0.4150, -35.7372, -118.5897", angles),
        ("Table 4-2", "length [mm], Newton-Raphson", "485.1522", f"{1000.0 * newton.length:.7f}"),
        ("Table 4-2", "6 kappa_F^2, called the condition number", "6.5046", f"{6.0 * kappa**2:.7f}"),
        ("(2.14)", "kappa_F", "", f"{kappa:.9f}"),
        ("appendix A", "6 kappa_F, `cond(J_n, 'fro')` of MATLAB", "", f"{6.0 * kappa:.9f}"),
        ("Table 4-2", "evaluations, Newton-Raphson", "67", f"{newton.evaluations}"),
        ("Table 4-2", "the same, the length one more variable", "67", f"{variable.evaluations}"),
        ("Table 4-2", "evaluations, quasi-Newton", "238", f"{bfgs.evaluations}"),
        ("Table 4-2", "gradient of kappa_F^2, norm, at the quasi-Newton posture", "", f"{there:.1e}"),
        ("Table 4-2", "the same at the Newton-Raphson posture", "", bound(here)),
        ("4.1", "rms distance of the axes at the start [mm]", "298.5933", first),
        ("4.1", "rms distance of the axes at the quasi-Newton posture [mm]", "242.7693", last),
    ]


def slope(q: F64, length: float) -> float:
    """Return the norm of the gradient of kappa_F^2 over the joints and the length."""
    index = rd.ConditionNumber(length, squared=True)
    return float(np.linalg.norm(index.evaluate(FANUC, q, order=1, with_length=True)[1]))


def first_point(path: rd.Toolpath) -> list[Row]:
    """Compare the posture (4.37) with the nearest one that holds (4.36) with the printed axis."""

    def constraints(q: F64) -> F64:
        return np.concatenate([FANUC.fk(q)[:3, 3] - path.position[0], printed_axis(q)[1:]])

    q, h = FIRST_POINT, 1e-6
    for _ in range(10):
        slopes = [(constraints(q + h * unit) - constraints(q - h * unit)) / (2 * h) for unit in np.eye(6)]
        q = q - np.linalg.pinv(np.stack(slopes, axis=1)) @ constraints(q)
    moved = f"the same, moved by {np.abs(np.rad2deg(q - FIRST_POINT)).max():.0e} onto the target (4.36)"
    off = angle_to(FANUC.fk(FIRST_POINT)[:3, 2], path.axis[0])
    kappa = rd.ConditionNumber(QUASI_NEWTON_LENGTH).evaluate(FANUC, FIRST_POINT, order=0)
    return [
        ("(4.37)", "joints [deg], axis as printed", in_degrees(FIRST_POINT), moved),
        ("(4.37)", "kappa_F there", "", f"{kappa:.4f}"),
        ("(4.37)", "error of the axis there, tool fixed to the flange [deg]", "0", f"{off:.1f}"),
    ]


def helix() -> list[Row]:
    """Compare Fig. 4-7 and 4-8, with the tool fixed to the flange."""
    job = read_job(pages.HELIX_JOB)
    found = rd.follow(job.solver(), job.path, progress=False)
    errors = max(found.position_error.max(), found.axis_error.max())
    margin = f"kept, {np.rad2deg(found.limit_margin):.2f} to the nearest"
    largest = f"{found.max_condition_number:.5f}"
    return [
        *first_point(job.path),
        ("Fig. 4-7", "kappa_F of the first point", "", f"{found.condition_number[0]:.5f}"),
        ("Fig. 4-7", "largest kappa_F (printed: 17.42, 6 times it)", f"{17.42 / 6:.3f}", largest),
        ("Fig. 4-7", "mean kappa_F", "", f"{found.mean_condition_number:.5f}"),
        ("Fig. 4-7", "largest error of position [m] and axis [rad]", "", bound(errors)),
        ("4.2.3", "joint limits [deg]", "not considered", margin),
        *spin_scan(found.q[SCANNED], job.path.axis[SCANNED]),
    ]


def spin_scan(q: F64, axis: F64) -> list[Row]:
    """Compare Fig. 4-8: 1/kappa_F over the spin, and the spins up to which the elbow is not stretched."""
    lines = plots.spin_scan(FANUC, q, QUASI_NEWTON_LENGTH, points=7201).axes[0].lines
    best = max(float(np.nanmax(np.asarray(line.get_ydata(), dtype=np.float64))) for line in lines)
    here = 1.0 / rd.ConditionNumber(QUASI_NEWTON_LENGTH).evaluate(FANUC, q, order=0)
    shoulder, elbow, wrist, tip = (FANUC.link_frames(q)[i, :3, 3] for i in (1, 2, 4, 6))
    longest = np.linalg.norm(elbow - shoulder) + np.linalg.norm(wrist - elbow)
    angles = np.deg2rad(np.arange(-180.0, 180.0, 0.1))
    arm = wrist - tip
    along = (arm @ axis) * axis
    place = tip + along + np.outer(np.cos(angles), arm - along) + np.outer(np.sin(angles), np.cross(axis, arm))
    out = np.hypot(place[:, 0], place[:, 1]) - np.hypot(*shoulder[:2])
    reached = np.rad2deg(angles[np.hypot(out, place[:, 2] - shoulder[2]) <= longest])
    return [
        ("Fig. 4-8", "1/kappa_F at the 85th point", "the largest of all spins", f"{here:.4f}"),
        ("Fig. 4-8", "the largest 1/kappa_F of all spins there", "", f"{best:.4f}"),
        ("Fig. 4-8", "spins that can be reached there [deg]", "-180 to 180", f"{reached[0]:.0f} to {reached[-1]:.0f}"),
    ]


def costs() -> list[Row]:
    """Compare the operations of (3.36) and (3.48a), and what a minimisation takes of them."""
    ledger = flops.count()
    gradient = ledger.upto("value", "gradient")
    hessian = ledger.upto("value", "gradient", "Hessian")
    newton, bfgs = (int(history(method, eliminate=True).evaluations[-1]) for method in METHODS)
    return [
        ("Table 4-2", "operations of all evaluations, Newton-Raphson", "1594300", f"{newton * hessian}"),
        ("Table 4-2", "operations of all evaluations, quasi-Newton", "419500", f"{bfgs * gradient}"),
        ("(3.36)", "operations, gradient", f"{flops.THESIS['gradient']}", f"{gradient}"),
        ("(3.48a)", "operations, Hessian", f"{flops.THESIS['Hessian']}", f"{hessian}"),
    ]


def comparison() -> str:
    """Return the comparison as a Markdown table."""
    rows = (*minimum_posture(), *helix(), *second_path.start(), *costs())
    return pages.table(("where", "what", "printed", "computed"), rows)


SECTIONS: tuple[Callable[[], str], ...] = (comparison, convergence, second_path.small_helix, sums)


def main(arguments: list[str]) -> int:
    """Print the tables; with --write, put them into the page; with --check, compare with the pages."""
    shown = [(section.__name__, section()) for section in SECTIONS]
    pages.show(PAGE, shown, "--write" in arguments)
    if "--check" not in arguments:
        return 0
    texts = [(PAGE, pages.marked(name, text)) for name, text in shown]
    return 1 if pages.stale([*texts, (pages.DOCS / "indices.md", flops.table(flops.count()))]) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
