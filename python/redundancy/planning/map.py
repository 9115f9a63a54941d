"""The redundancy map: what every spin of a tool, or value of spare joints, is worth along a path, on every branch."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._core import Lattice, Objective, OrientationVolume, Robot, Task, angle_grid, spare_grid
from .._util import F64, progress_bar
from ..errors import InvalidValueError
from ..paths import Toolpath, Trajectory
from ..plots import BY_BADNESS, CAUSES, MapLine
from .numbers import core_path

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Predicate = Callable[[F64], ArrayLike]
"""Says of postures (M, n) which are allowed, (M,)."""

_CHUNK = 200_000
"""Cells between two signs of life."""


@dataclass(frozen=True, eq=False)
class RedundancyMap:
    """Values of an objective over path points, spin angles and branches.

    Attributes
    ----------
    robot, path, task, objective
        What the map is of.
    angles : ndarray, shape (A,)
        Spins of the tool [rad] from the frames of the path at spin 0 (its rotations, or frames that never turn about
        the axis).
    value : ndarray, shape (N, A, B), or (N, S, A, B) with S values of spare joints, or S tilts, or both: for each value
        of the spare joints all tilts
        Objective; NaN where there is no posture.
    cause : ndarray of uint8, as value
        Why: an index of `CAUSES`: feasible, unreachable, joint limit, singular, predicate.
    named : bool
        Whether a branch is the same in all cells: shoulder, elbow and wrist of arms with a closed form. Else branches
        are numbered as they come.
    spare : tuple of int
        Joints that are held, counted from 0.
    spare_values : ndarray, shape (S, k)
        Where they are held [rad or m].
    spins : bool
        Whether the spins of the tool are on the grid. Else there is one angle, 0, and a map holds the values of the
        spare joints and the branches: a full task or a position, or five joints with an axisymmetric one.
    tilts : ndarray, shape (M, 2)
        Tilts of the tool within the volume that is the task, each with its heading [rad]; of a product of rotations its
        first two angles. One, of zeros, for other tasks.
    """

    robot: Robot
    path: Toolpath
    task: Task
    objective: Objective | None
    angles: F64
    value: F64 = field(repr=False)
    cause: NDArray[np.uint8] = field(repr=False)
    named: bool
    spare: tuple[int, ...] = ()
    spare_values: F64 = field(default_factory=lambda: np.zeros((1, 0)), repr=False)
    spins: bool = True
    tilts: F64 = field(default_factory=lambda: np.zeros((1, 2)), repr=False)

    CAUSES = CAUSES

    @property
    def feasible(self) -> NDArray[np.bool_]:
        """Where there is a posture; shape of ``value``."""
        feasible: NDArray[np.bool_] = self.cause == 0
        return feasible

    @property
    def best(self) -> F64:
        """Least value over branches and spare joints, shape (N, A); NaN where there is none."""
        value = np.where(np.isnan(self.value), np.inf, self.value)
        least = value.min(axis=(1, 3)) if self.value.ndim == 4 else value.min(axis=2)
        best: F64 = np.where(np.isinf(least), np.nan, least)
        return best

    @property
    def best_by_tilt(self) -> F64:
        """Least value over spins, branches and spare joints, shape (N, M), a column each of ``tilts``; NaN for none."""
        value = np.where(np.isnan(self.value), np.inf, self.value)
        least = value.reshape(len(value), -1, len(self.tilts), *value.shape[-2:]).min(axis=(1, 3, 4))
        best: F64 = np.where(np.isinf(least), np.nan, least)
        return best

    def planes(self) -> tuple[F64, NDArray[np.uint8], F64]:
        """Return the map as pictures need it: spare joints where they are best, nothing beyond the range of the angle.

        Returns
        -------
        value, cause : ndarray, shape (N, A, B)
            Angles that were not asked for are there as refused by the user.
        angles : ndarray, shape (A,)
            Spins [rad]; without them the values of the spare joint, if it is a single one that turns.
        """
        value, cause, held = self.value, self.cause, self._held()
        if held is not None:
            return self._framed(value[:, :, 0], cause[:, :, 0], self.spare_values[:, 0])
        if value.ndim == 4:
            worth = np.where(cause == 0, value, np.inf)
            # The least value; where no cell has one, the cause that came closest.
            rank = np.where(np.isfinite(worth.min(axis=1, keepdims=True)), worth, np.argsort(BY_BADNESS)[cause])
            pick = rank.argmin(axis=1)[:, None]
            value = np.take_along_axis(value, pick, axis=1)[:, 0]
            cause = np.take_along_axis(cause, pick, axis=1)[:, 0]
        return self._framed(value, cause, self.angles)

    @property
    def angle_name(self) -> str:
        """What the angles of a picture are: "spin", or the label of the joint that is held."""
        held = self._held()
        return "spin" if held is None else f"joint {held + 1}"

    @property
    def has_angles(self) -> bool:
        """Whether there is anything to draw over the path: spins, or the values of a single spare joint that turns."""
        return self.spins or self._held() is not None

    def _held(self) -> int | None:
        """Return the joint whose values are the angles of a picture: a single one that turns, where no spin is."""
        if self.spins or len(self.spare) != 1 or self.value.ndim != 4:
            return None
        joint = self.spare[0]
        turns = self.robot.joints[joint] == "R" and np.ptp(self.spare_values) < 2.0 * np.pi
        return joint if turns else None

    def _framed(self, value: F64, cause: NDArray[np.uint8], angles: F64) -> tuple[F64, NDArray[np.uint8], F64]:
        """Add a row of refused angles at either end of a range that is less than a turn."""
        if len(angles) < 2:
            return value, cause, angles
        step = float(angles[1] - angles[0])
        if angles[-1] - angles[0] + 1.5 * step > 2.0 * np.pi:
            return value, cause, angles
        rows = ((0, 0), (1, 1), (0, 0))
        angles = np.concatenate([[angles[0] - step], angles, [angles[-1] + step]])
        refused = CAUSES.index("predicate")
        framed: F64 = np.pad(value, rows, constant_values=np.nan)
        return framed, np.pad(cause, rows, constant_values=refused), angles

    def plot(
        self,
        path: str | Path | None = None,
        trajectory: Trajectory | None = None,
        branch: int | None = None,
        name: str | None = None,
    ) -> "Figure":
        """Draw the map: value by colour, causes where there is none, and the angle that a trajectory chose.

        Angles are spins of the tool; without these the values of the spare joint, if it is a single one that turns.

        Parameters
        ----------
        path : path-like, optional
            Where to save the picture (``.png``, ``.svg``, ``.pdf``).
        trajectory : Trajectory, optional
            Drawn as a line.
        branch : int, optional
            One branch only; else the best one of each cell, outlined.
        name : str, optional
            What the values are, in words.

        Raises
        ------
        InvalidValueError
            If there is neither.
        ImportError
            If matplotlib is not installed.
        """
        from .. import plots

        self._check_angle()
        value, cause, angles = self.planes()
        figure = plots.redundancy_map_figure(
            value,
            cause,
            angles,
            lines=self.lines_of(trajectory),
            branch=branch,
            name=name or self._name,
            title=self.robot.name,
            angle_name=self.angle_name,
        )
        if path is not None:
            plots.save(figure, path)
        return figure

    def write_html(self, file: str | Path, trajectory: Trajectory | None = None, name: str | None = None) -> None:
        """Write the map as an interactive page that needs no network.

        Parameters
        ----------
        file : path-like
            The page.
        trajectory : Trajectory, optional
            Drawn as a line.
        name : str, optional
            What the values are, in words.

        Raises
        ------
        InvalidValueError
            If there is neither a spin nor a single spare joint that turns.
        ImportError
            If plotly is not installed.
        OSError
            If the file cannot be written.
        """
        from ..plots.map_page import write_map_html

        self._check_angle()
        value, cause, angles = self.planes()
        write_map_html(
            file,
            value,
            cause,
            angles,
            lines=self.lines_of(trajectory),
            name=name or self._name,
            title=self.robot.name,
            angle_name=self.angle_name,
        )

    def _check_angle(self) -> None:
        if not self.has_angles:
            raise InvalidValueError(
                f"the task leaves {self.robot.name} no spin, expected one, or a single spare joint that turns, "
                "for a picture of angles"
            )

    def lines_of(self, trajectory: Trajectory | None) -> list[MapLine]:
        """Return what a picture draws of a trajectory: its spin, or the joint that is held on the map."""
        held = self._held()
        if trajectory is None:
            return []
        if held is None:
            return [MapLine(self.spin_of(trajectory))]
        return [MapLine(trajectory.q[:, held], label=f"chosen {self.angle_name}")]

    @property
    def _name(self) -> str:
        """What the values are, in words."""
        return self.objective.name if self.objective is not None else "value"

    def spin_of(self, trajectory: Trajectory) -> F64:
        """Return the spin of a trajectory along the map's path [rad], shape (N,), from -pi to pi."""
        return core_path(self.path).spins(self.robot, self.task, trajectory.q)


