"""Calls of several trees of the package in turn, such as an old build and a new one.

    python -m benches.python.trees old=/path/to/another/checkout/python new=python

Each tree is a folder with `redundancy` in it and has a process of its own; the processes take turns, round by round, so
that a clock that changes while it runs changes for all. The ratios are medians over neighbouring rounds.
"""

import statistics
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter_ns
from typing import Any

from .cold import Workers

ROUNDS = 41
ROBOTS = ("3R", "6R", "7R", "9R", "12R")
METHODS = ("TwistDecomposition", "VirtualJoint", "GradientProjection", "Householder", "Elimination", "WeightedInverse")
ROWS = (
    *("fk", "jacobian", "jacobian_derivative", "inverse"),
    *("manipulability 0", "manipulability 1", "kappa 0", "kappa 1", "kappa 2", "kappa_2 1", "kappa_2 2", "many"),
    *METHODS,
    *("TaskPriority", "ResolvedRate", "TwistDecomposition by w_ps", "OrthogonalSQP", "programme", "solve"),
)


def sweep(chain: str, row: str) -> Callable[[], object] | None:
    """One call for each of many postures; nothing where a robot has no such row."""
    import numpy as np
    import redundancy as rd

    from .chains import CHAINS

    n = int(chain[:-1])
    if chain in CHAINS:
        robot, postures = CHAINS[chain].robot(), CHAINS[chain].postures()
    else:
        turn = np.resize([0.5 * np.pi, -0.5 * np.pi], n) * (n > 3)
        robot = rd.Robot.from_dh(np.full(n, 0.3), np.full(n, 0.1 * (n > 3)), turn, np.zeros(n))
        postures = list(np.random.default_rng(0).uniform(-2.0, 2.0, (256, n)))
    rows = None if n > 3 else [2, 3, 4]
    condition = rd.ConditionNumber(0.48, rows=rows)
    squared = rd.ConditionNumber(0.48, rows=rows, squared=True)
    task = rd.Task.axisymmetric() if n > 3 else rd.Task.position()
    out, twist = np.empty(n), np.array([0.1, -0.05, 0.02, 0.05, 0.1, -0.1])
    indices: dict[str, Any] = {
        "manipulability": rd.Manipulability(0.48, rows=rows),
        "kappa": condition,
        "kappa_2": rd.ConditionNumber(0.48, norm="spectral", rows=rows),
    }
    name, _, order = row.partition(" ")
    if row in ("fk", "jacobian", "jacobian_derivative"):
        call = getattr(robot, row)
        result = np.empty(call(postures[0]).shape)
        return lambda: [call(q, out=result) for q in postures]
    if row == "inverse":
        frames = list(robot.fk(np.array(postures))) if n == 6 else []
        return (lambda: [robot.inverse(frame) for frame in frames]) if n == 6 else None
    if name in indices:
        return lambda: [indices[name].evaluate(robot, q, order=int(order)) for q in postures]
    if row == "many":
        return lambda: condition.evaluate_many(robot, np.array(postures), 1, threads=1)
    if row == "solve":
        tools = robot.fk(np.array(postures[:8]))
        targets = np.hstack([tools[:, :3, 3], tools[:, :3, 2]])
        sqp = rd.OrthogonalSQP(robot, task, squared) if n > 5 else None
        return (lambda: [sqp.solve(t, q) for t, q in zip(targets, postures[8:], strict=False)]) if sqp else None
    if n == 3 and name in (*METHODS, "TaskPriority", "ResolvedRate"):
        return None
    step: Any
    if row.endswith("w_ps"):
        step = rd.TwistDecomposition(robot, task, rd.SingularityParameter(0.48, rows=rows) + 0.1 * rd.JointLimits())
    elif row == "OrthogonalSQP":
        step = rd.OrthogonalSQP(robot, task, squared)
    elif row == "programme":
        step = rd.QuadraticProgram(robot, task, squared, weight=0.1, dt=0.01, length=0.48)
    else:
        step = getattr(rd, row)(robot, task, squared + 0.1 * rd.JointLimits())
    return lambda: [step.step(q, twist, out=out) for q in postures]


def serve() -> None:
    """Answer every line `chain row` with the nanoseconds of one round, 0 where there is no such row."""
    sweeps: dict[str, tuple[Callable[[], object] | None, int]] = {}
    for line in sys.stdin:
        name = line.strip()
        if name not in sweeps:
            found, count = sweep(*name.split(" ", 1)), 1
            if found is not None:
                start = perf_counter_ns()
                found()
                count = max(1, round(2e6 / (perf_counter_ns() - start)))
            sweeps[name] = found, count
        call, count = sweeps[name]
        start = perf_counter_ns()
        if call is not None:
            for _ in range(count):
                call()
        print((perf_counter_ns() - start) // count if call is not None else 0, flush=True)


def main(trees: dict[str, str]) -> None:
    """Print for every row the median of each tree, and of its ratio to the first one."""
    workers = Workers(trees, "trees")
    for chain in ROBOTS:
        for row in ROWS:
            rounds = [workers.ask(f"{chain} {row}") for _ in range(ROUNDS + 2)][2:]
            if not all(rounds[0]):
                continue
            medians = [statistics.median(times) / 1e3 for times in zip(*rounds, strict=True)]
            ratios = [statistics.median(times[i] / times[0] for times in rounds) for i in range(len(trees))]
            parts = [f"{n} {m:9.1f} us ({r:.3f})" for n, m, r in zip(trees, medians, ratios, strict=True)]
            print(f"{chain:3} {row:26}", *parts, sep="  ", flush=True)
    workers.stop()


if __name__ == "__main__":
    here = {"here": str(Path(__file__).parents[2] / "python")}
    main(dict(argument.split("=", 1) for argument in sys.argv[1:]) or here)
