"""Joints as controllers have them: the map itself, pendant zeros and signs of the library's robots, files."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from redundancy.cli import main

from tests.reference.files import DATA

X, Y, Z = np.eye(3)
NONE = np.zeros(3)
FANUC = (Z, NONE, -Y, -X, -Y, -X)
"""FANUC's axes z, y, -y, -x, -y, -x, with J3 against the horizontal: J2 alone does not turn the hand."""
PENDANT = {
    # Axes about which the hand turns with each joint of the pendant at its zero, and the tool point there [m].
    # FANUC, fanuc_description (2025), crx10ia_urdf_macro.xacro, wbase to flange.
    "fanuc_crx10ia": (FANUC, (0.540 + 0.160, -0.150, 0.540)),
    # FANUC, fanuc_description (2025), crx10ia_l_urdf_macro.xacro, base_link to flange.
    "fanuc_crx10ia_l": (FANUC, (0.540 + 0.160, -0.150, 0.245 + 0.710)),
    # ROS-Industrial fanuc_m710ic_support, m710ic50_macro.xacro, base to tool0 (FANUC manual B-82274EN/09).
    "fanuc_m710ic50": (FANUC, (0.150 + 1.016 + 0.175, 0.0, 0.870 + 0.170)),
    # ROS-Industrial fanuc_m16ib_support, m16ib20_macro.xacro; Huo's table has the elbow's 100 mm on the other side.
    "fanuc_m16ib": (FANUC, (0.150 + 0.740 + 0.100, 0.0, 0.525 + 0.770 + 0.100 - 0.200)),
    # ROS-Industrial abb_irb2400_support, irb2400_macro.xacro; ABB's axis 3 is counted from the horizontal.
    "abb_irb2400": ((Z, NONE, Y, X, Y, X), (0.100 + 0.755 + 0.085, 0.0, 0.615 + 0.705 + 0.135)),
    # ROS-Industrial abb_irb120_support, irb120_3_58_macro.xacro; ABB data sheet ROB0149EN_D, zero posture.
    "abb_irb120": ((Z, Y, Y, X, Y, X), (0.302 + 0.072, 0.0, 0.290 + 0.270 + 0.070)),
    # ROS-Industrial kuka_lbr_iiwa_support, lbr_iiwa_14_r820_macro.xacro; KUKA specification: upright at zero.
    "kuka_iiwa14": ((Z, Y, Z, -Y, Z, Y, Z), (0.0, 0.0, 0.360 + 0.420 + 0.400 + 0.126)),
    # Rethink Robotics, baxter_common 1.2.0, baxter_base.urdf.xacro, S0 to left_hand: stretched along x at zero.
    "baxter_left": ((Z, Y, X, Y, X, Y, X), (0.069 + 0.36435 + 0.37429 + 0.229525, 0.0, 0.27035 - 0.069 - 0.010)),
    # Universal Robots, DH parameters (support article, 2022): stretched against x of the Base frame at zero.
    "ur5e": ((Z, -Y, -Y, -Y, -Z, -Y), (-0.425 - 0.3922, -0.1333 - 0.0996, 0.1625 - 0.0997)),
    "ur10e": ((Z, -Y, -Y, -Y, -Z, -Y), (-0.6127 - 0.57155, -0.17415 - 0.11655, 0.1807 - 0.11985)),
}
UNSOURCED = {"puma500", "stanford_arm", "planar_3r", "planar_4r"}
"""No pendant, or none of which a source was found."""
ELSEWHERE = {"fanuc_m710ic50_milling", "panda"}
"""The bare robot with a tool; equal to its URDF in all joints (test_robots)."""


@pytest.mark.parametrize("name", PENDANT)
def test_pendant_zero_and_signs(name: str) -> None:
    axes, point = PENDANT[name]
    robot = rd.robots.get(name)
    controller = robot.controller
    q = controller.to_robot(np.zeros(robot.n))
    np.testing.assert_allclose(robot.fk(q)[:3, 3], point, atol=1e-9)
    moved = [robot.jacobian(q)[:3] @ controller.rates_to_robot(rate) for rate in np.eye(robot.n)]
    np.testing.assert_allclose(moved, axes, atol=1e-9)


