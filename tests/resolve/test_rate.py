"""The methods at the level of rates: the printed formulas in numpy, what counts, what the objective adds."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st

from tests.resolve.rates import F64, FANUC, METHODS, TWIST, WRIST, Q

ROBOTS = {name: rd.robots.get(name) for name in ("fanuc_m710ic50_milling", "ur5e", "stanford_arm", "panda")}
PART = np.array([[0.0, -1.0, 0.0, 0.6], [0.0, 0.0, -1.0, -0.2], [1.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
TASKS = {
    "axisymmetric": rd.Task.axisymmetric((1.0, -2.0, 2.0)),
    "full": rd.Task.full(),
    "position": rd.Task.position(),
    "base": rd.Task(("line", (1, 2, 3)), ("plane", (0, 1, 1)), "base"),
    "part": rd.Task(("plane", (0, 1, 1)), ("plane", (3, 1, 0)), PART),
}
CUTOFF = 1e-9
"""Below this part of the largest a singular value of numpy's references is zero; postures nearer to it are left out."""


def pinv(a: F64) -> F64:
    inverse = np.linalg.pinv(a, rcond=CUTOFF)
    return np.asarray(inverse, np.float64)


def projector(robot: rd.Robot, task: rd.Task, q: F64) -> F64:
    """T on twists at the tool point, from the one at the point that the task speaks of."""
    T = task.projector(robot, q)
    if "<part>" not in repr(task):
        return T
    x, y, z = PART[:3, 3] - robot.fk(q)[:3, 3]
    # v at the part's origin is v + w x arm.
    shift = np.eye(6)
    shift[3:, :3] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    moved: F64 = np.linalg.inv(shift) @ T @ shift
    return moved


def chan_dubey(robot: rd.Robot, q: F64) -> F64:
    """1 + |dH/dq| with H = sum (range)^2 / (4 (q_max - q) (q - q_min)) over joints, per half range."""
    middle, half = 0.5 * (robot.q_min + robot.q_max), 0.5 * (robot.q_max - robot.q_min)
    bounded = np.isfinite(half)
    x = np.where(bounded, (q - np.where(bounded, middle, 0.0)) / np.where(bounded, half, 1.0), 0.0)
    gradient = x / (1.0 - x**2) ** 2 / np.where(bounded, half, 1.0)
    weights: F64 = 1.0 + np.abs(gradient)
    return weights


def reference(name: str, robot: rd.Robot, task: rd.Task, q: F64, t: F64, h: F64) -> F64:
    """What the thesis prints, by pseudo-inverses."""
    J, T = robot.jacobian(q), projector(robot, task, q)
    free, one = np.eye(6) - T, np.eye(robot.n)
    JT = T @ J
    answer: F64
    if name == "TwistDecomposition":  # (3.8), and what the null space of J takes of h
        answer = pinv(J) @ T @ t + pinv(J) @ free @ J @ h + (one - pinv(J) @ J) @ h
    elif name == "ResolvedRate":  # (2.24)
        answer = pinv(J) @ t
    elif name == "WeightedInverse":  # (2.38), (2.39)
        root = np.diag(1.0 / np.sqrt(chan_dubey(robot, q)))
        answer = h + root @ pinv(JT @ root) @ (T @ t - JT @ h)
    elif name == "TaskPriority":  # (2.37)
        first = pinv(JT) @ T @ t
        N1 = one - pinv(JT) @ JT
        J2 = free @ J @ N1
        second = first + pinv(J2) @ (free @ t - free @ J @ first)
        answer = second + N1 @ (one - pinv(J2) @ J2) @ N1 @ h
    elif name == "VirtualJoint":  # (2.76) to (2.79): a column for every free twist of unit size
        values, vectors = np.linalg.eigh(0.5 * (free0(robot, task, q) + free0(robot, task, q).T))
        E = np.linalg.inv(arm(robot, task, q)) @ vectors[:, values > 0.5]
        answer = h + (pinv(np.hstack([J, E])) @ (t - J @ h))[: robot.n]
    else:  # (2.25), also by reflections (2.50) and after an elimination (2.75)
        answer = pinv(JT) @ T @ t + (one - pinv(JT) @ JT) @ h
    return answer


