"""Joints that follow others: against pinocchio's mimic joints, the free chain of the same joints, and differences."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st
from redundancy.loops import Solver

from tests.reference.chain import F64, random_frame
from tests.reference.differences import sweep

INF = np.inf
FINGER = """<robot name="finger"><link name="l0"/><link name="l1"/><link name="l2"/><link name="tip"/>
<joint name="j1" type="revolute"><origin xyz="0 0 .05"/><parent link="l0"/><child link="l1"/><axis xyz="0 1 0"/>
<limit lower="0" upper="1.5" velocity="1" effort="1"/></joint>
<joint name="j2" type="revolute"><origin xyz="0 0 .04"/><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
<limit lower="-.7" upper="2" velocity="4" effort="1"/><mimic joint="j1" multiplier="-.8" offset=".1"/></joint>
<joint name="jt" type="fixed"><origin xyz="0 0 .03"/><parent link="l2"/><child link="tip"/></joint></robot>"""


def frame_at(position: list[float]) -> F64:
    out = np.eye(4)
    out[:3, 3] = position
    return out


class Case:
    """A random chain of which some joints follow others, and the same chain with all joints free."""

    def __init__(self, seed: int, m: int | None = None, dependents: int | None = None) -> None:
        rng = np.random.default_rng(seed)
        m = int(rng.integers(2, 10)) if m is None else m
        dependents = int(rng.integers(1, m)) if dependents is None else dependents
        letters = "".join(rng.choice(["R", "R", "P"], m))
        links, flange = np.array([random_frame(rng) for _ in range(m)]), random_frame(rng)
        followers = [int(i) for i in rng.permutation(m)[:dependents]]
        free = [i for i in range(m) if i not in followers]
        self.mimic = {
            i: (int(rng.choice(free)), float(rng.uniform(-2.0, 2.0)), float(rng.normal())) for i in sorted(followers)
        }
        self.robot = rd.Robot.from_links(links, flange, letters, mimic=self.mimic)
        self.free = rd.Robot.from_links(links, flange, letters)
        # theta = matrix q + offset
        self.matrix, self.offset = np.zeros((m, len(free))), np.zeros(m)
        for k, i in enumerate(free):
            self.matrix[i, k] = 1.0
        for i, (driver, factor, offset) in self.mimic.items():
            self.matrix[i, free.index(driver)], self.offset[i] = factor, offset
        self.q = rng.uniform(-1.5, 1.5, len(free))

    @property
    def theta(self) -> F64:
        return self.matrix @ self.q + self.offset


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6))
def test_kinematics_are_those_of_the_chain_contracted(seed: int) -> None:
    """FK, J, dJ, d2J and the rate of J: those of the free chain at theta = M q + o, times M."""
    case = Case(seed)
    robot, chain, q, theta, m = case.robot, case.free, case.q, case.theta, case.matrix
    assert robot.n == len(q)
    assert robot.chain == chain.joints
    np.testing.assert_allclose(robot.fk(q), chain.fk(theta), atol=1e-13)
    np.testing.assert_allclose(robot.jacobian(q), chain.jacobian(theta) @ m, atol=1e-12)
    dj = np.einsum("ria,ij,ak->rjk", chain.jacobian_derivative(theta), m, m)
    np.testing.assert_allclose(robot.jacobian_derivative(q), dj, atol=1e-11)
    d2j = np.einsum("riab,ij,ak,bl->rjkl", chain.jacobian_second_derivative(theta), m, m, m)
    np.testing.assert_allclose(robot.jacobian_second_derivative(q), d2j, atol=1e-10)
    qd = np.linspace(-1.0, 1.0, robot.n)
    np.testing.assert_allclose(robot.jacobian_rate(q, qd), dj @ qd, atol=1e-11)
    frames = robot.link_frames(q)
    assert frames.shape == (len(robot.chain) + 1, 4, 4)
    np.testing.assert_allclose(frames, chain.link_frames(theta), atol=1e-13)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10**6), st.integers(0, 4))
def test_indices_have_gradient_and_hessian(seed: int, which: int) -> None:
    """Value from the singular values of J; gradient and Hessian against differences of value and gradient."""
    rng = np.random.default_rng(seed)
    m = int(rng.integers(5, 10))
    case = Case(seed, m, int(rng.integers(1, m - 2)))
    robot, q = case.robot, case.q
    rows = [3, 4, 5]
    index = (
        rd.ConditionNumber(0.5, rows=rows),
        rd.Manipulability(0.5, rows=rows),
        rd.ConditionNumber(0.5, "spectral", rows=rows),
        rd.SingularityParameter(0.5, rows=rows),
        rd.ConditionNumber(0.5, rows=rows, squared=True) + 0.1 * rd.Manipulability(0.5, rows=rows),
    )[which]
    sigma = np.linalg.svd(robot.jacobian(q)[3:], compute_uv=False)
    if sigma[-1] < 0.1 * sigma[0] or np.diff(-sigma).min() < 0.1 * sigma[0]:
        return
    value, gradient, hessian = index.evaluate(robot, q, order=2)
    if which == 0:
        assert value == pytest.approx(np.sqrt((sigma**2).sum() * (sigma**-2).sum()) / 3.0, rel=1e-12)
    assert sweep(lambda x: index.evaluate(robot, x, order=0), q, gradient) < 1e-7
    assert sweep(lambda x: index.evaluate(robot, x, order=1)[1], q, hessian) < 1e-7
    np.testing.assert_allclose(hessian, hessian.T)
    batch = index.evaluate_many(robot, np.stack([q, q + 0.1]), order=1)
    assert batch[0][0] == value
    np.testing.assert_array_equal(batch[1][0], gradient)


def test_a_full_row_index_against_the_singular_values() -> None:
    """All six rows of a chain of nine joints on seven coordinates."""
    case = Case(7, 9, 2)
    robot, q = case.robot, case.q
    assert robot.n == 7
    index = rd.ConditionNumber(0.4)
    value, gradient, hessian = index.evaluate(robot, q, order=2)
    scaled = robot.jacobian(q)
    scaled[:3] *= 0.4
    sigma = np.linalg.svd(scaled, compute_uv=False)
    assert value == pytest.approx(np.sqrt((sigma**2).sum() * (sigma**-2).sum()) / 6.0, rel=1e-12)
    assert sweep(lambda x: index.evaluate(robot, x, order=1)[1], q, hessian) < 1e-6
    _, slopes, curvature = index.evaluate(robot, q, order=2, with_length=True)
    np.testing.assert_allclose(slopes[:-1], gradient)

    def at_length(length: F64) -> F64:
        return np.asarray(index.with_length(float(length[0])).evaluate(robot, q, order=1)[1])

    assert sweep(at_length, np.array([0.4]), curvature[-1:, :-1].T) < 1e-7


@pytest.fixture
def finger(tmp_path: Path) -> Path:
    file = tmp_path / "finger.urdf"
    file.write_text(FINGER)
    return file


def test_urdf_mimic_as_pinocchio_has_it(finger: Path) -> None:
    pin = pytest.importorskip("pinocchio")
    robot = rd.Robot.from_urdf(finger)
    assert robot.n == 1
    first, both = 0.6, 0.6 + 0.1 - 0.8 * 0.6
    tip = [0.04 * np.sin(first) + 0.03 * np.sin(both), 0.0, 0.05 + 0.04 * np.cos(first) + 0.03 * np.cos(both)]
    np.testing.assert_allclose(robot.fk([0.6])[:3, 3], tip, atol=1e-14)
    model = pin.buildModelFromUrdf(str(finger), mimic=True)
    data, end = model.createData(), model.getFrameId("tip")
    for x in np.linspace(-0.5, 1.5, 9):
        q = np.array([x])
        pin.framesForwardKinematics(model, data, q)
        placement = data.oMf[end].homogeneous
        np.testing.assert_allclose(robot.fk(q), placement, atol=1e-14)
        columns = pin.computeFrameJacobian(model, data, q, end, pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(robot.jacobian(q), columns.reshape(6, 1)[[3, 4, 5, 0, 1, 2]], atol=1e-13)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6))
def test_random_urdfs_as_pinocchio_has_them(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    """FK and J; pinocchio's mimic joints come after the joint that they follow, and are of its kind."""
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(seed)
    m = int(rng.integers(2, 9))
    kinds = rng.choice(["revolute", "prismatic"], m, p=[0.7, 0.3])
    text, free = ['<robot name="r"><link name="l0"/>'], list[int]()
    for i, kind in enumerate(kinds):
        same = [k for k in free if kinds[k] == kind]
        follows = bool(same) and bool(rng.random() < 0.5)
        xyz, rpy = rng.uniform(-0.4, 0.4, 3), rng.uniform(-3.0, 3.0, 3)
        axis = np.eye(3)[rng.integers(3)] if rng.random() < 0.5 else rng.normal(size=3)
        text.append(
            f'<link name="l{i + 1}"/><joint name="j{i}" type="{kind}"><parent link="l{i}"/><child link="l{i + 1}"/>'
            f'<origin xyz="{" ".join(map(repr, xyz.tolist()))}" rpy="{" ".join(map(repr, rpy.tolist()))}"/>'
            f'<axis xyz="{" ".join(map(repr, (axis / np.linalg.norm(axis)).tolist()))}"/>'
            '<limit lower="-9" upper="9" velocity="1" effort="1"/>'
        )
        if follows:
            factor, offset = rng.uniform(-2.0, 2.0), rng.normal()
            text.append(f'<mimic joint="j{rng.choice(same)}" multiplier="{factor!r}" offset="{offset!r}"/>')
        else:
            free.append(i)
        text.append("</joint>")
    file = tmp_path_factory.mktemp("urdf") / "r.urdf"
    file.write_text("".join(text) + "</robot>")
    robot = rd.Robot.from_urdf(file)
    model = pin.buildModelFromUrdf(str(file), mimic=True)
    data, tip = model.createData(), model.getFrameId(f"l{m}")
    assert robot.n == model.nq == len(free)
    q = rng.uniform(-2.0, 2.0, robot.n)
    pin.framesForwardKinematics(model, data, q)
    np.testing.assert_allclose(robot.fk(q), data.oMf[tip].homogeneous, atol=1e-12)
    columns = pin.computeFrameJacobian(model, data, q, tip, pin.LOCAL_WORLD_ALIGNED).reshape(6, -1)
    np.testing.assert_allclose(robot.jacobian(q), columns[[3, 4, 5, 0, 1, 2]], atol=1e-12)


