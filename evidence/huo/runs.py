"""What is computed for docs/reproduction_huo.md: trajectories, what they measure, weights on a grid."""

import dataclasses
import time
from collections.abc import Callable
from functools import cache

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy import weights
from redundancy.loops import Solver
from redundancy.weights.pointwise import PointwiseSolver
from redundancy.weights.setting import THRESHOLD, setting

from evidence.huo import cases as huo

F64 = NDArray[np.float64]
Method = Callable[..., rd.RateSolver]

ITERATIONS = 20
"""Iterations a point with the pull; printed for Table 3.2 alone."""

EVEN = np.full(6, 0.01)
"""The starting weights (3.32), (4.13), (5.5)."""

SPHERE = rd.PosturePull([0.10, 0.12, 0.10, 0.10, 0.10, 0.10], middle=np.zeros(6))
"""(3.27) to (3.29)."""


def sixth(value: float) -> F64:
    """Return the starting weights with another for joint 6."""
    changed = EVEN.copy()
    changed[5] = value
    return changed


AROUND, C_SING = 30, -0.5
"""How far Test C changes c_sing around the critical instant, and to what (section 6.3.3)."""

TEST_III = (sixth(0.03), sixth(0.05))  # (4.15), (4.16)
TEST_IV = (sixth(0.0483), sixth(0.0256))  # (5.8), (5.9)


def run(solver: Solver, case: huo.Case, path: rd.Toolpath | None = None, start: F64 | None = None) -> rd.Trajectory:
    """Follow the path of a case, or another, from its start, or another."""
    return rd.follow(solver, path or case.path, case.start if start is None else start, progress=False)


def unresolved(case: huo.Case) -> rd.Trajectory:
    """Follow the rotations of the path: what the robot does that does not use its redundancy."""
    return run(rd.ResolvedRate(case.robot, rd.Task.full(), limits=False), case)


def twist(case: huo.Case, w: F64, k: F64 | None, iterations: int = ITERATIONS, stop: float = 0.0) -> rd.RateSolver:
    """Return the twist decomposition with constant weights."""
    return rd.TwistDecomposition(case.robot, case.task, rd.PosturePull(w, k), iterations=iterations, stop=stop)


def from_start(solver: rd.RateSolver, case: huo.Case, start: F64 | None = None) -> rd.Trajectory:
    """Follow the path of a case with the start on its first point, where `follow` alone would let the pull act too."""
    path, q = case.path, case.start if start is None else start
    assert path.rotation is not None
    assert path.time is not None
    head, rest = (
        rd.Toolpath(path.position[part], path.axis[part], path.rotation[part], path.time[part])
        for part in (slice(0, 1), slice(1, None))
    )
    there, found = run(solver.with_objective(None), case, head, q), run(solver, case, rest, q)

    def both(name: str) -> F64:
        return np.concatenate([getattr(there, name), getattr(found, name)])

    return dataclasses.replace(
        found,
        path=path,
        q=both("q"),
        condition_number=both("condition_number"),
        value=both("value"),
        position_error=both("position_error"),
        axis_error=both("axis_error"),
        status=there.status + found.status,
    )


