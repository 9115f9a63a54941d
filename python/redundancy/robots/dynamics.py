"""What torques a motion takes: the interface that speeds need, and pinocchio behind it."""

from collections.abc import Callable
from typing import Any, Protocol, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from .._util import F64, checked
from ..errors import InvalidValueError, ShapeError

TorqueFunction: TypeAlias = Callable[[F64, F64, F64], ArrayLike]
"""Gets postures, their rates and accelerations, shape (N, n) each, and returns torques [N m or N], shape (N, n)."""


Derivatives: TypeAlias = Callable[[F64, F64, F64], tuple[F64, F64, F64]]
"""Returns the derivatives of torques in postures, rates and accelerations, shape (N, n, n), rows being torques."""


@runtime_checkable
class Dynamics(Protocol):
    """A robot's dynamics with the torques that its joints can take; `PinocchioDynamics` is one.

    A method ``derivatives``, which only some have, saves `fastest` the differences.
    """

    @property
    def limit(self) -> F64:
        """Largest torques [N m or N], shape (n,); infinite where a joint has no limit."""

    def torque(self, q: F64, qd: F64, qdd: F64) -> ArrayLike:
        """Return torques [N m or N], shape (N, n), for postures, rates and accelerations, shape (N, n) each."""


class PinocchioDynamics:
    """Torques by pinocchio's recursive Newton-Euler algorithm.

    Parameters
    ----------
    model : pinocchio.Model
        Its joints are those of the robot, in its order, one coordinate each (no continuous joints with a cosine and a
        sine); inertias of motors are its ``armature``, gravity its ``gravity``. It is copied.
    limit : array_like, shape (n,), optional
        Largest torques [N m or N], above 0; infinite for a joint that does not count. ``model.effortLimit`` if not
        given.

    Raises
    ------
    ImportError
        If pinocchio is not installed (``pip install redundancy[timing]``).
    ShapeError
        If the limits have the wrong shape.
    InvalidValueError
        If a limit is not above 0, or a joint has more than one coordinate.
    """

    def __init__(self, model: Any, limit: ArrayLike | None = None) -> None:  # noqa: ANN401  (pinocchio has no types)
        import pinocchio

        if model.nq != model.nv:
            raise InvalidValueError(f"model has {model.nq} coordinates for {model.nv} rates, expected as many")
        self._rnea = pinocchio.rnea
        self._rnea_derivatives = pinocchio.computeRNEADerivatives
        self._model = model.copy()
        self._data = self._model.createData()
        self.limit = checked_limit("limit", model.effortLimit if limit is None else limit, model.nv)

    def torque(self, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> F64:
        """Return the torques of a motion.

        Parameters
        ----------
        q, qd, qdd : array_like, shape (n,) or (N, n)
            Postures [rad or m], rates and accelerations.

        Returns
        -------
        ndarray, shape (n,) or (N, n)
            Torques [N m; N of a prismatic joint]; without friction.

        Raises
        ------
        ShapeError, NonFiniteError
            If an array has the wrong shape or holds NaN or infinities.
        """
        shape = (self._model.nq,) if np.ndim(q) == 1 else (len(np.atleast_2d(np.asarray(q))), self._model.nq)
        motion = [checked(name, value, shape) for name, value in (("q", q), ("qd", qd), ("qdd", qdd))]
        rows = zip(*(np.atleast_2d(part) for part in motion), strict=True)
        torques = [np.array(self._rnea(self._model, self._data, *row)) for row in rows]
        return torques[0] if np.ndim(q) == 1 else np.array(torques).reshape(shape)

    def derivatives(self, q: F64, qd: F64, qdd: F64) -> tuple[F64, F64, F64]:
        """Return the derivatives of the torques in postures, rates and accelerations.

        Parameters
        ----------
        q, qd, qdd : ndarray, shape (N, n)
            As for `torque`.

        Returns
        -------
        tuple of ndarray, shape (N, n, n)
            Rows are torques; the last one is the inertia matrix.
        """
        result = np.empty((3, *q.shape, q.shape[1]))
        for k, motion in enumerate(zip(q, qd, qdd, strict=True)):
            result[:, k] = self._rnea_derivatives(self._model, self._data, *motion)
        return result[0], result[1], result[2]


def checked_limit(name: str, value: ArrayLike, n: int) -> F64:
    """Copy an array-like into limits above 0, shape (n,), which may be infinite.

    Raises
    ------
    ShapeError, InvalidValueError
        If the shape is another, or a limit is not a number above 0.
    """
    try:
        limit = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} is no array of real numbers") from None
    if limit.shape != (n,):
        raise ShapeError(f"{name}: got shape {limit.shape}, expected ({n},)")
    if not (limit > 0.0).all():
        joint = int(np.argmin(limit > 0.0))
        raise InvalidValueError(f"{name}[{joint}] is {limit[joint]}, expected a number above 0")
    limit.setflags(write=False)
    return limit


def torques_of(torque: Dynamics | TorqueFunction, limit: ArrayLike | None, n: int) -> tuple[TorqueFunction, F64]:
    """Return a function of torques and the limits that go with it.

    Parameters
    ----------
    torque : Dynamics or callable
        What knows the torques.
    limit : array_like, shape (n,), optional
        Largest torques; those of the dynamics if not given.
    n : int
        Number of joints.

    Raises
    ------
    ShapeError, InvalidValueError
        If these are no dynamics and no function, or the limits are missing or wrong.
    """
    if limit is None:
        if not isinstance(torque, Dynamics):
            raise InvalidValueError("torque has no limits of its own, expected torque_limit")
        limit = torque.limit
    function = torque.torque if isinstance(torque, Dynamics) else torque
    if not callable(function):
        raise InvalidValueError(f"torque is {torque!r}, expected dynamics or a function")
    return function, checked_limit("torque_limit", limit, n)
