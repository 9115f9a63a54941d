"""The path that IKLink ships, followed with the fewest reconfigurations.

``python -m evidence.planner.iklink [--grid]`` plans the 767 poses of a Panda's hand that the repository of Y. Wang, C.
Sifferman and M. Gleicher, IKLink: End-Effector Trajectory Tracking with Minimal Reconfigurations (ICRA 2024), has in
``input_trajectories`` (github.com/uwgraphics/IKLink, MIT), and prints where the path is left, how exactly it is kept
and how long that took. IKLink's own answer to it is 2 reconfigurations ("Expected output" of its README). With --grid
the fewest that a fine grid of joint 7 knows are counted beside it, by a sweep of its own; that takes a minute.

Differences: IKLink takes a pose as reached within 1 mm and 0.01 rad, a plan keeps it exactly; it cuts between two
poses, a plan ends a segment and begins the next at the same one. Limits of position and speed are those of its robot
file.
"""

import sys
import time
from pathlib import Path

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy._core import Lattice
from redundancy.planning import core_path
from scipy.spatial import KDTree

F64 = NDArray[np.float64]

DATA = Path(__file__).resolve().parents[2] / "tests" / "data" / "iklink_panda.csv"
JOINT_4 = 0.0698
"""Upper limit of joint 4 in its robot file [rad]."""
HELD = 480
"""Values of joint 7 in the fine grid."""


def robot() -> rd.Robot:
    """Return the arm of its robot file: the hand is turned by -45 degrees, 107 mm from the axis of joint 6."""
    half = 0.5**0.5
    hand = np.array([[half, half, 0, 0], [-half, half, 0, 0], [0, 0, 1, 0.107], [0, 0, 0, 1]])
    arm = rd.robots.get("panda")
    q_max = arm.q_max.copy()
    q_max[3] = JOINT_4
    return arm.with_tool(hand).with_limits(q_max=q_max)


def path() -> rd.Toolpath:
    """Return its path with times."""
    columns = np.loadtxt(DATA, delimiter=",", skiprows=1)
    x, y, z, w = (columns[:, 4:8] / np.linalg.norm(columns[:, 4:8], axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    rotation = np.moveaxis(np.array(rows), 2, 0)
    return rd.Toolpath(columns[:, 1:4], rotation[:, :, 2], rotation, time=columns[:, 0])


def plan() -> rd.Plan:
    """Plan it for the least motion, joint 7 on the grid."""
    return rd.plan(
        robot(), path(), rd.Task.full(), criterion="motion", reconfigurations=True, spare=(6,), progress=False
    )


def fewest_on_a_grid(held: int = HELD) -> list[int]:
    """Return the points at which a sweep over a fine grid has to begin again, from all postures there."""
    arm, way = robot(), path()
    values = np.linspace(arm.q_min[6], arm.q_max[6], held)[:, None]
    frames = core_path(way).frames(rd.Task.full())
    lattice = Lattice(arm, frames, rd.Task.full(), [0.0], [6], values, None, True)
    assert way.time is not None
    largest = np.diff(way.time)[:, None] * arm.qd_max
    cuts: list[int] = []
    before = reached = np.zeros((0, 7))
    for point in range(len(way)):
        q, _, cause = lattice.postures(point, 1)
        now = q.reshape(-1, 7)[cause.ravel() == 0]
        if point == 0:
            before = reached = now
            continue
        scale = 1.0 / largest[point - 1]
        led = now[_near(reached * scale, now * scale)]
        if not len(led):
            cuts.append(point - 1)
            led = now[_near(before * scale, now * scale)]
        before, reached = now, led
    return cuts


def _near(known: F64, asked: F64) -> NDArray[np.bool_]:
    """Tell which rows have a known one within 1 in every coordinate."""
    distance, _ = KDTree(known).query(asked, p=np.inf, distance_upper_bound=1.0)
    near: NDArray[np.bool_] = np.isfinite(distance)
    return near


def main() -> None:
    """Print what comes out."""
    start = time.perf_counter()
    found = plan()
    seconds = time.perf_counter() - start
    speed = found.joint_speed
    assert speed is not None
    share = float((np.abs(speed) / found.robot.qd_max).max())
    distance, angle = found.position_error.max(), found.axis_error.max()
    print(f"{len(found)} poses: {found.reconfigurations}, planned in {seconds:.2f} s")
    print(f"segments: {', '.join(f'{a} to {b}' for a, b in found.segments)}; failure: {found.failure}")
    print(f"largest error {distance:.1e} m, {angle:.1e} rad; speed {share:.3f} of the limit")
    for way in found.transfers:
        lift = f"{1000.0 * way.lift[0]:.0f} and {1000.0 * way.lift[1]:.0f} mm"
        print(f"transfer at point {way.points[0]}: {len(way)} postures, lifted by {lift}, {way.duration:.2f} s")
    if "--grid" in sys.argv[1:]:
        cuts = fewest_on_a_grid()
        print(f"fewest on a grid of {HELD} values of joint 7: {len(cuts)}, at points {cuts} at the latest")


if __name__ == "__main__":
    main()
