"""What a trajectory has to fulfil, and where it fails worst (Huo 2009, section 6.2.4)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._core import SingularityParameter
from .._util import F64
from ..errors import InvalidValueError
from ..paths import Trajectory
from .performance import limit_distances

Problem = Literal["joint limits", "singularity", "speed"]


SMALLEST_GAIN = 0.01
"""Share of an excess by which another has to be lower to be much less."""

LARGEST_EXCESS = 1e6
"""What an infinite excess, as at a singularity, counts as: means with infinities in them do not compare."""


@dataclass(frozen=True)
class Failure:
    """How far a trajectory is from what it has to fulfil.

    Attributes
    ----------
    unreachable : int
        Points that were not reached.
    limits, singularity, speed : float
        Excess over each criterion, the worst joint's at each point, averaged over all points; 0 where it is met. Share
        of the joint's range, share of the largest parameter of singularity allowed, share of the largest speed allowed.
        The mean falls where one of several peaks does, the maximum need not.
    instants : dict of str to int
        The criteria that are not met, of "joint limits", "singularity", "speed" in this order, and for each the
        critical instant: the point where the excess is worst, counted from 0.
    """

    unreachable: int
    limits: float
    singularity: float
    speed: float
    instants: dict[Problem, int]

    @property
    def excess(self) -> tuple[float, float, float, float]:
        """What to compare, the most important first: smaller is better."""
        return (float(self.unreachable), self.limits, self.singularity, self.speed)

    def less_than(self, other: "Failure") -> bool:
        """Tell whether this is less of a failure: in the first excess that differs, and much less in one of them."""
        pairs = zip(self.excess, other.excess, strict=True)
        return self.excess < other.excess and any(new < (1.0 - SMALLEST_GAIN) * old for new, old in pairs)


@dataclass(frozen=True)
class Criteria:
    """What a trajectory has to fulfil.

    Parameters
    ----------
    margin : float
        Distance that each joint keeps to its limits, as a share of its range, 0 to 0.5.
    singularity : float
        Largest parameter of singularity w_ps with length 1, above 0, inf for any. The thesis prints none; the value
        given here is what its best example reaches (4.17).
    speed : array_like, shape (n,) or (), optional
        Largest joint speeds [rad/s or m/s], above 0; those of the robot if not given. Paths without times have none.

    Raises
    ------
    InvalidValueError
        If a parameter is outside its domain.
    """

    margin: float = 0.0
    singularity: float = 20.0
    speed: ArrayLike | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.margin < 0.5:
            raise InvalidValueError(f"margin is {self.margin}, expected at least 0 and less than 0.5 of the range")
        if not self.singularity > 0.0:
            raise InvalidValueError(f"singularity is {self.singularity}, expected a number above 0")
        if self.speed is not None and not (np.asarray(self.speed, dtype=np.float64) > 0.0).all():
            raise InvalidValueError(f"speed is {self.speed}, expected numbers above 0")

    def check(self, trajectory: Trajectory) -> Failure:
        """Tell where a trajectory fails worst.

        Raises
        ------
        InvalidValueError
            If ``speed`` holds neither one number nor one for each joint.
        """
        excesses: dict[Problem, F64] = {
            "joint limits": limit_distances(trajectory.robot, trajectory.q).max(axis=1) + self.margin,
            "singularity": self._singularity(trajectory),
            "speed": self._speed(trajectory),
        }
        instants = {name: int(np.argmax(excess)) for name, excess in excesses.items() if excess.max() > 0.0}
        limits, singularity, speed = (_mean_excess(excess) for excess in excesses.values())
        return Failure(len(trajectory.unreachable), limits, singularity, speed, instants)

    def _singularity(self, trajectory: Trajectory) -> F64:
        if self.singularity == np.inf:
            return np.zeros(len(trajectory))
        index = SingularityParameter(1.0, rows=trajectory.robot.rows_in_use())
        excess: F64 = index.evaluate_many(trajectory.robot, trajectory.q, 0)[0] / self.singularity - 1.0
        return excess

    def _speed(self, trajectory: Trajectory) -> F64:
        speed, n = trajectory.joint_speed, trajectory.robot.n
        if speed is None:
            return np.zeros(len(trajectory))
        allowed = trajectory.robot.qd_max if self.speed is None else np.asarray(self.speed, dtype=np.float64)
        if allowed.shape not in ((), (n,)):
            raise InvalidValueError(f"speed has shape {allowed.shape}, expected () or ({n},)")
        excess: F64 = (np.abs(speed) / allowed - 1.0).max(axis=1)
        return excess


def _mean_excess(excess: F64) -> float:
    return float(np.clip(excess, 0.0, LARGEST_EXCESS).mean())
