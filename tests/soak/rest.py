"""Rest in front of goals out of reach, at length: `python -m tests.soak rest` prints a table; 1 if a bar was missed.

Two hundred random goals for four robots, two thirds beyond the arm's length and one third with limits in the way, every
method, ticks of 1 to 10 ms, stiffness 1e4 to 1e6, five starts each, the error asked for in one tick. Bars: after five
seconds no joint moves faster than 1e-3 rad/s, and an independent optimiser that starts there makes |e|^2 / 2 less by
no more than 1e-4. `--slow` asks for 10 1/s of the error instead, `--methods`, `--goals` and `--starts` choose less.
"""

import argparse
from time import perf_counter

import numpy as np
from redundancy._util import progress_bar as progress

from tests.reference.rest import LOOPS, ROBOTS, SAME_COST, STILL, cost_left, loop, random_goal, send, within


def main(arguments: list[str]) -> int:
    """Run it; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak rest", description=__doc__)
    parser.add_argument("--goals", type=int, default=200)
    parser.add_argument("--starts", type=int, default=5)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--slow", action="store_true")
    parser.add_argument("--methods", nargs="+", default=list(LOOPS))
    options = parser.parse_args(arguments)
    rng, begin = np.random.default_rng(options.seed), perf_counter()
    goals = [random_goal(rng, ROBOTS[k % 4], k % 3 == 2, options.slow) for k in range(options.goals)]
    starts = [[rng.uniform(*within(goal.robot)) for _ in range(options.starts)] for goal in goals]
    missed = 0
    with progress(len(goals) * len(options.methods), "to rest", True) as advance:
        for method in options.methods:
            runs, moving, higher, fastest, worst = 0, 0, 0, 0.0, 0.0
            for goal, places in zip(goals, starts, strict=True):
                advance(1)
                if loop(goal, method).task != goal.task:
                    continue  # without resolution every component counts
                for place in places:
                    q, rate = send(goal, method, place)
                    left = cost_left(goal, q)
                    if np.isnan(left):
                        continue  # within reach after all
                    runs, moving, higher = runs + 1, moving + (rate >= STILL), higher + (left >= SAME_COST)
                    fastest, worst = max(fastest, rate), max(worst, left)
            print(
                f"{method}: {runs} runs, {moving} not at rest (fastest {fastest:.1e} rad/s), "
                f"{higher} above a minimum (by {worst:.1e} at most)",
                flush=True,
            )
            missed += moving + higher
    print(f"{perf_counter() - begin:.0f} s")
    return int(missed > 0)
