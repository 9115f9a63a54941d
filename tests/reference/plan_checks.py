"""What a plan has to keep, checked from its joints with own kinematics."""

import warnings
from dataclasses import dataclass
from time import process_time

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy.errors import RedundancyError

from tests.reference.chain import F64
from tests.reference.motions import frames_of, jacobians_of, rotation_vectors, twist_errors
from tests.reference.plan_jobs import Job

Bool = NDArray[np.bool_]

ON_PATH = 1e-8
"""Error of the tool that is none [m, rad]."""
WITHIN = 1e-9
"""Excess over a limit that is none, as a part of it where it is a step."""
SAME = 1e-9
"""Part of a value that is rounding, times the condition number."""
TOO_MUCH = "no more than the robot can do"
"""What a plan says of a task that is too much for its robot: true of some paths at random."""
SLOW = 60.0
"""CPU seconds that are too many for 300 points."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a job.

    Attributes
    ----------
    job : Job
        The job.
    plan : Plan or None
        None where there was an exception.
    faults : list of tuple of str
        Kind and words of what is wrong.
    seconds : float
        CPU time.
    refused : str
        Message of an exception of the package; empty without one.
    """

    job: Job
    plan: rd.Plan | None
    faults: list[tuple[str, str]]
    seconds: float
    refused: str = ""

    @property
    def cause(self) -> str:
        """What the plan says: whole, the cause of its failure, or refused."""
        if self.plan is None:
            return "refused" if self.refused else "exception"
        return "whole" if self.plan.failure is None else self.plan.failure.cause


def run(job: Job) -> Outcome:
    """Plan a job and check the plan; a failure where a motion is known is a fault."""
    begin = process_time()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            plan = job.plan()
        except RedundancyError as error:
            words = str(error) or "refused"
            rightly = job.known is None and TOO_MUCH in words
            return Outcome(job, None, [] if rightly else [("refused", words)], process_time() - begin, words)
        except BaseException as error:  # a panic is no Exception
            if isinstance(error, KeyboardInterrupt):
                raise
            return Outcome(job, None, [(f"{type(error).__name__}", str(error))], process_time() - begin)
    seconds = process_time() - begin
    faults = [("warning", f"{w.category.__name__}: {w.message}") for w in caught]
    faults += check(job, plan)
    if seconds > SLOW:
        faults.append(("slow", f"{seconds:.0f} CPU seconds for {len(job.path)} points"))
    if plan.failure is not None and job.known is not None:
        crossed = singular_at(job, job.known)
        kind = "false failure past a singularity" if crossed else "false failure"
        faults.append((kind, plan.failure.told(job.robot)))
    return Outcome(job, plan, faults, seconds)


def check(job: Job, plan: rd.Plan) -> list[tuple[str, str]]:
    """Return what is wrong with a plan: kinds and words."""
    robot, q = job.robot, plan.q
    faults: list[tuple[str, str]] = []
    if q.shape != (len(job.path), robot.n) or not np.isfinite(q).all():
        return [("not finite", f"shape {q.shape}, {np.isnan(q).sum()} NaN")]
    reached = np.array([status != "unreachable" for status in plan.status])
    if plan.failure is None and not reached.all():
        faults.append(("unreachable without a failure", f"points {plan.unreachable[:5]}"))
    away = np.where(reached, off_path(job, q), 0.0)
    if away.max(initial=0.0) > ON_PATH:
        faults.append(("off the path", f"by {away.max():.1e} at point {away.argmax()}"))
    if job.settings.get("limits", True):
        beyond = np.where(reached, np.maximum(robot.q_min - q, q - robot.q_max).max(axis=1), -1.0)
        if beyond.max(initial=-1.0) > WITHIN:
            faults.append(("beyond a limit", f"by {beyond.max():.1e} at point {beyond.argmax()}"))
    allowed = job.settings.get("feasible")
    told = plan.failure is not None and plan.failure.cause == "predicate"
    if allowed is not None and not told and not allowed(q[reached]).all():
        faults.append(("not allowed", f"{int((~allowed(q[reached])).sum())} points"))
    if "spin_range" in job.settings and job.path.rotation is not None:
        low, high = job.settings["spin_range"]
        turn = job.path.rotation.transpose(0, 2, 1) @ frames_of(robot, q)[:, :3, :3]
        spin = (rotation_vectors(turn) @ job.task.axis)[reached]
        if (spin < low - ON_PATH).any() or (spin > high + ON_PATH).any():
            faults.append(("beyond the spin range", f"{spin.min():.6f} to {spin.max():.6f} of {low:.6f} to {high:.6f}"))
    faults += _steps(job, plan, reached)
    faults += _values(job, plan, reached)
    if plan.failure is None and job.settings.get("closed"):
        turns = np.array([letter == "R" for letter in robot.joints])
        apart = q[-1] - q[0]
        apart -= np.where(turns, 2.0 * np.pi * np.round(apart / (2.0 * np.pi)), 0.0)
        if np.abs(apart).max() > ON_PATH:
            faults.append(("not closed", f"by {np.abs(apart).max():.1e}"))
    return faults


