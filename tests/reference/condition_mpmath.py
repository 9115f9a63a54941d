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

Command line::

    python -m tests.reference.condition_mpmath --check
    python -m tests.reference.condition_mpmath --oracle condition_number.json
    python -m tests.reference.condition_mpmath --write tests/data/condition_random.npz
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
import multiprocessing
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import mpmath
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
"""Array of float64."""

ExactArray = npt.NDArray[np.object_]
"""Array of ``mpmath.mpf``."""

Number = float | str
"""A number that is taken as exact: a float64 or a decimal string."""

BASE_DIGITS = 50
"""Decimal digits of the arithmetic for a well-conditioned posture."""

RIGHT_ANGLE = 1e-15
"""A cosine or sine of ``alpha`` or ``theta`` below this is exactly zero."""

MAX_JOINTS = 9
"""Width of the padded arrays in the data file."""

CASES = 1000
"""Number of postures in the data file."""

SEED = 20140522
"""Seed of the data file."""

MAX_KAPPA = 1.2e7
"""Largest condition number in the data file."""

GENERIC_MAX_KAPPA = 1e5
"""Largest condition number of a posture that was not pushed towards a singularity."""


class Robot(NamedTuple):
    """A serial robot, the rows of its Jacobian in use, and the length that scales the angles.

    Attributes
    ----------
    joints : str
        One letter per joint, ``R`` or ``P``.
    a, d, alpha, theta : tuple of float or str
        DH parameters [m, m, rad, rad].
    rows : tuple of int
        Rows of ``[omega; v]`` in use.
    length : float or str
        Characteristic length ``L`` [m].
    tool : tuple of float or str
        Tool point in the last DH frame [m], its origin by default.
    """

    joints: str
    a: tuple[Number, ...]
    d: tuple[Number, ...]
    alpha: tuple[Number, ...]
    theta: tuple[Number, ...]
    rows: tuple[int, ...]
    length: Number
    tool: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)


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


class Case(NamedTuple):
    """One posture of the data file with its reference values."""

    robot: Robot
    q: tuple[float, ...]
    values: Reference


class _Chain(NamedTuple):
    """Jacobian, and its first and second derivatives (empty above the order asked for)."""

    jacobian: ExactArray
    first: list[ExactArray]
    second: list[list[ExactArray]]


def _zeros(*shape: int) -> ExactArray:
    """Return an array of exact zeros."""
    out = np.empty(shape, dtype=np.object_)
    out.fill(mpmath.mpf(0))
    return out


def _identity(size: int) -> ExactArray:
    """Return an exact identity matrix."""
    out = _zeros(size, size)
    for i in range(size):
        out[i, i] = mpmath.mpf(1)
    return out


def _exact(value: Number) -> Any:
    """Return a number as ``mpf``: floats exactly, strings as decimals."""
    return mpmath.mpf(value if isinstance(value, str) else float(value))


def _cos_sin(angle: Number) -> tuple[Any, Any]:
    """Return cosine and sine of a constant angle, exactly 0 and +-1 at right angles."""
    value = _exact(angle)
    cosine, sine = mpmath.cos(value), mpmath.sin(value)
    if abs(cosine) < RIGHT_ANGLE:
        return mpmath.mpf(0), mpmath.sign(sine)
    if abs(sine) < RIGHT_ANGLE:
        return mpmath.sign(cosine), mpmath.mpf(0)
    return cosine, sine


