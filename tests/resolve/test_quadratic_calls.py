"""Calls of a quadratic programme: arrays in and out, wrong arguments, threads, objectives that run Python."""

import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64
from tests.resolve.test_quadratic import MANIPULABILITY, PANDA, QUICK, TWIST, Q, posture


def test_out() -> None:
    solver = rd.QuadraticProgram(QUICK, rd.Task.full())
    out = np.full(7, np.nan)
    assert solver.step(Q, TWIST, out) is out
    np.testing.assert_array_equal(out, rd.QuadraticProgram(QUICK, rd.Task.full()).step(Q, TWIST))
    # The posture itself may receive the rates.
    q = Q.copy()
    solver.reset()
    np.testing.assert_array_equal(solver.step(q, TWIST, q), out)
    for wrong in (np.zeros(6), np.zeros(7, np.float32), np.zeros(14)[::2], np.zeros((1, 7)), [0.0] * 7):
        with pytest.raises(rd.ShapeError, match="out"):
            solver.step(Q, TWIST, wrong)  # type: ignore[arg-type]
    out.flags.writeable = False
    with pytest.raises(rd.ShapeError, match="read-only"):
        solver.step(Q, TWIST, out)


def test_any_layout_of_the_arrays() -> None:
    solver = rd.QuadraticProgram(QUICK, rd.Task.full())
    rows = np.random.default_rng(0).standard_normal((3, 7))
    wanted = solver.step(Q, TWIST, rows=rows, lower=np.zeros(3))
    spread = np.repeat(Q, 2)[::2], np.repeat(TWIST, 3)[::3]
    solver.reset()
    np.testing.assert_array_equal(solver.step(*spread, rows=np.asfortranarray(rows), lower=np.zeros(6)[::2]), wanted)
    solver.reset()
    np.testing.assert_array_equal(solver.step(Q.tolist(), TWIST.tolist(), rows=rows.tolist(), lower=[0, 0, 0]), wanted)
    still = Q.copy()
    still.flags.writeable = False
    solver.reset()
    np.testing.assert_array_equal(solver.step(still, TWIST, rows=rows, lower=np.zeros(3)), wanted)


