"""Lengths against a scalar minimisation by scipy, and the planar tetrahedron against its own geometry."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from redundancy import ConditionNumber, Robot, characteristic_length, planar_tetrahedron, rms_length
from scipy.optimize import minimize_scalar

from tests.reference.chain import F64, Chain, chains

ALL = [0, 1, 2, 3, 4, 5]
PLANAR = [2, 3, 4]


@given(chains(least=3, most=9), st.sets(st.sampled_from(ALL), min_size=2, max_size=6))
def test_characteristic_length_minimises_the_condition_number(drawn: tuple[Chain, F64], chosen: set[int]) -> None:
    chain, q = drawn
    rows = sorted(chosen)
    assume(len(rows) <= chain.n and rows[0] < 3 <= rows[-1])
    robot = chain.robot()
    jacobian = chain.derivatives(q)[0]
    assume(np.linalg.cond(jacobian[rows]) < 1e3)

    def kappa(logarithm: float) -> float:
        sigma = np.linalg.svd((jacobian * np.repeat([np.exp(logarithm), 1.0], 3)[:, None])[rows], compute_uv=False)
        return float(np.sum(sigma**2) * np.sum(sigma**-2.0))

    length = characteristic_length(robot, q, rows)
    found = minimize_scalar(kappa, bracket=(-2.0, 0.0), tol=1e-12)
    assert np.log(length) == pytest.approx(found.x, abs=1e-6)
    value, gradient = ConditionNumber(length, rows=rows, squared=True).evaluate(robot, q, order=1, with_length=True)
    assert abs(gradient[-1] * length) < 1e-10 * value
    assert value == pytest.approx(found.fun / len(rows) ** 2, rel=1e-10)


def test_characteristic_length_at_a_singularity_is_not_a_number() -> None:
    robot = Robot.from_dh([1.0, 1.0, 1.0], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    assert np.isnan(characteristic_length(robot, [0.1, 0.0, 0.0], PLANAR))


@given(chains(least=1, most=9))
def test_rms_length_is_that_of_the_revolute_arms(drawn: tuple[Chain, F64]) -> None:
    chain, q = drawn
    assume("R" in chain.joints)
    jacobian = chain.derivatives(q)[0]
    revolute = np.array([kind == "R" for kind in chain.joints])
    wanted = np.sqrt(np.mean(np.sum(jacobian[3:, revolute] ** 2, axis=0)))
    assert rms_length(chain.robot(), q) == pytest.approx(wanted, rel=1e-12, abs=1e-13)


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3.0))
def test_planar_tetrahedron_is_the_condition_number(seed: int, length: float) -> None:
    rng = np.random.default_rng(seed)
    links = rng.uniform(0.2, 2.0, 3)
    robot = Robot.from_dh(links, [0.0] * 3, [0.0] * 3, [0.0] * 3)
    q = rng.uniform(-np.pi, np.pi, 3)
    angles = np.cumsum(q)
    joints = np.concatenate(
        [[[0.0, 0.0]], np.cumsum(links[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1), 0)]
    )
    arms = joints[3] - joints[:3]
    edges = np.column_stack([arms, np.full(3, length)])
    volume = abs(np.linalg.det(edges)) / 6.0
    assume(volume > 1e-3)
    found = planar_tetrahedron(robot, q, length)
    assert found.volume == pytest.approx(volume, rel=1e-10)
    pairs = ((1, 2), (2, 0), (0, 1))
    faces = [0.5 * np.linalg.norm(np.cross(edges[i], edges[j])) for i, j in pairs]
    np.testing.assert_allclose(sorted(found.faces), sorted(faces), rtol=1e-10)
    # Height of a vertex over the face opposite: three volumes over the area.
    np.testing.assert_allclose(sorted(found.distances), sorted(3.0 * volume / np.array(faces)), rtol=1e-9)
    kappa = ConditionNumber(length, rows=PLANAR).evaluate(robot, q, order=0)
    assert found.condition_number == pytest.approx(kappa, rel=1e-9)
    sigma = np.linalg.svd(edges, compute_uv=False)
    assert kappa == pytest.approx(np.sqrt(np.sum(sigma**2) * np.sum(sigma**-2.0)) / 3.0, rel=1e-9)
