"""Pinocchio as a contender: the quickest calls of its Python interface that give the quantity."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from .chains import F64, Chain
from .contender import Contender

ANGULAR_FIRST = [3, 4, 5, 0, 1, 2]


def contender(chain: Chain, quantity: str) -> Contender:
    """Frame placement (an SE3, no matrix), Jacobian or kinematic Hessian."""
    pin = pytest.importorskip("pinocchio")
    model = pin.buildModelFromUrdf(str(chain.urdf))
    data, frame, aligned = model.createData(), model.getFrameId(chain.tip), pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    last = np.empty(0)

    def fk(postures: Sequence[F64]) -> None:
        for q in postures:
            pin.forwardKinematics(model, data, q)
            pin.updateFramePlacement(model, data, frame)

    def jacobian(postures: Sequence[F64]) -> None:
        nonlocal last
        for q in postures:
            pin.computeJointJacobians(model, data, q)
            last = pin.getFrameJacobian(model, data, frame, aligned)

    def jacobian_derivative(postures: Sequence[F64]) -> None:
        nonlocal last
        for q in postures:
            pin.computeJointKinematicHessians(model, data, q)
            last = pin.getFrameKinematicHessian(model, data, frame, aligned)

    def hessian() -> F64:
        # Pinocchio 4.1 labels its column-major (6, n, n) buffer as row-major: read it again as [k, i, row].
        n = int(model.nv)
        return last.ravel(order="K").reshape(n, n, 6).transpose(2, 1, 0)[ANGULAR_FIRST]

    ways: dict[str, tuple[Callable[[Sequence[F64]], None], Callable[[], F64]]] = {
        "fk": (fk, lambda: np.asarray(data.oMf[frame].homogeneous)),
        "jacobian": (jacobian, lambda: last[ANGULAR_FIRST]),
        "jacobian_derivative": (jacobian_derivative, hessian),
    }
    sweep, result = ways[quantity]
    return Contender(sweep, lambda: (result(),))
