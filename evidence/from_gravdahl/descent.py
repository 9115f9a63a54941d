"""How far the five algorithms come, beside damped Newton: the tables of docs/descent.md.

``python -m evidence.from_gravdahl.descent [--write | --check]`` sweeps from the same starts to the same goals with
every algorithm. A goal is reached within 1e-4 m and 1e-3 rad. Near goals are the pose of the start's joints moved by up
to 0.2 rad (a tenth of that in metres for a joint that slides), random ones that of another posture within the limits.
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any, Final

import numpy as np
import numpy.typing as npt
import redundancy as rd

from evidence.pages import DOCS, marked, show, stale, table

PAGE: Final = DOCS / "descent.md"
GOALS: Final = 100
NEAR: Final = 0.2
SLIDE: Final = 0.1
"""A joint that slides moves by this part of a metre where one that turns moves by a radian."""
EARLY: Final = 10
POSITION, ORIENTATION = 1e-4, 1e-3
NEWTON_STEPS: Final = 100
STARTERS: Final = 5
ALGORITHMS: Final[dict[str, tuple[int, dict[str, Any]]]] = {
    "1, end to base": (300, {"algorithm": 1}),
    "1, base to end": (300, {"algorithm": 1, "order": "base_to_end"}),
    "1, double": (150, {"algorithm": 1, "order": "double"}),
    "2, largest decrease": (300, {"algorithm": 2}),
    "3, largest rate": (300, {"algorithm": 3}),
    "4, w_s = 1 / sum W": (300, {"algorithm": 4}),
    "5, with search": (300, {"algorithm": 5}),
    "5, as printed": (300, {"algorithm": 5, "rule": "printed"}),
}

_F64 = npt.NDArray[np.float64]
_Way = tuple[bool, int, float]
"""Whether a goal is reached, after how many sweeps, and the root of the cost after ten."""


def puma() -> rd.Robot:
    """Return a PUMA 560 with a tool of 0.25 m, its limits as published."""
    tool = np.eye(4)
    tool[2, 3] = 0.25
    quarter = np.pi / 2
    degrees = [(-160, 160), (-45, 225), (-225, 45), (-110, 170), (-100, 100), (-266, 266)]
    low, high = np.deg2rad(degrees).T
    return rd.Robot.from_dh(
        [0, 0.4318, 0.0203, 0, 0, 0],
        [0, 0, 0.15005, 0.4318, 0, 0],
        [quarter, 0, -quarter, quarter, -quarter, 0],
        [0] * 6,
        tool=tool,
        q_min=low,
        q_max=high,
    )


def robots() -> dict[str, rd.Robot]:
    """Return the robots of the tables."""
    others = {"UR5e": "ur5e", "LBR iiwa 14": "kuka_iiwa14", "Stanford arm": "stanford_arm"}
    return {"PUMA 560": puma()} | {shown: rd.robots.get(name) for shown, name in others.items()}


def starts_and_goals(robot: rd.Robot, near: bool) -> Iterator[tuple[_F64, _F64]]:
    """Yield starts and poses to reach."""
    rng = np.random.default_rng(1)
    low, high = (np.clip(limit, -np.pi, np.pi) for limit in (robot.q_min, robot.q_max))
    size = np.where([kind == "R" for kind in robot.joints], 1.0, SLIDE)
    for _ in range(GOALS):
        q0, other = rng.uniform(low, high), rng.uniform(low, high)
        moved = np.clip(q0 + size * rng.uniform(-NEAR, NEAR, robot.n), low, high)
        yield q0, robot.fk(moved if near else other)


def swept(robot: rd.Robot, q0: _F64, goal: _F64, sweeps: int, settings: dict[str, Any]) -> _Way:
    """Sweep to a goal."""
    descent = rd.CoordinateDescent(robot, goal, **settings)
    found = descent.solve(q0, sweeps, position_tolerance=POSITION, orientation_tolerance=ORIENTATION)
    early = found.costs[min(EARLY, found.iterations)]
    return found.status == "converged", found.iterations, float(np.sqrt(early))


def newton(robot: rd.Robot, q0: _F64, goal: _F64) -> _Way:
    """Go to a goal by damped steps that keep the limits, damped by the error (Sugihara 2011)."""
    q, length, caution = q0.copy(), np.sqrt(2 * weight(robot)), 1.0
    left = error(robot, q, goal, length)
    for k in range(NEWTON_STEPS):
        if np.linalg.norm(left[3:]) <= POSITION and np.linalg.norm(left[:3]) / length <= ORIENTATION:
            return True, k, float(np.linalg.norm(left))
        j = robot.jacobian(q) * np.repeat([length, 1.0], 3)[:, None]
        damping = 0.05 * caution * left @ left + 1e-12
        step = np.linalg.solve(j.T @ j + damping * np.eye(robot.n), j.T @ left)
        trial = np.clip(q + step / max(1.0, np.abs(step).max()), robot.q_min, robot.q_max)
        there = error(robot, trial, goal, length)
        better = there @ there < left @ left
        caution = max(0.3 * caution, 1e-3) if better else 10 * caution
        if better:
            q, left = trial, there
    return False, NEWTON_STEPS, float(np.linalg.norm(left))


def started(robot: rd.Robot, q0: _F64, goal: _F64) -> _Way:
    """Go there by Newton's method after a few sweeps of algorithm 1."""
    q = rd.CoordinateDescent(robot, goal).trace(q0, STARTERS).q[-1]
    return newton(robot, q, goal)


