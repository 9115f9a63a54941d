"""The reference against differences of another formula, and against recorded cases."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mpmath

from tests.reference.condition.cases import make_case
from tests.reference.condition.chain import ExactArray, Number, Robot, as_mpf, geometric_jacobian, zeros
from tests.reference.condition.index import kappa_squared, reference_exact


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
        x = [as_mpf(value) for value in q] + [as_mpf(robot.length)]

        def value(*moves: tuple[int, int]) -> Any:
            y = list(x)
            for index, sign in moves:
                y[index] = y[index] + sign * h
            return kappa_squared(robot, geometric_jacobian(robot, y[:n]), y[n])

        centre = value()
        gradient = zeros(n + 1)
        hessian = zeros(n + 1, n + 1)
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
            gradient, hessian = zeros(size), zeros(size, size)
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
