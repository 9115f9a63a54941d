"""The best spin over a whole path: a search over all spins and branches, then the continuous optimum."""

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from ._arrays import F64, checked
from ._core import ConditionNumber, Objective, Robot, Task, least_value, refine_path, restore_path
from ._map_data import CAUSES
from ._layers import Layers, PathData, SearchSettings, Segment, spread
from ._path_frames import motion_bounds, point_weights, shares, spin_frames
from ._progress import progress as progress_bar
from ._rows import rows_in_use
from ._spare import angle_grid, spare_grid
from .errors import InvalidValueError
from .redundancy_map import Predicate
from .toolpath import Toolpath
from .trajectory import Trajectory

_CRITERIA: Final = ("minimax", "integral", "motion")
_ON_PATH: Final = 1e-9
"""Error of a point that counts as on the path [rad, m]."""
_WANDERED: Final = 0.5
"""A posture this far from where its neighbours' interpolation put it [rad] is another route."""
_ROUNDS: Final = 8
"""Times that points are added to the search."""
_GENTLE: Final = 1e-6
"""Weight of the motion where none is given: this part of the value, for the motion of the route that was found."""
_BOUND_POINTS: Final = 3
"""Points at which the lower bound of a worst value is looked for."""


@dataclass(frozen=True)
class PlanFailure:
    """Why a plan is not whole.

    Attributes
    ----------
    point : int
        First point that is not reached as it should be, counted from 0.
    cause : str
        "unreachable", "joint limit", "singular", "predicate", "speed limit", "no way" (the point has postures, but no
        branch leads there from the points before) or "not closed".
    joint : int or None
        The joint in the way, counted from 0, for "joint limit" and "speed limit".
    excess : float
        How far beyond its limit that joint would have to go [rad or m], or how many times its speed limit it would need;
        NaN where neither is meant.
    """

    point: int
    cause: str
    joint: int | None = None
    excess: float = float("nan")

    def __str__(self) -> str:
        where = f"point {self.point}: {self.cause}"
        if self.cause == "joint limit" and self.joint is not None:
            return f"{where} of joint {self.joint + 1}, by {self.excess:.3g} at least"
        if self.cause == "speed limit" and self.joint is not None:
            return f"{where} of joint {self.joint + 1}, {self.excess:.3g} times it needed"
        return where


@dataclass(frozen=True, eq=False)
class Plan(Trajectory):
    """A trajectory that is best as a whole.

    Attributes
    ----------
    objective : Objective or None
        What was minimised; None where it was the motion alone.
    criterion : str
        "minimax", "integral" or "motion".
    smoothness : float
        Weight of the integral of the squared joint speed over the path's share.
    cost : float
        What was minimised: worst value, or integral of the value, each plus smoothness times motion.
    motion : float
        Integral of the squared joint speed over the path's share [rad^2 or m^2].
    bound : float
        No path can do better than this (minimax: the least value at the worst point; integral: the integral of the
        least values), to the resolution of the search; NaN where it was not asked for.
    residual : float
        First-order residual: the largest slope of the Lagrangian along a free motion.
    failure : PlanFailure or None
        Why the plan is not whole; the points that are reached are the best that there are.
    refined : bool
        Whether the continuous optimum was reached; else the best route of the grid is what is returned.
    """

    objective: Objective | None = None
    criterion: str = "minimax"
    smoothness: float = 0.0
    cost: float = float("nan")
    motion: float = float("nan")
    bound: float = float("nan")
    residual: float = float("nan")
    failure: PlanFailure | None = None
    refined: bool = False

    @property
    def gap(self) -> float:
        """How far the plan can be from the best there is: worst (or mean) value less the bound."""
        reached = self.value[np.isfinite(self.value)]
        if self.criterion == "minimax":
            return float(reached.max(initial=-np.inf) - self.bound)
        weights = point_weights(shares(self.path), False)
        return float(weights @ self.value - self.bound)