def test_every_robot_of_the_library_is_looked_at() -> None:
    assert set(rd.robots.names()) == set(PENDANT) | UNSOURCED | ELSEWHERE
    for name in UNSOURCED | {"panda"}:
        robot = rd.robots.get(name)
        assert robot.controller == robot.with_controller().controller
    milling, bare = rd.robots.get("fanuc_m710ic50_milling"), rd.robots.get("fanuc_m710ic50")
    assert milling.controller == bare.controller


def test_signs_of_universal_robots_in_a_urdf() -> None:
    """The UR5 has the axes of the e-series; its base_link is turned by half a turn against the controller's Base."""
    urdf, robot = rd.Robot.from_urdf(DATA / "ur5.urdf", tip="tool0"), rd.robots.get("ur5e")
    turned = np.diag([-1.0, -1.0, 1.0])
    for q in np.random.default_rng(0).uniform(-2.0, 2.0, (10, 6)):
        np.testing.assert_allclose(turned @ urdf.jacobian(q)[:3], robot.jacobian(q)[:3], atol=1e-5)


@pytest.mark.parametrize(("name", "upper", "height"), [("fanuc_crx10ia", 0.54, 0.0), ("fanuc_crx10ia_l", 0.71, 0.245)])
def test_crx_equals_the_description_of_its_maker(name: str, upper: float, height: float) -> None:
    """The axes of FANUC's description by a product of exponentials: z, y, -y, -x, -y, -x through the points named."""
    robot = rd.robots.get(name)
    elbow, wrist = np.array([0.0, 0.0, height + upper]), np.array([0.54, 0.0, height + upper])
    hand = wrist - [0.0, 0.15, 0.0]
    axes = [(Z, NONE), (Y, height * Z), (-Y, elbow), (-X, elbow), (-Y, wrist), (-X, hand)]
    end = robot.fk(np.zeros(6))
    np.testing.assert_allclose(end[:3, 3], hand + 0.16 * X, atol=1e-12)
    np.testing.assert_allclose(end[:3, 2], X, atol=1e-12)
    for q in np.random.default_rng(0).uniform(-3.0, 3.0, (20, 6)):
        pose = np.eye(4)
        for (axis, point), angle in zip(axes, q, strict=True):
            cross = np.cross(axis, np.eye(3)).T
            turn = np.eye(4)
            turn[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
            turn[:3, 3] = point - turn[:3, :3] @ point
            pose = pose @ turn
        np.testing.assert_allclose(robot.fk(q), pose @ end, atol=1e-12)


def test_a_published_pendant_posture_of_a_fanuc() -> None:
    """ros-industrial/fanuc_experimental, report no. 17: a pendant shows J3 -33.342 deg at these joint_states."""
    states = [
        0.2743533253669739,
        0.5467115640640259,
        -0.035214900970458984,
        1.2852824926376343,
        -1.7649667263031006,
        0.0,
    ]
    shown = rd.robots.get("fanuc_m710ic50").controller.from_robot(states)
    assert np.rad2deg(shown[2]) == pytest.approx(-33.342, abs=1e-3)
    np.testing.assert_array_equal(np.delete(shown, 2), np.delete(states, 2))


def test_a_published_pendant_posture_of_a_crx() -> None:
    """github.com/mattj23/crx-kinematics, report no. 1: these angles on the controller put the wrist on axis 1."""
    robot = rd.robots.get("fanuc_crx10ia")
    q = robot.controller.to_robot(np.deg2rad([10.0, -80.0, 10.0, 20.0, -20.0, 45.0]))
    np.testing.assert_allclose(robot.link_frames(q)[3][:2, 3], 0.0, atol=1e-15)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6))
