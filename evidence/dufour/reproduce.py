"""The scenarios of Dufour and Suleiman (2020): ``python -m evidence.dufour.reproduce [--write]``.

Prints the tables of docs/reproduction_dufour.md, each between two marks. With --write it puts them into the page and
draws its pictures. Times are of the machine that runs it.
"""

import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from evidence.dufour import cases as duf
from evidence.dufour.derivatives import bfgs, differences, relative
from evidence.dufour.figures import PRINTED_ALPHA, draw
from evidence.dufour.runs import (
    BALL_ALPHA,
    EQUALITY,
    INDEX,
    NAMES,
    STEADY,
    Derivatives,
    Form,
    beside_ball,
    best,
    compared,
    enough,
    follow,
    indefinite,
    largest_manipulability,
    named,
    oscillates_from,
    printed_form,
    program,
    random_balls,
    random_postures,
    rest,
    searched,
    single,
    sweep,
    tried,
)
from evidence.pages import DOCS, IMAGES, show, table

F64 = NDArray[np.float64]

PAGE = DOCS / "reproduction_dufour.md"


def factor(value: float) -> str:
    """Return k_0 or alpha with two digits."""
    return f"{value:.1e}".replace("e+0", "e") if value >= 1e3 else f"{value:.3g}"


def error(value: float) -> str:
    """Return an error with two digits; what is rounding alone alike on every machine."""
    return "below 1e-9" if value < 1e-9 else f"{value:.1e}"


def cases() -> str:
    """Describe the five paths."""
    rows = []
    for case in duf.cases():
        start = ", ".join(f"{x:.2f}" for x in case.start)
        ends = (f"({', '.join(f'{x:.3f}' for x in point)})" for point in case.path.position[[0, -1]])
        rows.append((case.name, case.about, start, *ends))
    maximum = f"Largest manipulability found within limits: {largest_manipulability():.6f}."
    return table(("task", "path", "start posture [rad]", "hand from [m]", "to"), rows) + "\n\n" + maximum


def scenario(name: str) -> str:
    """Compare the formulae on a path."""
    rows = []
    for label, (value, m) in compared(name).items():
        ends = f"{error(m.position_error[-1])}, {error(m.axis_error[-1])}"
        moved = f"{1e3 * m.position_error.max():.1f}, {np.rad2deg(m.axis_error.max()):.1f}"
        rates = f"{np.abs(m.rates).max():.1f}, {m.acceleration:.1f}"
        rows.append((label, factor(value) if value else "", f"{m.mean:.3f}", f"{m.least:.3f}", moved, ends, rates))
    head = ("formula", "k_0 or alpha", "mean of m / max", "smallest", "largest deviation [mm, deg]")
    return table((*head, "error at the goal [m, rad]", "fastest joint [rad/s], acceleration, rms [rad/s^2]"), rows)


def line() -> str:
    """Compare scenario 1 (fig. 3)."""
    return scenario("T1")


def taught() -> str:
    """Compare scenario 2 (fig. 4)."""
    return scenario("T2")


def influence() -> str:
    """Tell what alpha does to the deviations (fig. 4b)."""
    rows: list[Sequence[object]] = []
    for alpha, m in tried("T2", "curvature").items():
        if abs(2.0 * np.log10(alpha) - round(2.0 * np.log10(alpha))) < 1e-9:
            distance, angle = 1e3 * m.position_error, np.rad2deg(m.axis_error)
            cells = (f"{m.mean:.3f}", f"{m.least:.3f}", f"{distance.mean():.0f}, {distance.max():.0f}")
            rows.append((factor(alpha), *cells, f"{angle.mean():.1f}, {angle.max():.1f}", f"{m.acceleration:.0f}"))
    head = ("alpha", "mean of m / max", "smallest", "deviation, mean, largest [mm]", "mean, largest [deg]")
    return table((*head, "acceleration, rms [rad/s^2]"), rows)


def ball() -> str:
    """Compare scenario 3 (fig. 8), the ball at the goal, and random balls."""
    rows: list[Sequence[object]] = []
    for at_goal in (False, True):
        scene = duf.ball_scene(duf.goal_ball() if at_goal else duf.elbow_ball())
        for alpha in BALL_ALPHA:
            motion = beside_ball(alpha, at_goal)
            free = follow(program("curvature", alpha), duf.vertical_line())
            hit = min(scene.distance(q) for q in free.q)
            assert motion.distance is not None
            swept = sweep(scene, motion.q).min() - duf.SECURITY
            bare = sweep(scene, beside_ball(alpha, at_goal, margin=0.0).q).min() - duf.SECURITY
            held = np.abs(motion.rates[-1]).max()
            cells = [f"{1e3 * hit:.1f}", f"{1e6 * (motion.distance.min() - duf.SECURITY):.2f}", f"{1e6 * swept:.2f}"]
            off = rest(motion, scene)[1] if at_goal else float("nan")
            rows.append(
                (
                    "at the goal" if at_goal else "near the elbow",
                    factor(alpha),
                    *cells,
                    f"{1e6 * bare:.4f}",
                    f"{1e3 * motion.position_error[-1]:.2f}",
                    f"{motion.mean:.3f}",
                    "" if not at_goal else f"{held:.0e}, {off:.0e}",
                )
            )
    head = ("ball", "alpha", "smallest distance without the constraint [mm]", "with it, less d_s, at ticks [um]")
    more = ("swept [um]", "swept, no margin [um]", "hand from the goal at the end [mm]", "mean of m / max")
    return table((*head, *more, "rate at the end [rad/s], distance from optimality"), rows)


