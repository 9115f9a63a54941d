"""A serial chain in exact arithmetic: products of Denavit-Hartenberg matrices, differentiated up to third order."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import mpmath
import numpy as np
import numpy.typing as npt

ExactArray = npt.NDArray[np.object_]
"""Array of ``mpmath.mpf``."""
Number = float | str
"""A number that is taken as exact: a float64 or a decimal string."""
RIGHT_ANGLE = 1e-15
"""A cosine or sine of ``alpha`` or ``theta`` below this is exactly zero."""


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


class _Chain(NamedTuple):
    """Jacobian, and its first and second derivatives (empty above the order asked for)."""

    jacobian: ExactArray
    first: list[ExactArray]
    second: list[list[ExactArray]]


def zeros(*shape: int) -> ExactArray:
    """Return an array of exact zeros."""
    out = np.empty(shape, dtype=np.object_)
    out.fill(mpmath.mpf(0))
    return out


def identity(size: int) -> ExactArray:
    """Return an exact identity matrix."""
    out = zeros(size, size)
    for i in range(size):
        out[i, i] = mpmath.mpf(1)
    return out


def as_mpf(value: Number) -> Any:
    """Return a number as ``mpf``: floats exactly, strings as decimals."""
    return mpmath.mpf(value if isinstance(value, str) else float(value))


def _cos_sin(angle: Number) -> tuple[Any, Any]:
    """Return cosine and sine of a constant angle, exactly 0 and +-1 at right angles."""
    value = as_mpf(angle)
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
    shift = as_mpf(robot.d[joint])
    revolute = robot.joints[joint] == "R"
    if revolute:
        cq, sq = mpmath.cos(variable), mpmath.sin(variable)
        c, s = c * cq - s * sq, s * cq + c * sq
    else:
        shift += variable

    screw = identity(4)
    screw[0, 0], screw[0, 1], screw[1, 0], screw[1, 1] = c, -s, s, c
    screw[2, 3] = shift
    screws = [screw]
    for order in range(1, 4):
        derivative = zeros(4, 4)
        if revolute:
            c, s = -s, c
            derivative[0, 0], derivative[0, 1] = c, -s
            derivative[1, 0], derivative[1, 1] = s, c
        elif order == 1:
            derivative[2, 3] = mpmath.mpf(1)
        screws.append(derivative)

    ca, sa = _cos_sin(robot.alpha[joint])
    rest = identity(4)
    rest[0, 3] = as_mpf(robot.a[joint])
    rest[1, 1], rest[1, 2], rest[2, 1], rest[2, 2] = ca, -sa, sa, ca
    if joint == len(robot.joints) - 1:
        tool = identity(4)
        for i in range(3):
            tool[i, 3] = as_mpf(robot.tool[i])
        rest = rest @ tool
    return [matrix @ rest for matrix in screws]


def _products(links: list[list[ExactArray]], order: int) -> dict[tuple[int, ...], ExactArray]:
    """Differentiate the product of the DH matrices.

    The key is the sorted tuple of the joints to differentiate by; ``()`` is the product itself.
    """
    products: dict[tuple[int, ...], ExactArray] = {(): identity(4)}
    for joint, link in enumerate(links):
        grown: dict[tuple[int, ...], ExactArray] = {}
        for key, matrix in products.items():
            for times in range(order - len(key) + 1):
                grown[key + (joint,) * times] = matrix @ link[times]
        products = grown
    return products


def _vee(left: ExactArray, right: ExactArray) -> ExactArray:
    """Return entries (2, 1), (0, 2), (1, 0) of ``left right^T`` for the rotational blocks."""
    out = zeros(3)
    for i, (row, column) in enumerate(((2, 1), (0, 2), (1, 0))):
        out[i] = left[row, :3] @ right[column, :3]
    return out


def differentiated(robot: Robot, q: Sequence[Any], order: int) -> _Chain:
    """Return the 6 x n Jacobian and its derivatives up to ``order`` from the matrix products."""
    n = len(robot.joints)
    products = _products([_link(robot, i, q[i]) for i in range(n)], order + 1)

    def t(*key: int) -> ExactArray:
        return products[tuple(sorted(key))]

    rotation = t()
    jacobian = zeros(6, n)
    for i in range(n):
        jacobian[:3, i] = _vee(t(i), rotation)
        jacobian[3:, i] = t(i)[:3, 3]

    first: list[ExactArray] = []
    if order >= 1:
        for k in range(n):
            block = zeros(6, n)
            for i in range(n):
                block[:3, i] = _vee(t(i, k), rotation) + _vee(t(i), t(k))
                block[3:, i] = t(i, k)[:3, 3]
            first.append(block)

    second: list[list[ExactArray]] = []
    if order >= 2:
        for k in range(n):
            second.append([])
            for p in range(k + 1):
                block = zeros(6, n)
                for i in range(n):
                    block[:3, i] = (
                        _vee(t(i, k, p), rotation) + _vee(t(i, k), t(p)) + _vee(t(i, p), t(k)) + _vee(t(i), t(k, p))
                    )
                    block[3:, i] = t(i, k, p)[:3, 3]
                second[k].append(block)
    return _Chain(jacobian, first, second)


def geometric_jacobian(robot: Robot, q: Sequence[Any]) -> ExactArray:
    """Return the Jacobian from joint axes and cross products; only the checks use it."""
    n = len(robot.joints)
    frames = [identity(4)]
    for i in range(n):
        frames.append(frames[-1] @ _link(robot, i, q[i])[0])
    tool = frames[-1][:3, 3]
    jacobian = zeros(6, n)
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
