"""A plan put together from its parts, and what is wrong with it."""

from dataclasses import replace

import numpy as np

from ._core import ConditionNumber
from ._layers import Layers
from ._plan_refine import Part
from ._plan_result import Plan, PlanFailure
from ._plan_setup import ON_PATH, Setup
from .plots import CAUSES


def assembled(setup: Setup, known: Layers, parts: list[Part]) -> Plan:
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
        q = q[reached[np.abs(np.arange(n)[:, None] - reached).argmin(axis=1)]]
    else:
        q = np.tile(0.5 * (np.clip(robot.q_min, -np.pi, np.pi) + np.clip(robot.q_max, -np.pi, np.pi)), (n, 1))
    position_error, axis_error = setup.errors(np.arange(n), q)
    off = np.maximum(position_error, axis_error) > ON_PATH
    value[off] = np.nan
    whole = parts[0] if len(parts) == 1 and len(parts[0].q) == n and not off.any() else None
    index = ConditionNumber(setup.length, rows=robot.rows_in_use())
    result = Plan(
        robot=robot,
        path=setup.path,
        q=q,
        condition_number=index.evaluate_many(robot, q, 0)[0],
        value=value,
        position_error=position_error,
        axis_error=axis_error,
        status=["unreachable" if off[i] else state for i, state in enumerate(status)],
        length=setup.length,
        objective=setup.objective,
        criterion=setup.criterion,
        smoothness=parts[0].smoothness if parts else 0.0,
        cost=whole.cost if whole else float("nan"),
        motion=setup.motion(0, q),
        residual=max((part.residual for part in parts), default=float("nan")),
        refined=whole is not None and whole.refined,
    )
    return replace(result, failure=_first_failure(setup, known, parts, result))


def _first_failure(setup: Setup, known: Layers, parts: list[Part], result: Plan) -> PlanFailure | None:
    """Return the first reason why the plan is not whole."""
    failures = [part.failure for part in parts if part.failure is not None]
    bad = result.unreachable
    if bad and not any(failure.point <= bad[0] for failure in failures):
        failures.append(_cause_at(known, bad[0]))
    feasible = known.settings.feasible
    if feasible is not None and parts:
        reached = [point for point in range(len(result)) if point not in set(bad)]
        refused = np.flatnonzero(~np.asarray(feasible(result.q[reached])))
        failures.extend(PlanFailure(reached[i], "predicate") for i in refused[:1])
    starts = [part.first for part in parts[1:]]
    if starts and not failures:
        failures.append(PlanFailure(starts[0], "no way"))
    if setup.closed and not failures:
        turns = (result.q[-1] - result.q[0]) / (2.0 * np.pi)
        if np.abs(turns - np.round(turns)).max() > ON_PATH:
            failures.append(PlanFailure(len(result) - 1, "not closed"))
    return min(failures, key=lambda failure: failure.point, default=None)


def _cause_at(known: Layers, point: int) -> PlanFailure:
    """Return why a point has no posture; of its cells, the one that came nearest to having one counts."""
    known.add([point], lambda _: None)
    cause = CAUSES[int(known.cells[point].cause.max())]
    if cause == "joint limit":
        nearest = known.nearest_to_limits(point)
        if nearest is not None:
            return PlanFailure(point, cause, *nearest)
    return PlanFailure(point, "no way" if known.is_open(point) else cause)