def weight(robot: rd.Robot) -> float:
    """Return the weight of orientation that the package suggests."""
    return rd.CoordinateDescent(robot, np.eye(4)).w_o


def error(robot: rd.Robot, q: _F64, goal: _F64, length: float) -> _F64:
    """Return what is left to a pose: the rotation vector times a length, and the translation [m]."""
    tool = robot.fk(q)
    axis, angle = rd.quaternion.axis_angle(rd.quaternion.from_matrix(goal[:3, :3] @ tool[:3, :3].T))
    return np.concatenate([length * angle * np.asarray(axis), goal[:3, 3] - tool[:3, 3]])


def row(name: str, sweeps: int, solve: Callable[[rd.Robot, _F64, _F64], _Way], robot: rd.Robot) -> list[str]:
    """Return what a method makes of near and of random goals."""
    cells = [name, str(sweeps)]
    for near in (True, False):
        ways = [solve(robot, q0, goal) for q0, goal in starts_and_goals(robot, near)]
        done = [count for reached, count, _ in ways if reached]
        cells += [f"{len(done)}", f"{np.median(done):.0f}" if done else ""]
        cells.append("" if name.startswith("damped") else f"{np.median([early for *_, early in ways]):.1e}")
    return cells


def results(robot: rd.Robot) -> str:
    """Return the table of a robot."""
    rows = [
        row("damped Newton", NEWTON_STEPS, newton, robot),
        row(f"damped Newton after {STARTERS} sweeps of 1", NEWTON_STEPS, started, robot),
    ]
    for name, (sweeps, settings) in ALGORITHMS.items():
        rows.append(row(name, sweeps, partial(swept, sweeps=sweeps, settings=settings), robot))
    head = ("method", "sweeps or steps at most", "near goals reached", "sweeps, median", "sqrt g after 10 sweeps")
    return table((*head, "random goals reached", "sweeps, median", "sqrt g after 10 sweeps"), rows)


def sections() -> Iterator[tuple[str, str]]:
    """Yield the tables by their marks."""
    for name, robot in robots().items():
        yield f"descent {name}", results(robot)


def main(arguments: list[str]) -> int:
    """Print the tables; 1 if the page shows others."""
    parser = argparse.ArgumentParser(prog="python -m evidence.from_gravdahl.descent", description=__doc__)
    parser.add_argument("--write", action="store_true", help="put the tables into the page")
    parser.add_argument("--check", action="store_true", help="fail if the page shows others")
    options = parser.parse_args(arguments)
    if options.check:
        return min(1, stale((PAGE, marked(*section)) for section in sections()))
    show(PAGE, sections(), options.write)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
