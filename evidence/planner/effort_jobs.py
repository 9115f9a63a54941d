"""Jobs on which `evidence.planner.effort` measures what planning costs: parts as people have them, and the forty paths.

`python -m evidence.planner.effort_jobs NAME [effort]` plans one of them and prints what came of it as JSON: it runs
in a process of its own, with whatever build of the package is found there.
"""

import json
import resource
import sys
import time
from collections.abc import Callable
from typing import Any, Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from evidence.planner import cases

F64 = NDArray[np.float64]
Job = tuple[rd.Robot, rd.Toolpath, dict[str, Any]]

LENGTH: Final = 0.4
"""Characteristic length of the parts' objective [m]."""


def _tool(angle: float, x: float, z: float) -> F64:
    """Return a tool whose axis is turned about y [deg], with its tip at x and z [m]."""
    cosine, sine = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    return np.array([[cosine, 0, sine, x], [0, 1, 0, 0], [-sine, 0, cosine, z], [0, 0, 0, 1]])


def pipe_weld(
    centre: tuple[float, ...], main: float, branch: float, points: int, duration: float | None
) -> rd.Toolpath:
    """Return the closed seam of a pipe on a larger one, the torch leaning by 45 deg."""
    turn = np.linspace(0.0, 2.0 * np.pi, points)
    turn[-1] = 0.0
    x, y = branch * np.cos(turn), branch * np.sin(turn)
    position = np.array(centre) + np.stack([x, y, np.sqrt(main**2 - y**2)], axis=1)
    axis = -np.sqrt(0.5) * np.stack([np.cos(turn), np.sin(turn), np.ones(points)], axis=1)
    return rd.Toolpath(position, axis, time=None if duration is None else np.linspace(0.0, duration, points))


def raster_on_cap(centre: tuple[float, ...], radius: float, half: float, rows: int, points: int) -> rd.Toolpath:
    """Return rows to and fro over a spherical cap of half an opening [rad], the tool normal to it."""
    normals = []
    for i, u in enumerate(np.linspace(-half, half, rows)):
        v = np.linspace(-half, half, points)[:: 1 if i % 2 == 0 else -1]
        normals.append(np.stack([np.full(points, np.sin(u)), np.sin(v) * np.cos(u), np.cos(u) * np.cos(v)], axis=1))
    normal = np.concatenate(normals)
    return rd.Toolpath(np.array(centre) + radius * normal, -normal)


def straight(first: tuple[float, ...], last: tuple[float, ...], axis: tuple[float, ...], points: int) -> rd.Toolpath:
    """Return a straight line."""
    return rd.Toolpath(np.linspace(first, last, points), np.tile(np.array(axis), (points, 1)))


def spiral(centre: tuple[float, ...], inner: float, outer: float, turns: int, points: int) -> rd.Toolpath:
    """Return a flat spiral, the tool downwards."""
    share = np.linspace(0.0, 1.0, points)
    radius, turn = inner + (outer - inner) * share, 2.0 * np.pi * turns * share
    flat = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * share], axis=1)
    return rd.Toolpath(np.array(centre) + flat, np.tile([0.0, 0.0, -1.0], (points, 1)))


def _part(robot: str, tool: tuple[float, float, float], path: rd.Toolpath, closed: bool = False) -> Job:
    placed = rd.robots.get(robot).with_tool(_tool(*tool))
    return placed, path, {"objective": rd.ConditionNumber(LENGTH), "closed": closed}


def _case(name: str, robot: str, criterion: str) -> Job:
    case = cases.case(name, robot)
    settings = {"objective": rd.ConditionNumber(case.length), "closed": case.closed, "criterion": criterion}
    return case.robot, case.path, settings


SPINDLE: Final = (90.0, 0.15, 0.12)
TORCH: Final = (45.0, 0.05, 0.35)

PARTS: Final[dict[str, Callable[[], Job]]] = {
    "ur5e, closed pipe weld in 10 s": lambda: _part(
        "ur5e", (45.0, 0.03, 0.25), pipe_weld((-0.4, -0.2, 0.1), 0.12, 0.05, 201, 10.0), closed=True
    ),
    "ur10e, line of 1.6 m": lambda: _part(
        "ur10e", TORCH, straight((-0.6, -0.8, 0.2), (-0.6, 0.8, 0.2), (-0.7, 0.0, -0.7), 161)
    ),
    "irb2400, raster on a cap": lambda: _part(
        "abb_irb2400", SPINDLE, raster_on_cap((1.0, 0.1, 0.35), 0.25, 0.6, 9, 35)
    ),
    "m710ic50, raster on a cap": lambda: _part(
        "fanuc_m710ic50", SPINDLE, raster_on_cap((1.4, 0.0, 0.3), 0.3, 0.6, 20, 25)
    ),
}
"""Parts as people have them."""


def _cap(rows: int, points: int) -> Callable[[], Job]:
    return lambda: _part("fanuc_m710ic50", SPINDLE, raster_on_cap((1.4, 0.0, 0.3), 0.3, 0.6, rows, points))


LONG: Final[dict[str, Callable[[], Job]]] = {
    "iiwa14, closed pipe weld": lambda: _part(
        "kuka_iiwa14", (45.0, 0.03, 0.2), pipe_weld((0.55, 0.0, 0.3), 0.12, 0.05, 91, None), closed=True
    ),
    "m710ic50, raster of 1000": _cap(25, 40),
    "m710ic50, raster of 2000": _cap(25, 80),
    "m710ic50, raster of 20000": _cap(100, 200),
    "irb2400, spiral of 20000": lambda: _part("abb_irb2400", TORCH, spiral((1.0, 0.0, 0.4), 0.01, 0.25, 40, 20000)),
}
"""Long paths, and one that took long."""


def _paths(criterion: str) -> dict[str, Callable[[], Job]]:
    return {
        f"{robot}, {build.__name__}, {criterion}": (
            lambda name=build.__name__, robot=robot: _case(name, robot, criterion)  # type: ignore[misc]
        )
        for robot in cases.REACH
        for build in cases.SHAPES
    }


PATHS: Final = _paths("minimax") | _paths("integral")
"""The paths of docs/plan_comparison.md."""
JOBS: Final = PARTS | LONG | PATHS


def planned(name: str, effort: int | None) -> dict[str, Any]:
    """Plan a job and return what came of it: seconds, memory, worst value or cost, gap, largest step, failure."""
    robot, path, settings = JOBS[name]()
    wall, cpu = time.perf_counter(), time.process_time()
    plan = rd.plan(robot, path, effort=effort, progress=False, **settings)
    cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    worst = settings.get("criterion", "minimax") == "minimax"
    return {
        "points": len(path),
        "cpu": cpu,
        "wall": wall,
        "megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
        "value": float(np.max(plan.value)) if worst else float(plan.cost),
        "gap": float(plan.gap),
        "timed": path.time is not None,
        "step": float(np.abs(np.diff(plan.q, axis=0)).max()),
        "failure": None if plan.failure is None else str(plan.failure),
    }


if __name__ == "__main__":
    chosen, *more = sys.argv[1:]
    sys.stdout.write(json.dumps(planned(chosen, int(more[0]) if more else None)) + "\n")
