"""Plans of tools that may tilt within a volume, beside plans without tilt and searches of their own."""

import itertools

import numpy as np
import pytest
import redundancy as rd

from tests.reference.chain import F64
from tests.soak.volume_plans import fault_of

AXIS = rd.Task.axisymmetric()
CRITERIA = ("minimax", "integral", "motion", "speed")
KAPPA = rd.ConditionNumber(0.4855933)
FANUC = rd.robots.get("fanuc_m710ic50_milling")


def helix(points: int = 21) -> rd.Toolpath:
    return rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0), points=points)


def with_rotations(path: rd.Toolpath) -> rd.Toolpath:
    """Return a path with rotations in whose frames the best spins are about 0."""
    core = rd.planning.core_path(path)
    plan = rd.plan(FANUC, path, AXIS, KAPPA, progress=False)
    spin = float(np.median(np.unwrap(core.spins(FANUC, AXIS, plan.q))))
    c, s = np.cos(spin), np.sin(spin)
    rotation = core.frames(AXIS)[:, :3, :3] @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return rd.Toolpath(path.position, path.axis, rotation)


def joint_line(robot: rd.Robot, start: list[float], end: list[float], points: int) -> rd.Toolpath:
    frames = robot.fk(np.linspace(start, end, points))
    return rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], frames[:, :3, :3])


def relative(plan: rd.Plan, rotation: F64) -> F64:
    """Return the tool's rotations in the path's frames."""
    return np.swapaxes(rotation, 1, 2) @ plan.robot.fk(plan.q)[:, :3, :3]


def assert_within(plan: rd.Plan, volume: rd.OrientationVolume, rotation: F64) -> None:
    assert plan.failure is None
    assert np.max(volume.signed_distance(relative(plan, rotation))) <= 1e-9
    assert plan.position_error.max() <= 1e-9
    assert plan.axis_error.max() <= 1e-9


VOLUMES = {
    "cone": rd.OrientationVolume.cone(np.deg2rad(15)),
    "cone with spin": rd.OrientationVolume.cone(np.deg2rad(10), spin=(-0.4, 0.3)),
    "pyramid": rd.OrientationVolume.pyramid(np.deg2rad(12), np.deg2rad(6)),
    "pyramid with spin": rd.OrientationVolume.pyramid(np.deg2rad(12), np.deg2rad(6), spin=(-1.0, 0.2)),
    "square": rd.OrientationVolume.square(np.deg2rad(8), np.deg2rad(15), spin=(-0.5, 0.5)),
}


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("name", VOLUMES)
def test_no_worse_than_the_spin_alone(name: str, criterion: str) -> None:
    volume, path = VOLUMES[name], with_rotations(helix(15))
    assert path.rotation is not None
    plan = rd.plan(FANUC, path, rd.Task.within(volume), KAPPA, criterion, progress=False)
    alone = rd.plan(FANUC, path, AXIS, KAPPA, criterion, spin_range=volume.spin, progress=False)
    assert_within(plan, volume, path.rotation)
    assert alone.failure is None
    assert plan.cost <= alone.cost + 1e-6 * abs(alone.cost)
    if criterion == "minimax":
        assert plan.bound <= plan.value.max() * (1.0 + 1e-9)
        # The bound is the least of single points: no plan that is known is below it.
        assert plan.gap < 1e-2


