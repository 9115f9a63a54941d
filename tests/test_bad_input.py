"""Bad input against the documented exception: its class, and the offending value in its message; never a panic."""

import pickle
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

FANUC = rd.robots.get("fanuc_m710ic50_milling")
SQP = rd.OrthogonalSQP(FANUC, rd.Task.axisymmetric(), rd.ConditionNumber(0.5, squared=True))
Q = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
INDEX = rd.ConditionNumber(0.5)
ZEROS = np.zeros(6)

POSTURE_TAKERS: dict[str, Callable[[Any], Any]] = {
    "fk": FANUC.fk,
    "jacobian": FANUC.jacobian,
    "jacobian_derivative": FANUC.jacobian_derivative,
    "jacobian_second_derivative": FANUC.jacobian_second_derivative,
    "rate": lambda q: FANUC.jacobian_rate(q, ZEROS),
    "link_frames": FANUC.link_frames,
    "evaluate": lambda q: INDEX.evaluate(FANUC, q),
    "evaluate_many": lambda q: INDEX.evaluate_many(FANUC, q),
    "status": lambda q: INDEX.status(FANUC, q),
    "step": lambda q: SQP.step(q, ZEROS),
    "error": lambda q: SQP.error(q, [1, 0, 0, 1, 0, 0]),
    "solve": lambda q: SQP.solve([1, 0, 0, 1, 0, 0], q),
    "follow_chunk": lambda q: SQP.follow_chunk([[1, 0, 0, 1, 0, 0]], q),
    "characteristic_length": lambda q: rd.characteristic_length(FANUC, q),
    "rms_length": lambda q: rd.rms_length(FANUC, q),
    "minimum_condition_posture": lambda q: rd.minimum_condition_posture(FANUC, q),
}


