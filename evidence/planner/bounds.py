"""Bounds of plans beside a ten times finer search, and largest steps of paths sampled twice as finely.

``python -m evidence.planner.bounds [--count N] [--first K] [--write]`` prints two tables of docs/plan_measured.md.
Paths are the shapes of `evidence.planner.cases` at random places in front of its robots, with and without times, 15
to 60 points. The finer search is `evidence.planner.grid_search` over ten times the spins of the planner's grid, and
the planner's own one search over as many: no way may have a worst value below the bound. After halving the spacing
the largest step should halve.
"""

import argparse
import sys
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy.planning import core_path

from evidence.pages import DOCS, show, table
from evidence.planner import cases, grid_search
from evidence.planner.grid import make_grid

F64 = NDArray[np.float64]

PAGE: Final = DOCS / "plan_measured.md"
SPINS: Final = 480
"""Ten times those of the planner's grid."""
STEP: Final = 0.25
"""Largest motion of a joint from point to point of a path without times [rad]."""
ABOVE: Final = 1e-9
"""Part of a value by which a bound is not above it."""
SMOOTH: Final = ("circle_tilted", "cylinder_outside", "cylinder_inside", "sphere_spiral", "figure_eight", "dash")
"""Shapes without corners."""


@dataclass(frozen=True, eq=False)
class Measured:
    """A plan: name, bound, worst values of the plan and of two finer searches (infinite where these find no way)."""

    name: str
    bound: float
    plan: float
    grid: float
    fine: float
    halved: float
    """Largest step on the path sampled twice as finely over that of the plan; NaN where that is not asked."""

    @property
    def least(self) -> float:
        """Worst value of the best way that is known."""
        return min(self.plan, self.grid, self.fine)

    @property
    def excess(self) -> float:
        """How far the bound is above the best way, as a part of its value; negative where it is below."""
        return self.bound / self.least - 1.0


@dataclass(frozen=True, eq=False)
class Draw:
    """A random path: its robot, its shape, where it is and how long it takes."""

    robot: str
    shape: int
    place: tuple[float, ...]
    points: int
    duration: float | None

    @property
    def smooth(self) -> bool:
        """Whether the path has no corners."""
        return cases.SHAPES[self.shape].__name__ in SMOOTH

    def case(self, points: int) -> cases.Case:
        """Return the path with so many points."""
        build = cases.SHAPES[self.shape]
        shape = build(points)
        path = cases.placed(shape, self.place, self.duration)
        return cases.Case(
            build.__name__, cases.robot_named(self.robot), path, shape.closed, cases.REACH[self.robot] / 3.0
        )


def drawn(number: int) -> Draw:
    """Return a random path by its number; it may have no way."""
    rng = np.random.default_rng([17, number])
    robot = list(cases.REACH)[rng.integers(len(cases.REACH))]
    shape = int(rng.integers(len(cases.SHAPES)))
    reach, yaw = cases.REACH[robot], rng.uniform(-np.pi, np.pi)
    out = reach * rng.uniform(0.35, 0.75)
    where = (out * np.cos(yaw), out * np.sin(yaw), reach * rng.uniform(-0.1, 0.5))
    turns = (rng.uniform(-180.0, 180.0), rng.uniform(-20.0, 20.0))
    duration = float(rng.uniform(0.8, 5.0)) if rng.random() < 0.3 else None
    size = reach * rng.uniform(0.1, 0.5)
    return Draw(robot, shape, (*where, size, *turns), int(rng.integers(15, 60)), duration)


def planned(case: cases.Case, n_angles: int = 48, effort: int | None = None) -> rd.Plan:
    """Plan a path with the largest step of one without times."""
    return rd.plan(
        case.robot,
        case.path,
        objective=rd.ConditionNumber(case.length),
        closed=case.closed,
        max_step=STEP if case.path.time is None else None,
        n_angles=n_angles,
        effort=effort,
        progress=False,
    )


def measure(number: int) -> Measured | None:
    """Plan a random path and search it ten times finer; None where there is no plan."""
    draw = drawn(number)
    case = draw.case(draw.points)
    plan = planned(case)
    if plan.failure is not None:
        return None
    objective = rd.ConditionNumber(case.length)
    grid = make_grid(case.robot, case.path, objective, core_path(case.path).shares, case.closed, SPINS)
    if case.path.time is None:
        grid = replace(grid, largest=np.minimum(grid.largest, STEP))
    found = grid_search.minimax(grid)
    fine = planned(case, SPINS, 1)
    halved = float("nan")
    if draw.duration is None and draw.smooth:
        finer = planned(draw.case(2 * draw.points - 1))
        halved = _largest(finer.q) / _largest(plan.q) if finer.failure is None else np.inf
    return Measured(
        f"{case.robot.name} {case.name}",
        plan.bound,
        float(np.max(plan.value)),
        np.inf if found is None else found.objective,
        float(np.max(fine.value)) if fine.failure is None else np.inf,
        halved,
    )


def _largest(q: F64) -> float:
    return float(np.abs(np.diff(q, axis=0)).max())


def bounds(results: list[Measured]) -> str:
    """Return the table of bounds."""
    excess = np.array([r.excess for r in results])
    gaps = np.array([(r.plan - r.bound) / r.plan for r in results])
    better = np.array([r.plan / r.least - 1.0 for r in results])
    line = [
        len(results),
        f"{int((excess > ABOVE).sum())}",
        f"{excess.max():+.1e}",
        f"{int((gaps > 1e-3).sum())}",
        f"{int((better > 1e-6).sum())}, by {better.max():.1e} at most",
    ]
    head = ("plans", "bounds above a finer search", "most by [part]", "gaps above 0.1 %", "plans above a finer search")
    return table(head, [line])


def steps(results: list[Measured]) -> str:
    """Return the table of largest steps at half the spacing."""
    ratios = np.sort([r.halved for r in results if not np.isnan(r.halved)])
    if not len(ratios):
        return "no path"
    parts = [f"{np.quantile(ratios, share):.3f}" for share in (0.0, 0.1, 0.5, 0.9, 1.0)]
    return table(("paths", "least", "10 %", "median", "90 %", "most"), [[len(ratios), *parts]])


def main(arguments: list[str]) -> int:
    """Print the tables; 1 if a bound is above a value."""
    parser = argparse.ArgumentParser(prog="python -m evidence.planner.bounds", description=__doc__)
    parser.add_argument("--count", type=int, default=500, help="plans")
    parser.add_argument("--first", type=int, default=0, help="number of the first path")
    parser.add_argument("--write", action="store_true", help="put the tables into the page")
    options = parser.parse_args(arguments)
    results: list[Measured] = []
    number = options.first
    while len(results) < options.count:
        result = measure(number)
        if result is not None:
            results.append(result)
            sys.stderr.write(
                f"{number} {result.name}: bound {result.bound:.6f}, plan {result.plan:.6f}, grid {result.grid:.6f},"
                f" fine {result.fine:.6f}, half spacing {result.halved:.3f}"
                f"{'  ABOVE' if result.excess > ABOVE else ''}\n"
            )
            sys.stderr.flush()
        number += 1
    show(PAGE, [("bounds", bounds(results)), ("half the spacing", steps(results))], options.write)
    return int(any(result.excess > ABOVE for result in results))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
