"""The fastest motion within a tolerance: spin and tilt along a path for the largest constant speed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from .._core import ConditionNumber, Robot, Task
from .._util import F64, axis_angle, checked
from ..errors import InvalidValueError
from ..loops import ConstantSpeed, constant_speed
from ..paths import Toolpath, Trajectory, differences, length_along
from ..robots import Dynamics, TorqueFunction, checked_limit, torques_of
from .numbers import core_path
from .programme import Linear, MotionLimits, least_demand
from .result import Plan
from .tolerance import STEP, Postures, splines

MEMBER = 1e-10
"""How far outside a volume an orientation counts as a member [rad]: a tenth of what plans promise."""

GAIN = 1e-4
"""Share of 1/v^2 below which a step is no gain."""

FIRST_RADIUS, SMALLEST_RADIUS = 0.05, 1e-5
"""Trust region [rad] at which the search begins, and at which it stops: what is left to gain is of its square."""


SHARE = 1e-9
"""How closely the share of a tilt is found that a volume allows."""

KNOTS = 0.03
"""Distance of the knots of tilt and spin along the path [m], about that of corners that a tool goes round."""


class Volume(Protocol):
    """A set of orientations, as far as it is asked here; `OrientationVolume` is one."""

    def signed_distance(self, orientation: F64, /) -> Any:  # noqa: ANN401
        """Return how far orientations, shape (N, 3, 3), are outside [rad], shape (N,); negative inside."""


@dataclass(frozen=True, eq=False)
class Fastest:
    """A motion of largest constant speed.

    Attributes
    ----------
    trajectory : Trajectory
        Postures along the path; the rotations of its ``path`` are those of the tool, members of the volume. Its
        ``value`` is the time that each point wants for a metre [s/m].
    speed : ConstantSpeed
        Its largest constant speed, and by each criterion.
    start_speeds : tuple of float
        Those of the starts [m/s]; 0 for one that leaves the volume or the limits.
    iterations : int
        Linear programmes solved altogether.
    """

    trajectory: Trajectory
    speed: ConstantSpeed
    start_speeds: tuple[float, ...]
    iterations: int

    def __repr__(self) -> str:
        return (
            f"Fastest({self.speed.speed:.6g} m/s from {max(self.start_speeds):.6g} m/s, {self.iterations} iterations)"
        )


@dataclass(frozen=True, eq=False)
class _State:
    """Control values, tilt and spin, postures, and the 1/v^2 that they demand."""

    control: F64
    angles: F64
    q: F64
    w: float


def fastest(
    robot: Robot,
    path: Toolpath,
    volume: Volume,
    start: Trajectory | Sequence[Trajectory],
    *,
    torque: Dynamics | TorqueFunction | None = None,
    torque_limit: ArrayLike | None = None,
    rate: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    limits: bool = True,
    knots: float = KNOTS,
    max_iterations: int = 100,
) -> Fastest:
    """Find tilt and spin along a path for the largest constant speed of the tool, by rates, accelerations and torques.

    Tilt and spin relative to the path's frames are cubic splines in its length. With w = 1/v^2 the criteria of
    `constant_speed` are |q'| <= qd_max sqrt(w), |q''| <= qdd_max w and |alpha + w g| <= w tau_max at every point: each
    step minimises w over a linear model of these, of the membership and of the position limits within a trust region
    (sequential linear programming), and is taken if w falls. The result is a local optimum, and never slower than a
    start whose orientations are members.

    Parameters
    ----------
    robot : Robot
        Of six joints.
    path : Toolpath
        The path, at the distances at which the speed is to hold; without rotations the frames of spin 0 of plans, for
        volumes of free spin alone.
    volume : OrientationVolume
        Allowed orientations of the tool relative to the path's frame: those that stay members on the way to no tilt (or
        to no tilt and no spin), as cones, pyramids and squares do. Nothing is gained in one without an interior, such
        as a line.
    start : Trajectory or sequence of Trajectory
        Where to start, such as plans and motions by rules: postures along the same points. The best result is kept.
    torque, torque_limit, rate, acceleration
        Criteria, as in `constant_speed`; for torques alone give infinite rates.
    limits : bool
        Whether position limits hold.
    knots : float
        Largest distance of the knots along the path [m].
    max_iterations : int
        Linear programmes a start at most.

    Returns
    -------
    Fastest
        The trajectory and its speed.

    Raises
    ------
    ImportError
        If scipy is not installed (``pip install redundancy[timing]``).
    ShapeError, NonFiniteError, InvalidValueError
        As for `constant_speed`; if the robot has not six joints, no limit is finite, or no start can be brought into
        the volume within limits.
    """
    if robot.n != 6:
        raise InvalidValueError(f"robot has {robot.n} joints, expected 6")
    for name, number in {"knots": knots, "max_iterations": max_iterations}.items():
        if not checked(name, number, ()) > 0.0:
            raise InvalidValueError(f"{name} is {number}, expected a number above 0")
    bounds = _limits(robot, torque, torque_limit, rate, acceleration, limits)
    if path.rotation is None:
        path = path.oriented(core_path(path).frames(Task.axisymmetric()))
    starts = [start] if isinstance(start, Trajectory) else list(start)
    if not starts:
        raise InvalidValueError("start has no trajectory, expected at least one")
    search = _Search(robot, path, volume, bounds, knots)
    given = [search.given(_postures(start, path, robot)) for start in starts]
    found, solved = list(given), 0
    for first in given:
        fitted = search.fitted(first.q)
        if fitted is not None:
            better, programmes = search.improved(fitted, max_iterations)
            found.append(better)
            solved += programmes
    best = min(found, key=lambda state: state.w)
    if np.isinf(best.w):
        raise InvalidValueError("start: none can be brought into the volume and moved within limits")
    with np.errstate(divide="ignore"):
        value = 1.0 / bounds.speeds(search.postures.motion(best.q))
    trajectory = _trajectory(robot, path.oriented(search.postures.rotation(best.angles)), best.q, value)
    speed = constant_speed(
        robot, trajectory, torque, torque_limit=torque_limit, rate=bounds.rate, acceleration=acceleration
    )
    return Fastest(trajectory, speed, tuple(float(state.w**-0.5) for state in given), solved)


def faster(
    plan: Plan,
    task: Task,
    *,
    torque: Dynamics | TorqueFunction | None,
    torque_limit: ArrayLike | None,
    acceleration: ArrayLike | None,
    limits: bool,
) -> Plan:
    """Return a plan by joint rates brought to the largest constant speed by torques and accelerations too.

    Parameters
    ----------
    plan : Plan
        Where to start; returned as it is where it failed.
    task : Task
        Its task, `Task.within` a volume.
    torque, torque_limit, acceleration, limits
        As for `fastest`.

    Returns
    -------
    Plan
        With the criteria's time for a metre [s/m] as ``value``; what belongs to the search by rates is left out.
    """
    volume = task.volume
    if volume is None:
        raise InvalidValueError("torque and acceleration are for tasks within a volume, expected Task.within")
    if plan.failure is not None:
        return plan
    found = fastest(
        plan.robot,
        plan.path,
        volume,
        torque=torque,
        torque_limit=torque_limit,
        acceleration=acceleration,
        start=plan,
        limits=limits,
    ).trajectory
    kappa = ConditionNumber(plan.length or 1.0).evaluate_many(plan.robot, found.q, 0)[0]
    largest = float(found.value.max())
    return replace(
        plan,
        q=found.q,
        condition_number=kappa,
        value=found.value,
        position_error=found.position_error,
        cost=largest,
        bound=np.nan,
        residual=np.nan,
        motion=np.nan,
        ways=(),
    )


def _limits(
    robot: Robot,
    torque: Dynamics | TorqueFunction | None,
    torque_limit: ArrayLike | None,
    rate: ArrayLike | None,
    acceleration: ArrayLike | None,
    position: bool,
) -> MotionLimits:
    none = np.full(robot.n, np.inf)
    function, most = (None, none) if torque is None else torques_of(torque, torque_limit, robot.n)
    bounds = MotionLimits(
        checked_limit("rate", robot.qd_max if rate is None else rate, robot.n),
        none if acceleration is None else checked_limit("acceleration", acceleration, robot.n),
        most,
        function,
        getattr(torque, "derivatives", None),
        robot.q_min if position else -none,
        robot.q_max if position else none,
    )
    if not np.isfinite([bounds.rate, bounds.acceleration, bounds.torque]).any():
        raise InvalidValueError("rate, acceleration and torque: no limit is finite, expected at least one")
    return bounds


def _postures(start: Trajectory, path: Toolpath, robot: Robot) -> F64:
    """Return the postures of a start, or raise an InvalidValueError where it is none."""
    if start.q.shape != (len(path), robot.n):
        raise InvalidValueError(f"start has postures of shape {start.q.shape}, expected {(len(path), robot.n)}")
    if start.unreachable:
        raise InvalidValueError(f"start does not reach point {start.unreachable[0]}, expected all points")
    return start.q


def _trajectory(robot: Robot, path: Toolpath, q: F64, value: F64) -> Trajectory:
    assert path.rotation is not None
    pose = robot.fk(q)
    angle = axis_angle(pose[:, :3, :3] @ path.rotation.transpose(0, 2, 1))[1]
    return Trajectory(
        robot,
        path,
        q,
        ConditionNumber(1.0).evaluate_many(robot, q, 0)[0],
        value,
        np.linalg.norm(pose[:, :3, 3] - path.position, axis=1),
        angle,
        ["on target"] * len(q),
        1.0,
    )


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

    def given(self, q: F64) -> _State:
        """Return postures as they are, with an infinite demand where they leave the volume or their limits."""
        angles = self.postures.angles(q)
        allowed = not (q < self.limits.low).any() and not (q > self.limits.high).any()
        allowed = allowed and bool((self.outside(angles) <= MEMBER).all())
        return _State(np.empty((0, 3)), angles, q, self.limits.demand(self.postures.motion(q)) if allowed else np.inf)

    def fitted(self, q: F64) -> _State | None:
        """Return the state next to postures, in the least squares of tilt and spin; None where it has no motion."""
        from scipy.sparse.linalg import spsolve

        square = (self.basis.T @ self.basis).tocsc()
        state = self.state(np.asarray(spsolve(square, self.basis.T @ self.postures.angles(q))), q)
        return None if state is None or np.isinf(state.w) else state

    def _drawn(self, control: F64) -> F64 | None:
        """Draw control values towards no tilt, and if need be towards no spin, until all points are members."""
        if self._member(control):
            return control
        for kept in (np.array([0.0, 0.0, 1.0]), np.zeros(3)):
            if not self._member(kept * control):
                continue
            inside, beyond = kept, np.ones(3)
            while (beyond - inside).max() > SHARE:
                middle = 0.5 * (inside + beyond)
                inside, beyond = (middle, beyond) if self._member(middle * control) else (inside, middle)
            drawn: F64 = inside * control
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
            step = least_demand(model, self.limits, radius)
            if step is None or state.w - step[1] < GAIN * state.w:
                radius *= 0.25
                continue
            following = self.state(state.control + step[0], state.q)
            if following is None or following.w >= state.w:
                radius *= 0.4
                continue
            share = (state.w - following.w) / (state.w - step[1])
            radius *= 2.0 if share > 0.7 else 1.0 if share > 0.3 else 0.5
            state = following
            model = self._model(state)
        return state, solved

    def _model(self, state: _State) -> Linear | None:
        """Return the linear model about a state; None where postures have no slopes."""
        slopes = self.postures.slopes(state.angles, state.q)
        if slopes is None:
            return None
        motion = self.postures.motion(state.q)
        ahead, behind = (np.array([self.outside(state.angles + way * e) for e in np.eye(3)]) for way in (STEP, -STEP))
        normal = ((ahead - behind) / (2.0 * STEP)).T
        outside = self.outside(state.angles)
        return Linear(motion, state.w, slopes, self.postures.differences, self.basis, outside, normal)
