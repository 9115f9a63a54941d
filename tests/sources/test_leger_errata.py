"""Formulas of Leger (2014) that are printed wrong: the right form holds, the printed one does not.

docs/reproduction_leger.md lists them. Derivatives are checked against differences and the package's own.
"""

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64

FANUC = rd.robots.get("fanuc_m710ic50_milling")
LENGTH = 0.4855933
RNG = np.random.default_rng(14)
Q = np.deg2rad([20.0, 15.0, -30.0, 40.0, -75.0, 60.0])
SCALE = np.repeat([LENGTH, 1.0], 3)[:, None]


def cross_matrix(e: F64) -> F64:
    return np.array([[0.0, -e[2], e[1]], [e[2], 0.0, -e[0]], [-e[1], e[0], 0.0]])


def adjugate(a: F64) -> F64:
    adjoint: F64 = np.linalg.det(a) * np.linalg.inv(a)
    return adjoint


def test_1_8_manipulability_of_redundant_robots() -> None:
    panda = rd.robots.get("panda")
    q = panda.random_postures(1, seed=3)[0]
    jacobian = panda.jacobian(q)
    value = rd.Manipulability(1.0).evaluate(panda, q, 0)
    assert value == pytest.approx(np.sqrt(np.linalg.det(jacobian @ jacobian.T)), rel=1e-10)
    assert abs(np.linalg.det(jacobian.T @ jacobian)) < 1e-12 * value**2


def test_2_11_and_2_18_faces() -> None:
    p = RNG.normal(size=(3, 3))
    faces = np.array([np.linalg.norm(np.cross(p[:, i - 2], p[:, i - 1])) for i in range(3)])
    edges = np.linalg.norm(p, axis=0)
    sines = np.array([np.sqrt(1.0 - (p[:, i - 2] @ p[:, i - 1] / edges[i - 2] / edges[i - 1]) ** 2) for i in range(3)])
    np.testing.assert_allclose(faces, edges[[1, 2, 0]] * edges[[2, 0, 1]] * sines, rtol=1e-12)
    assert np.abs(faces / (edges * edges[[2, 0, 1]] * sines) - 1.0).max() > 0.01
    trace = np.trace(adjugate(p.T @ p))
    assert np.sum(faces**2) == pytest.approx(trace, rel=1e-10)
    assert np.sum(faces) != pytest.approx(trace, rel=0.01)


def hessian(printed_x: bool, printed_tr6: bool) -> F64:
    """(3.39) with 1/n^2 on every term, its traces by (3.40), X by (3.27) as printed or by algorithm 2."""
    jn = SCALE * FANUC.jacobian(Q)
    first = SCALE[..., None] * FANUC.jacobian_derivative(Q)
    second = SCALE[..., None, None] * FANUC.jacobian_second_derivative(Q)
    inverse = np.linalg.inv(jn)
    x = inverse @ inverse.T if printed_x else inverse.T @ inverse
    y = inverse @ x
    tr1, tr2 = np.trace(jn.T @ jn), np.trace(x)
    out = np.empty((6, 6))
    for i in range(6):
        for j in range(6):
            ji, jj, jij = first[..., i], first[..., j], second[..., i, j]
            tr5 = np.trace(jj.T @ ji) + np.trace(jn.T @ jij)
            if printed_tr6:
                turned, last = np.trace(x @ jj.T @ x.T @ ji), np.trace(inverse @ ji @ y @ ji)
            else:
                turned = np.trace(inverse @ inverse.T @ jj.T @ inverse.T @ inverse @ ji)
                last = np.trace(inverse @ ji @ y @ jj)
            tr6 = np.trace(y @ jij) - turned - np.trace(inverse @ jj @ y @ ji) - last
            mixed = np.trace(jn.T @ ji) * np.trace(y @ jj) + np.trace(jn.T @ jj) * np.trace(y @ ji)
            out[i, j] = 2.0 / 36.0 * (tr5 * tr2 - 2.0 * mixed - tr1 * tr6)
    return out


def test_3_27_and_3_40b_hessian() -> None:
    wanted = rd.ConditionNumber(LENGTH, squared=True).evaluate(FANUC, Q)[2]
    size = np.abs(wanted).max()
    np.testing.assert_allclose(hessian(False, False), wanted, rtol=0, atol=1e-10 * size)
    for printed in ((True, False), (False, True), (True, True)):
        assert np.abs(hessian(*printed) - wanted).max() > 1e-2 * size