def test_limits_of_a_joint_tighten_those_of_its_driver(finger: Path) -> None:
    """-0.8 q + 0.1 >= -0.7 holds up to q = 1; a speed of 4 of the second joint is 5 of the first."""
    robot = rd.Robot.from_urdf(finger)
    np.testing.assert_allclose([robot.q_min[0], robot.q_max[0], robot.qd_max[0]], [0.0, 1.0, 1.0])


def test_a_driver_beside_the_chain(tmp_path: Path) -> None:
    """A finger whose joints follow one of another finger: that joint is the coordinate."""
    pin = pytest.importorskip("pinocchio")
    file = tmp_path / "gripper.urdf"
    file.write_text(
        """<robot name="gripper"><link name="palm"/><link name="left"/><link name="right"/><link name="pad"/>
<joint name="a" type="prismatic"><origin xyz="0 .01 0" rpy=".1 .2 .3"/><parent link="palm"/><child link="left"/>
<axis xyz="0 1 0"/><limit lower="0" upper=".04" velocity=".2" effort="1"/></joint>
<joint name="b" type="revolute"><origin xyz="0 -.01 .02"/><parent link="palm"/><child link="right"/><axis xyz="1 0 1"/>
<limit lower="-1" upper="1" velocity="9" effort="1"/><mimic joint="a" multiplier="20" offset="-.3"/></joint>
<joint name="c" type="revolute"><origin xyz=".1 0 0"/><parent link="right"/><child link="pad"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" velocity="9" effort="1"/><mimic joint="b" multiplier="-1" offset="0"/></joint></robot>"""
    )
    robot = rd.Robot.from_urdf(file, tip="pad")
    assert (robot.n, robot.joints, robot.chain) == (1, "P", "RRP")
    assert robot.mimic == {0: (2, 20.0, -0.3), 1: (2, -20.0, 0.3)}
    np.testing.assert_allclose([robot.q_min[0], robot.q_max[0], robot.qd_max[0]], [0.0, 0.04, 0.2])
    # Pinocchio's mimic joints follow their own kind alone: all free, at a, 20 a - 0.3 and minus that.
    model = pin.buildModelFromUrdf(str(file))
    data, pad = model.createData(), model.getFrameId("pad")
    a = 0.013
    q = np.array([a, 20.0 * a - 0.3, 0.3 - 20.0 * a])
    pin.framesForwardKinematics(model, data, q)
    np.testing.assert_allclose(robot.fk([a]), data.oMf[pad].homogeneous, atol=1e-14)
    columns = pin.computeFrameJacobian(model, data, q, pad, pin.LOCAL_WORLD_ALIGNED)
    moved = columns[[3, 4, 5, 0, 1, 2]] @ [[1.0], [20.0], [-20.0]]
    np.testing.assert_allclose(robot.jacobian([a]), moved, atol=1e-13)
    assert pickle.loads(pickle.dumps(robot)) == robot


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10**6))
def test_it_is_written_read_and_pickled(tmp_path_factory: pytest.TempPathFactory, seed: int) -> None:
    case = Case(seed)
    robot = case.robot.with_limits(q_min=np.full(case.robot.n, -1.25), qd_max=np.full(case.robot.n, 0.1))
    assert robot.mimic == case.mimic
    assert pickle.loads(pickle.dumps(robot)) == robot
    file = tmp_path_factory.mktemp("robots") / "robot.toml"
    rd.robots.save(robot, file)
    again = rd.robots.load(file)
    assert again == robot
    np.testing.assert_array_equal(again.fk(case.q), robot.fk(case.q))