@dataclass(frozen=True)
class _Setup:
    robot: Robot
    path: Toolpath
    task: Task
    objective: Objective | None
    criterion: str
    smoothness: float | None
    limits: bool
    closed: bool
    data: PathData
    targets: F64
    length: float
    max_iterations: int


@dataclass
class _Part:
    """What is known of the points first to last of the path."""

    first: int
    q: F64
    value: F64
    cost: float = float("nan")
    residual: float = float("nan")
    smoothness: float = 0.0
    refined: bool = False
    failure: PlanFailure | None = None


def plan(
    robot: Robot,
    path: Toolpath,
    task: Task | None = None,
    objective: Objective | None = None,
    criterion: str = "minimax",
    limits: bool = True,
    *,
    smoothness: float | None = None,
    n_angles: int = 48,
    layers: int = 48,
    spin_range: tuple[float, float] | None = None,
    max_spin_step: float = np.pi / 3.0,
    spare: tuple[int, ...] | None = None,
    n_spare: int = 24,
    branches: tuple[int, ...] | None = None,
    branch_changes: bool = False,
    closed: bool = False,
    feasible: Predicate | None = None,
    warm_start: Trajectory | None = None,
    bound: bool | None = None,
    max_iterations: int = 200,
    progress: bool = True,
) -> Plan:
    """Plan the free motion of a robot along a whole path: the spin of its tool, and its spare joints.

    Every inverse solution at some points of the path, over a grid of spins, is searched for the best route; from there
    the path as a whole is brought to its continuous optimum by an interior-point method with exact second derivatives.

    Parameters
    ----------
    robot : Robot
        Six revolute joints, or more of which some are spare (a seven-axis arm, a robot on a rail).
    path : Toolpath
        N points; with times, joint speed limits hold.
    task : Task
        Axisymmetric (default, about z) or full.
    objective : Objective, optional
        What is minimised. Not needed for the criterion "motion".
    criterion : {"minimax", "integral", "motion"}
        The worst value on the path; the mean value; or the integral of the squared joint speed alone.
    limits : bool
        Whether position limits hold, and speed limits where the path has times.
    smoothness : float, optional
        Weight of the integral of the squared joint speed, over the path's share s from 0 to 1:
        value + smoothness * integral |dq/ds|^2 ds. If not given, as much as changes the value by a millionth.
    n_angles, n_spare : int
        Grid of the search: spins, and values of each spare joint.
    layers : int
        Points of the path at which the search begins; more are added where the path needs them.
    spin_range : tuple of float, optional
        Least and largest spin [rad] that the search may use, from the path's rotations (or from frames that never turn
        about the axis); a whole turn if not given.
    max_spin_step : float
        Largest change of the spin from one point of the search to the next [rad].
    spare : tuple of int, optional
        Joints on the grid, counted from 0; chosen if not given.
    branches : tuple of int, optional
        Branches that may be used, as in `redundancy_map`; all if not given.
    branch_changes : bool
        Whether the branch may change where the joints are continuous, through a singularity.
    closed : bool
        Whether the last point, which has to be the first, is reached in the same posture up to whole turns.
    feasible : callable, optional
        The user's own reason, such as a collision: gets postures (M, n), returns which are allowed (M,).
    warm_start : Trajectory, optional
        An earlier plan of a similar path: refined at once, with a search only if that fails.
    bound : bool, optional
        Whether to prove how good the plan is; done for "minimax" if not given.
    max_iterations : int
        Newton steps of the refinement at most.
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    Plan
        Where the path cannot be followed, ``failure`` names the first bad point and the cause, the points of ``status``
        "unreachable" hold the posture of the nearest point that is reached, and the others are planned as far as there
        is a way.

    Raises
    ------
    InvalidValueError
        If a setting is out of its domain, or the task or the robot is none that can be planned for.

    Notes
    -----
    The share of the path is time where it has times, else length. The bound of a minimax plan is the least value at its
    worst points: the best of the grid's postures there, each brought to its minimum by Newton. It is proven to the
    resolution of that grid.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.robots.get("fanuc_m710ic50_milling")
    >>> path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0))
    >>> best = rd.plan(robot, path, objective=rd.ConditionNumber(0.4856))
    >>> best.max_condition_number < 2.55, best.gap < 1e-4
    (True, True)
    """
    task = Task.axisymmetric() if task is None else task
    if criterion not in _CRITERIA:
        raise InvalidValueError(f"criterion is {criterion!r}, expected one of {', '.join(map(repr, _CRITERIA))}")
    if criterion != "motion" and objective is None:
        raise InvalidValueError(f"objective is None, expected an objective for the criterion {criterion!r}")
    for name, number in (("layers", layers), ("max_iterations", max_iterations)):
        if number < 1:
            raise InvalidValueError(f"{name} is {number}, expected at least 1")
    if smoothness is not None and not 0.0 <= smoothness < np.inf:
        raise InvalidValueError(f"smoothness is {smoothness}, expected a finite number of at least 0")
    if not 0.0 < max_spin_step <= np.pi:
        raise InvalidValueError(f"max_spin_step is {max_spin_step}, expected an angle above 0, at most pi [rad]")
    setup = _Setup(
        robot,
        path,
        task,
        None if criterion == "motion" else objective,
        criterion,
        1.0 if criterion == "motion" else smoothness,
        limits,
        closed,
        PathData(spin_frames(path, task, closed), shares(path), motion_bounds(robot, path, limits)),
        path.targets(task),
        (objective.length if isinstance(objective, Objective) else None) or 1.0,
        max_iterations,
    )
    chosen, values = spare_grid(robot, spare, n_spare)
    settings = SearchSettings(
        "integral" if criterion == "motion" else criterion,
        1.0 if criterion == "motion" else (smoothness or 0.0),
        angle_grid(task, n_angles, spin_range),
        chosen,
        values,
        limits,
        branches,
        branch_changes,
        max_spin_step,
        spin_range is None,
        feasible,
    )
    known = Layers(robot, task, setup.objective, setup.data, settings)
    with progress_bar(len(path), "planning", progress) as advance:
        parts = _from_warm_start(setup, feasible, warm_start) or _search(setup, known, feasible, layers, advance)
        result = _assemble(setup, parts)
        result = replace(result, failure=_first_failure(setup, known, parts, result))
        if bound if bound is not None else criterion == "minimax":
            result = _with_bound(setup, known, result, advance)
    return result


