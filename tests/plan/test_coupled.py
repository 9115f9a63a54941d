"""Plans and maps under limits on combinations of joints."""

import pickle

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64

KAPPA = rd.ConditionNumber(0.48, squared=True)
MILL = rd.robots.get("fanuc_m710ic50_milling")
PAIR = {1: -1.0, 2: 1.0}
DEGREE = np.pi / 180.0


def value(q: F64, terms: dict[int, float] = PAIR) -> F64:
    return np.asarray(sum(c * q[..., joint] for joint, c in terms.items()))


def line(robot: rd.Robot, reach: tuple[float, float, float], points: int = 15) -> rd.Toolpath:
    """A straight line from the posture of least condition number, the tool's axis as there."""
    tool = robot.fk(rd.minimum_condition_posture(robot, starts=8).q)
    position = tool[:3, 3] + np.linspace(0.0, 1.0, points)[:, None] * np.array(reach)
    return rd.Toolpath(position, np.tile(tool[:3, 2], (points, 1)))


PATH = line(MILL, (0.05, 0.12, -0.05))
FREE = rd.plan(MILL, PATH, objective=KAPPA, progress=False)


@pytest.mark.parametrize("criterion", ["minimax", "integral"])
def test_a_plan_keeps_a_limit_on_two_joints(criterion: str) -> None:
    free = rd.plan(MILL, PATH, objective=KAPPA, criterion=criterion, progress=False)
    # Joint 3 may only go down to somewhat above where it would like to be beside joint 2.
    reachable = rd.redundancy_map(MILL, PATH, objective=KAPPA, n_angles=180)
    assert reachable.feasible.any()
    at = value(free.q)
    for share in (0.1, 0.3):
        high = at.max() - share * np.ptp(at)
        robot = MILL.with_limits(coupled=[(PAIR, -np.inf, high)])
        kept = rd.plan(robot, PATH, objective=KAPPA, criterion=criterion, progress=False)
        assert kept.failure is None
        assert value(kept.q).max() <= high + 1e-9
        assert value(free.q).max() > high + 1e-3
        assert kept.limit_margin >= -1e-9
        worst = criterion == "minimax"
        costs = [plan.max_condition_number if worst else float(plan.value.mean()) for plan in (free, kept)]
        assert costs[1] >= costs[0] * (1.0 - 1e-9)
        position, axis = kept.position_error, kept.axis_error
        assert max(position.max(), axis.max()) <= 1e-9


def test_seven_joints_on_a_limit_all_along() -> None:
    """Equal to holding the combination by hand: a range of next to nothing is a plan of one freedom less."""
    panda = rd.robots.get("panda")
    path = line(panda, (0.04, 0.08, -0.05))
    free = rd.plan(panda, path, objective=KAPPA, progress=False)
    terms = {1: 1.0, 3: 1.0}
    high = float(value(free.q, terms).min() + 0.3 * np.ptp(value(free.q, terms)))
    robot = panda.with_limits(coupled=[(terms, -np.inf, high)])
    kept = rd.plan(robot, path, objective=KAPPA, progress=False)
    assert kept.failure is None
    assert value(kept.q, terms).max() <= high + 1e-9
    assert free.max_condition_number <= kept.max_condition_number * (1.0 + 1e-9)


def test_what_is_in_the_way_is_named() -> None:
    low = float(value(FREE.q).max() + 15.0 * DEGREE)
    failure = rd.plan(MILL.with_limits(coupled=[(PAIR, low, np.inf)]), PATH, objective=KAPPA, progress=False).failure
    assert failure is not None
    assert (failure.cause, failure.joint, failure.combination) == ("joint limit", None, "joint 3 - joint 2")
    assert str(failure).startswith("point 0: joint limit of joint 3 - joint 2, which would have to go about ")
    # In degrees of the combination, not of a distance of postures.
    assert failure.excess == pytest.approx(15.0 * DEGREE, abs=5.0 * DEGREE)
    again = pickle.loads(pickle.dumps(failure))
    assert again == failure
    assert str(again) == str(failure)


def test_a_map_leaves_out_what_is_beyond() -> None:
    high = float(np.median(value(FREE.q)))
    free = rd.redundancy_map(MILL, PATH, objective=KAPPA, n_angles=90)
    robot = MILL.with_limits(coupled=[(PAIR, -np.inf, high)])
    kept = rd.redundancy_map(robot, PATH, objective=KAPPA, n_angles=90)
    by_hand = rd.redundancy_map(MILL, PATH, objective=KAPPA, n_angles=90, feasible=lambda q: value(q) <= high)
    np.testing.assert_array_equal(kept.feasible, by_hand.feasible)
    np.testing.assert_array_equal(kept.value[kept.feasible], free.value[kept.feasible])
    assert 0 < kept.feasible.sum() < free.feasible.sum()
    whole = rd.redundancy_map(robot, PATH, objective=KAPPA, n_angles=90, limits=False)
    assert whole.feasible.sum() >= free.feasible.sum()


def test_whole_turns_along_a_plan_obey_it() -> None:
    """Joints 4 and 6 of a wrist turn more than once: only copies whose sum is small are allowed."""
    low, high = MILL.q_min.copy(), MILL.q_max.copy()
    low[[3, 5]], high[[3, 5]] = -2.0 * np.pi, 2.0 * np.pi
    arm = MILL.with_limits(low, high)
    free = rd.plan(arm, PATH, objective=KAPPA, progress=False)
    total = value(free.q, {3: 1.0, 5: 1.0})
    for shift in (-2.0 * np.pi, 2.0 * np.pi):
        ends = (float(total.min()) + shift - 0.1, float(total.max()) + shift + 0.1)
        robot = arm.with_limits(coupled=[({3: 1.0, 5: 1.0}, *ends)])
        plan = rd.plan(robot, PATH, objective=KAPPA, progress=False)
        assert plan.failure is None
        assert robot.within_limits(plan.q).all()
        assert plan.max_condition_number == pytest.approx(free.max_condition_number, rel=1e-6)


def test_a_closed_path_comes_back_within_it() -> None:
    arm = rd.robots.get("ur5e")
    middle = arm.fk(np.array([0.3, -1.2, 1.5, -1.8, -1.5, 0.2]))
    turn = np.linspace(0.0, 2.0 * np.pi, 16)
    position = middle[:3, 3] + 0.05 * np.stack([np.cos(turn) - 1.0, np.sin(turn), 0.0 * turn], axis=1)
    position[-1] = position[0]
    path = rd.Toolpath(position, np.tile(middle[:3, 2], (16, 1)))
    free = rd.plan(arm, path, objective=KAPPA, closed=True, progress=False)
    terms = {1: 1.0, 2: 1.0}
    at = value(free.q, terms)
    robot = arm.with_limits(
        np.full(6, -np.pi), np.full(6, np.pi), coupled=[(terms, -np.inf, float(at.max() - 0.2 * np.ptp(at)))]
    )
    plan = rd.plan(robot, path, objective=KAPPA, closed=True, progress=False)
    if plan.failure is None:
        assert robot.within_limits(plan.q).all()
        np.testing.assert_allclose(plan.q[0], plan.q[-1], atol=1e-9)
    else:
        assert plan.failure.combination == "joint 2 + joint 3"
