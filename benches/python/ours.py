"""This package as a contender."""

from collections.abc import Callable, Sequence

import numpy as np
import redundancy as rd

from .chains import F64, Chain
from .contender import Contender

INDICES: dict[str, tuple[rd.Objective, int]] = {
    "manipulability": (rd.Manipulability(), 0),
    "manipulability_gradient": (rd.Manipulability(), 1),
    "kappa": (rd.ConditionNumber(), 0),
    "kappa_gradient": (rd.ConditionNumber(), 1),
    "kappa_hessian": (rd.ConditionNumber(), 2),
}


def contender(chain: Chain, quantity: str) -> Contender:
    """Kinematics with `out=`; an index with its derivatives up to the order in its name."""
    robot = chain.robot()
    if quantity in INDICES:
        return _index(robot, *INDICES[quantity])
    call: Callable[..., F64] = getattr(robot, quantity)
    out = np.empty(call(np.zeros(robot.n)).shape)

    def sweep(postures: Sequence[F64]) -> None:
        for q in postures:
            call(q, out=out)

    return Contender(sweep, lambda: (out,))


def _index(robot: rd.Robot, index: rd.Objective, order: int) -> Contender:
    evaluate: Callable[..., float | tuple[float | F64, ...]] = index.evaluate
    last: float | tuple[float | F64, ...] = ()

    def sweep(postures: Sequence[F64]) -> None:
        nonlocal last
        for q in postures:
            last = evaluate(robot, q, order=order)

    def result() -> tuple[F64, ...]:
        return tuple(np.asarray(part) for part in (last if isinstance(last, tuple) else (last,)))

    return Contender(sweep, result)