def test_holding_a_driver_holds_those_that_follow() -> None:
    case = Case(11, 7, 3)
    robot, q = case.robot, case.q
    driver = sorted({i for i in range(7) if i not in case.mimic}).index(next(iter(case.mimic.values()))[0])
    held = robot.with_fixed({driver: float(q[driver])})
    assert held.n == robot.n - 1
    rest = np.delete(q, driver)
    np.testing.assert_allclose(held.fk(rest), robot.fk(q), atol=1e-13)
    np.testing.assert_allclose(held.jacobian(rest), np.delete(robot.jacobian(q), driver, axis=1), atol=1e-12)


def arm() -> rd.Robot:
    """Seven axes of which the fifth follows the third: six coordinates, one of them of two joints."""
    panda = rd.robots.get("panda")
    dh = panda.dh
    assert dh is not None
    return rd.Robot.from_dh(
        dh["a"],
        dh["d"],
        dh["alpha"],
        dh["theta"],
        convention="modified",
        tool=panda.tool,
        q_min=panda.q_min,
        q_max=panda.q_max,
        qd_max=panda.qd_max,
        mimic={4: (2, -0.5, 0.4)},
    )


@pytest.mark.parametrize("kind", ["sqp", "qp", "rate"])
def test_solvers_reach_poses(kind: str) -> None:
    robot = arm()
    assert robot.n == 6
    task = rd.Task.axisymmetric()
    index = rd.ConditionNumber(0.3)
    solvers: dict[str, Solver] = {
        "sqp": rd.OrthogonalSQP(robot, task, index),
        "qp": rd.QuadraticProgram(robot, task, index),
        "rate": rd.GradientProjection(robot, task, index),
    }
    q0 = robot.middle
    goal = robot.fk(q0 + 0.2 * np.array([1.0, -1.0, 0.5, 1.0, -0.5, 1.0]))
    path = rd.Toolpath(np.linspace(robot.fk(q0)[:3, 3], goal[:3, 3], 12), np.tile(goal[:3, 2], (12, 1)))
    trajectory = rd.follow(solvers[kind], path, q0=q0)
    assert trajectory.unreachable == []
    for q, position in zip(trajectory.q, path.position, strict=True):
        np.testing.assert_allclose(robot.fk(q)[:3, 3], position, atol=1e-5)


