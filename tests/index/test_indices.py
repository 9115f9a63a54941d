"""Every index: values against numpy's SVD and determinants, gradients and Hessians against central differences."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from redundancy import (
    ConditionNumber,
    CustomIndex,
    JointLimits,
    LimitBarrier,
    Manipulability,
    Objective,
    Robot,
    SingularityParameter,
    SmallestSingularValue,
    robots,
)
from redundancy.errors import InvalidValueError

from tests.reference.chain import F64, Chain, chains, random_columns, random_frame
from tests.reference.differences import sweep

ALL = [0, 1, 2, 3, 4, 5]


def _spectral(**given: Any) -> Objective:
    return ConditionNumber(norm="spectral", **given)


KINDS: dict[str, Callable[..., Objective]] = {
    "condition": ConditionNumber,
    "spectral": _spectral,
    "manipulability": Manipulability,
    "smallest": SmallestSingularValue,
    "singularity": SingularityParameter,
}


def normalised(robot: Robot, q: F64, length: float, rows: list[int]) -> F64:
    """The rows in use, the angular ones times the length."""
    scaled: F64 = robot.jacobian(q) * np.repeat([length, 1.0], 3)[:, None]
    return scaled[rows]


def expected(kind: str, sigma: F64) -> float:
    """The index from the singular values."""
    product = float(np.prod(sigma))
    found: dict[str, float] = {
        "condition": float(np.sqrt(np.sum(sigma**2) * np.sum(sigma**-2.0)) / sigma.size),
        "spectral": sigma[0] / sigma[-1],
        "manipulability": product,
        "smallest": sigma[-1],
        "singularity": float(np.sqrt(sigma[0] / sigma[-1] / product)),
    }
    return found[kind]


@st.composite
def postures(draw: st.DrawFn) -> tuple[Robot, F64, list[int], float, F64]:
    """A robot, a well-conditioned posture, rows, a length and the singular values, which are apart."""
    chain, q = draw(chains(least=2, most=9))
    rows = sorted(draw(st.sets(st.sampled_from(ALL), min_size=1, max_size=min(6, chain.n))))
    length = draw(st.floats(0.2, 2.0))
    robot = chain.robot()
    sigma: F64 = np.asarray(np.linalg.svd(normalised(robot, q, length, rows), compute_uv=False), dtype=np.float64)
    assume(sigma[0] < 100 * sigma[-1])
    # A single row that nothing moves has one singular value: rounding.
    assume(sigma[-1] > 1e-6)
    assume(np.all(np.abs(np.diff(sigma)) > 0.03 * sigma[0]))
    return robot, q, rows, length, sigma


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("squared", [False, True])
@hypothesis_settings(max_examples=60)
@given(posture=postures())
def test_value_gradient_and_hessian(
    kind: str, squared: bool, posture: tuple[Robot, F64, list[int], float, F64]
) -> None:
    robot, q, rows, length, sigma = posture
    index = KINDS[kind](length=length, rows=rows, squared=squared)
    value, gradient, hessian = index.evaluate(robot, q, with_length=True)
    np.testing.assert_allclose(value, expected(kind, sigma) ** (2 if squared else 1), rtol=1e-11)
    assert index.status(robot, q) == "regular"

    def slope(x: F64) -> F64:
        return index.with_length(float(x[-1])).evaluate(robot, x[:-1], order=1, with_length=True)[1]

    def height(x: F64) -> float:
        return index.with_length(float(x[-1])).evaluate(robot, x[:-1], order=0)

    x = np.append(q, length)
    assert sweep(height, x, gradient) < 1e-7
    assert sweep(slope, x, hessian) < 1e-7
    np.testing.assert_array_equal(hessian, hessian.T)
    # Lower orders, and no length, are the same numbers left out.
    assert index.evaluate(robot, q, order=0) == pytest.approx(value, rel=1e-14)
    alone = index.evaluate(robot, q)
    np.testing.assert_allclose(alone[1], gradient[:-1], rtol=1e-12, atol=1e-12 * abs(gradient).max())
    np.testing.assert_allclose(alone[2], hessian[:-1, :-1], rtol=1e-12, atol=1e-12 * abs(hessian).max())


@given(chains(least=6, most=8), st.integers(0, 2**32 - 1), st.floats(-3, 3))
def test_no_index_changes_with_the_base_or_a_vertical_first_joint(
    drawn: tuple[Chain, F64], seed: int, turn: float
) -> None:
    chain, q = drawn
    robot = chain.robot()
    moved = robot.with_base(random_frame(np.random.default_rng(seed)))
    sigma = np.linalg.svd(normalised(robot, q, 0.5, ALL), compute_uv=False)
    assume(sigma[-1] > 1e-3 * sigma[0])
    for kind, make in KINDS.items():
        index = make(length=0.5)
        value = index.evaluate(robot, q, order=0)
        assert index.evaluate(moved, q, order=0) == pytest.approx(value, rel=1e-10), kind
        turned = q.copy()
        turned[0] += turn
        assert index.evaluate(robot, turned, order=0) == pytest.approx(value, rel=1e-10), kind


@given(postures())
def test_norms_bound_each_other(posture: tuple[Robot, F64, list[int], float, F64]) -> None:
    robot, q, rows, length, sigma = posture
    frobenius = ConditionNumber(length, rows=rows).evaluate(robot, q, order=0)
    spectral = ConditionNumber(length, norm="spectral", rows=rows).evaluate(robot, q, order=0)
    m = sigma.size
    assert 1 - 1e-12 <= frobenius <= spectral * (1 + 1e-12)
    assert spectral <= m * frobenius * (1 + 1e-12)


def test_manipulability_of_six_joints_is_the_determinant() -> None:
    chain = Chain(*random_columns(4, 6), joints="RRRRRR")
    q = np.linspace(-1, 1, 6)
    wanted = abs(np.linalg.det(chain.derivatives(q)[0]))
    assert Manipulability().evaluate(chain.robot(), q, order=0) == pytest.approx(wanted, rel=1e-12)


LIMITED = Robot.from_dh(
    *random_columns(4, 6),
    q_min=[-1.0, -2.0, -np.inf, 0.5, -1.0, -3.0],
    q_max=[1.0, 3.0, 1.0, 1.5, np.inf, 1.0],
)
BOUNDED = np.array([True, True, False, True, False, True])
Q = np.array([0.3, -1.0, 0.7, 1.2, 5.0, -2.0])


def test_joint_limits_by_hand() -> None:
    weights = np.array([1.0, 2.0, 3.0, 0.5, 1.0, 0.0])
    with np.errstate(invalid="ignore"):
        middle, half = 0.5 * (LIMITED.q_min + LIMITED.q_max), 0.5 * (LIMITED.q_max - LIMITED.q_min)
        offset = np.where(BOUNDED, (Q - middle) / half, 0.0)
    value, gradient, hessian = JointLimits(weights).evaluate(LIMITED, Q)
    assert value == pytest.approx(0.5 * np.sum(weights * offset**2), rel=1e-14)
    np.testing.assert_allclose(gradient, weights * offset / half, rtol=1e-14)
    np.testing.assert_allclose(hessian, np.diag(np.where(BOUNDED, weights / half**2, 0.0)), rtol=1e-14)
    corner = np.array([1.0, 3.0, 0.0, 1.5, 0.0, 1.0])
    assert JointLimits().evaluate(LIMITED, corner, order=0) == pytest.approx(2.0, rel=1e-15)
    # A smooth function beyond the limits, too.
    beyond = np.array([1.5, 0.5, 0.0, 1.0, 0.0, -1.0])
    assert JointLimits().evaluate(LIMITED, beyond, order=0) == pytest.approx(0.5 * 1.5**2)
    assert JointLimits().status(LIMITED, beyond) == "regular"


def test_limit_barrier_by_hand() -> None:
    weights = np.array([1.0, 2.0, 3.0, 0.5, 1.0, 0.0])
    above, below = Q - LIMITED.q_min, LIMITED.q_max - Q
    value, gradient, hessian = LimitBarrier(weights).evaluate(LIMITED, Q)
    chosen = BOUNDED & (weights > 0)
    half = 0.5 * (above + below)[chosen]
    wanted = -np.sum(weights[chosen] * np.log(above[chosen] * below[chosen] / half**2))
    assert value == pytest.approx(wanted, rel=1e-13)
    slope = np.where(chosen, weights * (1 / below - 1 / above), 0.0)
    np.testing.assert_allclose(gradient, slope, rtol=1e-13)
    bend = np.where(chosen, weights * (1 / below**2 + 1 / above**2), 0.0)
    np.testing.assert_allclose(hessian, np.diag(bend), rtol=1e-13)
    middle = np.array([0.0, 0.5, 0.0, 1.0, 0.0, -1.0])
    assert LimitBarrier().evaluate(LIMITED, middle, order=0) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("first", [1.0, 1.5, -1.0, -7.0])
def test_limit_barrier_at_and_beyond_a_limit(first: float) -> None:
    q = np.array([first, 0.5, 0.0, 1.0, 0.0, -1.0])
    value, gradient, hessian = LimitBarrier().evaluate(LIMITED, q)
    assert value == np.inf
    assert np.isnan(gradient).all()
    assert np.isnan(hessian).all()
    assert LimitBarrier().status(LIMITED, q) == "outside limits"


def test_sum_is_the_sum_of_its_terms() -> None:
    terms = [ConditionNumber(0.7, squared=True), JointLimits(), Manipulability(0.7)]
    total = terms[0] + 0.25 * terms[1] + terms[2] * -2.0
    for order in (1, 2):
        parts = [term.evaluate(LIMITED, Q, order=order) for term in terms]
        for got, *wanted in zip(total.evaluate(LIMITED, Q, order=order), *parts, strict=True):
            combined = wanted[0] + 0.25 * wanted[1] - 2.0 * wanted[2]
            np.testing.assert_allclose(got, combined, rtol=1e-12, atol=1e-12 * np.abs(wanted[0]).max())
    assert total.length == 0.7
    assert (total + ConditionNumber(0.3)).length is None
    assert JointLimits().length is None
    assert total.with_length(0.4).length == 0.4
    other = terms[0].with_length(0.4).evaluate(LIMITED, Q, order=0)
    assert other == pytest.approx(ConditionNumber(0.4, squared=True).evaluate(LIMITED, Q, order=0))


def _bowl(q: F64) -> float:
    return float(np.sum(np.sin(q)) + 0.5 * q[0] * q[1] ** 2)


def _bowl_gradient(q: F64) -> F64:
    gradient: F64 = np.cos(q)
    gradient[0] += 0.5 * q[1] ** 2
    gradient[1] += q[0] * q[1]
    return gradient


def _bowl_hessian(q: F64) -> F64:
    hessian: F64 = np.diag(-np.sin(q))
    hessian[1, 1] += q[0]
    hessian[0, 1] += q[1]
    hessian[1, 0] += q[1]
    return hessian


@pytest.mark.parametrize(
    ("function", "tolerance"),
    [
        (_bowl, 1e-6),
        (lambda q: (_bowl(q), _bowl_gradient(q)), 1e-8),
        (lambda q: (_bowl(q), _bowl_gradient(q), _bowl_hessian(q)), 1e-15),
    ],
    ids=["value", "gradient", "Hessian"],
)
def test_callable_is_an_index(function: Callable[[F64], Any], tolerance: float) -> None:
    for index in (CustomIndex(function), 0.0 * JointLimits() + function):
        value, gradient, hessian = index.evaluate(LIMITED, Q)
        assert value == pytest.approx(_bowl(Q), rel=1e-15)
        np.testing.assert_allclose(gradient, _bowl_gradient(Q), rtol=0, atol=tolerance)
        np.testing.assert_allclose(hessian, _bowl_hessian(Q), rtol=0, atol=tolerance)
    batch = CustomIndex(function).evaluate(LIMITED, np.stack([Q] * 300), order=1)
    np.testing.assert_allclose(batch[1], np.broadcast_to(_bowl_gradient(Q), (300, 6)), rtol=0, atol=tolerance)


def test_exception_of_a_callable_reaches_the_caller_once() -> None:
    class MyError(Exception):
        pass

    def fail(q: F64) -> float:
        if q[0] > 0:
            raise MyError("of the callable")
        return 1.0

    total = ConditionNumber() + fail
    for order in (0, 1, 2):
        with pytest.raises(MyError, match="of the callable"):
            total.evaluate(LIMITED, Q, order=order)
    with pytest.raises(MyError):
        total.evaluate(LIMITED, np.stack([Q] * 400), order=1)
    with pytest.raises(MyError):
        total.status(LIMITED, Q)
    assert np.isfinite(total.evaluate(LIMITED, -abs(Q), order=0))


@pytest.mark.parametrize("value", [None, "text", [1.0, 2.0], (1.0, [1.0]), (1.0, np.ones(6), np.ones((6, 5))), ()])
def test_wrong_answer_of_a_callable_is_an_exception(value: object) -> None:
    with pytest.raises(Exception, match=r".") as caught:
        CustomIndex(lambda q: value).evaluate(LIMITED, Q)
    assert type(caught.value).__name__ != "PanicException"


FANUC = Robot.from_dh(
    [0.15, 0.87, 0.17, 0, 0, 0],
    [0, 0, 0, -1.016, 0, -0.175],
    np.deg2rad([-90, 180, -90, 90, -90, 180]),
    [0, -np.pi / 2, 0, 0, 0, 0],
)
PLANAR = Robot.from_dh([1.0, 1.0, 1.0], [0.0] * 3, [0.0] * 3, [0.0] * 3)


@pytest.mark.parametrize(
    ("robot", "q", "rows"),
    [
        (FANUC, np.array([0.3, 0.2, -0.4, 0.5, 0.0, 0.9]), ALL),
        (PLANAR, np.array([0.4, 0.0, 0.0]), [2, 3, 4]),
        (PLANAR, np.array([0.4, np.pi, 0.0]), [2, 3, 4]),
        (PLANAR, np.array([0.4, 0.3, 0.2]), [2, 3, 5]),
        (PLANAR, np.array([0.4, 0.0, 0.0]), [3, 4]),
    ],
    ids=["wrist", "stretched", "folded", "out of the plane", "stretched pair"],
)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("squared", [False, True])
def test_at_a_singularity(kind: str, squared: bool, robot: Robot, q: F64, rows: list[int]) -> None:
    assert np.linalg.svd(normalised(robot, q, 0.5, rows), compute_uv=False)[-1] < 1e-15
    index = KINDS[kind](length=0.5, rows=rows, squared=squared)
    value, gradient, hessian = index.evaluate(robot, q, with_length=True)
    assert value == (0.0 if kind in ("manipulability", "smallest") else np.inf)
    assert index.status(robot, q) == "singular"
    if not (kind == "manipulability" and squared):
        assert np.isnan(gradient[:-1]).all()
        assert np.isnan(hessian).all()


def _isotropic() -> tuple[Robot, F64, float]:
    # A planar arm whose joints sit at the corners of an equilateral triangle about the tool point (distance l/sqrt 3):
    # J_n is then sqrt(3) L times an orthogonal matrix for L = r / sqrt 2.
    side = 1.0
    radius = side / np.sqrt(3.0)
    robot = Robot.from_dh([side, side, radius], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    return robot, np.array([0.4, 2 * np.pi / 3, 5 * np.pi / 6]), radius / np.sqrt(2.0)


def test_isotropic_posture_has_repeated_singular_values() -> None:
    robot, q, length = _isotropic()
    rows = [2, 3, 4]
    sigma = np.linalg.svd(normalised(robot, q, length, rows), compute_uv=False)
    np.testing.assert_allclose(sigma, sigma[0], rtol=1e-14)
    frobenius = ConditionNumber(length, rows=rows)
    value, gradient, hessian = frobenius.evaluate(robot, q, with_length=True)
    assert value == pytest.approx(1.0, abs=1e-14)
    np.testing.assert_allclose(gradient, 0.0, atol=1e-13)
    assert np.linalg.eigvalsh(hessian).min() > -1e-12
    assert frobenius.status(robot, q) == "regular"
    for make in (_spectral, SmallestSingularValue, SingularityParameter):
        index = make(length=length, rows=rows)
        assert index.status(robot, q) == "repeated"
        value, gradient, hessian = index.evaluate(robot, q)
        assert np.isfinite(value)
        assert np.isfinite(gradient).all()
        assert np.isnan(hessian).all()
    # The volume does not tell singular values apart.
    assert Manipulability(length, rows=rows).status(robot, q) == "regular"


@pytest.mark.parametrize("kind", KINDS)
def test_batch_is_its_postures(kind: str) -> None:
    index = KINDS[kind](length=0.6) + JointLimits()
    q = np.random.default_rng(2).uniform(-0.9, 0.9, (700, 6))
    batch: Any = index.evaluate(FANUC, q)
    many = index.evaluate_many(FANUC, q, order=2, threads=2)
    for i in range(0, 700, 50):
        single = index.evaluate(FANUC, q[i])
        for got, again, wanted in zip((part[i] for part in batch), (part[i] for part in many), single, strict=True):
            np.testing.assert_array_equal(got, wanted)
            np.testing.assert_array_equal(again, wanted)
    np.testing.assert_array_equal(index.evaluate(FANUC, q, order=0), batch[0])
    none: Any = index.evaluate(FANUC, np.empty((0, 6)))
    assert [part.shape for part in none] == [(0,), (0, 6), (0, 6, 6)]


@pytest.mark.parametrize("name", Objective.kinds())
def test_indices_by_name(name: str) -> None:
    classes: dict[str, Callable[..., Objective]] = {
        "condition_number": ConditionNumber,
        "spectral_condition_number": _spectral,
        "manipulability": Manipulability,
        "smallest_singular_value": SmallestSingularValue,
        "singularity_parameter": SingularityParameter,
        "joint_limits": lambda **_: JointLimits(),
        "limit_barrier": lambda **_: LimitBarrier(),
    }
    robot = robots.get("fanuc_m710ic50_milling")
    q = np.array([0.1, 0.2, -0.3, 0.4, 0.9, 0.2])
    index = Objective.named(name, 0.4, squared=True)
    assert index.evaluate(robot, q, 0) == classes[name](length=0.4, squared=True).evaluate(robot, q, 0)
    assert index.name == name.replace("_", " ")
    assert Objective.kinds()[name] == (index.length is not None)


def test_names_of_what_is_no_single_index() -> None:
    condition = ConditionNumber()
    for objective in (condition + JointLimits(), -1.0 * condition, CustomIndex(lambda _: 1.0)):
        assert objective.name == "value"
    with pytest.raises(InvalidValueError, match=r"one of condition_number, .*, limit_barrier"):
        Objective.named("volume")


@pytest.mark.parametrize("norm", ["frobenius", "spectral"])
@pytest.mark.parametrize("rows", [[0, 1, 2], [3, 4, 5], [1], [4]])
def test_length_that_scales_all_rows_or_none(norm: str, rows: list[int]) -> None:
    robot = robots.get("fanuc_m710ic50_milling")
    q = np.array([0.1, 0.2, -0.3, 0.4, 0.9, 0.2])
    _, gradient, hessian = ConditionNumber(1e-5, norm, rows).evaluate(robot, q, with_length=True)  # type: ignore[arg-type]
    assert gradient[-1] == 0.0
    assert not hessian[-1].any()
    assert not hessian[:, -1].any()
