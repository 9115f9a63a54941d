"""`redundancy.plan` on the two benchmarks of moveit_dp_redundancy_resolution, beside its dynamic programme.

``python -m evidence.planner.moveit_dp [--write] [name ...]`` prints the table of docs/plan_comparison.md; with --write
it puts it there, with --samples=N the grid has as many samples instead of those that the package asks for. The package
(https://github.com/unisa-acg/moveit_dp_redundancy_resolution, commit 37f2f7b, BSD-3-Clause; Ferrentino, Salvioli and
Chiacchio 2021) is a ROS plugin that no package index has, so what it does is rebuilt here in
numpy: one joint on a grid of its samples, every inverse solution of the others, and at every point the cheapest
predecessor of each state within the limits of speed and, against the predecessor's own speed, of acceleration. Other
than there, angles are taken the short way round only where a joint has no limits, and the integral of what is not a
speed is by the trapezoidal rule for both planners.

The circle of the planar arm is `data/kazerounian_circle.csv`, the columns of its file
fourr_kazerounian_controller/config/ws_trajectory_matlab.yaml; the square of the Panda is made by `square`, which its
file panda_controller/trajectories/square_trajectory.traj repeats to 1e-8.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from evidence.pages import DOCS, show, table

F64 = NDArray[np.float64]
Index = NDArray[np.intp]

PAGE: Final = DOCS / "plan_comparison.md"
CIRCLE: Final = Path(__file__).parent / "data" / "kazerounian_circle.csv"
LINKS: Final = (7.0, 7.0, 4.0, 1.5)
"""Lengths of the planar arm of Kazerounian and Wang (1988)."""
YAW: Final = -1.0472
OBSTACLE: Final = np.array([6.0, 4.0])
SPEED, DISTANCE = 0.1, 0.9
"""Weights of the squared speed and of the squared distance of the third joint from the obstacle."""
PAIRS: Final = 1_000_000
"""Steps that are looked at at once."""


@dataclass(frozen=True, eq=False)
class Benchmark:
    """A robot, its path and what is minimised: the integral over time of speed |dq/dt|^2 + distance(q).

    Attributes
    ----------
    name : str
        Its name.
    robot : Robot
        The arm.
    path : Toolpath
        With rotations and times.
    acceleration : ndarray, shape (n,)
        Limits.
    states : list of ndarray, shape (M, n)
        Postures of every point on the grid, those of the joint on the grid in order.
    held : int
        That joint.
    making : float
        CPU seconds that the postures took.
    speed : float
        Weight of the squared speed.
    distance : callable or None
        Of postures (M, n): values (M,), gradients (M, n) and Hessians (M, n, n).
    """

    name: str
    robot: rd.Robot
    path: rd.Toolpath
    acceleration: F64
    states: list[F64]
    held: int
    making: float
    speed: float = 1.0
    distance: Callable[[F64], tuple[F64, F64, F64]] | None = None

    @property
    def dt(self) -> F64:
        """Seconds from point to point."""
        assert self.path.time is not None
        return np.diff(self.path.time)

    def apart(self, before: F64, after: F64) -> F64:
        """Return motions; the short way round for joints without limits."""
        change: F64 = after - before
        return np.where(np.isinf(self.robot.q_max), change - 2.0 * np.pi * np.round(change / (2.0 * np.pi)), change)

    def cost(self, q: F64) -> float:
        """Return what is minimised, of postures along the path."""
        motion = self.speed * float(((np.diff(q, axis=0) ** 2).sum(axis=1) / self.dt).sum())
        if self.distance is None:
            return motion
        return motion + float(self.weights @ self.distance(q)[0])

    @property
    def weights(self) -> F64:
        """Seconds that every point stands for, by the trapezoidal rule."""
        weights: F64 = np.convolve(self.dt, [0.5, 0.5])
        return weights

    def shares(self, q: F64) -> tuple[float, float]:
        """Return the largest speed and acceleration as parts of their limits, at rest before the first point."""
        speed = np.diff(q, axis=0) / self.dt[:, None]
        change = np.diff(speed, axis=0, prepend=np.zeros((1, q.shape[1]))) / self.dt[:, None]
        return float((np.abs(speed) / self.robot.qd_max).max()), float((np.abs(change) / self.acceleration).max())


def planar() -> rd.Robot:
    """Return the planar arm."""
    none, endless = [0.0] * 4, [np.inf] * 4
    return rd.Robot.from_dh(
        LINKS,
        none,
        none,
        none,
        joints="RRRR",
        q_min=-np.array(endless),
        q_max=endless,
        qd_max=[2.0] * 4,
        name="kazerounian_wang_4r",
    )


def circle(samples: int = 1440, distance: bool = False) -> Benchmark:
    """Return the circle of the planar arm; for `distance` with the weights of its configuration."""
    moment, x, y = np.loadtxt(CIRCLE, delimiter=",", skiprows=1, unpack=True)
    zero, one = np.zeros_like(x), np.ones_like(x)
    cosine, sine = np.cos(YAW) * one, np.sin(YAW) * one
    rotation = np.stack([cosine, -sine, zero, sine, cosine, zero, zero, zero, one], axis=1).reshape(-1, 3, 3)
    path = rd.Toolpath(np.stack([x, y, zero], axis=1), rotation[:, :, 2], rotation=rotation, time=moment)
    begin = time.process_time()
    wrist = np.stack([x - LINKS[3] * np.cos(YAW), y - LINKS[3] * np.sin(YAW)], axis=1)
    first = np.linspace(-np.pi, np.pi, samples, endpoint=False)
    states = [_planar_postures(point, first) for point in wrist]
    making = time.process_time() - begin
    benchmark = Benchmark("4R, speed", planar(), path, np.full(4, 10.0), states, 0, making)
    if distance:
        return replace(benchmark, name="4R, speed and distance", speed=SPEED, distance=elbow_distance)
    return benchmark


def _planar_postures(wrist: F64, first: F64) -> F64:
    """Return the postures of the planar arm for values of its first joint, both elbows."""
    x, y = wrist[0] - LINKS[0] * np.cos(first), wrist[1] - LINKS[0] * np.sin(first)
    cosine = (x**2 + y**2 - LINKS[1] ** 2 - LINKS[2] ** 2) / (2.0 * LINKS[1] * LINKS[2])
    within = np.abs(cosine) <= 1.0
    x, y, cosine, first = x[within], y[within], cosine[within], first[within]
    rows = []
    for side in (1.0, -1.0):
        third = side * np.arccos(cosine)
        second = np.arctan2(y, x) - np.arctan2(LINKS[2] * np.sin(third), LINKS[1] + LINKS[2] * cosine) - first
        rows.append(np.stack([first, second, third, YAW - first - second - third], axis=1))
    q: F64 = np.stack(rows, axis=1).reshape(-1, 4)
    return q


def elbow_distance(q: F64) -> tuple[F64, F64, F64]:
    """Return the weighted squared distance of the third joint from the obstacle, with gradients and Hessians."""
    off, slope = np.tile(-OBSTACLE, (len(q), 1)), np.zeros((len(q), 2, 4))
    bend = np.zeros((2, len(q), 2, 4, 4))
    for i, (length, angle) in enumerate(zip(LINKS, (q[:, 0], q[:, 0] + q[:, 1]), strict=False)):
        moved = np.array([1.0, float(i), 0.0, 0.0])
        along, across = (
            np.stack([np.cos(angle), np.sin(angle)], axis=1),
            np.stack([-np.sin(angle), np.cos(angle)], axis=1),
        )
        off += length * along
        slope += length * across[:, :, None] * moved
        bend[i] = -length * along[:, :, None, None] * np.outer(moved, moved)
    value = DISTANCE * (off**2).sum(axis=1)
    gradient = 2.0 * DISTANCE * np.einsum("mi,mij->mj", off, slope)
    hessian = 2.0 * DISTANCE * (np.einsum("mik,mil->mkl", slope, slope) + np.einsum("mi,bmikl->mkl", off, bend))
    return value, gradient, hessian


def square(samples: int = 720) -> Benchmark:
    """Return the square of the Panda, the tool turning at its corners' pace."""
    corner = np.array([[0.3, -0.3, 0.8], [0.3, -0.3, 0.4], [0.3, 0.3, 0.4], [0.3, 0.3, 0.8], [0.3, -0.3, 0.8]])
    # w, x, y, z, each on the side of the one before.
    half = 0.5**0.5
    turn = np.array(
        [
            [half, 0.0, -half, 0.0],
            [half, 0.0, -half, 0.0],
            [0.0, 0.0, -1.0, 0.0],
            [-half, 0.0, -half, 0.0],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )
    position, rotation = [corner[:1]], [_rotations(turn[0], turn[0], np.zeros((1, 1)))]
    for i, steps in enumerate((41, 61, 40, 60)):
        share = np.arange(1, steps + 1)[:, None] / steps
        position.append(corner[i] + share * (corner[i + 1] - corner[i]))
        rotation.append(_rotations(turn[i], turn[i + 1], share))
    frames = np.tile(np.eye(4), (203, 1, 1))
    frames[:, :3, 3], frames[:, :3, :3] = np.concatenate(position), np.concatenate(rotation)
    moment = np.linspace(0.0, 60.0, len(frames))
    robot, held = rd.robots.get("panda"), 3
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], rotation=frames[:, :3, :3], time=moment)
    begin = time.process_time()
    found: list[list[F64]] = [[] for _ in frames]
    for value in np.linspace(robot.q_min[held], robot.q_max[held], samples):
        rows, owner = robot.inverse(frames, fixed={held: float(value)}, limits=True)
        for row, i in zip(rows, owner, strict=True):
            found[i].append(row)
    making = time.process_time() - begin
    acceleration = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
    return Benchmark("Panda, speed", robot, path, acceleration, [np.array(q) for q in found], held, making)