def test_the_optimum_is_that_of_the_chain_under_a_constraint() -> None:
    """Where the SQP rests, the gradient along the task's free motion is zero."""
    robot = arm()
    task, index = rd.Task.axisymmetric(), rd.ConditionNumber(0.3)
    found = rd.OrthogonalSQP(robot.with_limits([-INF] * 6, [INF] * 6), task, index)
    q0 = robot.middle
    start = robot.fk(q0)
    path = rd.Toolpath(start[:3, 3][None], start[:3, 2][None])
    trajectory = rd.follow(found, path, q0=q0)
    q = trajectory.q[0]
    columns, tool = robot.jacobian(q), robot.fk(q)
    rows = np.vstack([tool[:3, :2].T @ columns[:3], columns[3:]])
    free = np.linalg.svd(rows)[2][-1]
    assert abs(free @ index.evaluate(robot, q, order=1)[1]) < 1e-6


def test_closed_forms_want_free_joints() -> None:
    with pytest.raises(rd.InvalidValueError, match="six free joints"):
        arm().inverse(np.eye(4))
    # Held with its driver, what follows no longer moves.
    planned = rd.Robot.from_links(
        np.tile(np.eye(4), (8, 1, 1)), np.eye(4), "R" * 8, mimic={7: (0, 1.0, 0.0)}
    ).with_fixed({0: 0.1})
    assert planned.mimic == {}
    assert planned.n == 6