def test_there_and_back(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 17))
    matrix, offset = rng.normal(size=(n, n)) + 3.0 * np.eye(n), rng.normal(size=n)
    robot = rd.Robot.from_links(np.tile(np.eye(4), (n, 1, 1)), np.eye(4), "R" * n)
    controller = robot.with_controller(matrix, offset).controller
    q = rng.normal(size=(5, n))
    p = controller.from_robot(q)
    np.testing.assert_allclose(p, q @ matrix.T + offset, atol=1e-12)
    size = np.linalg.cond(matrix) * 1e-14
    np.testing.assert_allclose(controller.to_robot(p), q, atol=10.0 * size * n)
    np.testing.assert_array_equal(controller.to_robot(p[0]), controller.to_robot(p)[0])
    np.testing.assert_allclose(controller.rates_from_robot(q), q @ matrix.T, atol=1e-12)
    np.testing.assert_allclose(controller.rates_to_robot(controller.rates_from_robot(q)), q, atol=10.0 * size * n)
    assert controller.names == [f"J{i}" for i in range(1, n + 1)]


def test_parts_make_the_matrix() -> None:
    robot = rd.robots.get("ur5e").with_controller(
        signs=[1, -1, 1, 1, 1, -1], coupling={(2, 1): -1.0, (5, 4): 0.5}, offset=np.arange(6.0), names=list("abcdef")
    )
    expected = np.diag([1.0, -1.0, 1.0, 1.0, 1.0, -1.0])
    expected[2, 1], expected[5, 4] = -1.0, 0.5
    np.testing.assert_array_equal(robot.controller.matrix, expected)
    assert robot.controller.names == list("abcdef")
    assert robot.with_controller() == rd.robots.get("ur5e")


def test_it_stays_with_the_robot(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    robot = rd.robots.get("panda").with_controller(
        np.eye(7) + 0.1 * rng.normal(size=(7, 7)), rng.normal(size=7), names=[*"ABCDEFG"]
    )
    assert robot != rd.robots.get("panda")
    for other in (
        robot.with_tool(np.eye(4)),
        robot.with_base(np.eye(4)),
        robot.with_limits(qd_max=np.ones(7)),
        robot.with_name("x"),
    ):
        assert other.controller == robot.controller
    assert pickle.loads(pickle.dumps(robot)) == robot
    file = tmp_path / "robot.toml"
    rd.robots.save(robot, file)
    assert rd.robots.load(file) == robot
    rail = rd.on_rail(robot, (0.0, 1.0, 0.0), -1.0, 1.0)
    np.testing.assert_array_equal(rail.controller.matrix[1:, 1:], robot.controller.matrix)
    assert rail.controller.names == ["E1", *"ABCDEFG"]
    crane = rd.on_rail(rail, (1.0, 0.0, 0.0), -1.0, 1.0)
    assert crane.controller.names == ["E2", "E1", *"ABCDEFG"]


def test_held_joints_go_into_the_offset() -> None:
    """What the controller shows of the other joints stays the same."""
    robot = rd.robots.get("fanuc_m710ic50")
    q = np.linspace(0.1, 0.6, 6)
    held = robot.with_fixed({1: q[1]})
    shown = held.controller.from_robot(np.delete(q, 1))
    np.testing.assert_allclose(shown, np.delete(robot.controller.from_robot(q), 1), atol=1e-15)
    assert held.controller.names == ["J1", "J3", "J4", "J5", "J6"]


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"matrix": np.ones((6, 6))}, "invertible"),
        ({"matrix": np.eye(5)}, r"\(6, 6\)"),
        ({"matrix": np.eye(6), "signs": np.ones(6)}, "matrix or its parts"),
        ({"signs": [2, 1, 1, 1, 1, 1]}, "1 or -1"),
        ({"signs": [1, 1]}, r"\(6,\)"),
        ({"offset": [0.0, np.nan, 0.0, 0.0, 0.0, 0.0]}, "finite"),
        ({"offset": [0.0]}, r"\(6,\)"),
        ({"coupling": {(1, 1): 1.0}}, "two different joints"),
        ({"coupling": {(1, 6): 1.0}}, "two different joints"),
        ({"coupling": {3: 1.0}}, "two different joints"),
        ({"names": ["a"] * 6}, "6 different names"),
        ({"names": ["a"]}, "6 different names"),
    ],
)
def test_what_is_refused(arguments: dict[str, Any], match: str) -> None:
    with pytest.raises(rd.RedundancyError, match=match):
        rd.robots.get("ur5e").with_controller(**arguments)


