"""Inverse kinematics at length: `python -m tests.soak inverse` prints tables and fails if a bar is missed.

Bars: the posture a pose was made from is among the solutions, to 1e-9 rad where there is a closed form and to 1e-7 rad
in at least 999 of 1000 postures of any other arm; every solution takes the tool to the pose to 1e-9; none comes twice.

Near a singularity rounding of the pose alone moves the posture by its size over the smallest singular value of J. A
miss whose distance times that value is below `ROUNDING` is counted and listed like any other, but nobody could have
avoided it and it fails no bar.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
import redundancy as rd
from redundancy._util import progress_bar as progress

from tests.reference.arms import PLACES, distance, pose_error, random_arm, smallest_singular_value
from tests.reference.chain import F64
from tests.soak.options import scaled

CLOSED_FORM, GENERAL = 1e-9, 1e-7
SHARE = 0.999
ON_THE_POSE = 1e-9
TWICE = 1e-7
ROUNDING = 3e-15
CHUNK = 1000
LISTED = 40


@dataclass
class Miss:
    """A posture that is not among the solutions of its pose."""

    arm: str
    q: F64
    solutions: int
    """How many were returned."""
    nearest: float
    """Distance of the nearest one [rad]; infinite without any."""
    polished: float
    """The same after two Newton steps from there."""
    sigma: float
    """Smallest singular value of J at the posture, SI units."""

    @property
    def rounding(self) -> bool:
        """Whether rounding of the pose explains it."""
        return self.nearest * self.sigma <= ROUNDING


@dataclass
class Row:
    """What is counted of one arm, or of several."""

    name: str
    tolerance: float
    share: float = 1.0
    arms: int = 0
    postures: int = 0
    seconds: float = 0.0
    worst: float = 0.0
    """Largest distance that is no miss [rad]."""
    off: float = 0.0
    """Largest error of a solution's pose."""
    twice: int = 0
    numbers: Counter[int] = field(default_factory=Counter)
    misses: list[Miss] = field(default_factory=list)
    poorest: float = 1.0
    """Smallest share of recovered postures of one arm."""

    @property
    def passed(self) -> bool:
        """Whether every bar is met."""
        recovered = all(miss.rounding for miss in self.misses) if self.share == 1.0 else self.poorest >= self.share
        return recovered and self.off <= ON_THE_POSE and self.twice == 0

    def add(self, robot: rd.Robot, label: str, q: F64, advance: Callable[[int], None]) -> None:
        """Count postures of one arm."""
        missed = 0
        for start in range(0, len(q), CHUNK):
            part = q[start : start + CHUNK]
            missed += self._chunk(robot, label, part)
            advance(len(part))
        self.arms += 1
        self.postures += len(q)
        self.poorest = min(self.poorest, 1.0 - missed / len(q))

    def _chunk(self, robot: rd.Robot, label: str, q: F64) -> int:
        poses = robot.fk(q)
        begin = perf_counter()
        answers = [robot.inverse(pose) for pose in poses]
        self.seconds += perf_counter() - begin
        counts = np.array([len(answer) for answer in answers])
        self.numbers.update(counts.tolist())
        solutions, owner = np.concatenate(answers), np.repeat(np.arange(len(q)), counts)
        if len(solutions):
            self.off = max(self.off, float(np.abs(pose_error(poses[owner], robot.fk(solutions))).max()))
        padded = np.full((len(q), 16, 6), np.nan)
        padded[np.arange(16) < counts[:, None]] = solutions
        for lag in range(1, 16):
            # Comparisons with the padding are false.
            self.twice += int((distance(padded[:, lag:], padded[:, :-lag]) < TWICE).sum())
        nearest = np.full(len(q), np.inf)
        np.minimum.at(nearest, owner, distance(solutions, q[owner]))
        found = nearest <= self.tolerance
        self.worst = max(self.worst, float(nearest[found].max(initial=0.0)))
        for i in np.flatnonzero(~found):
            polished = np.inf
            if counts[i]:
                polished = float(
                    distance(_newton(robot, poses[i], answers[i][distance(answers[i], q[i]).argmin()]), q[i])
                )
            sigma = float(smallest_singular_value(robot, q[i]))
            self.misses.append(Miss(label, q[i], int(counts[i]), float(nearest[i]), polished, sigma))
        return int((~found).sum())


