"""Pictures of what a robot does along a path."""

from collections.abc import Callable

import numpy as np

from .._util import F64, Joints, checked_joints, coordinates_of, kinds_of, limits_of, names_of
from .colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY
from .style import STYLE, Axes, Figure, legend_beside, log_if_long, marker, mpl, plain
from .subject import Course


def condition_along_path(optimised: Course, fixed: Course | None = None) -> Figure:
    """Draw the condition number along a path.

    Parameters
    ----------
    optimised : Course
        With the spin that was chosen.
    fixed : Course, optional
        The same path with a spin that was not, for comparison; points it did not reach are left out.

    Returns
    -------
    Figure
        kappa_F over time, or over the points of a path without times.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 3.2), layout="constrained")
        _draw_condition(figure.subplots(), optimised, fixed)
    return figure


def joints_against_limits(trajectory: Course, joints: Joints = "robot") -> Figure:
    """Draw every joint with its limits.

    Parameters
    ----------
    trajectory : Course
        The trajectory.
    joints : {"robot", "controller"}
        Whose joints are drawn; one of the controller's that several of the robot's move has no limits of its own.

    Returns
    -------
    Figure
        One panel a joint: its coordinate [deg, mm where prismatic]; what is beyond a limit is shaded.
    """
    with mpl.rc_context(STYLE):
        n = trajectory.robot.n
        columns = min(3, n)
        rows = -(-n // columns)
        figure = Figure(figsize=(2.4 * columns, 1.9 * rows + 0.3), layout="constrained")
        panels = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
        for i, panel in enumerate(panels):
            if i < n:
                _draw_joint(panel, trajectory, i, checked_joints(joints))
            else:
                panel.set_visible(False)
            if n - columns <= i < n:
                panel.tick_params(labelbottom=True)
                panel.set_xlabel(_abscissa(trajectory)[1])
        figure.align_ylabels()
    return figure


def spin_along_path(trajectory: Course) -> Figure:
    """Draw how far the tool turns about its axis along the path, see `Trajectory.spin`.

    Parameters
    ----------
    trajectory : Course
        The trajectory.

    Returns
    -------
    Figure
        Spin [deg] over time, or over the points of a path without times.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 3.2), layout="constrained")
        _draw_spin(figure.subplots(), trajectory)
    return figure


