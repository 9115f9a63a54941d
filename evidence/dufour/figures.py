"""The pictures of docs/reproduction_dufour.md."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import SubFigure
from numpy.typing import ArrayLike
from redundancy.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, Axes, Figure, mpl, save

from evidence.dufour import cases as duf
from evidence.dufour.derivatives import bfgs, differences, relative
from evidence.dufour.runs import (
    BALL_ALPHA,
    F64,
    INDEX,
    NAMES,
    Motion,
    beside_ball,
    best,
    compared,
    enough,
    follow,
    named,
    normalised,
    printed_form,
    program,
    searched,
    single,
    tried,
)

TIME = duf.TICK * np.arange(round(duf.DURATION / duf.TICK) + 1)
COLORS = {"no resolution": GREY, "(7)": BLACK, "(10), no deviation": GREEN, "(10)": BLUE, "(14)": ORANGE}
SIDE, FRONT, TOP = (0, 2), (1, 2), (0, 1)
AXES = "xyz"


def draw(folder: Path) -> None:
    """Draw every picture."""
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, figure in {
            "dufour_line": _comparison("T1"),
            "dufour_taught": _comparison("T2"),
            "dufour_influence": _influence(),
            "dufour_final": _final(),
            "dufour_ball": _ball(),
            "dufour_goal": _goal(),
            "dufour_tasks": _tasks(),
            "dufour_convexity": _convexity(),
            "dufour_derivatives": _derivatives(),
        }.items():
            save(figure, folder / f"{name}.svg")


def _label(name: str, factor: float) -> str:
    if name == "no resolution":
        return name
    return rf"{name}, ${'k_0' if name == '(7)' else chr(92) + 'alpha'} = {power(factor)}$"


def power(value: float) -> str:
    """Return a number as a power of ten with a factor, in TeX."""
    exponent = int(np.floor(np.log10(value) + 1e-9))
    factor = f"{value / 10.0**exponent:.1f}"
    if exponent < 3:
        return f"{value:.3g}"
    return f"10^{exponent}" if factor == "1.0" else rf"{factor}\cdot 10^{exponent}"


def _comparison(name: str) -> Figure:
    """Draw profiles and hand paths of scenario 1 or 2 (fig. 3 and 4)."""
    case = named(name)
    figure = Figure(figsize=(7.2, 6.4), layout="constrained")
    upper, lower = _halves(figure, [1.0, 1.2])
    profiles, paths = upper.subplots(), lower.subplots(1, 2)
    for label, (factor, motion) in compared(name).items():
        line = "--" if label == "(14)" else "-"
        profiles.plot(TIME, normalised(motion.q), color=COLORS[label], linestyle=line, label=_label(label, factor))
    profiles.set(xlabel="time [s]", ylabel="normalised manipulability", ylim=(0.0, 1.0), xlim=(0.0, duf.DURATION))
    profiles.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    for axes, view in zip(paths, (SIDE, FRONT), strict=True):
        for label in ("(7)", "(10)", "(14)"):
            hand = duf.robot().fk(compared(name)[label][1].q)[:, :3, 3]
            line = "--" if label == "(14)" else "-"
            axes.plot(*hand[:, view].T, color=COLORS[label], linestyle=line, label=label)
        axes.plot(*case.path.position[:, view].T, color=PURPLE, linewidth=4.0, alpha=0.4, zorder=1, label="reference")
        _ends(axes, case.path.position[:, view])
        axes.set(xlabel=f"{AXES[view[0]]} [m]", ylabel=f"{AXES[view[1]]} [m]")
        axes.set_aspect("equal", adjustable="datalim")
    paths[0].set_title("hand, from the side", loc="left", fontsize=9.0)
    paths[1].set_title("hand, from the front", loc="left", fontsize=9.0)
    paths[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _halves(figure: Figure, heights: list[float]) -> tuple[SubFigure, SubFigure]:
    """Divide a figure into an upper and a lower half, each with columns of its own."""
    upper, lower = np.ravel(np.array(figure.subfigures(2, 1, height_ratios=heights)))
    return upper, lower


def _ends(axes: Axes, points: F64) -> None:
    axes.plot(*points[0], "o", color=PURPLE, markersize=6.0, zorder=5)
    axes.plot(*points[-1], "*", color=PURPLE, markersize=11.0, zorder=5)


SHOWN_ALPHA = (1e3, 1e4, 1e5)


def _influence() -> Figure:
    """Draw what alpha does to scenario 2: profiles and deviations (fig. 4)."""
    figure = Figure(figsize=(7.2, 5.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    motions = tried("T2", "curvature")
    for alpha, color in zip(SHOWN_ALPHA, (SKY, GREEN, BLUE), strict=True):
        motion, label = motions[_nearest(motions, alpha)], rf"(10), $\alpha = {power(alpha)}$"
        for panel, values in zip(panels, _curves(motion), strict=True):
            panel.plot(TIME, values, color=color, label=label)
    gain, seven = compared("T2")["(7)"]
    for panel, values in zip(panels, _curves(seven), strict=True):
        panel.plot(TIME, values, color=BLACK, label=_label("(7)", gain))
    panels[0].set(ylabel="normalised\nmanipulability", ylim=(0.0, 1.0), xlim=(0.0, duf.DURATION))
    panels[1].set(ylabel="deviation [mm]")
    panels[2].set(ylabel="deviation [deg]", xlabel="time [s]")
    panels[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.align_ylabels()
    return figure


def _nearest(factors: Iterable[float], wanted: float) -> float:
    return min(factors, key=lambda factor: abs(np.log(factor / wanted)))


def _curves(motion: Motion) -> tuple[F64, F64, F64]:
    return normalised(motion.q), 1e3 * motion.position_error, np.rad2deg(motion.axis_error)


def _arm(axes: Axes, q: ArrayLike, view: tuple[int, int], color: str, label: str = "", alpha: float = 1.0) -> None:
    """Draw the arm as a stick figure."""
    points = np.vstack([np.zeros(3), duf.robot().link_frames(q)[:, :3, 3]])
    axes.plot(
        *points[:, view].T,
        "-o",
        color=color,
        linewidth=3.0,
        markersize=4.0,
        solid_capstyle="round",
        alpha=alpha,
        label=label,
    )


def _views(axes: Sequence[Axes], views: Sequence[tuple[int, int]]) -> None:
    names = {SIDE: "from the side", FRONT: "from the front", TOP: "from above"}
    for panel, view in zip(axes, views, strict=True):
        panel.set(xlabel=f"{AXES[view[0]]} [m]", ylabel=f"{AXES[view[1]]} [m]")
        panel.set_aspect("equal", adjustable="datalim")
        panel.set_title(names[view], loc="left", fontsize=9.0)


def _final() -> Figure:
    """Draw the last postures of scenario 2 (fig. 5)."""
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    panels = figure.subplots(1, 2)
    for panel, view in zip(panels, (SIDE, TOP), strict=True):
        case = named("T2")
        assert case.taught is not None
        _arm(panel, case.taught[-1], view, GREY, "taught", 0.7)
        for label in ("(7)", "(10)"):
            _arm(panel, compared("T2")[label][1].q[-1], view, COLORS[label], label, 0.8)
        panel.plot(*case.path.position[:, view].T, color=PURPLE, alpha=0.5, label="reference")
        _ends(panel, case.path.position[:, view])
    _views(panels, (SIDE, TOP))
    panels[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _ball() -> Figure:
    """Draw distances and manipulability of scenario 3, and the arm where it would hit the ball (fig. 7 and 8)."""
    figure = Figure(figsize=(7.2, 8.0), layout="constrained")
    upper, lower = _halves(figure, [1.0, 0.9])
    panels = upper.subplots(2, 1, sharex=True)
    scene, alpha = duf.ball_scene(duf.elbow_ball()), BALL_ALPHA[1]
    free = follow(program("curvature", alpha), duf.vertical_line())
    for factor, color in zip(BALL_ALPHA, (GREY, BLUE), strict=True):
        motion = beside_ball(factor)
        assert motion.distance is not None
        label = rf"(10), $\alpha = {power(factor) if factor else 0}$"
        panels[0].plot(TIME, 1e3 * motion.distance, color=color, label=label)
        panels[1].plot(TIME, normalised(motion.q), color=color)
    distance = np.array([scene.distance(q) for q in free.q])
    label = rf"(10), $\alpha = {power(alpha)}$, no ball"
    panels[0].plot(TIME, 1e3 * distance, color=ORANGE, linestyle="--", label=label)
    panels[1].plot(TIME, normalised(free.q), color=ORANGE, linestyle="--")
    for value, name in ((duf.INFLUENCE, "$d_i$"), (duf.SECURITY, "$d_s$")):
        panels[0].axhline(1e3 * value, color=BLACK, linewidth=1.0, linestyle=":")
        panels[0].annotate(name, (0.05, 1e3 * value), va="bottom")
    panels[0].set(ylabel="smallest distance [mm]", xlim=(0.0, duf.DURATION), ylim=(-85.0, 125.0))
    panels[1].set(xlabel="time [s]", ylabel="normalised\nmanipulability", ylim=(0.0, 1.0))
    panels[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    upper.align_ylabels()
    at = int(distance.argmin())
    views = lower.subplots(1, 2)
    for panel, view in zip(views, (SIDE, FRONT), strict=True):
        _sphere(panel, duf.elbow_ball(), view)
        _arm(panel, free.q[at], view, ORANGE, "no ball", 0.8)
        _arm(panel, beside_ball(alpha).q[at], view, BLUE, "with the ball", 0.8)
    _views(views, (SIDE, FRONT))
    lower.suptitle(rf"arm at {TIME[at]:.2f} s, $\alpha = {power(alpha)}$", fontsize=9.0)
    views[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _sphere(axes: Axes, center: F64, view: tuple[int, int]) -> None:
    axes.add_patch(mpl.patches.Circle(tuple(center[list(view)]), duf.BALL, color=GREEN, alpha=0.35, linewidth=0.0))


def _goal() -> Figure:
    """Draw what comes of a ball at the goal."""
    figure = Figure(figsize=(7.2, 5.8), layout="constrained")
    upper, lower = _halves(figure, [0.7, 1.0])
    panels, views = upper.subplots(1, 2), lower.subplots(1, 2)
    for alpha, color in zip(BALL_ALPHA, (GREY, BLUE), strict=True):
        motion = beside_ball(alpha, at_goal=True)
        assert motion.distance is not None
        time, label = duf.TICK * np.arange(len(motion.q)), rf"$\alpha = {power(alpha) if alpha else 0}$"
        panels[0].plot(time, 1e3 * motion.distance, color=color, label=label)
        panels[1].plot(time, 1e3 * motion.position_error, color=color, label=label)
        for panel, view in zip(views, (SIDE, FRONT), strict=True):
            _arm(panel, motion.q[-1], view, color, label, 0.8)
    panels[0].axhline(1e3 * duf.SECURITY, color=BLACK, linewidth=1.0, linestyle=":")
    panels[0].annotate("$d_s$", (0.05, 1e3 * duf.SECURITY), va="bottom")
    panels[0].set(ylabel="distance to the ball [mm]", xlabel="time [s]", ylim=(0.0, None))
    panels[1].set(ylabel="hand off the path [mm]", xlabel="time [s]", ylim=(0.0, None))
    for panel, view in zip(views, (SIDE, FRONT), strict=True):
        _sphere(panel, duf.goal_ball(), view)
        panel.plot(*duf.vertical_line().path.position[:, view].T, color=PURPLE, alpha=0.5)
        _ends(panel, duf.vertical_line().path.position[:, view])
    _views(views, (SIDE, FRONT))
    panels[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _tasks() -> Figure:
    """Draw both formulae along every task (fig. 9), and their means against alpha."""
    figure = Figure(figsize=(7.2, 8.4), layout="constrained")
    panels = figure.subplots(5, 2, sharex="col", width_ratios=[1.3, 1.0])
    equal, _ = single()
    for (left, right), name in zip(panels, NAMES, strict=True):
        ten, fourteen = tried(name, "curvature"), tried(name, "equality")
        left.plot(TIME, normalised(searched(name)[best(searched(name))].q), color=BLACK, label="(7), best $k_0$")
        left.plot(TIME, normalised(ten[enough(ten)].q), color=BLUE, label=r"(10), best $\alpha$")
        label = rf"(14), $\alpha = {power(equal)}$"
        left.plot(TIME, normalised(fourteen[equal].q), color=ORANGE, linestyle="--", label=label)
        left.set(ylim=(0.0, 1.0), ylabel=name, xlim=(0.0, duf.DURATION))
        for motions, color, line in ((ten, BLUE, "-"), (fourteen, ORANGE, "--")):
            factors = np.array(list(motions))
            means = np.array([motion.mean for motion in motions.values()])
            fit = np.array([motion.fit for motion in motions.values()])
            right.plot(factors, means, color=color, linestyle=line, linewidth=1.0)
            right.plot(factors[fit], means[fit], "o", color=color, markersize=3.5)
            right.plot(factors[~fit], means[~fit], "x", color=color, markersize=4.0)
        right.set(xscale="log")
    panels[0][0].set_title("normalised manipulability", loc="left", fontsize=9.0)
    panels[0][1].set_title(r"its mean; $\times$: not steady, or off the goal", loc="left", fontsize=9.0)
    panels[-1][0].set_xlabel("time [s]")
    panels[-1][1].set_xlabel(r"$\alpha$")
    figure.legend(*panels[0][0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return figure


PRINTED_ALPHA = tuple(float(x) for x in np.geomspace(1e3, 1e7, 13))


def _convexity() -> Figure:
    """Draw at how many ticks (10) as printed is no longer convex."""
    figure = Figure(figsize=(6.5, 3.2), layout="constrained")
    axes = figure.subplots()
    for name, color in zip(NAMES, (BLUE, ORANGE, GREEN, PURPLE, SKY), strict=True):
        shares = [100.0 * printed_form(name, alpha) for alpha in PRINTED_ALPHA]
        axes.plot(PRINTED_ALPHA, shares, "-o", color=color, markersize=3.5, label=f"(10) as printed, {name}")
    axes.plot(PRINTED_ALPHA, np.zeros(len(PRINTED_ALPHA)), color=BLACK, linestyle="--", label="(14), all")
    axes.axvspan(5e4, 1.2e5, color=GREY, alpha=0.2, linewidth=0.0, label="table 1")
    axes.set(xscale="log", xlabel=r"$\alpha$", ylabel="ticks not convex [%]", ylim=(-3.0, 103.0))
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _derivatives() -> Figure:
    """Draw the errors of gradients and Hessians along the motion of scenario 1."""
    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    q = compared("T1")["(10)"][1].q
    _, gradient, hessian = INDEX.evaluate_many(duf.robot(), q, 2)[:3]
    assert gradient is not None
    assert hessian is not None
    for step, color in ((1e-3, SKY), (1e-4, BLUE)):
        found = differences(q, step)
        label = rf"(17), (19), $\delta q = {'10^{-3}' if step == 1e-3 else '10^{-4}'}$"
        panels[0].semilogy(TIME, relative(found[0], gradient), color=color, label=label)
        panels[1].semilogy(TIME, relative(found[1], hessian), color=color, label=label)
    panels[1].semilogy(TIME, relative(-bfgs(q)[0], hessian), color=ORANGE, label="BFGS, direct update")
    panels[1].semilogy(TIME, relative(-bfgs(q, True)[0], hessian), color=PURPLE, label="BFGS, (20) as printed")
    panels[0].set(ylabel="error of the gradient")
    panels[1].set(ylabel="error of the Hessian", xlabel="time [s]", xlim=(0.0, duf.DURATION))
    panels[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.align_ylabels()
    return figure
