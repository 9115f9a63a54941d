"""Where to start on a toolpath (future work of Huo 2009, chapter 7)."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import cycle, product
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from .._core import JointLimits, Objective, OrthogonalSQP, RateSolver, Robot, Solution, Task, transport
from .._util import F64, checked, progress_bar, turns
from ..errors import InvalidValueError
from ..paths import Toolpath, Trajectory
from .following import Solver, first_posture, follow

Candidate: TypeAlias = tuple[F64, int, float, float]
_SPINS = 16
"""Angles of the tool about its axis that are tried."""
_SAME, _APART = 1e-6, 0.5
"""Differences of joints up to which postures are one, and from which they are no neighbours [rad or m]."""
_CLOSED = 1e-9
"""Difference of the ends of a closed path: what solvers call on target [rad, m]."""


@dataclass(frozen=True, eq=False)
class StartSearch:
    """A start posture q0 (n,) [rad or m], what the robot does from there, and the candidates, the best first.

    Each is a posture, the number of points not reached from there, the worst violation of a position limit (to
    1e-6 rad or m) and the worst value of the criterion along the path.
    """

    q0: F64
    trajectory: Trajectory
    candidates: list[Candidate] = field(repr=False)


@dataclass(frozen=True, eq=False)
class CyclicStart:
    """A start posture q0 (n,) [rad or m] on the first target of a closed path, and the turn that begins with it.

    ``closed`` tells whether the turn ends at q0, joint by joint: a robot that winds up by whole turns does not close.
    ``gap`` is, for each turn that was followed, the largest difference of a joint between end and start [rad or m].
    """

    q0: F64
    closed: bool
    gap: list[float]
    trajectory: Trajectory


def best_start(
    step: Solver,
    path: Toolpath,
    *,
    starts: int = 64,
    candidates: int = 8,
    seed: int = 0,
    turns: int = 0,
    progress: bool = True,
) -> StartSearch:
    """Choose the start posture of a path by following all of it from several.

    Postures on the first target come from random starts and, for an axisymmetric task, from random starts to each of
    16 angles of the tool about its axis: spin and inverse branch are searched together. Those within the limits that
    are worth most at the first point, and differ, are candidates; the start that `follow` takes is always one of them.

    Parameters
    ----------
    step : OrthogonalSQP, TwistDecomposition or another method
        The solver. It is used by several threads at once.
    path : Toolpath
        The path, N points.
    starts, candidates : int
        Number of random starts, and again as many for the angles of the tool; from how many of the postures found the
        whole path is followed, besides the start that `follow` takes. Both at least 1.
    seed, turns : int
        Seed of the random starts; how many whole turns more or less of each revolute joint are tried with each
        candidate, as far as limits allow. Both at least 0.
    progress : bool
        As for `follow`.

    Returns
    -------
    StartSearch
        The start with the fewest points not reached, among equals the least violation of a position limit, then the
        least maximum over the path of the solver's objective, or of kappa_F where that is no Objective.

    Raises
    ------
    InvalidValueError
        If a number is outside its domain, or the task needs rotations and the path has none.
    """
    _at_least(1, starts=starts, candidates=candidates)
    _at_least(0, seed=seed, turns=turns)
    robot, target, first = step.robot, path.targets(step.task)[0], _part(path, slice(0, 1))
    with ThreadPoolExecutor() as pool:
        found = _postures(step, target, starts, seed, pool)
        settled = [(t.q[0], *_score(step, t)) for t in pool.map(partial(_run, step, first), found)]
        settled.sort(key=lambda posture: posture[1:])
        inside = [q for q, unreached, violation, _ in settled if unreached == 0 == violation]
        kept = _distinct(robot, [first_posture(step, target), *inside])[: candidates + 1]
        followed = [copy for q in kept for copy in _with_turns(robot, q, turns)]
        results = []
        with progress_bar(len(followed), "following the path", progress) as advance:
            for q, trajectory in zip(followed, pool.map(partial(_run, step, path), followed), strict=True):
                results.append(((q, *_score(step, trajectory)), trajectory))
                advance(1)
    # Sorting is stable: of equals, the start that `follow` takes comes first.
    results.sort(key=lambda result: result[0][1:])
    return StartSearch(results[0][0][0], results[0][1], [candidate for candidate, _ in results])


def cyclic_start(
    step: Solver, path: Toolpath, q0: ArrayLike, *, turns: int = 20, tolerance: float = 1e-9, progress: bool = True
) -> CyclicStart:
    """Find the start from which a closed path ends where it started, joint by joint, from the first turn on.

    The path is followed turn after turn, each from the end of the one before: the pull of a secondary task makes the
    robot forget where it started.

    Parameters
    ----------
    step, path, progress
        As for `follow`. The path is closed: its first target is its last one. A `PosturePull` remembers nothing from
        one turn to the next.
    q0 : array_like, shape (n,)
        Where the search starts [rad or m]; brought onto the first target.
    turns, tolerance
        Turns at most, at least 1; difference between end and start that counts as none [rad or m], above 0.

    Returns
    -------
    CyclicStart
        Start and turn; ``step.follow_chunk(path.targets(step.task)[1:], q0)`` repeats it; `follow` would first work on
        the first point. The search ends early where the posture differs by whole turns: it winds up ever further.

    Raises
    ------
    ShapeError, NonFiniteError, InvalidValueError
        If ``q0`` is no posture, a number is outside its domain, or the path is not closed or lacks rotations.
    """
    start = checked("q0", q0, (step.robot.n,))
    _at_least(1, turns=turns)
    if not 0.0 < tolerance < np.inf:
        raise InvalidValueError(f"tolerance is {tolerance}, expected a finite number above 0")
    targets = path.targets(step.task)
    if len(path) < 2 or np.abs(targets[-1] - targets[0]).max() > _CLOSED:
        shown = f"{targets[0].tolist()} and ends at {targets[-1].tolist()}, {len(path)} points"
        raise InvalidValueError(f"path starts at {shown}, expected a closed path of at least 2")
    rest, gaps = _part(path, slice(1, None)), list[float]()
    point = _run(step, _part(path, slice(0, 1)), start)
    with progress_bar(turns, "closing the path", progress) as advance:
        while True:
            turn = _joined(path, point, _run(step, rest, point.q[-1]))
            advance(1)
            off = turn.q[-1] - turn.q[0]
            gaps.append(float(np.abs(off).max()))
            if _largest(step.robot, off) <= tolerance or len(gaps) == turns:
                return CyclicStart(turn.q[0].copy(), gaps[-1] <= tolerance, gaps, turn)
            point = turn


def _at_least(least: int, **values: int) -> None:
    for name, value in values.items():
        if not value >= least:
            raise InvalidValueError(f"{name} is {value}, expected at least {least}")


def _run(step: Solver, path: Toolpath, q0: F64) -> Trajectory:
    """Follow a path by a solver of its own: what a `PosturePull` remembers is one path's."""
    own = step.with_objective(step.objective) if isinstance(step, RateSolver) else step
    return follow(own, path, q0, progress=False)


