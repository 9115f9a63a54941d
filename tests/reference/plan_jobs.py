"""Random jobs for plans: robots, paths, tasks, settings; most are made from a known motion, so that a way exists.

`job(seed, number)` is the same on every machine. A known motion is within position limits, within speed limits where
the path has times, and below the largest step where it has none.
"""

from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from tests.reference.chain import F64, random_frame
from tests.reference.motions import followed, frames_of
from tests.reference.plan_robots import ROBOTS

STEP: Final = 0.25
"""Largest motion of a joint between neighbouring points of a path without times, by default [rad or m]."""
POINTS: Final = 300
OFFSETS: Final = (0.0, 1e-6, 1e-3, 5e-3)
"""How far paths lead past a singular posture [m]."""
SHAPES: Final = ("joints", "joints closed", "line", "arc", "spiral", "corners", "circle", "singular", "random")
TRIES: Final = 12
EDGE: Final = 0.02
"""Part of their range that known motions keep from the limits."""


@dataclass(frozen=True, eq=False)
class Job:
    """What is planned.

    Attributes
    ----------
    name : str
        Robot, shape, task and criterion.
    robot, path, task, objective : Robot, Toolpath, Task, Objective or None
        As for `redundancy.plan`.
    settings : dict
        Its other arguments.
    known : ndarray, shape (N, n), or None
        A motion that does it.
    """

    name: str
    robot: rd.Robot
    path: rd.Toolpath
    task: rd.Task
    objective: rd.Objective | None
    settings: dict[str, Any]
    known: F64 | None = field(repr=False)

    @property
    def largest(self) -> F64:
        """Largest motions of the joints from each point to the next, shape (N - 1, n)."""
        count, n = len(self.path), self.robot.n
        turning = [STEP if joint == "R" and self.path.time is None else np.inf for joint in self.robot.joints]
        largest = np.tile(self.settings.get("max_step", turning), (count - 1, 1)) * np.ones(n)
        if self.path.time is not None and self.settings.get("limits", True):
            largest = np.minimum(largest, np.diff(self.path.time)[:, None] * self.robot.qd_max)
        return largest

    def plan(self, **more: Any) -> rd.Plan:
        """Plan it."""
        settings = self.settings | more
        return rd.plan(self.robot, self.path, self.task, self.objective, progress=False, **settings)


@dataclass(frozen=True, eq=False)
class Around:
    """A reason of the user's own: joints within some distance of those of a motion."""

    known: F64
    distance: float

    def __call__(self, q: F64) -> NDArray[np.bool_]:
        """Say of postures (M, n) which are allowed."""
        low, high = self.known.min(axis=0) - self.distance, self.known.max(axis=0) + self.distance
        return np.asarray(((q >= low) & (q <= high)).all(axis=1))


def job(seed: int, number: int) -> Job:
    """Return a job by its number."""
    rng = np.random.default_rng([seed, number])
    name = str(rng.choice(list(ROBOTS)))
    robot = _tooled(ROBOTS[name](), rng)
    shape = str(rng.choice(SHAPES, p=[0.18, 0.1, 0.13, 0.1, 0.08, 0.1, 0.1, 0.13, 0.08]))
    points = int(np.exp(rng.uniform(0.0, np.log(POINTS)))) if rng.random() < 0.9 else POINTS
    if shape in ("joints closed", "circle", "arc", "spiral", "corners"):
        points = max(points, 12)
    kind, task, axis = _task(robot, rng)
    timed = rng.random() < 0.4 and bool(np.isfinite(robot.qd_max).all())
    settings, step = _settings(rng, timed)
    frames, known = _drawn(robot, shape, points, kind, axis, step if not timed else np.inf, rng)
    closed = shape in ("joints closed", "circle") and known is not None and np.abs(known[-1] - known[0]).max() < 1e-12
    if closed:
        frames[-1] = frames[0]
        settings["closed"] = True
    time = None
    if timed and len(frames) > 1:
        time = _times(robot, frames, known, rng)
    if known is not None and not timed and len(known) > 1 and np.abs(np.diff(known, axis=0)).max() > step:
        known = None
    turned = kind in ("full", "general") or rng.random() < 0.3
    if turned and kind == "axisymmetric" and rng.random() < 0.3:
        # The known motion has spin 0.
        settings["spin_range"] = (-float(rng.uniform(0.1, 3.0)), float(rng.uniform(0.1, 3.0)))
    if known is not None and rng.random() < 0.05:
        settings["feasible"] = Around(known, float(rng.uniform(0.1, 1.0)))
    elif rng.random() < 0.05:
        settings["limits"] = False
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, :3] @ axis, frames[:, :3, :3] if turned else None, time)
    objective = None if settings["criterion"] == "motion" else _objective(robot, task, rng)
    words = [name, shape, kind, settings["criterion"], "timed" if timed else "untimed"]
    return Job(", ".join(words), robot, path, task, objective, settings, known)


