"""The pictures of docs/reproduction_from.md: Figs. 3, 4 and 5 of the source for the scenario S2."""

from pathlib import Path

import numpy as np
import redundancy as rd
from numpy.typing import NDArray
from redundancy.loops import Motion
from redundancy.planning import tilt_and_spin
from redundancy.plots.style import BLACK, BLUE, GREEN, GREY, ORANGE, STYLE, Axes, Figure, mpl, save

from evidence.from_gravdahl.cases import Scenario, dynamics, scenarios
from evidence.from_gravdahl.runs import by_rule, frames_of, planned

F64 = NDArray[np.float64]

SHOWN = "S2"
TORQUES = "torques of joints 1 and 2"
COLORS = {"constant": BLACK, "spin": BLUE, "tilt and spin": ORANGE, "plan": GREEN}


def motions(scenario: Scenario) -> dict[str, rd.Trajectory]:
    """Return the motions that are compared, each within the cone of 10 deg."""
    rules = {"constant": "constant", "spin": "spin +atan2 (printed)", "tilt and spin": scenario.best_rule}
    found = {name: by_rule(scenario.name, rule)[0] for name, rule in rules.items()}
    return {**found, "plan": planned(scenario.name, TORQUES).trajectory}


def draw(folder: Path) -> None:
    """Draw every picture."""
    folder.mkdir(parents=True, exist_ok=True)
    scenario = scenarios()[SHOWN]
    with mpl.rc_context(STYLE):
        save(_paths(scenario), folder / "from_paths.svg")
        save(_orientations(scenario), folder / "from_orientations.svg")
        save(_torques(scenario), folder / "from_torques.svg")


def _paths(scenario: Scenario) -> Figure:
    """Draw the tool's path and those of the wrist from above (Fig. 3)."""
    figure = Figure(figsize=(7.0, 2.0), layout="constrained")
    panels = figure.subplots(1, 4, sharex=True, sharey=True)
    flange = np.linalg.inv(scenario.robot.tool)
    for panel, (name, motion) in zip(panels, motions(scenario).items(), strict=True):
        wrist = (scenario.robot.fk(motion.q) @ flange)[:, :3, 3]
        panel.plot(
            *motion.path.position[:, :2].T,
            color=GREY,
            linewidth=1.0,
            label="tool point" if panel is panels[0] else None,
        )
        panel.plot(*wrist[:, :2].T, color=COLORS[name], label=f"wrist, {name}")
        panel.plot(0.0, 0.0, "+", color=BLACK, markersize=8.0)
        panel.annotate("joint 1", (0.0, 0.0), (0.0, 8.0), textcoords="offset points", ha="left", fontsize=8.0)
        panel.set(aspect="equal", xlabel="x [m]")
        panel.xaxis.set_major_locator(mpl.ticker.MultipleLocator(0.4))
        panel.yaxis.set_major_locator(mpl.ticker.MultipleLocator(0.2))
    panels[0].set(ylabel="y [m]")
    figure.legend(loc="outside upper center", ncols=5, fontsize=8.0)
    return figure


def _orientations(scenario: Scenario) -> Figure:
    """Draw tilt about the tool's x and y axes, the whole tilt, and the spin along the path (Fig. 4)."""
    figure = Figure(figsize=(7.0, 6.2), layout="constrained")
    panels = figure.subplots(4, 1, sharex=True)
    for name, motion in motions(scenario).items():
        assert motion.path.rotation is not None
        # The path's frames are the same everywhere.
        angles = np.rad2deg(tilt_and_spin(frames_of(scenario.name)[0].T @ motion.path.rotation))
        curves = (angles[:, 0], angles[:, 1], np.hypot(angles[:, 0], angles[:, 1]), angles[:, 2])
        along = np.linspace(0.0, motion.path.length, len(motion))
        for panel, curve in zip(panels, curves, strict=True):
            panel.plot(along, curve, color=COLORS[name], label=name)
    for panel, label in zip(panels, ("tilt about x", "tilt about y", "tilt", "spin"), strict=True):
        panel.set(ylabel=f"{label} [deg]")
    panels[-1].set(xlabel="length of the path [m]")
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)
    figure.align_ylabels()
    return figure


def _torques(scenario: Scenario) -> Figure:
    """Draw the torques of joints 1 and 2 against time, each motion at its own largest speed (Fig. 5)."""
    figure = Figure(figsize=(7.0, 5.2), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    free = np.full(6, np.inf)
    limit = np.where(np.arange(6) < 2, dynamics().limit, np.inf)
    for name, motion in motions(scenario).items():
        found = rd.constant_speed(scenario.robot, motion, dynamics(), torque_limit=limit, rate=free)
        timed = motion.timed(found.speed)
        assert timed.time is not None
        course = Motion.of(scenario.robot, timed)
        torques = dynamics().torque(course.q, found.speed * course.first, found.speed**2 * course.second)
        for panel, torque in zip(panels, torques.T, strict=False):
            panel.plot(timed.time, torque, color=COLORS[name], label=f"{name}, {found.speed:.2f} m/s", linewidth=1.0)
    for joint, panel in enumerate(panels):
        _limits(panel, limit[joint])
        panel.set(ylabel=f"torque of joint {joint + 1} [N m]")
    panels[-1].set(xlabel="time [s]")
    panels[0].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4, fontsize=8.0)
    figure.align_ylabels()
    return figure


def _limits(panel: Axes, limit: float) -> None:
    for sign in (1.0, -1.0):
        panel.axhline(sign * limit, color=GREY, linestyle="--", linewidth=1.0)