def _rotations(start: F64, end: F64, share: F64) -> F64:
    """Return the rotations on the way from one unit quaternion w, x, y, z to another (Shoemake 1985)."""
    angle = np.arccos(np.clip(start @ end, -1.0, 1.0))
    if angle > 0.0:
        start, end = (np.sin((1.0 - share) * angle) * start + np.sin(share * angle) * end) / np.sin(angle), end
    w, x, y, z = np.broadcast_to(start, (len(share), 4)).T
    rows = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)]
    rows += [2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)]
    rows += [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)]
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


def rebuilt(benchmark: Benchmark) -> F64:
    """Return the postures of the dynamic programme, (N, n)."""
    states, dt = benchmark.states, benchmark.dt
    own = [np.zeros(len(q)) for q in states]
    if benchmark.distance is not None:
        own = [w * benchmark.distance(q)[0] for w, q in zip(benchmark.weights, states, strict=True)]
    label, speed = own[0], np.zeros_like(states[0])
    back: list[Index] = []
    for t in range(1, len(states)):
        cost, origin = _cheapest(benchmark, t, label, speed)
        if not np.isfinite(cost).any():
            raise ValueError(f"no way to point {t}")
        speed = benchmark.apart(states[t - 1][origin], states[t]) / dt[t - 1]
        label = cost + own[t]
        back.append(origin)
    at = [int(label.argmin())]
    for origin in reversed(back):
        at.append(int(origin[at[-1]]))
    way = np.array([q[i] for q, i in zip(states, reversed(at), strict=True)])
    steps = benchmark.apart(way[:-1], way[1:])
    return np.concatenate([way[:1], way[0] + np.cumsum(steps, axis=0)])