def _search(setup: _Setup, known: Layers, feasible: Predicate | None, layers: int, advance: Any) -> list[_Part]:
    """Find routes through the path, as long as they get, and refine each."""
    n = len(setup.path)
    wanted = sorted({round(x) for x in np.linspace(0, n - 1, min(n, layers))})
    for _ in range(_ROUNDS):
        known.add(wanted, advance)
        stretches = _stretches(known, wanted)
        whole = len(stretches) == 1 and len(stretches[0]) == len(wanted)
        found = [segment for stretch in stretches for segment in _routes(setup, known, stretch, whole)]
        more = _where_more_is_needed(setup, known, wanted, found)
        if not more:
            break
        wanted = sorted({*wanted, *more})
    return [_refined(setup, segment, feasible) for segment in found]


def _stretches(known: Layers, points: list[int]) -> list[list[int]]:
    """Return the runs of points that have postures."""
    runs: list[list[int]] = [[]]
    for point in points:
        if known.is_open(point):
            runs[-1].append(point)
        elif runs[-1]:
            runs.append([])
    return [run for run in runs if run]


def _routes(setup: _Setup, known: Layers, points: list[int], whole: bool) -> list[Segment]:
    """Return the routes of a run of points: one, or several where there is no way from one to the next."""
    if setup.closed and whole:
        ring = known.route(points, True)
        if len(ring.points) == len(points):
            return [ring]
    routes = []
    rest = points
    while rest:
        segment = known.route(rest, False)
        routes.append(segment)
        rest = rest[len(segment.points) :] if segment.points else []
    return routes


