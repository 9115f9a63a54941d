"""The pictures of docs/reproduction_huo.md."""

from pathlib import Path

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, STYLE, Axes, Figure, mpl, save

from evidence.huo import cases as huo
from evidence.huo.runs import SPHERE, parts, puma_solver, run, tilted, unresolved, welding

F64 = NDArray[np.float64]
COLORS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)


def draw(folder: Path) -> None:
    """Draw every picture."""
    folder.mkdir(parents=True, exist_ok=True)
    with mpl.rc_context(STYLE):
        for name, figure in {
            "huo_puma": _methods(huo.puma_pipe()),
            "huo_sphere": _methods(huo.m16ib_sphere_edge()),
            "huo_cylinders": _welding(),
            "huo_tilted": _tilted(),
            "huo_parts": _parts(),
        }.items():
            save(figure, folder / f"{name}.svg")


def _methods(case: huo.Case) -> Figure:
    """Draw the joints without resolution, with a virtual joint and with the twist decomposition."""
    puma = case.name == "puma_pipe"
    found = {"no resolution": unresolved(case)}
    for name, method in (("virtual joint", rd.VirtualJoint), ("twist decomposition", rd.TwistDecomposition)):
        solver = puma_solver(case, method) if puma else method(case.robot, case.task, SPHERE)
        found[name] = run(solver, case)
    figure = Figure(figsize=(6.0, 6.5), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True, sharey=True)
    for panel, (name, trajectory) in zip(panels, found.items(), strict=True):
        for i, color in enumerate(COLORS):
            _over_time(panel, trajectory, np.rad2deg(trajectory.q[:, i]), color, f"joint {i + 1}")
        panel.set_title(name, loc="left", fontsize=9.0)
        panel.set(ylabel="joint [deg]")
        panel.yaxis.set_major_locator(mpl.ticker.MultipleLocator(180.0))
    panels[-1].set(xlabel="time [s]")
    panels[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _welding() -> Figure:
    """Draw joint 6, joint 4 and the parameter of singularity for the tests of the cylinders."""
    figure = Figure(figsize=(6.5, 6.5), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    index = rd.SingularityParameter(1.0)
    shown = [name for name in welding() if name.startswith("Test")]
    for name, color in zip(shown, COLORS, strict=False):
        trajectory = welding()[name]
        curves = (*np.rad2deg(trajectory.q[:, [5, 3]]).T, index.evaluate_many(trajectory.robot, trajectory.q, 0)[0])
        for panel, curve in zip(panels, curves, strict=True):
            _over_time(panel, trajectory, curve, color, name.replace("`", ""))
    for panel, joint in zip(panels[:2], (6, 4), strict=True):
        panel.set(ylabel=f"joint {joint} [deg]")
        panel.yaxis.set_major_locator(mpl.ticker.MultipleLocator(90.0 if joint == 6 else 45.0))
    panels[2].set(xlabel="time [s]", ylabel=r"$w_{ps}$", yscale="log")
    panels[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.align_ylabels()
    return figure


def _tilted() -> Figure:
    """Draw joints 4 to 6 and the speed of joint 4 for the tests of chapter 6 (Fig. 6.5 to 6.9)."""
    figure = Figure(figsize=(6.5, 8.0), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    found = {name: trajectory for name, trajectory in tilted().found.items() if name in "ABC"}
    for (name, trajectory), color in zip(found.items(), COLORS, strict=False):
        for panel, joint in zip(panels[:3], (3, 4, 5), strict=True):
            _over_time(panel, trajectory, np.rad2deg(trajectory.q[:, joint]), color, f"Test {name}")
        assert trajectory.joint_speed is not None
        _over_time(panels[3], trajectory, np.rad2deg(trajectory.joint_speed[:, 3]), color, name)
    robot = found["A"].robot
    for panel, joint in zip(panels[:3], (3, 4, 5), strict=True):
        for limit in np.rad2deg([robot.q_min[joint], robot.q_max[joint]]):
            panel.axhline(limit, color=GREY, linewidth=1.0, linestyle=":")
        panel.set(ylabel=f"joint {joint + 1} [deg]")
        panel.yaxis.set_major_locator(mpl.ticker.MultipleLocator(60.0 if joint == 4 else 180.0))
    panels[3].set(xlabel="time [s]", ylabel="joint 4 [deg/s]")
    panels[0].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.align_ylabels()
    return figure


def _parts() -> Figure:
    """Draw the three parts of (4.10) along Test C (Fig. 6.10)."""
    figure = Figure(figsize=(6.5, 3.4), layout="constrained")
    axes = figure.subplots()
    for norms, color, name in zip(parts(tilted()).T, COLORS, ("task", "limits", "singularity"), strict=False):
        # What is not there is not drawn: a logarithm has no zero.
        _over_time(axes, tilted().found["C"], np.where(norms > 0.0, norms, np.nan), color, name)
    axes.set(xlabel="time [s]", ylabel="norm in the first iteration [rad]", yscale="log", ylim=(1e-4, 0.3))
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure


def _over_time(axes: Axes, trajectory: rd.Trajectory, values: F64, color: str, label: str) -> None:
    assert trajectory.time is not None
    axes.plot(trajectory.time, values, color=color, label=label)
    axes.set_xlim(0.0, trajectory.time[-1])
