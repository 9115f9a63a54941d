"""The fastest motion within a tolerance: spin and tilt along a path for the largest constant speed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .._core import ConditionNumber, Robot, Task
from .._util import F64
from ..errors import InvalidValueError
from ..loops import ConstantSpeed, Dynamics, TorqueFunction, checked_limit, constant_speed, torques_of
from ..paths import Toolpath, Trajectory, differences, length_along
from .plan import plan
from .programme import MotionLimits, largest_gain, rows_of
from .tolerance import STEP, Postures, splines

MEMBER = 1e-10
"""How far outside a volume an orientation counts as a member [rad]: a tenth of what plans promise."""

GAIN = 1e-6
"""Share of 1/v^2 below which a step is no gain."""

FIRST_RADIUS, SMALLEST_RADIUS = 0.05, 1e-5
"""Trust region [rad] at which the search begins, and at which it stops: what is left to gain is of its square."""


class Volume(Protocol):
    """A set of orientations, as far as it is asked here; `OrientationVolume` is one."""

    def signed_distance(self, orientation: ArrayLike, /) -> Any:  # noqa: ANN401
        """Return how far orientations, shape (N, 3, 3), are outside [rad], shape (N,); negative inside."""


@dataclass(frozen=True, eq=False)
class Fastest:
    """A motion of largest constant speed.

    Attributes
    ----------
    trajectory : Trajectory
        Postures along the path; the rotations of its ``path`` are those of the tool, members of the volume.
    speed : ConstantSpeed
        Its largest constant speed, and by each criterion.
    start_speeds : tuple of float
        Those of the starts [m/s].
    iterations : int
        Linear programmes solved altogether.
    """

    trajectory: Trajectory
    speed: ConstantSpeed
    start_speeds: tuple[float, ...]
    iterations: int

    def __repr__(self) -> str:
        return f"Fastest({self.speed.speed:.6g} m/s from {max(self.start_speeds):.6g} m/s, {self.iterations} iterations)"


@dataclass(frozen=True, eq=False)
class _State:
    """Control values, tilt and spin, postures, and the 1/v^2 that they demand."""

    control: F64
    angles: F64
    q: F64
    w: float


class _Search:
    """What stays the same from start to start."""

    def __init__(self, robot: Robot, path: Toolpath, volume: Volume, limits: MotionLimits, knots: float) -> None:
        assert path.rotation is not None
        s = length_along(path.position)
        self.volume, self.limits = volume, limits
        self.postures = Postures(robot, path.position, path.rotation, differences(s))
        self.basis = splines(s, knots)

    def outside(self, angles: F64) -> F64:
        """Return how far orientations are outside the volume [rad], shape (N,)."""
        relative = self.postures.frames.transpose(0, 2, 1) @ self.postures.rotation(angles)
        return np.asarray(self.volume.signed_distance(relative), dtype=np.float64)

    def state(self, control: F64, near: F64) -> _State | None:
        """Return the state of control values drawn into the volume; None where that or a posture fails."""
        drawn = self._drawn(control)
        if drawn is None:
            return None
        angles = self.basis @ drawn
        q = self.postures.at(angles, near)
        if q is None or (q < self.limits.low).any() or (q > self.limits.high).any():
            return None
        return _State(drawn, angles, q, self.limits.demand(self.postures.motion(q)))

    def start(self, q: F64) -> _State | None:
        """Return the state next to the postures of a trajectory."""
        from scipy.sparse.linalg import spsolve

        square = (self.basis.T @ self.basis).tocsc()
        return self.state(np.asarray(spsolve(square, self.basis.T @ self.postures.angles(q))), q)

    def _drawn(self, control: F64) -> F64 | None:
        """Draw control values towards no tilt, and if need be towards no spin, until all points are members."""
        for towards in (np.array([0.0, 0.0, 1.0]), np.zeros(3)):
            shares = [0.0, 1.0]
            if self._member(control):
                return control
            if not self._member(towards * control):
                continue
            while shares[1] - shares[0] > 1e-9:
                middle = 0.5 * (shares[0] + shares[1])
                shares[self._member((middle + (1.0 - middle) * towards) * control) ^ True] = middle
            drawn: F64 = (shares[0] + (1.0 - shares[0]) * towards) * control
            return drawn
        return None

    def _member(self, control: F64) -> bool:
        return bool((self.outside(self.basis @ control) <= MEMBER).all())

    def improved(self, state: _State, max_iterations: int) -> tuple[_State, int]:
        """Return a state that no step of the linear programme betters, and the number of programmes solved."""
        radius, solved = FIRST_RADIUS, 0
        model = self._model(state)
        while model is not None and radius > SMALLEST_RADIUS and solved < max_iterations:
            solved += 1
            rows, motion, slopes, membership = model
            step = largest_gain(
                rows, motion, self.limits, slopes, self.postures.differences, self.basis, membership, state.w, radius
            )
            if step is None or state.w - step[1] < GAIN * state.w:
                radius *= 0.25
                continue
            following = self.state(state.control + step[0], state.q)
            if following is None or following.w >= state.w:
                radius *= 0.4
                continue
            share = (state.w - following.w) / (state.w - step[1])
            radius = min(radius * (2.0 if share > 0.7 else 1.0 if share > 0.3 else 0.5), 0.5)
            state = following
            model = self._model(state)
        return state, solved

    def _model(self, state: _State) -> Any:  # noqa: ANN401
        """Return what the linear programme needs at a state; None where postures have no slopes."""
        slopes = self.postures.slopes(state.angles, state.q)
        if slopes is None:
            return None
        motion = self.postures.motion(state.q)
        normal = np.stack(
            [(self.outside(state.angles + e) - self.outside(state.angles - e)) / (2.0 * STEP) for e in STEP * np.eye(3)],
            axis=1,
        )
        return rows_of(motion, self.limits, state.w), motion, slopes, (self.outside(state.angles), normal)
