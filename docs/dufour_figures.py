"""What is computed for docs/reproduction_dufour.md, by `reproduce_dufour.py`: the motions and their pictures."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Literal

import dufour_cases as duf
import numpy as np
import redundancy as rd
from matplotlib.figure import SubFigure
from numpy.typing import ArrayLike, NDArray
from redundancy._plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, Axes, Figure, mpl, save

F64 = NDArray[np.float64]
Form = Literal["curvature", "equality", "printed"]
Derivatives = Literal["exact", "bfgs", "differences"]

INDEX = rd.Manipulability()
"""m of (5), in SI units."""

FULL = rd.Task.full()

SAME_POSE = 5e-4
"""Distance [m] and angle [rad] from the goal with which a motion counts as having reached it."""

STEADY = 30.0
"""Root mean square of the joint accelerations [rad/s^2] up to which a motion counts as free from oscillations."""

GAINS = tuple(float(x) for x in np.geomspace(1.0, 1e4, 25))
"""k_0 that are tried for (7) [1/s]."""

CURVATURE = tuple(float(x) for x in 10.0 ** (3.0 + np.arange(19) / 6.0))
"""alpha that are tried for (10)."""

EQUALITY = tuple(float(x) for x in 10.0 ** (4.0 + np.arange(19) / 6.0))
"""alpha that are tried for (14)."""

SUBTICKS = 100
"""Postures a tick that a sweep looks at: 10 kHz."""


@cache
def largest_manipulability(samples: int = 200_000, kept: int = 100) -> float:
    """Return the maximum of m within limits: the best of random postures, then climbed from."""
    robot, rng = duf.robot(), np.random.default_rng(0)
    q = rng.uniform(robot.q_min, robot.q_max, (samples, robot.n))
    value = INDEX.evaluate_many(robot, q, 0)[0]
    q = q[np.argsort(value)[-kept:]]
    for _ in range(200):
        value, gradient = INDEX.evaluate_many(robot, q, 1)[:2]
        assert gradient is not None
        tried = np.clip(q + np.geomspace(0.01, 3.0, 6)[:, None, None] * gradient, robot.q_min, robot.q_max)
        found = np.stack([INDEX.evaluate_many(robot, step, 0)[0] for step in tried])
        best = found.argmax(axis=0)
        better = found.max(axis=0) > value
        q[better] = tried[best, np.arange(kept)][better]
    return float(INDEX.evaluate_many(robot, q, 0)[0].max())


def normalised(q: F64) -> F64:
    """Return m over its maximum."""
    values: F64 = INDEX.evaluate_many(duf.robot(), q, 0)[0] / largest_manipulability()
    return values


@dataclass(frozen=True, eq=False)
class Motion:
    """What came of following a case, tick by tick; lengths and units as in `redundancy.Tracking`."""

    q: F64
    rates: F64
    position_error: F64
    axis_error: F64
    status: tuple[str, ...] = ()
    distance: F64 | None = None

    @property
    def mean(self) -> float:
        """Mean of the normalised manipulability."""
        return float(normalised(self.q).mean())

    @property
    def least(self) -> float:
        """Smallest normalised manipulability."""
        return float(normalised(self.q).min())

    @property
    def reached(self) -> bool:
        """Whether it ends at the goal."""
        return bool(max(self.position_error[-1], self.axis_error[-1]) <= SAME_POSE)

    @property
    def acceleration(self) -> float:
        """Root mean square of the joint accelerations [rad/s^2]."""
        return float(np.sqrt((np.diff(self.rates, axis=0) ** 2).mean())) / duf.TICK

    @property
    def fit(self) -> bool:
        """Whether it ends at the goal without oscillations on the way."""
        return self.reached and self.acceleration <= STEADY


Bounds = tuple[float, float]


def program(
    form: Form,
    alpha: float,
    *,
    scene: rd.Scene | None = None,
    derivatives: Derivatives = "exact",
    tube: Bounds | None = duf.TUBE,
    margin: float = duf.MARGIN,
) -> rd.QuadraticProgram:
    """Return (10) or (14) with Q = I and bounds of the deviation; among obstacles with (A.1)."""
    return rd.QuadraticProgram(
        duf.robot(),
        FULL,
        -1.0 * INDEX,
        weight=alpha,
        form=form,
        derivatives=derivatives,
        dt=duf.TICK,
        largest_deviation=None if tube is None else (tube[0] / duf.TICK, tube[1] / duf.TICK),
        scene=scene,
        influence=duf.INFLUENCE,
        security=duf.SECURITY + margin,
        damping=duf.DAMPING,
    )


def profile(share: F64) -> F64:
    """Return the stiffness of fig. 1."""
    return rd.stiffness_profile(share, duf.LOW, duf.HIGH, duf.RAMP)


def follow(solver: rd.QuadraticProgram, case: duf.Case, *, low: float = duf.LOW, hold: float = 0.0) -> Motion:
    """Follow a case with a quadratic programme and the stiffness of fig. 1, whose end is that of the path."""
    moving = duf.DURATION / (duf.DURATION + hold)

    def stiffness(share: F64) -> F64:
        return rd.stiffness_profile(np.asarray(share) / moving, low, duf.HIGH, duf.RAMP)

    found = rd.track(solver, case.path, case.start, stiffness=stiffness, hold=hold, progress=False)
    distance = None if solver.scene is None else found.distance
    return Motion(found.q, found.rates, found.position_error, found.axis_error, tuple(found.status), distance)


def without_deviation(case: duf.Case, alpha: float) -> Motion:
    """Follow a case with (10) and Q_high throughout."""
    return follow(program("curvature", alpha), case, low=duf.HIGH)


def classical(case: duf.Case, gain: float) -> Motion:
    """Follow a case with (7): the pseudo-inverse, and k_0 times the gradient of m in its null space.

    `GradientProjection` descends, so the gradient of -m with a positive gain is (7).
    """
    solver = rd.GradientProjection(
        duf.robot(), FULL, -1.0 * INDEX if gain > 0.0 else None, gain=gain or 1.0, length=1.0, dt=duf.TICK
    )
    errors = program("curvature", 0.0)
    targets = case.path.targets(FULL)
    q, rates = np.empty((len(targets), 7)), np.empty((len(targets) - 1, 7))
    q[0] = case.start
    for k, target in enumerate(targets[1:]):
        solver.step(q[k], errors.twist_to(q[k], target), rates[k])
        q[k + 1] = q[k] + duf.TICK * rates[k]
    missing = duf.TICK * np.array([errors.twist_to(row, target) for row, target in zip(q, targets, strict=True)])
    return Motion(q, rates, np.linalg.norm(missing[:, 3:], axis=1), np.linalg.norm(missing[:, :3], axis=1))


@cache
def searched(name: str) -> dict[float, Motion]:
    """Follow a case with (7) and every k_0."""
    case = named(name)
    return {gain: classical(case, gain) for gain in GAINS}


@cache
def tried(name: str, form: Form, low: float = duf.LOW, tube: Bounds | None = duf.TUBE) -> dict[float, Motion]:
    """Follow a case with (10) or (14) and every alpha."""
    case = named(name)
    weights = EQUALITY if form == "equality" else CURVATURE
    return {alpha: follow(program(form, alpha, tube=tube), case, low=low) for alpha in weights}


def named(name: str) -> duf.Case:
    """Return one of T1 to T5."""
    return next(case for case in duf.cases() if case.name == name)


NAMES = tuple(case.name for case in duf.cases())


def best(motions: dict[float, Motion]) -> float:
    """Return the factor with the largest mean of m among the motions that are fit; NaN without any."""
    fit = [(motion.mean, factor) for factor, motion in motions.items() if motion.fit]
    return max(fit)[1] if fit else float("nan")


ENOUGH = 0.99
"""Share of the best mean from which on a larger alpha is not worth it."""


def enough(motions: dict[float, Motion]) -> float:
    """Return the least factor beyond which the mean hardly grows."""
    most = motions[best(motions)].mean
    return min(factor for factor, motion in motions.items() if motion.fit and motion.mean >= ENOUGH * most)


@cache
def single(low: float = duf.LOW, tube: Bounds | None = duf.TUBE) -> tuple[float, tuple[float, ...]]:
    """Return one alpha of (14) for all cases, and its means relative to the largest of (10).

    It is the least one beyond which the smallest of the five ratios hardly grows; only alphas with which every case is
    fit are looked at.
    """
    most = [tried(name, "curvature", low, tube) for name in NAMES]
    bars = [motions[best(motions)].mean for motions in most]
    own = [tried(name, "equality", low, tube) for name in NAMES]
    found = []
    for alpha in EQUALITY:
        if all(motions[alpha].fit for motions in own):
            ratios = tuple(motions[alpha].mean / bar for motions, bar in zip(own, bars, strict=True))
            found.append((min(ratios), alpha, ratios))
    return next((alpha, ratios) for least, alpha, ratios in found if least >= ENOUGH * max(found)[0])


@cache
def compared(name: str) -> dict[str, tuple[float, Motion]]:
    """Return the motions of scenario 1 or 2 with their factors: none, the best of each formula."""
    case, seven, ten = named(name), searched(name), tried(name, "curvature")
    gain, alpha, equal = best(seven), enough(ten), single()[0]
    return {
        "no resolution": (0.0, classical(case, 0.0)),
        "(7)": (gain, seven[gain]),
        "(10), no deviation": (alpha, without_deviation(case, alpha)),
        "(10)": (alpha, ten[alpha]),
        "(14)": (equal, tried(name, "equality")[equal]),
    }


def sweep(scene: rd.Scene, q: F64, subticks: int = SUBTICKS) -> F64:
    """Return the smallest distance within every tick, joints moving evenly from posture to posture [m]."""
    shares = np.arange(subticks + 1) / subticks
    return np.array([min(scene.distance(a + share * (b - a)) for share in shares) for a, b in pairwise(q)])


BALL_ALPHA = (0.0, 1e5)
"""Of scenario 3: m is left alone, or raised."""


@cache
def beside_ball(alpha: float, at_goal: bool = False, form: Form = "curvature", margin: float = duf.MARGIN) -> Motion:
    """Follow scenario 1 with the ball of scenario 3, or that at the goal, which is held for 3 s."""
    scene = duf.ball_scene(duf.goal_ball() if at_goal else duf.elbow_ball())
    solver = program(form, alpha, scene=scene, margin=margin)
    return follow(solver, duf.vertical_line(), hold=3.0 if at_goal else 0.0)


def rest(motion: Motion, scene: rd.Scene) -> tuple[float, float]:
    """Return how far the end of a motion is from the goal [m], and from being nearest to it.

    At the safe posture nearest to the goal, no step that keeps the distances brings the hand nearer: the error, seen
    from the joints, is a sum of the gradients of distances at their bounds with the right signs. What is left of the
    error then is told as a part of it.
    """
    robot, q, errors = duf.robot(), motion.q[-1], program("curvature", 0.0)
    error = duf.TICK * errors.twist_to(q, duf.vertical_line().path.targets(FULL)[-1])
    pull = robot.jacobian(q).T @ error
    active = scene.near(q, duf.SECURITY + 1e-4)
    rows = np.array([pair.gradient for pair in active])
    # Multipliers are at least 0: the pull is against the distances.
    weights = np.maximum(np.linalg.lstsq(-rows.T, pull, rcond=None)[0], 0.0)
    return float(np.linalg.norm(error[3:])), float(np.linalg.norm(pull + rows.T @ weights) / np.linalg.norm(pull))


@dataclass(frozen=True)
class Balls:
    """What came of many balls at random; `free` counts those beside which some posture on the goal is safe."""

    alpha: float
    number: int
    ticks: float
    swept: float
    reached: int
    free: int
    infeasible: int


@cache
def random_balls(alpha: float, number: int = 50, margin: float = duf.MARGIN) -> Balls:
    """Follow scenario 1 beside random balls that would be hit, each swept at 10 kHz; least distances less d_s [m]."""
    case, rng = duf.vertical_line(), np.random.default_rng(0)
    free = follow(program("curvature", alpha), case)
    ticks, swept, reached, clear, infeasible, count = np.inf, np.inf, 0, 0, 0, 0
    while count < number:
        elbow = duf.robot().link_frames(free.q[rng.integers(100, 450)])[3, :3, 3]
        scene = duf.ball_scene(elbow + rng.normal(0.0, 0.12, 3))
        hit = min(scene.distance(q) for q in free.q[::5]) < duf.SECURITY
        if not hit or scene.distance(case.start) < duf.INFLUENCE:
            continue
        found = follow(program("curvature", alpha, scene=scene, margin=margin), case)
        assert found.distance is not None
        ticks = min(ticks, float(found.distance.min()) - duf.SECURITY)
        # Only where it is near at all can it come nearer within a tick.
        near = np.flatnonzero(found.distance[:-1] < duf.SECURITY + 0.02)
        for k in near:
            swept = min(swept, float(sweep(scene, found.q[k : k + 2]).min()) - duf.SECURITY)
        reached, infeasible, count = reached + found.reached, infeasible + ("infeasible" in found.status), count + 1
        clear += any(scene.distance(q) >= duf.SECURITY for q in goal_postures())
    return Balls(alpha, number, ticks, swept, reached, clear, infeasible)


@cache
def goal_postures(number: int = 200) -> list[F64]:
    """Return postures within limits on the goal of scenario 1, from random starts."""
    robot, target = duf.robot(), duf.vertical_line().path.targets(FULL)[-1]
    solver = rd.QuadraticProgram(robot, FULL, dt=duf.TICK)
    found = [solver.solve(target, q) for q in random_postures(number)]
    return [q for q, _, status, _ in found if status == "on target"]


@cache
def printed_form(name: str, alpha: float) -> float:
    """Return the share of ticks at which (10) as printed is not convex."""
    found = follow(program("printed", alpha), named(name))
    return found.status.count("not convex") / len(found.status)


@cache
def indefinite(name: str, alpha: float) -> float:
    """Return the share of ticks at which Q - alpha T^2 H_m is not positive definite along (14)'s motion."""
    hessian = INDEX.evaluate_many(duf.robot(), tried(name, "equality")[single()[0]].q, 2)[2]
    assert hessian is not None
    least = np.linalg.eigvalsh(np.eye(7) - alpha * duf.TICK**2 * hessian)[:, 0]
    return float((least <= 0.0).mean())


