"""Trajectories read from the files that were written of them."""

from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

COLUMNS = ("q", "condition_number", "value", "position_error", "axis_error")


@pytest.fixture(scope="module")
def trajectory() -> rd.Trajectory:
    robot = rd.robots.get("fanuc_m710ic50_milling")
    path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0), points=9, duration=4.0)
    return rd.follow(rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(0.4856)), path)


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_what_was_written_is_read(trajectory: rd.Trajectory, tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"trajectory.{ending}"
    trajectory.write(file)
    read = rd.Trajectory.read(file, trajectory.robot)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(read, name), getattr(trajectory, name))
    for name in ("position", "axis", "time"):
        np.testing.assert_array_equal(getattr(read.path, name), getattr(trajectory.path, name))
    assert read.robot is trajectory.robot
    assert read.status == trajectory.status
    again = tmp_path / f"again.{ending}"
    read.write(again)
    assert again.read_bytes() == file.read_bytes()
    assert read.length == (trajectory.length if ending == "json" else None)


def test_numbers_that_are_not_finite_come_back(tmp_path: Path) -> None:
    robot = rd.robots.get("panda")
    path = rd.Toolpath([[9.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
    nothing = np.array([np.nan])
    trajectory = rd.Trajectory(
        robot, path, np.zeros((1, 7)), nothing, nothing, np.array([8.0]), nothing, ["unreachable"]
    )
    for file in (tmp_path / "far.csv", tmp_path / "far.json"):
        trajectory.write(file)
        read = rd.Trajectory.read(file, robot)
        assert np.isnan([read.condition_number[0], read.value[0], read.axis_error[0]]).all()
        assert read.unreachable == [0]
        assert read.time is None


def test_json_names_a_packaged_robot(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    file = tmp_path / "trajectory.json"
    trajectory.write(file)
    read = rd.Trajectory.read(file)
    assert read.robot.name == trajectory.robot.name
    np.testing.assert_array_equal(read.q, trajectory.q)


def test_a_robot_with_another_tool_is_not_the_packaged_one(tmp_path: Path) -> None:
    tool = np.eye(4)
    tool[2, 3] = 0.1
    robot = rd.robots.get("panda").with_tool(tool)
    q = np.full((1, 7), 0.3)
    frame = robot.fk(q[0])
    path, zero = rd.Toolpath(frame[None, :3, 3], frame[None, :3, 2]), np.zeros(1)
    file = tmp_path / "trajectory.json"
    rd.Trajectory(robot, path, q, zero + 2.0, zero, zero, zero, ["converged"]).write(file)
    assert rd.Trajectory.read(file, robot).robot is robot
    with pytest.raises(rd.ToolpathError, match="its tool is elsewhere"):
        rd.Trajectory.read(file)


def test_what_names_no_robot_needs_one(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    trajectory.write(tmp_path / "trajectory.csv")
    with pytest.raises(rd.InvalidValueError, match="does not name its robot"):
        rd.Trajectory.read(tmp_path / "trajectory.csv")
    text = (tmp_path / "trajectory.csv").read_bytes()
    (tmp_path / "bad.csv").write_bytes(text.replace(b"converged", b"\xff", 1))
    with pytest.raises(rd.ToolpathError, match=r"bad\.csv:2:\d+: not UTF-8 text"):
        rd.Trajectory.read(tmp_path / "bad.csv", trajectory.robot)


def test_a_trajectory_of_another_robot_is_refused(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    trajectory.write(tmp_path / "trajectory.csv")
    with pytest.raises(rd.ToolpathError, match="joints are q1_rad"):
        rd.Trajectory.read(tmp_path / "trajectory.csv", rd.robots.get("panda"))