def _cheapest(benchmark: Benchmark, t: int, label: F64, speed: F64) -> tuple[F64, Index]:
    """Return what the cheapest predecessor of every state costs, and which it is."""
    before, now, dt = benchmark.states[t - 1], benchmark.states[t], benchmark.dt[t - 1]
    place = np.arange(len(before))
    held = before[:, benchmark.held]
    if np.isinf(benchmark.robot.q_max[benchmark.held]):
        held = np.concatenate([held - 2.0 * np.pi, held, held + 2.0 * np.pi])
        place = np.tile(place, 3)
    reach = benchmark.robot.qd_max[benchmark.held] * dt
    first = np.searchsorted(held, now[:, benchmark.held] - reach)
    count = np.searchsorted(held, now[:, benchmark.held] + reach, side="right") - first
    cost, origin = np.full(len(now), np.inf), np.zeros(len(now), dtype=np.intp)
    ends = np.cumsum(count)
    chunks = np.searchsorted(ends, np.arange(0, ends[-1] + PAIRS, PAIRS))
    for a, b in pairwise(chunks):
        some = count[a:b]
        if not some.sum():
            continue
        to = np.repeat(np.arange(a, b), some)
        nth = np.arange(some.sum()) - np.repeat(np.cumsum(some) - some, some)
        origins = place[first[to] + nth]
        rate = benchmark.apart(before[origins], now[to]) / dt
        kept = (np.abs(rate) <= benchmark.robot.qd_max).all(axis=1)
        earlier = benchmark.dt[max(t - 2, 0)]
        kept &= (np.abs(rate - speed[origins]) <= benchmark.acceleration * earlier).all(axis=1)
        to, origins, rate = to[kept], origins[kept], rate[kept]
        price = label[origins] + benchmark.speed * dt * (rate**2).sum(axis=1)
        order = np.lexsort((price, to))
        leading = order[np.flatnonzero(np.diff(to[order], prepend=-1))]
        cost[to[leading]], origin[to[leading]] = price[leading], origins[leading]
    return cost, origin