def oscillates_from(motion: Motion) -> float:
    """Return the alpha of (14) beyond which its step overshoots the maximum of m at half of the ticks of a motion.

    The ticks between the ramps count. Near a maximum, where grad m vanishes and with it the curvature of (14) itself, a
    tick moves the joints by alpha T^2 m A^-1 grad m with A = Q + Q_low J'J. With H the Hessian of m, this is more than
    twice the way to the maximum when alpha T^2 m times an eigenvalue of -A^-1 H is above 2.
    """
    middle = slice(round(duf.RAMP * len(motion.q)), round((1.0 - duf.RAMP) * len(motion.q)))
    q = motion.q[middle]
    value, _, hessian = INDEX.evaluate_many(duf.robot(), q, 2)[:3]
    assert hessian is not None
    jacobian = duf.robot().jacobian(q)
    stiff = np.eye(7) + duf.LOW * jacobian.transpose(0, 2, 1) @ jacobian
    most = np.linalg.eigvals(np.linalg.solve(stiff, -hessian)).real.max(axis=1)
    return float(2.0 / (duf.TICK**2 * np.median(value * most)))


def differences(q: F64, step: float) -> tuple[F64, F64]:
    """Return the gradients (17) and the Hessians (19) of m at postures (N, 7)."""
    robot, unit = duf.robot(), step * np.eye(7)

    def m(postures: F64) -> F64:
        values: F64 = INDEX.evaluate_many(robot, postures, 0)[0]
        return values

    gradient = np.stack([m(q + e) - m(q - e) for e in unit], axis=1) / (2.0 * step)
    hessian = np.empty((len(q), 7, 7))
    for i, a in enumerate(unit):
        for j, b in enumerate(unit):
            forth, back = m(q + a + b) - m(q + a - b), m(q - a + b) - m(q - a - b)
            hessian[:, i, j] = (forth - back) / (4.0 * step**2)
    return gradient, hessian