def redundancy_map(
    robot: Robot,
    path: Toolpath,
    task: Task | None = None,
    objective: Objective | None = None,
    n_angles: int = 360,
    *,
    spin_range: tuple[float, float] | None = None,
    spare: tuple[int, ...] | None = None,
    n_spare: int | None = None,
    n_tilts: int = 3,
    n_headings: int = 12,
    limits: bool = True,
    feasible: Predicate | None = None,
    progress: bool = True,
) -> RedundancyMap:
    """Map an objective over path points, spin angles and inverse solutions.

    Parameters
    ----------
    robot : Robot
        Any with up to 16 joints; those beyond what the task and its spin take are spare.
    path : Toolpath
        N points.
    task : Task
        Any; axisymmetric about z if not given. Its targets are the path's positions and, as far as it looks at the
        orientation, axes or rotations. ``Task.within`` a volume adds tilts within it: a picture shows for every spin the
        best of them, `RedundancyMap.best_by_tilt` for every tilt the best spin.
    objective : Objective, optional
        What cells are worth; 0 where feasible if not given.
    n_angles : int
        Spins of the grid; one where the task or the robot leaves no spin.
    spin_range : tuple of float, optional
        Least and largest spin [rad]; a whole turn if not given.
    spare : tuple of int, optional
        Joints that are put on a grid so that the task and its spin take all others, counted from 0. If not given, those
        whose values tell most about the posture (by their share of the null space of the task), weighed against how
        hard the rest is to solve.
    n_spare : int, optional
        Values of each spare joint, over its range. If not given, 120 of a single one; 24 beside spins, or of each of
        two; about 1000 combinations of more; fewer where the rest has no closed form.
    n_tilts, n_headings : int
        Tilts of a volume beside none: so many rings out to its bound, of so many headings each. A product of rotations
        has a grid of its own.
    limits : bool
        Whether postures beyond the position limits are out.
    feasible : callable, optional
        The user's own reason, such as a collision: gets postures (M, n), returns which are allowed (M,).
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    RedundancyMap
        Values, causes, pictures.

    Raises
    ------
    InvalidValueError
        If a setting is out of its domain, the spare joints leave others than the task and its spin take, one of them
        slides without limits, or the path has no rotations and the task looks at more than an axis of the tool.

    Notes
    -----
    At a singularity of the objective (an infinite value) a cell is "singular". Where the rest has neither a closed form
    nor an elimination (tasks with free directions in the base, some arms with slides), postures come by Newton from
    random ones and from those of neighbouring cells: there may be others. All cores work with the GIL released,
    except for objectives and predicates in Python.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.robots.get("fanuc_m710ic50_milling")
    >>> path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0), points=5)
    >>> chart = rd.redundancy_map(robot, path, objective=rd.ConditionNumber(0.4856), n_angles=24)
    >>> chart.value.shape, bool(chart.feasible.any())
    ((5, 24, 8), True)
    """
    task = Task.axisymmetric() if task is None else task
    frames = core_path(path).frames(task)
    chosen, values, spins = spare_grid(robot, task, spare, n_spare)
    angles = (
        angle_grid(spins, n_angles, spin_range) if task.volume is None else _angles_of(task.volume, spins, n_angles)
    )
    for name, count in (("n_tilts", n_tilts), ("n_headings", n_headings)):
        if count < 1:
            raise InvalidValueError(f"{name} is {count}, expected at least 1")
    if task.volume is not None and (spin_range is not None or not spins):
        given = (
            "spin_range beside a volume" if spin_range is not None else f"a volume for {robot.name}, which has no spin"
        )
        raise InvalidValueError(f"task is {given}, expected a volume with its own spin, and joints that spin the tool")
    lattice = Lattice(
        robot, frames, task, angles, list(chosen), values, objective, limits, rings=n_tilts, headings=n_headings
    )
    shape = (len(path), *lattice.shape)
    value, cause = np.empty(shape), np.empty(shape, dtype=np.uint8)
    with progress_bar(len(path), "mapping", progress) as advance:
        chunk = max(1, _CHUNK // int(np.prod(lattice.shape)))
        for first in range(0, len(path), chunk):
            part = slice(first, min(first + chunk, len(path)))
            count = part.stop - part.start
            cells, causes = lattice.survey(first, count, feasible)
            value[part], cause[part] = cells.reshape(count, *shape[1:]), causes.reshape(count, *shape[1:])
            advance(count)
    if len(values) * len(lattice.tilts) == 1:
        value, cause = value[:, 0], cause[:, 0]
    spins = spins and (task.volume is None or task.volume.kind != "product")
    tilts = lattice.tilts
    return RedundancyMap(
        robot, path, task, objective, angles, value, cause, lattice.named, tuple(chosen), values, spins, tilts
    )


def _angles_of(volume: OrientationVolume, spins: bool, count: int) -> F64:
    """Return the spins of a volume on a grid; a product has them among its angles."""
    if volume.kind == "product" or volume.spin is None:
        return angle_grid(spins and volume.kind != "product", count, None)
    low, high = volume.spin
    return angle_grid(spins, count, (low, high)) if low < high else np.array([low])