def _steps(job: Job, plan: rd.Plan, reached: Bool) -> list[tuple[str, str]]:
    """Return steps that are too large and of which no failure speaks: those before its point count."""
    last = len(job.path) if plan.failure is None else plan.failure.point
    share = np.abs(np.diff(plan.q, axis=0)) / np.maximum(job.largest, 1e-300)
    share = np.where((reached[1:] & reached[:-1])[:, None], share, 0.0)[: max(last - 1, 0)]
    if share.max(initial=0.0) <= 1.0 + 1e-6:
        return []
    point, joint = np.unravel_index(share.argmax(), share.shape)
    kind = "too fast" if job.path.time is not None else "large step"
    ending = "" if plan.failure is None else f" (failure: {plan.failure.told(job.robot)})"
    words = f"joint {joint + 1} from point {point}: {share.max():.3g} times the largest{ending}"
    return [(kind + (" before the failure" if plan.failure else ""), words)]


def _values(job: Job, plan: rd.Plan, reached: Bool) -> list[tuple[str, str]]:
    faults: list[tuple[str, str]] = []
    if job.objective is None:
        return faults
    own = values_of(job, plan.q)
    good = reached & np.isfinite(own) & np.isfinite(plan.value) & (own < 1e6)
    apart = np.abs(own - plan.value)[good] / np.maximum(np.abs(own[good]), 1e-300)
    allowed = SAME * np.maximum(1.0, np.abs(own[good]))
    if (apart > allowed).any():
        faults.append(("another value", f"by {apart.max():.1e} of it"))
    if np.isnan(plan.value[reached]).any():
        faults.append(("value is NaN", f"{np.isnan(plan.value[reached]).sum()} points"))
    worst = float(np.max(plan.value)) if np.isfinite(plan.value).all() else np.inf
    if plan.failure is None and job.settings["criterion"] == "minimax" and plan.bound > worst + 1e-9 * abs(worst):
        faults.append(("bound above the value", f"{plan.bound!r} > {worst!r}"))
    if plan.failure is None and not np.isfinite(plan.cost) and np.isfinite(worst):
        faults.append(("cost not finite", f"{plan.cost}, worst value {worst}"))
    return faults


def values_of(job: Job, q: F64) -> F64:
    """Return the objective: kappa_F from own Jacobians and singular values (Leger 2014, eq. 2.14) where it is that."""
    objective = job.objective
    assert objective is not None
    if isinstance(objective, rd.ConditionNumber) and objective.length is not None:  # jobs have no squared ones
        rows = job.robot.rows_in_use()
        scaled = (jacobians_of(job.robot, q) * np.repeat([objective.length, 1.0], 3)[:, None])[:, rows]
        sigma = np.linalg.svd(scaled, compute_uv=False)
        with np.errstate(divide="ignore"):
            squared = (sigma**2).sum(axis=1) * (sigma**-2).sum(axis=1) / len(rows) ** 2
        return np.asarray(np.sqrt(squared))
    return np.asarray(objective.evaluate_many(job.robot, q, 0)[0])


def singular_at(job: Job, q: F64, bar: float = 1e6) -> bool:
    """Whether a motion leads through a singular posture: a condition number above a bar."""
    rows = job.robot.rows_in_use()
    sigma = np.linalg.svd(jacobians_of(job.robot, q)[:, rows], compute_uv=False)
    return bool((sigma[:, -1] * bar < sigma[:, 0]).any())


def off_path(job: Job, q: F64) -> F64:
    """Return how far tools are from a path in what the task asks for [m, rad], shape (N,)."""
    path, task = job.path, job.task
    have = frames_of(job.robot, q)
    away = have[:, :3, 3] - path.position
    if task.kind == "axisymmetric":
        return np.asarray(np.abs(np.hstack([away, have[:, :3, :3] @ task.axis - path.axis])).max(axis=1))
    if task.kind == "position":
        return np.asarray(np.abs(away).max(axis=1))
    wanted = have.copy()
    wanted[:, :3, 3] = path.position
    if path.rotation is not None:
        wanted[:, :3, :3] = path.rotation
    error = twist_errors(have, wanted)
    if task.kind != "full":
        # To first order, where directions turn with the tool.
        error = np.stack([task.projector(job.robot, row) @ e for row, e in zip(q, error, strict=True)])
    return np.asarray(np.abs(error).max(axis=1))
