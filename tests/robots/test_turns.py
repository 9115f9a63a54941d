"""Whole turns, middle and random postures with limits on both sides, on one, on none."""

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given
from hypothesis import strategies as st

from tests.reference.chain import F64

ROBOT = rd.robots.get("fanuc_m710ic50_milling")
KAPPA = rd.ConditionNumber(0.4855933, squared=True)
TASK = rd.Task.axisymmetric()


def limited(low: float, high: float) -> rd.Robot:
    """The robot with other limits of its first joint."""
    q_min, q_max = ROBOT.q_min.copy(), ROBOT.q_max.copy()
    q_min[0], q_max[0] = low, high
    return ROBOT.with_limits(q_min=q_min, q_max=q_max)


ends = st.floats(-20.0, 20.0)


@given(low=st.one_of(st.just(-np.inf), ends), room=st.one_of(st.just(np.inf), st.floats(0.1, 20.0)), angle=ends)
def test_turned_is_the_same_posture_within_the_limits_if_any_copy_is(low: float, room: float, angle: float) -> None:
    high = low + room if np.isfinite(low) else room - 10.0
    q = ROBOT.middle
    q[0] = angle
    turned = limited(low, high).turned(q)
    turns = (turned - q) / (2.0 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-12)
    np.testing.assert_array_equal(turned[1:], q[1:])
    copies = angle + 2.0 * np.pi * np.arange(-8, 9)
    inside = copies[(copies >= low + 1e-9) & (copies <= high - 1e-9)]
    if len(inside):
        assert low <= turned[0] <= high
    if len(inside) and np.isfinite(high - low):
        assert abs(turned[0] - 0.5 * (low + high)) <= abs(inside - 0.5 * (low + high)).min() + 1e-9


@pytest.mark.parametrize(
    ("low", "high", "middle"),
    [
        (-1.0, 3.0, 1.0),
        (-np.inf, np.inf, 0.0),
        (-np.inf, -4.0, -4.0),
        (-np.inf, 4.0, 0.0),
        (4.0, np.inf, 4.0),
        (-4.0, np.inf, 0.0),
    ],
)
def test_middle_and_random_postures_are_within_the_limits(low: float, high: float, middle: float) -> None:
    robot = limited(low, high)
    assert robot.middle[0] == middle
    postures = robot.random_postures(1000, seed=3)
    assert postures.shape == (1000, 6)
    assert ((postures >= robot.q_min) & (postures <= robot.q_max)).all()
    assert np.ptp(postures[:, 0]) > 0.9 * min(high - low, 2.0 * np.pi)
    np.testing.assert_array_equal(postures, robot.random_postures(1000, seed=3))
    assert (postures != robot.random_postures(1000, seed=4)).any()


def test_bad_postures_are_refused() -> None:
    with pytest.raises(rd.ShapeError, match="q"):
        ROBOT.turned(np.zeros(5))
    with pytest.raises(rd.NonFiniteError, match=r"q\[2\] is NaN"):
        ROBOT.turned([0.0, 0.0, np.nan, 0.0, 0.0, 0.0])


def target(robot: rd.Robot) -> F64:
    tool = robot.fk(np.array([0.3, 0.2, -0.3, 0.4, -1.2, 0.5]))
    return np.concatenate([tool[:3, 3], tool[:3, 2]])


@pytest.mark.parametrize("sides", [(-np.inf, -4.0), (4.0, np.inf)])
def test_solvers_answer_within_a_limit_on_one_side(sides: tuple[float, float]) -> None:
    robot = limited(*sides)
    solvers: list[rd.OrthogonalSQP | rd.TwistDecomposition | rd.QuadraticProgram] = [
        rd.OrthogonalSQP(robot, TASK, KAPPA),
        rd.TwistDecomposition(robot, TASK, KAPPA),
        rd.QuadraticProgram(robot, TASK, KAPPA),
    ]
    for solver in solvers:
        q, _, status, _ = solver.solve(target(robot), starts=60)
        assert status != "unreachable"
        assert ((robot.q_min <= q) & (q <= robot.q_max)).all()


def test_a_posture_that_a_turn_brings_inside_is_inside() -> None:
    robot = limited(-np.inf, -4.0)
    start = np.deg2rad([0.0, 20.0, -20.0, 0.0, -90.0, 0.0])
    found = rd.minimum_condition_posture(robot, start)
    free = rd.minimum_condition_posture(ROBOT, start)
    assert free.condition_number == pytest.approx(found.condition_number, abs=1e-9)
    assert found.within_limits == free.within_limits
    assert found.q[0] <= -4.0
