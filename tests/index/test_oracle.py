"""Condition number with gradient and Hessian, in joints and length, against multiple-precision references.

The references are `data/condition_number.json` (34 postures of five robots, 12 digits or more),
`data/condition_random.npz` (1000 postures of random robots, 50 digits and more, rounded) and, live, the program that
made the latter. An error is the norm of the difference over the norm of the reference, divided by 2.22e-16 kappa: what
rounding the joint angles alone costs.
"""

import json
from collections.abc import Callable
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pytest
from numpy.typing import NDArray
from redundancy import ConditionNumber, Robot

from tests.reference.condition.index import reference
from tests.reference.files import DATA

F64: TypeAlias = NDArray[np.float64]

SQUARE = np.array([10.0, 20.0, 40.0])
REDUNDANT = np.array([20.0, 40.0, 100.0])
LIVE = range(50, 1000, 95)


class Case(NamedTuple):
    """A posture and its reference: kappa, and gradient and Hessian of its square over (q, L)."""

    robot: Robot
    rows: list[int]
    length: float
    q: F64
    kappa: float
    gradient: F64
    hessian: F64


def _json_case(case: dict[str, Any]) -> Case:
    model = case["model"]
    table: dict[str, Any] = {key: np.array(model[key], dtype=np.float64) for key in ("a", "d", "alpha", "theta")}
    tool = np.eye(4)
    tool[:3, 3] = np.array(model.get("tool_offset", (0, 0, 0)), dtype=np.float64)
    robot = Robot.from_dh(**table, joints=model["joints"], tool=tool, name=case["robot"])
    q, gradient, hessian = (np.array(case[key], dtype=np.float64) for key in ("q", "grad", "hess"))
    return Case(robot, model["rows"], float(case["L"]), q, float(case["kappa"]), gradient, hessian)


def _npz_case(data: dict[str, NDArray[Any]], i: int) -> Case:
    n = int(data["n"][i])
    table: dict[str, Any] = {key: data[key][i, :n] for key in ("a", "d", "alpha", "theta")}
    robot = Robot.from_dh(**table, joints="".join(data["joints"][i, :n]))
    rows = np.flatnonzero(data["rows"][i]).tolist()
    values = data["gradient"][i, : n + 1], data["hessian"][i, : n + 1, : n + 1]
    return Case(robot, rows, float(data["length"][i]), data["q"][i, :n], float(data["kappa"][i]), *values)


def _errors(case: Case) -> F64:
    """Errors of value, gradient and Hessian in units of 2.22e-16 kappa."""
    index = ConditionNumber(case.length, rows=case.rows, squared=True)
    value, gradient, hessian = index.evaluate(case.robot, case.q, order=2, with_length=True)
    relative = [
        abs(np.sqrt(value) - case.kappa) / case.kappa,
        np.linalg.norm(gradient - case.gradient) / np.linalg.norm(case.gradient),
        np.linalg.norm(hessian - case.hessian) / np.linalg.norm(case.hessian),
    ]
    return np.array(relative) / (np.finfo(np.float64).eps * case.kappa)


@pytest.fixture(scope="module")
def postures() -> list[Case]:
    document = json.loads((DATA / "condition_number.json").read_text(encoding="utf-8"))
    return [_json_case(case) for case in document["cases"]]


@pytest.fixture(scope="module")
def random_data() -> dict[str, NDArray[Any]]:
    with np.load(DATA / "condition_random.npz") as archive:
        return {key: archive[key] for key in archive.files}


def _check(cases: list[Case], record: Callable[[str, object], None]) -> None:
    errors = np.array([_errors(case) for case in cases])
    square = np.array([len(case.rows) == case.robot.n for case in cases])
    for label, chosen, bound in (("square", square, SQUARE), ("redundant", ~square, REDUNDANT)):
        worst = errors[chosen].max(axis=0)
        record(label, [round(float(x), 2) for x in worst])
        print(f"{label}: worst value, gradient, Hessian {worst.round(2)}, bounds {bound}, {chosen.sum()} postures")
        over = [(i, errors[i].round(1), cases[i].kappa) for i in np.flatnonzero(chosen) if (errors[i] > bound).any()]
        assert not over, f"{len(over)} {label} postures beyond {bound}: {over[:8]}"


def test_postures_of_known_robots(postures: list[Case], record_property: Callable[[str, object], None]) -> None:
    assert max(case.kappa for case in postures) > 1e6
    _check(postures, record_property)


def test_postures_of_random_robots(
    random_data: dict[str, NDArray[Any]], record_property: Callable[[str, object], None]
) -> None:
    cases = [_npz_case(random_data, i) for i in range(1000)]
    assert {case.robot.n for case in cases} == set(range(3, 10))
    assert max(case.kappa for case in cases) > 1e6
    _check(cases, record_property)


def test_no_gradient_is_lost_in_the_value(random_data: dict[str, NDArray[Any]]) -> None:
    # Relative errors mean something only where the derivatives are not tiny beside kappa^2.
    size = np.sqrt(np.nansum(random_data["gradient"] ** 2, axis=1)) / random_data["kappa"] ** 2
    print(f"smallest gradient norm over kappa^2 {size.min():.3g}")
    assert size.min() > 1e-3


@pytest.mark.parametrize("i", LIVE)
def test_file_is_what_the_reference_computes(random_data: dict[str, NDArray[Any]], i: int) -> None:
    case = _npz_case(random_data, i)
    table = case.robot.dh
    assert table is not None
    columns: dict[str, Any] = {key: table[key].tolist() for key in ("a", "d", "alpha", "theta")}
    live = reference(**columns, joints=case.robot.joints, q=case.q.tolist(), length=case.length, rows=case.rows)
    np.testing.assert_allclose(live.kappa, case.kappa, rtol=1e-15)
    np.testing.assert_allclose(live.gradient, case.gradient, rtol=1e-15, atol=1e-30)
    np.testing.assert_allclose(live.hessian, case.hessian, rtol=1e-15, atol=1e-30)
    bound = SQUARE if len(case.rows) == case.robot.n else REDUNDANT
    assert (_errors(case._replace(kappa=live.kappa, gradient=live.gradient, hessian=live.hessian)) <= bound).all()
