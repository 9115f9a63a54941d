"""The motions behind the tables and pictures, each computed once."""

from functools import cache

import numpy as np
import redundancy as rd
from redundancy.planning import tilt_and_spin, tilted

from evidence.from_gravdahl.cases import F64, TILT, Cone, Scenario, along, dynamics, recorded, scenarios, speeds

CONE = Cone(TILT)

PLANNED = {"torques of joints 1 and 2": "tau12", "all torques and rates": "all"}
"""What plans are for, and the name of it among the speeds."""

ITERATIONS = 12
"""Linear programmes a plan: what more of them gain is below a tenth."""


@cache
def by_rule(name: str, rule: str) -> tuple[rd.Trajectory, dict[str, float]]:
    """Return the motion of a scenario by a rule, and its largest speeds [m/s] by criterion."""
    scenario = scenarios()[name]
    motion = scenario.motion(rule)
    return motion, speeds(scenario.robot, motion)


@cache
def planned(name: str, criterion: str, spacing: float = 5e-4, iterations: int = ITERATIONS) -> rd.Fastest:
    """Return the fastest motion of a scenario within the cone of 10 deg by a criterion of `PLANNED`."""
    scenario = scenarios()[name]
    limit = np.array(recorded("puma560_dynamics")["torque_limit"])
    free = np.full(6, np.inf)
    limit = np.where(np.arange(6) < 2, limit, np.inf) if criterion == "torques of joints 1 and 2" else limit
    return rd.fastest(
        scenario.robot,
        scenario.path(spacing),
        CONE,
        torque=dynamics(),
        torque_limit=limit,
        rate=scenario.robot.qd_max if "rates" in criterion else free,
        start=scenario.motion(scenario.best_rule, spacing),
        max_iterations=iterations,
    )


def within_cone(scenario: Scenario) -> list[str]:
    """Return the rules that keep to the cone of 10 deg."""
    return [rule for rule in scenario.rules() if "square" not in rule]


@cache
def finer(name: str, criterion: str, spacing: float = 1.25e-4) -> dict[str, float]:
    """Return the speeds of a plan at points that are closer, its tilt and spin joined by cubic splines."""
    from scipy.interpolate import CubicSpline

    scenario, motion = scenarios()[name], planned(name, criterion).trajectory
    assert motion.path.rotation is not None
    path, frame = scenario.path(spacing), frames_of(name)[0]
    share, fine = np.linspace(0.0, 1.0, len(motion)), np.linspace(0.0, 1.0, len(path))
    # Splines without knots next to the ends: natural ones would have no acceleration there.
    angles = CubicSpline(share, tilt_and_spin(frame.T @ motion.path.rotation))(fine)
    return speeds(scenario.robot, along(scenario.robot, path.oriented(frame @ tilted(angles)), motion.q[0]))


def frames_of(name: str) -> F64:
    """Return the orientations of a scenario's path, shape (N, 3, 3)."""
    frames = scenarios()[name].path().rotation
    assert frames is not None
    return frames
