"""High-precision reference for the Frobenius condition number of a serial robot's Jacobian.

Everything here is derived without the usual cross-product formulas: the homogeneous
transformation of the chain is a product of Denavit-Hartenberg matrices, and this product is
differentiated directly, up to third order, in arithmetic of 50 digits or more.  The columns of
the Jacobian and their derivatives are read off those matrices::

    omega_i = vee(R_i R^T),   v_i = p_i

where a subscript is a derivative with respect to a joint variable, ``R`` the rotation and ``p``
the tool point of the chain.  Then, with ``J_n = diag(L, L, L, 1, 1, 1) J``, the selected rows
only, ``G = J_n J_n^T`` and ``H = G^-1``::

    kappa^2     = tr(G) tr(H) / m^2
    tr(H)_k     = -tr(H^2 G_k)
    tr(H)_kl    = 2 tr(H^2 G_k H G_l) - tr(H^2 G_kl)

Conventions: distal (standard) DH, ``T_i = Rz(theta) Tz(d) Tx(a) Rx(alpha)``; the joint variable
is added to ``theta`` (``R``) or to ``d`` (``P``); the rows of ``J`` are ``[omega; v]``, at the
tool point (the origin of the last DH frame, unless ``tool`` moves it within that frame), in the
base frame.  The variables are ``x = (q_1, ..., q_n, L)``.

Numbers are taken as exact: a float is the float64 number that it is, a string is read as a
decimal.  The single exception is a right angle: where the cosine or the sine of ``alpha`` or of
the offset ``theta`` is below 1e-15 in magnitude, the angle is the multiple of pi/2 that it stands
for, as in the package.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import mpmath
import numpy as np
import numpy.typing as npt

from tests.reference.condition.chain import ExactArray, Number, Robot, as_mpf, differentiated, zeros

FloatArray = npt.NDArray[np.float64]
"""Array of float64."""
BASE_DIGITS = 50
"""Decimal digits of the arithmetic for a well-conditioned posture."""


class Exact(NamedTuple):
    """Condition number and derivatives of its square, as ``mpmath.mpf``.

    Attributes
    ----------
    kappa : mpf
        Normalised Frobenius condition number.
    squared : mpf
        Its square.
    gradient : ndarray of mpf, shape (n + 1,)
        Gradient of the square over ``(q, L)``.
    hessian : ndarray of mpf, shape (n + 1, n + 1)
        Hessian of the square over ``(q, L)``.
    digits : int
        Decimal digits of the arithmetic.
    """

    kappa: Any
    squared: Any
    gradient: ExactArray
    hessian: ExactArray
    digits: int


class Reference(NamedTuple):
    """Condition number and derivatives of its square, rounded to float64.

    Attributes
    ----------
    kappa : float
        Normalised Frobenius condition number.
    gradient : ndarray, shape (n + 1,)
        Gradient of ``kappa**2`` over ``(q, L)``.
    hessian : ndarray, shape (n + 1, n + 1)
        Hessian of ``kappa**2`` over ``(q, L)``.
    """

    kappa: float
    gradient: FloatArray
    hessian: FloatArray


def scaled_rows(robot: Robot, jacobian: ExactArray, length: Any) -> ExactArray:
    """Return the selected rows with the angular ones multiplied by ``length``."""
    rows = list(robot.rows)
    scale = zeros(len(rows), 1)
    for i, row in enumerate(rows):
        scale[i, 0] = length if row < 3 else mpmath.mpf(1)
    out: ExactArray = jacobian[rows, :] * scale
    return out


def angular_rows(robot: Robot, jacobian: ExactArray) -> ExactArray:
    """Return the derivative of the scaled rows over the length."""
    rows = list(robot.rows)
    scale = zeros(len(rows), 1)
    for i, row in enumerate(rows):
        scale[i, 0] = mpmath.mpf(1 if row < 3 else 0)
    out: ExactArray = jacobian[rows, :] * scale
    return out


def inverse_of(matrix: ExactArray) -> ExactArray:
    """Return the inverse of a square matrix; raise ZeroDivisionError if it is singular."""
    size = matrix.shape[0]
    inverse = mpmath.inverse(mpmath.matrix(matrix.tolist()))
    out = zeros(size, size)
    for i in range(size):
        for j in range(size):
            out[i, j] = inverse[i, j]
    return out


def _trace_of_product(left: ExactArray, right: ExactArray) -> Any:
    """Return the trace of ``left right``."""
    return (left * right.T).sum()


def kappa_squared(robot: Robot, jacobian: ExactArray, length: Any) -> Any:
    """Return ``tr(G) tr(G^-1) / m^2`` of a 6 x n Jacobian."""
    scaled = scaled_rows(robot, jacobian, length)
    gram = scaled @ scaled.T
    return gram.trace() * inverse_of(gram).trace() / len(robot.rows) ** 2


def kappa_of(robot: Robot, q: Sequence[Any]) -> Any:
    """Return the condition number at the current precision, infinity if it is singular."""
    try:
        squared = kappa_squared(robot, differentiated(robot, q, 0).jacobian, as_mpf(robot.length))
    except ZeroDivisionError:
        return mpmath.inf
    return mpmath.sqrt(squared) if squared > 0 else mpmath.inf


def _derivatives(robot: Robot, q: Sequence[Any], length: Any) -> tuple[Any, ExactArray, ExactArray]:
    """Return value, gradient and Hessian of the squared condition number."""
    n = len(robot.joints)
    chain = differentiated(robot, q, 2)
    j = scaled_rows(robot, chain.jacobian, length)
    j1 = [scaled_rows(robot, block, length) for block in chain.first]
    j1.append(angular_rows(robot, chain.jacobian))
    j2 = [[scaled_rows(robot, block, length) for block in line] for line in chain.second]
    j2.append([angular_rows(robot, block) for block in chain.first])
    j2[n].append(zeros(*j.shape))

    gram = j @ j.T
    inverse = inverse_of(gram)
    inverse_2 = inverse @ inverse
    g1 = []
    for k in range(n + 1):
        half = j1[k] @ j.T
        g1.append(half + half.T)
    trace_g = gram.trace()
    trace_h = inverse.trace()
    trace_g1 = [g.trace() for g in g1]
    trace_h1 = [-_trace_of_product(inverse_2, g) for g in g1]
    left = [inverse_2 @ g @ inverse for g in g1]

    scale = mpmath.mpf(1) / len(robot.rows) ** 2
    gradient = zeros(n + 1)
    hessian = zeros(n + 1, n + 1)
    for k in range(n + 1):
        gradient[k] = scale * (trace_g1[k] * trace_h + trace_g * trace_h1[k])
        for p in range(k + 1):
            half = j2[k][p] @ j.T + j1[k] @ j1[p].T
            g2 = half + half.T
            trace_h2 = 2 * _trace_of_product(left[k], g1[p]) - _trace_of_product(inverse_2, g2)
            hessian[k, p] = scale * (
                g2.trace() * trace_h + trace_g1[k] * trace_h1[p] + trace_g1[p] * trace_h1[k] + trace_g * trace_h2
            )
            hessian[p, k] = hessian[k, p]
    return scale * trace_g * trace_h, gradient, hessian


def reference_exact(robot: Robot, q: Sequence[Number], digits: int | None = None) -> Exact:
    """Return the condition number and the derivatives of its square as ``mpf``.

    Parameters
    ----------
    robot : Robot
        The robot, its rows and its length.
    q : sequence of float or str, length n
        Joint variables [rad or m].
    digits : int, optional
        Decimal digits of the arithmetic.  By default 50, and six more for every power of ten of
        the condition number.

    Returns
    -------
    Exact
        Values in the arithmetic of ``digits`` digits.

    Raises
    ------
    ZeroDivisionError
        If the posture is exactly singular.
    """
    if digits is None:
        with mpmath.workdps(BASE_DIGITS):
            kappa = kappa_of(robot, [as_mpf(value) for value in q])
            if not mpmath.isfinite(kappa):
                raise ZeroDivisionError("the posture is singular")
            digits = BASE_DIGITS + 6 * max(0, math.ceil(float(mpmath.log10(kappa))))
    with mpmath.workdps(digits):
        squared, gradient, hessian = _derivatives(robot, [as_mpf(value) for value in q], as_mpf(robot.length))
        return Exact(mpmath.sqrt(squared), squared, gradient, hessian, digits)


def reference(
    a: Sequence[Number],
    d: Sequence[Number],
    alpha: Sequence[Number],
    theta: Sequence[Number],
    joints: str,
    q: Sequence[Number],
    length: Number,
    rows: Sequence[int] = (0, 1, 2, 3, 4, 5),
    digits: int | None = None,
    tool: Sequence[Number] = (0.0, 0.0, 0.0),
) -> Reference:
    """Return kappa, and the gradient and Hessian of ``kappa**2``, rounded to float64.

    Parameters
    ----------
    a, d, alpha, theta : sequence of float or str, length n
        Distal DH parameters [m, m, rad, rad], taken as exact numbers (see the module).
    joints : str
        ``R`` or ``P`` for every joint.
    q : sequence of float or str, length n
        Joint variables [rad or m].
    length : float or str
        Length that multiplies the angular rows [m].
    rows : sequence of int, length m
        Rows of ``[omega; v]`` in use, ``m <= n``.
    digits : int, optional
        Decimal digits of the arithmetic, by default chosen from the condition number.
    tool : sequence of float or str, length 3
        Tool point in the last DH frame [m], its origin by default.

    Returns
    -------
    Reference
        Entries ``0..n-1`` of the derivatives are over ``q``, entry ``n`` is over ``length``.

    Raises
    ------
    ValueError
        If the lengths of the sequences disagree.
    ZeroDivisionError
        If the posture is exactly singular.
    """
    n = len(joints)
    if any(len(values) != n for values in (a, d, alpha, theta, q)) or set(joints) - set("RP"):
        raise ValueError("a, d, alpha, theta, joints and q must describe the same n joints")
    if not 1 <= len(rows) <= n or not set(rows) <= set(range(6)) or len(set(rows)) != len(rows):
        raise ValueError("rows must be distinct, in 0..5, and at most n")
    robot = Robot(
        joints,
        tuple(a),
        tuple(d),
        tuple(alpha),
        tuple(theta),
        tuple(int(row) for row in rows),
        length,
        (tool[0], tool[1], tool[2]),
    )
    return rounded(reference_exact(robot, q, digits))


def rounded(values: Exact) -> Reference:
    """Round to float64."""
    return Reference(float(values.kappa), values.gradient.astype(np.float64), values.hessian.astype(np.float64))
