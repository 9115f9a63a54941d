"""Lines and circles of seven-axis arms with full poses, planned by default for the least motion, beside a grid search.

``python -m evidence.planner.seven_axis [--write] [--count N] [--held N] [robot ...]`` prints the table of
docs/plan_measured.md; with --write it puts it there. Each path is made from a known motion within the limits, in a time
in which that motion takes nine tenths of a speed limit, so every path has a way. The grid search is
`evidence.planner.held_joint`: the best over the held joints (--held: so many with the largest share in the null space
along the known motion) and over all branches.
"""

import argparse
import sys
import time
from dataclasses import dataclass
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy.planning import core_path

from evidence.pages import DOCS, show, table
from evidence.planner.held_joint import Way, least_motion

F64 = NDArray[np.float64]

PAGE: Final = DOCS / "plan_measured.md"
ROBOTS: Final = ("panda", "kuka_iiwa14", "baxter_left")
POINTS: Final = 50
LENGTH: Final = 0.25
"""Length of a line [m]."""
RADIUS: Final = 0.08
"""Radius of a circle [m]."""
TURN: Final = 0.5
"""Turn of the tool along every second path [rad]."""
SPEED: Final = 0.9
"""Part of a speed limit that the known motion takes."""
ON_PATH: Final = 1e-9
SAME: Final = 0.01
"""Part of the grid's motion by which a plan may be above it."""


@dataclass(frozen=True, eq=False)
class Job:
    """A path of a robot, and a motion along it that is known."""

    robot: rd.Robot
    path: rd.Toolpath
    known: F64

    @property
    def largest(self) -> F64:
        """Largest motions of the joints from point to point [rad]."""
        time = self.path.time
        assert time is not None
        largest: F64 = np.diff(time)[:, None] * self.robot.qd_max
        return largest


@dataclass(frozen=True, eq=False)
class Measured:
    """A plan beside a grid search: CPU seconds, motions, and what is wrong with the plan, empty if nothing is."""

    job: Job
    plan: rd.Plan
    way: Way | None
    plan_seconds: float
    grid_seconds: float
    fault: str

    @property
    def ratio(self) -> float:
        """Motion of the plan over that of the grid; NaN where one of them is not whole."""
        return float("nan") if self.way is None or self.fault else self.plan.motion / self.way.motion


def job(name: str, number: int) -> Job:
    """Return a path by its number: lines and circles by turns, every second pair with a tool that turns."""
    robot = rd.robots.get(name)
    rng = np.random.default_rng([number, *name.encode()])
    while True:
        q0 = rng.uniform(robot.q_min, robot.q_max)
        known = _followed(robot, q0, _frames(robot.fk(q0), number, rng))
        if known is not None:
            break
    frames = robot.fk(known)
    needed = float((np.abs(np.diff(known, axis=0)) / robot.qd_max).max())
    clock = np.linspace(0.0, (POINTS - 1) * needed / SPEED, POINTS)
    return Job(robot, rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], frames[:, :3, :3], clock), known)


def _frames(first: F64, number: int, rng: np.random.Generator) -> F64:
    s = np.linspace(0.0, 1.0, POINTS)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    frames = np.tile(first, (POINTS, 1, 1))
    if number % 2 == 0:
        frames[:, :3, 3] += LENGTH * s[:, None] * turn[:, 0]
    else:
        angle = 2.0 * np.pi * s[:, None]
        frames[:, :3, 3] += RADIUS * ((np.cos(angle) - 1.0) * turn[:, 0] + np.sin(angle) * turn[:, 1])
    if number % 4 >= 2:
        angles = TURN * (s if number % 2 == 0 else np.sin(np.pi * s) ** 2)
        x, y, z = turn[:, 2]
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        sine, versine = np.sin(angles)[:, None, None], (1.0 - np.cos(angles))[:, None, None]
        frames[:, :3, :3] = (np.eye(3) + sine * cross + versine * (cross @ cross)) @ first[:3, :3]
    return frames


def _followed(robot: rd.Robot, q0: F64, frames: F64) -> F64 | None:
    """Return the motion of least joint motion from point to point; None where it leaves the limits or gets stuck."""
    q = np.empty((len(frames), robot.n))
    now = q0.copy()
    for i, frame in enumerate(frames):
        for _ in range(10):
            tool = robot.fk(now)
            turn = frame[:3, :3] @ tool[:3, :3].T
            # The odd part of a small turn; Newton makes it exact.
            odd = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
            error = np.concatenate([odd, frame[:3, 3] - tool[:3, 3]])
            if np.abs(error).max() < 1e-13:
                break
            now = now + np.linalg.lstsq(robot.jacobian(now), error, rcond=None)[0]
        within = (now >= robot.q_min).all() and (now <= robot.q_max).all()
        if not within or np.abs(error).max() > 1e-11 or (i and np.abs(now - q[i - 1]).max() > 0.2):
            return None
        q[i] = now
    return q


