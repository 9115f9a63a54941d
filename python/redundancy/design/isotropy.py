"""How far a posture is from an isotropic one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._core import Robot
from .._util import F64, checked
from ..errors import InvalidValueError


@dataclass(frozen=True, eq=False)
class Isotropy:
    """What the conditions of isotropy, J_n J_n' = alpha L^2 1, miss (Leger 2014, eq. 2.5 to 2.7).

    J_n = [L A; B], with a angular and b linear rows in use. All three residuals vanish where kappa_F = kappa_2 = 1, and
    nowhere else. N postures give every array a leading axis.

    Attributes
    ----------
    alpha : ndarray, shape ()
        The factor, as the mean of the diagonal; n / 3 for n revolute joints that are isotropic in all rows.
    length : ndarray, shape ()
        L [m].
    angular : ndarray, shape (a, a)
        A A' / alpha - 1, eq. 2.5.
    coupling : ndarray, shape (a, b)
        A B' / (alpha L), eq. 2.6.
    linear : ndarray, shape (b, b)
        B B' / (alpha L^2) - 1, eq. 2.7.
    """

    alpha: F64
    length: F64
    angular: F64
    coupling: F64
    linear: F64

    @property
    def residual(self) -> F64:
        """Largest entry of the three, as a magnitude, shape () or (N,)."""
        blocks = (self.angular, self.coupling, self.linear)
        largest: F64 = np.max([np.abs(block).max(axis=(-2, -1), initial=0.0) for block in blocks], axis=0)
        return largest


def isotropy(robot: Robot, q: ArrayLike, length: float | None = None, *, rows: Sequence[int] | None = None) -> Isotropy:
    """Return what a posture misses to be isotropic (Leger 2014, eq. 2.5 to 2.7).

    Parameters
    ----------
    robot : Robot
        The robot.
    q : array_like, shape (n,) or (N, n)
        Posture or postures [rad or m].
    length : float, optional
        Characteristic length L [m]. If not given, the only one with which eq. 2.5 and 2.7 can both hold:
        ``L^2 = (|B|^2 / b) / (|A|^2 / a)``; `rms_length` for revolute joints and all six rows, 1 / sqrt(2) times that
        for a planar robot.
    rows : sequence of int, optional
        Rows of the Jacobian in use; all six if not given (planar robots: [2, 3, 4]).

    Returns
    -------
    Isotropy
        Residuals of the conditions; NaN where no row of one kind moves.

    Raises
    ------
    ShapeError, NonFiniteError
        If ``q`` has the wrong shape or is not finite.
    InvalidValueError
        If the length is not positive, the rows are none of 0 to 5 in increasing order, or, without a length, not of
        both kinds.

    Examples
    --------
    The DIESTRO, whose axes are all 50 mm from the tool point where it is isotropic:

    >>> import numpy as np
    >>> import redundancy as rd
    >>> right = np.pi / 2
    >>> robot = rd.Robot.from_dh([0.05] * 6, [0.05] * 6, [right, -right] * 3, [0.0] * 6)
    >>> found = rd.isotropy(robot, [0.0, right, -right, right, -right, 2 * right])
    >>> round(float(found.length), 6), round(float(found.alpha), 6), bool(found.residual < 1e-14)
    (0.05, 2.0, True)
    """
    used = _used(rows)
    jacobian = robot.jacobian(q)[..., used, :]
    split = sum(row < 3 for row in used)
    angular, linear = jacobian[..., :split, :], jacobian[..., split:, :]
    with np.errstate(divide="ignore", invalid="ignore"):
        if length is None:
            if split in (0, len(used)):
                raise InvalidValueError(f"rows are {used}, expected angular and linear rows, or a length")
            scale = np.sqrt(_mean_square(linear) / _mean_square(angular))
        else:
            if not checked("length", length, ()) > 0.0:
                raise InvalidValueError(f"length is {length}, expected a number above 0")
            scale = np.full(jacobian.shape[:-2], float(length))
        normalised = np.concatenate([angular, linear / scale[..., None, None]], axis=-2)
        alpha = _mean_square(normalised)
        missed = normalised @ np.swapaxes(normalised, -1, -2) / alpha[..., None, None] - np.eye(len(used))
    blocks = missed[..., :split, :split], missed[..., :split, split:], missed[..., split:, split:]
    return Isotropy(alpha, scale, *blocks)


def _used(rows: Sequence[int] | None) -> list[int]:
    used = list(range(6)) if rows is None else list(rows)
    if not used or sorted(set(used) & set(range(6))) != used:
        raise InvalidValueError(f"rows are {used}, expected some of 0 to 5, each once and in increasing order")
    return used


def _mean_square(block: F64) -> F64:
    """Return the mean of the squared norms of the rows."""
    mean: F64 = np.asarray(np.square(block).sum(axis=-1).mean(axis=-1))
    return mean
