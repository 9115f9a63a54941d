"""What is wrong in print in Huo's thesis: the table of errata of docs/reproduction_huo.md."""

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray
from redundancy import weights as rw
from scipy.spatial.transform import Rotation

F64 = NDArray[np.float64]
RNG = np.random.default_rng(5)


def vect(q: F64) -> F64:
    """Axial vector of a matrix, as Angeles and the thesis define it."""
    return 0.5 * np.array([q[2, 1] - q[1, 2], q[0, 2] - q[2, 0], q[1, 0] - q[0, 1]])


def swung_and_spun(angle: float, spin: float) -> tuple[F64, F64]:
    """Return Q and Q_d, whose z axes are an angle apart: from one to the other by the shortest way, then a spin."""
    q = Rotation.random(random_state=RNG.integers(1 << 31)).as_matrix()
    heading = RNG.uniform(-np.pi, np.pi)
    swing = Rotation.from_rotvec(angle * np.array([np.cos(heading), np.sin(heading), 0.0]))
    return q, q @ (swing * Rotation.from_rotvec([0.0, 0.0, spin])).as_matrix()


def printed_error(q: F64, wanted: F64) -> F64:
    """(3.22) before its norm is taken, and line 6 of algorithm 3.1 after the projection."""
    e = q[:, 2]
    error: F64 = (np.eye(3) - np.outer(e, e)) @ q @ vect(q.T @ wanted)
    return error


@pytest.mark.parametrize("spin", [0.0, 0.4, -1.5, 3.0])
@pytest.mark.parametrize("angle", [1e-6, 1e-2, 1.0])
def test_3_22_is_the_sine_of_the_angle_times_the_cosine_of_half_the_spin(angle: float, spin: float) -> None:
    q, wanted = swung_and_spun(angle, spin)
    assert np.linalg.norm(np.cross(q[:, 2], wanted[:, 2])) == pytest.approx(np.sin(angle), rel=1e-9)
    expected = np.sin(angle) * np.cos(0.5 * spin)
    assert np.linalg.norm(printed_error(q, wanted)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("spin", [0.5, 1.5, 2.8])
def test_line_6_of_algorithm_3_1_corrects_a_free_axis_linearly(spin: float) -> None:
    def angle() -> float:
        return float(np.arcsin(np.linalg.norm(np.cross(q[:, 2], wanted[:, 2]))))

    q, wanted = swung_and_spun(1e-3, spin)
    for _ in range(5):
        before = angle()
        q = Rotation.from_rotvec(printed_error(q, wanted)).as_matrix() @ q
        assert angle() == pytest.approx(abs(np.sin(0.5 * spin)) * before, rel=1e-2)


def test_the_package_corrects_a_free_axis_quadratically() -> None:
    robot, task = rd.robots.get("fanuc_m710ic50"), rd.Task.axisymmetric()
    q = np.array([0.3, 0.4, -0.5, 0.6, 0.9, 0.2])
    pose = robot.fk(q)
    axis = Rotation.from_rotvec([1e-3, 2e-3, 0.0]).apply(pose[:3, 2])
    one = rd.TwistDecomposition(robot, task, iterations=1, correct=False)
    found = one.follow_chunk(np.concatenate([pose[:3, 3], axis])[None], q)
    assert found.axis_error[0] < 1e-5


def test_2_21_is_of_angles_about_z_y_z() -> None:
    angles = np.array([0.4, 0.7, -0.3])
    a, b = angles[:2]
    printed = np.array(
        [[0.0, -np.sin(a), np.cos(a) * np.sin(b)], [0.0, np.cos(a), np.sin(a) * np.sin(b)], [1.0, 0.0, np.cos(b)]]
    )

    def rates(sequence: str) -> F64:
        """Angular velocities that go with the rates of three angles, by differences."""
        h, here = 1e-6, Rotation.from_euler(sequence, angles)
        moved = [Rotation.from_euler(sequence, angles + h * d) * here.inv() for d in np.eye(3)]
        return np.stack([m.as_rotvec() / h for m in moved], axis=1)

    np.testing.assert_allclose(rates("ZYZ"), printed, rtol=0, atol=1e-6)
    assert np.abs(rates("ZYX") - printed).max() > 0.1


def test_printed_shares_are_not_those_of_the_ranges() -> None:
    # Table 4.1, section 5.4.2.
    two, three, four = np.array([-4.6, 4.17]), np.array([-1.52, 4.17]), np.array([-0.9707, 0.1864])
    assert three[0] / two[0] == pytest.approx(0.33, abs=0.005)
    assert four[0] / two[0] == pytest.approx(0.21, abs=0.005)
    assert np.ptp(three) / np.ptp(two) == pytest.approx(0.65, abs=0.005)
    assert np.ptp(four) / np.ptp(two) == pytest.approx(0.13, abs=0.005)
    # Section 5.4.1.
    assert np.ptp([-0.2437, 0.2445]) / np.ptp([-1.047, 1.05]) == pytest.approx(0.23, abs=0.005)


def test_printed_damping_scalar_makes_6_8_negative() -> None:
    cosines, manipulability = np.ones(6), 0.1
    # m (1 - 0) exp(-2 w) with m = 0.25, and the same with s = 1.
    assert (0.25 - 0.5) * np.exp(-2.0 * manipulability) < 0.0
    _, k = rw.WeightFunctions().weights(cosines, np.full(6, -0.5), manipulability, c_sing=-0.5)
    np.testing.assert_array_equal(k, [0.01, 0.01, 0.01, 0.0, 0.0, 0.0])
