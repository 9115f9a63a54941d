"""The methods at the level of rates, called from Python: against numpy, limits, singularities, memory, threads."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

F64 = NDArray[np.float64]

METHODS: dict[str, Any] = {
    method.__name__: method
    for method in (
        rd.TwistDecomposition,
        rd.ResolvedRate,
        rd.GradientProjection,
        rd.WeightedInverse,
        rd.TaskPriority,
        rd.Householder,
        rd.Elimination,
        rd.VirtualJoint,
    )
}
FANUC = rd.robots.get("fanuc_m710ic50_milling")
WRIST = rd.robots.get("fanuc_m710ic50")
ROBOTS = {name: rd.robots.get(name) for name in ("fanuc_m710ic50_milling", "ur5e", "stanford_arm", "panda")}
PART = np.array([[0.0, -1.0, 0.0, 0.6], [0.0, 0.0, -1.0, -0.2], [1.0, 0.0, 0.0, 0.5], [0.0, 0.0, 0.0, 1.0]])
TASKS = {
    "axisymmetric": rd.Task.axisymmetric((1.0, -2.0, 2.0)),
    "full": rd.Task.full(),
    "position": rd.Task.position(),
    "base": rd.Task(("line", (1, 2, 3)), ("plane", (0, 1, 1)), "base"),
    "part": rd.Task(("plane", (0, 1, 1)), ("plane", (3, 1, 0)), PART),
}
TWIST = np.array([0.1, -0.2, 0.3, 0.05, 0.02, -0.04])
Q = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
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


@pytest.mark.parametrize("name", METHODS)
def test_out_is_filled_and_returned(name: str) -> None:
    solver = METHODS[name](FANUC, rd.Task.axisymmetric(), rd.JointLimits())
    wanted = solver.step(Q, TWIST)
    assert wanted.shape == (6,)
    out = np.full(6, np.nan)
    assert solver.step(Q, TWIST, out=out) is out
    np.testing.assert_array_equal(out, wanted)
    q = Q.copy()
    assert solver.step(q, TWIST, out=q) is q
    np.testing.assert_array_equal(q, wanted)


def _locked() -> F64:
    out = np.full(6, 7.0)
    out.setflags(write=False)
    return out


S = rd.TwistDecomposition(FANUC, rd.Task.axisymmetric(), rd.JointLimits())
AXIAL = rd.Task.axisymmetric()
NAN = np.nan
TALL = rd.Robot.from_dh(a=[0.1] * 16, d=[0.0] * 16, alpha=[0.3] * 16, theta=[0.0] * 16)
WRONG: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "short q": (lambda: S.step(Q[:5], TWIST), rd.ShapeError, r"q: got shape \(5,\), expected \(6,\)"),
    "many q": (lambda: S.step([Q, Q], TWIST), rd.ShapeError, r"q: got shape \(2, 6\), expected \(6,\)"),
    "NaN q": (lambda: S.step([0, 0, NAN, 0, 0, 0], TWIST), rd.NonFiniteError, r"q\[2\] is NaN"),
    "short twist": (lambda: S.step(Q, TWIST[:3]), rd.ShapeError, r"twist: got shape \(3,\)"),
    "infinite twist": (lambda: S.step(Q, [0, 0, 0, 0, np.inf, 0]), rd.NonFiniteError, r"twist\[4\] is inf"),
    "text": (lambda: S.step("q", TWIST), rd.InvalidValueError, "q is 'q'"),
    "locked out": (lambda: S.step(Q, TWIST, out=_locked()), rd.ShapeError, "read-only"),
    "short out": (lambda: S.step(Q, TWIST, out=np.zeros(5)), rd.ShapeError, r"out: got shape \(5,\)"),
    "narrow out": (lambda: S.step(Q, TWIST, out=np.zeros(6, np.float32)), rd.ShapeError, "out"),
    "short target": (lambda: S.solve([1, 0, 0, 1, 0]), rd.ShapeError, r"target: got shape \(5,\)"),
    "no axis": (lambda: S.solve([1, 0, 0, 0, 0, 0], Q), rd.InvalidValueError, "axis is"),
    "short q0": (lambda: S.solve([1, 0, 0, 0, 0, 1], Q[:5]), rd.ShapeError, r"q0: got shape \(5,\)"),
    "NaN targets": (lambda: S.follow_chunk([[NAN, 0, 0, 0, 0, 1]], Q), rd.NonFiniteError, r"targets\[0\] is NaN"),
    "objective": (lambda: S.with_objective(3), TypeError, "got <class 'int'>, expected an Objective"),  # type: ignore[arg-type]
    "function": (lambda: rd.TwistDecomposition(FANUC, AXIAL, lambda q: 0.0), TypeError, "function"),  # type: ignore[arg-type]
    "short w": (lambda: S.with_objective(rd.PosturePull([1] * 5)), rd.ShapeError, r"w: got shape \(5,\)"),
    "short k": (lambda: S.with_objective(rd.PosturePull([1] * 6, [1] * 7)), rd.ShapeError, r"k: got shape \(7,\)"),
    "middle": (
        lambda: S.with_objective(rd.PosturePull([1] * 6, middle=[0.0])),
        rd.ShapeError,
        r"middle: got shape \(1,\)",
    ),
    "one w": (lambda: rd.PosturePull(1.0), rd.ShapeError, r"w: got shape \(\)"),
    "NaN w": (lambda: rd.PosturePull([1, NAN]), rd.NonFiniteError, r"w\[1\] is NaN"),
    "NaN k": (lambda: rd.PosturePull([1], [NAN]), rd.NonFiniteError, r"k\[0\] is NaN"),
    "threshold": (lambda: rd.PosturePull([1], threshold=0.0), rd.InvalidValueError, "threshold is 0"),
    "pull length": (lambda: rd.PosturePull([1], length=-2.0), rd.InvalidValueError, "length is -2"),
    "scaling": (lambda: rd.Householder(FANUC, AXIAL, scaling="x"), rd.InvalidValueError, 'scaling is "x"'),  # type: ignore[arg-type]
    "gain": (lambda: rd.Householder(FANUC, AXIAL, gain=-1.0), rd.InvalidValueError, "gain is -1"),
    "relaxation": (lambda: rd.Householder(FANUC, AXIAL, relaxation=NAN), rd.InvalidValueError, "relaxation is NaN"),
    "length": (lambda: rd.Householder(FANUC, AXIAL, length=0.0), rd.InvalidValueError, "length is 0"),
    "damping": (lambda: rd.Householder(FANUC, AXIAL, damping=1.0), rd.InvalidValueError, "damping is 1"),
    "dt": (lambda: rd.Householder(FANUC, AXIAL, dt=np.inf), rd.InvalidValueError, "dt is inf"),
    "iterations": (lambda: rd.Householder(FANUC, AXIAL, iterations=0), rd.InvalidValueError, "iterations is 0"),
    "tolerance": (lambda: rd.Householder(FANUC, AXIAL, tolerance=NAN), rd.InvalidValueError, "tolerance is NaN"),
    "weights": (
        lambda: rd.WeightedInverse(FANUC, AXIAL, weights=[1.0] * 5),
        rd.ShapeError,
        r"weights: got shape \(5,\)",
    ),
    "no weight": (lambda: rd.WeightedInverse(FANUC, AXIAL, weights=[1, 1, 1, 1, 1, -2]), rd.InvalidValueError, "-2"),
    "NaN weight": (
        lambda: rd.WeightedInverse(FANUC, AXIAL, weights=[1, 1, 1, NAN, 1, 1]),
        rd.NonFiniteError,
        r"weights\[3\]",
    ),
    "no room": (lambda: rd.VirtualJoint(TALL, AXIAL), rd.InvalidValueError, "16 joints and 1 virtual"),
    "base class": (lambda: rd.RateSolver(), TypeError, "RateSolver"),
}


@pytest.mark.parametrize("case", WRONG)
def test_bad_input(case: str) -> None:
    call, kind, message = WRONG[case]
    with pytest.raises(kind, match=message) as caught:
        call()
    assert type(caught.value) is kind


def test_locked_out_stays_what_it_was() -> None:
    out = _locked()
    with pytest.raises(rd.ShapeError):
        S.step(Q, TWIST, out=out)
    assert (out == 7.0).all()


@pytest.mark.parametrize("name", METHODS)
def test_speed_limits_slow_all_joints_down_together(name: str) -> None:
    solver = METHODS[name](FANUC, AXIAL)
    free = METHODS[name](FANUC, AXIAL, limits=False)
    slow = solver.step(Q, TWIST)
    assert solver.step_status == "regular"
    np.testing.assert_array_equal(slow, free.step(Q, TWIST))
    fast = solver.step(Q, 100.0 * TWIST)
    assert solver.step_status == "limited"
    assert np.max(np.abs(fast) / FANUC.qd_max) == pytest.approx(1.0, rel=1e-12)
    np.testing.assert_allclose(fast / np.linalg.norm(fast), slow / np.linalg.norm(slow), rtol=0, atol=1e-10)


@pytest.mark.parametrize("name", METHODS)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 1e-12, 1e-4, 0.5]), st.floats(0.0, 50.0))
def test_no_step_crosses_a_limit(name: str, seed: int, room: float, speed: float) -> None:
    rng = np.random.default_rng(seed)
    upper = rng.random(6) < 0.5
    q = np.where(upper, WRIST.q_max - room, WRIST.q_min + room)
    solver = METHODS[name](WRIST, AXIAL, rd.JointLimits(), dt=0.01)
    rates = solver.step(q, speed * rng.uniform(-1.0, 1.0, 6))
    assert np.isfinite(rates).all()
    assert (np.abs(rates) <= WRIST.qd_max * (1.0 + 1e-12)).all()
    slack = 4e-16 * np.abs(q).max() + 1e-15
    assert (q + 0.01 * rates <= WRIST.q_max + slack).all()
    assert (q + 0.01 * rates >= WRIST.q_min - slack).all()


def test_joint_at_its_limit_stops_and_one_beyond_comes_back() -> None:
    solver = rd.TwistDecomposition(FANUC, AXIAL, dt=0.01)
    free = rd.TwistDecomposition(FANUC, AXIAL, limits=False)
    for joint in range(6):
        q = Q.copy()
        high, low = FANUC.q_max[joint], FANUC.q_min[joint]
        for value, sign in ((high, 1.0), (high + 0.1, 1.0), (low - 0.1, -1.0)):
            q[joint] = value
            out = free.step(q, TWIST)
            twist = TWIST if out[joint] * sign > 0.0 else -TWIST
            assert solver.step(q, twist)[joint] == 0.0
            assert solver.step_status == "limited"
            assert solver.step(q, -twist)[joint] * sign < 0.0


SINGULAR = {
    "wrist": np.array([0.3, 0.2, -0.4, 0.5, 0.0, 0.9]),
    "zero": np.zeros(6),
}


@pytest.mark.parametrize("kind", SINGULAR)
@pytest.mark.parametrize("name", METHODS)
def test_singular_postures(name: str, kind: str) -> None:
    q = SINGULAR[kind]
    assert np.linalg.cond(WRIST.jacobian(q)) > 1e9
    rng = np.random.default_rng(5)
    for limits in (True, False):
        solver = METHODS[name](WRIST, rd.Task.full(), rd.SingularityParameter(), limits=limits)
        for _ in range(10):
            t = rng.uniform(-1.0, 1.0, 6)
            rates = solver.step(q, t)
            assert np.isfinite(rates).all()
            assert solver.step_status in (("damped", "limited") if limits else ("damped",))
            # A' (A A' + lambda)^-1 b is at most |b| / (2 sqrt(lambda)) long, and lambda is damping^2 |A|^2 here.
            bound = np.linalg.norm(t) / (2e-3 * np.linalg.norm(WRIST.jacobian(q)))
            assert np.linalg.norm(rates) <= bound * (1.0 + 1e-6)


@pytest.mark.parametrize("distance", [1e-14, 1e-10, 1e-7, 1e-5, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("name", METHODS)
def test_near_a_singularity_rates_stay_bounded(name: str, distance: float) -> None:
    solver = METHODS[name](WRIST, rd.Task.full(), limits=False)
    rng = np.random.default_rng(6)
    size = np.linalg.norm(WRIST.jacobian(SINGULAR["wrist"]))
    for _ in range(10):
        q = SINGULAR["wrist"] + distance * rng.uniform(-1.0, 1.0, 6)
        t = rng.uniform(-1.0, 1.0, 6)
        # Never longer than |b| / (damping |A|) times the few units by which shortest row and singular value differ.
        assert np.linalg.norm(solver.step(q, t)) <= 10.0 * np.linalg.norm(t) / (1e-3 * size)


def test_objective_without_value_leaves_the_task() -> None:
    for name, method in METHODS.items():
        solver = method(FANUC, AXIAL, rd.CustomIndex(lambda q: (NAN, np.full(6, NAN))), limits=False)
        rates = solver.step(Q, TWIST)
        np.testing.assert_allclose(rates, method(FANUC, AXIAL, limits=False).step(Q, TWIST), rtol=0, atol=1e-15)
        assert solver.step_status == ("regular" if name == "ResolvedRate" else "task only")


@pytest.mark.parametrize("name", [name for name in METHODS if name != "ResolvedRate"])
def test_exception_of_an_objective_reaches_the_caller(name: str) -> None:
    broken = True

    def index(q: F64) -> tuple[float, F64]:
        if broken:
            raise LookupError("of the callable")
        return 0.5 * float(q @ q), q

    solver = METHODS[name](FANUC, AXIAL, rd.CustomIndex(index))
    with pytest.raises(LookupError, match="of the callable"):
        solver.step(Q, TWIST)
    with pytest.raises(LookupError, match="of the callable"):
        solver.follow_chunk([[1.0, 0.0, 0.5, 0.0, 0.0, 1.0]], Q)
    broken = False
    # It is gone with the call that raised it.
    pull = METHODS[name](FANUC, AXIAL, rd.PosturePull(np.ones(6), middle=np.zeros(6)))
    np.testing.assert_allclose(solver.step(Q, TWIST), pull.step(Q, TWIST), rtol=0, atol=1e-13)


def test_posture_pull_keeps_what_it_was_given() -> None:
    pull = rd.PosturePull([1, 2, 3], k=[4, 5, 6], threshold=7.0, length=0.5)
    np.testing.assert_array_equal(pull.w, [1, 2, 3])
    assert pull.k is not None
    np.testing.assert_array_equal(pull.k, [4, 5, 6])
    assert (pull.threshold, pull.length) == (7.0, 0.5)
    assert rd.PosturePull([1]).k is None
    pull.w[0] = 9.0
    assert pull.w[0] == 1.0
    solver = rd.TwistDecomposition(FANUC, AXIAL, rd.PosturePull(np.ones(6)))
    assert isinstance(solver.objective, rd.PosturePull)
    # Without a posture given it pulls to the middle of the ranges.
    middle = 0.5 * (FANUC.q_min + FANUC.q_max)
    given_middle = rd.TwistDecomposition(FANUC, AXIAL, rd.PosturePull(np.ones(6), middle=middle))
    np.testing.assert_array_equal(solver.step(Q, TWIST), given_middle.step(Q, TWIST))


class Pull:
    """(4.9): the anchor is where w_ps (4.6) reached its threshold, forgotten below it."""

    def __init__(self, w: F64, k: F64, middle: F64, threshold: float, length: float) -> None:
        self.w, self.k, self.middle, self.threshold, self.length = w, k, middle, threshold, length
        self.anchor: F64 | None = None

    def __call__(self, robot: rd.Robot, q: F64) -> F64:
        sigma = np.linalg.svd(np.diag([self.length] * 3 + [1.0] * 3) @ robot.jacobian(q), compute_uv=False)
        parameter = min(np.sqrt(sigma[0] / sigma[5] / np.prod(sigma)), 1e6)
        h: F64 = self.w * (self.middle - q)
        if parameter >= self.threshold:
            self.anchor = q.copy() if self.anchor is None else self.anchor
            h = h + self.k * parameter * (self.anchor - q)
        else:
            self.anchor = None
        longest = np.abs(h).max()
        return h * (0.3 / longest) if longest > 0.3 else h


def walk(step: Callable[[F64, F64], F64], ticks: int, dt: float) -> F64:
    """Postures of a robot whose tool swings to and fro past the singularity of the wrist."""
    q = np.array([0.2, 0.1, -0.3, 0.4, 0.8, 0.5])
    visited = [q]
    for tick in range(ticks):
        # Joint 5 would swing between 0.8 and 0.08.
        wanted = np.array([0.1, 0.05, 0.0, 0.0, -0.36 * np.pi * np.sin(np.pi * tick * dt), 0.0])
        q = q + dt * step(q, WRIST.jacobian(q) @ wanted)
        visited.append(q)
    return np.array(visited)


@pytest.mark.parametrize("length", [1.0, 0.3])
def test_posture_pull_is_the_printed_one_along_a_trajectory(length: float) -> None:
    rng = np.random.default_rng(7)
    w, k, middle = rng.uniform(0.0, 0.1, 6), rng.uniform(0.01, 0.1, 6), rng.uniform(-0.3, 0.3, 6)
    threshold = 6.0 if length == 1.0 else 50.0
    solver = rd.TwistDecomposition(WRIST, AXIAL, rd.PosturePull(w, k, middle, threshold, length), limits=False)
    pull = Pull(w, k, middle, threshold, length)
    anchors: list[bytes | None] = []

    def printed(q: F64, t: F64) -> F64:
        J, T = WRIST.jacobian(q), AXIAL.projector(WRIST, q)
        h = pull(WRIST, q)
        anchors.append(None if pull.anchor is None else pull.anchor.tobytes())
        return np.asarray(np.linalg.solve(J, T @ t + (np.eye(6) - T) @ J @ h), np.float64)

    wanted = walk(printed, 300, 0.02)
    np.testing.assert_allclose(walk(solver.step, 300, 0.02), wanted, rtol=0, atol=1e-9)
    assert solver.step_status == "regular"
    # The threshold was crossed three times to and fro, each time with a posture of its own.
    assert len({anchor for anchor in anchors if anchor is not None}) == 3
    assert anchors[0] is None

    # The memory matters: a solver that forgets after each tick goes elsewhere.
    def forgetful(q: F64, t: F64) -> F64:
        solver.reset()
        return solver.step(q, t)

    assert np.abs(walk(forgetful, 300, 0.02) - wanted).max() > 1e-3
    # reset() makes it what it was at first.
    solver.reset()
    np.testing.assert_allclose(walk(solver.step, 300, 0.02), wanted, rtol=0, atol=1e-9)


def test_memory_belongs_to_a_solver() -> None:
    w, k = np.full(6, 0.01), np.full(6, 0.05)
    solver = rd.TwistDecomposition(WRIST, AXIAL, rd.PosturePull(w, k, threshold=1e-3), limits=False)
    other = solver.with_objective(solver.objective)
    away = Q + 0.01
    first = solver.step(Q, TWIST)
    np.testing.assert_array_equal(first, other.step(Q, TWIST))
    remembering = solver.step(away, TWIST)
    fresh = solver.with_objective(solver.objective).step(away, TWIST)
    assert np.abs(remembering - fresh).max() > 1e-4
    np.testing.assert_array_equal(other.step(away, TWIST), remembering)
    solver.reset()
    np.testing.assert_array_equal(solver.step(away, TWIST), fresh)


def circle(points: int = 60) -> rd.Toolpath:
    """A level circle within reach, the tool down, one orientation all along."""
    turn = np.linspace(0.0, 2.0 * np.pi, points)
    position = np.array([1.2, 0.0, 0.3]) + 0.2 * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    down = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]])
    return rd.Toolpath(
        position, np.tile(down[:, 2], (points, 1)), np.tile(down, (points, 1, 1)), np.linspace(0, 6, points)
    )


TORCH = WRIST.with_tool(np.array([[0.8, 0, 0.6, 0.1], [0, 1, 0, 0], [-0.6, 0, 0.8, 0.3], [0, 0, 0, 1.0]]))


@pytest.mark.parametrize("name", METHODS)
def test_follow(name: str) -> None:
    path = circle()
    solver = METHODS[name](TORCH, AXIAL, rd.JointLimits(), relaxation=0.1)
    trajectory = rd.follow(solver, path, progress=False)
    assert trajectory.q.shape == (60, 6)
    assert trajectory.unreachable == []
    assert set(trajectory.status) == {"on target"}
    poses = TORCH.fk(trajectory.q)
    # Iterations end below 1e-12; products of frames add a few roundings of numbers up to 2.
    np.testing.assert_allclose(poses[:, :3, 3], path.position, rtol=0, atol=1e-11)
    np.testing.assert_allclose(poses[:, :3, 2], path.axis, rtol=0, atol=1e-11)
    if name == "ResolvedRate":
        assert path.rotation is not None
        assert solver.task == rd.Task.full()
        np.testing.assert_allclose(poses[:, :3, :3], path.rotation, rtol=0, atol=1e-11)
    index = rd.JointLimits().evaluate_many(TORCH, trajectory.q, 0)[0]
    np.testing.assert_allclose(trajectory.value, index, rtol=1e-12)


@pytest.mark.parametrize("name", METHODS)
def test_follow_without_correction(name: str) -> None:
    path = circle()
    solver = METHODS[name](TORCH, AXIAL, rd.JointLimits(), relaxation=0.1, correct=False, iterations=5)
    start = METHODS[name](TORCH, AXIAL).solve(path.targets(solver.task)[0])[0]
    trajectory = rd.follow(solver, path, start, progress=False)
    assert trajectory.iterations == 5 * 60
    # The last motion d spoils what is of second order: at most half of (sum |d|)^2 times the longest arm, here 3 m. At
    # the point reached it is less, but not by half.
    still = METHODS[name](TORCH, AXIAL, rd.JointLimits(), gain=0.1, limits=False)
    last = np.array([np.abs(still.step(q, np.zeros(6))).sum() for q in trajectory.q])
    worst = np.maximum(trajectory.position_error, trajectory.axis_error)
    assert (worst <= 0.5 * 3.0 * (2.0 * last) ** 2 + 1e-9).all()
    assert trajectory.unreachable == np.flatnonzero(worst > 1e-9).tolist()
    errors = np.linalg.norm(TORCH.fk(trajectory.q)[:, :3, 3] - path.position, axis=1)
    np.testing.assert_allclose(trajectory.position_error, errors, rtol=0, atol=1e-14)


def test_gain_is_for_step_and_relaxation_for_iterations() -> None:
    index, target = rd.JointLimits(), circle().targets()[0]
    start = rd.TwistDecomposition(TORCH, AXIAL).solve(target)[0]

    def moved(gain: float, relaxation: float) -> tuple[F64, F64]:
        settings: dict[str, Any] = {"gain": gain, "relaxation": relaxation, "limits": False}
        solver = rd.TwistDecomposition(TORCH, AXIAL, index, **settings, iterations=1, correct=False)
        return solver.step(start, np.zeros(6)), solver.solve(target, start)[0] - start

    (step, iteration), (half, same), (again, quarter) = moved(0.4, 0.4), moved(0.2, 0.4), moved(0.4, 0.1)
    # On target one iteration is one step. The target is met to 1e-12, and a difference of joints costs a few roundings.
    np.testing.assert_allclose(iteration, step, rtol=0, atol=1e-10)
    np.testing.assert_allclose(half, 0.5 * step, rtol=1e-12)
    np.testing.assert_allclose(quarter, 0.25 * iteration, rtol=0, atol=1e-10)
    np.testing.assert_array_equal(same, iteration)
    np.testing.assert_array_equal(again, step)


def test_secondary_task_lowers_the_objective_along_a_path() -> None:
    path, start = circle(), rd.follow(rd.ResolvedRate(TORCH, AXIAL), circle(), progress=False).q[0]
    index = rd.JointLimits()
    none = rd.follow(rd.TwistDecomposition(TORCH, AXIAL), path, start, progress=False)
    least = rd.follow(rd.OrthogonalSQP(TORCH, AXIAL, index), path, start, progress=False)
    for name in ("TwistDecomposition", "GradientProjection", "Householder", "Elimination", "VirtualJoint"):
        some = rd.follow(METHODS[name](TORCH, AXIAL, index, relaxation=0.1), path, start, progress=False)
        # Towards the pointwise minimum, never below it.
        assert (some.value >= least.value - 1e-9).all()
        assert some.value[-1] < index.evaluate(TORCH, none.q[-1], 0)
        assert some.value[-1] == pytest.approx(least.value[-1], abs=0.05)
    assert np.isnan(none.value).all()


def test_with_objective() -> None:
    for name, method in METHODS.items():
        index = rd.ConditionNumber(0.4)
        solver = method(FANUC, AXIAL, index, gain=2.0, limits=False)
        assert solver.length == 0.4
        plain = solver.with_objective()
        assert isinstance(plain, rd.RateSolver)
        assert plain.objective is None
        assert plain.task == solver.task
        assert plain.robot is solver.robot
        assert solver.objective is index
        np.testing.assert_array_equal(
            plain.step(Q, TWIST), method(FANUC, AXIAL, length=0.4, limits=False).step(Q, TWIST)
        )
        other = plain.with_objective(rd.JointLimits())
        wanted = method(FANUC, AXIAL, rd.JointLimits(), gain=2.0, length=0.4, limits=False)
        np.testing.assert_array_equal(other.step(Q, TWIST), wanted.step(Q, TWIST))
        assert name == type(solver).__name__


def test_solve() -> None:
    target = np.r_[1.2, 0.1, 0.3, 0.0, 0.0, -1.0]
    solver = rd.TwistDecomposition(TORCH, AXIAL, rd.JointLimits(), relaxation=0.1)
    q, value, status, iterations = solver.solve(target)
    assert status == "on target"
    assert iterations >= 20
    assert value == rd.JointLimits().evaluate(TORCH, q, 0)
    assert ((TORCH.q_min <= q) & (q <= TORCH.q_max)).all()
    np.testing.assert_allclose(TORCH.fk(q)[:3, 2:], np.stack([target[3:], target[:3]], axis=1), rtol=0, atol=1e-11)
    np.testing.assert_array_equal(solver.solve(target, seed=0)[0], q)
    far, value, status, _ = solver.solve([9.0, 0, 0, 0, 0, -1.0])
    assert status == "unreachable"
    assert np.isnan(far).all()
    assert np.isnan(value)
    near, _, status, _ = solver.solve([9.0, 0, 0, 0, 0, -1.0], Q)
    assert status == "unreachable"
    assert np.isfinite(near).all()


def run(solver: rd.RateSolver, seed: int, ticks: int = 2000) -> F64:
    rng = np.random.default_rng(seed)
    q, out = Q.copy(), np.empty(6)
    for _ in range(ticks):
        q = q + 1e-3 * solver.step(q, rng.uniform(-0.5, 0.5, 6), out=out)
    return q


def test_two_threads_with_two_solvers() -> None:
    def solvers() -> list[rd.RateSolver]:
        pull = rd.PosturePull(np.full(6, 0.1), np.full(6, 0.1), threshold=2.0)
        return [
            rd.TwistDecomposition(FANUC, AXIAL, pull),
            rd.VirtualJoint(FANUC, AXIAL, rd.CustomIndex(lambda q: (q @ q, 2 * q))),
        ]

    alone = [run(solver, seed) for seed, solver in enumerate(solvers())]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(run, solvers(), range(2)))
    np.testing.assert_array_equal(together, alone)


def test_two_threads_with_one_solver() -> None:
    # Without a memory there is nothing to share.
    solver = rd.TwistDecomposition(FANUC, AXIAL, rd.JointLimits())
    alone = [run(solver, seed) for seed in range(2)]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(run, [solver, solver], range(2)))
    np.testing.assert_array_equal(together, alone)
    path = circle()
    with ThreadPoolExecutor(2) as pool:
        steps = [rd.GradientProjection(TORCH, AXIAL, rd.JointLimits(), relaxation=0.1)] * 4
        found = list(pool.map(lambda step: rd.follow(step, path, progress=False).q, steps))
    for q in found[1:]:
        np.testing.assert_array_equal(q, found[0])
