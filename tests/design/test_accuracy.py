"""The bounds (1.10) against random rates with random errors, and against the worst ones."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.reference.chain import F64, Chain, chains

PLANAR = [2, 3, 4]


def ratios(normalised: F64, rates: F64, errors: F64) -> F64:
    """Relative error of the twist over that of the rates."""
    norm = np.linalg.norm
    twists, missed = normalised @ rates, normalised @ errors
    found: F64 = norm(missed, axis=0) / norm(twists, axis=0) / (norm(errors, axis=0) / norm(rates, axis=0))
    return found


@given(chains(least=6, most=8), st.floats(0.1, 2.0), st.integers(0, 2**32 - 1))
def test_bounds_hold_and_are_attained(drawn: tuple[Chain, F64], length: float, seed: int) -> None:
    chain, q = drawn
    normalised = chain.derivatives(q)[0] * np.repeat([length, 1.0], 3)[:, None]
    _, sigma, right = np.linalg.svd(normalised, full_matrices=False)
    assume(sigma[-1] > 1e-4 * sigma[0])
    lower, upper = rd.error_bounds(chain.robot(), q, length)
    wide_lower, wide_upper = rd.error_bounds(chain.robot(), q, length, norm="frobenius")
    rng = np.random.default_rng(seed)
    # The shortest rates of random twists and errors of twists.
    rates, errors = (np.linalg.pinv(normalised) @ rng.normal(size=(6, 500)) for _ in range(2))
    found = ratios(normalised, rates, errors)
    assert (found <= upper * (1 + 1e-9)).all()
    assert (found >= lower * (1 - 1e-9)).all()
    assert wide_lower < lower
    assert wide_upper > upper
    worst = ratios(normalised, right[-1][:, None], right[:1].T)
    best = ratios(normalised, right[:1].T, right[-1][:, None])
    assert worst[0] == pytest.approx(upper, rel=1e-8)
    assert best[0] == pytest.approx(lower, rel=1e-8)


def test_normalised_condition_number_is_no_bound() -> None:
    """(1.10) asks for a norm that goes with that of vectors, which (2.14) does not: it is 1 for the unit matrix."""
    robot = rd.robots.get("fanuc_m710ic50_milling")
    q = np.deg2rad([0.0, 20.0, -20.0, 0.0, -90.0, 0.0])
    normalised = robot.jacobian(q) * np.repeat([0.4852, 1.0], 3)[:, None]
    right = np.linalg.svd(normalised)[2]
    worst = ratios(normalised, right[-1:].T, right[:1].T)[0]
    kappa = rd.ConditionNumber(0.4852).evaluate(robot, q, 0)
    assert worst > 1.5 * kappa
    assert worst < rd.error_bounds(robot, q, 0.4852, norm="frobenius")[1] == pytest.approx(6.0 * kappa)
    assert rd.error_bounds(robot, q, 0.4852, norm="frobenius")[1] == pytest.approx(np.linalg.cond(normalised, "fro"))


def test_a_batch_is_its_postures() -> None:
    robot = rd.robots.get("panda")
    q = robot.random_postures(7, seed=1)
    lower, upper = rd.error_bounds(robot, q, 0.4)
    assert lower.shape == upper.shape == (7,)
    single = [rd.error_bounds(robot, posture, 0.4) for posture in q]
    np.testing.assert_allclose(lower, [bounds[0] for bounds in single], rtol=1e-14)
    np.testing.assert_allclose(upper, [bounds[1] for bounds in single], rtol=1e-14)


def test_planar_robot_at_an_isotropic_posture() -> None:
    robot = rd.Robot.from_dh([1.0, 1.0, 1 / np.sqrt(3.0)], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    lower, upper = rd.error_bounds(robot, [0.4, 2 * np.pi / 3, 5 * np.pi / 6], 1 / np.sqrt(6.0), rows=PLANAR)
    assert lower == pytest.approx(1.0, abs=1e-12)
    assert upper == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("norm", ["spectral", "frobenius"])
def test_nothing_is_bound_at_a_singularity(norm: str) -> None:
    robot = rd.Robot.from_dh([1.0, 1.0, 1.0], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    q = np.array([[0.1, 0.0, 0.0], [0.1, 1.0, 0.5]])
    lower, upper = rd.error_bounds(robot, q, 0.5, norm=norm, rows=PLANAR)  # type: ignore[arg-type]
    assert (lower[0], upper[0]) == (0.0, np.inf)
    assert 0.0 < lower[1] < 1.0 < upper[1] < np.inf


def test_wrong_input() -> None:
    robot = rd.robots.get("panda")
    with pytest.raises(rd.InvalidValueError, match="length"):
        rd.error_bounds(robot, np.zeros(7), -1.0)
    with pytest.raises(rd.InvalidValueError, match="norm"):
        rd.error_bounds(robot, np.zeros(7), 1.0, norm="nuclear")  # type: ignore[arg-type]
    with pytest.raises(rd.ShapeError):
        rd.error_bounds(robot, np.zeros(6), 1.0)
