"""Postures of minimum condition number against the thesis' FANUC (`data/leger_fanuc.json`) and an isotropic arm."""

from typing import Any, Literal

import numpy as np
import pytest
import redundancy as rd
from redundancy import _core

from tests.reference.files import read_json

ORACLE: dict[str, Any] = read_json("leger_fanuc.json")
BEST = ORACLE["minimum_condition_number"]
START = np.deg2rad([0.0, 20.0, -20.0, 0.0, -90.0, 0.0])
LENGTH0 = 0.2985933
PLANAR_ROWS = [2, 3, 4]


@pytest.fixture(scope="module")
def fanuc() -> rd.Robot:
    return rd.robots.get("fanuc_m710ic50_milling")


@pytest.mark.parametrize("eliminate", [True, False])
def test_newton_from_the_start_of_the_thesis(fanuc: rd.Robot, eliminate: bool) -> None:
    found = rd.minimum_condition_posture(fanuc, START, length0=LENGTH0, eliminate=eliminate)
    print(f"eliminate {eliminate}: {found.iterations} iterations, {found.evaluations} evaluations")
    angles = np.array(BEST["q_deg_2_to_6"], dtype=np.float64)
    np.testing.assert_allclose(np.rad2deg(found.q[1:]), angles, rtol=1e-9, atol=1e-9)
    assert found.q[0] == pytest.approx(0.0, abs=1e-12)
    assert found.length == pytest.approx(float(BEST["length_m"]), rel=1e-9)
    assert found.condition_number == pytest.approx(float(BEST["kappa_frobenius_normalised"]), rel=1e-11)
    assert found.status == "converged"
    assert found.evaluations <= 20
    # The thesis counts 238 iterations of its quasi-Newton and 67 of its Newton-Raphson method.
    assert found.iterations < 67
    # Nothing is left of the gradient, length included.
    index = rd.ConditionNumber(found.length, squared=True)
    assert np.linalg.norm(index.evaluate(fanuc, found.q, order=1, with_length=True)[1]) < 1e-9


@pytest.mark.parametrize("eliminate", [True, False])
def test_bfgs_from_the_start_of_the_thesis(fanuc: rd.Robot, eliminate: bool) -> None:
    found = rd.minimum_condition_posture(fanuc, START, method="bfgs", length0=LENGTH0, eliminate=eliminate)
    angles = np.deg2rad(np.array(BEST["q_deg_2_to_6"], dtype=np.float64))
    np.testing.assert_allclose(found.q[1:], angles, rtol=0, atol=1e-6)
    assert found.length == pytest.approx(float(BEST["length_m"]), rel=1e-6)
    assert found.condition_number == pytest.approx(float(BEST["kappa_frobenius_normalised"]), rel=1e-11)
    assert found.method == "bfgs"


@pytest.mark.parametrize("method", ["newton", "bfgs"])
def test_fixed_length(fanuc: rd.Robot, method: Literal["newton", "bfgs"]) -> None:
    best = float(BEST["length_m"])
    same = rd.minimum_condition_posture(fanuc, START, length=best, method=method)
    assert same.condition_number == pytest.approx(float(BEST["kappa_frobenius_normalised"]), rel=1e-10)
    other = rd.minimum_condition_posture(fanuc, START, length=0.3, method=method)
    assert other.length == 0.3
    assert other.condition_number > same.condition_number
    gradient = rd.ConditionNumber(0.3, squared=True).evaluate(fanuc, other.q, order=1)[1]
    assert np.linalg.norm(gradient) < 1e-6


def test_more_starts_are_never_worse(fanuc: rd.Robot) -> None:
    robots = [(fanuc, None), (rd.robots.get("ur5e"), None), (rd.robots.get("planar_3r"), PLANAR_ROWS)]
    for robot, rows in robots:
        found = [rd.minimum_condition_posture(robot, starts=n, rows=rows, seed=3) for n in (1, 4, 16)]
        # Within limits comes before outside.
        ranks = [(not f.within_limits, f.condition_number) for f in found]
        assert ranks == sorted(ranks, reverse=True)
        for f in found:
            assert f.within_limits == bool(np.all((robot.q_min <= f.q) & (f.q <= robot.q_max)))


def test_random_starts_do_not_beat_the_thesis(fanuc: rd.Robot) -> None:
    found = rd.minimum_condition_posture(fanuc, starts=60, seed=1)
    assert found.condition_number == pytest.approx(float(BEST["kappa_frobenius_normalised"]), rel=1e-10)