def _link(robot: Robot, joint: int, variable: Any) -> list[ExactArray]:
    """Return a DH matrix and its first three derivatives over its joint variable.

    The tool belongs to the last link.
    """
    c, s = _cos_sin(robot.theta[joint])
    shift = _exact(robot.d[joint])
    revolute = robot.joints[joint] == "R"
    if revolute:
        cq, sq = mpmath.cos(variable), mpmath.sin(variable)
        c, s = c * cq - s * sq, s * cq + c * sq
    else:
        shift += variable

    screw = _identity(4)
    screw[0, 0], screw[0, 1], screw[1, 0], screw[1, 1] = c, -s, s, c
    screw[2, 3] = shift
    screws = [screw]
    for order in range(1, 4):
        derivative = _zeros(4, 4)
        if revolute:
            c, s = -s, c
            derivative[0, 0], derivative[0, 1] = c, -s
            derivative[1, 0], derivative[1, 1] = s, c
        elif order == 1:
            derivative[2, 3] = mpmath.mpf(1)
        screws.append(derivative)

    ca, sa = _cos_sin(robot.alpha[joint])
    rest = _identity(4)
    rest[0, 3] = _exact(robot.a[joint])
    rest[1, 1], rest[1, 2], rest[2, 1], rest[2, 2] = ca, -sa, sa, ca
    if joint == len(robot.joints) - 1:
        tool = _identity(4)
        for i in range(3):
            tool[i, 3] = _exact(robot.tool[i])
        rest = rest @ tool
    return [matrix @ rest for matrix in screws]


def _products(links: list[list[ExactArray]], order: int) -> dict[tuple[int, ...], ExactArray]:
    """Differentiate the product of the DH matrices.

    The key is the sorted tuple of the joints to differentiate by; ``()`` is the product itself.
    """
    products: dict[tuple[int, ...], ExactArray] = {(): _identity(4)}
    for joint, link in enumerate(links):
        grown: dict[tuple[int, ...], ExactArray] = {}
        for key, matrix in products.items():
            for times in range(order - len(key) + 1):
                grown[key + (joint,) * times] = matrix @ link[times]
        products = grown
    return products


def _vee(left: ExactArray, right: ExactArray) -> ExactArray:
    """Return entries (2, 1), (0, 2), (1, 0) of ``left right^T`` for the rotational blocks."""
    out = _zeros(3)
    for i, (row, column) in enumerate(((2, 1), (0, 2), (1, 0))):
        out[i] = left[row, :3] @ right[column, :3]
    return out


def _chain(robot: Robot, q: Sequence[Any], order: int) -> _Chain:
    """Return the 6 x n Jacobian and its derivatives up to ``order`` from the matrix products."""
    n = len(robot.joints)
    products = _products([_link(robot, i, q[i]) for i in range(n)], order + 1)

    def t(*key: int) -> ExactArray:
        return products[tuple(sorted(key))]

    rotation = t()
    jacobian = _zeros(6, n)
    for i in range(n):
        jacobian[:3, i] = _vee(t(i), rotation)
        jacobian[3:, i] = t(i)[:3, 3]

    first: list[ExactArray] = []
    if order >= 1:
        for k in range(n):
            block = _zeros(6, n)
            for i in range(n):
                block[:3, i] = _vee(t(i, k), rotation) + _vee(t(i), t(k))
                block[3:, i] = t(i, k)[:3, 3]
            first.append(block)

    second: list[list[ExactArray]] = []
    if order >= 2:
        for k in range(n):
            second.append([])
            for p in range(k + 1):
                block = _zeros(6, n)
                for i in range(n):
                    block[:3, i] = (
                        _vee(t(i, k, p), rotation) + _vee(t(i, k), t(p)) + _vee(t(i, p), t(k)) + _vee(t(i), t(k, p))
                    )
                    block[3:, i] = t(i, k, p)[:3, 3]
                second[k].append(block)
    return _Chain(jacobian, first, second)


def _scaled(robot: Robot, jacobian: ExactArray, length: Any) -> ExactArray:
    """Return the selected rows with the angular ones multiplied by ``length``."""
    rows = list(robot.rows)
    scale = _zeros(len(rows), 1)
    for i, row in enumerate(rows):
        scale[i, 0] = length if row < 3 else mpmath.mpf(1)
    out: ExactArray = jacobian[rows, :] * scale
    return out


def _angular(robot: Robot, jacobian: ExactArray) -> ExactArray:
    """Return the derivative of the scaled rows over the length."""
    rows = list(robot.rows)
    scale = _zeros(len(rows), 1)
    for i, row in enumerate(rows):
        scale[i, 0] = mpmath.mpf(1 if row < 3 else 0)
    out: ExactArray = jacobian[rows, :] * scale
    return out


