"""Plans and maps of robots that are not six revolute joints, some beside a search of their own over all postures."""

import itertools

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64

AXIS, FULL = rd.Task.axisymmetric(), rd.Task.full()
QUARTER = np.pi / 2


def five_joints() -> rd.Robot:
    """Return yaw, three pitches and roll, with a tool that leans against the last axis."""
    tool = np.eye(4)
    tool[:3] = np.array([[0, 0, 1, 0.1], [0, 1, 0, 0], [-1, 0, 0, 0.1]])
    a, d, alpha = [0, 0.4, 0.3, 0, 0], [0.3, 0, 0, 0, 0.15], [QUARTER, 0, 0, -QUARTER, 0]
    return rd.Robot.from_dh(a, d, alpha, [0] * 5, tool=tool, q_min=[-4] * 5, q_max=[4] * 5, name="five")


def slides(hand: int) -> tuple[list[float], list[float], list[float], list[float], str]:
    """Return the table of three slides across each other and `hand` turns."""
    a, d = [0.0] * (3 + hand), [0.0] * (2 + hand) + [0.2]
    alpha = [QUARTER, QUARTER, 0, -QUARTER, QUARTER, 0][: 3 + hand]
    theta = [QUARTER, QUARTER, 0, 0, 0, 0][: 3 + hand]
    return a, d, alpha, theta, "PPP" + "R" * hand


def scara(rail: bool = False) -> rd.Robot:
    """Return a SCARA, on a rail if asked for."""
    turn = [0.4, 0.3, 0, 0], [0.4, 0, 0, 0], [0, np.pi, 0, 0], [0.0] * 4
    robot = rd.Robot.from_dh(*turn, "RRPR", q_min=[-2.5, -2.5, 0, -6], q_max=[2.5, 2.5, 0.5, 6], name="scara")
    return rd.on_rail(robot, (1, 0, 0), -1.0, 1.0) if rail else robot


ROBOTS = {
    "five": (five_joints(), AXIS, [0.1, 0.3, -0.8, 0.4, 0.2], [0.6, 0.5, -1.0, 0.1, 0.9]),
    "PPPRR": (
        rd.Robot.from_dh(*slides(2), q_min=[-2, -2, -2, -4, -2], q_max=[2, 2, 2, 4, 2]),
        AXIS,
        [0.1, 0.3, -0.8, 0.4, 0.4],
        [0.6, 0.5, -1.0, 0.1, 0.9],
    ),
    "gantry": (
        rd.Robot.from_dh(*slides(3), q_min=[-2, -2, -2, -3, -2, -3], q_max=[2, 2, 2, 3, 2, 3]),
        AXIS,
        [0.1, 0.8, 0.5, 0.4, 0.5, 0.3],
        [0.6, 0.5, 0.6, 0.9, 0.8, 0.1],
    ),
    "stanford": (
        rd.robots.get("stanford_arm"),
        AXIS,
        [0.1, 0.8, 0.5, 0.4, 0.5, 0.3],
        [0.6, 0.5, 0.6, 0.9, 0.8, 0.1],
    ),
    "scara": (scara(), FULL, [0.1, 0.8, 0.1, 0.4], [0.6, 0.5, 0.3, 0.9]),
    "scara's axis": (scara(), AXIS, [0.1, 0.8, 0.1, 0.4], [0.6, 0.5, 0.3, 0.9]),
    "scara on a rail": (scara(rail=True), AXIS, [0.1, 0.1, 0.8, 0.1, 0.4], [0.2, 0.6, 0.5, 0.3, 0.9]),
    "planar": (rd.robots.get("planar_3r"), FULL, [0.1, 0.8, 0.4], [0.6, 0.5, 0.9]),
}


def joint_path(robot: rd.Robot, task: rd.Task, start: list[float], end: list[float], points: int) -> rd.Toolpath:
    """Return the path of the tool along a line in the joints."""
    frames = robot.fk(np.linspace(start, end, points))
    rotation = frames[:, :3, :3] if task == FULL else None
    return rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], rotation)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("criterion", ["motion", "minimax", "integral"])
def test_plan(name: str, criterion: str) -> None:
    robot, task, start, end = ROBOTS[name]
    path = joint_path(robot, task, start, end, 15)
    rows = robot.rows_in_use()[-min(3, robot.n) :]
    kappa = rd.ConditionNumber(0.4, rows=rows, squared=True)
    plan = rd.plan(robot, path, task, None if criterion == "motion" else kappa, criterion, n_angles=24, n_spare=8)
    assert plan.failure is None
    assert plan.refined
    assert max(plan.position_error.max(), plan.axis_error.max()) < 1e-9
    tools = robot.fk(plan.q)
    assert np.abs(tools[:, :3, 3] - path.position).max() < 1e-9
    assert np.abs(tools[:, :3, 2] - path.axis).max() < 1e-9
    if path.rotation is not None:
        assert np.abs(tools[:, :3, :3] - path.rotation).max() < 1e-9
    assert ((plan.q >= robot.q_min) & (plan.q <= robot.q_max)).all()
    if criterion == "minimax":
        assert plan.gap < 1e-3
        assert plan.value.max() <= kappa.evaluate_many(robot, np.linspace(start, end, 15), 0)[0].max() * (1 + 1e-9)
    motion = (np.diff(np.linspace(start, end, 15), axis=0) ** 2).sum() * 14
    if criterion == "motion" and task == AXIS:
        assert plan.motion <= motion * 1.1
    assert np.isnan(plan.condition_number).all() == (len(robot.rows_in_use()) > robot.n)


