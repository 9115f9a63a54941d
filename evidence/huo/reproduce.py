"""The examples of Huo (2009) beside those of this package: ``python -m evidence.huo.reproduce [--write]``.

Prints the tables of docs/reproduction_huo.md, each between two marks. With --write it puts them into the page and
draws its pictures. Times are of the machine that runs it.
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
    ITERATIONS,
    SPHERE,
    TEST_III,
    TEST_IV,
    Measures,
    adapt,
    condition_and_limits,
    mean_errors,
    other_tools,
    pipe,
    puma_solver,
    run,
    share,
    step_time,
    tilted,
    twist_run,
    unresolved,
    weight_grid,
    welding,
)
from evidence.pages import DOCS, IMAGES, show, table

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


def cells(m: Measures) -> tuple[str, ...]:
    """Return the cells of Table 4.1."""
    motion = f"{m.low:.2f} to {m.high:.2f}, {m.range_6:.2f}"
    indices = (f"{m.kappa:.3g}", f"{m.manipulability:.4f}", f"{m.singularity:.3g}")
    return motion, *indices, f"{m.speed_6:.0f}", f"{m.speed_4:.0f}", small(m.orientation), small(m.position)


PRINTED = {
    "Test I": ("-5.30 to 4.47, 9.77", "163", "0.0066", "157", "57", "74", "1.3e-03", "2.4e-06"),
    "Test II": ("-4.60 to 4.17, 8.77", "56", "0.0300", "43.2", "56", "22", "1.3e-03", "2.4e-06"),
    "Test III": ("-1.52 to 4.17, 5.69", "31", "0.0760", "20.2", "37", "26", "7.7e-04", "2.4e-06"),
    "Test IV": ("-0.97 to 0.19, 1.16", "", "0.0732", "", "", "", "", ""),
}
"""Table 4.1, and what section 5.4.2 tells of Test IV."""


def tests() -> str:
    """Compare Table 4.1."""
    rows: list[Sequence[object]] = [(f"printed: {name}", *printed) for name, printed in PRINTED.items()]
    rows += [(name, *cells(Measures.of(found))) for name, found in welding().items()]
    head = ("test", "joint 6, range [rad]", "kappa_2", "manipulability", "w_ps", "joint 6 [deg/s]", "joint 4 [deg/s]")
    return table((*head, "orientation [rad]", "position [m]"), rows)


def steps() -> str:
    """Tell what the number of iterations a point does to the tests, and to the errors without correction."""
    case = huo.m710_cylinders()
    rows: list[Sequence[object]] = []
    for iterations in (1, 2, 3, 5, 20):
        cells = []
        for w, k in ((EVEN, None), (EVEN, EVEN), TEST_III, TEST_IV):
            m = Measures.of(twist_run(case, w, k, iterations))
            pull = rd.PosturePull(w, k)
            raw = run(rd.TwistDecomposition(case.robot, case.task, pull, iterations=iterations, correct=False), case)
            cells.append(f"{m.range_6:.2f}, {m.singularity:.0f}, {m.speed_4:.0f}, {1e3 * raw.position_error.max():.2f}")
        rows.append((iterations, *cells))
    return table(
        (
            "iterations",
            "Test I: joint 6 [rad], w_ps, joint 4 [deg/s], error [mm]",
            "Test II",
            "Test III",
            "IV, printed",
        ),
        rows,
    )


def adaptation() -> str:
    """Compare section 5.4.2: joint 6 and manipulability as shares of those of Test II."""
    case = huo.m710_cylinders()
    rows: list[Sequence[object]] = [("printed", "21 %, 2.48", "", "", "")]
    for iterations in (1, 2, 3, 20):
        found = adapt(case, iterations)
        before = Measures.of(twist_run(case, EVEN, EVEN, iterations))
        printed = share(Measures.of(twist_run(case, *TEST_IV, iterations)), before)
        adapted = share(found.performance, found.history[0].performance)
        shares = weight_grid(iterations).reshape(-1, 2)
        still, open_ = shares[shares[:, 0] <= 0.25], shares[shares[:, 1] >= 2.4]
        best = [
            f"{still[:, 1].max():.2f}" if len(still) else "none",
            f"{open_[:, 0].min():.0%}" if len(open_) else "none",
        ]
        rows.append((str(iterations), *(f"{a:.0%}, {b:.2f}" for a, b in (printed, adapted)), *best))
    tools = other_tools()
    both = int(((tools[:, 0] <= 0.25) & (tools[:, 1] >= 2.4)).sum())
    text = (
        f"Of {len(tools)} other tools parallel to axis 6, self-adapted with {ITERATIONS} iterations, {both} reach both"
    )
    text += f" bars, {int((tools[:, 0] <= 0.25).sum())} the first, {int((tools[:, 1] >= 2.4).sum())} the second;"
    text += f" the smallest range is {tools[:, 0].min():.0%} of that before."
    head = (
        "iterations",
        "printed weights (5.8), (5.9)",
        "`self_adapt`",
        "best manipulability with a range of 25 % or less",
    )
    return table((*head, "least range with 2.4 times the manipulability"), rows) + "\n\n" + text


def geometries() -> str:
    """Compare section 5.4: joints before and after self-adaptation with three lies of the tool."""
    rows: list[Sequence[object]] = []
    for case in (huo.m710_rectangle(), huo.m710_cylinders(), huo.m16ib_oblique()):
        found = adapt(case)
        a, b = found.history[0].performance, found.performance
        joints = " and ".join(str(i + 1) for i in found.sensitivity.joints)
        cells = [f"{x:.2f} to {y:.2f}" for x, y in zip(a.ranges[3:], b.ranges[3:], strict=True)]
        beyond = f"{a.limit_distance:.0%} to {b.limit_distance:.0%}"
        indices = [f"{a.singularity:.1f} to {b.singularity:.1f}", f"{a.manipulability:.3f} to {b.manipulability:.3f}"]
        rows.append((found.sensitivity.case, joints, *cells, beyond, *indices))
    head = ("tool", "tuned", "range of joint 4 [rad]", "joint 5", "joint 6", "beyond a limit [share of range]")
    return table((*head, "w_ps", "manipulability"), rows)


def dynamic() -> str:
    """Compare Table 6.1."""
    rows: list[Sequence[object]] = [
        ("printed: A", "", "134", "417", "450", "235", "0.1276"),
        ("printed: B", "", "97", "130", "102", "74", "0.1431"),
        ("printed: C", "", "97", "130", "27", "13", "0.12"),
    ]
    for name, found in tilted().items():
        m, farthest = Measures.of(found), [f"{x:.0f}" for x in np.rad2deg(np.abs(found.q)).max(axis=0)[3:]]
        rows.append((name, *farthest, f"{m.speed_4:.0f}", f"{m.speed_6:.0f}", f"{m.manipulability:.4f}"))
    head = ("test", "joint 4 up to [deg]", "joint 5 (limit 125)", "joint 6 (limit 360)", "joint 4 [deg/s]")
    return table((*head, "joint 6 [deg/s]", "least manipulability"), rows)


def claims() -> str:
    """Tell which of the improvements that the thesis claims appear."""
    m = {name: Measures.of(found) for name, found in welding().items()}
    one, two, three = m["Test I"], m["Test II"], m["Test III"]
    printed, found = m["Test IV, printed weights"], m["Test IV, `self_adapt`"]
    a, b, c, d = (tilted()[name] for name in ("A", "B", "C as printed", "C by `dynamic_adapt`"))
    speed_b, speed_c, speed_d = (Measures.of(x).speed_4 for x in (b, c, d))

    def moved(old: float, new: float, wanted: float = -1.0) -> tuple[str, bool]:
        return f"{old:.3g} to {new:.3g}", wanted * (new - old) > 0.0

    def opened(new: Measures) -> tuple[str, bool]:
        return moved(two.manipulability, new.manipulability, 1.0)

    rows: list[tuple[str, str, tuple[str, bool]]] = [
        ("none to I: joint 6 [rad]", "within limits", moved(m["no resolution"].range_6, one.range_6)),
        ("none to I: w_ps", "not told", moved(m["no resolution"].singularity, one.singularity)),
        ("I to II: joint 6 [rad]", "9.77 to 8.77", moved(one.range_6, two.range_6)),
        ("I to II: kappa_2", "163 to 56", moved(one.kappa, two.kappa)),
        ("I to II: w_ps", "157 to 43.2", moved(one.singularity, two.singularity)),
        ("I to II: joint 4 [deg/s]", "74 to 22", moved(one.speed_4, two.speed_4)),
        ("II to III: joint 6 [rad]", "to 33 %", moved(two.range_6, three.range_6)),
        ("II to III: w_ps", "43.2 to 20.2", moved(two.singularity, three.singularity)),
        ("III to IV, printed weights: joint 6 [rad]", "5.69 to 1.16", moved(three.range_6, printed.range_6)),
        ("II to IV, printed weights: joint 6 [rad]", "to 21 %", moved(two.range_6, printed.range_6)),
        ("II to IV, printed weights: manipulability", "0.0295 to 0.0732", opened(printed)),
        ("II to IV, `self_adapt`: joint 6 [rad]", "to 21 %", moved(two.range_6, found.range_6)),
        ("II to IV, `self_adapt`: manipulability", "0.0295 to 0.0732", opened(found)),
        ("A to B: beyond a limit [rad]", "0.99 to none", moved(-a.limit_margin, -b.limit_margin)),
        ("B to C as printed: joint 4 [deg/s]", "102 to 27", moved(speed_b, speed_c)),
        ("B to C by `dynamic_adapt`: joint 4 [deg/s]", "102 to 27", moved(speed_b, speed_d)),
    ]
    head = ("from test to test", "thesis", "here", "appears")
    return table(head, [(what, was, now, "yes" if true else "no") for what, was, (now, true) in rows])


def rivals() -> str:
    """Compare the twist decomposition with the SQP on every path, both from the start of the case."""
    rows: list[Sequence[object]] = []
    cases = [(build.__name__, build()) for build in huo.BUILDERS]
    cases.append(("m710_cylinders, 60 deg", huo.m710_cylinders(np.pi / 3)))
    for label, case in cases:
        puma = case.name == "puma_pipe"
        # The limits of the PUMA's file are not those of the thesis.
        solvers: dict[str, Solver] = {"SQP": condition_and_limits(case, limits=not puma)}
        if puma:
            solvers["TWA"] = puma_solver(case, rd.TwistDecomposition)
        else:
            pull = SPHERE if case.name == "m16ib_sphere_edge" else rd.PosturePull(EVEN, EVEN)
            found = adapt(case)
            pulls = {"TWA": pull, "TWA, `self_adapt`": rd.PosturePull(found.w, found.k)}
            for name, pull in pulls.items():
                solvers[name] = rd.TwistDecomposition(case.robot, case.task, pull, iterations=ITERATIONS)
        rows += [(label, name, *rival(solver, case, puma)) for name, solver in solvers.items()]
    head = ("path", "method", "iterations a point", "time a point [us]", "kappa_F, last", "mean", "largest")
    return table((*head, "second differences of q, rms [rad]", "smallest distance to a limit [rad]"), rows)


def rival(solver: Solver, case: huo.Case, unlimited: bool) -> tuple[str, ...]:
    """Return what a method needs for a path, the median time of five runs, and what it makes of it."""
    spent = []
    for _ in range(5):
        begin = time.perf_counter()
        found = run(solver, case)
        spent.append(time.perf_counter() - begin)
    kappa = rd.ConditionNumber(1.0).evaluate_many(case.robot, found.q, 0)[0]
    bend = float(np.sqrt((np.diff(found.q, 2, axis=0) ** 2).mean()))
    effort = (f"{found.iterations / len(found):.1f}", f"{1e6 * np.median(spent) / len(found):.0f}")
    indices = [f"{x:.2f}" for x in (kappa[-1], kappa.mean(), kappa.max())]
    return *effort, *indices, f"{bend:.1e}", "" if unlimited else f"{found.limit_margin:.2f}"


SECTIONS: tuple[Callable[[], str], ...]
SECTIONS = (puma, errors, sphere, times, tests, steps, adaptation, geometries, dynamic, claims, rivals)


def main(arguments: list[str]) -> int:
    """Print the tables; with --write, put them into the page and draw the pictures."""
    write = "--write" in arguments
    show(PAGE, ((section.__name__, section()) for section in SECTIONS), write)
    if write:
        draw(IMAGES)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
