"""The examples of Huo (2009) beside those of this package: ``python -m evidence.huo.reproduce [--write | --check]``.

Prints the tables of docs/reproduction_huo.md, each between two marks. With --write it puts them into the page and
draws its pictures. With --check it tells, by its exit status, whether the page shows all but the tables with times,
which are of the machine that runs it.
"""

import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy.loops import Solver

from evidence.huo import cases as huo
from evidence.huo.figures import draw
from evidence.huo.runs import (
    EVEN,
    SPHERE,
    Measures,
    adapt,
    condition_and_limits,
    mean_errors,
    pipe,
    puma_solver,
    run,
    self_adapted,
    step_time,
    tilted,
    unresolved,
    until_accurate,
    until_still,
    welded,
    welding,
)
from evidence.pages import DOCS, IMAGES, marked, show, stale, table

F64 = NDArray[np.float64]

PAGE = DOCS / "reproduction_huo.md"


def span(values: F64) -> str:
    """Return the smallest and the largest of some values."""
    return f"{values.min():.2f} to {values.max():.2f}"


def small(value: float) -> str:
    """Round what is rounding alone, so that the page is the same on every machine."""
    return "below 1e-9" if value < 1e-9 else f"{value:.1e}"


def largest_step(q: F64) -> float:
    """Return the longest way of a joint from a point to the next [rad]."""
    return float(np.abs(np.diff(q, axis=0)).max())