def lift() -> rd.Robot:
    """An arm on a lift of two stages, of which the second follows the first."""
    ur5e = rd.robots.get("ur5e")
    links = np.concatenate([np.tile(np.eye(4), (2, 1, 1)), ur5e.links])
    robot = rd.Robot.from_links(links, ur5e.flange, "PP" + ur5e.joints, mimic={1: (0, 1.0, 0.0)})
    limits = (("q_min", 0.0), ("q_max", 0.3), ("qd_max", 0.1))
    return robot.with_limits(**{key: np.concatenate([[end], getattr(ur5e, key)]) for key, end in limits})


def test_a_plan_moves_both_stages_of_a_lift() -> None:
    robot, ur5e = lift(), rd.robots.get("ur5e")
    assert robot.joints == "PRRRRRR"
    path = rd.Toolpath(np.linspace([0.5, -0.2, 0.5], [0.5, 0.2, 0.7], 9), np.tile([1.0, 0.0, 0.0], (9, 1)))
    settings: dict[str, Any] = {"n_angles": 12, "layers": 5, "n_spare": 4, "progress": False}
    planned = rd.plan(robot, path, rd.Task.axisymmetric(), rd.ConditionNumber(0.3, squared=True), **settings)
    assert planned.failure is None
    assert planned.refined
    assert (planned.margins >= 0.0).all()
    for q, point, axis in zip(planned.q, path.position, path.axis, strict=True):
        tool = ur5e.fk(q[1:])
        np.testing.assert_allclose(tool[:3, 3] + [0.0, 0.0, 2.0 * q[0]], point, atol=1e-8)
        np.testing.assert_allclose(tool[:3, 2], axis, atol=1e-8)


def test_postures_with_the_driver_held() -> None:
    """Those of the arm alone, twice the height of a stage lower."""
    robot, ur5e = lift(), rd.robots.get("ur5e")
    pose = ur5e.fk([0.3, -1.2, 1.5, -0.6, 0.8, 0.2])
    raised = pose.copy()
    raised[2, 3] += 2.0 * 0.11
    found, alone = robot.inverse(raised, fixed={0: 0.11}), ur5e.inverse(pose)
    np.testing.assert_array_equal(found[:, 0], 0.11)
    assert len(found) == len(alone)
    for q in alone:
        assert np.abs(found[:, 1:] - q).max(axis=1).min() < 1e-9