def balls() -> str:
    """Tell what came of random balls."""
    rows = []
    for margin in (duf.MARGIN, 0.0):
        for alpha in BALL_ALPHA:
            found = random_balls(alpha, margin=margin)
            cells = [f"{1e6 * x:.4f}" for x in (found.ticks, found.swept)]
            rows.append(
                (f"{1e6 * margin:g}", factor(alpha), found.number, *cells, found.free, found.reached, found.infeasible)
            )
    head = ("margin [um]", "alpha", "balls", "smallest distance less d_s, at ticks [um]", "swept [um]")
    return table((*head, "goal free", "goal reached", "with infeasible ticks"), rows)


def tasks() -> str:
    """Compare table 1 and fig. 9."""
    equal, ratios = single()
    printed = ("50 000", "70 000", "70 000", "120 000", "90 000")
    rows = []
    for name, ratio, was in zip(NAMES, ratios, printed, strict=True):
        ten, fourteen = tried(name, "curvature"), tried(name, "equality")
        seven = searched(name)[best(searched(name))]
        top, used = best(ten), enough(ten)
        cells = [f"{x.mean:.3f}" for x in (seven, ten[used], ten[top], fourteen[equal])]
        against = f"{ratio - 1.0:+.1%}"
        rows.append((name, was, factor(used), factor(top), *cells, against, f"{least_ratio(name, equal):+.1%}"))
    head = ("task", "alpha of (10), printed", "alpha of (10), 99 %", "of the largest mean", "mean, (7)", "(10), 99 %")
    text = f"Single alpha of (14): {factor(equal)} (printed: 5e5)."
    return table((*head, "(10), largest", "(14)", "(14) from (10)'s largest", "smallest m, (14) from (10)"), rows) + (
        "\n\n" + text
    )


def least_ratio(name: str, alpha: float) -> float:
    """Return how far the smallest m of (14) is from that of (10) with 99 % of its largest mean."""
    ten = tried(name, "curvature")
    return tried(name, "equality")[alpha].least / ten[enough(ten)].least - 1.0


SETTINGS: tuple[tuple[float, tuple[float, float] | None], ...] = (
    (1.0, (0.05, 0.025)),
    (1.0, duf.TUBE),
    (1.0, (0.2, 0.1)),
    (1.0, None),
    (10.0, (0.05, 0.025)),
    (10.0, duf.TUBE),
    (10.0, (0.2, 0.1)),
    (10.0, None),
)
"""Q_low and bounds of the deviation with which the single alpha is sought."""


def settings() -> str:
    """Tell how the single alpha of (14) depends on Q_low and the bounds of the deviation."""
    rows = []
    for low, tube in SETTINGS:
        alpha, ratios = single(low, tube)
        own = [enough(tried(name, "curvature", low, tube)) for name in NAMES]
        farthest = max(tried(name, "equality", low, tube)[alpha].position_error.max() for name in NAMES)
        bounds = "none" if tube is None else f"{1e3 * tube[1]:.0f} mm, {tube[0]:g} rad"
        cells = ", ".join(f"{ratio - 1.0:+.1%}" for ratio in ratios)
        spread = f"{factor(min(own))} to {factor(max(own))}"
        met = "yes" if min(ratios) >= 0.95 else "**no**"
        rows.append((f"{low:g}", bounds, spread, factor(alpha), cells, met, f"{1e3 * farthest:.0f}"))
    head = (
        "Q_low",
        "bounds of a component",
        "alpha of (10), 99 %",
        "alpha of (14)",
        "(14) from (10)'s largest, T1 to T5",
    )
    return table((*head, "within 5 %", "largest deviation of (14) [mm]"), rows)


