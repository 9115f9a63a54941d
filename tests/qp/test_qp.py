"""Small quadratic programmes: closed forms, optimality by the numbers alone, certificates, bad input, scipy."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, lsq_linear, minimize

from tests.reference.chain import F64
from tests.reference.programmes import KINDS, Programme, out_of_reach, prove, random_programme, residual

INF = np.inf


def positive(rng: np.random.Generator, n: int, spread: float = 2.0) -> F64:
    """A random symmetric matrix with eigenvalues between 10^-spread and 1."""
    basis, _ = np.linalg.qr(rng.standard_normal((n, n)))
    h: F64 = (basis * 10.0 ** -rng.uniform(0.0, spread, n)) @ basis.T
    return 0.5 * (h + h.T)


def most_changes(n: int, m: int) -> int:
    """The documented number."""
    return 50 + 10 * (n + m)


@pytest.mark.parametrize("n", range(1, 21))
def test_without_constraints_it_is_a_linear_system(n: int) -> None:
    rng = np.random.default_rng(n)
    h, g = positive(rng, n), rng.standard_normal(n)
    x, status, bounds, rows, changes = rd.solve_qp(h, g)
    assert (status, changes) == ("solved", 0)
    np.testing.assert_allclose(x, np.linalg.solve(h, -g), rtol=0, atol=1e-13 * np.linalg.cond(h) * np.abs(x).max())
    np.testing.assert_array_equal(bounds, np.zeros(n))
    assert rows.shape == (0,)


@given(st.integers(1, 20), st.integers(0, 2**32 - 1))
def test_diagonal_programmes_are_clipped(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    d, g = 10.0 ** rng.uniform(-6.0, 6.0, n), rng.standard_normal(n)
    lower = np.where(rng.random(n) < 0.5, rng.uniform(-1.0, 0.0, n), -INF)
    upper = np.where(rng.random(n) < 0.5, rng.uniform(0.0, 1.0, n), INF)
    fixed = rng.random(n) < 0.1
    lower[fixed] = upper[fixed] = 0.25
    x, status, multipliers, _, _ = rd.solve_qp(np.diag(d), g, lower, upper)
    wanted = np.clip(-g / d, lower, upper)
    assert status == "solved"
    assert (x >= lower).all()
    assert (x <= upper).all()
    np.testing.assert_allclose(x, wanted, rtol=1e-12)
    np.testing.assert_allclose(multipliers, np.where(wanted == -g / d, 0.0, d * wanted + g), rtol=1e-9, atol=1e-9)


@given(st.integers(2, 20), st.integers(0, 2**32 - 1))
def test_equalities_alone_are_the_linear_system_of_lagrange(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    m = int(rng.integers(1, n))
    h, g, a, b = positive(rng, n), rng.standard_normal(n), rng.standard_normal((m, n)), rng.standard_normal(m)
    system = np.block([[h, -a.T], [a, np.zeros((m, m))]])
    wanted = np.linalg.solve(system, np.r_[-g, b])
    x, status, _, multipliers, _ = rd.solve_qp(h, g, rows=a, row_lower=b, row_upper=b)
    assert status == "solved"
    tolerance = 1e-14 * np.linalg.cond(system) * np.abs(wanted).max()
    np.testing.assert_allclose(np.r_[x, multipliers], wanted, rtol=0, atol=tolerance + 1e-12)


def test_the_nearest_point_of_a_simplex() -> None:
    # |x - c|^2 / 2 with x >= 0 and sum x = 1: c less one number, cut at zero.
    rng = np.random.default_rng(0)
    for n in range(2, 21):
        c = rng.standard_normal(n)
        falling = np.sort(c)[::-1]
        shifts = (np.cumsum(falling) - 1.0) / np.arange(1, n + 1)
        wanted = np.maximum(c - shifts[falling > shifts][-1], 0.0)
        x, status, _, (less,), _ = rd.solve_qp(np.eye(n), -c, np.zeros(n), None, [np.ones(n)], [1.0], [1.0])
        assert status == "solved"
        np.testing.assert_allclose(x, wanted, rtol=0, atol=1e-14)
        assert less == pytest.approx(-shifts[falling > shifts][-1], abs=1e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_every_answer_is_proved_by_the_numbers_of_the_problem(kind: str) -> None:
    said = set()
    for seed in range(60):
        programme = random_programme(np.random.default_rng([7, seed]), kind)
        x, status, bounds, rows, changes = rd.solve_qp(**programme.arguments())
        said.add(status)
        multipliers = np.r_[bounds, rows]
        assert changes <= most_changes(programme.n, len(rows))
        if status == "infeasible":
            assert out_of_reach(programme, multipliers) > 1e6, seed
            continue
        assert status == "solved", seed
        assert residual(programme, x, multipliers) < 1e-12, seed
        assert (x >= programme.lower).all()
        assert (x <= programme.upper).all()
        proof = prove(programme, multipliers)
        assert proof.error < 1e-10, seed
        assert proof.distance(programme, x) < 1e-11, seed
    assert said == {"generic": {"solved"}, "infeasible": {"infeasible"}}.get(kind, said)
    assert kind != "tight" or said == {"solved", "infeasible"}


@given(st.sampled_from(KINDS), st.integers(0, 2**32 - 1), st.integers(-6, 6))
def test_units_do_not_matter(kind: str, seed: int, exponent: int) -> None:
    # Powers of two change no digit: variables, rows and the objective in other units.
    rng = np.random.default_rng(seed)
    p = random_programme(rng, kind)
    d, r, o = 2.0 ** rng.integers(-6, 7, p.n), 2.0 ** rng.integers(-6, 7, len(p.rows)), 2.0**exponent
    x, status, *_ = rd.solve_qp(**p.arguments())
    scaled = rd.solve_qp(
        o * p.h / np.outer(d, d),
        o * p.g / d,
        d * p.lower,
        d * p.upper,
        r[:, None] * p.rows / d,
        r * p.row_lower,
        r * p.row_upper,
    )
    assert scaled[1] == status
    if status == "solved":
        np.testing.assert_allclose(scaled[0] / d, x, rtol=0, atol=1e-9 * (1.0 + np.abs(x).max()))


def test_beside_scipy() -> None:
    rng = np.random.default_rng(5)
    for _ in range(60):
        # Least squares within bounds.
        n, k = int(rng.integers(2, 21)), int(rng.integers(21, 30))
        a, b = rng.standard_normal((k, n)), rng.standard_normal(k)
        lower, upper = -rng.uniform(0.0, 0.2, n), rng.uniform(0.01, 0.2, n)
        theirs = lsq_linear(a, b, (lower, upper), method="bvls", tol=1e-14)
        x, status, *_ = rd.solve_qp(a.T @ a, -a.T @ b, lower, upper)
        assert status == "solved"
        np.testing.assert_allclose(x, theirs.x, rtol=0, atol=1e-10)


def test_beside_scipys_general_solver() -> None:
    compared = 0
    for seed in range(15):
        p = random_programme(np.random.default_rng([11, seed]), "generic")
        x, status, *_ = rd.solve_qp(**p.arguments())
        equal = p.row_lower == p.row_upper
        there = (np.isfinite(p.row_lower) | np.isfinite(p.row_upper)) & ~equal
        rows = [LinearConstraint(p.rows[k], p.row_lower[k], p.row_upper[k]) for k in (equal, there) if k.any()]

        def cost(z: F64, p: Programme = p) -> float:
            return float(0.5 * z @ p.h @ z + p.g @ z)

        def slope(z: F64, p: Programme = p) -> F64:
            return np.asarray(p.h @ z + p.g)

        theirs = minimize(
            cost,
            np.clip(np.zeros(p.n), p.lower, p.upper),
            jac=slope,
            bounds=np.c_[p.lower, p.upper],
            constraints=rows,
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        )
        if theirs.success:
            compared += 1
            assert status == "solved"
            # It stops by the change of its cost, which is flat about the minimum.
            assert abs(cost(x) - theirs.fun) < 1e-7 * (1.0 + abs(theirs.fun))
    assert compared >= 8


@pytest.mark.parametrize("name", ["daqp", "proxqp", "clarabel"])
def test_beside_other_solvers(name: str) -> None:
    pytest.importorskip("proxsuite" if name == "proxqp" else name)
    from tests.soak import qp as soak_qp

    solve: Callable[[Programme], soak_qp.Answer] = getattr(soak_qp, name)()
    for seed in range(200):
        p = random_programme(np.random.default_rng([13, seed]), "infeasible" if seed % 4 == 0 else "generic")
        x, status, *_ = rd.solve_qp(**p.arguments())
        other, theirs, multipliers = solve(p)
        if other == status == "infeasible":
            continue
        if other == "solved" and residual(p, theirs, multipliers) < 1e-10:
            assert status == "solved", seed
            apart = x - theirs
            assert np.sqrt(apart @ p.h @ apart) < 1e-7 * (1.0 + np.abs(x).max()), seed


def test_rows_that_exclude_each_other() -> None:
    x, status, _, rows, _ = rd.solve_qp(
        np.eye(2), [1.0, 1.0], rows=[[1.0, 1.0], [2.0, 2.0]], row_lower=[3.0, -INF], row_upper=[INF, 4.0]
    )
    assert status == "infeasible"
    assert np.isfinite(x).all()
    np.testing.assert_allclose(rows / rows[0], [1.0, -0.5], atol=1e-15)
    assert rows[0] * 3.0 + rows[1] * 4.0 > 0.0
    # An empty row that asks for something, beside one that asks for nothing.
    assert rd.solve_qp(np.eye(2), [1.0, 1.0], rows=[[0.0, 0.0]], row_lower=[1.0])[1] == "infeasible"
    assert rd.solve_qp(np.eye(2), [1.0, 1.0], rows=[[0.0, 0.0]], row_lower=[-1.0])[1] == "solved"


def test_limits_that_are_crossed_are_infeasible() -> None:
    assert rd.solve_qp(np.eye(2), [1.0, 1.0], [2.0, 0.0], [1.0, 1.0])[1] == "infeasible"
    assert rd.solve_qp(np.eye(2), [1.0, 1.0], rows=[[1.0, 0.0]], row_lower=[2.0], row_upper=[1.0])[1] == "infeasible"


@pytest.mark.parametrize("place", ["bound", "row"])
def test_limits_that_are_crossed_need_no_other_proof(place: str) -> None:
    if place == "bound":
        _, status, found, _, _ = rd.solve_qp(np.eye(2), [1.0, 1.0], [2.0, 0.0], [1.0, 1.0])
    else:
        _, status, _, found, _ = rd.solve_qp(np.eye(2), [1.0, 1.0], rows=[[1.0, 0.0]], row_lower=[2.0], row_upper=[1.0])
    assert status == "infeasible"
    assert not found.any()


@pytest.mark.parametrize(
    ("change", "status"),
    [
        ({"h": -np.eye(3)}, "not convex"),
        ({"h": np.zeros((3, 3))}, "not convex"),
        ({"h": np.diag([1.0, 0.0, 1.0])}, "not convex"),
        ({"h": np.ones((3, 3))}, "not convex"),
        ({"h": np.full((3, 3), np.nan)}, "undefined"),
        ({"h": np.diag([1.0, np.inf, 1.0])}, "undefined"),
        ({"g": [0.0, np.nan, 0.0]}, "undefined"),
        ({"g": [0.0, np.inf, 0.0]}, "undefined"),
        ({"lower": [np.nan, 0.0, 0.0]}, "undefined"),
        ({"lower": [np.inf, 0.0, 0.0]}, "undefined"),
        ({"upper": [-np.inf, 0.0, 0.0]}, "undefined"),
        ({"rows": [[1.0, np.nan, 0.0]]}, "undefined"),
        ({"rows": [[1.0, np.inf, 0.0]], "row_lower": [0.0]}, "undefined"),
        ({"rows": [[1.0, 0.0, 0.0]], "row_lower": [np.nan]}, "undefined"),
        ({"rows": [[1.0, 0.0, 0.0]], "row_upper": [-np.inf]}, "undefined"),
        ({"g": [1e308, 0.0, 0.0], "h": np.diag([1e-308, 1.0, 1.0])}, "undefined"),
    ],
)
def test_numbers_that_make_no_programme_are_a_status(change: dict[str, Any], status: str) -> None:
    x, said, bounds, _, _ = rd.solve_qp(**({"h": np.eye(3), "g": np.ones(3)} | change))
    assert said == status
    assert x.shape == bounds.shape == (3,)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"h": np.eye(2)}, rd.ShapeError, "^h: got"),
        ({"h": np.ones(3)}, rd.ShapeError, "^h: got"),
        ({"h": np.ones((3, 4))}, rd.ShapeError, "^h: got"),
        ({"g": [[1.0, 1.0, 1.0]]}, rd.ShapeError, "^g: got"),
        ({"g": 1.0}, rd.ShapeError, "^g: got"),
        ({"g": None}, rd.ShapeError, "^g: got"),
        ({"lower": [0.0]}, rd.ShapeError, "^lower: got"),
        ({"upper": np.zeros(4)}, rd.ShapeError, "^upper: got"),
        ({"rows": [1.0, 1.0, 1.0]}, rd.ShapeError, "^rows: got"),
        ({"rows": np.ones((2, 2))}, rd.ShapeError, "^rows: got"),
        ({"rows": np.ones((2, 3)), "row_lower": [0.0]}, rd.ShapeError, "^row_lower: got"),
        ({"rows": np.ones((2, 3)), "row_upper": np.zeros(3)}, rd.ShapeError, "^row_upper: got"),
        ({"row_lower": [0.0]}, rd.ShapeError, "^row_lower: got"),
        ({"h": np.eye(21), "g": np.ones(21)}, rd.InvalidValueError, "21 variables, expected at most 20"),
        ({"g": ["a", "b", "c"]}, rd.InvalidValueError, "^g is .* real numbers"),
        ({"h": 1j * np.eye(3)}, rd.InvalidValueError, "^h is .* real numbers"),
    ],
)
def test_wrong_arguments_are_named(change: dict[str, Any], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=f"(?s){message}"):
        rd.solve_qp(**({"h": np.eye(3), "g": np.ones(3)} | change))


def test_any_layout_of_the_arrays() -> None:
    p = random_programme(np.random.default_rng(3), "generic", 6)
    wanted = rd.solve_qp(**p.arguments())
    for change in (
        lambda a: np.asfortranarray(a),
        lambda a: np.repeat(np.repeat(a, 2, axis=0), 2, axis=-1)[::2, ::2] if a.ndim == 2 else np.repeat(a, 2)[::2],
        lambda a: a.tolist(),
        lambda a: a[::-1].copy()[::-1],
    ):
        given_ = {name: change(value) for name, value in p.arguments().items()}
        for got, want in zip(rd.solve_qp(**given_), wanted, strict=True):
            np.testing.assert_array_equal(got, want)
    for value in p.arguments().values():
        value.flags.writeable = False
    np.testing.assert_array_equal(rd.solve_qp(**p.arguments())[0], wanted[0])
    whole = rd.solve_qp(2 * np.eye(2, dtype=np.int64), np.array([2, -3], dtype=np.int32), np.zeros(2, dtype=np.float32))
    np.testing.assert_array_equal(whole[0], [0.0, 1.5])


def test_only_the_lower_triangle_is_read() -> None:
    rng = np.random.default_rng(1)
    h, g = positive(rng, 5), rng.standard_normal(5)
    np.testing.assert_array_equal(
        rd.solve_qp(np.tril(h) + np.triu(np.full((5, 5), 9.0), 1), g)[0], rd.solve_qp(h, g)[0]
    )


def test_nothing_is_a_programme_too() -> None:
    x, status, bounds, rows, changes = rd.solve_qp(np.zeros((0, 0)), np.zeros(0))
    assert (x.shape, status, bounds.shape, rows.shape, changes) == ((0,), "solved", (0,), (0,), 0)
    assert rd.solve_qp(np.eye(2), [1.0, 1.0], rows=np.zeros((0, 2)))[1] == "solved"


def test_threads_do_not_meet() -> None:
    programmes = [random_programme(np.random.default_rng([17, seed])) for seed in range(200)]
    alone = [rd.solve_qp(**p.arguments()) for p in programmes]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda p: rd.solve_qp(**p.arguments()), programmes))
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1] == other[1]