def _newton(robot: rd.Robot, pose: F64, q: F64) -> F64:
    for _ in range(2):
        q = q + np.linalg.lstsq(robot.jacobian(q), pose_error(pose[None], robot.fk(q)[None])[0], rcond=1e-15)[0]
    return q


def library(count: int, rng: np.random.Generator, advance: Callable[[int], None]) -> Iterator[Row]:
    """Every arm of six revolute joints that comes with the package."""
    for name in rd.robots.names():
        robot = rd.robots.get(name)
        if robot.joints == "RRRRRR":
            row = Row(f"{name} ({robot.structure})", CLOSED_FORM)
            row.add(robot, name, rng.uniform(-np.pi, np.pi, (count, 6)), advance)
            yield row


def random_arms(kind: str, arms: int, count: int, seed: int, advance: Callable[[int], None]) -> Iterator[Row]:
    """Random arms: a row for each place of the axes that meet or are parallel."""
    for place in range(PLACES[kind]):
        axes = f" {place + 1} to {place + 3}" if kind != "general" else ""
        row = Row(f"random {kind}{axes}", *((GENERAL, SHARE) if kind == "general" else (CLOSED_FORM, 1.0)))
        for index in range(arms // PLACES[kind]):
            rng = np.random.default_rng([seed, sorted(PLACES).index(kind), place, index])
            robot = random_arm(rng, kind, place).robot()
            label = f'random_arm(default_rng({[seed, sorted(PLACES).index(kind), place, index]}), "{kind}", {place})'
            row.add(robot, label, rng.uniform(-np.pi, np.pi, (count, 6)), advance)
        yield row


def _tables(rows: list[Row]) -> Iterator[str]:
    yield (
        "| arm | arms | postures | misses | of them by rounding | worst that is none [rad] | poorest arm | worst pose"
        " | twice | solutions | us a pose | |"
    )
    yield "|---|--:|--:|--:|--:|--:|--:|--:|--:|---|--:|---|"
    for row in rows:
        rounding = sum(miss.rounding for miss in row.misses)
        numbers = ", ".join(f"{k}: {n / row.postures:.1%}" for k, n in sorted(row.numbers.items()))
        yield (
            f"| {row.name} | {row.arms} | {row.postures} | {len(row.misses)} | {rounding} | {row.worst:.1e}"
            f" | {row.poorest:.2%} | {row.off:.1e} | {row.twice} | {numbers} | {1e6 * row.seconds / row.postures:.1f}"
            f" | {'pass' if row.passed else '**missed**'} |"
        )
    misses = [miss for row in rows for miss in row.misses]
    if misses:
        yield f"\nMisses by distance times smallest singular value, {min(LISTED, len(misses))} of {len(misses)}:\n"
        yield "| arm | posture | solutions | distance [rad] | after Newton | sigma_min | product | |"
        yield "|---|---|--:|--:|--:|--:|--:|---|"
        for miss in sorted(misses, key=lambda miss: -miss.nearest * miss.sigma)[:LISTED]:
            yield (
                f"| {miss.arm} | {miss.q.tolist()} | {miss.solutions} | {miss.nearest:.1e} | {miss.polished:.1e}"
                f" | {miss.sigma:.1e} | {miss.nearest * miss.sigma:.1e} | {'rounding' if miss.rounding else ''} |"
            )


def main(arguments: list[str] | None = None) -> int:
    """Run the soak.

    Parameters
    ----------
    arguments : list of str, optional
        Command-line arguments, by default those of the process.

    Returns
    -------
    int
        Exit status, 1 if a bar was missed.
    """
    options = scaled((__doc__ or "").splitlines()[0], "postures", arguments)
    size = options.scale
    each = max(1, round(1e5 * size))
    few, many = max(1, round(100 * size)), max(1, round(1000 * size))
    sixes = sum(rd.robots.get(name).joints == "RRRRRR" for name in rd.robots.names())
    rng = np.random.default_rng(options.seed)
    with progress(sixes * each + 1200 * few + 200 * many, "postures") as advance:
        rows = [
            *library(each, rng, advance),
            *random_arms("wrist", 1000, few, options.seed, advance),
            *random_arms("parallel", 200, few, options.seed, advance),
            *random_arms("general", 200, many, options.seed, advance),
        ]
    print("\n".join(_tables(rows)))
    return 0 if all(row.passed for row in rows) else 1