@pytest.mark.parametrize("name", POSTURE_TAKERS)
@pytest.mark.parametrize("shape", [(), (0,), (5,), (7,), (2, 5), (0, 5), (1, 1, 6), (6, 1)])
def test_wrong_shape(name: str, shape: tuple[int, ...]) -> None:
    with pytest.raises(rd.ShapeError) as caught:
        POSTURE_TAKERS[name](np.zeros(shape))
    for size in shape:
        assert str(size) in str(caught.value)
    assert "6" in str(caught.value)
    assert isinstance(caught.value, rd.RedundancyError)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("name", POSTURE_TAKERS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite(name: str, value: float) -> None:
    q = Q.copy()
    q[3] = value
    with pytest.raises(rd.NonFiniteError, match=r"q0?\[3\] is (NaN|nan|inf|-inf)"):
        POSTURE_TAKERS[name](q)


@pytest.mark.parametrize("name", POSTURE_TAKERS)
@pytest.mark.parametrize(
    "value",
    [None, "text", "0.1", b"bytes", [0.1, "x", 0, 0, 0, 0], [[1.0], [1.0, 2.0]], {1: 2.0}, object(), [None] * 6],
    ids=lambda value: "object()" if type(value) is object else repr(value),  # alike in every process
)
def test_no_numbers(name: str, value: object) -> None:
    if value is None and name in ("solve", "minimum_condition_posture"):
        pytest.skip("None is the default")
    with pytest.raises((rd.InvalidValueError, rd.ShapeError, rd.NonFiniteError)):
        POSTURE_TAKERS[name](value)


@pytest.mark.parametrize("name", ["fk", "evaluate", "step", "minimum_condition_posture"])
def test_imaginary_parts_are_not_dropped(name: str) -> None:
    # Whatever the filters for numpy's warnings are.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with pytest.raises(rd.InvalidValueError):
            POSTURE_TAKERS[name](Q + 0.5j)


def _misaligned(q: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    raw = np.empty(q.nbytes + 1, np.uint8)
    view = raw[1:].view(np.float64).reshape(q.shape)
    view[...] = q
    assert not view.flags.aligned
    return view


FORMS: dict[str, Callable[[np.ndarray[Any, Any]], Any]] = {
    "list": lambda q: q.tolist(),
    "tuple": lambda q: tuple(q.tolist()),
    "strided": lambda q: np.repeat(q, 3, axis=-1)[..., ::3],
    "reversed": lambda q: q[..., ::-1].copy()[..., ::-1],
    "fortran": np.asfortranarray,
    "misaligned": _misaligned,
    "swapped": lambda q: q.astype(">f8"),
    "objects": lambda q: q.astype(object),
    "long double": lambda q: q.astype(np.longdouble),
    "read-only": lambda q: np.frombuffer(q.tobytes()).reshape(q.shape),
    "memoryview": lambda q: q.data,
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("shape", [(6,), (3, 6)])
def test_every_form_of_the_same_numbers(form: str, shape: tuple[int, ...]) -> None:
    q = np.random.default_rng(1).uniform(-1, 1, shape)
    given_q = FORMS[form](q.copy())
    np.testing.assert_array_equal(FANUC.jacobian(given_q), FANUC.jacobian(q))
    for got, wanted in zip(INDEX.evaluate(FANUC, given_q), INDEX.evaluate(FANUC, q), strict=True):
        np.testing.assert_array_equal(got, wanted)


@pytest.mark.parametrize("kind", [np.float32, np.float16, np.int8, np.int64, np.uint8, np.bool_])
def test_narrower_numbers_are_widened(kind: type) -> None:
    q: np.ndarray[Any, Any] = np.array([1, 0, 1, 1, 0, 1], dtype=kind)
    np.testing.assert_array_equal(FANUC.fk(q), FANUC.fk(q.astype(np.float64)))


WRONG_OUT: dict[str, Callable[[], Any]] = {
    "read-only": lambda: np.broadcast_to(np.zeros(()), (6, 6)),
    "float32": lambda: np.zeros((6, 6), np.float32),
    "swapped": lambda: np.zeros((6, 6), ">f8"),
    "int": lambda: np.zeros((6, 6), np.int64),
    "complex": lambda: np.zeros((6, 6), complex),
    "object": lambda: np.zeros((6, 6), object),
    "fortran": lambda: np.zeros((6, 6), order="F"),
    "strided": lambda: np.zeros((6, 12))[:, ::2],
    "misaligned": lambda: _misaligned(np.zeros((6, 6))),
    "shape": lambda: np.zeros((6, 7)),
    "transposed": lambda: np.zeros((36,)),
    "batch": lambda: np.zeros((1, 6, 6)),
    "list": lambda: [[0.0] * 6] * 6,
    "text": lambda: "out",
}


@pytest.mark.parametrize("form", WRONG_OUT)
def test_wrong_out(form: str) -> None:
    with pytest.raises(rd.ShapeError, match="out"):
        FANUC.jacobian(Q, out=WRONG_OUT[form]())


def test_locked_out_stays_what_it_was() -> None:
    out = np.full((6, 6), 7.0)
    out.setflags(write=False)
    with pytest.raises(rd.ShapeError, match="read-only"):
        FANUC.jacobian(Q, out=out)
    assert (out == 7.0).all()


def test_out_may_overlap_the_input() -> None:
    buffer = np.zeros((400, 6, 6))
    q = np.random.default_rng(1).uniform(-1, 1, (400, 6))
    buffer[:, 0, :] = q
    got = FANUC.jacobian(buffer[:, 0, :], out=buffer)
    assert got is buffer
    np.testing.assert_array_equal(buffer, FANUC.jacobian(q))
    rates = Q.copy()
    wanted = SQP.step(rates, 0.01 * np.ones(6))
    np.testing.assert_array_equal(SQP.step(rates, 0.01 * np.ones(6), out=rates), wanted)


VALUES: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "zero length": (lambda: rd.ConditionNumber(0.0), rd.InvalidValueError, "length is 0"),
    "negative length": (lambda: rd.Manipulability(-1.5), rd.InvalidValueError, "length is -1.5"),
    "NaN length": (lambda: rd.SmallestSingularValue(np.nan), rd.InvalidValueError, "length is NaN"),
    "infinite length": (lambda: INDEX.with_length(np.inf), rd.InvalidValueError, "length is inf"),
    "norm": (lambda: rd.ConditionNumber(norm="nuclear"), rd.InvalidValueError, "nuclear"),  # type: ignore[arg-type]
    "no rows": (lambda: rd.ConditionNumber(rows=[]), rd.InvalidValueError, "rows"),
    "row 6": (lambda: rd.ConditionNumber(rows=[0, 6]), rd.InvalidValueError, "6"),
    "rows twice": (lambda: rd.ConditionNumber(rows=[2, 2]), rd.InvalidValueError, "2, 2"),
    "rows back": (lambda: rd.ConditionNumber(rows=[3, 2]), rd.InvalidValueError, "3, 2"),
    "too many rows": (lambda: INDEX.evaluate(rd.robots.get("planar_3r"), ZEROS[:3]), rd.InvalidValueError, "rows"),
    "order": (lambda: INDEX.evaluate(FANUC, Q, order=3), rd.InvalidValueError, "3"),  # type: ignore[call-overload]
    "weight": (lambda: rd.JointLimits([1, 2, -3.5, 1, 1, 1]), rd.InvalidValueError, "-3.5"),
    "NaN weight": (lambda: rd.LimitBarrier([1, np.nan]), rd.InvalidValueError, "NaN"),
    "weights": (lambda: rd.JointLimits([1.0, 2.0]).evaluate(FANUC, Q), rd.ShapeError, r"\(2,\)"),
    "factor": (lambda: INDEX * np.inf, rd.InvalidValueError, "inf"),
    "length of none": (lambda: rd.JointLimits().evaluate(FANUC, Q, with_length=True), rd.InvalidValueError, "length"),
    "zero axis": (lambda: rd.Task.axisymmetric((0, 0, 0)), rd.InvalidValueError, "axis"),
    "NaN axis": (lambda: rd.Task.axisymmetric((0, np.nan, 0)), rd.NonFiniteError, r"axis\[1\]"),
    "long axis": (lambda: rd.Task.axisymmetric((0, 0, 0, 1)), rd.ShapeError, r"\(4,\)"),
    "zero target": (lambda: SQP.solve([1, 1, 1, 0, 0, 0], Q), rd.InvalidValueError, "axis"),
    "short target": (lambda: SQP.solve([1, 1, 1], Q), rd.ShapeError, r"\(3,\)"),
    "NaN target": (lambda: SQP.solve([1, np.nan, 1, 1, 0, 0], Q), rd.NonFiniteError, r"target\[1\]"),
    "NaN twist": (lambda: SQP.step(Q, [0, 0, np.inf, 0, 0, 0]), rd.NonFiniteError, r"twist\[2\]"),
    "twist": (lambda: SQP.step(Q, [0, 0, 0]), rd.ShapeError, "twist"),
    "few joints": (
        lambda: rd.OrthogonalSQP(rd.robots.get("planar_3r"), rd.Task.full(), rd.JointLimits()),
        rd.InvalidValueError,
        "3 joints",
    ),
    "hessian": (
        lambda: rd.OrthogonalSQP(FANUC, rd.Task.full(), INDEX, hessian="none"),  # type: ignore[arg-type]
        rd.InvalidValueError,
        "none",
    ),
    "dt": (lambda: rd.OrthogonalSQP(FANUC, rd.Task.full(), INDEX, dt=0.0), rd.InvalidValueError, "dt is 0"),
    "gain": (lambda: rd.OrthogonalSQP(FANUC, rd.Task.full(), INDEX, gain=-1.0), rd.InvalidValueError, "gain is -1"),
    "iterations": (
        lambda: rd.OrthogonalSQP(FANUC, rd.Task.full(), INDEX, max_iterations=0),
        rd.InvalidValueError,
        "max_iterations is 0",
    ),
    "tolerance": (
        lambda: rd.OrthogonalSQP(FANUC, rd.Task.full(), INDEX, tolerance=np.nan),
        rd.InvalidValueError,
        "tolerance is NaN",
    ),
    "method": (
        lambda: rd.minimum_condition_posture(FANUC, Q, method="guess"),  # type: ignore[arg-type]
        rd.InvalidValueError,
        "guess",
    ),
    "starts": (lambda: rd.minimum_condition_posture(FANUC, Q, starts=0), rd.InvalidValueError, "starts is 0"),
    "posture length": (lambda: rd.minimum_condition_posture(FANUC, Q, length=-2.0), rd.InvalidValueError, "-2"),
    "first length": (
        lambda: rd.minimum_condition_posture(FANUC, Q, length0=0.0, eliminate=False),
        rd.InvalidValueError,
        "length0 is 0",
    ),
    "posture tolerance": (
        lambda: rd.minimum_condition_posture(FANUC, Q, tolerance=0.0),
        rd.InvalidValueError,
        "tolerance",
    ),
    "tetrahedron of six": (lambda: rd.planar_tetrahedron(FANUC, Q, 1.0), rd.InvalidValueError, "fanuc"),
    "flat tetrahedron": (
        lambda: rd.planar_tetrahedron(rd.robots.get("planar_3r"), [0.1, 0.2, 0.3], 0.0),
        rd.InvalidValueError,
        "length is 0",
    ),
    "robot name": (lambda: rd.robots.get("fanuc_m710"), rd.UnknownRobotError, "did you mean 'fanuc_m710ic50"),
    "robot path": (lambda: rd.robots.get("../robots/panda"), rd.UnknownRobotError, "unknown robot"),
}


@pytest.mark.parametrize("case", VALUES)
def test_value_out_of_its_domain(case: str) -> None:
    call, kind, message = VALUES[case]
    with pytest.raises(kind, match=message) as caught:
        call()
    assert type(caught.value) is kind
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)


TABLE: dict[str, Any] = {"a": [1.0, 0.5], "d": [0.0, 0.0], "alpha": [0.0, 1.0], "theta": [0.0, 0.0]}
SKEW = np.eye(4)
SKEW[0, 1] = 0.01
MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
LAST = np.eye(4)
LAST[3, 0] = 1.0
TABLES: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "uneven": ({"d": [0.0]}, rd.ShapeError, "d"),
    "none": ({key: [] for key in TABLE}, rd.InvalidValueError, "0"),
    "seventeen": ({key: [0.1] * 17 for key in TABLE}, rd.InvalidValueError, "17"),
    "NaN": ({"alpha": [0.0, np.nan]}, rd.NonFiniteError, r"alpha\[1\]"),
    "infinite": ({"a": [np.inf, 0.0]}, rd.NonFiniteError, r"a\[0\]"),
    "letters": ({"joints": "RX"}, rd.InvalidValueError, "RX"),
    "many letters": ({"joints": "RRR"}, rd.RedundancyError, "3"),
    "convention": ({"convention": "craig"}, rd.InvalidValueError, "craig"),
    "inverted": ({"q_min": [0.0, 2.0], "q_max": [1.0, 1.5]}, rd.InvalidValueError, r"q_min\[1\] is 2"),
    "equal limits": ({"q_min": [0.0, 1.0], "q_max": [1.0, 1.0]}, rd.InvalidValueError, r"q_min\[1\]"),
    "NaN limit": ({"q_max": [np.nan, 1.0]}, rd.NonFiniteError, r"q_max\[0\]"),
    "short limit": ({"q_max": [1.0]}, rd.ShapeError, "q_max"),
    "no speed": ({"qd_max": [1.0, 0.0]}, rd.InvalidValueError, r"qd_max\[1\] is 0"),
    "negative acceleration": ({"qdd_max": [-1.0, 1.0]}, rd.InvalidValueError, r"qdd_max\[0\] is -1"),
    "skew tool": ({"tool": SKEW}, rd.InvalidValueError, "tool"),
    "mirrored base": ({"base": MIRROR}, rd.InvalidValueError, "base"),
    "no last row": ({"tool": LAST}, rd.InvalidValueError, "tool"),
    "small tool": ({"tool": np.eye(3)}, rd.ShapeError, r"tool.*\(3, 3\)"),
    "NaN tool": ({"tool": np.full((4, 4), np.nan)}, rd.NonFiniteError, "tool"),
}


