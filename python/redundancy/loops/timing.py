"""How fast a tool can go along a path: the largest constant speed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._core import Robot
from .._util import F64, checked
from ..errors import InvalidValueError
from ..paths import Trajectory, differences, length_along
from ..robots import Dynamics, TorqueFunction, checked_limit, torques_of

_QUADRATIC = 1e-9
"""Share of the largest torque by which torques may miss a parabola in the speed: rounding of any model's sums."""


@dataclass(frozen=True, eq=False)
class SpeedLimit:
    """What one criterion allows along a path.

    Attributes
    ----------
    speed : float
        Largest constant speed of the tool point [m/s]; inf where nothing limits it, 0 where it cannot even rest.
    joint, point : int or None
        The joint that limits it, and where, counted from 0; None where nothing does.
    joint_speed : ndarray, shape (n,)
        What each joint allows alone [m/s].
    joint_point : ndarray of int, shape (n,)
        The points where they do.
    """

    speed: float
    joint: int | None
    point: int | None
    joint_speed: F64
    joint_point: np.ndarray


@dataclass(frozen=True, eq=False)
class ConstantSpeed:
    """The largest constant speed of a tool along a path.

    Attributes
    ----------
    speed : float
        The smallest of all criteria [m/s].
    joint, point : int or None
        The joint that limits it, and where, counted from 0; None where nothing does.
    criterion : str or None
        The criterion that limits it.
    criteria : dict of str to SpeedLimit
        Each by itself: "rate", and where they were asked for "acceleration" and "torque".
    """

    speed: float
    joint: int | None
    point: int | None
    criterion: str | None
    criteria: dict[str, SpeedLimit]

    def __repr__(self) -> str:
        told = ", ".join(f"{name} {limit.speed:.6g}" for name, limit in self.criteria.items())
        return f"ConstantSpeed({self.speed:.6g} m/s; {told})"


def constant_speed(
    robot: Robot,
    trajectory: Trajectory,
    torque: Dynamics | TorqueFunction | None = None,
    *,
    torque_limit: ArrayLike | None = None,
    rate: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
) -> ConstantSpeed:
    """Return the largest constant speed of a tool along a path: by joint rates, accelerations and torques.

    At a constant speed v a joint moves at q' v and q'' v^2, primes being derivatives in the length of the path, and its
    torque is alpha v^2 + g with alpha = tau(q, q', q'') - g and the torque g of rest. So the largest speeds are
    min qd_max / |q'|, min sqrt(qdd_max / |q''|) and min sqrt((tau_max -+ g) / |alpha|) over joints and points, exactly.
    Derivatives are those of the parabola through three neighbouring points: of second order at equal distances.

    Parameters
    ----------
    robot : Robot
        The robot.
    trajectory : Trajectory
        Postures at N points; times do not matter.
    torque : Dynamics or callable, optional
        The robot's dynamics, such as `PinocchioDynamics`; or a function of postures, rates and accelerations, shape
        (N, n) each, that returns torques [N m or N], (N, n). Without friction: torques quadratic in the speed.
    torque_limit : array_like, shape (n,), optional
        Largest torques, infinite for joints that do not count; those of ``torque`` if not given.
    rate : array_like, shape (n,), optional
        Largest joint rates [rad/s or m/s]; ``robot.qd_max`` if not given.
    acceleration : array_like, shape (n,), optional
        Largest joint accelerations [rad/s^2 or m/s^2]; none if not given.

    Returns
    -------
    ConstantSpeed
        Speed, what limits it and where, and the same for each criterion and each joint.

    Raises
    ------
    ShapeError, NonFiniteError
        If an array has the wrong shape, or torques are not finite.
    InvalidValueError
        If the trajectory is another robot's, has unreached points or a single one, the tool point rests on the way, a
        limit is not above 0, torques have no limit, or they are not quadratic in the speed.

    Examples
    --------
    >>> import redundancy as rd
    >>> robot = rd.robots.get("ur5e")
    >>> frame = [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]]
    >>> path = rd.Toolpath.raster((0.2, 0.3), 3, 0.05, 0.005, frame=frame)
    >>> plan = rd.plan(robot, path, rd.Task.full(), criterion="motion")
    >>> found = rd.constant_speed(robot, plan)
    >>> found.criterion, round(found.speed, 2)
    ('rate', 1.02)
    """
    motion = Motion.of(robot, trajectory)
    criteria = {"rate": _smallest(motion.by_rate(robot.qd_max if rate is None else rate))}
    if acceleration is not None:
        criteria["acceleration"] = _smallest(motion.by_acceleration(acceleration))
    if torque is not None:
        criteria["torque"] = _smallest(motion.by_torque(*torques_of(torque, torque_limit, robot.n)))
    elif torque_limit is not None:
        raise InvalidValueError("torque_limit is given without torque, expected both")
    name, slowest = min(criteria.items(), key=lambda item: item[1].speed)
    limited = slowest.joint is not None
    return ConstantSpeed(slowest.speed, slowest.joint, slowest.point, name if limited else None, criteria)