@pytest.mark.parametrize(
    ("q", "twist", "change", "error"),
    [
        (Q[:6], TWIST, {}, rd.ShapeError),
        (Q[None], TWIST, {}, rd.ShapeError),
        (Q, TWIST[:5], {}, rd.ShapeError),
        (Q * np.nan, TWIST, {}, rd.NonFiniteError),
        (Q, TWIST * np.inf, {}, rd.NonFiniteError),
        ("posture", TWIST, {}, rd.InvalidValueError),
        (Q, TWIST, {"stiffness": 0.0}, rd.InvalidValueError),
        (Q, TWIST, {"stiffness": np.nan}, rd.InvalidValueError),
        (Q, TWIST, {"rates": np.zeros(6)}, rd.ShapeError),
        (Q, TWIST, {"rates": np.full(7, np.nan)}, rd.NonFiniteError),
        (Q, TWIST, {"lower": [0.0]}, rd.InvalidValueError),
        (Q, TWIST, {"rows": np.zeros(7)}, rd.ShapeError),
        (Q, TWIST, {"rows": np.zeros((1, 6))}, rd.ShapeError),
        (Q, TWIST, {"rows": np.zeros((33, 7))}, rd.InvalidValueError),
        (Q, TWIST, {"rows": np.full((1, 7), np.inf)}, rd.NonFiniteError),
        (Q, TWIST, {"rows": np.ones((1, 7)), "upper": [1.0, 2.0]}, rd.ShapeError),
        (Q, TWIST, {"rows": np.ones((1, 7)), "upper": [np.nan]}, rd.NonFiniteError),
    ],
)
def test_bad_steps_change_nothing(q: Any, twist: F64, change: dict[str, Any], error: type[Exception]) -> None:
    solver = rd.QuadraticProgram(PANDA, rd.Task.full())
    solver.step(Q, TWIST)
    before = solver.deviation
    with pytest.raises(error):
        solver.step(q, twist, **change)
    np.testing.assert_array_equal(solver.deviation, before)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"weight": -1.0}, rd.InvalidValueError),
        ({"weight": np.nan}, rd.NonFiniteError),
        ({"form": "square"}, rd.InvalidValueError),
        ({"derivatives": "guess"}, rd.InvalidValueError),
        ({"rate_weights": 0.0}, rd.InvalidValueError),
        ({"rate_weights": [1.0, 2.0]}, rd.ShapeError),
        ({"rate_weights": np.full(7, np.nan)}, rd.InvalidValueError),
        ({"stiffness": np.inf}, rd.InvalidValueError),
        ({"largest_deviation": (-1.0, 1.0)}, rd.InvalidValueError),
        ({"largest_deviation": (np.nan, 1.0)}, rd.InvalidValueError),
        ({"length": 0.0}, rd.InvalidValueError),
        ({"dt": 0.0}, rd.InvalidValueError),
        ({"tolerance": -1.0}, rd.InvalidValueError),
        ({"objective": 3}, TypeError),
    ],
)
def test_bad_settings(change: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        rd.QuadraticProgram(PANDA, rd.Task.full(), **({"objective": MANIPULABILITY} | change))


def test_threads_of_their_own_and_together() -> None:
    rng = np.random.default_rng(9)
    work = [(posture(PANDA, rng), rng.uniform(-1.0, 1.0, 6)) for _ in range(300)]
    objective = rd.ConditionNumber(0.5, squared=True)

    def alone(item: tuple[F64, F64]) -> F64:
        return rd.QuadraticProgram(QUICK, rd.Task.axisymmetric(), objective).step(*item)

    wanted = [alone(item) for item in work]
    with ThreadPoolExecutor(4) as pool:
        for got, want in zip(pool.map(alone, work), wanted, strict=True):
            np.testing.assert_array_equal(got, want)
        # One object: nothing is remembered that changes an answer but for rounding, nothing hangs, nothing is torn.
        shared = rd.QuadraticProgram(QUICK, rd.Task.axisymmetric(), objective)
        for got, want in zip(pool.map(lambda item: shared.step(*item), work), wanted, strict=True):
            np.testing.assert_allclose(got, want, rtol=0, atol=1e-8)


def test_a_step_within_an_objective_of_python() -> None:
    # An index that runs Python lets other threads in, which may use the same programme.
    def index(q: F64) -> float:
        return float(q @ q)

    solver = rd.QuadraticProgram(QUICK, rd.Task.position(), rd.CustomIndex(index))
    answers: list[F64] = []
    threads = [threading.Thread(target=lambda: answers.append(solver.step(Q, TWIST)), daemon=True) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20.0)
    assert len(answers) == 8
    for answer in answers:
        np.testing.assert_allclose(answer, answers[0], rtol=0, atol=1e-8)


def test_an_error_of_the_objective_arrives() -> None:
    def index(q: F64) -> float:
        raise RuntimeError("no value")

    with pytest.raises(RuntimeError, match="no value"):
        rd.QuadraticProgram(PANDA, rd.Task.full(), rd.CustomIndex(index)).step(Q, TWIST)


@pytest.mark.parametrize("limits", [{"lower": [np.inf]}, {"upper": [-np.inf]}])
def test_infinite_limits_on_the_wrong_side(limits: dict[str, list[float]]) -> None:
    solver = rd.QuadraticProgram(QUICK, rd.Task.full())
    try:
        solver.step(Q, TWIST, rows=np.ones((1, 7)), lower=limits.get("lower"), upper=limits.get("upper"))
    except rd.RedundancyError:
        return
    assert solver.failed == ["row 0"]


WITHIN = """
import numpy as np
import redundancy as rd

robot = rd.robots.get("panda")
scene = rd.Scene(robot, rd.capsules_along_links(robot, 0.05), {"ball": rd.Shape.sphere(0.05)})
scene.place("ball", [0.5, 0.2, 0.5])
index = rd.CustomIndex(lambda q: -scene.distance(q))
program = rd.QuadraticProgram(robot, rd.Task.position(), index, scene=scene)
print(np.isfinite(program.step([0.1, 0.2, -0.3, -1.4, 0.2, 1.6, 0.4], np.zeros(6))).all())
"""


def test_an_objective_may_ask_the_scene_of_its_own_programme() -> None:
    # In a process of its own: what waits for a lock while it holds Python's cannot be interrupted.
    done = subprocess.run([sys.executable, "-c", WITHIN], capture_output=True, text=True, timeout=60.0, check=True)
    assert done.stdout.strip() == "True"