def puma() -> str:
    """Compare turns without resolution, with the twist decomposition and with a virtual joint (Fig. 3.2 to 3.4)."""
    case, points = huo.puma_pipe(), 100
    rows: list[Sequence[object]] = []
    for name, solver in [
        ("no resolution", rd.ResolvedRate(case.robot, rd.Task.full(), limits=False)),
        ("TWA, half of the pull", puma_solver(case, rd.TwistDecomposition, 0.5)),
        ("TWA, all of the pull", puma_solver(case, rd.TwistDecomposition)),
        ("TWA, twice the pull", puma_solver(case, rd.TwistDecomposition, 2.0)),
        ("virtual joint, all of the pull", puma_solver(case, rd.VirtualJoint)),
    ]:
        q = run(solver, case, pipe(case, points, turns=3)).q
        one, two, three = (q[i * points : (i + 1) * points + 1] for i in range(3))
        change = np.abs(two - one).max(axis=1)
        cells = [span(turn[:, 5]) for turn in (one, two)] + [f"{largest_step(turn):.2f}" for turn in (one, two)]
        cells += [small(float(x)) for x in (change.max(), change[points // 2 :].max(), np.abs(three - two).max())]
        rows.append((name, *cells))
    head = ("method", "joint 6, turn 1 [rad]", "turn 2", "longest step, turn 1 [rad]", "turn 2")
    return table((*head, "turn 2 from turn 1 [rad]", "their second halves", "turn 3 from turn 2"), rows)


PRINTED_ERRORS = np.array([9.4712e-8, 9.2936e-6])
"""Mean errors of the twist decomposition in Table 3.2 [m, rad]."""

ACCURATE = (2000, 0.1)
"""Points a turn and share of the pull with which both turns keep Table 3.2's errors."""


def errors() -> str:
    """Compare Table 3.2."""
    case = huo.puma_pipe()
    rows: list[Sequence[object]] = [
        ("Table 3.2", "", "TWA", "9.5e-08, 9.3e-06", "", ""),
        ("", "", "augmented", "2.5e-06, 2.3e-05", "", ""),
    ]
    for points, part in [(100, 1.0), (400, 1.0), (1000, 1.0), ACCURATE]:
        for name, method in [("TWA", rd.TwistDecomposition), ("virtual joint", rd.VirtualJoint)]:
            both, second = mean_errors(case, method, points, part)
            kept = [turns for turns, mean in (("both", both), ("turn 2", second)) if (mean <= PRINTED_ERRORS).all()]
            printed = [f"{position:.1e}, {angle:.1e}" for position, angle in (both, second)]
            rows.append((points, f"{part:g}", name, *printed, ", ".join(kept) or "no"))
    head = ("points a turn", "share of the pull", "method", "mean errors, both turns [m, rad]", "turn 2 alone [m, rad]")
    return table((*head, "at most Table 3.2's for TWA"), rows)


def sphere() -> str:
    """Compare Fig. 3.6."""
    case = huo.m16ib_sphere_edge()
    rows: list[Sequence[object]] = []
    for name, found in [
        ("no resolution", unresolved(case)),
        ("virtual joint", run(rd.VirtualJoint(case.robot, case.task, SPHERE), case)),
        ("TWA", run(rd.TwistDecomposition(case.robot, case.task, SPHERE), case)),
    ]:
        speed, margins = np.rad2deg(np.abs(np.diff(found.q, axis=0)).max(axis=0) / case.dt), found.margins
        joint = int(margins.min(axis=0).argmin())
        rows.append((name, f"{margins.min():.2f} (joint {joint + 1})", f"{speed[3]:.0f}", f"{speed[5]:.0f}"))
    return table(("method", "smallest distance to a limit [rad]", "joint 4 [deg/s]", "joint 6 [deg/s]"), rows)


def times() -> str:
    """Compare Table 3.4: the median time of a step, called from Python."""
    twa, virtual = step_time(rd.TwistDecomposition), step_time(rd.VirtualJoint)
    printed, here = (f"{a:.2f}" for a in (1.3748 / 0.3950, virtual / twa))
    rows = [
        ("Table 3.4, period B [s]", "0.3950", "1.3748", printed),
        ("a step [ns]", f"{twa:.0f}", f"{virtual:.0f}", here),
    ]
    return table(("what", "TWA", "virtual joint (augmented)", "ratio"), rows)


def counts() -> str:
    """Compare the iterations of Table 3.4, along two turns."""
    rows: list[Sequence[object]] = [("Table 3.4", "", "1 mm and 0.01 rad", "4787", "4809")]
    for points in (100, 2200):
        case = huo.m16ib_sphere_edge(points)
        methods = (rd.TwistDecomposition, rd.VirtualJoint)
        first = [str(until_accurate(method, case).iterations) for method in methods]
        rows.append(("here", len(case.path), "1 mm and 0.01 rad", *first))
        for stop in (1e-2, 1e-3, 1e-5):
            still = [until_still(method, case, stop).iterations for method in methods]
            rows.append(("", len(case.path), f"motion below {stop:.0e}", *still))
    return table(("", "points", "stop", "TWA", "virtual joint (augmented)"), rows)


def cells(m: Measures) -> tuple[str, ...]:
    """Return the cells of Table 4.1."""
    motion = f"{m.low:.2f} to {m.high:.2f}, {m.range_6:.2f}"
    indices = (f"{m.kappa:.3g}", f"{m.manipulability:.4f}", f"{m.singularity:.3g}")
    return motion, *indices, f"{m.speed_6:.0f}", f"{m.speed_4:.0f}"


PRINTED = {
    "Test I": ("-5.30 to 4.47, 9.77", "163", "0.0066", "157", "57", "74"),
    "Test II": ("-4.60 to 4.17, 8.77", "56", "0.0300", "43.2", "56", "22"),
    "Test III": ("-1.52 to 4.17, 5.69", "31", "0.0760", "20.2", "37", "26"),
    "Test IV": ("-0.97 to 0.19, 1.16", "", "0.0732", "", "", ""),
}
"""Table 4.1, and what section 5.4.2 tells of Test IV."""


def tests() -> str:
    """Compare Table 4.1."""
    rows: list[Sequence[object]] = []
    found = welding()
    for name, printed in PRINTED.items():
        rows.append((f"{name}, thesis", *printed))
        same = {other: t for other, t in found.items() if other == name or other.startswith(name + ",")}
        rows += [(f"**{other}, here**", *cells(Measures.of(t))) for other, t in same.items()]
    rows += [(name, *cells(Measures.of(t))) for name, t in found.items() if not name.startswith("Test")]
    head = ("test", "joint 6, range [rad]", "kappa_2", "manipulability", "w_ps", "joint 6 [deg/s]", "joint 4 [deg/s]")
    return table(head, rows)


def gains(four: Measures, two: Measures) -> str:
    """Return what Test IV makes of Test II: range of joint 6, smallest manipulability."""
    share, times = four.against(two)
    return f"{share:.0%}, {times:.2f}"


def steps() -> str:
    """Tell what the number of iterations a point does to the tests, and a stop where the motion is short."""
    case = huo.m710_cylinders()
    rows: list[Sequence[object]] = []
    for iterations, stop in ((2, 0.0), (3, 0.0), (5, 0.0), (10, 0.0), (20, 0.0), (50, 0.0), (200, 1e-2), (200, 1e-3)):
        found = [Measures.of(t) for t in welded(case, iterations, stop).values()]
        name, by_search = str(iterations), ""
        if stop:
            name = f"until {stop:g} rad"
        else:
            by_search = gains(Measures.of(self_adapted(iterations)), found[1])
        cells = [f"{m.range_6:.2f}, {m.singularity:.0f}, {m.speed_6:.0f}, {m.speed_4:.0f}" for m in found]
        rows.append((name, *cells, gains(found[3], found[1]), by_search))
    head = ("iterations", "Test I: joint 6 [rad], w_ps, joints 6 and 4 [deg/s]", "Test II", "Test III", "Test IV")
    return table((*head, "IV of II: range, manipulability", "the same by `self_adapt`"), rows)


def geometries() -> str:
    """Compare section 5.4: joints before and after self-adaptation with three lies of the tool."""
    rows: list[Sequence[object]] = []
    for build in (huo.m710_rectangle, huo.m710_cylinders, huo.m16ib_oblique):
        found = adapt(build)
        a, b = found.history[0].performance, found.performance
        joints = " and ".join(str(i + 1) for i in found.sensitivity.joints)
        cells = [f"{x:.2f} to {y:.2f}" for x, y in zip(a.ranges[3:], b.ranges[3:], strict=True)]
        beyond = f"{a.limit_distance:.0%} to {b.limit_distance:.0%}"
        indices = [f"{a.singularity:.1f} to {b.singularity:.1f}", f"{a.manipulability:.3f} to {b.manipulability:.3f}"]
        rows.append((found.sensitivity.case, joints, *cells, beyond, *indices))
    head = ("tool", "tuned", "range of joint 4 [rad]", "joint 5", "joint 6", "beyond a limit [share of range]")
    return table((*head, "w_ps", "manipulability"), rows)


def pairs() -> str:
    """Compare Table 5.1: pairs of weights that are named by hand."""
    rows: list[Sequence[object]] = []
    tests = {(4, 3): "0.3098, within", (4, 5): "0.4075, within", (5, 3): "no solution"}
    for joints, printed in tests.items():
        found = adapt(huo.m16ib_oblique, joints=joints, max_runs=400)
        before, after = (
            f"{m.manipulability:.3f}, {'within' if m.within_limits else 'beyond'}"
            for m in (found.history[0].performance, found.performance)
        )
        if not rows:
            rows.append(("none", "0.197, beyond", before, ""))
        tuned = ", ".join(f"w{i + 1} {found.w[i]:.3g}, k{i + 1} {found.k[i]:.3g}" for i in joints)
        rows.append((" and ".join(str(i + 1) for i in joints), printed, after, tuned))
    return table(("joints tuned", "thesis: least manipulability, limits", "here", "weights found"), rows)


def dynamic() -> str:
    """Compare Table 6.1."""
    printed = {
        "A": ("", "134", "417", "450", "235", "0.1276"),
        "B": ("", "97", "130", "102", "74", "0.1431"),
        "C": ("", "97", "130", "27", "13", "0.12"),
    }
    rows: list[Sequence[object]] = []
    for name, found in tilted().found.items():
        m, farthest = Measures.of(found), [f"{x:.0f}" for x in np.rad2deg(np.abs(found.q)).max(axis=0)[3:]]
        if name in printed:
            rows.append((f"Test {name}, thesis", *printed[name]))
        label = f"**Test {name}, here**" if name in printed else name
        rows.append((label, *farthest, f"{m.speed_4:.0f}", f"{m.speed_6:.0f}", f"{m.manipulability:.4f}"))
    head = ("test", "joint 4 up to [deg]", "joint 5 (limit 125)", "joint 6 (limit 360)", "joint 4 [deg/s]")
    return table((*head, "joint 6 [deg/s]", "least manipulability"), rows)


def rivals() -> str:
    """Compare the twist decomposition with the SQP on every path, both from one start."""
    rows: list[Sequence[object]] = []
    for build in huo.BUILDERS:
        case = build()
        puma = case.name == "puma_pipe"
        # The limits of the PUMA's file are not those of the thesis.
        solvers: dict[str, Solver] = {"SQP": condition_and_limits(case, limits=not puma)}
        if puma:
            solvers["TWA"] = puma_solver(case, rd.TwistDecomposition)
        else:
            pull = SPHERE if case.name == "m16ib_sphere_edge" else rd.PosturePull(EVEN, EVEN)
            found = adapt(build)
            pulls = {"TWA": pull, "TWA, `self_adapt`": rd.PosturePull(found.w, found.k)}
            for name, pull in pulls.items():
                solvers[name] = rd.TwistDecomposition(case.robot, case.task, pull)
        rows += [(case.name, name, *rival(solver, case, puma)) for name, solver in solvers.items()]
    head = ("path", "method", "iterations a point", "time a point [us]", "kappa_F, last", "mean", "largest")
    return table((*head, "second differences of q, rms [rad]", "smallest distance to a limit [rad]"), rows)


def rival(solver: Solver, case: huo.Case, unlimited: bool) -> tuple[str, ...]:
    """Return what a method needs for a path, the median time of five runs, and what it makes of it."""
    spent = []
    # Of the same postures of the tool the one nearest to the middle, whole turns of joints taken off.
    start = case.start if unlimited else case.robot.turned(case.start)
    for _ in range(5):
        begin = time.perf_counter()
        found = run(solver, case, start=start)
        spent.append(time.perf_counter() - begin)
    kappa = rd.ConditionNumber(1.0).evaluate_many(case.robot, found.q, 0)[0]
    bend = float(np.sqrt((np.diff(found.q, 2, axis=0) ** 2).mean()))
    effort = (f"{found.iterations / len(found):.1f}", f"{1e6 * np.median(spent) / len(found):.0f}")
    indices = [f"{x:.2f}" for x in (kappa[-1], kappa.mean(), kappa.max())]
    return *effort, *indices, f"{bend:.1e}", "" if unlimited else f"{found.limit_margin:.2f}"


TIMED: tuple[Callable[[], str], ...] = (times, rivals)
SECTIONS: tuple[Callable[[], str], ...]
SECTIONS = (puma, errors, sphere, times, counts, tests, steps, geometries, pairs, dynamic, rivals)


def main(arguments: list[str]) -> int:
    """Print the tables; with --write or --check, put them into the page or compare them with it."""
    if "--check" in arguments:
        return 1 if stale((PAGE, marked(f.__name__, f())) for f in SECTIONS if f not in TIMED) else 0
    write = "--write" in arguments
    show(PAGE, ((section.__name__, section()) for section in SECTIONS), write)
    if write:
        draw(IMAGES)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
