"""What pictures need of the things that they show."""

from typing import Protocol

from .._core import Robot
from .._util import F64


class Placed(Protocol):
    """Points in space."""

    @property
    def position(self) -> F64:
        """Positions [m], shape (N, 3)."""


class Course(Protocol):
    """What a robot of n joints does along N points; `redundancy.Trajectory` is one."""

    def __len__(self) -> int: ...

    @property
    def robot(self) -> Robot:
        """The robot."""

    @property
    def time(self) -> F64 | None:
        """Times [s], shape (N,), if there are any."""

    @property
    def q(self) -> F64:
        """Joint coordinates [rad or m], shape (N, n)."""

    @property
    def condition_number(self) -> F64:
        """kappa_F, shape (N,)."""

    @property
    def length(self) -> float | None:
        """Length that made it homogeneous [m], if known."""

    @property
    def spin(self) -> F64:
        """Angle that the tool has turned about its axis since the first point [rad], shape (N,), unwrapped."""

    @property
    def unreachable(self) -> list[int]:
        """Points that were not reached."""


class Ticks(Protocol):
    """What came of a control loop of N ticks; `redundancy.Tracking` is one."""

    @property
    def time(self) -> F64:
        """Times of the postures [s], shape (N + 1,)."""

    @property
    def q(self) -> F64:
        """Postures [rad or m], shape (N + 1, n)."""

    @property
    def position_error(self) -> F64:
        """Distances to the path [m], shape (N + 1,)."""

    @property
    def axis_error(self) -> F64:
        """Angles to the path [rad], shape (N + 1,)."""

    @property
    def value(self) -> F64:
        """The objective, shape (N + 1,); NaN without."""

    @property
    def distance(self) -> F64:
        """Smallest distances to obstacles [m], shape (N + 1,); infinite without."""

    @property
    def status(self) -> list[str]:
        """How each tick ended."""
