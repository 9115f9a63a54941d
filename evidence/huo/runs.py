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
from redundancy.weights.setting import setting

from evidence.huo import cases as huo

F64 = NDArray[np.float64]
Method = Callable[..., rd.RateSolver]

ITERATIONS = 2
"""Steps a point for the tests of chapters 4 and 5."""

EVEN = np.full(6, 0.01)
"""The starting weights (3.32), (4.13), (5.5)."""

SPHERE = rd.PosturePull([0.10, 0.12, 0.10, 0.10, 0.10, 0.10], middle=np.zeros(6))
"""(3.27) to (3.29)."""


def sixth(value: float) -> F64:
    """Return the starting weights with another for joint 6."""
    changed = EVEN.copy()
    changed[5] = value
    return changed


TEST_III = (sixth(0.03), sixth(0.05))  # (4.15), (4.16)
TEST_IV = (sixth(0.0483), sixth(0.0256))  # (5.8), (5.9)


def run(solver: Solver, case: huo.Case, path: rd.Toolpath | None = None, start: F64 | None = None) -> rd.Trajectory:
    """Follow the path of a case, or another, from its start, or another."""
    return rd.follow(solver, path or case.path, case.start if start is None else start, progress=False)


def unresolved(case: huo.Case) -> rd.Trajectory:
    """Follow the rotations of the path: what the robot does that does not use its redundancy."""
    return run(rd.ResolvedRate(case.robot, rd.Task.full(), limits=False), case)


def twist_run(case: huo.Case, w: F64, k: F64 | None, iterations: int = ITERATIONS) -> rd.Trajectory:
    """Follow with the twist decomposition and constant weights."""
    return run(rd.TwistDecomposition(case.robot, case.task, rd.PosturePull(w, k), iterations=iterations), case)


def adapt(case: huo.Case, iterations: int = ITERATIONS) -> weights.WeightSearch:
    """Adapt the starting weights to a case."""
    robot, path, task, start = case.robot, case.path, case.task, case.start
    return weights.self_adapt(robot, path, task, EVEN, EVEN, start=start, iterations=iterations, progress=False)


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
    """What Table 4.1 tells of a trajectory: rad, 1, m^3, deg/s, rad, m."""

    low: float
    high: float
    kappa: float
    manipulability: float
    singularity: float
    speed_6: float
    speed_4: float
    orientation: float
    position: float

    @classmethod
    def of(cls, found: rd.Trajectory) -> "Measures":
        """Measure a trajectory; condition number, manipulability and w_ps with length 1."""
        robot, q, speed = found.robot, found.q, found.joint_speed
        assert speed is not None
        fastest = np.rad2deg(np.abs(speed)).max(axis=0)
        return cls(
            float(q[:, 5].min()),
            float(q[:, 5].max()),
            float(np.linalg.cond(robot.jacobian(q)).max()),
            float(rd.Manipulability(1.0).evaluate_many(robot, q, 0)[0].min()),
            float(rd.SingularityParameter(1.0).evaluate_many(robot, q, 0)[0].max()),
            float(fastest[5]),
            float(fastest[3]),
            float(found.axis_error.max()),
            float(found.position_error.max()),
        )

    @property
    def range_6(self) -> float:
        """Motion range of joint 6 [rad]."""
        return self.high - self.low


@cache
def welding() -> dict[str, rd.Trajectory]:
    """Follow the intersection of the cylinders in every way that is compared."""
    case = huo.m710_cylinders()
    dynamic = weights.dynamic_adapt(
        case.robot, case.path, case.task, start=case.start, iterations=ITERATIONS, progress=False
    )
    pull = rd.PosturePull(EVEN, EVEN)
    return {
        "no resolution": unresolved(case),
        "virtual joint": run(rd.VirtualJoint(case.robot, case.task, pull, iterations=ITERATIONS), case),
        "Test I": twist_run(case, EVEN, None),
        "Test II": twist_run(case, EVEN, EVEN),
        "Test III": twist_run(case, *TEST_III),
        "Test IV, printed weights": twist_run(case, *TEST_IV),
        "Test IV, `self_adapt`": adapt(case).trajectory,
        "`dynamic_adapt`": dynamic.trajectory,
        "SQP": run(condition_and_limits(case), case),
    }


def share(new: weights.Performance | Measures, old: weights.Performance | Measures) -> tuple[float, float]:
    """Return the range of joint 6 and the smallest manipulability as shares of those of another trajectory."""
    ranges = [m.range_6 if isinstance(m, Measures) else m.ranges[5] for m in (new, old)]
    return ranges[0] / ranges[1], new.manipulability / old.manipulability


@cache
def weight_grid(iterations: int) -> F64:
    """Return the shares, against Test II, of weights of joint 6 on a grid: (16 w, 16 k, 2)."""
    case = huo.m710_cylinders()
    grid = np.concatenate([[0.0], np.geomspace(0.001, 1.0, 15)])
    before = weights.Performance.of_trajectory(twist_run(case, EVEN, EVEN, iterations))
    runs = [twist_run(case, sixth(w), sixth(k), iterations) for w in grid for k in grid]
    shares = [share(weights.Performance.of_trajectory(found), before) for found in runs]
    return np.array(shares).reshape(16, 16, 2)


def other_tools(number: int = 40) -> F64:
    """Return the shares of self-adapted weights with random tools parallel to axis 6, (number, 2)."""
    case = huo.m710_cylinders()
    bare, rng = rd.robots.get("fanuc_m710ic50"), np.random.default_rng(0)
    shares: list[tuple[float, float]] = []
    while len(shares) < number:
        tool = np.eye(4)
        tool[:3, 3] = rng.uniform([-0.5, 0.0, 0.0], [0.5, 0.0, 0.5])
        robot = bare.with_tool(tool)
        # The posture on the first rotation that is nearest to the middle.
        solver = rd.OrthogonalSQP(robot, rd.Task.full(), rd.JointLimits())
        start, _, status, _ = solver.solve(case.path.targets(rd.Task.full())[0])
        if status == "unreachable":
            continue
        found = weights.self_adapt(
            robot, case.path, case.task, start=start, iterations=ITERATIONS, max_runs=60, progress=False
        )
        first = found.history[0].performance
        if first.unreachable == found.performance.unreachable == 0:
            shares.append(share(found.performance, first))
    return np.array(shares)


@cache
def tilted() -> dict[str, rd.Trajectory]:
    """Follow the intersection of the cylinders with the tool of section 6.3."""
    case = huo.m710_cylinders(np.pi / 3)
    found = {}
    for iterations, note in ((3, ", 3 iterations"), (20, "")):
        found["A" + note] = twist_run(case, EVEN, EVEN, iterations)
        made = setting(case.robot, case.path, case.task, EVEN, EVEN, case.start, 5.0, iterations)
        none = np.zeros(len(case.path))
        found["B" + note] = run(PointwiseSolver(made, weights.WeightFunctions(), none, none), case)
    lowered = none.copy()
    lowered[54:115] = lowered[187:248] = -0.5
    found["C as printed"] = run(PointwiseSolver(made, weights.WeightFunctions(), none, lowered), case)
    slow = weights.Criteria(speed=np.deg2rad(30.0))
    adapted = weights.dynamic_adapt(
        case.robot, case.path, case.task, criteria=slow, start=case.start, iterations=20, progress=False
    )
    found["C by `dynamic_adapt`"] = adapted.trajectory
    return found
