"""Plans of random jobs at length: `python -m tests.soak plans` prints what is wrong by kind; 1 if anything is.

Jobs are those of `tests.reference.plan_jobs`: robots of the library, planar and SCARA arms, gantries, rails; lines,
arcs, spirals, corners, motions of the joints, through and beside singular postures; every kind of task and criterion,
with and without times. Bars: no exception but the package's own, and that only where a task asks for more than a robot
can do; no warning; tool, limits, speeds, values and bound by own kinematics; no step above the largest of which no
failure speaks; no failure where a motion is known, or where brute force finds a way (on a sample of the others), and no
point "unreachable" that Newton reaches. Each job runs in a process of its own, for no more than `--patience` seconds.
"""

import argparse
import multiprocessing
import sys
from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from time import perf_counter

from redundancy._util import progress_bar as progress

from tests.reference import plan_jobs
from tests.reference.plan_checks import run
from tests.reference.plan_ways import confirmed

LISTED = 6
"""Jobs that are shown of each kind of fault."""


@dataclass(frozen=True)
class Result:
    """What is counted of a job."""

    name: str
    points: int
    cause: str
    faults: list[tuple[str, str]]
    seconds: float
    searched: bool
    """Whether brute force was asked about a failure."""


def _measured(seed: int, number: int, ask: bool, pipe: Connection) -> None:
    job = plan_jobs.job(seed, number)
    pipe.send((job.name, len(job.path)))
    outcome = run(job)
    searched = ask and outcome.plan is not None and outcome.plan.failure is not None and job.known is None
    if searched:
        outcome = confirmed(outcome)
    pipe.send((outcome.cause, outcome.faults, outcome.seconds, searched))


def measured(seed: int, number: int, ask: bool, patience: float) -> Result:
    """Return what comes of a job in a process of its own."""
    here, there = multiprocessing.Pipe(duplex=False)
    process = multiprocessing.get_context("fork").Process(target=_measured, args=(seed, number, ask, there))
    process.start()
    there.close()
    name, points = f"job {number}", 0
    try:
        if here.poll(patience):
            name, points = here.recv()
        if here.poll(patience):
            return Result(name, points, *here.recv())
    except EOFError:
        process.join()
        return Result(name, points, "died", [("died", f"exit code {process.exitcode}")], 0.0, False)
    finally:
        process.kill()
        process.join()
    return Result(name, points, "slow", [("slow", f"not done after {patience:.0f} s")], patience, False)


def report(seen: list[tuple[int, Result]], seed: int) -> Iterator[str]:
    """Yield lines: how plans end by robot, shape, task and criterion, and faults by kind."""
    for place, what in enumerate(("robot", "shape", "task", "criterion")):
        rows: dict[str, Counter[str]] = defaultdict(Counter)
        for _, result in seen:
            rows[result.name.split(", ")[place] if result.points else "none"][result.cause] += 1
        yield f"\n| {what} | jobs | whole | otherwise |\n|---|--:|--:|---|"
        for name, counts in sorted(rows.items()):
            others = ", ".join(f"{cause} {count}" for cause, count in counts.most_common() if cause != "whole")
            yield f"| {name} | {counts.total()} | {counts['whole']} | {others} |"
    kinds: dict[str, list[str]] = defaultdict(list)
    for number, result in seen:
        for kind, words in result.faults:
            kinds[kind].append(f"  --seed {seed} --only {number} ({result.name}, {result.points} points): {words}")
    for kind, entries in sorted(kinds.items(), key=lambda item: -len(item[1])):
        yield "\n".join([f"\n{kind}: {len(entries)}", *entries[:LISTED]])


def main(arguments: list[str]) -> int:
    """Run it; return 1 if anything is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak plans", description=__doc__)
    parser.add_argument("--jobs", type=int, default=2000)
    parser.add_argument("--first", type=int, default=0, help="number of the first job")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="number of one job")
    parser.add_argument("--sample", type=int, default=100, help="failures checked by brute force")
    parser.add_argument("--patience", type=float, default=240.0, help="seconds for a job")
    options = parser.parse_args(arguments)
    numbers = range(options.first, options.first + options.jobs)
    if options.only is not None:
        numbers = range(options.only, options.only + 1)
    begin, searched = perf_counter(), 0
    seen: list[tuple[int, Result]] = []
    with progress(len(numbers), "plans", True) as advance:
        for number in numbers:
            result = measured(options.seed, number, searched < options.sample, options.patience)
            searched += result.searched
            seen.append((number, result))
            for kind, words in result.faults:
                sys.stderr.write(f"{number} ({result.name}, {result.points} points): {kind}: {words}\n")
            advance(1)
    print("\n".join(report(seen, options.seed)))
    wrong = sum(bool(result.faults) for _, result in seen)
    cpu, wall = sum(result.seconds for _, result in seen), perf_counter() - begin
    print(f"\n{len(seen)} jobs, {wrong} with faults, {searched} failures searched by brute force;", end=" ")
    print(f"{cpu:.0f} CPU seconds of plans, {wall:.0f} s in all")
    return int(wrong > 0)