def _reach(robot: rd.Robot) -> float:
    """Return about how far a robot reaches [m]."""
    links = np.linalg.norm(robot.links[1:, :3, 3], axis=1).sum() + np.linalg.norm(robot.flange[:3, 3])
    return float(max(links, 0.6))


def _tooled(robot: rd.Robot, rng: np.random.Generator) -> rd.Robot:
    """Give six-axis arms and longer ones a tool: none, straight, a torch or a spindle."""
    size = 0.2 * min(_reach(robot), 2.0)
    which = rng.integers(4)
    if robot.n < 6 or which == 0:
        return robot
    tool = np.eye(4)
    angle = [0.0, np.deg2rad(rng.uniform(15.0, 60.0)), np.pi / 2][which - 1]
    tool[[0, 0, 2, 2], [0, 2, 0, 2]] = np.cos(angle), np.sin(angle), -np.sin(angle), np.cos(angle)
    tool[:3, 3] = size * np.array([[0.0, 0.0, 1.0], [0.2, 0.0, 1.0], [0.7, 0.0, 0.5]][which - 1])
    return robot.with_tool(tool)


def _task(robot: rd.Robot, rng: np.random.Generator) -> tuple[str, rd.Task, F64]:
    """Return a task, what sort it is, and the axis of the tool."""
    z = np.array([0.0, 0.0, 1.0])
    draw = rng.random()
    if draw < 0.5:
        axis = z
        if rng.random() < 0.2 and robot.n >= 6:
            axis = rng.standard_normal(3)
            axis /= np.linalg.norm(axis)
        return "axisymmetric", rd.Task.axisymmetric(tuple(axis)), axis
    if draw < 0.75 and (robot.n >= 6 or robot.joints != "PPPRR"):
        return "full", rd.Task.full(), z
    if draw < 0.88:
        return "position", rd.Task.position(), z
    angular = ["free", "full", ("plane", (0, 0, 1)), ("line", (0, 0, 1))][rng.integers(4)]
    linear = ["full", ("plane", (0, 0, 1)), ("line", (0, 0, 1)), ("plane", (1, 0, 0))][rng.integers(4)]
    return "general", rd.Task(angular, linear, str(rng.choice(["tool", "base"]))), z  # type: ignore[arg-type]


def _objective(robot: rd.Robot, task: rd.Task, rng: np.random.Generator) -> rd.Objective:
    rows = robot.rows_in_use()
    length = _reach(robot) / 3.0
    if len(rows) > robot.n or rng.random() < 0.15:
        return rd.JointLimits()
    if len(rows) < 6:
        return rd.ConditionNumber(length, rows=rows)
    draw = rng.random()
    if draw < 0.7:
        return rd.ConditionNumber(length)
    return rd.ConditionNumber(length) + 0.1 * rd.JointLimits()


def _settings(rng: np.random.Generator, timed: bool) -> tuple[dict[str, Any], float]:
    """Return settings of a plan, and the largest step of a known motion."""
    settings: dict[str, Any] = {"criterion": str(rng.choice(["minimax", "minimax", "integral", "motion"]))}
    step = STEP
    if rng.random() < 0.15 and not timed:
        step = float(rng.uniform(0.1, 0.6))
        settings["max_step"] = step
    if rng.random() < 0.1:
        settings["branch_changes"] = True
    return settings, step


def _ends(robot: rd.Robot) -> tuple[F64, F64]:
    """Return where postures are drawn: within the limits, at most a turn."""
    turns = np.array([letter == "R" for letter in robot.joints])
    low = np.maximum(robot.q_min, np.where(turns, -np.pi, -1.0))
    high = np.minimum(robot.q_max, np.where(turns, np.pi, 1.0))
    return low + EDGE * (high - low), high - EDGE * (high - low)


