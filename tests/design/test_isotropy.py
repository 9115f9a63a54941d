"""The conditions (2.5) to (2.7) summed joint by joint from axes and arms, and robots that fulfil them."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.reference.chain import F64, Chain, chains

PLANAR = [2, 3, 4]
RIGHT = np.pi / 2
DIESTRO = rd.Robot.from_dh([0.05] * 6, [0.05] * 6, [RIGHT, -RIGHT] * 3, [0.0] * 6)


@given(chains(least=1, most=8), st.floats(0.1, 2.0))
def test_sums_over_the_joints(drawn: tuple[Chain, F64], length: float) -> None:
    chain, q = drawn
    robot = chain.robot()
    jacobian = chain.derivatives(q)[0]
    angular, coupling, linear = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    for column in jacobian.T:
        angular += np.outer(column[:3], column[:3])
        coupling += np.outer(column[:3], column[3:])
        linear += np.outer(column[3:], column[3:]) / length**2
    alpha = (np.trace(angular) + np.trace(linear)) / 6.0
    found = rd.isotropy(robot, q, length)
    assert found.alpha == pytest.approx(alpha, rel=1e-12)
    np.testing.assert_allclose(found.angular, angular / alpha - np.eye(3), atol=1e-11)
    np.testing.assert_allclose(found.coupling, coupling / (alpha * length), atol=1e-11)
    np.testing.assert_allclose(found.linear, linear / alpha - np.eye(3), atol=1e-11)
    if set(chain.joints) == {"R"} and rd.rms_length(robot, q) > 1e-9:
        free = rd.isotropy(robot, q)
        assert free.length == pytest.approx(rd.rms_length(robot, q), rel=1e-12)
        assert free.alpha == pytest.approx(chain.n / 3.0, rel=1e-12)


@given(chains(least=6, most=8))
def test_residual_is_a_measure_of_the_condition_number(drawn: tuple[Chain, F64]) -> None:
    """With G = J_n J_n' / (alpha L^2), eigenvalues are within 6 residuals of 1; so is their ratio, kappa_2^2."""
    chain, q = drawn
    assume("R" in chain.joints)
    found = rd.isotropy(chain.robot(), q, 0.5)
    kappa = rd.ConditionNumber(0.5, "spectral").evaluate(chain.robot(), q, 0)
    assume(np.isfinite(kappa))
    assert found.residual > 0.0
    if found.residual < 1 / 6:
        assert kappa**2 <= (1 + 6 * found.residual) / (1 - 6 * found.residual) * (1 + 1e-9)
    assert found.residual >= (kappa**2 - 1) / (kappa**2 + 1) / 6 * (1 - 1e-9)


def test_diestro_is_isotropic() -> None:
    q = [0.3, RIGHT, -RIGHT, RIGHT, -RIGHT, np.pi]
    found = rd.isotropy(DIESTRO, q)
    assert found.residual < 1e-14
    assert found.length == pytest.approx(0.05, rel=1e-13)
    assert found.alpha == pytest.approx(2.0, rel=1e-13)
    assert rd.ConditionNumber(float(found.length)).evaluate(DIESTRO, q, 0) == pytest.approx(1.0, abs=1e-13)
    # Another length, or another posture, and it is not.
    assert rd.isotropy(DIESTRO, q, 0.06).residual > 0.1
    assert rd.isotropy(DIESTRO, [0.3, RIGHT, -RIGHT, RIGHT, -RIGHT, 3.0]).residual > 0.1


def test_axes_through_the_tool_point_have_no_length() -> None:
    robot = rd.Robot.from_dh([0.0] * 3, [0.0] * 3, [RIGHT, -RIGHT, 0.0], [0.0] * 3)
    assert np.isnan(rd.isotropy(robot, [0.1, 0.2, 0.3]).residual)


