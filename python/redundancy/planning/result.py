"""What a plan is, and why it may not be whole."""

from dataclasses import dataclass

import numpy as np

from .._core import Objective, PlanFailure
from ..paths import Trajectory
from .numbers import core_path


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Trajectory):
    """A trajectory that is best as a whole.

    Attributes
    ----------
    objective : Objective or None
        What was minimised; None where it was the motion alone.
    criterion : str
        "minimax", "integral" or "motion".
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
        No path can do better than this (minimax: the least value at the worst point; integral: the integral of the
        least values), to the resolution of the search; NaN where it was not asked for.
    residual : float
        First-order residual: the largest slope of the Lagrangian along a free motion; NaN where an ``edge_cost``, which
        has no derivatives, changed the path.
    failure : PlanFailure or None
        Why the plan is not whole; the points that are reached are the best that there are.
    refined : bool
        Whether the continuous optimum was reached; else the best route of the grid is what is returned.
    notes : tuple of str
        What else is worth saying, in words: that the way passes through a singularity, and where; that the value does
        not depend on the spin of the tool.
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

    def __repr__(self) -> str:
        words = [self.robot.name, f"{len(self)} points", self.criterion]
        if self.objective is not None and not np.isnan(self.value).all():
            words.append(f"worst value {np.nanmax(self.value):.6g}")
        if len(self) > 1:
            words.append(f"largest step {self.largest_step_told}")
        if self.failure is not None:
            words.append(self.failure.told(self.robot))
        words.extend(self.notes)
        return f"Plan({', '.join(words)})"

    @property
    def gap(self) -> float:
        """How far the plan can be from the best there is: worst (or mean) value less the bound.

        Infinite where the value is and the bound is not; 0 where both are, as no path is better.
        """
        if self.criterion == "minimax":
            value = float(np.nanmax(self.value, initial=-np.inf))
        elif np.isposinf(self.value).any():
            value = np.inf
        else:
            value = float(core_path(self.path).weights @ self.value)
        return 0.0 if value == self.bound == np.inf else value - self.bound
