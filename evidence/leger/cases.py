"""What Leger (2014) prints: the robot, postures, lengths, the tool axis of its program."""

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Row = tuple[str, str, str, str]
"""Where, what, printed, computed."""

FANUC = rd.robots.get("fanuc_m710ic50_milling")
START = np.deg2rad([0.0, 20.0, -20.0, 0.0, -90.0, 0.0])  # (4.3)
START_LENGTH = 0.2985933  # (4.4)
QUASI_NEWTON = np.deg2rad([0.0, 0.4424, -35.7223, 0.0, -118.5801, 0.0])  # (4.35)
QUASI_NEWTON_LENGTH = 0.4855933
FIRST_POINT = np.deg2rad([29.9052, 23.2777, 0.9907, -56.6009, -83.3305, 102.7566])  # (4.37)
SECOND_START = np.deg2rad([-0.3195, -10.7744, -47.5477, 0.5337, -83.2256, -1.5715])
"""``x0`` of the main program in appendix A: "Starting point traj2"."""


def printed_axis(q: F64) -> F64:
    """Return the axis of (4.33) as appendix A builds it: e_6 turned by -60 deg about -((e_5 x e_6) x e_6)."""
    e5, e6 = FANUC.jacobian(q)[:3, 4:].T
    y = -np.cross(np.cross(e5, e6), e6)
    y /= np.linalg.norm(y)
    angle = np.deg2rad(-60.0)
    axis: F64 = np.cos(angle) * e6 + np.sin(angle) * np.cross(y, e6) + (1 - np.cos(angle)) * (y @ e6) * y
    return axis


def in_degrees(q: F64) -> str:
    """Return a posture as it is printed."""
    return ", ".join(f"{x:.4f}" for x in np.rad2deg(q))


def angle_to(axis: F64, other: F64) -> float:
    """Return the angle between two unit vectors [deg]."""
    return float(np.rad2deg(np.arctan2(np.linalg.norm(np.cross(axis, other)), axis @ other)))


def bound(value: float, digits: int = 0) -> str:
    """Round what is rounding alone, so that the page is the same on every machine."""
    return "below 1e-11" if value < 1e-11 else f"{value:.{digits}e}"