def settled(solver: rd.RateSolver, case: huo.Case) -> rd.Trajectory:
    """Follow a path of closed turns from the posture in which its first turn ends: the arbitrary start is forgotten."""
    return from_start(solver, case, from_start(solver, case).q[(len(case.path) - 1) // huo.TURNS])


@cache
def adapt(
    build: Callable[[], huo.Case],
    iterations: int = ITERATIONS,
    joints: tuple[int, ...] | None = None,
    max_runs: int = 100,
) -> weights.WeightSearch:
    """Adapt the starting weights to the case that a function builds."""
    case = build()
    given = (case.robot, case.path, case.task, EVEN, EVEN)
    return weights.self_adapt(
        *given, joints=joints, start=case.start, iterations=iterations, max_runs=max_runs, progress=False
    )


def condition_and_limits(case: huo.Case, limits: bool = True) -> rd.OrthogonalSQP:
    """Return the SQP that is compared: least kappa_F^2 with length 1, away from the limits."""
    objective = rd.ConditionNumber(1.0, squared=True)
    whole = objective + 0.01 * rd.LimitBarrier() if limits else objective
    return rd.OrthogonalSQP(case.robot, case.task, whole, limits=limits)


def pipe(case: huo.Case, points: int, turns: int = huo.TURNS) -> rd.Toolpath:
    """Return the turns around the pipe with another number of points a turn."""
    angle = 2.0 * np.pi * np.arange(turns * points + 1) / points
    turn = np.zeros((len(angle), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(angle)
    turn[:, 1, 0] = np.sin(angle)
    turn[:, 0, 1] = -turn[:, 1, 0]
    turn[:, 2, 2] = 1.0
    center = np.array([0.0, 0.6, -0.59])  # (3.15)
    assert case.path.rotation is not None
    rotation = turn @ case.path.rotation[0]
    position = center + turn @ (case.path.position[0] - center)
    return rd.Toolpath(position, rotation[:, :, 2], rotation, 285.0 * angle / (2.0 * np.pi))


def puma_pull(case: huo.Case) -> rd.PosturePull:
    """Return (3.17) with the weights of (3.10) and the middle (3.18)."""
    return rd.PosturePull(1.0 / (case.robot.q_max - case.robot.q_min), middle=huo.PUMA_MIDDLE)


def puma_solver(case: huo.Case, method: Method, share: float = 1.0, correct: bool = True) -> rd.RateSolver:
    """Return a method with a share of the pull (3.17) in each of the 20 iterations of Table 3.2."""
    pull = puma_pull(case)
    return method(case.robot, case.task, pull, relaxation=share, iterations=20, correct=correct, limits=False)


def mean_errors(case: huo.Case, method: Method, points: int, share: float) -> tuple[F64, F64]:
    """Return mean errors of position [m] and axis [rad] after exactly 20 iterations: both turns, the second alone."""
    found = run(puma_solver(case, method, share, correct=False), case, pipe(case, points))
    errors = np.stack([found.position_error, found.axis_error])
    return errors[:, 1:].mean(axis=1), errors[:, points + 1 :].mean(axis=1)


def until_accurate(method: Method, case: huo.Case) -> rd.Trajectory:
    """Follow until a point is within 1 mm and 0.01 rad (Table 3.4): one iteration with the pull, then of the task."""
    return run(method(case.robot, case.task, SPHERE, iterations=1, length=0.1, tolerance=0.01), case)


def until_still(method: Method, case: huo.Case, stop: float) -> rd.Trajectory:
    """Follow by algorithm 3.1 with its own stop, a joint motion shorter than epsilon."""
    return run(method(case.robot, case.task, SPHERE, iterations=1000, stop=stop, correct=False), case)


def step_time(method: Method) -> float:
    """Return the median time of a step in 2000 random postures [ns]."""
    case, out, spent = huo.m16ib_sphere_edge(), np.empty(6), []
    rng, solver = np.random.default_rng(0), method(case.robot, case.task, SPHERE, limits=False)
    postures, twists = rng.uniform(-1.5, 1.5, (2000, 6)), rng.normal(size=(2000, 6))
    for q, twist in zip(np.tile(postures, (5, 1)), np.tile(twists, (5, 1)), strict=True):
        begin = time.perf_counter_ns()
        solver.step(q, twist, out)
        spent.append(time.perf_counter_ns() - begin)
    return float(np.median(spent))


@dataclasses.dataclass(frozen=True)
class Measures:
    """What Tables 4.1 and 6.1 tell of a trajectory: rad, 1, m^3, deg/s, rad, m.

    Speeds are the largest from a point to the next, without the first, which leads away from an arbitrary start.
    """

    low: float
    high: float
    kappa: float
    manipulability: float
    singularity: float
    speed_6: float
    speed_4: float

    @classmethod
    def of(cls, found: rd.Trajectory) -> "Measures":
        """Measure a trajectory; condition number, manipulability and w_ps with length 1."""
        robot, q, speed = found.robot, found.q, found.joint_speed
        assert speed is not None
        fastest = np.rad2deg(np.abs(speed[1:])).max(axis=0)
        return cls(
            float(q[:, 5].min()),
            float(q[:, 5].max()),
            float(np.linalg.cond(robot.jacobian(q)).max()),
            float(rd.Manipulability(1.0).evaluate_many(robot, q, 0)[0].min()),
            float(rd.SingularityParameter(1.0).evaluate_many(robot, q, 0)[0].max()),
            float(fastest[5]),
            float(fastest[3]),
        )

    @property
    def range_6(self) -> float:
        """Motion range of joint 6 [rad]."""
        return self.high - self.low

    def against(self, other: "Measures") -> tuple[float, float]:
        """Return the range of joint 6 and the smallest manipulability as shares of those of another trajectory."""
        return self.range_6 / other.range_6, self.manipulability / other.manipulability


def welded(case: huo.Case, iterations: int = ITERATIONS, stop: float = 0.0) -> dict[str, rd.Trajectory]:
    """Weld the cylinders as in Tests I to IV, with the printed weights."""
    given = (iterations, stop)
    return {
        "Test I": from_start(twist(case, EVEN, None, *given), case),
        "Test II": from_start(twist(case, EVEN, EVEN, *given), case),
        "Test III": from_start(twist(case, *TEST_III, *given), case),
        "Test IV, printed weights": settled(twist(case, *TEST_IV, *given), case),
    }


def self_adapted(iterations: int = ITERATIONS) -> rd.Trajectory:
    """Weld the cylinders as in Test IV, with the weights that `self_adapt` finds."""
    case, found = huo.m710_cylinders(), adapt(huo.m710_cylinders, iterations)
    return settled(twist(case, found.w, found.k, iterations), case)


@cache
def welding() -> dict[str, rd.Trajectory]:
    """Weld the cylinders in every way that is compared."""
    case = huo.m710_cylinders()
    pull = rd.PosturePull(EVEN, EVEN)
    dynamic = weights.dynamic_adapt(case.robot, case.path, case.task, start=case.start, progress=False)
    return {
        "no resolution": unresolved(case),
        "virtual joint": from_start(rd.VirtualJoint(case.robot, case.task, pull, iterations=ITERATIONS), case),
        **welded(case),
        "Test IV, `self_adapt`": self_adapted(),
        "`dynamic_adapt`": dynamic.trajectory,
    }


@dataclasses.dataclass(frozen=True)
class Tilted:
    """Tests A to C, and what is known of C."""

    found: dict[str, rd.Trajectory]
    critical: int
    """The instant of a turn at which B is fastest, counted from 0."""
    solver: PointwiseSolver
    """That of C, with its weights at every point."""


@cache
def tilted() -> Tilted:
    """Weld the cylinders with the tool of section 6.3."""
    case = huo.m710_tilted()
    turn, none = (len(case.path) - 1) // huo.TURNS, np.zeros(len(case.path))
    made = setting(case.robot, case.path, case.task, EVEN, EVEN, case.start, THRESHOLD, ITERATIONS)
    b = run(PointwiseSolver(made, weights.WeightFunctions(), none, none), case)
    critical = int(np.abs(np.diff(b.q[:, 3])).argmax()) % turn
    lowered = none.copy()
    for first in (0, turn):
        lowered[first + critical - AROUND : first + critical + AROUND + 1] = C_SING
    solver = PointwiseSolver(made, weights.WeightFunctions(), none, lowered)
    slow = weights.Criteria(speed=np.deg2rad(30.0))
    adapted = weights.dynamic_adapt(
        case.robot, case.path, case.task, criteria=slow, start=case.start, max_rounds=40, progress=False
    )
    found = {
        "A": run(twist(case, EVEN, EVEN), case),
        "B": b,
        "C": run(solver, case),
        "`dynamic_adapt`": adapted.trajectory,
    }
    return Tilted(found, critical, solver)


def parts(c: Tilted) -> F64:
    """Return the norms of the three parts of (4.10), in the first iteration on the way to each point of C, (N, 3)."""
    found, solver = c.found["C"], c.solver
    robot, targets = found.robot, found.path.targets(solver.task)
    index = rd.SingularityParameter(1.0)
    error = rd.OrthogonalSQP(robot, solver.task, rd.JointLimits(), limits=False).error
    norms = np.full((len(found), 3), np.nan)
    for i, target in enumerate(targets[1:], 1):
        q = found.q[i - 1]
        held = None if np.isnan(solver.held[i]).any() else solver.held[i]
        # Both pulls are shortened alike where they would pass the mean of what they pull to.
        both = solver.w[i] + (0.0 if held is None else solver.k[i] * index.evaluate(robot, q, 0))
        share = 1.0 / np.maximum(both, 1.0)
        moved = weights.displacements(
            robot, solver.task, q, error(q, target), share * solver.w[i], share * solver.k[i], held
        )
        norms[i] = np.linalg.norm(moved, axis=1)
    return norms