def planned(benchmark: Benchmark) -> rd.Plan:
    """Return the plan for the same integral."""
    if benchmark.distance is None:
        return rd.plan(benchmark.robot, benchmark.path, rd.Task.full(), criterion="motion", progress=False)
    whole, distance = float(benchmark.dt.sum()), benchmark.distance

    def one(q: F64) -> tuple[float, F64, F64]:
        value, gradient, hessian = distance(q[None])
        return float(value[0]), gradient[0], hessian[0]

    return rd.plan(
        benchmark.robot,
        benchmark.path,
        rd.Task.full(),
        rd.CustomIndex(one),
        "integral",
        smoothness=benchmark.speed / whole**2,
        progress=False,
    )


def rows_of(benchmark: Benchmark) -> list[list[object]]:
    """Return the rows of a benchmark: the rebuilt programme, the same without limits of acceleration, and the plan."""
    free = replace(benchmark, acceleration=np.full(benchmark.robot.n, np.inf))
    planners: list[tuple[str, Callable[[], F64 | str], float]] = [
        ("rebuilt", lambda: rebuilt(benchmark), benchmark.making),
        ("rebuilt, any acceleration", lambda: rebuilt(free), benchmark.making),
        ("`rd.plan`", lambda: _postures(planned(benchmark)), 0.0),
    ]
    rows: list[list[object]] = []
    first = float("nan")
    for name, make, making in planners:
        begin, used = time.perf_counter(), time.process_time()
        q = make()
        wall, spent = time.perf_counter() - begin + making, time.process_time() - used + making
        row = [benchmark.name, len(benchmark.path), name]
        if isinstance(q, str):
            rows.append([*row, q, *4 * [""], f"{wall:.2f}, {spent:.2f}"])
            continue
        cost = benchmark.cost(q)
        first = first if rows else cost
        speed, acceleration = benchmark.shares(q)
        step = float(np.abs(np.diff(q, axis=0)).max())
        off = float(np.abs(benchmark.robot.fk(q)[:, :3, 3] - benchmark.path.position).max())
        figures = [f"{cost:.5f}", f"{cost / first - 1.0:+.1%}", f"{step:.3f}", f"{speed:.2f}, {acceleration:.2f}"]
        rows.append([*row, *figures, f"{off:.0e}", f"{wall:.2f}, {spent:.2f}"])
    return rows


def _postures(plan: rd.Plan) -> F64 | str:
    """Return the postures of a plan, or why there are none."""
    return plan.q if plan.failure is None else str(plan.failure)


def main(arguments: list[str]) -> int:
    """Print the table; with --write, put it into the page."""
    names = [argument.lower() for argument in arguments if not argument.startswith("--")]
    samples = next((int(a.removeprefix("--samples=")) for a in arguments if a.startswith("--samples=")), None)
    head = ("benchmark", "points", "planner", "integral", "against the rebuilt", "largest step [rad]")
    benchmarks = [circle(samples or 1440), circle(samples or 1440, distance=True), square(samples or 720)]
    rows = [
        row
        for benchmark in benchmarks
        if not names or any(name in benchmark.name.lower() for name in names)
        for row in rows_of(benchmark)
    ]
    text = table((*head, "speed, acceleration over limits", "off the path [m]", "wall, CPU [s]"), rows)
    show(PAGE, [("moveit dp", text)], "--write" in arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
