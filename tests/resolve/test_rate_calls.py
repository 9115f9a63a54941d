"""Calls of the methods at the level of rates: arrays, wrong arguments, exceptions, other objectives, threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import redundancy as rd

from tests.resolve.rates import AXIAL, F64, FANUC, METHODS, NAN, TORCH, TWIST, Q, circle


@pytest.mark.parametrize("name", METHODS)
def test_out_is_filled_and_returned(name: str) -> None:
    solver = METHODS[name](FANUC, rd.Task.axisymmetric(), rd.JointLimits())
    wanted = solver.step(Q, TWIST)
    assert wanted.shape == (6,)
    out = np.full(6, np.nan)
    assert solver.step(Q, TWIST, out=out) is out
    np.testing.assert_array_equal(out, wanted)
    q = Q.copy()
    assert solver.step(q, TWIST, out=q) is q
    np.testing.assert_array_equal(q, wanted)


def _locked() -> F64:
    out = np.full(6, 7.0)
    out.setflags(write=False)
    return out


S = rd.TwistDecomposition(FANUC, rd.Task.axisymmetric(), rd.JointLimits())
TALL = rd.Robot.from_dh(a=[0.1] * 16, d=[0.0] * 16, alpha=[0.3] * 16, theta=[0.0] * 16)
WRONG: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "short q": (lambda: S.step(Q[:5], TWIST), rd.ShapeError, r"q: got shape \(5,\), expected \(6,\)"),
    "many q": (lambda: S.step([Q, Q], TWIST), rd.ShapeError, r"q: got shape \(2, 6\), expected \(6,\)"),
    "NaN q": (lambda: S.step([0, 0, NAN, 0, 0, 0], TWIST), rd.NonFiniteError, r"q\[2\] is NaN"),
    "short twist": (lambda: S.step(Q, TWIST[:3]), rd.ShapeError, r"twist: got shape \(3,\)"),
    "infinite twist": (lambda: S.step(Q, [0, 0, 0, 0, np.inf, 0]), rd.NonFiniteError, r"twist\[4\] is inf"),
    "text": (lambda: S.step("q", TWIST), rd.InvalidValueError, "q is 'q'"),
    "locked out": (lambda: S.step(Q, TWIST, out=_locked()), rd.ShapeError, "read-only"),
    "short out": (lambda: S.step(Q, TWIST, out=np.zeros(5)), rd.ShapeError, r"out: got shape \(5,\)"),
    "narrow out": (lambda: S.step(Q, TWIST, out=np.zeros(6, np.float32)), rd.ShapeError, "out"),
    "short target": (lambda: S.solve([1, 0, 0, 1, 0]), rd.ShapeError, r"target: got shape \(5,\)"),
    "no axis": (lambda: S.solve([1, 0, 0, 0, 0, 0], Q), rd.InvalidValueError, "axis is"),
    "short q0": (lambda: S.solve([1, 0, 0, 0, 0, 1], Q[:5]), rd.ShapeError, r"q0: got shape \(5,\)"),
    "NaN targets": (lambda: S.follow_chunk([[NAN, 0, 0, 0, 0, 1]], Q), rd.NonFiniteError, r"targets\[0\] is NaN"),
    "objective": (lambda: S.with_objective(3), TypeError, "got <class 'int'>, expected an Objective"),  # type: ignore[arg-type]
    "function": (lambda: rd.TwistDecomposition(FANUC, AXIAL, lambda q: 0.0), TypeError, "function"),  # type: ignore[arg-type]
    "short w": (lambda: S.with_objective(rd.PosturePull([1] * 5)), rd.ShapeError, r"w: got shape \(5,\)"),
    "short k": (lambda: S.with_objective(rd.PosturePull([1] * 6, [1] * 7)), rd.ShapeError, r"k: got shape \(7,\)"),
    "middle": (
        lambda: S.with_objective(rd.PosturePull([1] * 6, middle=[0.0])),
        rd.ShapeError,
        r"middle: got shape \(1,\)",
    ),
    "one w": (lambda: rd.PosturePull(1.0), rd.ShapeError, r"w: got shape \(\)"),
    "NaN w": (lambda: rd.PosturePull([1, NAN]), rd.NonFiniteError, r"w\[1\] is NaN"),
    "NaN k": (lambda: rd.PosturePull([1], [NAN]), rd.NonFiniteError, r"k\[0\] is NaN"),
    "threshold": (lambda: rd.PosturePull([1], threshold=0.0), rd.InvalidValueError, "threshold is 0"),
    "pull length": (lambda: rd.PosturePull([1], length=-2.0), rd.InvalidValueError, "length is -2"),
    "scaling": (lambda: rd.Householder(FANUC, AXIAL, scaling="x"), rd.InvalidValueError, 'scaling is "x"'),  # type: ignore[arg-type]
    "gain": (lambda: rd.Householder(FANUC, AXIAL, gain=-1.0), rd.InvalidValueError, "gain is -1"),
    "relaxation": (lambda: rd.Householder(FANUC, AXIAL, relaxation=NAN), rd.InvalidValueError, "relaxation is NaN"),
    "length": (lambda: rd.Householder(FANUC, AXIAL, length=0.0), rd.InvalidValueError, "length is 0"),
    "damping": (lambda: rd.Householder(FANUC, AXIAL, damping=1.0), rd.InvalidValueError, "damping is 1"),
    "dt": (lambda: rd.Householder(FANUC, AXIAL, dt=np.inf), rd.InvalidValueError, "dt is inf"),
    "iterations": (lambda: rd.Householder(FANUC, AXIAL, iterations=0), rd.InvalidValueError, "iterations is 0"),
    "negative stop": (lambda: rd.Householder(FANUC, AXIAL, stop=-1e-3), rd.InvalidValueError, r"stop is -0\.001"),
    "NaN stop": (lambda: rd.VirtualJoint(FANUC, AXIAL, stop=NAN), rd.InvalidValueError, "stop is NaN"),
    "tolerance": (lambda: rd.Householder(FANUC, AXIAL, tolerance=NAN), rd.InvalidValueError, "tolerance is NaN"),
    "weights": (
        lambda: rd.WeightedInverse(FANUC, AXIAL, weights=[1.0] * 5),
        rd.ShapeError,
        r"weights: got shape \(5,\)",
    ),
    "no weight": (lambda: rd.WeightedInverse(FANUC, AXIAL, weights=[1, 1, 1, 1, 1, -2]), rd.InvalidValueError, "-2"),
    "NaN weight": (
        lambda: rd.WeightedInverse(FANUC, AXIAL, weights=[1, 1, 1, NAN, 1, 1]),
        rd.NonFiniteError,
        r"weights\[3\]",
    ),
    "no room": (lambda: rd.VirtualJoint(TALL, AXIAL), rd.InvalidValueError, "16 joints and 1 virtual"),
    "base class": (lambda: rd.RateSolver(), TypeError, "RateSolver"),
}


@pytest.mark.parametrize("case", WRONG)
def test_bad_input(case: str) -> None:
    call, kind, message = WRONG[case]
    with pytest.raises(kind, match=message) as caught:
        call()
    assert type(caught.value) is kind


def test_locked_out_stays_what_it_was() -> None:
    out = _locked()
    with pytest.raises(rd.ShapeError):
        S.step(Q, TWIST, out=out)
    assert (out == 7.0).all()


@pytest.mark.parametrize("name", [name for name in METHODS if name != "ResolvedRate"])
def test_exception_of_an_objective_reaches_the_caller(name: str) -> None:
    broken = True

    def index(q: F64) -> tuple[float, F64]:
        if broken:
            raise LookupError("of the callable")
        return 0.5 * float(q @ q), q

    solver = METHODS[name](FANUC, AXIAL, rd.CustomIndex(index))
    with pytest.raises(LookupError, match="of the callable"):
        solver.step(Q, TWIST)
    with pytest.raises(LookupError, match="of the callable"):
        solver.follow_chunk([[1.0, 0.0, 0.5, 0.0, 0.0, 1.0]], Q)
    broken = False
    # It is gone with the call that raised it.
    pull = METHODS[name](FANUC, AXIAL, rd.PosturePull(np.ones(6), middle=np.zeros(6)))
    np.testing.assert_allclose(solver.step(Q, TWIST), pull.step(Q, TWIST), rtol=0, atol=1e-13)


def test_with_objective() -> None:
    for name, method in METHODS.items():
        index = rd.ConditionNumber(0.4)
        solver = method(FANUC, AXIAL, index, gain=2.0, limits=False)
        assert solver.length == 0.4
        plain = solver.with_objective()
        assert isinstance(plain, rd.RateSolver)
        assert plain.objective is None
        assert plain.task == solver.task
        assert plain.robot is solver.robot
        assert solver.objective is index
        np.testing.assert_array_equal(
            plain.step(Q, TWIST), method(FANUC, AXIAL, length=0.4, limits=False).step(Q, TWIST)
        )
        other = plain.with_objective(rd.JointLimits())
        wanted = method(FANUC, AXIAL, rd.JointLimits(), gain=2.0, length=0.4, limits=False)
        np.testing.assert_array_equal(other.step(Q, TWIST), wanted.step(Q, TWIST))
        assert name == type(solver).__name__


def run(solver: rd.RateSolver, seed: int, ticks: int = 2000) -> F64:
    rng = np.random.default_rng(seed)
    q, out = Q.copy(), np.empty(6)
    for _ in range(ticks):
        q = q + 1e-3 * solver.step(q, rng.uniform(-0.5, 0.5, 6), out=out)
    return q


def test_two_threads_with_two_solvers() -> None:
    def solvers() -> list[rd.RateSolver]:
        pull = rd.PosturePull(np.full(6, 0.1), np.full(6, 0.1), threshold=2.0)
        return [
            rd.TwistDecomposition(FANUC, AXIAL, pull),
            rd.VirtualJoint(FANUC, AXIAL, rd.CustomIndex(lambda q: (q @ q, 2 * q))),
        ]

    alone = [run(solver, seed) for seed, solver in enumerate(solvers())]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(run, solvers(), range(2)))
    np.testing.assert_array_equal(together, alone)


def test_two_threads_with_one_solver() -> None:
    # Without a memory there is nothing to share.
    solver = rd.TwistDecomposition(FANUC, AXIAL, rd.JointLimits())
    alone = [run(solver, seed) for seed in range(2)]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(run, [solver, solver], range(2)))
    np.testing.assert_array_equal(together, alone)
    path = circle()
    with ThreadPoolExecutor(2) as pool:
        steps = [rd.GradientProjection(TORCH, AXIAL, rd.JointLimits(), relaxation=0.1)] * 4
        found = list(pool.map(lambda step: rd.follow(step, path, progress=False).q, steps))
    for q in found[1:]:
        np.testing.assert_array_equal(q, found[0])