def _inverse(matrix: ExactArray) -> ExactArray:
    """Return the inverse of a square matrix; raise ZeroDivisionError if it is singular."""
    size = matrix.shape[0]
    inverse = mpmath.inverse(mpmath.matrix(matrix.tolist()))
    out = _zeros(size, size)
    for i in range(size):
        for j in range(size):
            out[i, j] = inverse[i, j]
    return out


def _trace_of_product(left: ExactArray, right: ExactArray) -> Any:
    """Return the trace of ``left right``."""
    return (left * right.T).sum()


def _kappa_squared(robot: Robot, jacobian: ExactArray, length: Any) -> Any:
    """Return ``tr(G) tr(G^-1) / m^2`` of a 6 x n Jacobian."""
    scaled = _scaled(robot, jacobian, length)
    gram = scaled @ scaled.T
    return gram.trace() * _inverse(gram).trace() / len(robot.rows) ** 2


def _kappa(robot: Robot, q: Sequence[Any]) -> Any:
    """Return the condition number at the current precision, infinity if it is singular."""
    try:
        squared = _kappa_squared(robot, _chain(robot, q, 0).jacobian, _exact(robot.length))
    except ZeroDivisionError:
        return mpmath.inf
    return mpmath.sqrt(squared) if squared > 0 else mpmath.inf


def _derivatives(robot: Robot, q: Sequence[Any], length: Any) -> tuple[Any, ExactArray, ExactArray]:
    """Return value, gradient and Hessian of the squared condition number."""
    n = len(robot.joints)
    chain = _chain(robot, q, 2)
    j = _scaled(robot, chain.jacobian, length)
    j1 = [_scaled(robot, block, length) for block in chain.first]
    j1.append(_angular(robot, chain.jacobian))
    j2 = [[_scaled(robot, block, length) for block in line] for line in chain.second]
    j2.append([_angular(robot, block) for block in chain.first])
    j2[n].append(_zeros(*j.shape))

    gram = j @ j.T
    inverse = _inverse(gram)
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
    gradient = _zeros(n + 1)
    hessian = _zeros(n + 1, n + 1)
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
            kappa = _kappa(robot, [_exact(value) for value in q])
            if not mpmath.isfinite(kappa):
                raise ZeroDivisionError("the posture is singular")
            digits = BASE_DIGITS + 6 * max(0, math.ceil(float(mpmath.log10(kappa))))
    with mpmath.workdps(digits):
        squared, gradient, hessian = _derivatives(robot, [_exact(value) for value in q], _exact(robot.length))
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
    return _rounded(reference_exact(robot, q, digits))


def _rounded(values: Exact) -> Reference:
    """Round to float64."""
    return Reference(float(values.kappa), values.gradient.astype(np.float64), values.hessian.astype(np.float64))


# Checks -------------------------------------------------------------------------------------


def _geometric_jacobian(robot: Robot, q: Sequence[Any]) -> ExactArray:
    """Return the Jacobian from joint axes and cross products; only the checks use it."""
    n = len(robot.joints)
    frames = [_identity(4)]
    for i in range(n):
        frames.append(frames[-1] @ _link(robot, i, q[i])[0])
    tool = frames[-1][:3, 3]
    jacobian = _zeros(6, n)
    for i in range(n):
        e = frames[i][:3, 2]
        if robot.joints[i] == "R":
            r = tool - frames[i][:3, 3]
            jacobian[:3, i] = e
            jacobian[3, i] = e[1] * r[2] - e[2] * r[1]
            jacobian[4, i] = e[2] * r[0] - e[0] * r[2]
            jacobian[5, i] = e[0] * r[1] - e[1] * r[0]
        else:
            jacobian[3:, i] = e
    return jacobian


