"""`redundancy.plan` beside a grid search.

``python -m evidence.planner.compare [--write] [--quick] [--effort=N] [name ...]`` prints the tables of
docs/plan_comparison.md, each between two marks; with --write it puts them into the page and draws its pictures. With
--quick only paths of up to 151 points are compared, with names only these robots and paths. Times are of the machine
that runs it.
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Literal

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy._path_frames import shares

from evidence.pages import DOCS, IMAGES, show, table
from evidence.planner import cases as plan_cases
from evidence.planner import grid_search
from evidence.planner.grid import JUMP, SPINS, Grid, make_grid

F64 = NDArray[np.float64]
Criterion = Literal["minimax", "integral"]

PAGE = DOCS / "plan_comparison.md"
CRITERIA: Final[tuple[Criterion, ...]] = ("minimax", "integral")
ROBOTS: Final = set(plan_cases.REACH)
PATHS: Final = {build.__name__ for build in plan_cases.SHAPES}
QUICK_POINTS: Final = 151
PRECISION: Final = 1e-6
"""Part of the value that the planner may give away for less motion: its `smoothness` where none is given."""
ON_PATH: Final = 1e-8
WITHIN: Final = 1e-7
"""Error of a plan that is none [m, rad], and excess over a limit that is none [rad, or part of a speed]."""
PICTURED: Final = (("abb_irb2400", "figure_eight"), ("fanuc_m710ic50_milling", "star"), ("ur5e", "dash"))


@dataclass(frozen=True, eq=False)
class Comparison:
    """One case under one criterion.

    Attributes
    ----------
    case : Case
        Robot and path.
    criterion : str
        Criterion.
    plan : Plan
        The planner's.
    grid : Found or None
        The grid's; None where it has no way.
    plan_value, grid_value : float
        Worst value; or integral of value and smoothness times squared speed.
    plan_time, grid_time : float
        Seconds.
    used : float
        Largest part of the window of spin changes that the grid's way uses.
    fault : str
        What is wrong with the plan, checked here; empty if nothing is.
    """

    case: plan_cases.Case
    criterion: Criterion
    plan: rd.Plan
    grid: grid_search.Found | None
    plan_value: float
    grid_value: float
    plan_time: float
    grid_time: float
    used: float
    fault: str

    @property
    def difference(self) -> float:
        """How much the plan is better, as a part of the grid's value."""
        return (self.grid_value - self.plan_value) / self.grid_value

    @property
    def never_worse(self) -> bool:
        """Whether the plan is right, and not worse than the grid but for what it may give away."""
        return not self.fault and (self.grid is None or self.difference >= -PRECISION)

    @property
    def smoother(self) -> bool:
        """Whether the plan has the smaller second differences."""
        return self.grid is None or bend(self.plan.q) <= bend(self.grid.q)

    @property
    def verdict(self) -> str:
        """What the table says."""
        if self.fault:
            return f"**{self.fault}**"
        if self.grid is None:
            return "only the plan"
        level = "better" if self.difference > PRECISION else "equal" if self.never_worse else "**worse**"
        return f"{level}, {'smoother' if self.smoother else '**rougher**'}"


def bend(q: F64) -> float:
    """Return the root mean square of the second differences of the joints [rad]."""
    return float(np.sqrt((np.diff(q, 2, axis=0) ** 2).mean()))


def speed_share(case: plan_cases.Case, q: F64) -> float:
    """Return the largest joint speed as a part of its limit; NaN without times."""
    if case.path.time is None:
        return float("nan")
    return float((np.abs(np.diff(q, axis=0)) / np.diff(case.path.time)[:, None] / case.robot.qd_max).max())


def condition_numbers(robot: rd.Robot, q: F64, length: float) -> F64:
    """Return kappa_F of postures from singular values (Leger 2014, eq. 2.14)."""
    scaled = np.array([robot.jacobian(row) for row in q]) * np.repeat([length, 1.0], 3)[:, None]
    sigma = np.linalg.svd(scaled, compute_uv=False)
    values: F64 = np.sqrt((sigma**2).sum(axis=1) * (sigma**-2).sum(axis=1)) / 6.0
    return values