@dataclass(frozen=True)
class Motion:
    """Postures along a path and their derivatives in its length, shape (N, n) each."""

    q: F64
    first: F64
    second: F64

    @classmethod
    def of(cls, robot: Robot, trajectory: Trajectory) -> "Motion":
        """Return the motion of a trajectory, or raise an InvalidValueError."""
        if not isinstance(trajectory, Trajectory):
            raise InvalidValueError(f"trajectory is a {type(trajectory).__name__}, expected a Trajectory or a Plan")
        if trajectory.q.shape[1] != robot.n:
            raise InvalidValueError(f"trajectory has {trajectory.q.shape[1]} joints, expected {robot.n}")
        if trajectory.unreachable:
            raise InvalidValueError(f"trajectory does not reach point {trajectory.unreachable[0]}, expected all points")
        if len(trajectory) < 2:
            raise InvalidValueError("trajectory has a single point, expected at least 2")
        return cls(trajectory.q, *differences(length_along(trajectory.path.position)).of(trajectory.q))

    def by_rate(self, limit: ArrayLike) -> F64:
        """Return the largest speeds by joint rates [m/s], shape (N, n)."""
        rate = checked_limit("rate", limit, self.q.shape[1])
        return _ratio(rate, np.abs(self.first))

    def by_acceleration(self, limit: ArrayLike) -> F64:
        """Return the largest speeds by joint accelerations [m/s], shape (N, n)."""
        acceleration = checked_limit("acceleration", limit, self.q.shape[1])
        return np.sqrt(_ratio(acceleration, np.abs(self.second)))

    def by_torque(self, torque: TorqueFunction, limit: F64) -> F64:
        """Return the largest speeds by joint torques [m/s], shape (N, n)."""
        alpha, rest = self.torques(torque)
        spare = np.maximum(limit - np.sign(alpha) * rest, 0.0)
        # A torque of rest beyond its limit leaves no speed at all, whichever way motion changes it.
        return np.where(np.abs(rest) > limit, 0.0, np.sqrt(_ratio(spare, np.abs(alpha))))

    def torques(self, torque: TorqueFunction) -> tuple[F64, F64]:
        """Return the torques of motion at unit speed, and of rest [N m or N], shape (N, n) each."""
        rest = _answer(torque, self.q, np.zeros_like(self.q), np.zeros_like(self.q))
        alpha = _answer(torque, self.q, self.first, self.second) - rest
        double = _answer(torque, self.q, 2.0 * self.first, 4.0 * self.second) - rest
        if np.abs(double - 4.0 * alpha).max() > _QUADRATIC * max(np.abs(double).max(), np.abs(rest).max()):
            raise InvalidValueError("torque is not quadratic in the speed, expected one without friction")
        return alpha, rest


def _answer(torque: TorqueFunction, q: F64, qd: F64, qdd: F64) -> F64:
    return checked("torque", torque(q, qd, qdd), q.shape)


def _ratio(limit: F64, demand: F64) -> F64:
    """Return limits over demands; infinite where nothing is demanded."""
    ratio = np.full(np.broadcast_shapes(limit.shape, demand.shape), np.inf)
    np.divide(limit, demand, out=ratio, where=demand > 0.0)
    return ratio


def _smallest(speeds: F64) -> SpeedLimit:
    point = speeds.argmin(axis=0)
    by_joint = speeds[point, np.arange(speeds.shape[1])]
    joint = int(by_joint.argmin())
    speed = float(by_joint[joint])
    if np.isinf(speed):
        return SpeedLimit(speed, None, None, by_joint, point)
    return SpeedLimit(speed, joint, int(point[joint]), by_joint, point)
