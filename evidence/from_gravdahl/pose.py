"""Ways to a pose beside each other: ``python -m evidence.from_gravdahl.pose [--write | --check]``.

Prints the tables of docs/pose.md, each between two marks. With --write it puts them into the page. With --check it
tells, by its exit status, whether the page shows all but the table with times, which are of the machine that runs it.
Peers are timed where they are installed (dependency group ``pose``).
"""

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import perf_counter_ns
from typing import Any

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from evidence.from_gravdahl.pose_peers import peers
from evidence.pages import DOCS, marked, show, stale, table

F64 = NDArray[np.float64]

PAGE = DOCS / "pose.md"
POSES = 2000
FEW = 200
"""Poses of the descent algorithms, which are slow."""
SWEEPS = 300
POSITION, ORIENTATION = 1e-4, 1e-3
SEED = 15


def general() -> rd.Robot:
    """Return six revolute joints without any special geometry: a DH table of random numbers, rounded."""
    rng = np.random.default_rng(SEED)
    (a, d), (alpha, theta) = rng.uniform(-0.4, 0.4, (2, 6)).round(2), rng.uniform(-3.0, 3.0, (2, 6)).round(2)
    return rd.Robot.from_dh(a, d, alpha, theta, q_min=[-np.pi] * 6, q_max=[np.pi] * 6, name="general 6R")


def robots() -> list[rd.Robot]:
    """Return the robots of the tables."""
    names = ("ur5e", "fanuc_m710ic50", "panda", "kuka_iiwa14", "stanford_arm")
    return [*(rd.robots.get(name) for name in names), general()]


@dataclass
class Tally:
    """What one way does with the poses of one robot."""

    reached: int = 0
    steps: list[int] = field(default_factory=list)
    restarts: list[int] = field(default_factory=list)
    nanoseconds: list[int] = field(default_factory=list)

    @property
    def microseconds(self) -> str:
        """Of one pose in the median."""
        return f"{1e-3 * float(np.median(self.nanoseconds)):.1f}"


def is_reached(robot: rd.Robot, q: F64 | None, pose: F64) -> bool:
    """Return whether a posture is within the limits and its tool at the pose, by the forward kinematics."""
    if q is None or not np.isfinite(q).all() or not robot.within_limits(np.asarray(q, dtype=np.float64)):
        return False
    tool = robot.fk(q)
    distance = float(np.linalg.norm(tool[:3, 3] - pose[:3, 3]))
    angle = 2.0 * np.arcsin(min(1.0, float(np.linalg.norm(tool[:3, :3] - pose[:3, :3])) / np.sqrt(8.0)))
    return distance <= POSITION and angle <= ORIENTATION


def ours(robot: rd.Robot, method: str, poses: F64) -> Tally:
    """Solve poses by one method, each from the middle posture."""
    tally = Tally()
    robot.solve_pose(poses[0], None, method)  # the table of starts is made once
    for pose in poses:
        began = perf_counter_ns()
        found = robot.solve_pose(pose, None, method)
        tally.nanoseconds.append(perf_counter_ns() - began)
        tally.reached += found.status == "converged" and is_reached(robot, found.q, pose)
        tally.steps.append(int(found.iterations))
        tally.restarts.append(int(found.restarts))
    return tally


ALGORITHMS: dict[str, dict[str, Any]] = {
    "1, end to base": {"algorithm": 1},
    "1, double": {"algorithm": 1, "order": "double"},
    "2, largest decrease": {"algorithm": 2},
    "3, largest decrease by way": {"algorithm": 3},
    "4, all joints at once": {"algorithm": 4},
    "5, as printed": {"algorithm": 5, "rule": "printed"},
    "5, with a search": {"algorithm": 5, "rule": "search"},
}


def swept(robot: rd.Robot, settings: dict[str, Any], poses: F64) -> Tally:
    """Solve poses by one of the descent algorithms, each from the middle posture."""
    tally = Tally()
    for pose in poses:
        found = rd.CoordinateDescent(robot, pose, **settings).solve(robot.middle, SWEEPS)
        tally.reached += is_reached(robot, found.q, pose)
        tally.steps.append(found.iterations)
    return tally


def poses_of(robot: rd.Robot, count: int) -> F64:
    """Return the poses of random postures within the limits."""
    return np.asarray(robot.fk(robot.random_postures(count, seed=SEED)))


def reached() -> str:
    """Tell how many poses each method reaches, in how many steps."""
    rows: list[list[object]] = []
    for robot in robots():
        poses = poses_of(robot, POSES)
        for method in ("auto", "newton", "hybrid"):
            tally = ours(robot, method, poses)
            steps, most = f"{np.mean(tally.steps):.1f}", max(tally.restarts)
            rows.append(
                [
                    robot.name,
                    f'"{method}"',
                    f"{tally.reached} of {POSES}",
                    steps,
                    f"{np.mean(tally.restarts):.2f}",
                    most,
                ]
            )
    return table(["robot", "method", "reached", "steps, mean", "restarts, mean", "most"], rows)


def descents() -> str:
    """Tell how many poses the five algorithms reach, alone."""
    rows: list[list[object]] = []
    for robot in robots():
        poses = poses_of(robot, FEW)
        counts = [swept(robot, settings, poses) for settings in ALGORITHMS.values()]
        rows.append([robot.name, *(f"{tally.reached} ({np.median(tally.steps):.0f})" for tally in counts)])
    return table(["robot", *ALGORITHMS], rows)


def timed() -> str:
    """Time the methods and the peers in one run, turn by turn."""
    rows: list[list[object]] = []
    for robot in robots():
        poses = poses_of(robot, POSES)
        for method in ("auto", "newton", "hybrid"):
            tally = ours(robot, method, poses)
            rows.append([robot.name, f'"{method}"', f"{tally.reached} of {POSES}", tally.microseconds])
        if robot.name in ("ur5e", "panda"):
            rows += peer_rows(robot, poses)
    return table(["robot", "solver", "reached", "us a pose, median"], rows)


def peer_rows(robot: rd.Robot, poses: F64) -> Iterator[list[object]]:
    """Yield what the peers do with the same poses from the same start."""
    start = np.array(robot.middle)
    for name, solve in peers(robot):
        tally = Tally()
        for pose in poses:
            began = perf_counter_ns()
            q = solve(pose, start)
            tally.nanoseconds.append(perf_counter_ns() - began)
            tally.reached += is_reached(robot, q, pose)
        yield [robot.name, name, f"{tally.reached} of {len(poses)}", tally.microseconds]


SECTIONS: dict[str, Callable[[], str]] = {"poses reached": reached, "descent alone": descents, "times of poses": timed}
UNCHECKED = ("times of poses",)


def main(arguments: list[str]) -> int:
    """Print, write or check the tables."""
    if "--check" in arguments:
        return int(stale((PAGE, marked(name, make())) for name, make in SECTIONS.items() if name not in UNCHECKED) > 0)
    show(PAGE, ((name, make()) for name, make in SECTIONS.items()), "--write" in arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