def compare(case: plan_cases.Case, effort: int | None = None) -> list[Comparison]:
    """Plan a case and search its grid, under each criterion."""
    objective = rd.ConditionNumber(case.length)
    begin = time.perf_counter()
    grid = make_grid(case.robot, case.path, objective, shares(case.path), case.closed)
    making = time.perf_counter() - begin
    results = []
    for criterion in CRITERIA:
        begin = time.perf_counter()
        plan = rd.plan(
            case.robot,
            case.path,
            objective=objective,
            criterion=criterion,
            closed=case.closed,
            effort=effort,
            progress=False,
        )
        planning = time.perf_counter() - begin
        begin = time.perf_counter()
        found = grid_search.minimax(grid) if criterion == "minimax" else grid_search.integral(grid, plan.smoothness)
        searching = time.perf_counter() - begin + making
        values = [
            float("nan") if q is None else measure(case, grid, criterion, plan.smoothness, q)
            for q in (plan.q, None if found is None else found.q)
        ]
        results.append(
            Comparison(
                case,
                criterion,
                plan,
                found,
                values[0],
                values[1],
                planning,
                searching,
                used(grid, found),
                fault(case, plan),
            )
        )
    return results


def used(grid: Grid, found: grid_search.Found | None) -> float:
    """Return the largest change of the spin as a part of the window."""
    if found is None:
        return float("nan")
    change = np.abs(np.diff(found.spin))
    return float(np.minimum(change, SPINS - change).max() / grid.window)


def measure(case: plan_cases.Case, grid: Grid, criterion: Criterion, smoothness: float, q: F64) -> float:
    """Return what is minimised, from the joints alone."""
    value = condition_numbers(case.robot, q, case.length)
    if criterion == "minimax":
        return float(value.max())
    return float(grid.weights @ value) + smoothness * grid.motion(q)


def fault(case: plan_cases.Case, plan: rd.Plan) -> str:
    """Return what is wrong with a plan: a failure that it tells, or a fault of path, limits, speed or end."""
    if plan.failure is not None:
        return f"failure: {plan.failure}"
    q, robot = plan.q, case.robot
    tools = robot.fk(q)
    away = max(
        np.abs(tools[:, :3, 3] - case.path.position).max(),
        np.linalg.norm(tools[:, :3, 2] - case.path.axis, axis=1).max(),
    )
    if not away <= ON_PATH:
        return f"off the path by {away:.1e}"
    beyond = max((robot.q_min - q).max(), (q - robot.q_max).max())
    if not beyond <= WITHIN:
        return f"beyond a limit by {beyond:.1e}"
    if speed_share(case, q) > 1.0 + WITHIN:
        return f"too fast: {speed_share(case, q):.6f}"
    if case.closed:
        turns = (q[-1] - q[0]) / (2.0 * np.pi)
        if np.abs(turns - np.round(turns)).max() > WITHIN:
            return "not closed"
    jump = float(np.abs(np.diff(q, axis=0)).max())
    steady = case.path.time is not None or jump <= JUMP + WITHIN
    return "" if steady else f"jumps by {jump:.2f} rad"


def rows_of(results: Sequence[Comparison], criterion: Criterion) -> str:
    """Return the table of a criterion."""
    rows = []
    for r in results:
        if r.criterion != criterion:
            continue
        grid = r.grid
        proof = r.plan.gap if criterion == "minimax" else float("nan") if grid is None else r.grid_value - grid.bound
        shares_used = [speed_share(r.case, q) for q in (r.plan.q, *(() if grid is None else (grid.q,)))]
        rows.append(
            [
                r.case.robot.name.removesuffix("_milling"),
                r.case.name,
                len(r.case.path),
                f"{r.plan_value:.6f}",
                "none" if grid is None else f"{r.grid_value:.6f}",
                "" if grid is None else f"{r.difference:+.1e}",
                f"{abs(proof):.0e}" if np.isfinite(proof) else "",
                f"{bend(r.plan.q):.2e}",
                "" if grid is None else f"{bend(grid.q):.2e}",
                ", ".join(f"{share:.3f}" for share in shares_used if np.isfinite(share)),
                f"{r.plan_time:.2f}, {r.grid_time:.1f}",
                r.verdict,
            ]
        )
    proof_head = "plan's gap to its bound" if criterion == "minimax" else "grid's gap to its bound"
    head = ("robot", "path", "points", "plan", "grid", "plan is better by [part]", proof_head)
    return table(
        (*head, "bend, plan [rad]", "bend, grid", "speed, plan, grid", "time, plan, grid [s]", "verdict"), rows
    )