def _part(path: Toolpath, points: slice) -> Toolpath:
    rotation, time = (None if x is None else x[points] for x in (path.rotation, path.time))
    return Toolpath(path.position[points], path.axis[points], rotation, time)


def _joined(path: Toolpath, before: Trajectory, rest: Trajectory) -> Trajectory:
    """Put the last point of a trajectory in front of another."""
    names = ("q", "condition_number", "value", "position_error", "axis_error")
    columns: dict[str, Any] = {x: np.concatenate([getattr(before, x)[-1:], getattr(rest, x)]) for x in names}
    return replace(rest, path=path, status=[before.status[-1], *rest.status], **columns)


def _score(step: Solver, trajectory: Trajectory) -> tuple[int, float, float]:
    values = trajectory.value if isinstance(step.objective, Objective) else trajectory.condition_number
    cost = np.inf if np.isnan(values).any() else float(values.max())
    return len(trajectory.unreachable), round(max(0.0, -trajectory.limit_margin), 6), cost


def _postures(step: Solver, target: F64, starts: int, seed: int, pool: ThreadPoolExecutor) -> list[F64]:
    """Return postures on a target from random starts, without whole turns; those of no success are left out."""
    robot = step.robot
    seeds = [int(x) for x in np.random.default_rng(seed).integers(2**63, size=2 * starts)]
    jobs = [(step, target)] * starts
    if step.task.kind == "axisymmetric" and robot.n >= 6:
        posed = OrthogonalSQP(robot, Task.full(), JointLimits(), length=getattr(step, "length", None))
        jobs += [(posed, pose) for pose, _ in zip(cycle(_ring(target, step.task.axis)), range(starts), strict=False)]

    def solve(job: tuple[Solver, F64], number: int) -> Solution:
        return job[0].solve(job[1], starts=1, seed=number)

    found = pool.map(solve, jobs, seeds)
    return [robot.turned(q) for q, _, status, _ in found if status != "unreachable" and np.isfinite(q).all()]


def _ring(target: F64, axis: F64) -> list[F64]:
    """Return the poses of a tool on an axisymmetric target at equal angles about its axis ``axis``."""
    onto = transport(np.stack([axis, target[3:]]))[1]
    turned = onto @ turns(axis, 2.0 * np.pi * np.arange(_SPINS) / _SPINS)
    return [np.concatenate([target[:3], rotation.ravel()]) for rotation in turned]


def _largest(robot: Robot, off: F64) -> F64:
    """Return the largest of each posture's differences in the joints, whole turns aside."""
    turns = np.where(robot.periodic, np.round(off / (2.0 * np.pi)), 0.0)
    return np.asarray(np.abs(off - 2.0 * np.pi * turns).max(axis=-1))


def _distinct(robot: Robot, postures: list[F64]) -> list[F64]:
    """Leave out copies, and put those first that are well apart from all before them."""
    q = np.array(postures).reshape(-1, robot.n)
    apart, near = list[int](), list[int]()
    for i, away in enumerate(_largest(robot, q[:, None] - q)):
        if away[apart].min(initial=np.inf) > _APART:
            apart.append(i)
        elif away[apart + near].min() > _SAME:
            near.append(i)
    return [postures[i] for i in apart + near]


def _with_turns(robot: Robot, q: F64, turns: int) -> list[F64]:
    """Return a posture, then its copies within the limits by whole turns of joints that have limits."""
    choices, alone = [], robot.with_limits(coupled=[])
    for joint, periodic in enumerate(robot.periodic):
        bounded = np.isfinite(robot.q_max[joint] - robot.q_min[joint])
        most = turns if periodic and bounded else 0
        shifts = 2.0 * np.pi * np.array([k for k in range(-most, most + 1) if k != 0])
        copies = np.tile(robot.middle, (len(shifts), 1))
        copies[:, joint] = q[joint] + shifts
        choices.append([0.0, *shifts[alone.within_limits(copies)]])
    first, *others = (q + np.array(shift) for shift in product(*choices))
    return [first, *(copy for copy in others if robot.within_limits(copy))]