@pytest.fixture
def trajectory() -> rd.Trajectory:
    robot = rd.robots.get("fanuc_m710ic50")
    path = rd.Toolpath(
        np.linspace([1.1, -0.2, 0.4], [1.1, 0.2, 0.5], 5), np.tile([0.0, 0.0, -1.0], (5, 1)), time=np.arange(5.0)
    )
    return rd.follow(rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(0.5)), path)


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_pendant_values_are_written_and_read_back(tmp_path: Path, trajectory: rd.Trajectory, ending: str) -> None:
    file = tmp_path / f"trajectory.{ending}"
    trajectory.write(file, joints="controller")
    text = file.read_text(encoding="utf-8")
    assert "J3_deg" in text
    assert "q3_rad" not in text
    if ending == "csv":
        header, first, *_ = text.splitlines()
        row = dict(zip(header.split(","), first.split(","), strict=True))
        degrees = np.rad2deg(trajectory.q[0])
        assert float(row["J2_deg"]) == pytest.approx(degrees[1], rel=1e-14)
        assert float(row["J3_deg"]) == pytest.approx(degrees[2] - degrees[1], rel=1e-13)
    again = rd.Trajectory.read(file, trajectory.robot)
    np.testing.assert_allclose(again.q, trajectory.q, atol=1e-14)
    np.testing.assert_array_equal(again.position_error, trajectory.position_error)
    if ending == "json":
        np.testing.assert_allclose(rd.Trajectory.read(file).q, trajectory.q, atol=1e-14)
    with pytest.raises(rd.ToolpathError, match="joints are J1_deg"):
        rd.Trajectory.read(file, trajectory.robot.with_controller(names=[*"abcdef"]))


def test_a_rail_is_shown_in_millimetres(tmp_path: Path) -> None:
    robot = rd.on_rail(rd.robots.get("fanuc_m710ic50"), (0.0, 1.0, 0.0), -1.0, 1.0)
    q = np.linspace(0.1, 0.7, 7)
    tool = robot.fk(q)
    path = rd.Toolpath(tool[:3, 3][None], tool[:3, 2][None])
    one, zero = np.ones(1), np.zeros(1)
    file = tmp_path / "rail.csv"
    rd.Trajectory(robot, path, q[None], one, one, zero, zero, ["converged"]).write(file, joints="controller")
    header, first = file.read_text(encoding="utf-8").splitlines()
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert float(row["E1_mm"]) == pytest.approx(100.0)
    np.testing.assert_allclose(rd.Trajectory.read(file, robot).q, q[None], atol=1e-15)


def test_whose_joints_is_checked(tmp_path: Path, trajectory: rd.Trajectory) -> None:
    with pytest.raises(rd.InvalidValueError, match="'robot' or 'controller'"):
        trajectory.write(tmp_path / "t.csv", joints="pendant")  # type: ignore[arg-type]
    with pytest.raises(rd.InvalidValueError, match="poses alone"):
        trajectory.write(tmp_path / "t.pathx", joints="controller")


def test_pictures_of_the_controllers_joints(trajectory: rd.Trajectory) -> None:
    pytest.importorskip("matplotlib")
    figure = rd.plots.joints_against_limits(trajectory, "controller")
    panel = figure.axes[2]
    assert panel.get_ylabel() == "J3 [deg]"
    shown = np.rad2deg(trajectory.q[:, 2] - trajectory.q[:, 1])
    np.testing.assert_allclose(np.asarray(panel.lines[0].get_ydata()), shown)
    legend = trajectory.plot(joints="controller").axes[1].get_legend()
    assert legend is not None
    labels = [text.get_text() for text in legend.get_texts()]
    # Joint 3 has no limits of its own there.
    assert labels == ["J1", "J2", "J4", "J5", "J6"]