def summary(results: Sequence[Comparison]) -> str:
    """Count."""
    rows = []
    for criterion in CRITERIA:
        own = [r for r in results if r.criterion == criterion]
        both = [r for r in own if r.grid is not None and not r.fault]
        better = [r.difference for r in both]
        smoother = [bend(r.grid.q) / bend(r.plan.q) for r in both if r.grid is not None]
        rows.append(
            [
                criterion,
                len(own),
                sum(r.never_worse for r in own),
                sum(r.smoother and not r.fault for r in own),
                sum(r.grid is None for r in own),
                sum(r.used == 1.0 for r in own),
                f"{min(better):+.1e} to {max(better):+.1e}",
                f"{min(smoother):.2f} to {max(smoother):.1f}, {np.median(smoother):.1f}",
                f"{sum(r.plan_time for r in own):.0f}, {sum(r.grid_time for r in own):.0f}",
            ]
        )
    head = (
        "criterion",
        "cases",
        "never worse",
        "smoother",
        "the grid finds no way",
        "its window binds",
        "plan is better by [part]",
    )
    return table((*head, "bend, grid over plan: range, median", "time in all, plan, grid [s]"), rows)


def draw(results: Sequence[Comparison], folder: Path) -> None:
    """Draw three maps with the spins of plan and grid."""
    from redundancy import plots

    for robot, name in PICTURED:
        r = next(
            (r for r in results if (r.case.robot.name, r.case.name, r.criterion) == (robot, name, "minimax")), None
        )
        if r is None or r.grid is None:
            continue
        chart = rd.redundancy_map(
            r.case.robot, r.case.path, objective=rd.ConditionNumber(r.case.length), progress=False
        )
        lines = [
            plots.MapLine(chart.spin_of(replace(r.plan, q=q)), label=label)
            for q, label in ((r.grid.q, "grid"), (r.plan.q, "plan"))
        ]
        figure = plots.redundancy_map_figure(
            chart.value, chart.cause, chart.angles, lines=lines, title=f"{r.case.robot.name}, {name}"
        )
        plots.save(figure, folder / f"plan_comparison_{name}.png")


def main(arguments: list[str]) -> int:
    """Print the tables; with --write, put them into the page and draw the picture."""
    results: list[Comparison] = []
    names = {argument for argument in arguments if not argument.startswith("--")}
    effort = next((int(a.removeprefix("--effort=")) for a in arguments if a.startswith("--effort=")), None)
    for case in plan_cases.cases():
        if "--quick" in arguments and len(case.path) > QUICK_POINTS:
            continue
        if any(names & every and one not in names for one, every in ((case.robot.name, ROBOTS), (case.name, PATHS))):
            continue
        for result in compare(case, effort):
            results.append(result)
            sys.stderr.write(
                f"{case.robot.name} {case.name} {result.criterion}: {result.plan_value:.6f} {result.grid_value:.6f}"
                f" {result.verdict} ({result.plan_time:.2f} s, {result.grid_time:.1f} s), window {result.used:.2f}\n"
            )
            sys.stderr.flush()
    sections = {"summary": summary(results)} | {criterion: rows_of(results, criterion) for criterion in CRITERIA}
    write = "--write" in arguments
    show(PAGE, sections.items(), write)
    if write:
        draw(results, IMAGES)
    return 0 if all(r.never_worse and r.smoother for r in results) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
