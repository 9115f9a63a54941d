"""Plans of random jobs at length: `python -m tests.soak plans` prints what is wrong by kind; 1 if anything is.

Jobs are those of `tests.reference.plan_jobs`: robots of the library, planar and SCARA arms, gantries, rails; lines,
arcs, spirals, corners, motions of the joints, through and beside singular postures; every kind of task and criterion,
with and without times. Bars: no exception but the package's own, and that only where a task asks for more than a
robot can do; no warning; tool, limits, speeds, values and bound by own kinematics; no step above the largest of which
no failure speaks; no failure where a motion is known, or where brute force finds a way (on a sample of the others),
and no point "unreachable" that Newton reaches.
"""

import argparse
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from time import perf_counter

from redundancy._util import progress_bar as progress

from tests.reference import plan_jobs
from tests.reference.plan_checks import Outcome, run
from tests.reference.plan_ways import confirmed

LISTED = 6
"""Jobs that are shown of each kind of fault."""


def outcomes(seed: int, numbers: range, sample: int) -> Iterator[tuple[int, Outcome]]:
    """Yield what comes of jobs; the first failures without a known motion are checked by brute force."""
    for number in numbers:
        outcome = run(plan_jobs.job(seed, number))
        if outcome.plan is not None and outcome.plan.failure is not None and outcome.job.known is None and sample > 0:
            sample -= 1
            outcome = confirmed(outcome)
        yield number, outcome


def report(seen: list[tuple[int, Outcome]], seed: int) -> Iterator[str]:
    """Yield lines: how plans end by shape and robot, and faults by kind."""
    for what, place in (("robot", 0), ("shape", 1), ("task", 2), ("criterion", 3)):
        rows: dict[str, Counter[str]] = defaultdict(Counter)
        for _, outcome in seen:
            rows[outcome.job.name.split(", ")[place]][outcome.cause] += 1
        yield f"\n| {what} | jobs | whole | otherwise |\n|---|--:|--:|---|"
        for name, counts in sorted(rows.items()):
            others = ", ".join(f"{cause} {count}" for cause, count in counts.most_common() if cause != "whole")
            yield f"| {name} | {counts.total()} | {counts['whole']} | {others} |"
    kinds: dict[str, list[tuple[int, Outcome, str]]] = defaultdict(list)
    for number, outcome in seen:
        for kind, words in outcome.faults:
            kinds[kind].append((number, outcome, words))
    for kind, entries in sorted(kinds.items(), key=lambda item: -len(item[1])):
        yield f"\n{kind}: {len(entries)}"
        for number, outcome, words in entries[:LISTED]:
            name = f"{outcome.job.name}, {len(outcome.job.path)} points"
            yield f"  --seed {seed} --only {number} ({name}): {words}"


def main(arguments: list[str]) -> int:
    """Run it; return 1 if anything is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak plans", description=__doc__)
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first job")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="number of one job")
    parser.add_argument("--sample", type=int, default=100, help="failures checked by brute force")
    options = parser.parse_args(arguments)
    numbers = range(options.first, options.first + options.jobs)
    if options.only is not None:
        numbers = range(options.only, options.only + 1)
    begin = perf_counter()
    seen: list[tuple[int, Outcome]] = []
    with progress(len(numbers), "plans", True) as advance:
        for number, outcome in outcomes(options.seed, numbers, options.sample):
            seen.append((number, outcome))
            for kind, words in outcome.faults:
                sys.stderr.write(f"{number} ({outcome.job.name}): {kind}: {words}\n")
            advance(1)
    print("\n".join(report(seen, options.seed)))
    wrong = sum(bool(outcome.faults) for _, outcome in seen)
    cpu, wall = sum(outcome.seconds for _, outcome in seen), perf_counter() - begin
    print(f"\n{len(seen)} jobs, {wrong} with faults; {cpu:.0f} CPU seconds of plans, {wall:.0f} s in all")
    return int(wrong > 0)