def _where_more_is_needed(setup: _Setup, known: Layers, wanted: list[int], found: list[Segment]) -> set[int]:
    """Return points whose cells should be known: where routes end early and where interpolation loses the path."""
    more: set[int] = set()
    inside = {point for segment in found for point in segment.points}
    for a, b in zip(wanted[:-1], wanted[1:], strict=True):
        ends = any(segment.points[-1] == a or segment.points[0] == b for segment in found)
        joined = any(a in segment.points and b in segment.points for segment in found)
        if b - a > 1 and not joined and (ends or (a in inside) != (b in inside)):
            # Halving finds the edge; a range of points that a search has to cross is not left in the dark.
            more.update({(a + b) // 2} if b - a > 8 else set(range(a + 1, b)))
    for segment in found:
        if len(segment.points) < 2:
            continue
        points, q = spread(segment)
        restored = _restored(setup, points, q)
        lost = np.flatnonzero(~np.isfinite(restored).all(axis=1) | (np.abs(restored - q).max(axis=1) > _WANDERED))
        if setup.limits:
            beyond = np.maximum(setup.robot.q_min - restored, restored - setup.robot.q_max).max(axis=1)
            lost = np.union1d(lost, np.flatnonzero(beyond > 0.02))
        more.update(int(points[i]) for i in _thinned(lost))
    return more - set(known.cells)


def _thinned(lost: F64) -> F64:
    """Return every other of the neighbouring ones: the next round sees whether that is enough."""
    return lost[::2] if len(lost) > 16 else lost


def _restored(setup: _Setup, points: F64, q: F64) -> F64:
    """Return postures brought onto the path by Newton; NaN where it does not lead there."""
    rows, reached = restore_path(setup.robot, setup.task, setup.targets[points], q, setup.length)
    rows[~reached] = np.nan
    return rows


def _errors(setup: _Setup, points: F64, q: F64) -> tuple[F64, F64]:
    """Return the distances [m] and the angles [rad] of postures to points of the path."""
    tools = setup.robot.fk(q)
    frames = setup.data.frames[points]
    position: F64 = np.linalg.norm(tools[:, :3, 3] - frames[:, :3, 3], axis=1)
    if setup.task.kind == "full":
        chord = np.linalg.norm((tools - frames)[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
    else:
        chord = np.linalg.norm((tools - frames)[:, :3, :3] @ setup.task.axis, axis=1)
    angle: F64 = 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    return position, angle


def _refine(setup: _Setup, points: F64, q: F64, smoothness: float, iterations: int, turns: F64 | None = None) -> Any:
    """Call the refinement for a run of points; `turns` closes it."""
    first, last = int(points[0]), int(points[-1])
    steps = setup.data.steps[first:last]
    bounds = setup.data.bounds[first:last]
    total = steps.sum() if len(steps) else 1.0
    weights = point_weights(steps / total, turns is not None)
    kept = slice(None) if turns is None else slice(0, -1)
    return refine_path(
        setup.robot,
        setup.task,
        setup.targets[first : last + 1][kept],
        q[kept],
        setup.objective,
        "integral" if setup.criterion == "motion" else setup.criterion,
        smoothness,
        weights[kept],
        steps / total,
        bounds,
        setup.limits,
        turns,
        setup.length,
        iterations,
    )


def _refined(setup: _Setup, segment: Segment, feasible: Predicate | None) -> _Part:
    """Refine a route; where that fails, keep the route."""
    points, q = spread(segment)
    part = _refine_part(setup, points, q, feasible)
    ended = segment.points[-1]
    if segment.blocked is not None:
        joint, excess = segment.blocked
        cause = "speed limit" if np.isfinite(setup.data.bounds).any() and excess > 1.0 else "no way"
        part.failure = PlanFailure(ended + 1, cause, joint if cause == "speed limit" else None, excess)
    return part


def _refine_part(setup: _Setup, points: F64, q: F64, feasible: Predicate | None) -> _Part:
    closing = setup.closed and len(points) == len(setup.path) and len(points) > 2
    turns = 2.0 * np.pi * np.round((q[-1] - q[0]) / (2.0 * np.pi)) if closing else None
    start = _restored(setup, points, q)
    whole = bool(np.isfinite(start).all())
    smoothness = setup.smoothness if setup.smoothness is not None else _gentle(setup, points, start if whole else q)
    rows, value, cost, residual, _, _, status, tightest = _refine(
        setup, points, start if whole else q, smoothness, setup.max_iterations, turns
    )
    if turns is not None:
        rows, value = np.vstack([rows, rows[0] + turns]), np.append(value, value[0])
    part = _Part(int(points[0]), rows, value, cost, residual, smoothness, status == "converged")
    if status == "infeasible" and tightest is not None:
        part.failure = _failure(setup, points, rows, tightest)
    if status == "singular" or (feasible is not None and not np.asarray(feasible(rows)).all()):
        part.q, part.refined = (start if whole else q), False
        part.value = _values(setup, part.q)
    return part


def _gentle(setup: _Setup, points: F64, q: F64) -> float:
    """Return the weight of motion that changes the value by a millionth."""
    steps = setup.data.steps[points[0] : points[-1]]
    if not len(steps):
        return 0.0
    motion = float((np.diff(q, axis=0) ** 2).sum(axis=1) @ (steps.sum() / steps))
    value = _values(setup, q)
    scale = float(np.abs(value[np.isfinite(value)]).mean()) if np.isfinite(value).any() else 1.0
    return _GENTLE * scale / motion if motion > 0.0 else 0.0


def _failure(setup: _Setup, points: F64, q: F64, tightest: tuple[str, int, int]) -> PlanFailure:
    """Say which joint limit or speed limit leaves no path."""
    kind, at, joint = tightest
    point = int(points[0]) + at
    if kind == "joint limit":
        beyond = np.maximum(setup.robot.q_min - q, q - setup.robot.q_max).max(axis=1)
        return PlanFailure(point, kind, joint, float(beyond[at]))
    nxt = min(at + 1, len(q) - 1)
    excess = abs(q[nxt, joint] - q[at, joint]) / setup.data.bounds[min(point, len(setup.data.bounds) - 1), joint]
    return PlanFailure(min(point + 1, len(setup.path) - 1), kind, joint, float(excess))


def _values(setup: _Setup, q: F64) -> F64:
    if setup.objective is None:
        return np.zeros(len(q))
    values: F64 = setup.objective.evaluate_many(setup.robot, q, 0)[0]
    return values


def _from_warm_start(setup: _Setup, feasible: Predicate | None, earlier: Trajectory | None) -> list[_Part]:
    """Refine an earlier plan, carried over by the share of the path; nothing if that does not lead to an optimum."""
    if earlier is None:
        return []
    if earlier.robot.n != setup.robot.n:
        raise InvalidValueError(f"warm_start has {earlier.robot.n} joints, expected {setup.robot.n}")
    places = [np.concatenate([[0.0], np.cumsum(shares(path))]) for path in (earlier.path, setup.path)]
    q = np.stack([np.interp(places[1], places[0], column) for column in earlier.q.T], axis=1)
    part = _refine_part(setup, np.arange(len(q)), q, feasible)
    return [part] if part.refined and part.failure is None else []


def _assemble(setup: _Setup, parts: list[_Part]) -> Plan:
    """Put the parts of a path together; where there is none the nearest posture stays."""
    n, robot = len(setup.path), setup.robot
    q = np.full((n, robot.n), np.nan)
    value = np.full(n, np.nan)
    status = ["unreachable"] * n
    for part in parts:
        rows = slice(part.first, part.first + len(part.q))
        q[rows], value[rows] = part.q, part.value
        status[rows] = ["converged" if part.refined else "on target"] * len(part.q)
    reached = np.flatnonzero(np.isfinite(q).all(axis=1))
    if len(reached):
        nearest = reached[np.abs(np.arange(n)[:, None] - reached).argmin(axis=1)]
        q = q[nearest]
    else:
        q = np.tile(0.5 * (np.clip(robot.q_min, -np.pi, np.pi) + np.clip(robot.q_max, -np.pi, np.pi)), (n, 1))
    position_error, axis_error = _errors(setup, np.arange(n), q)
    off = np.maximum(position_error, axis_error) > _ON_PATH
    status = ["unreachable" if off[i] else state for i, state in enumerate(status)]
    steps = setup.data.steps
    motion = float((np.diff(q, axis=0) ** 2).sum(axis=1) @ (1.0 / steps)) if len(steps) else 0.0
    one = parts[0] if len(parts) == 1 and len(parts[0].q) == n else None
    return Plan(
        robot=robot,
        path=setup.path,
        q=q,
        condition_number=_condition_number(setup, q),
        value=value,
        position_error=position_error,
        axis_error=axis_error,
        status=status,
        length=setup.length,
        objective=setup.objective,
        criterion=setup.criterion,
        smoothness=parts[0].smoothness if parts else 0.0,
        cost=one.cost if one else float("nan"),
        motion=motion,
        residual=max((part.residual for part in parts), default=float("nan")),
        refined=one is not None and one.refined,
    )


def _first_failure(setup: _Setup, known: Layers, parts: list[_Part], result: Plan) -> PlanFailure | None:
    """Return the first reason why the plan is not whole."""
    failures = [part.failure for part in parts if part.failure is not None]
    if setup.closed and result.refined is False and not failures and not result.unreachable:
        turns = (result.q[-1] - result.q[0]) / (2.0 * np.pi)
        if np.abs(turns - np.round(turns)).max() > _ON_PATH:
            failures.append(PlanFailure(len(result) - 1, "not closed"))
    bad = result.unreachable
    if bad and not any(failure.point <= bad[0] for failure in failures):
        failures.append(_cause_at(known, bad[0]))
    return min(failures, key=lambda failure: failure.point, default=None)


def _cause_at(known: Layers, point: int) -> PlanFailure:
    """Return why a point has no posture; of its cells, the one that came nearest to having one counts."""
    known.add([point], lambda _: None)
    cause = CAUSES[int(known.cells[point].cause.max())]
    if cause == "joint limit":
        nearest = known.nearest_to_limits(point)
        if nearest is not None:
            return PlanFailure(point, cause, *nearest)
    return PlanFailure(point, "no way" if cause == "feasible" else cause)


def _with_bound(setup: _Setup, known: Layers, result: Plan, advance: Any) -> Plan:
    """Add what no path can do better than."""
    finite = np.isfinite(result.value)
    if setup.objective is None or not finite.any():
        return result
    if setup.criterion == "integral":
        known.add(list(range(len(result))), advance)
        least = np.array([_least(setup, known, point) for point in range(len(result))])
        weights = point_weights(setup.data.steps, setup.closed)
        return replace(result, bound=float(weights @ least))
    worst = int(np.argmax(np.where(finite, result.value, -np.inf)))
    known.add([worst], advance)
    # Points of the search whose best cell is worst: no path passes below them either.
    ceilings = {point: np.nanmin(cells.value, initial=np.inf) for point, cells in known.cells.items() if known.is_open(point)}
    hardest = sorted(ceilings, key=lambda point: -ceilings[point])[:_BOUND_POINTS]
    return replace(result, bound=max(_least(setup, known, point) for point in {worst, *hardest} if known.is_open(point)))


def _least(setup: _Setup, known: Layers, point: int) -> float:
    assert setup.objective is not None
    cells = known.cells[point]
    usable = cells.cause == 0
    return least_value(
        setup.robot,
        setup.task,
        setup.targets[point],
        cells.q[usable],
        cells.value[usable],
        setup.objective,
        setup.limits,
        setup.length,
    )


def _condition_number(setup: _Setup, q: F64) -> F64:
    rows = rows_in_use(setup.robot)
    values: F64 = ConditionNumber(setup.length, rows=rows).evaluate_many(setup.robot, q, 0)[0]
    return values
