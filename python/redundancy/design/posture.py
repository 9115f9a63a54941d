"""Postures of minimum condition number, and what they tell about a robot."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._core import Robot, characteristic_length
from .._util import F64, checked, progress_bar
from ..errors import InvalidValueError

__all__ = [
    "Convergence",
    "PlanarTetrahedron",
    "PostureResult",
    "characteristic_length",
    "minimum_condition_posture",
    "planar_tetrahedron",
]

_SINGULAR = 1e6
"""Condition number from which a posture is no start for a minimisation."""


class Convergence(NamedTuple):
    """The points that a minimisation went through: the start and every point that a step was taken to, k altogether.

    Newton's last step, too short to change the value, is taken without an evaluation and is not among them.

    Attributes
    ----------
    evaluations : ndarray, shape (k,)
        Evaluations of the function and its derivatives up to each point, refused steps and line searches included.
    condition_number : ndarray, shape (k,)
        kappa_F.
    gradient : ndarray, shape (k,)
        Norm of the gradient of kappa_F^2 over the joints [1/rad or 1/m]; with ``eliminate=False`` also over the
        logarithm of the length.
    """

    evaluations: F64
    condition_number: F64
    gradient: F64


@dataclass(frozen=True, eq=False)
class PostureResult:
    """A posture of minimum condition number.

    Attributes
    ----------
    q : ndarray, shape (n,)
        Joint coordinates [rad or m], brought within the limits by whole turns where that is possible.
    length : float
        Characteristic length [m].
    condition_number : float
        kappa_F, normalised: 1 when isotropic.
    iterations, evaluations : int
        Steps, and evaluations of the derivatives, of the start that was best.
    status : str
        "converged", "stalled" (rounding allows no further decrease), "out of iterations" or "singular start".
    method : str
        "newton" or "bfgs".
    within_limits : bool
        Whether the posture is within the robot's position limits, which the minimisation does not consider.
    history : Convergence
        The points that the start that was best went through.
    """

    q: F64
    length: float
    condition_number: float
    iterations: int
    evaluations: int
    status: str
    method: str
    within_limits: bool
    history: Convergence = field(repr=False)


def minimum_condition_posture(
    robot: Robot,
    q0: ArrayLike | None = None,
    length: float | None = None,
    method: Literal["newton", "bfgs"] = "newton",
    starts: int = 1,
    *,
    rows: Sequence[int] | None = None,
    length0: float | None = None,
    eliminate: bool = True,
    tolerance: float = 1e-9,
    max_iterations: int = 100,
    seed: int = 0,
    progress: bool = False,
) -> PostureResult:
    """Find the posture, and the length, of minimum condition number kappa_F (Leger 2014, 2.2 and 4.1).

    Parameters
    ----------
    robot : Robot
        The robot.
    q0 : array_like, shape (n,), optional
        First start [rad or m]. If not given, the middle of the limits (0 where there are none) or, where that is
        singular, the best of 32 random postures.
    length : float, optional
        Characteristic length [m]; if not given, it is minimised over as well.
    method : {"newton", "bfgs"}
        Trust-region Newton on the exact Hessian, or BFGS with a strong Wolfe line search.
    starts : int
        Number of starts; those after the first are random postures within the limits. The best is returned: a posture
        within limits before one outside, then the smaller condition number.
    rows : sequence of int, optional
        Rows of the Jacobian in use; all six if not given (planar robots: [2, 3, 4]).
    length0 : float, optional
        First length, where it is a variable [m]; the root mean square distance of the axes if not given.
    eliminate : bool
        Whether the length takes its best value in closed form at each posture, or is one more variable.
    tolerance : float
        Step at which the minimisation ends [rad or m].
    max_iterations : int
        Steps of one start at most.
    seed : int
        Seed of the random postures.
    progress : bool
        Whether a bar on stderr shows the progress of what takes longer than a second.

    Returns
    -------
    PostureResult
        The best of the starts.

    Raises
    ------
    ShapeError, NonFiniteError
        If ``q0`` has the wrong shape or is not finite.
    InvalidValueError
        If a setting is out of its domain or the rows cannot be used with this robot.
    """
    if starts < 1:
        raise InvalidValueError(f"starts is {starts}, expected at least 1")
    postures = robot.random_postures(max(starts, 33) - 1, seed)
    first = _first_start(robot, postures[:32], rows) if q0 is None else checked("q0", q0, (robot.n,))

    def run(start: F64) -> PostureResult:
        q, best_length, condition, iterations, evaluations, status, passed = _core.minimum_condition_posture(
            robot, start, length, length0, method, eliminate, rows, tolerance, max_iterations
        )
        q = _brought_inside(robot, q)
        within = bool(np.isfinite(q).all() and robot.within_limits(q))
        history = Convergence(*passed.T)
        return PostureResult(q, best_length, condition, iterations, evaluations, status, method, within, history)

    # The core releases the GIL, so threads are enough.
    results = []
    with ThreadPoolExecutor() as pool, progress_bar(starts, "minimising", progress) as advance:
        for result in pool.map(run, [first, *postures[: starts - 1]]):
            results.append(result)
            advance(1)
    return min(results, key=_rank)


def _rank(result: PostureResult) -> tuple[bool, bool, float]:
    singular = not np.isfinite(result.condition_number)
    return singular, not result.within_limits, result.condition_number


def _first_start(robot: Robot, others: F64, rows: Sequence[int] | None) -> F64:
    """Return the middle of the limits unless it is singular: no minimisation can leave a singularity."""
    candidates = np.vstack([robot.middle, others])
    (kappa,) = _core.ConditionNumber(rows=rows).evaluate_many(robot, candidates, 0)
    best: F64 = candidates[0 if kappa[0] < _SINGULAR else int(np.argmin(kappa))]
    return best


def _brought_inside(robot: Robot, q: F64) -> F64:
    """Bring a posture that is beyond limits back by whole turns."""
    return q if not np.isfinite(q).all() or robot.within_limits(q) else robot.turned(q)


@dataclass(frozen=True, eq=False)
class PlanarTetrahedron:
    """The condition number of a planar 3R robot as a tetrahedron (Leger 2014, eq. 2.15 to 2.21).

    Its base is the triangle of the three joints; its apex stands a length above the operation point.

    Attributes
    ----------
    edges : ndarray, shape (3, 3)
        Edges from the joints to the apex, by rows: length, x, y [m].
    volume : float
        Volume [m^3].
    faces : ndarray, shape (3,)
        Area of the face opposite to each edge [m^2].
    distances : ndarray, shape (3,)
        Distance of each joint to the face opposite to its edge [m].
    height : float
        Height: the length [m].
    condition_number : float
        kappa_F; inf where the volume is zero.
    """

    edges: F64
    volume: float
    faces: F64
    distances: F64
    height: float
    condition_number: float


def planar_tetrahedron(robot: Robot, q: ArrayLike, length: float) -> PlanarTetrahedron:
    """Return the tetrahedron of a planar 3R robot at a posture.

    Parameters
    ----------
    robot : Robot
        Three revolute joints about the base z axis.
    q : array_like, shape (3,)
        Joint coordinates [rad].
    length : float
        Height of the tetrahedron [m].

    Returns
    -------
    PlanarTetrahedron
        Its measures.

    Raises
    ------
    InvalidValueError
        If the robot is another or the length is not positive.
    """
    return PlanarTetrahedron(**_core.planar_tetrahedron(robot, q, length))
