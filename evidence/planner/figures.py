"""The pictures of docs/plan.md: ``python -m evidence.planner.figures [folder]``; the folder is docs/img if left out."""

import sys
from pathlib import Path

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy import plots
from redundancy.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, Axes, Figure, mpl

from evidence import pages

F64 = NDArray[np.float64]
Place = tuple[float, float, float]

COLORS = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY, BLACK)


def tool(degrees: float, x: float, z: float) -> F64:
    """Return a tool with its tip at x and z of the flange [m], its axis tilted about y."""
    cosine, sine = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return np.array([[cosine, 0.0, sine, x], [0.0, 1.0, 0.0, 0.0], [-sine, 0.0, cosine, z], [0.0, 0.0, 0.0, 1.0]])


def rolling(start: Place, stop: Place, degrees: float, points: int, duration: float | None) -> rd.Toolpath:
    """Return a line along which the tool, pointing down, rolls from one side to the other."""
    roll = np.deg2rad(np.linspace(-degrees, degrees, points))
    axis = np.stack([0.2 + 0.0 * roll, np.sin(roll), -np.cos(roll)], axis=1)
    time = None if duration is None else np.linspace(0.0, duration, points)
    return rd.Toolpath(np.linspace(start, stop, points), axis, time=time)


def helix_map(folder: Path) -> None:
    """Draw what every spin is worth along the milled helix, and the spin of the plan."""
    robot = rd.robots.get("fanuc_m710ic50_milling")
    path = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0, np.pi / 2, offset=np.pi, center=(1.3, 1, 0))
    objective = rd.ConditionNumber(0.4855933)
    best = rd.plan(robot, path, objective=objective, criterion="integral", progress=False)
    chart = rd.redundancy_map(robot, path, objective=objective, progress=False)
    plots.save(chart.plot(trajectory=best, name=r"condition number $\kappa_F$"), folder / "helix_map.png")


def speeds(folder: Path) -> None:
    """Draw joint speeds as a share of their limits, point by point and planned, from the same first posture."""
    robot = rd.robots.get("abb_irb120").with_tool(tool(45.0, 0.02, 0.06))
    path = rolling((0.35, -0.2, 0.1), (0.35, 0.2, 0.1), 60.0, 81, 0.65)
    objective = rd.ConditionNumber(0.2)
    planned = rd.plan(robot, path, objective=objective, criterion="integral", progress=False)
    solver = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), objective)
    followed = rd.follow(solver, path, planned.q[0], progress=False)
    assert path.time is not None
    middle = 0.5 * (path.time[1:] + path.time[:-1])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(7.5, 3.2), layout="constrained")
        panels = figure.subplots(1, 2, sharey=True)
        for panel, trajectory, name in zip(panels, (followed, planned), ("point by point", "planned"), strict=True):
            _draw_speeds(panel, trajectory, middle)
            panel.set_title(f"{name}: mean $\\kappa_F$ {trajectory.mean_condition_number:.4f}", fontsize="medium")
        panels[0].set_ylabel("joint speed over its limit")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=len(handles), handlelength=1.2)
    plots.save(figure, folder / "plan_speeds.png")


def _draw_speeds(panel: Axes, trajectory: rd.Trajectory, at: F64) -> None:
    assert trajectory.joint_speed is not None
    share = np.abs(trajectory.joint_speed[:-1]) / trajectory.robot.qd_max
    for joint, color in zip(range(trajectory.robot.n), COLORS, strict=False):
        panel.plot(at, share[:, joint], color=color, label=f"joint {joint + 1}")
    fastest = share.max(axis=1)
    panel.fill_between(at, 1.0, np.maximum(fastest, 1.0), color=ORANGE, alpha=0.2, linewidth=0.0)
    panel.axhline(1.0, color=BLACK, linewidth=0.8, linestyle="--", label="limit")
    panel.set(xlabel="time [s]", xlim=(at[0], at[-1]), ylim=(0.0, None))


def two_freedoms(folder: Path) -> None:
    """Draw the condition number of a seven-axis arm, point by point and planned."""
    robot = rd.robots.get("kuka_iiwa14").with_tool(tool(45.0, 0.05, 0.15))
    path = rolling((0.65, -0.3, 0.2), (0.65, 0.4, 0.2), 50.0, 61, None)
    objective = rd.ConditionNumber(0.3)
    planned = rd.plan(robot, path, objective=objective, progress=False)
    followed = rd.follow(rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), objective), path, progress=False)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.0, 3.2), layout="constrained")
        axes = figure.subplots()
        axes.plot(followed.condition_number, color=ORANGE, linestyle="--", label="point by point")
        axes.plot(planned.condition_number, color=BLUE, label="planned (minimax)")
        axes.axhline(planned.bound, color=BLACK, linewidth=0.8, linestyle=":", label="lower bound of the worst")
        axes.set(xlabel="point of the path", ylabel=r"condition number $\kappa_F$", xlim=(0, len(path) - 1))
        axes.legend(loc="upper left")
    plots.save(figure, folder / "plan_two_freedoms.png")


def main(arguments: list[str]) -> int:
    """Draw every picture."""
    folder = pages.folder_of(arguments)
    for draw in (helix_map, speeds, two_freedoms):
        draw(folder)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
