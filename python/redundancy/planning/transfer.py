"""From the end of a segment of a path to the start of the next."""

from dataclasses import dataclass, field

import numpy as np

from .._core import Robot
from .._util import F64


@dataclass(frozen=True, eq=False)
class Transfer:
    """A motion off the work, to another posture, and down again.

    The tool is drawn back along its axis with its orientation kept, the joints go straight to the posture above the
    next start, and the tool comes down as it went up. Position limits hold all the way. Nothing is known of what stands
    around the robot but what ``feasible`` tells.

    Attributes
    ----------
    robot : Robot
        Whose motion it is.
    points : tuple of int
        Points of the path at which the tool is lifted off and set down again, counted from 0.
    q : ndarray, shape (m, n)
        Postures [rad or m]; the first ends a segment, the last begins the next. No joint moves by more than
        ``max_step`` (0.25 if not given) from one to the next.
    lift : tuple of float
        How far the tool is drawn back at either end [m]: less than ``lift_off`` where a limit or the reach of the robot
        ends it.
    allowed : bool
        Whether ``feasible``, if it was given, allows all of them.
    """

    robot: Robot
    points: tuple[int, int]
    q: F64 = field(repr=False)
    lift: tuple[float, float]
    allowed: bool = True

    def __len__(self) -> int:
        """Return the number of postures."""
        return len(self.q)

    @property
    def time(self) -> F64:
        """Times from 0 at which the postures are passed when some joint always has its speed limit [s], shape (m,).

        Without accelerations, so the least there is; zeros for joints without speed limits.
        """
        needed = np.abs(np.diff(self.q, axis=0)) / self.robot.qd_max
        time: F64 = np.concatenate([[0.0], np.cumsum(needed.max(axis=1))])
        return time

    @property
    def duration(self) -> float:
        """The last of the times [s]."""
        return float(self.time[-1])
