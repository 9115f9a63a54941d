"""Coordinate descent at length: `python -m tests.soak descent` tells which problems miss a bar and fails if one does.

Bars, on random robots of 1 to 9 joints of both kinds with limits, goals of every kind and further terms: no sweep of
algorithms 1, 2, 3 and 5 with its search raises the cost, which is the one by forward kinematics to 1e-12 (1 + |g|);
limits hold; the gradient is that of differences to 1e-8, but where the nearest of two members of a volume changes.
"""

import argparse
from time import perf_counter

from tests.reference.descent import MONOTONE, Problem, slope_misses, uphill

KINKS = 2e-3
"""Share of problems that may start at one."""


def main(arguments: list[str]) -> int:
    """Run it; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak descent", description=__doc__)
    parser.add_argument("--problems", type=int, default=5000)
    parser.add_argument("--first", type=int, default=1000)
    options = parser.parse_args(arguments)
    begin, wrong, slopes = perf_counter(), 0, 0
    for seed in range(options.first, options.first + options.problems):
        problem = Problem(seed)
        for settings in MONOTONE:
            if words := uphill(problem, settings):
                wrong += 1
                print(f"problem {seed}, {settings}: {words}")
        if (miss := slope_misses(problem)) > 1e-8:
            slopes += 1
            print(f"problem {seed}: the gradient misses differences by {miss:.1e}")
    print(f"{options.problems} problems: {wrong} wrong, {slopes} gradients; {perf_counter() - begin:.0f} s")
    return int(wrong > 0 or slopes > KINKS * options.problems)