def measure(name: str, number: int, held: int) -> Measured:
    """Plan a path by default and search it on a grid."""
    case = job(name, number)
    begin = time.process_time()
    plan = rd.plan(case.robot, case.path, rd.Task.full(), criterion="motion", progress=False)
    plan_seconds = time.process_time() - begin
    begin = time.process_time()
    shares = core_path(case.path).shares
    frames = case.robot.fk(case.known)
    found = [least_motion(case.robot, frames, shares, case.largest, joint) for joint in _free_joints(case, held)]
    ways = [way for way in found if way is not None]
    way = min(ways, key=lambda way: way.motion) if ways else None
    grid_seconds = time.process_time() - begin
    return Measured(case, plan, way, plan_seconds, grid_seconds, fault(case, plan))


def _free_joints(case: Job, count: int) -> list[int]:
    """Return the joints with the largest share in the null space along the known motion."""
    null = np.linalg.svd(case.robot.jacobian(case.known))[2][:, -1]
    return [int(joint) for joint in np.argsort(-np.abs(null).mean(axis=0))[:count]]


def fault(case: Job, plan: rd.Plan) -> str:
    """Return what is wrong with a plan, from its joints alone."""
    if plan.failure is not None:
        return f"failure: {plan.failure.told(case.robot)}"
    tools = case.robot.fk(plan.q)
    away = max(np.abs(tools[:, :3, 3] - case.path.position).max(), np.abs(tools - case.robot.fk(case.known)).max())
    if not away <= ON_PATH:
        return f"off the path by {away:.1e}"
    beyond = max((case.robot.q_min - plan.q).max(), (plan.q - case.robot.q_max).max())
    if not beyond <= ON_PATH:
        return f"beyond a limit by {beyond:.1e}"
    speed = (np.abs(np.diff(plan.q, axis=0)) / case.largest).max()
    return f"too fast: {speed:.6f}" if speed > 1.0 + 1e-7 else ""


def row(name: str, results: list[Measured]) -> list[object]:
    """Return a line of the table."""
    whole = [r for r in results if not r.fault]
    ratios = np.array([r.ratio for r in whole if np.isfinite(r.ratio)])
    spread = f"{ratios.min():.4f}, {np.median(ratios):.4f}, {ratios.max():.4f}" if len(ratios) else ""
    seconds = [f"{np.median(x):.2f}, {np.max(x):.2f}" for x in zip(*_seconds(results), strict=True)]
    return [
        name,
        len(results),
        len(whole),
        sum(r.way is None for r in results),
        spread,
        f"{int((ratios <= 1.0 + SAME).sum())} of {len(ratios)}",
        *seconds,
    ]


def _seconds(results: list[Measured]) -> list[tuple[float, float]]:
    return [(r.plan_seconds, r.grid_seconds) for r in results]


def main(arguments: list[str]) -> int:
    """Print the table; 1 if a plan is wrong, or above the grid."""
    parser = argparse.ArgumentParser(prog="python -m evidence.planner.seven_axis", description=__doc__)
    parser.add_argument("robots", nargs="*", metavar="robot", default=list(ROBOTS))
    parser.add_argument("--count", type=int, default=100, help="paths for each robot")
    parser.add_argument("--first", type=int, default=0, help="number of the first path")
    parser.add_argument("--held", type=int, default=3, help="joints that the grid search holds, one after another")
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    options = parser.parse_args(arguments)
    rows, good = [], True
    for name in options.robots:
        results = []
        for number in range(options.first, options.first + options.count):
            result = measure(name, number, options.held)
            results.append(result)
            words = result.fault or f"plan {result.plan.motion:.5f}, ratio {result.ratio:.4f}"
            sys.stderr.write(
                f"{name} {number}: {words}, {result.plan_seconds:.2f} s, grid {result.grid_seconds:.1f} s\n"
            )
            sys.stderr.flush()
        good &= all(not result.fault and not result.ratio > 1.0 + SAME for result in results)
        rows.append(row(name, results))
    head = ("robot", "paths", "planned whole", "the grid finds no way", "motion, plan over grid: least, median, most")
    show(
        PAGE,
        [
            (
                "seven axes",
                table(
                    (*head, f"within {SAME:.0%} or better", "CPU of a plan: median, most [s]", "of the grid [s]"), rows
                ),
            )
        ],
        options.write,
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
