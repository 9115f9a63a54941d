"""What the default plan costs beside one search of another build of the package, in the same run.

``python -m evidence.planner.effort --against FOLDER [--today] [--repeat N] [--write] [word ...]`` plans the parts and
the paths of `evidence.planner.effort_jobs` in processes of their own, by turns with this package and, with
``effort=1``, with the one in the folder (its ``redundancy`` with its compiled library), and prints the table of
docs/plan_measured.md; words choose jobs whose names have them. With --today the other build plans by default too: its
values and gaps stand beside. ``--long`` plans the long paths by this package alone, with seconds and memory.
"""

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import redundancy as rd

from evidence.pages import DOCS, ROOT, show, table
from evidence.planner.effort_jobs import LONG, PARTS, PATHS

PAGE: Final = DOCS / "plan_measured.md"
GAP: Final = 1e-3
"""Gap that is wide."""
SAME: Final = 1e-6
"""Part of a value that a plan may give away: the planner's smoothness."""
STEP: Final = 0.25
"""Largest step of a path without times [rad]: ways before took larger ones."""
MEDIAN, WORST = 3.0, 6.0
"""Most CPU seconds, as multiples of one search of the other build."""


@dataclass(frozen=True)
class Measured:
    """What the builds made of a job: this one by default, the other by one search and by default."""

    name: str
    new: dict[str, Any]
    old: dict[str, Any]
    today: dict[str, Any] | None

    @property
    def ratio(self) -> float:
        """CPU seconds of this build by default over those of one search of the other."""
        return float(self.new["cpu"] / self.old["cpu"])

    @property
    def reference(self) -> dict[str, Any]:
        """What the value is compared with."""
        return self.old if self.today is None else self.today

    @property
    def better(self) -> float:
        """How much the value is better, as a part of it; NaN where a plan is not whole, or its steps are too large."""
        large = not self.reference["timed"] and self.reference["step"] > STEP
        if self.new["failure"] or self.reference["failure"] or large:
            return float("nan")
        return float(1.0 - self.new["value"] / self.reference["value"])


def planned(package: Path, name: str, effort: int | None, repeat: int = 1) -> dict[str, Any]:
    """Return what a build makes of a job; of several runs the one with the fewest CPU seconds."""
    command = [sys.executable, "-m", "evidence.planner.effort_jobs", name, *([] if effort is None else [str(effort)])]
    environment = os.environ | {"PYTHONPATH": str(package)}
    runs = []
    for _ in range(repeat):
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"{name}: {done.stderr}")
        runs.append(json.loads(done.stdout))
    best: dict[str, Any] = min(runs, key=lambda run: run["cpu"])
    return best


def measured(names: list[str], against: Path, today: bool, repeat: int) -> Iterator[Measured]:
    """Yield what the builds make of jobs, by turns."""
    here = Path(rd.__file__).parents[1]
    for name in names:
        new = planned(here, name, None, repeat)
        old = planned(against, name, 1, repeat)
        result = Measured(name, new, old, planned(against, name, None) if today else None)
        sys.stderr.write(
            f"{name}: {new['cpu']:.2f} s, {old['cpu']:.2f} s, ratio {result.ratio:.2f}, better by {result.better:+.1e},"
            f" gaps {new['gap']:.1e} {result.reference['gap']:.1e} {new['failure'] or ''}\n"
        )
        sys.stderr.flush()
        yield result


def rows(results: list[Measured]) -> str:
    """Return the table of jobs."""
    lines = [
        [
            r.name,
            r.new["points"],
            f"{r.new['cpu']:.2f}",
            f"{r.old['cpu']:.2f}",
            f"{r.ratio:.2f}",
            f"{r.new['value']:.6f}",
            f"{r.better:+.1e}",
            f"{abs(r.new['gap']):.0e}",
            f"{abs(r.reference['gap']):.0e}",
            f"{r.new['step']:.3f}",
            r.new["failure"] or "",
        ]
        for r in results
    ]
    head = ("job", "points", "CPU, default [s]", "CPU, one search before [s]", "ratio", "value", "better by [part]")
    return table((*head, "gap", "gap before", "largest step [rad]", "failure"), lines)


def summary(results: list[Measured]) -> str:
    """Return what counts: ratios, values, gaps."""
    ratios = np.array([r.ratio for r in results])
    worse = sum(r.better < -SAME for r in results)
    wide = [
        sum(abs(x["gap"]) > GAP for x in side) for side in zip(*((r.new, r.reference) for r in results), strict=True)
    ]
    line = [
        len(results),
        f"{np.median(ratios):.2f}, {ratios.max():.2f} ({results[int(ratios.argmax())].name})",
        worse,
        f"{wide[0]}, {wide[1]}",
        sum(bool(r.new["failure"]) for r in results),
    ]
    head = ("jobs", "ratio: median, most", "worse than before", f"gaps above {GAP:g}: now, before", "failures")
    return table(head, [line])


def long(names: list[str]) -> str:
    """Return the table of the long paths."""
    here = Path(rd.__file__).parents[1]
    lines = []
    for name in names:
        got = planned(here, name, None)
        lines.append(
            [
                name,
                got["points"],
                f"{got['wall']:.1f}",
                f"{got['cpu']:.1f}",
                f"{got['megabytes']:.0f}",
                f"{got['value']:.6f}",
                f"{abs(got['gap']):.0e}",
                f"{got['step']:.3f}",
                got["failure"] or "",
            ]
        )
        sys.stderr.write(f"{lines[-1]}\n")
    head = ("path", "points", "seconds", "CPU seconds", "memory [MB]", "value", "gap", "largest step [rad]", "failure")
    return table(head, lines)


def main(arguments: list[str]) -> int:
    """Print the tables; 1 if the ratios or the values are worse than they may be."""
    parser = argparse.ArgumentParser(prog="python -m evidence.planner.effort", description=__doc__)
    parser.add_argument("words", nargs="*", help="words of the names of jobs")
    parser.add_argument("--against", type=Path, help="folder with another build of the package")
    parser.add_argument("--today", action="store_true", help="plan by default with the other build too")
    parser.add_argument("--repeat", type=int, default=1, help="runs of which the fastest counts")
    parser.add_argument("--long", action="store_true", help="plan the long paths")
    parser.add_argument("--write", action="store_true", help="put the tables into the page")
    options = parser.parse_args(arguments)
    sections, good = [], True
    if options.long:
        sections.append(("long paths", long(_chosen(list(LONG), options.words))))
    if options.against:
        chosen = _chosen([*PARTS, *PATHS], options.words)
        results = list(measured(chosen, options.against.resolve(), options.today, options.repeat))
        sections += [("effort", summary(results)), ("effort by job", rows(results))]
        ratios = [r.ratio for r in results]
        good = bool(np.median(ratios) <= MEDIAN and max(ratios) <= WORST and not any(r.better < -SAME for r in results))
    if not sections:
        parser.error("--against FOLDER or --long")
    show(PAGE, sections, options.write)
    return 0 if good else 1


def _chosen(names: list[str], words: list[str]) -> list[str]:
    return [name for name in names if not words or any(word in name for word in words)]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