def _drawn(
    robot: rd.Robot, shape: str, points: int, kind: str, axis: F64, step: float, rng: np.random.Generator
) -> tuple[F64, F64 | None]:
    """Return frames of a path, and a motion along it if one is known."""
    low, high = _ends(robot)
    if shape == "random":
        q = rng.uniform(low, high)
        return _placed(frames_of(robot, q[None])[0], _shaped("line", points, rng), _reach(robot), robot, rng), None
    if shape.startswith("joints"):
        known = _joint_curve(low, high, points, shape.endswith("closed"), step, rng)
        return frames_of(robot, known), known
    if shape == "singular":
        return _past_singular(robot, points, step, rng)
    size = 0.4 * _reach(robot)
    frames = np.tile(np.eye(4), (points, 1, 1))
    wanted = "full" if kind in ("full", "general") else kind
    for attempt in range(TRIES):
        start = rng.uniform(low, high)
        curve = _shaped(shape, points, rng)
        frames = _placed(frames_of(robot, start[None])[0], curve, size * 0.8**attempt, robot, rng)
        motion = followed(robot, start, frames, wanted, axis)
        if motion is None or (motion < robot.q_min).any() or (motion > robot.q_max).any():
            continue
        if len(motion) == 1 or np.abs(np.diff(motion, axis=0)).max() <= step:
            return frames, motion
    return frames, None


def _joint_curve(low: F64, high: F64, points: int, closed: bool, step: float, rng: np.random.Generator) -> F64:
    """Return a smooth motion of the joints within limits."""
    s = np.linspace(0.0, 1.0, points)[:, None]
    first = rng.uniform(low, high)
    if closed:
        a, b = rng.standard_normal((2, len(low)))
        curve = a * (np.cos(2 * np.pi * s) - 1.0) + b * np.sin(2 * np.pi * s)
        curve[-1] = 0.0
    else:
        a, b = rng.standard_normal((2, len(low)))
        curve = s * a + 0.3 * np.sin(np.pi * s) * b
    size = 10.0 ** rng.uniform(-1.5, 0.3)
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(curve > 0, (high - first) / curve, np.where(curve < 0, (low - first) / curve, np.inf))
    size = min(size, 0.999 * float(room.min()))
    if points > 1:
        size = min(size, 0.98 * step / float(np.abs(np.diff(curve, axis=0)).max()))
    return np.asarray(first + size * curve)


def _past_singular(robot: rd.Robot, points: int, step: float, rng: np.random.Generator) -> tuple[F64, F64 | None]:
    """Return a path through a singular posture, or beside it: then no motion is known."""
    low, high = _ends(robot)
    middle = _singular(robot, rng.uniform(low, high), rng)
    direction = rng.standard_normal(robot.n)
    s = np.linspace(-1.0, 1.0, points)[:, None] if points > 1 else np.zeros((1, 1))
    with np.errstate(divide="ignore"):
        room = np.minimum(high - middle, middle - low) / np.abs(direction)
    size = min(10.0 ** rng.uniform(-1.5, -0.2), float(np.maximum(room, 0.0).min()))
    if points > 1:
        size = min(size, 0.98 * step / float(np.abs(np.diff(s * direction, axis=0)).max()))
    known = middle + size * s * direction
    frames = frames_of(robot, known)
    offset = float(rng.choice(OFFSETS))
    aside = rng.standard_normal(3)
    flat = [1.0, 1.0, 0.0] if robot.name.startswith("planar") else [1.0, 1.0, 1.0]
    if rng.random() < 0.5:
        direction = rng.standard_normal(3) * flat
        if rng.random() < 0.5:
            direction = np.eye(3)[rng.integers(2)]
        frames, known = _straight_past(robot, middle, direction / np.linalg.norm(direction), points, step, rng)
    if offset == 0.0:
        return frames, known
    aside *= flat
    frames[:, :3, 3] += offset * aside / np.linalg.norm(aside)
    return frames, None


def _straight_past(
    robot: rd.Robot, middle: F64, direction: F64, points: int, step: float, rng: np.random.Generator
) -> tuple[F64, F64 | None]:
    """Return a straight line with a singular posture in its middle, and a motion from there to both ends if any."""
    half = 0.25 * _reach(robot) * rng.uniform(0.1, 1.0)
    frames = np.tile(frames_of(robot, middle[None]), (points, 1, 1))
    frames[:, :3, 3] += np.linspace(-half, half, points)[:, None] * direction if points > 1 else 0.0
    centre = points // 2
    z = np.array([0.0, 0.0, 1.0])
    ahead = followed(robot, middle, frames[centre:], "full", z)
    behind = followed(robot, middle, frames[:centre][::-1], "full", z)
    if ahead is None or behind is None:
        return frames, None
    known = np.concatenate([behind[::-1], ahead])
    within = (known >= robot.q_min).all() and (known <= robot.q_max).all()
    steady = points == 1 or np.abs(np.diff(known, axis=0)).max() <= step
    return frames, known if within and steady else None