def test_tilt_heading_and_twist() -> None:
    path = with_rotations(helix(11))
    assert path.rotation is not None
    plan = rd.plan(FANUC, path, rd.Task.within(VOLUMES["cone with spin"]), KAPPA, progress=False)
    assert plan.tilt is not None
    assert plan.heading is not None
    assert plan.twist is not None
    for R, tilt, heading, twist in zip(relative(plan, path.rotation), plan.tilt, plan.heading, plan.twist, strict=True):
        axis = np.array([-np.sin(heading), np.cos(heading), 0.0])
        K = np.cross(np.eye(3), axis)
        swing = np.eye(3) + np.sin(tilt) * K + (1.0 - np.cos(tilt)) * K @ K
        c, s = np.cos(twist), np.sin(twist)
        np.testing.assert_allclose(swing @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]), R, atol=1e-12)
    assert rd.plan(FANUC, path, AXIS, KAPPA, progress=False).tilt is None


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_cone_of_tilt_0_is_the_spin_alone(criterion: str) -> None:
    path = helix(15)
    alone = rd.plan(FANUC, path, AXIS, KAPPA, criterion, progress=False)
    upright = rd.plan(FANUC, path, rd.Task.within(rd.OrientationVolume.cone(0.0)), KAPPA, criterion, progress=False)
    np.testing.assert_allclose(upright.q, alone.q, atol=1e-12)
    about_z = rd.OrientationVolume.product([((0, 0, 1), -0.3, 0.4)])
    path = with_rotations(path)
    ranged = rd.plan(FANUC, path, AXIS, KAPPA, criterion, spin_range=(-0.3, 0.4), progress=False)
    product = rd.plan(FANUC, path, rd.Task.within(about_z), KAPPA, criterion, progress=False)
    np.testing.assert_allclose(product.cost, ranged.cost, rtol=1e-9)


def test_a_wider_cone_is_no_worse() -> None:
    path = helix(15)
    for criterion in CRITERIA:
        costs = []
        for tilt in (0.0, 3.0, 8.0, 20.0, 45.0):
            task = rd.Task.within(rd.OrientationVolume.cone(np.deg2rad(tilt)))
            costs.append(rd.plan(FANUC, path, task, KAPPA, criterion, progress=False).cost)
        assert all(b <= a + 1e-6 * abs(a) for a, b in itertools.pairwise(costs)), (criterion, costs)


def least_by_grid(robot: rd.Robot, path: rd.Toolpath, tilt: float, criterion: str) -> float:
    """Return the least cost over a grid of tilts, headings and spins, by dynamic programming over postures."""
    rotation = rd.planning.core_path(path).frames(AXIS)[:, :3, :3]
    members = rd.OrientationVolume.cone(tilt).grid(2, 8, 48)
    layers = []
    for R, p in zip(rotation, path.position, strict=True):
        pose = np.eye(4)
        pose[:3, 3] = p
        rows = []
        for member in members:
            pose[:3, :3] = R @ rd.quaternion.matrix(member)
            rows.append(robot.inverse(pose, limits=True))
        layers.append(np.vstack(rows))
    values = [KAPPA.evaluate_many(robot, layer, 0)[0] for layer in layers]
    cost = values[0] * (0.5 if criterion == "integral" else 1.0)
    for i in range(1, len(layers)):
        after = np.full(len(layers[i]), np.inf)
        own = values[i] * (0.5 if i == len(layers) - 1 and criterion == "integral" else 1.0)
        for k, q in enumerate(layers[i]):
            near = (np.abs(layers[i - 1] - q) <= 0.25).all(axis=1)
            if near.any():
                best = cost[near].min()
                after[k] = max(best, own[k]) if criterion == "minimax" else best + own[k]
        cost = after
    return float(cost.min() / (1.0 if criterion == "minimax" else len(layers) - 1))


@pytest.mark.parametrize("criterion", ["minimax", "integral"])
def test_no_worse_than_a_grid(criterion: str) -> None:
    tilt, path = np.deg2rad(15), helix(61)
    path = rd.Toolpath(path.position[:4], path.axis[:4])
    plan = rd.plan(FANUC, path, rd.Task.within(rd.OrientationVolume.cone(tilt)), KAPPA, criterion, progress=False)
    assert plan.failure is None
    value = plan.value.max() if criterion == "minimax" else float(rd.planning.core_path(path).weights @ plan.value)
    assert value <= least_by_grid(FANUC, path, tilt, criterion) * (1.0 + 1e-5)


