"""The best spin over a whole path: a search over all spins and branches, then the continuous optimum."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from .._core import ConditionNumber, Objective, PlanSettings, Robot, Task
from .._util import progress_bar
from ..errors import InvalidValueError
from ..paths import Toolpath, Trajectory
from ..robots import Dynamics, TorqueFunction
from .map import Predicate
from .numbers import core_path
from .result import Plan, Way
from .speed import faster
from .transfer import Transfer

SINGULAR = 1e12
"""A posture with a larger condition number is singular: hardly a digit is left that tells it from infinity."""

EdgeCost = Callable[[NDArray[np.float64], NDArray[np.float64]], ArrayLike]
"""Says of postures before and after some steps, shape (M, n) each, what the steps cost, shape (M,)."""


def plan(
    robot: Robot,
    path: Toolpath,
    task: Task | None = None,
    objective: Objective | None = None,
    criterion: str = "minimax",
    limits: bool = True,
    *,
    smoothness: float | None = None,
    joint_weights: ArrayLike | None = None,
    n_angles: int = 48,
    layers: int = 32,
    spin_range: tuple[float, float] | None = None,
    max_spin_step: float = np.pi / 3.0,
    max_step: float | None = None,
    spare: tuple[int, ...] | None = None,
    n_spare: int | None = None,
    branches: tuple[int, ...] | None = None,
    branch_changes: bool = False,
    closed: bool = False,
    feasible: Predicate | None = None,
    edge_cost: EdgeCost | None = None,
    torque: Dynamics | TorqueFunction | None = None,
    torque_limit: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    warm_start: Trajectory | None = None,
    bound: bool | None = None,
    effort: int | None = None,
    max_iterations: int = 200,
    start: ArrayLike | None = None,
    end: ArrayLike | None = None,
    pins: Mapping[int, float | ArrayLike] | None = None,
    reconfigurations: bool = False,
    lift_off: float = 0.05,
    progress: bool = True,
) -> Plan:
    """Plan the free motion of a robot along a whole path: the spin of its tool, and its spare joints.

    Every inverse solution at some points of the path, over a grid of spins, is searched for the best route; from there
    the path as a whole is brought to its continuous optimum by an interior-point method with exact second derivatives.

    Parameters
    ----------
    robot : Robot
        Any with up to 16 joints that can do the task: as many joints as the task takes, whose plan is the choice of
        branches and whole turns, or more, of which some are spare (a planar arm of four joints, a seven-axis arm, a
        robot on a rail). A SCARA or a planar arm does a task as far as it can move its tool. Where the robot has fewer
        joints than rows of the Jacobian in use the ``condition_number`` of the plan is NaN, and an objective needs
        ``rows``.
    path : Toolpath
        N points; with times, joint speed limits hold.
    task : Task
        Any: axisymmetric about z if not given. Its targets are the path's positions and, as far as it looks at the
        orientation, axes (an axis of the tool) or rotations (more than that). ``Task.within`` a cone, a pyramid, a
        square or a product of three rotations leaves the tool its tilt as well: the volume is seen in the path's
        rotations; axes alone are enough for a cone with free spin.
    objective : Objective, optional
        What is minimised. Not needed for the criteria "motion" and "speed".
    criterion : {"minimax", "integral", "motion", "speed"}
        The worst value on the path; the mean value; the integral of the squared joint speed alone; or the largest
        constant speed of the tool by the speed limits ``robot.qd_max``: the largest |dq| / (qd_max ds) of all joints and
        steps is minimised, 1 / `Plan.speed`. A step without length, on which the tool stands, does not count. Times of
        the path are not looked at.
    limits : bool
        Whether position limits hold, and speed limits where the path has times.
    smoothness : float, optional
        Weight of the integral of the squared joint speed, over the path's share s from 0 to 1:
        value + smoothness * integral |dq/ds|^2 ds. If not given, 1e-5 of the mean value, 1e-7 for the worst one.
    joint_weights : array_like, shape (n,), optional
        Weights of the joints in that integral, |dq/ds|^2 being the sum of weight times square, wherever motion is
        minimised; not negative, not all 0; 1 each if not given. A joint of weight 0 moves for nothing.
    n_angles : int
        Spins of the search's grid; half as many beside the tilts of a volume.
    n_spare : int, optional
        Values of each spare joint. If not given, 120 of a single one; 24 beside spins, or of each of two; about 1000
        combinations of more; fewer where the rest has no closed form; half as many beside the tilts of a volume.
    layers : int
        Points of the path at which the first search begins; more are added where the path needs them.
    spin_range : tuple of float, optional
        Least and largest spin [rad], from the path's rotations (or from frames that never turn about the axis); a whole
        turn if not given. A volume has a spin of its own.
    max_spin_step : float
        Largest change of the spin from one point of the search to the next [rad].
    max_step : float, optional
        Largest motion of any joint from point to point [rad or m], beside the speed limits of a path with times. If not
        given, 0.25 rad for joints that turn, on paths without times. Where no way keeps to it ``failure`` names the
        first step that is larger.
    spare : tuple of int, optional
        Joints on the grid, counted from 0. If not given, those whose values tell most about a posture (by their share
        of the null space of the task), weighed against how hard the rest is to solve; where these lead to no whole
        plan, the next best.
    branches : tuple of int, optional
        Branches that may be used, as in `redundancy_map`; all if not given.
    branch_changes : bool
        Whether the branch may change where the joints are continuous, through a singularity.
    closed : bool
        Whether the last point, which has to be the first, is reached in the same posture up to whole turns.
    feasible : callable, optional
        The user's own reason, such as a collision: gets postures (M, n), returns which are allowed (M,).
    edge_cost : callable, optional
        The user's own cost of moving from a point of the path to the next: gets the postures before and after steps,
        shape (M, n) each, returns what each step costs, shape (M,): at least 0, ``inf`` where it is forbidden. Its sum
        over the path is added to what is minimised; for "minimax" to the motion, which decides among ways of the same
        worst value. The search asks of steps between its own points, several points of the path apart: what is added
        up along a way, such as distances, is meant; ``layers=len(path)`` lets it ask at every point. Joints that can
        turn more than once come next to where they were.
    torque, torque_limit, acceleration : optional
        More that limits the speed for the criterion "speed", beside the joint rates, as in `constant_speed`: the plan
        by rates is where `fastest` starts, for tasks within a volume and robots of six joints.
    warm_start : Trajectory, optional
        An earlier plan of a similar path: refined at once, with a search only if that fails.
    bound : bool, optional
        Whether to prove how good the plan is; done for "minimax" if not given.
    effort : int, optional
        Searches at most; the best plan is kept. Each one after the first doubles the spins and the values of spare
        joints, where the least values of single points tell that something may be gained. If not given, 2; 1 for the
        criterion "motion", with joints to spare or an ``edge_cost``.
    max_iterations : int
        Newton steps of the refinement at most.
    start, end : array_like, shape (n,), optional
        Postures in which the path begins and ends [rad or m], whole turns included: within limits, and within 1e-6 of
        the first and the last point [m, rad]. The plan has them digit for digit. A closed path has no ``end`` of its
        own.
    pins : mapping, optional
        What is held at other points: ``{point: spin}`` or ``{point: posture}``, points counted from 0. A spin [rad] is
        that of `RedundancyMap`, from the path's frame; a posture is as ``start``. Limits, the largest step and the
        speed limits hold at pins and beside them; where they leave no way ``failure`` names the pin.
    reconfigurations : bool
        Whether the path may be cut where no single way exists, into as few segments as the search's grid allows, each
        planned as a whole: ``Plan.segments``, and in ``Plan.transfers`` how the robot gets from one to the next. Where
        the search finds a whole way nothing is cut. The point at which a segment ends also begins the next one, so that
        no stretch of the path is left out, unless no posture can move on from there.
    lift_off : float
        How far the tool is drawn back along its axis before it changes its posture [m], as far as the robot can.
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
        If a setting is out of its domain, the task or the robot is none that can be planned for, or ``feasible`` or
        ``edge_cost`` returns what it should not. What they raise is raised.

    Notes
    -----
    The share of the path is time where it has times, else length. The bound of a minimax plan is the least value at its
    worst points, the best of the grid's postures there, each brought to its minimum by Newton; for arms whose branches
    have names and no joint is to spare also the least bottleneck over connected ways. It is proven to the resolution of
    the grid. At a singularity that cannot be avoided the value, and with it the bound, is infinite, and ``notes`` tell.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.robots.get("fanuc_m710ic50_milling")
    >>> path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0))
    >>> best = rd.plan(robot, path, objective=rd.ConditionNumber(0.4856))
    >>> best.max_condition_number < 2.55, best.gap < 1e-4
    (True, True)
    """
    settings = PlanSettings(
        criterion,
        limits,
        smoothness=smoothness,
        joint_weights=joint_weights,
        n_angles=n_angles,
        layers=layers,
        spin_range=spin_range,
        max_spin_step=max_spin_step,
        max_step=max_step,
        spare=spare,
        n_spare=n_spare,
        branches=branches,
        branch_changes=branch_changes,
        closed=closed,
        bound=bound,
        effort=effort,
        max_iterations=max_iterations,
        start=start,
        end=end,
        pins=pins,
        reconfigurations=reconfigurations,
        lift_off=lift_off,
    )
    limited = torque is not None or acceleration is not None
    if limited and (criterion != "speed" or closed or reconfigurations or start is not None or end is not None or pins):
        raise InvalidValueError(
            "torque and acceleration are for the criterion 'speed' alone, without closed, reconfigurations, start, end "
            "and pins"
        )
    found = plan_by(
        settings,
        robot,
        path,
        task,
        objective,
        feasible=feasible,
        edge_cost=edge_cost,
        warm_start=warm_start,
        progress=progress,
    )
    if not limited:
        return found
    task = Task.axisymmetric() if task is None else task
    return faster(found, task, torque=torque, torque_limit=torque_limit, acceleration=acceleration, limits=limits)


def plan_by(
    settings: PlanSettings,
    robot: Robot,
    path: Toolpath,
    task: Task | None = None,
    objective: Objective | None = None,
    *,
    feasible: Predicate | None = None,
    edge_cost: EdgeCost | None = None,
    warm_start: Trajectory | None = None,
    progress: bool = True,
) -> Plan:
    """Plan the free motion of a robot along a whole path by settings that are made already.

    Parameters
    ----------
    settings : PlanSettings
        How it is planned.
    robot, path, task, objective, feasible, edge_cost, warm_start, progress
        As for `plan`.

    Returns
    -------
    Plan
        As for `plan`.

    Raises
    ------
    InvalidValueError
        If the task, the robot or the path is none that can be planned for.
    """
    task = Task.axisymmetric() if task is None else task
    earlier = None if warm_start is None else (core_path(warm_start.path), warm_start.q)
    with progress_bar(1.0, "planning", progress) as advance:
        found = _core.plan_path(
            robot, core_path(path), task, objective, settings, feasible, edge_cost, earlier, advance
        )
    rows = robot.rows_in_use()
    if len(rows) <= robot.n:
        condition_number = ConditionNumber(found.length, rows=rows).evaluate_many(robot, found.q, 0)[0]
        condition_number = np.where(condition_number > SINGULAR, np.inf, condition_number)
    else:
        condition_number = np.full(len(path), np.nan)
    tilt, heading, twist = (None,) * 3 if task.volume is None else core_path(path).tilts(robot, task, found.q).T
    return Plan(
        robot=robot,
        path=path,
        q=found.q,
        condition_number=condition_number,
        value=found.value,
        position_error=found.position_error,
        axis_error=found.axis_error,
        status=found.status,
        length=found.length,
        objective=None if settings.criterion in ("motion", "speed") else objective,
        criterion=settings.criterion,
        smoothness=found.smoothness,
        cost=found.cost,
        motion=found.motion,
        edge_cost=found.edge_cost,
        bound=found.bound,
        residual=found.residual,
        failure=found.failure,
        refined=found.refined,
        notes=tuple(found.notes),
        ways=tuple(Way(*way) for way in found.ways),
        segments=found.segments,
        transfers=[Transfer(robot, way.points, way.q, way.lift, way.allowed) for way in found.transfers],
        tilt=tilt,
        heading=heading,
        twist=twist,
    )