def bfgs(q: F64, as_printed: bool = False) -> tuple[F64, float]:
    """Return what BFGS makes of the Hessian of -m along a motion, and the share of ticks at which it learns.

    The direct update, or (20) as printed; both learn only where s'y > 0.
    """
    gradient = INDEX.evaluate_many(duf.robot(), q, 1)[1]
    assert gradient is not None
    matrix, out, learnt = np.zeros((7, 7)), [np.zeros((7, 7))], 0
    for k in range(1, len(q)):
        s, y = q[k] - q[k - 1], gradient[k - 1] - gradient[k]
        if s @ y > 1.5e-8 * np.linalg.norm(s) * np.linalg.norm(y):
            learnt += 1
            if not matrix.any():
                matrix = (s @ y) / (y @ y) * np.eye(7) if as_printed else (y @ y) / (s @ y) * np.eye(7)
            if as_printed:
                left = np.eye(7) - np.outer(s, y) / (s @ y)
                matrix = left @ matrix @ left.T + np.outer(s, s) / (s @ y)
            else:
                hs = matrix @ s
                matrix = matrix + np.outer(y, y) / (s @ y) - np.outer(hs, hs) / (s @ hs)
        out.append(matrix)
    return np.array(out), learnt / (len(q) - 1)


def relative(found: F64, exact: F64) -> F64:
    """Return the errors of vectors or matrices (N, ...) as parts of their lengths."""
    axes = tuple(range(1, exact.ndim))
    off: F64 = np.sqrt(((found - exact) ** 2).sum(axis=axes) / (exact**2).sum(axis=axes))
    return off


def random_postures(number: int = 500) -> F64:
    """Return random postures within limits."""
    robot = duf.robot()
    return np.random.default_rng(1).uniform(robot.q_min, robot.q_max, (number, robot.n))


# --- pictures ---------------------------------------------------------------------------------------------------------

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
