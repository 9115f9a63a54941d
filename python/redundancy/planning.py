"""The best spin over a whole path: a search over all spins and branches, then the continuous optimum."""

from dataclasses import replace
from typing import Final

import numpy as np

from ._core import Objective, Robot, Task
from ._layers import Layers, SearchSettings
from ._plan_bound import is_proven, with_bound
from ._plan_refine import better_parts, from_warm_start
from ._plan_result import Plan, PlanFailure
from ._plan_search import searched_parts
from ._plan_setup import Setup
from ._plan_verdict import assembled
from ._spare import angle_grid, spare_grid
from ._util import progress_bar
from .errors import InvalidValueError
from .maps import Predicate
from .paths import Toolpath, Trajectory

__all__ = ["Plan", "PlanFailure", "plan"]

_CRITERIA: Final = ("minimax", "integral", "motion")
_EFFORT: Final = 4
_JUMP: Final = 0.5
"""A joint that moves further from point to point [rad or m] jumps, where the path leaves it another way."""


def plan(
    robot: Robot,
    path: Toolpath,
    task: Task | None = None,
    objective: Objective | None = None,
    criterion: str = "minimax",
    limits: bool = True,
    *,
    smoothness: float | None = None,
    n_angles: int = 48,
    layers: int = 32,
    spin_range: tuple[float, float] | None = None,
    max_spin_step: float = np.pi / 3.0,
    max_step: float | None = None,
    spare: tuple[int, ...] | None = None,
    n_spare: int = 24,
    branches: tuple[int, ...] | None = None,
    branch_changes: bool = False,
    closed: bool = False,
    feasible: Predicate | None = None,
    warm_start: Trajectory | None = None,
    bound: bool | None = None,
    effort: int | None = None,
    max_iterations: int = 200,
    progress: bool = True,
) -> Plan:
    """Plan the free motion of a robot along a whole path: the spin of its tool, and its spare joints.

    Every inverse solution at some points of the path, over a grid of spins, is searched for the best route; from there
    the path as a whole is brought to its continuous optimum by an interior-point method with exact second derivatives.

    Parameters
    ----------
    robot : Robot
        Six revolute joints, or more of which some are spare (a seven-axis arm, a robot on a rail).
    path : Toolpath
        N points; with times, joint speed limits hold.
    task : Task
        Axisymmetric (default, about z) or full.
    objective : Objective, optional
        What is minimised. Not needed for the criterion "motion".
    criterion : {"minimax", "integral", "motion"}
        The worst value on the path; the mean value; or the integral of the squared joint speed alone.
    limits : bool
        Whether position limits hold, and speed limits where the path has times.
    smoothness : float, optional
        Weight of the integral of the squared joint speed, over the path's share s from 0 to 1:
        value + smoothness * integral |dq/ds|^2 ds. If not given, 1e-5 of the mean value, 1e-7 for the worst one.
    n_angles, n_spare : int
        Grid of the search: spins, and values of each spare joint.
    layers : int
        Points of the path at which the first search begins; more are added where the path needs them.
    spin_range : tuple of float, optional
        Least and largest spin [rad], from the path's rotations (or from frames that never turn about the axis); a whole
        turn if not given.
    max_spin_step : float
        Largest change of the spin from one point of the search to the next [rad].
    max_step : float, optional
        Largest motion of any joint from point to point [rad or m], beside the speed limits of a path with times. If not
        given, 0.5 where a path without times can keep to it.
    spare : tuple of int, optional
        Joints on the grid, counted from 0; chosen if not given.
    branches : tuple of int, optional
        Branches that may be used, as in `redundancy_map`; all if not given.
    branch_changes : bool
        Whether the branch may change where the joints are continuous, through a singularity.
    closed : bool
        Whether the last point, which has to be the first, is reached in the same posture up to whole turns.
    feasible : callable, optional
        The user's own reason, such as a collision: gets postures (M, n), returns which are allowed (M,).
    warm_start : Trajectory, optional
        An earlier plan of a similar path: refined at once, with a search only if that fails.
    bound : bool, optional
        Whether to prove how good the plan is; done for "minimax" if not given.
    effort : int, optional
        Searches at most; the best plan is kept, and one at its lower bound ends them. The second asks at every
        point, up to 1000 and as far as joints can move by a spin of the grid from one to the next; each one after it
        doubles the spins. If not given, 4; 1 for the criterion "motion", or with joints to spare.
    max_iterations : int
        Newton steps of the refinement at most.
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    Plan
        Where the path cannot be followed, ``failure`` names the first bad point and the cause, the points of ``status``
        "unreachable" hold the posture of the nearest point that is reached, and the others are planned as far as there
        is a way.

    Raises
    ------
    InvalidValueError
        If a setting is out of its domain, or the task or the robot is none that can be planned for.

    Notes
    -----
    The share of the path is time where it has times, else length. The bound of a minimax plan is the least value at its
    worst points: the best of the grid's postures there, each brought to its minimum by Newton. It is proven to the
    resolution of that grid.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.robots.get("fanuc_m710ic50_milling")
    >>> path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0))
    >>> best = rd.plan(robot, path, objective=rd.ConditionNumber(0.4856))
    >>> best.max_condition_number < 2.55, best.gap < 1e-4
    (True, True)
    """
    task = Task.axisymmetric() if task is None else task
    _check(objective, criterion, smoothness, layers, effort, max_spin_step, max_step, max_iterations)
    setup = Setup.of(robot, path, task, objective, criterion, smoothness, limits, closed, spin_range, max_iterations)
    chosen, values = spare_grid(robot, spare, n_spare)
    if effort is None:
        # Motion is known between points, and grids with joints to spare are large.
        effort = 1 if criterion == "motion" or chosen else _EFFORT
    angles = angle_grid(task, n_angles, spin_range)
    settings = SearchSettings(
        angles, spin_range is None, max_spin_step, chosen, values, branches, branch_changes, feasible
    )
    wanted = criterion == "minimax" if bound is None else bound
    with progress_bar(len(path), "planning", progress) as advance:

        def planned(setup: Setup) -> Plan:
            known = Layers(setup, settings)
            parts = from_warm_start(setup, feasible, warm_start)
            for search in () if parts else range(effort):
                finer = angle_grid(task, n_angles * 2 ** max(search - 1, 0), spin_range)
                known = Layers(setup, replace(settings, angles=finer))
                searched = searched_parts(setup, known, feasible, known.most_layers() if search else layers, advance)
                parts = better_parts(setup, parts, searched)
                if is_proven(setup, known, parts):
                    break
            result = assembled(setup, known, parts)
            return with_bound(setup, known, result, advance) if wanted else result

        result = planned(setup if max_step is None else setup.with_step(max_step))
        if max_step is None and path.time is None and result.failure is None and _largest_step(result) > _JUMP:
            # A jump is no way along the path, unless the path itself asks for it.
            steady = planned(setup.with_step(_JUMP))
            result = result if steady.failure is not None else steady
    return result


