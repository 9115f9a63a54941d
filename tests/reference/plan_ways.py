"""Whether a path has a way at all, by brute force: postures on a grid, or a cloud of them carried along the path.

What is found is a way, from point to point within limits and steps; where nothing is found there may be one still.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from redundancy.errors import RedundancyError
from scipy.spatial import cKDTree

from tests.reference.chain import F64
from tests.reference.motions import FOLLOWED, LONGEST, carried, frames_of, jacobians_of, twist_errors
from tests.reference.plan_checks import Outcome, off_path
from tests.reference.plan_jobs import Job, turned_about

Index = NDArray[np.intp]

SPINS = 360
"""Spins of the grid, or values of the held joint."""
CLOUD = 160
"""Postures that are carried along."""
STARTS = 600
"""Random postures from which the first point is sought."""
WITHIN = 1e-9
SLACK = 1e-9
"""Part of a step that is rounding."""


def confirmed(outcome: Outcome, seed: int = 0) -> Outcome:
    """Add what brute force says of a failure where no motion is known: a way, or a posture at an unreachable point."""
    plan, job = outcome.plan, outcome.job
    if plan is None or plan.failure is None or job.known is not None:
        return outcome
    faults = list(outcome.faults)
    told = plan.failure.told(job.robot)
    if plan.failure.cause == "unreachable":
        starts = random_starts(job, 400, np.random.default_rng(seed))
        postures = reached(job, plan.failure.point, starts)
        if len(postures):
            faults.append(("reachable after all", f"{told}; {np.round(postures[0], 4).tolist()}"))
    found = way(job, seed)
    if found is not None and off_path(job, found).max() < 1e-8:
        faults.append(("false failure by brute force", told))
    return replace(outcome, faults=faults)


def way(job: Job, seed: int = 0) -> F64 | None:
    """Return a motion along the whole path, or None where none was found; closed paths are searched as open ones."""
    found = _on_grid(job)
    if found is not None or "spin_range" in job.settings:
        return found  # the cloud knows no spins
    return _in_cloud(job, np.random.default_rng(seed))


def _on_grid(job: Job) -> F64 | None:
    """Search the spins of a robot without joints to spare, or the values of one held joint: each state once."""
    layers = []
    for point in range(len(job.path)):
        states = _states(job, point)
        if states is None or not len(states):
            return None
        layers.append(states)
    return linked(layers, job.largest)


def linked(layers: list[F64], largest: F64) -> F64 | None:
    """Return a way through layers of postures with no step above the largest: forward over all that are reached."""
    alive, parents = [layers[0]], []
    for states, step in zip(layers[1:], largest, strict=True):
        tree = cKDTree(alive[-1] / step)
        distance, parent = tree.query(states / step, p=np.inf, distance_upper_bound=1.0 + SLACK)
        reached = np.isfinite(distance)
        if not reached.any():
            return None
        alive.append(states[reached])
        parents.append(parent[reached])
    return _traced(alive, parents)


def _states(job: Job, point: int) -> F64 | None:
    """Return postures at a point within limits, in every whole turn; None where a grid of one value is not enough."""
    robot, path, task = job.robot, job.path, job.task
    if task.kind == "axisymmetric" and robot.n == 6:
        low, high = job.settings.get("spin_range", (-np.pi, np.pi))
        around = np.linspace(low, high, SPINS)
        frames = _spun(path.position[point], path.axis[point], task.axis, around)
        if path.rotation is not None:
            frames[:, :3, :3] = path.rotation[point] @ turned_about(task.axis, around)
    elif task.kind == "full" and path.rotation is not None and robot.n in (6, 7):
        frames = np.eye(4)[None]
        frames[0, :3, :3], frames[0, :3, 3] = path.rotation[point], path.position[point]
    else:
        return None
    try:
        if robot.n == 6:
            return np.asarray(robot.inverse(frames, turns=True)[0])
        return np.asarray(robot.inverse(frames[0], samples=2 * SPINS, turns=True))
    except RedundancyError:
        return None


def _spun(position: F64, axis: F64, own: F64, around: F64) -> F64:
    """Return frames whose own axis points along a direction, turned about it."""
    frames = np.tile(np.eye(4), (len(around), 1, 1))
    frames[:, :3, 3] = position
    there, here = _basis(axis), _basis(own)
    cosine, sine = np.cos(around), np.sin(around)
    turn = np.tile(np.eye(3), (len(around), 1, 1))
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1] = cosine, -sine, sine, cosine
    frames[:, :3, :3] = there @ turn @ here.T
    return frames


def _basis(z: F64) -> F64:
    """Return a right-handed basis with a third direction."""
    x = np.cross(z, np.eye(3)[np.abs(z).argmin()])
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], axis=1)


def reached(job: Job, point: int, starts: F64) -> F64:
    """Return the postures within limits in which Newton from some starts ends at a point."""
    robot, path, task = job.robot, job.path, job.task
    frame = np.eye(4)
    frame[:3, 3] = path.position[point]
    axis = np.array([0.0, 0.0, 1.0])
    if path.rotation is not None:
        frame[:3, :3] = path.rotation[point]
    elif task.kind == "axisymmetric":
        axis = task.axis
        frame = _spun(path.position[point], path.axis[point], axis, np.zeros(1))[0]
    frames = np.tile(frame, (len(starts), 1, 1))
    if task.kind == "general":
        q, left = _carried_generally(job, starts, frames)
    else:
        q, left = carried(robot, starts, frames, task.kind, task.axis if task.kind == "axisymmetric" else axis)
    return q[(left < 10.0 * FOLLOWED) & (q >= robot.q_min).all(axis=1) & (q <= robot.q_max).all(axis=1)]


def _carried_generally(job: Job, starts: F64, wanted: F64) -> tuple[F64, F64]:
    q = starts.copy()
    left = np.full(len(q), np.inf)
    for _ in range(12):
        projector = np.stack([job.task.projector(job.robot, row) for row in q])
        error = (projector @ twist_errors(frames_of(job.robot, q), wanted)[:, :, None])[:, :, 0]
        left = np.abs(error).max(axis=1)
        if (left < FOLLOWED).all():
            break
        jacobian = projector @ jacobians_of(job.robot, q)
        step = (np.linalg.pinv(jacobian, rcond=1e-7) @ error[:, :, None])[:, :, 0]
        q += step * np.minimum(1.0, LONGEST / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
    return q, left


def random_starts(job: Job, count: int, rng: np.random.Generator) -> F64:
    """Return random postures within limits."""
    robot = job.robot
    low = np.maximum(robot.q_min, -2.0 * np.pi)
    return rng.uniform(low, np.minimum(robot.q_max, 2.0 * np.pi), (count, robot.n))


def _in_cloud(job: Job, rng: np.random.Generator) -> F64 | None:
    """Carry postures from point to point: as they are, and moved at random by less than a step."""
    cloud = reached(job, 0, random_starts(job, STARTS, rng))
    first = job.largest[0] if len(job.path) > 1 else np.ones(job.robot.n)
    kept, parents = [_thinned(cloud, first, rng)[0]], []
    for point in range(1, len(job.path)):
        before, step = kept[-1], job.largest[point - 1]
        if not len(before):
            return None
        size = np.minimum(step, 0.3)
        moved = np.concatenate([before, *(before + rng.uniform(-size, size, before.shape) for _ in range(3))])
        states, parent = _linked_states(job, point, moved, before, step)
        states, index = _thinned(states, step, rng)
        kept.append(states)
        parents.append(parent[index])
    return _traced(kept, parents) if len(kept[-1]) else None


def _traced(layers: list[F64], parents: list[Index]) -> F64:
    """Return the way back from a posture of the last layer."""
    index, way = 0, [layers[-1][0]]
    for states, parent in zip(layers[-2::-1], parents[::-1], strict=True):
        index = int(parent[index])
        way.append(states[index])
    return np.array(way[::-1])


def _linked_states(job: Job, point: int, moved: F64, before: F64, step: F64) -> tuple[F64, Index]:
    """Return the postures at a point that are reached from those before within a step, and which these are."""
    states = reached(job, point, moved)
    if not len(states):
        return states, np.zeros(0, dtype=np.intp)
    distance, nearest = cKDTree(before / step).query(states / step, p=np.inf, distance_upper_bound=1.0 + SLACK)
    good = np.isfinite(distance)
    return states[good], nearest[good]


def _thinned(states: F64, step: F64, rng: np.random.Generator) -> tuple[F64, Index]:
    """Return at most `CLOUD` postures, spread over cells of about a step, and which they are."""
    if len(states) <= CLOUD:
        return states, np.arange(len(states))
    order = rng.permutation(len(states))
    cells = np.round(states[order] / np.minimum(step, 1.0)).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    rest = np.setdiff1d(np.arange(len(order)), first)
    chosen = order[np.concatenate([rng.permutation(first), rest])[:CLOUD]]
    return states[chosen], chosen