@pytest.mark.parametrize("name", ["five", "PPPRR", "scara", "planar"])
def test_the_choice_of_branches_is_the_best_of_all(name: str) -> None:
    robot, task, start, end = ROBOTS[name]
    points = 5
    path = joint_path(robot, task, start, end, points)
    frames = robot.fk(np.linspace(start, end, points))
    postures = [robot.inverse(frame, task=task, turns=True) for frame in frames]
    assert min(len(found) for found in postures) >= 2
    shares = np.diff(np.array(_places(path)))
    # Every sequence of postures, branches and whole turns included, by what its motion costs.
    costs = {
        choice: sum(
            float(((postures[i + 1][choice[i + 1]] - postures[i][choice[i]]) ** 2).sum()) / shares[i]
            for i in range(points - 1)
        )
        for choice in itertools.product(*(range(min(len(found), 8)) for found in postures))
    }
    plan = rd.plan(robot, path, task, criterion="motion")
    assert plan.failure is None
    assert plan.motion <= min(costs.values()) * (1 + 1e-9)
    if max(len(found) for found in postures) <= 8:
        assert plan.motion == pytest.approx(min(costs.values()), rel=1e-9)


def _places(path: rd.Toolpath) -> F64:
    """Return the share of the path at which each point is: by length, a turn of the axis by 1 rad counting as 0.1 m."""
    way = np.linalg.norm(np.diff(path.position, axis=0), axis=1)
    turn = np.arccos(np.clip((path.axis[1:] * path.axis[:-1]).sum(axis=1), -1.0, 1.0))
    steps = way + 0.1 * turn
    return np.concatenate([[0.0], np.cumsum(steps) / steps.sum()])


def test_maps() -> None:
    for name, shape, spins in [
        ("five", (5, 1, 16), False),
        ("PPPRR", (5, 1, 16), False),
        ("gantry", (5, 12, 16), True),
        ("stanford", (5, 12, 16), True),
        ("scara", (5, 1, 16), False),
        ("scara's axis", (5, 12, 16), True),
        ("scara on a rail", (5, 4, 12, 16), True),
    ]:
        robot, task, start, end = ROBOTS[name]
        path = joint_path(robot, task, start, end, 5)
        chart = rd.redundancy_map(robot, path, task, n_angles=12, n_spare=4)
        assert chart.value.shape == shape
        assert chart.spins == spins
        assert chart.feasible.reshape(5, -1).any(axis=1).all()
        if not spins:
            for i, frame in enumerate(robot.fk(np.linspace(start, end, 5))):
                assert chart.feasible[i].sum() == len(robot.inverse(frame, task=task, limits=True))
            with pytest.raises(rd.InvalidValueError, match="spin"):
                chart.plot()


def test_a_frame_that_leans_is_out_of_a_scara_s_reach() -> None:
    robot, task, start, end = ROBOTS["scara's axis"]
    path = joint_path(robot, task, start, end, 5)
    leaning = rd.Toolpath(path.position, path.axis + np.array([0.1, 0.0, 0.0]))
    plan = rd.plan(robot, leaning, task, criterion="motion")
    assert plan.failure is not None
    assert "unreachable" in str(plan.failure) or plan.failure.cause == "unreachable"
    assert not rd.redundancy_map(robot, leaning, task, n_angles=8).feasible.any()


def test_spare_joints_of_other_kinds() -> None:
    robot, task, start, end = ROBOTS["scara on a rail"]
    path = joint_path(robot, task, start, end, 5)
    # Any of the rail and the arm's turns may be held, not the quill.
    for joint in (0, 1, 2):
        plan = rd.plan(robot, path, task, criterion="motion", spare=(joint,), n_spare=12)
        assert plan.failure is None
    with pytest.raises(rd.InvalidValueError, match=r"spare is \(3,\), which leaves the joints 'PRRR' of 'PRRPR'"):
        rd.plan(robot, path, task, criterion="motion", spare=(3,))
    with pytest.raises(rd.InvalidValueError, match="task is full of 6 components for 5 joints"):
        rd.plan(five_joints(), joint_path(five_joints(), FULL, *ROBOTS["five"][2:], 5), FULL, criterion="motion")