def difference_check(
    robot: Robot, q: Sequence[Number], digits: int = 80, step: str = "1e-20"
) -> tuple[float, float, float]:
    """Compare value, gradient and Hessian with central differences at high precision.

    The differences are taken of ``kappa**2`` built on the Jacobian of joint axes and cross
    products, so that the columns are checked as well.

    Parameters
    ----------
    robot : Robot
        The robot, its rows and its length.
    q : sequence of float or str
        Joint variables.
    digits : int, default 80
        Decimal digits of the arithmetic.
    step : str, default "1e-20"
        Step of the differences.

    Returns
    -------
    tuple of float
        Deviation of value, gradient and Hessian, relative to their largest entry.
    """
    n = len(robot.joints)
    with mpmath.workdps(digits):
        h = mpmath.mpf(step)
        x = [_exact(value) for value in q] + [_exact(robot.length)]

        def value(*moves: tuple[int, int]) -> Any:
            y = list(x)
            for index, sign in moves:
                y[index] = y[index] + sign * h
            return _kappa_squared(robot, _geometric_jacobian(robot, y[:n]), y[n])

        centre = value()
        gradient = _zeros(n + 1)
        hessian = _zeros(n + 1, n + 1)
        for k in range(n + 1):
            plus, minus = value((k, 1)), value((k, -1))
            gradient[k] = (plus - minus) / (2 * h)
            hessian[k, k] = (plus - 2 * centre + minus) / h**2
            for p in range(k):
                mixed = value((k, 1), (p, 1)) - value((k, 1), (p, -1))
                mixed += value((k, -1), (p, -1)) - value((k, -1), (p, 1))
                hessian[k, p] = hessian[p, k] = mixed / (4 * h**2)
        exact = reference_exact(robot, q, digits)
        return (
            float(abs(exact.squared / centre - 1)),
            _deviation(exact.gradient, gradient),
            _deviation(exact.hessian, hessian),
        )


def _deviation(left: ExactArray, right: ExactArray) -> float:
    """Return the largest difference relative to the largest entry of ``right``."""
    difference: list[Any] = (left - right).ravel().tolist()
    values: list[Any] = right.ravel().tolist()
    return float(max(map(abs, difference)) / (max(map(abs, values)) or 1))


def _entry_deviation(left: ExactArray, right: ExactArray, floor: float) -> float:
    """Return the largest relative difference over the entries above ``floor`` times the largest."""
    values: list[Any] = right.ravel().tolist()
    scale = max(map(abs, values)) * floor
    pairs = zip(left.ravel().tolist(), values, strict=True)
    return float(max((abs(x / y - 1) for x, y in pairs if abs(y) > scale), default=0.0))


def oracle_check(path: Path) -> list[tuple[str, float, float, float, float]]:
    """Compare with a file of oracle cases.

    Parameters
    ----------
    path : Path
        JSON file with ``cases``, each of ``model``, ``q``, ``L``, ``kappa``, ``grad``, ``hess``,
        as decimal strings; a model may have a ``tool_offset`` in its last frame.

    Returns
    -------
    list of tuple
        For every case its name, the deviations of kappa, gradient and Hessian relative to the
        largest entry, and the largest deviation of one entry above 1e-10 of the largest.

    Raises
    ------
    ValueError
        If a model has an entry that is not understood.
    """
    out = []
    for case in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        model = case["model"]
        unknown = set(model) - {"a", "d", "alpha", "theta", "joints", "rows", "tool_offset"}
        if unknown:
            raise ValueError(f"the model of {case['robot']} has unknown entries {sorted(unknown)}")
        robot = Robot(
            model["joints"],
            tuple(model["a"]),
            tuple(model["d"]),
            tuple(model["alpha"]),
            tuple(model["theta"]),
            tuple(model["rows"]),
            case["L"],
            tuple(model.get("tool_offset", (0.0, 0.0, 0.0))),
        )
        exact = reference_exact(robot, case["q"])
        with mpmath.workdps(exact.digits):
            size = len(robot.joints) + 1
            gradient, hessian = _zeros(size), _zeros(size, size)
            for k in range(size):
                gradient[k] = mpmath.mpf(case["grad"][k])
                for p in range(size):
                    hessian[k, p] = mpmath.mpf(case["hess"][k][p])
            entries = max(
                _entry_deviation(exact.gradient, gradient, 1e-10),
                _entry_deviation(exact.hessian, hessian, 1e-10),
            )
            out.append(
                (
                    f"{case['robot']} {float(exact.kappa):.4g}",
                    float(abs(exact.kappa / mpmath.mpf(case["kappa"]) - 1)),
                    _deviation(exact.gradient, gradient),
                    _deviation(exact.hessian, hessian),
                    entries,
                )
            )
    return out


