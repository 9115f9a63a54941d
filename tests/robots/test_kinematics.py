"""Forward kinematics, Jacobian and its derivatives against differentiated matrix products and differences."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from redundancy import Robot

from tests.reference.chain import F64, Chain, chains, random_columns
from tests.reference.differences import difference, sweep

ATOL = 1e-13


@settings(max_examples=150, deadline=None)
@given(chains())
def test_every_derivative_is_that_of_the_matrix_product(drawn: tuple[Chain, F64]) -> None:
    chain, q = drawn
    robot = chain.robot()
    j, j1, j2 = chain.derivatives(q)
    np.testing.assert_allclose(robot.fk(q), chain.fk(q), rtol=0, atol=ATOL)
    np.testing.assert_allclose(robot.jacobian(q), j, rtol=0, atol=ATOL)
    np.testing.assert_allclose(robot.jacobian_derivative(q), j1, rtol=0, atol=ATOL)
    np.testing.assert_allclose(robot.jacobian_second_derivative(q), j2, rtol=0, atol=ATOL)


@settings(max_examples=40, deadline=None)
@given(chains(most=8))
def test_derivatives_are_those_of_the_function_itself(drawn: tuple[Chain, F64]) -> None:
    chain, q = drawn
    robot = chain.robot()
    rotation = robot.fk(q)[:3, :3]

    def spin(x: F64) -> F64:
        product = robot.fk(x)[:3, :3] @ rotation.T
        return np.array([product[2, 1], product[0, 2], product[1, 0]])

    j = robot.jacobian(q)
    assert sweep(spin, q, j[:3]) < 1e-9
    assert sweep(lambda x: robot.fk(x)[:3, 3], q, j[3:]) < 1e-9
    assert sweep(robot.jacobian, q, robot.jacobian_derivative(q)) < 1e-9
    assert sweep(robot.jacobian_derivative, q, robot.jacobian_second_derivative(q)) < 1e-9


@settings(max_examples=60, deadline=None)
@given(chains(), st.integers(0, 2**32 - 1))
def test_rate_is_the_derivative_along_the_rates(drawn: tuple[Chain, F64], seed: int) -> None:
    chain, q = drawn
    robot = chain.robot()
    rates = np.random.default_rng(seed).uniform(-1, 1, chain.n)
    wanted = np.einsum("rik,k->ri", chain.derivatives(q)[1], rates)
    np.testing.assert_allclose(robot.jacobian_rate(q, rates), wanted, rtol=0, atol=ATOL)
    along = difference(lambda t: robot.jacobian(q + t[0] * rates), np.zeros(1), 1e-3)[..., 0]
    np.testing.assert_allclose(robot.jacobian_rate(q, rates), along, rtol=0, atol=1e-9)


@pytest.mark.parametrize("count", [1, 2, 255, 256, 257, 1000])
@pytest.mark.parametrize("joints", ["R", "RPR", "RRRRRR", "RRPRRRR", "RRRRRRRRR"])
def test_batch_is_its_postures_and_fills_out(count: int, joints: str) -> None:
    rng = np.random.default_rng(count)
    n = len(joints)
    robot = Robot.from_dh(*random_columns(count, n), joints=joints)
    q = rng.uniform(-3, 3, (count, n))
    methods = (robot.fk, robot.jacobian, robot.jacobian_derivative, robot.jacobian_second_derivative)
    for method in methods[: 4 if count < 300 else 2]:
        batch = method(q)
        np.testing.assert_array_equal(batch, np.stack([method(row) for row in q]))
        out = np.full_like(batch, np.nan)
        assert method(q, out=out) is out
        np.testing.assert_array_equal(out, batch)
        single = np.full_like(batch[0], np.nan)
        assert method(q[0], out=single) is single
        np.testing.assert_array_equal(single, batch[0])


def test_empty_batch_has_the_shapes_of_none() -> None:
    robot = Robot.from_dh([1.0, 1.0], [0.0, 0.0], [0.0, 0.5], [0.0, 0.0])
    q = np.empty((0, 2))
    assert robot.fk(q).shape == (0, 4, 4)
    assert robot.jacobian(q).shape == (0, 6, 2)
    assert robot.jacobian_derivative(q).shape == (0, 6, 2, 2)
    assert robot.jacobian_second_derivative(q).shape == (0, 6, 2, 2, 2)


@pytest.mark.parametrize("turns", [1, 1000, 10**6, 10**9])
def test_large_angles_are_reduced_exactly(turns: int) -> None:
    # numpy reduces modulo 2 pi with all its digits; so must the package.
    chain = Chain(*random_columns(5, 6), joints="RRRRRR")
    q = np.linspace(0.3, 2.1, 6) + turns * 6.0
    np.testing.assert_allclose(chain.robot().fk(q), chain.fk(q), rtol=0, atol=1e-13 + 4e-16 * abs(q).max())
    np.testing.assert_allclose(
        chain.robot().jacobian(q), chain.derivatives(q)[0], rtol=0, atol=1e-13 + 4e-16 * abs(q).max()
    )


def test_angles_beyond_every_reduction_stay_rigid() -> None:
    robot = Robot.from_dh(*random_columns(5, 6))
    for size in (1e12, 1e18, 1e100, 1e308):
        frame = robot.fk(np.full(6, size))
        np.testing.assert_allclose(frame[:3, :3] @ frame[:3, :3].T, np.eye(3), atol=1e-14)


def test_prismatic_joint_slides_along_its_axis() -> None:
    # By hand: one P joint along z, then an R joint a metre out along x.
    robot = Robot.from_dh([1.0, 0.5], [0.2, 0.0], [0.0, 0.0], [0.0, 0.0], joints="PR")
    frame = robot.fk([0.7, np.pi / 2])
    np.testing.assert_allclose(frame[:3, 3], [1.0, 0.5, 0.9], atol=1e-15)
    wanted = np.array([[0, 0], [0, 0], [0, 1], [0, -0.5], [0, 0], [1, 0]])
    np.testing.assert_allclose(robot.jacobian([0.7, np.pi / 2]), wanted, atol=1e-15)


def test_base_and_tool_frames() -> None:
    rng = np.random.default_rng(8)
    chain = Chain(*random_columns(8, 6), joints="RRPRRR")
    q = rng.uniform(-1, 1, 6)
    base, tool = chain.fk(rng.uniform(-1, 1, 6)), chain.fk(rng.uniform(-1, 1, 6))
    moved = chain.robot().with_tool(tool).with_base(base)
    np.testing.assert_allclose(moved.fk(q), base @ chain.fk(q) @ tool, atol=1e-14)
    frames = moved.link_frames(q)
    assert frames.shape == (7, 4, 4)
    np.testing.assert_allclose(frames[-1], moved.fk(q), atol=1e-15)
    np.testing.assert_allclose(frames[5] @ moved.flange @ moved.tool, moved.fk(q), atol=1e-14)
