"""`redundancy.plan` beside Descartes, in one run on one processor.

``python -m evidence.planner.descartes [--write] [--points 50 200] [--repeat 5]`` prints the table of
docs/plan_comparison.md; with --write it puts it there. ABB IRB 2400, the tool held downwards along a wave, its spin
free. Descartes (ROS-Industrial, Apache-2.0, in Tesseract's wheel) takes every posture at spins 2 degrees apart and
searches the ladder of them for the shortest motion, without collisions.
"""

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.metadata import version
from platform import python_version
from time import perf_counter, process_time
from typing import Any, TypeAlias

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

from evidence.pages import DOCS, show, table

F64 = NDArray[np.float64]
Planner = Callable[[], F64]
"""What is timed: from nothing to postures, shape (N, 6)."""
Module: TypeAlias = Any
Profile: TypeAlias = Any

PAGE = DOCS / "plan_comparison.md"
ROBOT = "abb_irb2400"
PEER = "tesseract-robotics-nanobind==0.35.0.3"
SPIN_STEP = np.deg2rad(2.0)
DOWNWARDS = (0.0, -1.0, 0.0, 0.0)
"""Orientation of the tool for Descartes, w, x, y, z: half a turn about x."""
TOLERANCE = 1e-6
"""How far off the path [m], and off the axis [rad], a posture may be."""


@dataclass(frozen=True)
class Figures:
    """One planner's time and motion.

    Attributes
    ----------
    time, processor : float
        Median wall time and processor time [ms].
    length : float
        Way of all joints together [rad].
    step : float
        Largest step of a joint from a point to the next [rad].
    roughness : float
        Root of the mean square of the second differences [rad].
    """

    time: float
    processor: float
    length: float
    step: float
    roughness: float


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
    parser.add_argument("--points", type=int, nargs="+", default=[50, 200], help="points of the path")
    parser.add_argument("--repeat", type=int, default=5, help="timed runs, of which the median counts")
    parser.add_argument("--write", action="store_true", help="put the table into the page")
    options = parser.parse_args(arguments)
    if min(options.points) < 3 or options.repeat < 1:
        parser.error("needs 3 points and 1 run at least")
    if rd.build_profile != "release":
        parser.error(f"needs a release build, this one is {rd.build_profile!r}")
    # Before Tesseract starts its threads, and lest it writes into the table.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("TRAJOPT_LOG_THRESH", "ERROR")
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    tesseract("planning")
    rows: list[list[object]] = []
    for count in options.points:
        position = wave(count)
        peer = measure(descartes(position), position, options.repeat)
        own = measure(ours(position), position, options.repeat)
        time, processor = peer.time / own.time, peer.processor / own.processor
        ratios = (
            f"{time:.3g}, {processor:.3g}",
            f"{peer.length / own.length:.3g}",
            "",
            f"{peer.roughness / own.roughness:.3g}",
        )
        rows.append([count, "Descartes, 2 deg", *_texts(peer)])
        rows.append([count, "`rd.plan`", *_texts(own)])
        rows.append([count, "Descartes over `rd.plan`", *ratios])
    head = ("points", "planner", "time, wall and CPU [ms]", "joint path [rad]", "largest step [rad]")
    packages = ", ".join(f"{name} {version(name)}" for name in (PEER.partition("==")[0], "numpy"))
    load = f", load {os.getloadavg()[0]:.2g}" if hasattr(os, "getloadavg") else ""
    made = f"Python {python_version()}, redundancy {rd.__version__}, {packages}; median of {options.repeat}{load}."
    text = f"{table((*head, 'rms second difference [rad]'), rows)}\n\n{made}"
    show(PAGE, [("descartes", text)], options.write)
    return 0


def wave(count: int) -> F64:
    """Return the positions of the path.

    Parameters
    ----------
    count : int
        Number of points, at least 2.

    Returns
    -------
    ndarray, shape (count, 3)
        Positions of the tool point [m].
    """
    s = np.linspace(0.0, 1.0, count)
    return np.stack([0.85 + 0.05 * np.sin(6.0 * s), 0.8 * s - 0.4, np.full(count, 0.8)], axis=1)


def axis_of(quaternion: tuple[float, float, float, float]) -> F64:
    """Return the z axis of a rotation.

    Parameters
    ----------
    quaternion : tuple of float
        Unit quaternion w, x, y, z.

    Returns
    -------
    ndarray, shape (3,)
        Third column of the rotation matrix.
    """
    w, x, y, z = quaternion
    return np.array([2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)])


def ours(position: F64) -> Planner:
    """Prepare this package.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Positions of the tool point [m].

    Returns
    -------
    callable
        Plans once.
    """
    robot, task = rd.robots.get(ROBOT), rd.Task.axisymmetric()
    path = rd.Toolpath(position, np.tile(axis_of(DOWNWARDS), (len(position), 1)))

    def plan() -> F64:
        postures: F64 = rd.plan(robot, path, task, None, criterion="motion", limits=True).q
        return postures

    return plan


