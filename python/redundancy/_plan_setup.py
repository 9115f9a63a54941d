"""A planning problem in numbers, and what several steps of planning ask of it."""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from ._core import Objective, Robot, Task, restore_path
from ._path_frames import motion_bounds, shares, spin_frames
from ._util import F64
from .paths import Toolpath

ON_PATH: Final = 1e-9
"""Error of a point that counts as on the path [rad, m]."""

_GENTLE: Final = {"minimax": 1e-7, "integral": 1e-5}
"""Weight of the integral of the squared joint speed where none is given, relative to the value."""

Points = NDArray[np.intp]
"""Numbers of neighbouring points."""


@dataclass(frozen=True)
class PathData:
    """A path in numbers: frames, shares and largest motions from point to point."""

    frames: F64
    steps: F64
    bounds: F64


@dataclass(frozen=True)
class Setup:
    """What is planned, by which criterion, within what."""

    robot: Robot
    path: Toolpath
    task: Task
    objective: Objective | None
    criterion: str
    smoothness: float | None
    limits: bool
    closed: bool
    spin_range: tuple[float, float] | None
    max_iterations: int
    data: PathData
    targets: F64
    length: float

    @classmethod
    def of(
        cls,
        robot: Robot,
        path: Toolpath,
        task: Task,
        objective: Objective | None,
        criterion: str,
        smoothness: float | None,
        limits: bool,
        closed: bool,
        spin_range: tuple[float, float] | None,
        max_iterations: int,
    ) -> "Setup":
        """Prepare the path for a robot and a task."""
        return cls(
            robot,
            path,
            task,
            None if criterion == "motion" else objective,
            criterion,
            1.0 if criterion == "motion" else smoothness,
            limits,
            closed,
            spin_range if task.kind == "axisymmetric" else None,
            max_iterations,
            PathData(spin_frames(path, task, closed), shares(path), motion_bounds(robot, path, limits)),
            path.targets(task),
            (None if objective is None else objective.length) or 1.0,
        )

    @property
    def core_criterion(self) -> str:
        """The criterion as the core knows it: motion alone is an integral without a value."""
        return "integral" if self.criterion == "motion" else self.criterion

    def spin(self, points: slice) -> tuple[F64, tuple[float, ...], float, float] | None:
        """Return the range of the spin at some points as the core takes it; None for a whole turn."""
        if self.spin_range is None:
            return None
        return self.data.frames[points], tuple(map(float, self.task.axis)), *self.spin_range

    def restored(self, points: Points, q: F64) -> F64:
        """Return postures brought onto the path by Newton; NaN where it does not lead there."""
        rows, reached = restore_path(self.robot, self.task, self.targets[points], q, self.length)
        rows[~reached] = np.nan
        return rows

    def values(self, q: F64) -> F64:
        """Return the objective at postures (M, n); 0 without one."""
        if self.objective is None:
            return np.zeros(len(q))
        values: F64 = self.objective.evaluate_many(self.robot, q, 0)[0]
        return values

    def errors(self, points: Points, q: F64) -> tuple[F64, F64]:
        """Return the distances [m] and the angles [rad] of postures to points of the path."""
        tools = self.robot.fk(q)
        frames = self.data.frames[points]
        position: F64 = np.linalg.norm(tools[:, :3, 3] - frames[:, :3, 3], axis=1)
        if self.task.kind == "full":
            chord = np.linalg.norm((tools - frames)[:, :3, :3], axis=(1, 2)) / np.sqrt(2.0)
        else:
            chord = np.linalg.norm((tools - frames)[:, :3, :3] @ self.task.axis, axis=1)
        angle: F64 = 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
        return position, angle

    def weight_of_motion(self, values: F64) -> float:
        """Return the weight of the motion: as given, or next to nothing beside the values."""
        if self.smoothness is not None:
            return self.smoothness
        finite = values[np.isfinite(values)]
        return _GENTLE[self.criterion] * float(np.abs(finite).mean()) if len(finite) else 0.0

    @property
    def motion_limit(self) -> str:
        """What bounds the motion from point to point: speed limits, or the largest step."""
        return "step limit" if self.path.time is None else "speed limit"

    def with_step(self, max_step: float) -> "Setup":
        """Return the same problem with a largest motion of every joint from point to point [rad or m]."""
        return self._bounded(np.minimum(self.data.bounds, max_step))

    def without_steps(self) -> "Setup":
        """Return the same problem with any motion from point to point."""
        return self._bounded(np.full_like(self.data.bounds, np.inf))

    def _bounded(self, bounds: F64) -> "Setup":
        return replace(self, data=replace(self.data, bounds=bounds))

    @property
    def steps_only(self) -> bool:
        """Whether what bounds the motion from point to point is a largest step, not the speed of joints."""
        return self.path.time is None and bool(np.isfinite(self.data.bounds).any())

    def motion(self, first: int, q: F64) -> float:
        """Return the integral of the squared joint speed over the share of the path from a point on."""
        steps = self.data.steps[first : first + len(q) - 1]
        return float((np.diff(q, axis=0) ** 2).sum(axis=1) @ (steps.sum() / steps)) if len(steps) else 0.0