def free0(robot: rd.Robot, task: rd.Task, q: F64) -> F64:
    """1 - T at the point that the task speaks of."""
    rest: F64 = np.eye(6) - task.projector(robot, q)
    return rest


def arm(robot: rd.Robot, task: rd.Task, q: F64) -> F64:
    """From twists at the tool point to twists at the point that the task speaks of."""
    shift = np.eye(6)
    if "<part>" in repr(task):
        x, y, z = PART[:3, 3] - robot.fk(q)[:3, 3]
        shift[3:, :3] = -np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return shift


def posture(robot: rd.Robot, rng: np.random.Generator) -> F64:
    low, high = np.maximum(robot.q_min, -2.5), np.minimum(robot.q_max, 2.5)
    return rng.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("name", METHODS)
def test_step_is_the_printed_formula(name: str, robot: str, task: str) -> None:
    arm_, what = ROBOTS[robot], TASKS[task]
    n = arm_.n
    rng = np.random.default_rng(3)
    w, middle = rng.uniform(0.0, 0.1, n), rng.uniform(-0.5, 0.5, n)
    solver = METHODS[name](arm_, what, rd.PosturePull(w, middle=middle), limits=False, damping=1e-6, length=0.4)
    compared = 0
    for _ in range(10):
        q, t = posture(arm_, rng), rng.uniform(-1.0, 1.0, 6)
        h = w * (middle - q)
        h *= min(1.0, 0.3 / np.abs(h).max())
        sigma = np.linalg.svd(arm_.jacobian(q), compute_uv=False)
        got = solver.step(q, t)
        assert np.isfinite(got).all()
        if sigma[5] < 0.02 or solver.step_status != "regular":
            continue
        compared += 1
        # Condition numbers of the systems are below sigma_1 / 0.02, squared where two systems follow each other.
        scale = np.abs(got).max() + np.abs(h).max() + 1.0
        tolerance = 100 * np.finfo(float).eps * (sigma[0] / 0.02) ** 2 * scale
        np.testing.assert_allclose(got, reference(name, arm_, what, q, t, h), rtol=0, atol=tolerance)
        T = np.eye(6) if name == "ResolvedRate" else projector(arm_, what, q)
        np.testing.assert_allclose(T @ arm_.jacobian(q) @ got, T @ t, rtol=0, atol=tolerance * (1.0 + sigma[0]))
    assert compared >= 5


@given(
    st.sampled_from(sorted(METHODS)),
    st.sampled_from(sorted(ROBOTS)),
    st.sampled_from(sorted(TASKS)),
    st.integers(0, 2**32 - 1),
)
def test_task_is_met_whatever_the_objective(name: str, robot: str, task: str, seed: int) -> None:
    arm_, rng = ROBOTS[robot], np.random.default_rng(seed)
    solver = METHODS[name](arm_, TASKS[task], rd.LimitBarrier(), limits=False)
    q, t = posture(arm_, rng), rng.uniform(-1.0, 1.0, 6)
    dq = solver.step(q, t)
    assert np.isfinite(dq).all()
    if solver.step_status == "regular":
        T = np.eye(6) if name == "ResolvedRate" else projector(arm_, TASKS[task], q)
        J = arm_.jacobian(q)
        # Shortest over longest row is at least 1e-3, the default of damping: three digits lost, six where two systems
        # follow each other.
        atol = 1e-9 * (1.0 + np.abs(dq).max()) * (1.0 + np.abs(J).max())
        np.testing.assert_allclose(T @ J @ dq, T @ t, rtol=0, atol=atol)


