"""`one_joint_minimum` at length: `python -m tests.soak one_joint` prints the worst misses and fails if a bar is missed.

Bars, in units of 1 + |g|: the value within 1e-12 of a scan of the whole cost over the range, polished where its
derivative changes sign, and within 1e-12 of the cost at the change that is returned, which is in its range.
"""

import argparse
from time import perf_counter

import numpy as np

from tests.reference.one_joint import misses, random_cases

BAR = 1e-12
AT_ONCE = 1000


def main(arguments: list[str]) -> int:
    """Run it; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak one_joint", description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    rng, begin, worst, missed = np.random.default_rng(options.seed), perf_counter(), np.zeros(2), 0
    for _ in range(-(-options.cases // AT_ONCE)):
        both = np.array(misses(random_cases(rng, AT_ONCE)))
        worst, missed = np.maximum(worst, both.max(axis=1)), missed + int((~(both <= BAR)).any(axis=0).sum())
    print(f"{options.cases} joints: value {worst[0]:.1e} from the scan, {worst[1]:.1e} from the cost at the change")
    print(f"{missed} missed, {perf_counter() - begin:.0f} s")
    return int(missed > 0)