def test_products_and_references() -> None:
    path = with_rotations(helix(9))
    assert path.rotation is not None
    for volume in (
        rd.OrientationVolume.product([((1, 0, 0), -0.2, 0.1), ((0, 1, 0), -0.1, 0.1), ((0, 0, 1), -2.0, 1.0)]),
        rd.OrientationVolume.cone(0.15, spin=(-1.0, 1.0)).reoriented(rd.quaternion.from_matrix(_about_x(0.3))),
    ):
        plan = rd.plan(FANUC, path, rd.Task.within(volume), KAPPA, progress=False)
        assert_within(plan, volume, path.rotation)


def _about_x(angle: float) -> F64:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def test_a_seven_axis_arm() -> None:
    robot = rd.robots.get("kuka_iiwa14")
    path = joint_line(robot, [0, 0.5, 0, -1.2, 0, 0.8, 0], [0.4, 0.7, 0.2, -1.0, 0.3, 1.0, 0.4], 9)
    assert path.rotation is not None
    volume = rd.OrientationVolume.cone(np.deg2rad(10))
    for criterion in ("minimax", "motion"):
        plan = rd.plan(robot, path, rd.Task.within(volume), KAPPA, criterion, n_spare=8, n_angles=24, progress=False)
        alone = rd.plan(robot, path, AXIS, KAPPA, criterion, n_spare=8, n_angles=24, progress=False)
        assert_within(plan, volume, path.rotation)
        assert plan.cost <= alone.cost + 1e-6 * abs(alone.cost)


def test_a_machine_of_five_axes() -> None:
    quarter = np.pi / 2
    robot = rd.Robot.from_dh(
        [0.0] * 5, [0, 0, 0, 0, 0.2], [quarter, quarter, 0, -quarter, quarter], [quarter, quarter, 0, 0, 0], "PPPRR",
        q_min=[-2, -2, -2, -4, -2], q_max=[2, 2, 2, 4, 2],
    )  # fmt: skip
    path = joint_line(robot, [0.1, 0.3, -0.8, 0.4, 0.4], [0.6, 0.5, -1.0, 0.1, 0.9], 9)
    assert path.rotation is not None
    alone = rd.plan(robot, path, AXIS, criterion="motion", progress=False)
    for spin in (None, (-0.5, 0.5)):
        volume = rd.OrientationVolume.cone(np.deg2rad(10), spin=spin)
        plan = rd.plan(robot, path, rd.Task.within(volume), criterion="motion", progress=False)
        assert_within(plan, volume, path.rotation)
        if spin is None:
            assert plan.cost <= alone.cost * (1.0 + 1e-6)


def test_closed_paths_pins_and_cuts() -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 25)
    position = np.array([1.3, 0.0, 0.3]) + 0.15 * np.column_stack([np.cos(turn), np.sin(turn), 0.0 * turn])
    position[-1] = position[0]
    path = rd.Toolpath(position, np.tile([0.0, 0.0, -1.0], (25, 1)))
    volume = rd.OrientationVolume.cone(np.deg2rad(12))
    task = rd.Task.within(volume)
    rotation = rd.planning.core_path(path).frames(task)[:, :3, :3]
    plan = rd.plan(FANUC, path, task, KAPPA, closed=True, progress=False)
    assert_within(plan, volume, rotation)
    turns = (plan.q[-1] - plan.q[0]) / (2.0 * np.pi)
    assert np.abs(turns - np.round(turns)).max() < 1e-9
    held = rd.plan(FANUC, path, task, KAPPA, start=plan.q[3] * 0 + plan.q[0], progress=False)
    assert_within(held, volume, rotation)
    np.testing.assert_array_equal(held.q[0], plan.q[0])
    cut = rd.plan(FANUC, path, task, KAPPA, reconfigurations=True, progress=False)
    assert_within(cut, volume, rotation)
    with pytest.raises(rd.InvalidValueError, match="volume"):
        rd.plan(FANUC, path, task, KAPPA, pins={3: 0.1})
    outside = rd.plan(FANUC, path, rd.Task.within(rd.OrientationVolume.cone(0.7)), criterion="motion", progress=False)
    assert outside.tilt is not None
    if outside.tilt[0] > 0.3:
        with pytest.raises(rd.InvalidValueError, match="outside the orientation volume"):
            rd.plan(FANUC, path, task, KAPPA, start=outside.q[0])


