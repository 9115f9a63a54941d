"""The condition number over a whole turn of the tool."""

import numpy as np
from numpy.typing import ArrayLike

from .._core import ConditionNumber, OrthogonalSQP, Robot, Task
from .._util import F64, checked, turns
from .colours import BLUE, GREY, ORANGE
from .style import STYLE, Figure, mpl


def spin_scan(
    robot: Robot, q: ArrayLike, length: float, axis: ArrayLike = (0.0, 0.0, 1.0), points: int = 361
) -> Figure:
    """Draw the inverse condition number over a whole turn of the tool about its axis (Leger 2014, Fig. 4-8).

    Parameters
    ----------
    robot : Robot
        The robot.
    q : array_like, shape (n,)
        Joint coordinates at spin 0 [rad or m].
    length : float
        Characteristic length [m].
    axis : array_like, shape (3,)
        The tool's axis in the tool frame.
    points : int
        Angles from -180 to 180 deg, an odd number.

    Returns
    -------
    Figure
        1/kappa_F over the spin [deg]; postures beyond the joint limits are dashed, unreachable angles are left out.
    """
    angles = np.linspace(-np.pi, np.pi, points | 1)
    unit = Task.axisymmetric(axis).axis
    turned = _turn_tool(robot, checked("q", q, (robot.n,)), length, unit, angles)
    reached = np.isfinite(turned).all(axis=1)
    index = ConditionNumber(length, rows=robot.rows_in_use())
    inverse = np.full(len(angles), np.nan)
    inverse[reached] = 1.0 / index.evaluate_many(robot, turned[reached], 0)[0]
    inside = np.zeros(len(angles), dtype=bool)
    inside[reached] = robot.within_limits(turned[reached])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 3.2), layout="constrained")
        axes = figure.subplots()
        degrees = np.rad2deg(angles)
        if (reached & ~inside).any():
            axes.plot(degrees, inverse, "--", color=GREY, linewidth=1.2, label="beyond a joint limit")
        axes.plot(degrees, np.where(inside, inverse, np.nan), color=BLUE, label="within the joint limits")
        middle = len(angles) // 2
        axes.plot(0.0, inverse[middle], "o", color=ORANGE, label=f"posture given, {inverse[middle]:.4f}")
        axes.set(xlabel="spin from the posture given [deg]", ylabel=r"inverse condition number $1/\kappa_F$")
        axes.set(xlim=(-180.0, 180.0), ylim=(0.0, None), xticks=np.arange(-180, 181, 60))
        figure.legend(loc="outside upper center", ncols=3)
    return figure


def _turn_tool(robot: Robot, q: F64, length: float, axis: F64, angles: F64) -> F64:
    """Turn the tool about its axis both ways from a posture; NaN where it cannot follow."""
    objective = ConditionNumber(length, rows=robot.rows_in_use(), squared=True)
    solver = OrthogonalSQP(robot, Task.full(), objective, limits=False)
    targets = _turned_targets(robot.fk(q), axis, angles)
    middle = len(angles) // 2
    turned = np.full((len(angles), robot.n), np.nan)
    turned[middle] = q
    for order in (np.arange(middle + 1, len(angles)), np.arange(middle - 1, -1, -1)):
        postures, _, _, _, statuses, _ = solver.follow_chunk(targets[order], q)
        # Beyond the first angle that is out of reach the robot has left the branch.
        good = next((k for k, status in enumerate(statuses) if status == "unreachable"), len(statuses))
        turned[order[:good]] = postures[:good]
    return turned


def _turned_targets(tool: F64, axis: F64, angles: F64) -> F64:
    """Return the targets of the full task for a tool that is turned about its axis."""
    rotations = tool[:3, :3] @ turns(axis, angles)
    return np.hstack([np.tile(tool[:3, 3], (len(angles), 1)), rotations.reshape(-1, 9)])