def convexity() -> str:
    """Compare claim 1: at how many ticks the programme is not convex."""
    rows = []
    for alpha in PRINTED_ALPHA[::2]:
        shares = [f"{printed_form(name, alpha):.0%}, {indefinite(name, alpha):.0%}" for name in NAMES]
        rows.append((factor(alpha), *shares))
    status = [s for name in NAMES for motion in tried(name, "equality").values() for s in motion.status]
    bad = sum(s in ("infeasible", "not convex") for s in status)
    text = f"Of {len(status)} ticks of (14) with alpha from {factor(EQUALITY[0])} to {factor(EQUALITY[-1])},"
    text += f" {bad} are not convex or infeasible."
    status = [s for name in NAMES for motion in tried(name, "curvature").values() for s in motion.status]
    bad = sum(s in ("infeasible", "not convex") for s in status)
    text += f" Of {len(status)} of (10) with what is convex of the curvature, {bad}."
    return table(("alpha", *NAMES), rows) + "\n\n" + text


FORMS: tuple[Form, ...] = ("curvature", "equality")


def oscillations() -> str:
    """Tell from which alpha on motions oscillate."""
    rows = []
    for name in NAMES:
        cells = []
        for form in FORMS:
            motions = tried(name, form)
            steady = max(alpha for alpha, motion in motions.items() if motion.acceleration <= STEADY)
            rough = [alpha for alpha in motions if alpha > steady]
            worst = max(motion.acceleration for motion in motions.values())
            cells += [factor(min(rough)) if rough else f"above {factor(steady)}", f"{worst:.0f}"]
        rows.append((name, *cells, factor(oscillates_from(tried(name, "equality")[single()[0]]))))
    head = ("task", "(10) from alpha", "largest acceleration, rms [rad/s^2]", "(14) from alpha")
    return table((*head, "largest acceleration, rms [rad/s^2]", "(14), foretold"), rows)


def derivatives() -> str:
    """Compare errors of gradients and Hessians."""
    robot, ten = duf.robot(), compared("T1")["(10)"][1].q
    past = named("T2").taught
    assert past is not None
    rows: list[Sequence[object]] = []
    for where, q in (("random postures", random_postures()), ("scenario 1, (10)", ten), ("scenario 2 as taught", past)):
        _, gradient, hessian = INDEX.evaluate_many(robot, q, 2)[:3]
        assert gradient is not None
        assert hessian is not None
        for step in (1e-3, 1e-4, 1e-5):
            found = differences(q, step)
            cells = (spread(relative(found[0], gradient)), spread(relative(found[1], hessian)))
            rows.append((where, f"(17), (19), {step:.0e} rad", *cells, ""))
        if where != "random postures":
            for label, printed in (("BFGS, direct update", False), ("BFGS, (20) as printed", True)):
                matrix, learnt = bfgs(q, printed)
                rows.append((where, label, "exact", spread(relative(-matrix, hessian)[2:]), f"{learnt:.0%}"))
    head = ("where", "how", "error of the gradient, median, largest", "of the Hessian", "ticks at which BFGS learns")
    return table(head, rows)


def spread(values: F64) -> str:
    """Return the median and the largest."""
    return f"{np.median(values):.0e}, {values.max():.0e}"


def clock(call: Callable[[F64], object], postures: F64, repeats: int = 5) -> float:
    """Return the median time of a call [us]."""
    spent = []
    for q in np.tile(postures, (repeats, 1)):
        begin = time.perf_counter_ns()
        call(q)
        spent.append(time.perf_counter_ns() - begin)
    return float(np.median(spent)) / 1e3


DERIVATIVES: tuple[Derivatives, ...] = ("exact", "bfgs", "differences")


COSTS: tuple[tuple[str, Form, Derivatives], ...] = (
    ("(10)", "curvature", "exact"),
    ("(10)", "curvature", "bfgs"),
    ("(10)", "curvature", "differences"),
    ("(14)", "equality", "exact"),
    ("(14)", "equality", "differences"),
)


def costs() -> str:
    """Compare what derivatives cost, and what they do to the motion (fig. 6)."""
    q, twist, out = tried("T1", "curvature")[1e5].q[:-1], np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.1]), np.empty(7)

    def step(solver: rd.QuadraticProgram, postures: F64 = q) -> float:
        return clock(lambda posture: solver.step(posture, twist, out, stiffness=duf.HIGH), postures)

    bounds = (duf.TUBE[0] / duf.TICK, duf.TUBE[1] / duf.TICK)
    plain = step(rd.QuadraticProgram(duf.robot(), rd.Task.full(), dt=duf.TICK, largest_deviation=bounds))
    seven = rd.GradientProjection(duf.robot(), rd.Task.full(), -1.0 * INDEX, length=1.0, dt=duf.TICK)
    rows: list[Sequence[object]] = [
        ("(7)", "exact", f"{clock(lambda posture: seven.step(posture, twist, out), q):.1f}", "", "", ""),
        ("(3)", "none", f"{plain:.1f}", "", "", ""),
    ]
    for label, form, how in COSTS:
        weight = 1e5 if form == "curvature" else single()[0]
        spent = step(program(form, weight, derivatives=how))
        motions = [follow(program(form, weight, derivatives=how), named(name)) for name in ("T1", "T2")]
        means = [f"{motion.mean:.5f}, {motion.acceleration:.1f}" for motion in motions]
        rows.append((label, how, f"{spent:.1f}", f"{spent - plain:.1f}", *means))
    spent = step(program("curvature", 1e5, scene=duf.ball_scene(duf.elbow_ball())), beside_ball(1e5).q[:-1])
    rows.append(("(10), ball near the elbow", "exact", f"{spent:.1f}", f"{spent - plain:.1f}", "", ""))
    head = ("formula", "derivatives", "a step [us]", "more than (3)'s [us]")
    return table((*head, "T1: mean of m / max, acceleration, rms [rad/s^2]", "T2"), rows)