def overview(trajectory: Course, joints: Joints = "robot") -> Figure:
    """Draw condition number, joints in their ranges and spin, one above the other.

    Parameters
    ----------
    trajectory : Course
        The trajectory.
    joints : {"robot", "controller"}
        Whose joints are drawn; those without limits are not.

    Returns
    -------
    Figure
        Three panels with one abscissa.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 7.0), layout="constrained")
        condition, ranges, spin = figure.subplots(3, 1, sharex=True)
        _draw_condition(condition, trajectory, None)
        _draw_ranges(ranges, trajectory, checked_joints(joints))
        _draw_spin(spin, trajectory)
        for panel in (condition, ranges):
            panel.set_xlabel("")
        figure.align_ylabels()
    return figure


def _abscissa(trajectory: Course) -> tuple[F64, str]:
    if trajectory.time is None:
        return np.arange(len(trajectory), dtype=np.float64), "point of the path"
    return trajectory.time, "time [s]"


def _draw_condition(axes: Axes, optimised: Course, fixed: Course | None) -> None:
    x, label = _abscissa(optimised)
    curves = [(optimised, "optimised" if fixed is None else "optimised spin", BLUE, "-")]
    if fixed is not None:
        curves.insert(0, (fixed, "fixed spin", ORANGE, "--"))
    for trajectory, name, color, style in curves:
        kappa = trajectory.condition_number.copy()
        # What belongs to another pose says nothing about this path.
        kappa[trajectory.unreachable] = np.nan
        worst = f", max {np.nanmax(kappa):.3f}" if np.isfinite(kappa).any() else ", out of reach"
        axes.plot(x, kappa, style, marker=marker(x), color=color, label=f"{name}{worst}")
    axes.set(xlabel=label, ylabel=r"condition number $\kappa_F$")
    _fit(axes, optimised)
    log_if_long(axes, np.concatenate([np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.lines]))
    length = "" if optimised.length is None else f"length {1000.0 * optimised.length:.1f} mm"
    axes.legend(loc="best", title=length, alignment="left")


def _fit(axes: Axes, trajectory: Course) -> None:
    """Let the curves fill the width, and number points with whole numbers."""
    x, _ = _abscissa(trajectory)
    if len(x) > 1:
        axes.set_xlim(x[0], x[-1])
    axes.xaxis.set_major_locator(
        mpl.ticker.MaxNLocator("auto", integer=trajectory.time is None, steps=[1, 2, 2.5, 5, 10])
    )


def _draw_spin(axes: Axes, trajectory: Course) -> None:
    x, label = _abscissa(trajectory)
    axes.axhline(0.0, color=GREY, linewidth=1.0)
    axes.plot(x, np.rad2deg(trajectory.spin), marker=marker(x), color=BLUE)
    axes.set(xlabel=label, ylabel="spin about the tool axis\nsince the first point [deg]")
    _fit(axes, trajectory)


def _shown(kind: str) -> tuple[Callable[[F64], F64], str]:
    """Return the conversion of a joint of a kind to what people read, and its unit."""
    if kind == "R":
        return np.rad2deg, "deg"
    return (lambda metres: 1000.0 * metres), "mm"


def _draw_joint(axes: Axes, trajectory: Course, joint: int, joints: Joints) -> None:
    robot = trajectory.robot
    convert, unit = _shown(kinds_of(robot, joints)[joint])
    x, _ = _abscissa(trajectory)
    q = convert(coordinates_of(robot, trajectory.q, joints)[:, joint])
    axes.plot(x, q, marker=marker(x), color=BLUE)
    low, high = (float(convert(limit[joint])) for limit in limits_of(robot, joints))
    bounded = np.isfinite([low, high]).all()
    reach = high - low if bounded else max(float(np.ptp(q)), 1.0)
    bottom = min(low if np.isfinite(low) else q.min(), q.min()) - 0.08 * reach
    top = max(high if np.isfinite(high) else q.max(), q.max()) + 0.08 * reach
    for limit, edge in ((low, bottom), (high, top)):
        if np.isfinite(limit):
            axes.axhspan(limit, edge, color=ORANGE, alpha=0.25, linewidth=0.0)
            axes.axhline(limit, color=ORANGE, linewidth=1.0)
    axes.set(ylim=(bottom, top), ylabel=f"{plain(names_of(robot, joints)[joint])} [{unit}]")
    if unit == "deg":
        axes.yaxis.set_major_locator(mpl.ticker.MultipleLocator(_angle_step(top - bottom)))
    _fit(axes, trajectory)


def _angle_step(span: float) -> float:
    """Return a step for angles that people know, at most seven in a span [deg]."""
    steps = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 90.0, 180.0, 360.0)
    return next((step for step in steps if span <= 7.0 * step), 720.0)


def _draw_ranges(axes: Axes, trajectory: Course, joints: Joints) -> None:
    robot, (x, label) = trajectory.robot, _abscissa(trajectory)
    (low, high), names = limits_of(robot, joints), names_of(robot, joints)
    q = coordinates_of(robot, trajectory.q, joints)
    bounded = np.isfinite(low) & np.isfinite(high)
    colors = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY, BLACK)
    for i in np.flatnonzero(bounded):
        share = 200.0 * (q[:, i] - low[i]) / (high[i] - low[i]) - 100.0
        style = "-" if i < len(colors) else "--"
        axes.plot(x, share, style, marker=marker(x), color=colors[i % len(colors)], label=plain(names[i]))
    for limit in (-100.0, 100.0):
        axes.axhline(limit, color=BLACK, linewidth=1.0, linestyle=":")
    axes.set(xlabel=label, ylabel="place in the joint's range\n[%, limits at ±100]", ylim=(-108.0, 108.0))
    _fit(axes, trajectory)
    legend_beside(axes)