def test_a_part_of_a_turn_is_no_whole_turn() -> None:
    links = np.tile(np.eye(4), (3, 1, 1))
    robot = rd.Robot.from_links(links, np.eye(4), "RRR", mimic={1: (0, 0.5, 0.0)})
    np.testing.assert_array_equal(robot.periodic, [False, True])
    np.testing.assert_array_equal(robot.turned([7.0, 7.0]), [7.0, 7.0 - 2.0 * np.pi])
    whole = rd.Robot.from_links(links, np.eye(4), "RRR", mimic={1: (0, -2.0, 0.3)})
    np.testing.assert_array_equal(whole.periodic, [True, True])


def test_bodies_move_with_their_joints() -> None:
    """Rates of distances against differences, for a chain of which joints follow others."""
    case = Case(3, 6, 3)
    robot, q = case.robot, case.q
    scene = rd.Scene(
        robot, rd.capsules_along_links(robot, 0.02), {"ball": (rd.Shape.sphere(0.1), frame_at([1.0, 2.0, 3.0]))}
    )
    near = {found.names: found for found in scene.near(q, 10.0)}
    assert len(near) > 3
    for k in range(robot.n):
        step = 1e-6 * np.eye(robot.n)[k]
        ahead, behind = ({f.names: f.distance for f in scene.near(q + s * step, 10.0)} for s in (1.0, -1.0))
        for names, found in near.items():
            assert found.gradient[k] == pytest.approx((ahead[names] - behind[names]) / 2e-6, abs=1e-6)


def test_a_tick_moves_a_frame_on_a_link() -> None:
    """A frame beside the tool gets the twist that is asked of it, by the Jacobian of the chain up to its link."""
    robot = arm()
    q = robot.middle
    task = rd.FrameTask(4, rd.Task.position(), weight=1e6)
    tick = rd.QuadraticProgram(robot, rd.Task.position(), beside=[task])
    wanted = np.array([0.0, 0.0, 0.0, 0.01, -0.02, 0.015])
    dq = tick.step(q, np.zeros(6), stiffness=1e-6, twists=[wanted])
    step = 1e-6
    moved = (robot.link_frames(q + step * dq)[4] - robot.link_frames(q - step * dq)[4])[:3, 3] / (2.0 * step)
    np.testing.assert_allclose(moved, wanted[3:], atol=1e-4)


@pytest.mark.parametrize(
    ("mimic", "match"),
    [
        ({0: (1, 1.0, 0.0), 1: (0, 1.0, 0.0)}, "mimics itself"),
        ({0: (0, 1.0, 0.0)}, "mimics itself"),
        ({0: (9, 1.0, 0.0)}, "mimic"),
        ({0: (1, np.nan, 0.0)}, "finite"),
        ({0: 1}, "driver, factor, offset"),
    ],
)
def test_what_is_refused(mimic: Any, match: str) -> None:
    with pytest.raises(rd.RedundancyError, match=match):
        rd.Robot.from_links(np.tile(np.eye(4), (3, 1, 1)), np.eye(4), "RRR", mimic=mimic)


def test_capacity_counts_the_joints_of_the_chain() -> None:
    mimic = {i: (0, 1.0, 0.0) for i in range(1, 17)}
    with pytest.raises(rd.InvalidValueError, match="1 to 16, those that mimic others included"):
        rd.Robot.from_links(np.tile(np.eye(4), (17, 1, 1)), np.eye(4), "R" * 17, mimic=mimic)


def test_rows_in_use_are_those_of_the_chain() -> None:
    planar = rd.Robot.from_dh([1.0, 0.7, 0.4], [0.0] * 3, [0.0] * 3, [0.0] * 3, mimic={2: (1, -0.6, 0.2)})
    assert planar.rows_in_use() == [2, 3, 4]
    assert rd.Task.position().redundancy(planar) == (0, -1, -1)
