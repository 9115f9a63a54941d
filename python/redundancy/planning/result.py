"""What a plan is, and why it may not be whole."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from .._core import Objective, PlanFailure
from .._util import F64
from ..paths import Trajectory
from .numbers import core_path
from .transfer import Transfer


class Way(NamedTuple):
    """A way through the whole path that was compared: one on other branches, or on the other side of closed postures.

    Attributes
    ----------
    value : float
        What was minimised, at the points of the search: the worst value, or the integral with its share of the motion.
    motion : float
        Integral of the squared joint speed over the path's share [rad^2 or m^2].
    largest_step : float
        Largest motion of a turning joint from point to point [rad], evenly between the points of the search.
    refined : bool
        Whether it is an optimum; else as far as a few Newton steps went.
    """

    value: float
    motion: float
    largest_step: float
    refined: bool


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Trajectory):
    """A trajectory that is best as a whole.

    Attributes
    ----------
    objective : Objective or None
        What was minimised; None where it was the motion alone, or the speed that counts. For "speed" the ``value`` of a
        point is the time that the tool takes for a metre [s/m] by the joint that is slowest on the steps to and from it.
    criterion : str
        "minimax", "integral", "motion" or "speed".
    smoothness : float
        Weight of the integral of the squared joint speed over the path's share.
    cost : float
        What was minimised: worst value, or integral of the value, each plus smoothness times motion; NaN if the plan is
        not whole. The cost of the steps is added: to the integral as it is, to the worst value as a part of the motion.
    motion : float
        Integral of the squared joint speed over the path's share [rad^2 or m^2], each joint's square times its weight.
    edge_cost : float
        What the user's ``edge_cost`` says of all steps from point to point together; 0 without one.
    bound : float
        No path can do better than this (minimax: the least value at the worst point, and the least bottleneck over
        connected ways; integral: the integral of the least values), to the resolution of the search; NaN where it was
        not asked for.
    residual : float
        First-order residual: the largest slope of the Lagrangian along a free motion; NaN where an ``edge_cost``, which
        has no derivatives, changed the path.
    failure : PlanFailure or None
        Why the plan is not whole; the points that are reached are the best that there are.
    refined : bool
        Whether the continuous optimum was reached; else the best route of the grid is what is returned.
    ways : tuple of Way
        The ways through the whole path that were compared, the best of each branch and of each side of closed or much
        worse postures, the best first: the plan is best of these, and for "motion" and "integral" nothing more is
        proven. Empty where the search found one way alone, or a grid of joints to spare is too large to part them.
    notes : tuple of str
        What else is worth saying, in words: that the way passes through a singularity, and where; that the value does
        not depend on the spin of the tool.
    segments : list of tuple of int
        First and last point of every stretch that is followed without lifting off; one, of all points, where the plan
        is whole. With ``reconfigurations`` the point at which one ends begins the next: ``q`` holds the posture in
        which it ends, the last posture of the transfer the one in which the next begins, and `segment` has both.
    transfers : list of Transfer
        How the robot gets from one segment to the next; of a closed path that was cut also from the end to the start.
        They take time that the path's own times, if it has any, do not count: each segment keeps to the speed limits,
        and the times of what comes later shift by the transfer's.
    tilt, heading, twist : ndarray, shape (N,), or None
        Where the task is a volume of orientations how far the tool's z axis is tilted from that of the volume, towards
        which heading from its x to its y axis, and the twist about z [rad]; else None. ``axis_error`` is the angle by
        which the tool is outside the volume, 0 within.
    """

    objective: Objective | None = None
    criterion: str = "minimax"
    smoothness: float = 0.0
    cost: float = float("nan")
    motion: float = float("nan")
    edge_cost: float = 0.0
    bound: float = float("nan")
    residual: float = float("nan")
    failure: PlanFailure | None = None
    refined: bool = False
    notes: tuple[str, ...] = ()
    ways: tuple[Way, ...] = ()
    segments: list[tuple[int, int]] = field(default_factory=list)
    transfers: list[Transfer] = field(default_factory=list)
    tilt: F64 | None = None
    heading: F64 | None = None
    twist: F64 | None = None

    def __repr__(self) -> str:
        words = [self.robot.name, f"{len(self)} points", self.criterion]
        if self.objective is not None and not np.isnan(self.value).all():
            words.append(f"worst value {np.nanmax(self.value):.6g}")
        if len(self) > 1:
            words.append(f"largest step {self.largest_step_told}")
        if self.transfers:
            words.append(self.reconfigurations)
        if self.failure is not None:
            words.append(self.failure.told(self.robot))
        words.extend(self.notes)
        return f"Plan({', '.join(words)})"

    @property
    def reconfigurations(self) -> str:
        """The reconfigurations in words: "2 reconfigurations, at points 311 and 540"."""
        points = [str(transfer.points[0]) for transfer in self.transfers]
        if not points:
            return "no reconfigurations"
        listed = " and ".join([*([", ".join(points[:-1])] if len(points) > 1 else []), points[-1]])
        many = "s" if len(points) > 1 else ""
        return f"{len(points)} reconfiguration{many}, at point{many} {listed}"

    def segment(self, number: int) -> F64:
        """Return the postures of a segment, counted from 0, shape (points, n), with that in which it begins."""
        first, last = self.segments[number]
        q: F64 = self.q[first : last + 1].copy()
        if number > 0 and self.transfers:
            q[0] = self.transfers[number - 1].q[-1]
        return q

    @property
    def steps(self) -> F64:
        """Motions of the joints from point to point [rad or m], shape (N - 1, n); 0 where one is not reached.

        As for any trajectory, but behind a transfer from where that ends, and 0 where no segment leads on.
        """
        steps = super().steps
        for (_, last), transfer in zip(self.segments[:-1], self.transfers, strict=False):
            leads_on = transfer.points[1] == last
            steps[last] = self.q[last + 1] - transfer.q[-1] if leads_on else 0.0
        return steps

    @property
    def joint_speed(self) -> F64 | None:
        """Mean joint speeds from each point to the next [rad/s or m/s], shape (N, n); None without times.

        As for any trajectory, but behind a transfer from where that ends, and 0 where no segment leads on.
        """
        speed = super().joint_speed
        if speed is not None and self.time is not None and self.transfers:
            speed[:-1] = self.steps / np.diff(self.time)[:, None]
            speed[-1] = speed[-2]
        return speed

    @property
    def speed(self) -> float:
        """The largest constant speed of the tool at which every joint keeps to its speed limit [m/s].

        By the motion from point to point; steps without length, on which the tool stands, do not count. NaN where a point
        is not reached.
        """
        length = np.linalg.norm(np.diff(self.path.position, axis=0), axis=1)
        if "unreachable" in self.status or not (length > 0.0).any():
            return float("nan")
        share = (np.abs(self.steps) / self.robot.qd_max).max(axis=1)[length > 0.0]
        slowest = float((share / length[length > 0.0]).max())
        return 1.0 / slowest if slowest > 0.0 else float("inf")

    @property
    def gap(self) -> float:
        """How far the plan can be from the best there is: worst (or mean) value less the bound.

        Infinite where the value is and the bound is not; 0 where both are, as no path is better.
        """
        if self.criterion in ("minimax", "speed"):
            value = float(np.nanmax(self.value, initial=-np.inf))
        elif np.isposinf(self.value).any():
            value = np.inf
        else:
            value = float(core_path(self.path).weights @ self.value)
        return 0.0 if value == self.bound == np.inf else value - self.bound