def test_tilt_reaches_where_the_spin_alone_does_not() -> None:
    # Upright the tool is beyond the arm's reach at the far end; a lean brings it back.
    robot = rd.robots.get("ur5e")
    tool = np.eye(4)
    tool[2, 3] = 0.3
    robot = robot.with_tool(tool)
    x = np.linspace(0.6, 0.95, 14)
    path = rd.Toolpath(np.column_stack([x, 0 * x + 0.1, 0 * x + 0.0]), np.tile([0.0, 0.0, -1.0], (14, 1)))
    alone = rd.plan(robot, path, AXIS, criterion="motion", progress=False)
    assert alone.failure is not None
    leaning = rd.plan(
        robot, path, rd.Task.within(rd.OrientationVolume.cone(np.deg2rad(40))), criterion="motion", progress=False
    )
    assert leaning.failure is None
    assert leaning.tilt is not None
    assert leaning.tilt.max() > 0.05


def test_what_is_refused() -> None:
    path = helix(5)
    cone = rd.OrientationVolume.cone(0.1)
    with pytest.raises(rd.InvalidValueError, match="rotations"):
        rd.plan(FANUC, path, rd.Task.within(rd.OrientationVolume.cone(0.1, spin=(-1, 1))), KAPPA)
    with pytest.raises(rd.InvalidValueError, match="rotations"):
        rd.plan(FANUC, path, rd.Task.within(rd.OrientationVolume.pyramid(0.1, 0.1)), KAPPA)
    with pytest.raises(rd.InvalidValueError, match="spin_range"):
        rd.plan(FANUC, path, rd.Task.within(cone), KAPPA, spin_range=(-1, 1))
    with pytest.raises(rd.InvalidValueError, match="freedoms"):
        rd.plan(FANUC, with_rotations(path), rd.Task.within(rd.OrientationVolume.line_x(0.1)), KAPPA)
    with pytest.raises(rd.InvalidValueError, match="objective"):
        rd.plan(FANUC, path, rd.Task.within(cone))
    planar = rd.robots.get("planar_3r")
    with pytest.raises(rd.InvalidValueError, match="joints"):
        rd.plan(planar, rd.Toolpath([[0.5, 0.2, 0.0]] * 3, [[0, 0, 1]] * 3), rd.Task.within(cone), criterion="motion")


def test_map_over_tilt() -> None:
    path = helix(4)
    task = rd.Task.within(rd.OrientationVolume.cone(np.deg2rad(15)))
    chart = rd.redundancy_map(FANUC, path, task, KAPPA, 24, n_tilts=2, n_headings=6, progress=False)
    upright = rd.redundancy_map(FANUC, path, AXIS, KAPPA, 24, progress=False)
    assert chart.value.shape == (4, 13, 24, 8)
    assert chart.tilts.shape == (13, 2)
    np.testing.assert_allclose(chart.tilts[[0, 1, 7], 0], np.deg2rad([0.0, 7.5, 15.0]))
    np.testing.assert_allclose(chart.best_by_tilt[:, 0], np.nanmin(upright.best, axis=1))
    assert (np.nan_to_num(chart.best, nan=np.inf) <= np.nan_to_num(upright.best, nan=np.inf) + 1e-9).all()
    plan = rd.plan(FANUC, path, task, KAPPA, progress=False)
    assert plan.twist is not None
    np.testing.assert_allclose(chart.spin_of(plan), plan.twist)
    chart.plot(trajectory=plan)


@pytest.mark.parametrize("number", range(6))
def test_random_paths(number: int) -> None:
    assert fault_of(11, number) is None
