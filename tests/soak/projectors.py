"""`OrthogonalSQP.solve` at length: `python -m tests.soak projectors` prints a table and fails if a bar is missed.

Bars: for every pair of projectors that leaves a freedom, in the tool's, the base's and a part's frame, for four robots
and a hundred starts each: on the target, and "converged" with a reduced gradient below 1e-8 of the gradient's size (or
of 1), or a limit that holds it. Where the tool is within half a degree of half a turn from its target, the rotation
vector between them jumps and differences judge nothing: such starts are counted apart.
"""

import argparse
from collections import Counter
from time import perf_counter

import numpy as np
import redundancy as rd
from redundancy._util import progress_bar as progress

from tests.reference.projectors import ROBOTS, jumps, slope, tasks

HELD = 1e-8
WORST = 12


def main(arguments: list[str]) -> int:
    """Run it; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak projectors", description=__doc__)
    parser.add_argument("--starts", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    rng, begin = np.random.default_rng(options.seed), perf_counter()
    seen, missed = {name: Counter[str]() for name in ROBOTS}, []
    index, every = rd.ConditionNumber(0.4855933, squared=True), list(tasks())
    with progress(len(ROBOTS) * len(every), "projectors", True) as advance:
        for name in ROBOTS:
            robot = rd.robots.get(name)
            for which, task in every:
                advance(1)
                if task.dimension >= robot.n:
                    continue
                solver = rd.OrthogonalSQP(robot, task, index)
                for k in range(options.starts):
                    q0 = rng.uniform(np.maximum(robot.q_min, -3.0), np.minimum(robot.q_max, 3.0))
                    target = robot.fk(q0)
                    q, _, status, _ = solver.solve(target, q0)
                    if jumps(robot, q, target):
                        seen[name]["half a turn"] += 1
                        continue
                    left, size, limited = slope(solver, q, target)
                    ended = status == "converged" or (status == "on target" and limited)
                    good = ended and left <= HELD * max(1.0, size)
                    seen[name][("at a limit" if limited else status) if good else "missed"] += 1
                    if not good:
                        missed.append((left / max(1.0, size), name, which, k, status))
    for name, counts in seen.items():
        print(f"{name}: " + ", ".join(f"{count} {word}" for word, count in sorted(counts.items())))
    for ratio, *rest in sorted(missed, reverse=True)[:WORST]:
        print(f"missed: {ratio:.1e}", *rest)
    print(f"{perf_counter() - begin:.0f} s")
    # One in a thousand: beside a singularity, where differences of sixth order themselves are worse.
    return int(len(missed) > 1e-3 * sum(sum(counts.values()) for counts in seen.values()))
