"""Kinematics and indices of a URDF chain as CasADi expressions, with few operations."""

import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
import pytest

from .chains import F64, Chain

SX: TypeAlias = Any
"""A CasADi expression: the peer is optional and has no type here."""


def outputs(chain: Chain, quantity: str) -> tuple[SX, list[SX]]:
    """Return the joint coordinates and what `ours.contender` computes of them, derivatives by CasADi."""
    ca = pytest.importorskip("casadi")
    q, pose, jacobian = _kinematics(chain)
    if quantity == "fk":
        return q, [pose]
    if quantity == "jacobian":
        return q, [jacobian]
    if quantity == "jacobian_derivative":
        return q, [ca.jacobian(ca.vec(jacobian), q)]
    pivots, trace_of_inverse = _inverse(jacobian)
    if quantity.startswith("manipulability"):
        value = ca.sqrt(math.prod(pivots))
    else:
        value = ca.sqrt(ca.sumsqr(jacobian) * trace_of_inverse) / 6
    gradient = ca.gradient(value, q)
    parts = [value, gradient, ca.jacobian(gradient, q, {"symmetric": True})]
    return q, parts[: {"gradient": 2, "hessian": 3}.get(quantity.partition("_")[2], 1)]


def _kinematics(chain: Chain) -> tuple[SX, SX, SX]:
    ca = pytest.importorskip("casadi")
    coordinates: list[SX] = []
    axes: list[SX] = []
    origins: list[SX] = []
    rotation, position = ca.SX.eye(3), ca.SX(3, 1)
    for offset, turn, axis in _segments(chain):
        position = position + rotation @ _sparse(offset)
        rotation = rotation @ _sparse(turn)
        if axis is not None:
            q = ca.SX.sym(f"q{len(coordinates)}")
            coordinates.append(q)
            axes.append(ca.densify(rotation @ _sparse(axis)))
            origins.append(position)
            parallel, cross = np.outer(axis, axis), np.cross(np.eye(3), axis)
            across = np.eye(3) - parallel
            rotation = rotation @ (_sparse(parallel) + ca.cos(q) * _sparse(across) + ca.sin(q) * _sparse(cross))
    linear = [ca.cross(w, position - p) for w, p in zip(axes, origins, strict=True)]
    pose = ca.vertcat(ca.horzcat(rotation, position), ca.SX([[0, 0, 0, 1]]))
    return ca.vertcat(*coordinates), pose, ca.vertcat(ca.horzcat(*axes), ca.horzcat(*linear))


def _inverse(jacobian: SX) -> tuple[list[SX], SX]:
    """Pivots of J J^T = L D L^T and the trace of its inverse: half the operations of CasADi's own inverse."""
    ca = pytest.importorskip("casadi")
    m = jacobian.shape[0]
    gram = jacobian @ jacobian.T
    pivots: list[SX] = []
    lower, inverse, trace = ca.SX.eye(m), ca.SX.eye(m), 0
    for c in range(m):
        pivots.append(gram[c, c] - sum(lower[c, k] ** 2 * pivots[k] for k in range(c)))
        for r in range(c + 1, m):
            lower[r, c] = (gram[r, c] - sum(lower[r, k] * lower[c, k] * pivots[k] for k in range(c))) / pivots[c]
    for r in range(m):
        for c in range(r):
            inverse[r, c] = -sum(lower[r, k] * inverse[k, c] for k in range(c, r))
        trace += sum(inverse[r, c] ** 2 for c in range(r + 1)) / pivots[r]
    return pivots, trace


def _segments(chain: Chain) -> Iterator[tuple[F64, F64, F64 | None]]:
    """Walk the joints in the order of the file: offset, rotation, axis unless fixed."""
    for joint in ElementTree.parse(chain.urdf).getroot().findall("joint"):
        origin, axis = joint.find("origin"), joint.find("axis")
        assert origin is not None
        roll, pitch, yaw = _numbers(origin, "rpy")
        turn = _about(2, yaw) @ _about(1, pitch) @ _about(0, roll)
        moves = joint.get("type") == "revolute" and axis is not None
        yield _numbers(origin, "xyz"), turn, _numbers(axis, "xyz") if moves and axis is not None else None


def _numbers(element: ElementTree.Element, name: str) -> F64:
    return np.array([float(word) for word in element.get(name, "0 0 0").split()])


def _about(axis: int, angle: float) -> F64:
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[[i, i, j, j], [i, j, i, j]] = np.cos(angle), -np.sin(angle), np.sin(angle), np.cos(angle)
    return rotation


def _sparse(matrix: F64) -> SX:
    """Leave out what a right angle left as rounding, so that no operation is spent on it."""
    ca = pytest.importorskip("casadi")
    return ca.sparsify(ca.SX(np.where(np.abs(matrix) < 1e-12, 0.0, matrix)))