def _singular(robot: rd.Robot, q: F64, rng: np.random.Generator) -> F64:
    """Return a posture with a joint moved to where the Jacobian is singular; a stretched one where there is none."""
    rows = robot.rows_in_use()
    low, high = _ends(robot)
    for joint in rng.permutation(robot.n):
        if len(rows) != robot.n:
            break

        def determinant(x: float, joint: int = int(joint), q: F64 = q) -> float:
            moved = q.copy()
            moved[joint] = x
            return float(np.linalg.det(robot.jacobian(moved)[rows]))

        places = np.linspace(low[joint], high[joint], 24)
        values = [determinant(x) for x in places]
        flips = [i for i in range(23) if values[i] * values[i + 1] < 0.0]
        if flips:
            i = int(rng.choice(flips))
            a, b = places[i], places[i + 1]
            for _ in range(60):
                middle = 0.5 * (a + b)
                a, b = (a, middle) if determinant(a) * determinant(middle) <= 0.0 else (middle, b)
            q = q.copy()
            q[joint] = 0.5 * (a + b)
            return q
    q = q.copy()
    for joint in (1, 3, 5) if robot.n > 6 else (min(4, robot.n - 1),):
        if rng.random() < 0.6:
            q[joint] = np.clip(0.0, low[joint], high[joint])
    return q


def _shaped(shape: str, points: int, rng: np.random.Generator) -> F64:
    """Return points of a curve of about one unit that starts at the origin."""
    s = np.linspace(0.0, 1.0, points)
    zero = np.zeros(points)
    if shape == "line":
        return np.stack([s, zero, zero], axis=1)
    if shape in ("arc", "circle"):
        angle = s * (2.0 * np.pi if shape == "circle" else rng.uniform(0.5, 5.0))
        curve = 0.3 * np.stack([np.cos(angle) - 1.0, np.sin(angle), zero], axis=1)
        if shape == "circle":
            curve[-1] = curve[0]
        return np.asarray(curve)
    if shape == "spiral":
        angle, radius = 2.0 * np.pi * s * rng.uniform(1.0, 4.0), 0.05 + 0.25 * s
        curve = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.2 * s * rng.integers(2)], axis=1)
        return np.asarray(curve - curve[0])
    corners = np.vstack([np.zeros(3), np.cumsum(rng.uniform(-0.3, 0.3, (int(rng.integers(2, 6)), 3)), axis=0)])
    at = np.round(np.linspace(0, points - 1, len(corners)))
    return np.stack([np.interp(np.arange(points), at, column) for column in corners.T], axis=1)


def _placed(first: F64, curve: F64, size: float, robot: rd.Robot, rng: np.random.Generator) -> F64:
    """Return frames along a curve from a first frame on; the orientation stays, or turns as much as it may."""
    flat = robot.name.startswith("planar")
    turn = random_frame(rng)[:3, :3]
    about = rng.standard_normal(3)
    if flat:
        angle = rng.uniform(-np.pi, np.pi)
        turn = turned_about(np.array([0.0, 0.0, 1.0]), np.array([angle]))[0]
        curve = curve * [1.0, 1.0, 0.0]
    if flat or robot.joints == "RRPR":
        about = np.array([0.0, 0.0, 1.0])
    angle = float(rng.choice([0.0, 0.0, 0.3, 1.2])) * rng.uniform(0.3, 1.0)
    share = np.linspace(0.0, 1.0, len(curve))
    if np.abs(curve[-1] - curve[0]).max() < 1e-15 and len(curve) > 1:
        share = np.sin(np.pi * share) ** 2
        share[-1] = 0.0
    frames = np.tile(first, (len(curve), 1, 1))
    frames[:, :3, :3] = turned_about(about / np.linalg.norm(about), angle * share) @ first[:3, :3]
    frames[:, :3, 3] = first[:3, 3] + size * rng.uniform(0.2, 1.0) * curve @ turn.T
    return frames


def turned_about(axis: F64, angle: F64) -> F64:
    """Return rotations about an axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, versine = np.sin(angle)[:, None, None], (1.0 - np.cos(angle))[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + versine * (cross @ cross))


def _times(robot: rd.Robot, frames: F64, known: F64 | None, rng: np.random.Generator) -> F64:
    """Return times for which a known motion keeps the speed limits; without one, of a plausible speed."""
    share = rng.uniform(0.3, 0.98)
    if known is None:
        length = np.linalg.norm(np.diff(frames[:, :3, 3], axis=0), axis=1)
        return np.append(0.0, np.cumsum(np.maximum(length / rng.uniform(0.05, 0.8), 1e-3)))
    needed = (np.abs(np.diff(known, axis=0)) / robot.qd_max).max(axis=1)
    least = max(1e-3, 1e-2 * float(needed.max()))
    step = np.maximum(needed, least) if rng.random() < 0.5 else np.full(len(needed), max(float(needed.max()), least))
    return np.append(0.0, np.cumsum(step / share))