def descartes(position: F64, orientation: Sequence[float] = DOWNWARDS) -> Planner:
    """Prepare Descartes: robot, program and profiles are made ahead, the Cartesian pipeline is what plans.

    Parameters
    ----------
    position : ndarray, shape (N, 3)
        Positions of the tool point [m].

    Returns
    -------
    callable
        Plans once.
    """
    planning, solvers = tesseract("planning"), tesseract("tesseract_motion_planners_descartes")
    robot = planning.Robot.from_tesseract_support(ROBOT)
    names = robot.get_joint_names("manipulator")
    robot.set_joints(np.zeros(len(names)), joint_names=names)
    program = planning.MotionProgram("manipulator", tcp_frame="tool0").set_joint_names(names)
    for point in position:
        pose = planning.Pose.from_xyz_quat(list(point), tuple(orientation))
        program = program.move_to(planning.CartesianTarget(pose, profile="DEFAULT"))
    profiles = tesseract("tesseract_command_language").ProfileDictionary()
    for profile in _sampling(solvers), _one_thread(solvers):
        profiles.addProfile("DescartesMotionPlannerTask", "DEFAULT", profile)

    def plan() -> F64:
        result = planning.plan_cartesian(robot, program, pipeline="DescartesDNPCPipeline", profiles=profiles)
        if not result.successful:
            sys.exit(f"Descartes found no way: {result.message}")
        return np.array([point.positions for point in result])

    return plan


def tesseract(module: str) -> Module:
    """Import a module of Tesseract, or say what to install.

    Parameters
    ----------
    module : str
        Its name within `tesseract_robotics`.

    Returns
    -------
    module
        The module.
    """
    try:
        return import_module(f"tesseract_robotics.{module}")
    except ImportError as error:
        sys.exit(f"Descartes cannot be imported ({error}): pip install {PEER}")


def measure(planner: Planner, position: F64, repeat: int) -> Figures:
    """Time a planner, once its first plan, not timed, has been checked.

    Parameters
    ----------
    planner : callable
        Plans once.
    position : ndarray, shape (N, 3)
        Where the tool point has to be [m].
    repeat : int
        Number of timed runs.

    Returns
    -------
    Figures
        Median time, and what the plan is like.
    """
    q = planner()
    _check(q, position)
    times = []
    for _ in range(repeat):
        start = perf_counter(), process_time()
        planner()
        times.append((perf_counter() - start[0], process_time() - start[1]))
    step = np.abs(np.diff(q, axis=0))
    roughness = np.sqrt(np.mean(np.diff(q, 2, axis=0) ** 2))
    wall, processor = 1e3 * np.median(times, axis=0)
    return Figures(float(wall), float(processor), float(step.sum()), float(step.max()), float(roughness))


def _check(q: F64, position: F64) -> None:
    """Exit unless every posture is on the path, points downwards and keeps the limits."""
    robot = rd.robots.get(ROBOT)
    if q.shape != (len(position), robot.n):
        sys.exit(f"a plan of shape {q.shape} for {len(position)} points")
    frames = np.array([robot.fk(each) for each in q])
    off = np.abs(frames[:, :3, 3] - position).max()
    tilt = np.linalg.norm(np.cross(frames[:, :3, 2], axis_of(DOWNWARDS)), axis=1).max()
    upwards = (frames[:, :3, 2] @ axis_of(DOWNWARDS)).min() < 0.0
    over = max((robot.q_min - q).max(), (q - robot.q_max).max())
    # The URDF rounds the limits to four digits.
    if off > TOLERANCE or tilt > TOLERANCE or upwards or over > 1e-3:
        sys.exit(f"a plan {off:.1e} m and {tilt:.1e} rad off the path, {over:.1e} rad beyond the limits")


def _sampling(solvers: Module) -> Profile:
    """Spins all around the tool's axis, a step apart, and no collisions."""
    profile = solvers.DescartesDefaultPlanProfileD()
    profile.enable_collision = profile.enable_edge_collision = profile.target_pose_fixed = False
    profile.allow_collision = True
    profile.target_pose_sample_axis = np.array([0.0, 0.0, 1.0])
    profile.target_pose_sample_resolution = SPIN_STEP
    profile.target_pose_sample_min, profile.target_pose_sample_max = -np.pi, np.pi - SPIN_STEP
    return solvers.cast_DescartesPlanProfileD(profile)


def _one_thread(solvers: Module) -> Profile:
    profile = solvers.DescartesLadderGraphSolverProfileD()
    profile.num_threads = 1
    return solvers.cast_DescartesSolverProfileD(profile)


def _texts(figures: Figures) -> tuple[str, str, str, str]:
    times = f"{figures.time:.1f}, {figures.processor:.1f}"
    return times, f"{figures.length:.4f}", f"{figures.step:.4f}", f"{figures.roughness:.2e}"


if __name__ == "__main__":
    sys.exit(main())