def test_command_line_speaks_the_controllers_joints(tmp_path: Path) -> None:
    """Forearm level and upper arm 30 deg forward on the pendant: the wrist goes by the upper arm alone."""
    arguments = ["posture", "fanuc_m710ic50", "--controller", "--q", "0,30,0,0,0,0"]
    run = CliRunner(env={"COLUMNS": "200"}).invoke(main, arguments)
    assert run.exit_code == 0
    x = 150.0 + 870.0 * np.sin(np.deg2rad(30.0)) + 1016.0 + 175.0
    z = 870.0 * np.cos(np.deg2rad(30.0)) + 170.0
    assert f"{x:.3f}, 0.000, {z:.3f} mm" in run.stdout
    assert "0.0000, 30.0000, 0.0000, 0.0000, 0.0000, 0.0000 deg" in run.stdout
    job = tmp_path / "job.toml"
    job.write_text(
        """robot = "fanuc_m710ic50"
[objective]
length_mm = 500
[path.helix]
radius_mm = 100
pitch_mm_per_rad = 10
start_deg = 0
stop_deg = 20
center_mm = [900, 0, 0]
offset_deg = 180
points = 3
[output]
joints = "controller"
"""
    )
    run = CliRunner().invoke(main, ["solve", str(job), "--out", str(tmp_path / "out"), "--no-pictures"])
    assert run.exit_code == 0, run.stderr
    assert "J3_deg" in (tmp_path / "out" / "trajectory.csv").read_text()


FILE = """name = "two"
joints = "RPR"
[units]
length = "mm"
angle = "deg"
[dh]
a = [500, 0, 300]
d = [0, 0, 0]
alpha = [0, 90, 0]
theta = [0, 0, 0]
[limits]
q_min = [-90, 0, -inf]
q_max = [90, 200, inf]
[[mimic]]
joint = 3
driver = 1
factor = -0.5
offset = 30
[controller]
names = ["A", "B"]
signs = [-1, 1]
coupling = [[2, 1, 0.25]]
offset = [90, 100]
"""


def test_a_file_with_both(tmp_path: Path) -> None:
    file = tmp_path / "two.toml"
    file.write_text(FILE)
    robot = rd.robots.load(file)
    assert (robot.n, robot.joints, robot.chain) == (2, "RP", "RPR")
    assert robot.mimic == {2: (0, -0.5, np.deg2rad(30.0))}
    np.testing.assert_array_equal(robot.q_max, [np.pi / 2.0, 0.2])
    np.testing.assert_allclose(robot.controller.offset, [np.pi / 2.0, 0.1])
    np.testing.assert_array_equal(robot.controller.matrix, [[-1.0, 0.0], [0.25, 1.0]])
    assert robot.controller.names == ["A", "B"]
    again = tmp_path / "again.toml"
    rd.robots.save(robot, again)
    assert rd.robots.load(again) == robot


@pytest.mark.parametrize(
    ("change", "match"),
    [
        (("driver = 1", "driver = 4"), r"mimic\[0\]\.driver: got 4, expected a joint from 1 to 3"),
        (("driver = 1", "drivers = 1"), "did you mean driver"),
        (("driver = 1", ""), r"mimic\[0\]\.driver: got nothing"),
        (("driver = 1", "driver = 3"), "mimics itself"),
        (("[[mimic]]", "[mimic]"), "mimic: .*array of tables"),
        (("factor = -0.5", "factor = nan"), "finite number"),
        (('["A", "B"]', '["A", 2]'), r"controller\.names"),
        (('["A", "B"]', '["A"]'), "2 different names"),
        (("[-1, 1]", "[-1, 1, 1]"), r"controller\.signs"),
        (("[-1, 1]", "[-1, 2]"), "1 or -1"),
        (("[[2, 1, 0.25]]", "[[2, 1]]"), r"controller\.coupling"),
        (("[[2, 1, 0.25]]", "[[2, 1.5, 0.25]]"), r"controller\.coupling"),
        (("[[2, 1, 0.25]]", "3"), r"controller\.coupling"),
        (("coupling =", "couplings ="), "did you mean coupling"),
        (("coupling = [[2, 1, 0.25]]", "matrix = [[1, 1], [1, 1]]"), "matrix or its parts"),
    ],
)
def test_a_malformed_file_is_named(tmp_path: Path, change: tuple[str, str], match: str) -> None:
    file = tmp_path / "two.toml"
    file.write_text(FILE.replace(*change))
    with pytest.raises(rd.ModelError, match=match) as caught:
        rd.robots.load(file)
    assert str(file) in str(caught.value)
