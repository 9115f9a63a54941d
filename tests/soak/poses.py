"""Poses solved at length: `python -m tests.soak poses` prints a table and fails if a pose is missed.

Of every robot of the package and of random ones, poses of random postures within the limits, a tenth of them with
joints on their limits and a tenth with joints at zero, where arms are singular. The bars: every pose is reached from
the middle posture to 1e-4 m and 1e-3 rad, as measured by the forward kinematics, within the limits, of arms of more
than six joints without any geometry of their own all but one in a thousand (with several joints on their limits as
good as no other posture may be left); poses out of reach end where no small motion within the limits brings the tool
nearer, and are not called converged.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from time import perf_counter

import numpy as np
import redundancy as rd

from evidence.pages import table
from tests.inverse.test_pose import ORIENTATION, OTHERS, POSITION, errors, general
from tests.inverse.test_pose_nearest import cost_of, length, out_of_reach, slope
from tests.reference.chain import F64
from tests.soak.options import scaled

POSES = 4000
ARMS = 40
FEW = 500
"""Poses of each random arm."""
SHORT = 200
"""Poses out of reach of each robot."""
STATIONARY = 1e-6
SPARED = 1e-3
HEAD = ["robot", "poses", "missed", "us a pose", "most restarts", "out of reach", "not nearest"]


def robots(arms: int, seed: int) -> Iterator[tuple[str, rd.Robot, int]]:
    """Yield names, robots and shares of the poses."""
    yield from ((name, rd.robots.get(name), POSES) for name in rd.robots.names())
    yield from ((name, robot, POSES) for name, robot in OTHERS.items())
    rng = np.random.default_rng(seed)
    for k in range(arms):
        n = int(rng.integers(4, 10))
        half = float(rng.uniform(0.4, np.pi))
        yield f"{n} joints within {half:.2f}", general(1000 * seed + k + 100, n, half), FEW


def postures(robot: rd.Robot, count: int, seed: int) -> F64:
    """Return postures within the limits, some of them special."""
    rng = np.random.default_rng(seed)
    q = np.array(robot.random_postures(count, seed=seed))
    ends = np.where(rng.random(q.shape) < 0.5, robot.q_min, robot.q_max)
    on_limits = (rng.random(q.shape) < 0.4) & np.isfinite(ends) & (np.arange(count) % 10 == 0)[:, None]
    at_zero = (rng.random(q.shape) < 0.5) & (np.arange(count) % 10 == 1)[:, None]
    special = np.where(at_zero, np.clip(0.0, robot.q_min, robot.q_max), np.where(on_limits, ends, q))
    return np.where(robot.within_limits(special)[:, None], special, q)


def missed(robot: rd.Robot, count: int, seed: int) -> tuple[int, float, int]:
    """Return how many poses are missed, microseconds a pose in the median, and most restarts."""
    wrong, times, most = 0, [], 0
    for pose in robot.fk(postures(robot, count, seed)):
        began = perf_counter()
        found = robot.solve_pose(pose)
        times.append(perf_counter() - began)
        position, orientation = errors(robot, found.q, pose)
        reached = found.status == "converged" and position <= POSITION and orientation <= ORIENTATION
        wrong += not (reached and robot.within_limits(found.q))
        most = max(most, int(found.restarts))
    return wrong, 1e6 * float(np.median(times)), most


def not_nearest(robot: rd.Robot, count: int, seed: int) -> int:
    """Return how many poses out of reach end where the tool could come nearer, or are called converged."""
    wrong = 0
    for k in range(count):
        pose = out_of_reach(robot, ("far", "just", "outwards")[k % 3], seed + k)
        found, square = robot.solve_pose(pose), length(robot) ** 2
        reached = max(errors(robot, found.q, pose)[0] / POSITION, errors(robot, found.q, pose)[1] / ORIENTATION) <= 1.0
        bar = STATIONARY * square * (1.0 + np.sqrt(found.cost / square))
        still = slope(robot, cost_of(robot, pose), found.q) <= bar
        wrong += not ((found.status == "converged") == reached and (reached or still) and robot.within_limits(found.q))
    return wrong


def main(arguments: list[str] | None = None) -> int:
    """Run the soak; return 1 if a bar was missed."""
    options = scaled(__doc__.partition("\n")[0], "poses", arguments)
    sys.stdout.write(table(HEAD, []) + "\n")
    failed = 0
    for name, robot, poses in robots(max(1, round(ARMS * options.scale)), options.seed):
        count, short = max(20, round(poses * options.scale)), max(9, round(SHORT * options.scale))
        wrong, time, most = missed(robot, count, options.seed + 1)
        far = not_nearest(robot, short, options.seed + 2)
        allowed = 0.0 if robot.n <= 6 or name in rd.robots.names() else max(1.0, SPARED * count)
        failed += (wrong > allowed) + far
        sys.stdout.write(f"| {name} | {count} | {wrong} | {time:.1f} | {most} | {short} | {far} |\n")
        sys.stdout.flush()
    return int(failed > 0)
