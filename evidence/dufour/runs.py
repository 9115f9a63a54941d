"""What is computed for docs/reproduction_dufour.md: motions and searches for factors."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Literal

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from evidence.dufour import cases as duf

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
def largest_manipulability() -> float:
    """Return the maximum of m within limits."""
    return rd.maximum_manipulability(duf.robot(), starts=200_000).manipulability


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


def random_postures(number: int = 500) -> F64:
    """Return random postures within limits."""
    robot = duf.robot()
    return np.random.default_rng(1).uniform(robot.q_min, robot.q_max, (number, robot.n))


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