def test_planar_robot_on_an_equilateral_triangle() -> None:
    robot = rd.Robot.from_dh([1.0, 1.0, 1 / np.sqrt(3.0)], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    found = rd.isotropy(robot, [0.4, 2 * np.pi / 3, 5 * np.pi / 6], rows=PLANAR)
    assert found.residual < 1e-14
    assert found.alpha == pytest.approx(3.0)
    assert (found.angular.shape, found.coupling.shape, found.linear.shape) == ((1, 1), (1, 2), (2, 2))


def test_isotropic_tetrahedron_is_not_regular() -> None:
    """Section 2.1 calls it regular, and its height the rms distance r of the axes.

    Edges to the apex are sqrt(3/2) r long, those of the base sqrt(3) r, and the height is r / sqrt(2): three orthogonal
    edges of one length. On a regular tetrahedron, height sqrt(2) r, the condition number is 3 / sqrt(6).
    """
    robot = rd.Robot.from_dh([1.0, 1.0, 1 / np.sqrt(3.0)], [0.0] * 3, [0.0] * 3, [0.0] * 3)
    best = rd.minimum_condition_posture(robot, [0.1, 1.7, 2.3], rows=PLANAR)
    found = rd.planar_tetrahedron(robot, best.q, best.length)
    r = rd.rms_length(robot, best.q)
    assert found.condition_number == pytest.approx(1.0, abs=1e-10)
    assert found.height == pytest.approx(r / np.sqrt(2.0), rel=1e-6)
    np.testing.assert_allclose(np.linalg.norm(found.edges, axis=1), 1.2247449 * r, rtol=1e-6)
    base = [found.edges[i] - found.edges[i - 1] for i in range(3)]
    np.testing.assert_allclose(np.linalg.norm(base, axis=1), 1.7320508 * r, rtol=1e-6)
    np.testing.assert_allclose(found.edges @ found.edges.T, 1.5 * r**2 * np.eye(3), atol=1e-6 * r**2)
    regular = rd.planar_tetrahedron(robot, best.q, np.sqrt(2.0) * r)
    assert np.linalg.norm(regular.edges[0]) == pytest.approx(np.sqrt(3.0) * r, rel=1e-6)
    assert regular.condition_number == pytest.approx(3.0 / np.sqrt(6.0), rel=1e-6)


def test_a_batch_is_its_postures() -> None:
    robot = rd.robots.get("panda")
    q = robot.random_postures(5, seed=2)
    together = rd.isotropy(robot, q)
    assert together.residual.shape == (5,)
    assert together.coupling.shape == (5, 3, 3)
    for i, posture in enumerate(q):
        alone = rd.isotropy(robot, posture)
        assert together.length[i] == pytest.approx(alone.length, rel=1e-14)
        assert together.residual[i] == pytest.approx(alone.residual, rel=1e-13)


def test_rows_of_one_kind_need_a_length() -> None:
    robot = rd.robots.get("planar_3r")
    with pytest.raises(rd.InvalidValueError, match="a length"):
        rd.isotropy(robot, [0.1, 0.5, 0.7], rows=[3, 4])
    # Two links at a right angle, sqrt(2) : 1, are the isotropic pair of lengths at 135 degrees.
    pair = rd.Robot.from_dh([np.sqrt(2.0), 1.0], [0.0] * 2, [0.0] * 2, [0.0] * 2)
    found = rd.isotropy(pair, [0.2, np.deg2rad(135.0)], 1.0, rows=[3, 4])
    assert found.residual < 1e-14
    assert found.angular.shape == (0, 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"length": 0.0}, "length is 0"),
        ({"rows": [2, 1]}, r"rows are \[2, 1\]"),
        ({"rows": [6]}, "rows"),
        ({"rows": []}, "rows"),
    ],
)
def test_wrong_input(change: dict[str, object], message: str) -> None:
    with pytest.raises(rd.InvalidValueError, match=message):
        rd.isotropy(DIESTRO, np.zeros(6), **change)  # type: ignore[arg-type]
