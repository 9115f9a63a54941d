"""Pictures of one posture."""

from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from .._core import Robot
from .._core import planar_tetrahedron as tetrahedron_of
from .._util import F64
from .colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY
from .style import STYLE, Axes3D, Figure, Poly3DCollection, mpl
from .subject import Placed


def posture_3d(robot: Robot, q: ArrayLike, path: Placed | None = None) -> Figure:
    """Draw a robot as a stick figure.

    Parameters
    ----------
    robot : Robot
        The robot.
    q : array_like, shape (n,)
        Joint coordinates [rad or m].
    path : Toolpath, optional
        A path to draw with it.

    Returns
    -------
    Figure
        Links, joints, the tool frame's axes and the path in the base frame [m].
    """
    frames = robot.link_frames(q)
    sticks = _sticks(frames)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.0, 4.8), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        axes.plot(*sticks.T, color=GREY, linewidth=4.0, solid_capstyle="round", solid_joinstyle="round", label="links")
        axes.plot(*frames[:-1, :3, 3].T, "o", color=BLACK, markersize=5.0, label="joints")
        size = 0.12 * float(np.ptp(sticks, axis=0).max())
        for i, (name, color) in enumerate((("x", ORANGE), ("y", GREEN), ("z", BLUE))):
            tip = frames[-1, :3, 3] + size * frames[-1, :3, i]
            axes.plot(*np.stack([frames[-1, :3, 3], tip]).T, color=color, linewidth=2.0, label=f"tool {name}")
        if path is not None:
            axes.plot(*path.position.T, color=PURPLE, linewidth=2.0, label="path")
        _equal_scales(axes, np.vstack([sticks, *([] if path is None else [path.position])]))
        figure.legend(loc="outside upper center", ncols=3)
    return figure


def planar_tetrahedron(robot: Robot, q: ArrayLike, length: float) -> Figure:
    """Draw a planar 3R robot in its plane with the tetrahedron of its condition number (Leger 2014, eq. 2.15 to 2.21).

    Parameters
    ----------
    robot : Robot
        Three revolute joints about the base z axis.
    q : array_like, shape (3,)
        Joint coordinates [rad].
    length : float
        Height of the tetrahedron: the characteristic length [m].

    Returns
    -------
    Figure
        The robot, and the tetrahedron on its three joints, whose apex is above the operation point.

    Raises
    ------
    InvalidValueError
        If the robot is another or the length is not positive.
    """
    found = tetrahedron_of(robot, q, length)
    points = robot.link_frames(q)[:, :3, 3]
    joints, tip = points[:3], points[3]
    apex = tip + np.array([0.0, 0.0, length])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(5.0, 4.8), layout="constrained")
        axes = figure.add_subplot(projection="3d")
        faces = [np.stack([joints[i], joints[j], apex]) for i, j in ((0, 1), (1, 2), (2, 0))]
        axes.add_collection3d(
            Poly3DCollection([joints, *faces], facecolor=SKY, edgecolor=BLUE, linewidth=0.8, alpha=0.2)
        )
        axes.plot(*points.T, "-", color=GREY, linewidth=4.0, solid_capstyle="round", label="robot")
        axes.plot(*joints.T, "o", color=BLACK, markersize=5.0, label="joints")
        axes.plot(*tip[:, None], "s", color=ORANGE, markersize=5.0, label="operation point")
        axes.plot(*np.stack([tip, apex]).T, "--", color=ORANGE, linewidth=1.2, label=f"height {length:.4g} m")
        _equal_scales(axes, np.vstack([points, apex]))
        title = f"volume {found['volume']:.4g} m³, condition number $\\kappa_F$ = {found['condition_number']:.4g}"
        figure.legend(loc="outside upper center", ncols=2, title=title)
    return figure


def _sticks(frames: F64) -> F64:
    """Join origins by way of the foot on each joint's axis, so that offsets show as they are built."""
    points = [frames[0, :3, 3] * 0.0]
    for here, there in pairwise(frames):
        along = here[:3, 2] * (here[:3, 2] @ (there[:3, 3] - here[:3, 3]))
        points += [here[:3, 3], here[:3, 3] + along]
    return np.array([*points, frames[-1, :3, 3]])


def _equal_scales(axes: Axes3D, points: F64) -> None:
    """Give the three axes one scale and one step, with room for the labels of the shortest."""
    low, high = points.min(axis=0), points.max(axis=0)
    longest = float((high - low).max())
    spans = np.maximum(1.1 * (high - low), 0.5 * longest)
    middle = 0.5 * (low + high)
    for name, center, span in zip("xyz", middle, spans, strict=True):
        axes.set(**{f"{name}lim": (center - span / 2.0, center + span / 2.0), f"{name}label": f"{name} [m]"})
        axis = getattr(axes, f"{name}axis")
        axis.labelpad = 8.0
        axis.set_major_locator(mpl.ticker.MultipleLocator(_step(longest)))
    axes.set_box_aspect(spans, zoom=0.85)


def _step(span: float) -> float:
    """Return 1, 2 or 5 times a power of ten, about an eighth of a span."""
    size = 10.0 ** np.floor(np.log10(span / 8.0))
    return float(size * next(factor for factor in (1.0, 2.0, 5.0, 10.0) if factor * size >= span / 8.0))