def bars() -> str:
    """Tell which of the paper's claims appear."""
    rows = []

    def bar(what: str, paper: str, here: str, met: bool) -> None:
        rows.append((what, paper, here, "yes" if met else "**no**"))

    for name, number in (("T1", 1), ("T2", 2)):
        m = {label: motion for label, (_, motion) in compared(name).items()}
        seven = m["(7)"]
        for label in ("(10)", "(14)"):
            met = m[label].reached and seven.reached and m[label].mean > seven.mean
            means = f"{m[label].mean:.3f} against {seven.mean:.3f}"
            bar(f"scenario {number}: mean of m / max, {label} above (7), same last pose", "yes", means, met)
    far, near = compared("T2")["(10)"][1].least, compared("T2")["(7)"][1].least
    bar("scenario 2: (10) leaves the singularity", "yes", f"smallest m / max {far:.2f} against {near:.2f}", far > 0.1)
    alphas = [enough(tried(name, "curvature")) for name in NAMES]
    between = f"{factor(min(alphas))} to {factor(max(alphas))}"
    bar("(10): best alpha depends on the task", "50 000 to 120 000", between, min(alphas) < max(alphas))
    ratios = single()[1]
    between = f"{min(ratios) - 1.0:+.1%} to {max(ratios) - 1.0:+.1%}"
    bar("(14): one alpha within 5 % of (10)'s best", "-3 to -5 %", between, min(ratios) >= 0.95)
    share = max(printed_form(name, 1e6) for name in NAMES)
    count = sum(any(printed_form(name, alpha) > 0.0 for alpha in PRINTED_ALPHA) for name in NAMES)
    here = f"{count} of 5 tasks up to 1e7; at 1e6 at most {share:.0%} of ticks"
    bar("(10) as printed loses convexity with alpha", "yes", here, share > 0.0)
    motions = [motion for name in NAMES for motion in tried(name, "equality").values()]
    bad = sum(status in ("infeasible", "not convex") for motion in motions for status in motion.status)
    bar("(14) stays convex and feasible", "yes", f"{bad} ticks are not, alpha up to {factor(EQUALITY[-1])}", bad == 0)
    beyond = max(motion.acceleration for motion in motions)
    bar("(14) does not oscillate for large alpha", "yes", f"rms up to {beyond:.0f} rad/s^2", beyond <= STEADY)
    for at_goal in (False, True):
        scene = duf.ball_scene(duf.goal_ball() if at_goal else duf.elbow_ball())
        found = [beside_ball(alpha, at_goal) for alpha in BALL_ALPHA]
        least = min(sweep(scene, motion.q).min() for motion in found) - duf.SECURITY
        where = "at the goal" if at_goal else "near the elbow"
        bar(f"ball {where}: never below d_s, swept at 10 kHz", "yes", f"{1e6 * least:+.2f} um", least >= 0.0)
        if at_goal:
            off = max(rest(motion, scene)[1] for motion in found)
            still = max(float(np.abs(motion.rates[-1]).max()) for motion in found)
            here = f"{off:.0e} from optimality, {still:.0e} rad/s"
            bar("ball at the goal: nearest safe pose held", "yes", here, off < 1e-3 and still < 1e-3)
        else:
            off = 1e3 * max(motion.position_error[-1] for motion in found)
            bar("ball near the elbow: goal reached", "yes", f"{off:.2f} mm", all(motion.reached for motion in found))
    return table(("claim", "paper", "here", "appears"), rows)


SECTIONS: tuple[Callable[[], str], ...]
SECTIONS = (
    bars,
    cases,
    line,
    taught,
    influence,
    ball,
    balls,
    tasks,
    settings,
    convexity,
    oscillations,
    derivatives,
    costs,
)


def main(arguments: list[str]) -> int:
    """Print the tables; with --write, put them into the page and draw the pictures."""
    write = "--write" in arguments
    show(PAGE, ((section.__name__, section()) for section in SECTIONS), write)
    if write:
        draw(IMAGES)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