def test_sums_of_operations() -> None:
    from evidence.leger import sums

    # (3.24) has multiplications alone, and lacks a factor n / 6; (3.26) lacks the subtractions.
    assert sums.counted() == (sum((n + 1) * n + n * n for n in range(1, 6)), 36)
    assert sum(n * n for n in range(1, 6)) == 55 == 6 * 5 * 11 // 6
    # (3.43): a column behind l has two products more, in two blocks.
    assert [sums.second_derivative(l) for l in range(1, 7)] == [270 - 18 * l for l in range(1, 7)]  # noqa: E741
    assert sum(270 - 18 * l for k in range(1, 7) for l in range(k, 7)) == 4032  # noqa: E741
    text = sums.sums()
    for where, printed, right in (
        ("3.45", 5761, 4032),
        ("3.46", 2982, 42 * 71),
        ("3.47a", 13314, 21 * (71 + 432 + 36 - 1 + 90 + 6 - 1)),
        ("3.48a", 23796, 257 + 1482 + 5761 + 2982 + 13314 + 210),
    ):
        (row,) = [line for line in text.splitlines() if line.startswith(f"| ({where})") and f"| {printed} |" in line]
        assert row.endswith(f"| {right} |")
    assert "| 22256 |" in text  # 257 + 1482 + 4032 + 2982 + 13293 + 210


def test_4_13_to_4_17_and_4_34_lead_to_the_target() -> None:
    """The step of (4.15) with t_e of (4.34): with a1 - p1 it takes up the error to second order."""
    here = FANUC.fk(Q)
    position, axis = here[:3, 3], here[:3, 2]
    e_des = axis + 1e-3 * RNG.normal(size=3)
    e_des /= np.linalg.norm(e_des)
    target = position + 1e-3 * RNG.normal(size=3)

    def error(q: F64) -> F64:
        """h of (4.7), d = L."""
        frame = FANUC.fk(q)
        return np.concatenate([LENGTH * (frame[:3, 2] - e_des), frame[:3, 3] - target])

    jn = SCALE * FANUC.jacobian(Q)
    turn = LENGTH * np.cross(axis, e_des)
    before, right, printed = (
        float(np.linalg.norm(error(np.asarray(Q + step, dtype=np.float64))))
        for step in (
            np.zeros(6),
            np.linalg.solve(jn, np.append(turn, target - position)),
            np.linalg.solve(jn, np.append(turn, position - target)),
        )
    )
    assert right < 1e-2 * before
    assert printed > before
    # (4.13) is (3.61) with the other sign; J_p by (4.11), h in its range to first order.
    jp = np.block([[-cross_matrix(axis), np.zeros((3, 3))], [np.zeros((3, 3)), np.eye(3)]]) @ jn
    assert np.linalg.norm(error(Q - np.linalg.pinv(jp) @ error(Q))) < 1e-2 * before
    assert np.linalg.norm(error(Q + np.linalg.pinv(jp) @ error(Q))) > 1.9 * before


def test_4_20_goes_downhill() -> None:
    """(3.60) with (4.18) gives - L (L'BL)^-1 L'(...): a rate of n joints, downhill; as printed, one number, uphill."""
    gradient = rd.ConditionNumber(LENGTH, squared=True).evaluate(FANUC, Q, 1)[1]
    bent = np.diag(RNG.uniform(1.0, 2.0, 6))
    along = np.linalg.solve(SCALE * FANUC.jacobian(Q), np.append(FANUC.fk(Q)[:3, 2], np.zeros(3)))[:, None]
    share = np.linalg.solve(along.T @ bent @ along, along.T @ gradient)
    assert share.shape == (1,)
    assert gradient @ (-along @ share) < 0.0 < gradient @ (along @ share)
    # Neither moves the tool off its axis.
    tool = FANUC.jacobian(Q) @ (along @ share)
    np.testing.assert_allclose(np.append(np.cross(tool[:3], FANUC.fk(Q)[:3, 2]), tool[3:]), 0.0, atol=1e-12)