@pytest.mark.parametrize("eliminate", [True, False])
@pytest.mark.parametrize("method", ["newton", "bfgs"])
def test_history_goes_down_to_the_minimum(fanuc: rd.Robot, method: Literal["newton", "bfgs"], eliminate: bool) -> None:
    found = rd.minimum_condition_posture(fanuc, START, method=method, length0=LENGTH0, eliminate=eliminate)
    history = found.history
    length = rd.characteristic_length(fanuc, START) if eliminate else LENGTH0
    value, gradient = rd.ConditionNumber(length, squared=True).evaluate(fanuc, START, order=1, with_length=True)
    gradient[-1] *= length  # over the logarithm
    assert history.condition_number[0] == pytest.approx(np.sqrt(value), rel=1e-13)
    assert history.gradient[0] == pytest.approx(np.linalg.norm(gradient), rel=1e-10)
    assert history.condition_number[-1] == found.condition_number
    assert (np.diff(history.condition_number) <= 1e-14).all()
    assert history.evaluations[0] == 1
    assert (np.diff(history.evaluations) >= 1).all()
    assert history.evaluations[-1] <= found.evaluations
    assert len(history.gradient) <= found.iterations + 1
    if method == "newton":
        # Quadratic at the end: every gradient is at most a constant times the square of the one before.
        last = history.gradient[history.gradient > 1e-11]
        assert last[-1] < 1e-2 * last[-2]


@pytest.mark.parametrize("method", ["newton", "bfgs"])
def test_singular_start_is_a_status(fanuc: rd.Robot, method: Literal["newton", "bfgs"]) -> None:
    singular = np.array([0.0, 0.3, -0.3, 0.2, 0.0, 0.4])
    q, _, kappa, _, _, status, _ = _core.minimum_condition_posture(
        fanuc, singular, None, None, method, True, None, 1e-9, 100
    )
    assert status == "singular start"
    assert not np.isfinite(kappa)
    np.testing.assert_array_equal(q, singular)
    # Together with others it loses.
    found = rd.minimum_condition_posture(fanuc, singular, method=method, starts=4)
    assert found.status == "converged"


def test_out_of_iterations_is_a_status(fanuc: rd.Robot) -> None:
    found = rd.minimum_condition_posture(fanuc, START, max_iterations=1)
    assert found.status == "out of iterations"
    assert len(found.history.evaluations) <= 2
    index = rd.ConditionNumber(found.length)
    assert index.evaluate(fanuc, found.q, order=0) == pytest.approx(found.condition_number, rel=1e-12)


@pytest.mark.parametrize("eliminate", [True, False])
def test_planar_arm_with_joints_on_an_equilateral_triangle_is_isotropic(eliminate: bool) -> None:
    # Links 1, 1, 1/sqrt 3: the tool point can be the centre of the triangle of the joints.
    robot = rd.Robot.from_dh([1.0, 1.0, 1 / np.sqrt(3.0)], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    found = rd.minimum_condition_posture(robot, [0.1, 1.7, 2.3], rows=PLANAR_ROWS, eliminate=eliminate)
    assert found.condition_number == pytest.approx(1.0, abs=1e-12)
    assert found.length == pytest.approx(1 / np.sqrt(6.0), rel=1e-6)
    np.testing.assert_allclose(found.q[1:], [2 * np.pi / 3, 5 * np.pi / 6], atol=1e-6)
    assert rd.rms_length(robot, found.q) == pytest.approx(found.length * np.sqrt(2.0), rel=1e-6)


@pytest.mark.parametrize("name", ["puma500", "panda", "stanford_arm", "ur10e"])
def test_other_robots_end_at_a_minimum(name: str) -> None:
    robot = rd.robots.get(name)
    found = rd.minimum_condition_posture(robot, starts=6)
    index = rd.ConditionNumber(found.length, squared=True)
    value, gradient, hessian = index.evaluate(robot, found.q, with_length=True)
    assert np.linalg.norm(gradient) < 1e-6 * value
    assert np.linalg.eigvalsh(hessian).min() > -1e-8 * value
    assert found.condition_number == pytest.approx(np.sqrt(value), rel=1e-12)


def test_rows_without_both_units_need_a_length() -> None:
    robot = rd.robots.get("planar_3r")
    with pytest.raises(rd.InvalidValueError, match="length"):
        rd.minimum_condition_posture(robot, [0.1, 0.5, 0.7], rows=[3, 4])
    found = rd.minimum_condition_posture(robot, [0.1, 0.5, 0.7], rows=[3, 4], length=1.0)
    assert found.condition_number == pytest.approx(1.0, abs=1e-9)