@pytest.mark.parametrize("name", sorted(METHODS))
def test_exact_singularities_of_the_arm_do_not_matter_where_the_task_is_regular(name: str) -> None:
    # At the wrist's singularity a position alone is regular for a method that looks at the task's rows only.
    q = np.array([0.3, 0.2, -0.4, 0.5, 0.0, 0.9])
    solver = METHODS[name](WRIST, rd.Task.position(), limits=False)
    dq = solver.step(q, TWIST)
    J = WRIST.jacobian(q)
    if name in ("GradientProjection", "WeightedInverse", "Householder", "Elimination", "VirtualJoint"):
        assert solver.step_status == "regular"
        np.testing.assert_allclose(J[3:] @ dq, TWIST[3:], rtol=0, atol=1e-13)
    else:
        assert np.isfinite(dq).all()


def test_free_components_of_the_twist_count_only_where_documented() -> None:
    axis = FANUC.fk(Q)[:3, 2]
    spin = np.r_[axis, 0.0, 0.0, 0.0]
    for name, method in METHODS.items():
        solver = method(FANUC, rd.Task.axisymmetric(), limits=False)
        difference = solver.step(Q, TWIST + 0.5 * spin) - solver.step(Q, TWIST)
        if name in ("ResolvedRate", "TaskPriority"):
            np.testing.assert_allclose(FANUC.jacobian(Q) @ difference, 0.5 * spin, atol=1e-12)
        elif name == "VirtualJoint":
            # The virtual joint takes a part of the spin, so that the sum of squares is least: s^2 + |x (0.5 - s)|^2.
            unit = np.linalg.solve(FANUC.jacobian(Q), spin)
            np.testing.assert_allclose(difference, 0.5 * unit / (1.0 + unit @ unit), atol=1e-12)
        else:
            np.testing.assert_allclose(difference, 0.0, atol=1e-12)


def test_length_does_not_matter_where_nothing_is_damped() -> None:
    for method in METHODS.values():
        short, long = (
            method(FANUC, rd.Task.axisymmetric(), rd.JointLimits(), length=x, limits=False) for x in (0.1, 3.0)
        )
        np.testing.assert_allclose(short.step(Q, TWIST), long.step(Q, TWIST), rtol=0, atol=1e-11)


def test_weights_of_the_weighted_inverse() -> None:
    w = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    solver = rd.WeightedInverse(FANUC, rd.Task.axisymmetric(), weights=w, limits=False)
    T = rd.Task.axisymmetric().projector(FANUC, Q)
    root = np.diag(w**-0.5)
    wanted = root @ pinv(T @ FANUC.jacobian(Q) @ root) @ T @ TWIST
    np.testing.assert_allclose(solver.step(Q, TWIST), wanted, rtol=0, atol=1e-12)
    # A heavy joint hardly moves.
    w[0] = 1e8
    heavy = rd.WeightedInverse(FANUC, rd.Task.axisymmetric(), weights=w, limits=False, damping=1e-9)
    assert abs(heavy.step(Q, TWIST)[0]) < 1e-6


@pytest.mark.parametrize("scaling", ["gradient", "newton"])
def test_objective_falls(scaling: Any) -> None:
    index = rd.ConditionNumber(0.5, squared=True)
    for name, method in METHODS.items():
        solver = method(FANUC, rd.Task.axisymmetric(), index, scaling=scaling, limits=False)
        moved = solver.step(Q, np.zeros(6))
        _, gradient = index.evaluate(FANUC, Q, 1)
        if name in ("ResolvedRate", "TaskPriority"):  # they spend the spin on the twist
            np.testing.assert_allclose(moved, 0.0, atol=1e-12)
        else:
            assert gradient @ moved < -1e-3, name
            np.testing.assert_allclose((FANUC.jacobian(Q) @ moved)[3:], 0.0, atol=1e-13)


def test_gain_multiplies_the_secondary_motion() -> None:
    for method in METHODS.values():
        none, one, three = (
            method(FANUC, rd.Task.axisymmetric(), rd.JointLimits(), gain=gain, limits=False).step(Q, TWIST)
            for gain in (0.0, 1.0, 3.0)
        )
        np.testing.assert_allclose(three - none, 3.0 * (one - none), rtol=0, atol=1e-13)
        np.testing.assert_allclose(none, method(FANUC, rd.Task.axisymmetric(), limits=False).step(Q, TWIST), atol=1e-13)