# Random postures ----------------------------------------------------------------------------
#
# Only uniform random numbers and mpmath decide what is drawn and kept, so that the file does not
# depend on the platform's LAPACK or libm.


class _Plan(NamedTuple):
    """What a case must look like; the geometry is redrawn until it does."""

    n: int
    prismatic: int
    right: bool
    kind: str
    rows: tuple[int, ...]
    target: float


def _pick(rng: np.random.Generator, items: Sequence[Any], weights: Sequence[float]) -> Any:
    """Return one of ``items`` with the given weights."""
    total = rng.random() * sum(weights)
    for item, weight in zip(items, weights, strict=True):
        total -= weight
        if total < 0:
            return item
    return items[-1]


def _subset(rng: np.random.Generator, size: int) -> tuple[int, ...]:
    """Return ``size`` random rows in rising order."""
    return tuple(sorted(int(row) for row in rng.permutation(6)[:size]))


def _plan(rng: np.random.Generator, index: int) -> _Plan:
    """Draw what case ``index`` must look like."""
    n = int(_pick(rng, range(3, MAX_JOINTS + 1), (0.1, 0.1, 0.1, 0.32, 0.2, 0.1, 0.08)))
    prismatic = int(rng.integers(1, min(3, n - 2) + 1)) if rng.random() < 0.5 else 0
    right = bool(rng.random() < (0.45 if n >= 6 else 0.6))
    rows: tuple[int, ...]
    if n >= 6 and rng.random() < 0.75:
        kind, rows = "full", (0, 1, 2, 3, 4, 5)
        if right and n == 6 and rng.random() < 0.4:
            kind = "wrist"
    elif n >= 6:
        kind = _pick(rng, ("subset", "linear", "planar"), (0.6, 0.25, 0.15 if right else 0.0))
        rows = _subset(rng, int(_pick(rng, (5, 4, 3), (0.5, 0.2, 0.3))))
    else:
        kind = _pick(rng, ("subset", "linear", "planar"), (0.35, 0.35, 0.5 if right else 0.0))
        rows = _subset(rng, int(rng.integers(2, n + 1)))
    if kind == "linear":
        rows = (3, 4, 5)
    elif kind == "planar":
        rows = (2, 3, 4) if rng.random() < 0.8 else (3, 4)
        prismatic = min(prismatic, 2, (n - 1) // 2)
    # Only revolute joints turn the tool: one is needed for every angular row.
    prismatic = min(prismatic, n - sum(row < 3 for row in rows))
    target = 0.0
    if index % 10 in (1, 4, 7):
        target = float(rng.uniform(2.0, 7.0))
    return _Plan(n, prismatic, right, kind, rows, target)


def _planar_joints(rng: np.random.Generator, n: int, prismatic: int) -> str:
    """Return joints in random order, none of the prismatic ones first or next to another."""
    places = [
        places
        for places in itertools.combinations(range(1, n), prismatic)
        if all(second - first > 1 for first, second in itertools.pairwise(places))
    ]
    chosen = places[int(rng.integers(len(places)))]
    return "".join("P" if i in chosen else "R" for i in range(n))


def _draw_robot(rng: np.random.Generator, plan: _Plan) -> Robot:
    """Draw a robot of the planned kind; it may be singular everywhere."""
    n = plan.n
    free = n - 3 if plan.kind == "wrist" else n
    letters = ["P"] * min(plan.prismatic, free) + ["R"] * (free - min(plan.prismatic, free))
    joints = "".join(letters[int(i)] for i in rng.permutation(free)) + "R" * (n - free)
    if plan.kind == "planar":
        joints = _planar_joints(rng, n, plan.prismatic)

    a = [float(value) for value in rng.uniform(-0.8, 0.8, n)]
    d = [float(value) for value in rng.uniform(-0.8, 0.8, n)]
    alpha = [float(value) for value in rng.uniform(-math.pi, math.pi, n)]
    theta = [float(value) for value in rng.uniform(-math.pi, math.pi, n)]
    length = float(rng.uniform(0.1, 1.2))
    if plan.right:
        quarter = math.pi / 2
        # A catalogue robot: round figures, some of them zero, and right angles.
        a = [0.0 if rng.random() < 0.4 else round(value, 3) for value in a]
        d = [0.0 if rng.random() < 0.4 else round(value, 3) for value in d]
        turns = ((-1, 0, 1, 2), (0.4, 0.15, 0.4, 0.05))
        alpha = [quarter * _pick(rng, *turns) for _ in range(n)]
        turns = ((-1, 0, 1, 2), (0.15, 0.6, 0.15, 0.1))
        theta = [quarter * _pick(rng, *turns) for _ in range(n)]
        length = round(length, 3)
    if plan.kind == "wrist":
        sign = -1 if rng.random() < 0.5 else 1
        alpha[3:] = [sign * math.pi / 2, -sign * math.pi / 2, 0.0]
        a[3:] = [0.0, 0.0, 0.0]
        d[4] = 0.0
        theta[4] = 0.0
    if plan.kind == "planar":
        # The axis of a prismatic joint lies in the plane: turn into it before and out after.
        a = [float(rng.uniform(0.1, 0.9)) for _ in range(n)]
        alpha = [0.0] * n
        for i in range(n):
            if joints[i] == "P":
                alpha[i - 1], alpha[i], theta[i] = math.pi / 2, -math.pi / 2, 0.0
    return Robot(
        joints,
        tuple(a),
        tuple(d),
        tuple(alpha),
        tuple(theta),
        plan.rows,
        length,
    )


def _draw_posture(rng: np.random.Generator, robot: Robot) -> list[float]:
    """Draw joint variables."""
    return [float(rng.uniform(-math.pi, math.pi) if joint == "R" else rng.uniform(-0.7, 0.7)) for joint in robot.joints]


def _as_floats(robot: Robot, q: Sequence[Any]) -> tuple[float, ...] | None:
    """Return float64 joint variables, angles in (-pi, pi], or None if a prismatic one is large."""
    out = []
    for joint, value in zip(robot.joints, q, strict=True):
        if joint == "R":
            out.append(float(value - 2 * mpmath.pi * mpmath.nint(value / (2 * mpmath.pi))))
        elif abs(value) > 2:
            return None
        else:
            out.append(float(value))
    return tuple(out)


def _singular_posture(robot: Robot, start: Sequence[float]) -> list[Any] | None:
    """Solve ``J_n^T u = 0``, ``|u| = 1`` for a posture and a direction by damped Gauss-Newton.

    The unknowns outnumber the equations, so each step is the one of least norm.
    """
    n, m = len(robot.joints), len(robot.rows)
    length = _exact(robot.length)
    q = [_exact(value) for value in start]
    scaled = _scaled(robot, _chain(robot, q, 0).jacobian, length)
    try:
        inverse = _inverse(scaled @ scaled.T)
    except ZeroDivisionError:
        return None
    u = _zeros(m)
    u.fill(mpmath.mpf(1))
    for _ in range(8):
        u = inverse @ u
        u = u / mpmath.sqrt(u @ u)

    for _ in range(25):
        chain = _chain(robot, q, 1)
        scaled = _scaled(robot, chain.jacobian, length)
        residual = _zeros(n + 1)
        residual[:n] = scaled.T @ u
        residual[n] = (u @ u - 1) / 2
        square = residual @ residual
        if square < mpmath.mpf("1e-44"):
            return q
        slope = _zeros(n + 1, n + m)
        for k in range(n):
            slope[:n, k] = _scaled(robot, chain.first[k], length).T @ u
        slope[:n, n:] = scaled.T
        slope[n, n:] = u
        normal = slope @ slope.T
        for k in range(n + 1):
            normal[k, k] += square
        try:
            multiplier = _inverse(normal) @ residual
        except ZeroDivisionError:
            return None
        step = -(slope.T @ multiplier)
        largest = max(abs(value) for value in step)
        if largest > 0.5:
            step = step / (2 * largest)
        q = [value + step[k] for k, value in enumerate(q)]
        u = u + step[n:]
    return None


def _pushed_posture(
    rng: np.random.Generator, robot: Robot, plan: _Plan, start: Sequence[float]
) -> tuple[float, ...] | None:
    """Return a posture next to a singular one, with a condition number near the planned target."""
    n = len(robot.joints)
    if plan.kind == "wrist" and rng.random() < 0.6:
        singular: list[Any] | None = [_exact(value) for value in start]
        direction = [mpmath.mpf(0)] * n
        assert singular is not None
        singular[4], direction[4] = mpmath.mpf(0), mpmath.mpf(1)
    else:
        singular = _singular_posture(robot, start)
        direction = [_exact(value) for value in rng.uniform(-1.0, 1.0, n)]
    if singular is None:
        return None

    target = mpmath.mpf(10) ** plan.target
    distance = 1 / target
    for _ in range(8):
        moved = [s + distance * e for s, e in zip(singular, direction, strict=True)]
        q = _as_floats(robot, moved)
        if q is None:
            return None
        kappa = _kappa(robot, [_exact(value) for value in q])
        if not mpmath.isfinite(kappa):
            return None
        if target / 1.5 < kappa < target * 1.1 and distance < mpmath.mpf("0.2"):
            return q
        distance = min(distance * kappa / target, mpmath.mpf(1))
    return None


def make_case(index: int) -> Case:
    """Draw case ``index`` of the data file and compute its reference values.

    Parameters
    ----------
    index : int
        Number of the case; it seeds the random numbers, together with ``SEED``.

    Returns
    -------
    Case
        Robot, posture and values.
    """
    rng = np.random.default_rng([SEED, index])
    for attempt in range(2000):
        # Some plans cannot be met: the first axis is z whatever the robot, so that for instance
        # two revolute joints never serve both rows 0 and 1.
        if attempt % 100 == 0:
            plan = _plan(rng, index)
        robot = _draw_robot(rng, plan)
        start = _draw_posture(rng, robot)
        with mpmath.workdps(30):
            kappa = _kappa(robot, [_exact(value) for value in start])
            if not kappa < GENERIC_MAX_KAPPA:
                continue
            q: tuple[float, ...] | None = tuple(start)
            if plan.target:
                q = _pushed_posture(rng, robot, plan, start)
        if q is None:
            continue
        values = _rounded(reference_exact(robot, q))
        # A Cartesian robot has a constant index, which would test nothing.
        if values.kappa < MAX_KAPPA and np.abs(values.gradient[:-1]).max() > 1e-6:
            return Case(robot, q, values)
    raise RuntimeError(f"no posture found for case {index}")


def pack(cases: Sequence[Case]) -> dict[str, npt.NDArray[Any]]:
    """Return the padded arrays of the data file.

    Parameters
    ----------
    cases : sequence of Case
        The postures, N of them.

    Returns
    -------
    dict of ndarray
        ``n``, ``m`` (N,) int64; ``rows`` (N, 6) bool; ``joints`` (N, 9) one letter, empty beyond
        n; ``a``, ``d``, ``alpha``, ``theta``, ``q`` (N, 9), NaN beyond n; ``length``, ``kappa``
        (N,); ``gradient`` (N, 10) and ``hessian`` (N, 10, 10) of ``kappa**2``, entries 0..n-1
        over q, entry n over the length, NaN beyond.
    """
    count, width = len(cases), MAX_JOINTS
    out: dict[str, npt.NDArray[Any]] = {
        "n": np.array([len(case.robot.joints) for case in cases], dtype=np.int64),
        "m": np.array([len(case.robot.rows) for case in cases], dtype=np.int64),
        "rows": np.zeros((count, 6), dtype=np.bool_),
        "joints": np.zeros((count, width), dtype="<U1"),
    }
    for name in ("a", "d", "alpha", "theta", "q"):
        out[name] = np.full((count, width), np.nan)
    out["length"] = np.array([float(case.robot.length) for case in cases])
    out["kappa"] = np.array([case.values.kappa for case in cases])
    out["gradient"] = np.full((count, width + 1), np.nan)
    out["hessian"] = np.full((count, width + 1, width + 1), np.nan)
    for i, (robot, q, values) in enumerate(cases):
        n = len(robot.joints)
        out["rows"][i, list(robot.rows)] = True
        out["joints"][i, :n] = list(robot.joints)
        for name, numbers in zip(
            ("a", "d", "alpha", "theta", "q"),
            (robot.a, robot.d, robot.alpha, robot.theta, q),
            strict=True,
        ):
            out[name][i, :n] = numbers
        out["gradient"][i, : n + 1] = values.gradient
        out["hessian"][i, : n + 1, : n + 1] = values.hessian
    return out


def write(path: Path, count: int = CASES, workers: int = 2) -> None:
    """Compute the random postures and write the data file.

    Parameters
    ----------
    path : Path
        The ``.npz`` file.
    count : int, default 1000
        Number of postures.
    workers : int, default 2
        Number of processes.
    """
    start = time.monotonic()
    cases: list[Case] = []
    with multiprocessing.Pool(workers) as pool:
        for case in pool.imap(make_case, range(count), chunksize=4):
            cases.append(case)
            if len(cases) % 50 == 0 or len(cases) == count:
                print(f"{len(cases)} of {count}, {time.monotonic() - start:.0f} s", flush=True)
    np.savez_compressed(path, **pack(cases))  # type: ignore[arg-type]
    kappa = np.array([case.values.kappa for case in cases])
    prismatic = np.mean(["P" in case.robot.joints for case in cases])
    print(f"{path}: {path.stat().st_size} bytes, {prismatic:.0%} of the robots prismatic")
    print(f"kappa {kappa.min():.3g} to {kappa.max():.3g}, median {np.median(kappa):.3g}")


def check(count: int = 12) -> float:
    """Check random cases against central differences and return the worst deviation.

    Parameters
    ----------
    count : int, default 12
        Number of cases of the data file to check, from the first.

    Returns
    -------
    float
        Largest deviation, relative to the largest entry.
    """
    worst = 0.0
    for index in range(count):
        case = make_case(index)
        deviations = difference_check(case.robot, case.q)
        worst = max(worst, *deviations)
        print(
            f"{index} {case.robot.joints} rows {case.robot.rows} kappa {case.values.kappa:.4g}: "
            + " ".join(f"{value:.1e}" for value in deviations),
            flush=True,
        )
    return worst


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Command-line arguments, by default those of the process.

    Returns
    -------
    int
        Exit status, 1 if a check failed.
    """
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", type=Path, metavar="NPZ", help="regenerate the data file")
    parser.add_argument("--count", type=int, default=CASES, help="number of postures to write")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    parser.add_argument("--check", action="store_true", help="compare with central differences")
    parser.add_argument("--oracle", type=Path, metavar="JSON", help="compare with oracle cases")
    options = parser.parse_args(arguments)
    failed = False
    if options.check:
        worst = check()
        print(f"central differences: worst deviation {worst:.1e}")
        failed |= worst > 1e-15
    if options.oracle is not None:
        rows = oracle_check(options.oracle)
        for name, *deviations in rows:
            print(name, " ".join(f"{value:.1e}" for value in deviations))
        worst = max(max(deviations[:3]) for _, *deviations in rows)
        print(f"oracle: worst deviation {worst:.1e} of the largest entry")
        failed |= worst > 1e-12
    if options.write is not None:
        write(options.write, options.count, options.workers)
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())
