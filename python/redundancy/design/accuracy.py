"""How much a robot may amplify relative errors."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._core import ConditionNumber, Robot
from .._util import F64


def error_bounds(
    robot: Robot,
    q: ArrayLike,
    length: float,
    *,
    norm: Literal["spectral", "frobenius"] = "spectral",
    rows: Sequence[int] | None = None,
) -> tuple[F64, F64]:
    """Return between which factors a robot changes relative errors (Leger 2014, eq. 1.10).

    Rates q_d of the joints move the tool with the twist t = J_n q_d, angular part times ``length``. Errors of both are
    bound to each other by the condition number kappa of J_n::

        lower <= (|dt| / |t|) / (|dq_d| / |q_d|) <= upper,    lower = 1 / kappa, upper = kappa

    and, turned over, by the same two factors for what becomes of an error of the twist in the rates. That holds for any
    rates of a robot with as many joints as rows; of one with more, for rates and errors without a part in the null
    space, as the shortest rates J_n^+ t are.

    Parameters
    ----------
    robot : Robot
        The robot.
    q : array_like, shape (n,) or (N, n)
        Posture or postures [rad or m].
    length : float
        Length that makes the twist homogeneous [m].
    norm : {"spectral", "frobenius"}
        "spectral": kappa_2, the least bounds there are; some rates and errors attain them. "frobenius": with m rows,
        m kappa_F, wider: ``cond(J_n, "fro")`` of numpy and of the source's figure 4-7. kappa_F alone, normalised as in
        eq. 2.14, is no bound.
    rows : sequence of int, optional
        Rows of the Jacobian in use; all six if not given (planar robots: [2, 3, 4]).

    Returns
    -------
    lower, upper : ndarray, shape () or (N,)
        The factors: 0 and infinity at a singularity; NaN for a robot with fewer joints than rows that move.

    Raises
    ------
    ShapeError, NonFiniteError
        If ``q`` has the wrong shape or is not finite.
    InvalidValueError
        If the length is not positive, or the norm or the rows are unknown.

    Examples
    --------
    >>> import numpy as np
    >>> import redundancy as rd
    >>> robot = rd.robots.get("fanuc_m710ic50_milling")
    >>> lower, upper = rd.error_bounds(robot, np.deg2rad([0, 20, -20, 0, -90, 0]), 0.4852)
    >>> round(float(lower), 3), round(float(upper), 3)
    (0.389, 2.568)
    """
    kappa = np.asarray(ConditionNumber(length, norm, rows).evaluate(robot, q, 0))
    if norm == "frobenius":
        kappa = (6 if rows is None else len(rows)) * kappa
    return 1.0 / kappa, kappa