@pytest.mark.parametrize("case", TABLES)
def test_wrong_model(case: str) -> None:
    change, kind, message = TABLES[case]
    with pytest.raises(kind, match=message):
        rd.Robot.from_dh(**(TABLE | change))


@pytest.mark.parametrize("wrong", [1, "RR", None, ["R"]], ids=repr)
def test_wrong_types_of_robots(wrong: object) -> None:
    with pytest.raises(TypeError):
        INDEX.evaluate(wrong, Q)  # type: ignore[call-overload]
    with pytest.raises(TypeError):
        rd.OrthogonalSQP(wrong, rd.Task.full(), INDEX)  # type: ignore[arg-type]
    with pytest.raises(TypeError):
        INDEX + wrong  # type: ignore[operator]


DTYPES: list[np.dtype[Any]] = [
    np.dtype(name) for name in ("f8", "f4", "i8", "u1", "c16", "?", "O", "U3", "S2", "M8[s]")
]


@settings(max_examples=400)
@given(
    arrays.arrays(
        st.sampled_from(DTYPES),
        arrays.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=7),
    ),
    st.sampled_from(sorted(POSTURE_TAKERS)),
)
@example(np.full(6, 1e308), "solve")
@example(np.full(6, 5e-324), "step")
def test_arbitrary_arrays_give_a_result_or_a_documented_exception(array: np.ndarray[Any, Any], name: str) -> None:
    if array.dtype == object:
        array = array.copy()
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", np.exceptions.ComplexWarning)
        try:
            POSTURE_TAKERS[name](array)
        except rd.RedundancyError as error:
            message = str(error)
        else:
            message = "a result"
    assert message


@settings(max_examples=300)
@given(st.binary(min_size=48, max_size=48), st.sampled_from(sorted(POSTURE_TAKERS)))
def test_arbitrary_bits_give_a_result_or_a_documented_exception(bits: bytes, name: str) -> None:
    q = np.frombuffer(bits, np.float64)
    if np.isfinite(q).all():
        POSTURE_TAKERS[name](q)
    else:
        with pytest.raises(rd.NonFiniteError):
            POSTURE_TAKERS[name](q)