def _largest_step(result: Plan) -> float:
    return float(np.abs(np.diff(result.q, axis=0)).max(initial=0.0))


def _check(
    objective: Objective | None,
    criterion: str,
    smoothness: float | None,
    layers: int,
    effort: int | None,
    max_spin_step: float,
    max_step: float | None,
    max_iterations: int,
) -> None:
    if criterion not in _CRITERIA:
        raise InvalidValueError(f"criterion is {criterion!r}, expected one of {', '.join(map(repr, _CRITERIA))}")
    if criterion != "motion" and objective is None:
        raise InvalidValueError(f"objective is None, expected an objective for the criterion {criterion!r}")
    for name, number in (("layers", layers), ("effort", effort), ("max_iterations", max_iterations)):
        if number is not None and number < 1:
            raise InvalidValueError(f"{name} is {number}, expected at least 1")
    if smoothness is not None and not 0.0 <= smoothness < np.inf:
        raise InvalidValueError(f"smoothness is {smoothness}, expected a finite number of at least 0")
    if not 0.0 < max_spin_step <= np.pi:
        raise InvalidValueError(f"max_spin_step is {max_spin_step}, expected an angle above 0, at most pi [rad]")
    if max_step is not None and not max_step > 0.0:
        raise InvalidValueError(f"max_step is {max_step}, expected a number above 0")
