"""Plans of a tool that may tilt within a cone, beside the grid of 2 degrees in heading, tilt and spin.

``python -m evidence.planner.toleranced [--write] [--points 200] [--tilt 15] [--descartes]`` prints the table of
docs/plan.md; with --write it puts it there. The whole grid has 260 000 orientations a point, too many for a search of a
path. What is compared: values at single points with the least of the whole grid there, which no way through the grid is
below; motions and speeds with the best way through that part of the grid that is within 6 degrees of the plan. With
--descartes also Descartes (see `evidence.planner.descartes`), which samples spins alone: it plans with the tool tilted
by one angle along the whole path, and the best of nine tilts counts.
"""

import argparse
import sys
from collections.abc import Sequence
from time import perf_counter, process_time

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy._core import Lattice, angle_grid

from evidence.pages import DOCS, show, table

F64 = NDArray[np.float64]

PAGE = DOCS / "plan.md"
STEP = np.deg2rad(2.0)
"""Distance of the grid's tilts, headings and spins from each other."""
AROUND = np.deg2rad(6.0)
"""How far from the plan that part of the grid reaches in which ways are searched."""
SAMPLED = 8
"""Points at which the whole grid is looked at: the worst of the plan, and others evenly."""
Z = (0.0, 0.0, 1.0)
JUMP = 0.25
"""Longest motion of a joint from point to point [rad]."""
KAPPA = rd.ConditionNumber(0.4855933)
AXIS = rd.Task.axisymmetric()


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; with --write, put it into the page.

    Parameters
    ----------
    arguments : sequence of str, optional
        The command line; that of the process by default.

    Returns
    -------
    int
        The exit code.
    """
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=200, help="points of the path")
    parser.add_argument("--tilt", type=float, default=15.0, help="tilt of the cone [deg]")
    parser.add_argument("--descartes", action="store_true", help="compare with Descartes too")
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    options = parser.parse_args(arguments)
    tilt = float(np.deg2rad(options.tilt))
    rows: list[list[object]] = []
    for name, (robot, path) in cases(options.points).items():
        for criterion in ("minimax", "integral", "motion", "speed"):
            rows.append([name, *compared(robot, path, tilt, criterion)])
    head = ("path", "criterion", "spin alone", "spin and tilt", "grid of 2 deg", "CPU [s]", "wall [s]")
    text = table(head, rows)
    if options.descartes:
        text = f"{text}\n\n{beside_descartes(options.points, tilt)}"
    show(PAGE, [("toleranced", text)], options.write)
    return 0


def cases(points: int) -> dict[str, tuple[rd.Robot, rd.Toolpath]]:
    """Return robots and paths: the milled helix, and a wave over a table with the tool pointing down.

    Parameters
    ----------
    points : int
        Points of each path.
    """
    helix = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0), points=points)
    s = np.linspace(0.0, 1.0, points)
    position = np.stack([0.85 + 0.05 * np.sin(6.0 * s), 0.8 * s - 0.4, np.full(points, 0.8)], axis=1)
    tool = np.eye(4)
    tool[:3, 3] = 0.1, 0.0, 0.1
    return {
        "helix": (rd.robots.get("fanuc_m710ic50_milling"), helix),
        "wave": (
            rd.robots.get("abb_irb2400").with_tool(tool),
            rd.Toolpath(position, np.tile([0.0, 0.0, -1.0], (points, 1))),
        ),
    }


def compared(robot: rd.Robot, path: rd.Toolpath, tilt: float, criterion: str) -> list[object]:
    """Return a row of the table: criterion, what is minimised without tilt, with it and on the grid, times [s]."""
    task = rd.Task.within(rd.OrientationVolume.cone(tilt))
    alone = rd.plan(robot, path, AXIS, KAPPA, criterion, progress=False)
    start = perf_counter(), process_time()
    plan = rd.plan(robot, path, task, KAPPA, criterion, progress=False)
    wall, processor = perf_counter() - start[0], process_time() - start[1]
    if plan.failure is not None or alone.failure is not None:
        sys.exit(f"no plan: {alone!r}, {plan!r}")
    if criterion in ("minimax", "integral"):
        of = "worst" if criterion == "minimax" else "mean"
        worth, grid = at_points(plan, tilt, criterion)
        texts = [_value(alone, criterion), _value(plan, criterion), f"{worth:.5f}, grid {grid:.5f} ({of} of {SAMPLED})"]
    else:
        best = around(plan, task, tilt, criterion)
        texts = [f"{_total(each, criterion):.5f}" for each in (alone, plan)] + [f"{best:.5f} around the plan"]
    return [f'"{criterion}"', *texts, f"{processor:.2f}", f"{wall:.2f}"]


def _value(plan: rd.Plan, criterion: str) -> str:
    value = plan.value.max() if criterion == "minimax" else rd.planning.core_path(plan.path).weights @ plan.value
    return f"{value:.5f}"


def _total(plan: rd.Plan, criterion: str) -> float:
    """Return the motion, or the time of a metre [s]."""
    return plan.motion if criterion == "motion" else 1.0 / plan.speed


def at_points(plan: rd.Plan, tilt: float, criterion: str) -> tuple[float, float]:
    """Return worst or mean value of a plan at some points, and of the least values of the whole grid there.

    Parameters
    ----------
    plan : Plan
        Within a cone.
    tilt : float
        Of the cone [rad].
    criterion : str
        "minimax" or "integral".
    """
    count = len(plan.path)
    points = [int(np.argmax(plan.value)), *np.linspace(0, count - 1, SAMPLED - 1).round().astype(int)]
    rotation = rd.planning.core_path(plan.path).frames(AXIS)
    spins = angle_grid(True, round(2.0 * np.pi / STEP), None)
    rings = np.append(np.arange(STEP, tilt, STEP), tilt)
    headings = np.arange(0.0, 2.0 * np.pi, STEP)
    tilts = [(0.0, 0.0), *((ring, heading) for ring in rings for heading in headings)]
    least = np.full(len(points), np.inf)
    for i, point in enumerate(points):
        frames = np.tile(rotation[point], (len(tilts), 1, 1))
        frames[:, :3, :3] = rotation[point, :3, :3] @ np.array([_swing(*each) for each in tilts])
        lattice = Lattice(plan.robot, frames, AXIS, spins, [], np.zeros((1, 0)), KAPPA)
        value, _ = lattice.survey(0, len(tilts))
        least[i] = np.nanmin(value)
    worth = plan.value[points]
    return (worth.max(), least.max()) if criterion == "minimax" else (worth.mean(), least.mean())


def around(plan: rd.Plan, task: rd.Task, tilt: float, criterion: str) -> float:
    """Return the least motion, or time of a metre, over the grid's ways that stay near a plan.

    Parameters
    ----------
    plan : Plan
        Within a cone.
    task : Task
        The cone.
    tilt : float
        Of the cone [rad].
    criterion : str
        "motion" or "speed".
    """
    core = rd.planning.core_path(plan.path)
    rotation = core.frames(task)[:, :3, :3]
    found = core.tilts(plan.robot, task, plan.q)
    length = np.linalg.norm(np.diff(plan.path.position, axis=0), axis=1)
    steps = np.arange(-AROUND, AROUND + 0.5 * STEP, STEP)
    cost, before = np.zeros(1), plan.q[:1]
    for i in range(len(plan.path)):
        x, y = found[i, 0] * np.cos(found[i, 1]), found[i, 0] * np.sin(found[i, 1])
        # Tilts on a lattice of the grid's step that is the same at all points, spins likewise.
        lean = [np.round(centre / STEP) * STEP + steps for centre in (x, y)]
        spins = np.round(found[i, 2] / STEP) * STEP + steps
        poses = [
            _pose(
                plan.path.position[i],
                rotation[i] @ _swing(np.hypot(a, b), np.arctan2(b, a)) @ _about((0.0, 0.0, 1.0), spin),
            )
            for a in lean[0]
            for b in lean[1]
            if np.hypot(a, b) <= tilt
            for spin in spins
        ]
        q = np.array([row for pose in poses for row in _near(plan.robot, pose, plan.q[i])])
        if i == 0:
            cost, before = np.zeros(len(q)), q
            continue
        after = np.full(len(q), np.inf)
        for k, row in enumerate(q):
            step = np.abs(row - before)
            free = (step <= JUMP).all(axis=1)
            if criterion == "motion":
                through = cost + (step**2).sum(axis=1) / core.shares[i - 1]
            else:
                through = np.maximum(cost, (step / plan.robot.qd_max).max(axis=1) / length[i - 1])
            after[k] = through[free].min(initial=np.inf)
        cost, before = after, q
    return float(cost.min())


def _near(robot: rd.Robot, pose: F64, q: F64) -> F64:
    """Return the posture of a pose that is next to one, as rows: none where it is far."""
    found = robot.inverse(pose, near=q)
    rows = np.atleast_2d(found)[:1]
    return rows[(np.abs(rows - q) <= 1.0).all(axis=1) & robot.within_limits(rows)]


def _pose(position: F64, rotation: F64) -> F64:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def _swing(tilt: float, heading: float) -> F64:
    """Return the rotation by a tilt towards a heading."""
    return _about((-np.sin(heading), np.cos(heading), 0.0), tilt)


def _about(axis: tuple[float, float, float], angle: float) -> F64:
    return rd.quaternion.matrix(rd.quaternion.about(axis, angle))


def beside_descartes(points: int, tilt: float) -> str:
    """Return a table of the joints' way by Descartes over spins at nine tilts, and by a plan over the cone.

    Parameters
    ----------
    points : int
        Points of the wave of `evidence.planner.descartes`.
    tilt : float
        Of the cone [rad].
    """
    from evidence.planner.descartes import DOWNWARDS, ROBOT, axis_of, descartes, tesseract, wave

    tesseract("planning")
    position = wave(points)
    base = np.diag([1.0, -1.0, -1.0])
    start, best = (perf_counter(), process_time()), (np.inf, "")
    for lean, heading in [(0.0, 0.0), *((tilt, heading) for heading in np.arange(0.0, 2.0 * np.pi, np.pi / 4.0))]:
        turned = rd.quaternion.from_matrix(base @ _swing(lean, heading))
        q = descartes(position, tuple(turned))()
        best = min(best, (float(np.abs(np.diff(q, axis=0)).sum()), f"tilted towards {np.rad2deg(heading):.0f} deg"))
    peer = perf_counter() - start[0], process_time() - start[1]
    robot = rd.robots.get(ROBOT)
    path = rd.Toolpath(position, np.tile(axis_of(DOWNWARDS), (points, 1)))
    start = perf_counter(), process_time()
    plan = rd.plan(robot, path, rd.Task.within(rd.OrientationVolume.cone(tilt)), criterion="motion", progress=False)
    own = perf_counter() - start[0], process_time() - start[1]
    rows = [
        ["Descartes, spins of 2 deg at nine fixed tilts", f"{best[0]:.4f}, {best[1]}", f"{peer[0]:.2f}, {peer[1]:.2f}"],
        ["`rd.plan` over the cone", f"{np.abs(np.diff(plan.q, axis=0)).sum():.4f}", f"{own[0]:.2f}, {own[1]:.2f}"],
    ]
    return table(("planner", "joint path [rad]", "time, wall and CPU [s]"), rows)


if __name__ == "__main__":
    sys.exit(main())
