"""Names of joints: where they come from, and that nothing loses them."""

import json
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

NAMES = ("turn", "lift", "slide")
ARM = rd.Robot.from_dh(
    [0.3, 0.2, 0.0],
    [0.4, 0.0, 0.0],
    [0.0, np.pi, 0.0],
    [0.0, 0.0, 0.0],
    joints="RRP",
    q_min=[-2.0, -2.0, 0.0],
    q_max=[2.0, 2.0, 0.2],
    name="arm",
    joint_names=NAMES,
)
PLAIN = rd.robots.get("planar_3r")


def test_joints_without_names_are_counted() -> None:
    assert PLAIN.joint_names == ("joint 1", "joint 2", "joint 3")
    assert [PLAIN.joint_label(i) for i in range(3)] == ["joint 1", "joint 2", "joint 3"]
    assert [ARM.joint_label(i) for i in range(3)] == ["joint 1 (turn)", "joint 2 (lift)", "joint 3 (slide)"]
    assert ARM.with_joint_names(PLAIN.joint_names).joint_label(1) == "joint 2"


def test_nothing_loses_names(tmp_path: Path) -> None:
    frame = np.eye(4)
    linked = rd.Robot.from_links(ARM.links, ARM.flange, ARM.joints, joint_names=list(NAMES))
    for robot in (ARM, linked):
        rd.robots.save(robot, tmp_path / "arm.toml")
        for same in (
            rd.robots.load(tmp_path / "arm.toml"),
            pickle.loads(pickle.dumps(robot)),
            robot.with_tool(frame),
            robot.with_base(frame),
            robot.with_limits(q_min=[-1.0, -1.0, 0.0]),
            robot.with_name("other"),
        ):
            assert same.joint_names == NAMES
    assert ARM.with_joint_names(["a", "b", "c"]) != ARM
    rd.robots.save(PLAIN, tmp_path / "plain.toml")
    assert "joint_names" not in (tmp_path / "plain.toml").read_text(encoding="utf-8")
    assert rd.robots.load(tmp_path / "plain.toml") == PLAIN
    assert ARM.with_fixed({1: 0.3}).joint_names == ("turn", "slide")


def test_rails_and_turntables_have_names() -> None:
    rail = rd.on_rail(ARM, (1.0, 0.0, 0.0), -1.0, 1.0)
    assert rail.joint_names == ("rail", *NAMES)
    assert rd.on_rail(rail, (0.0, 1.0, 0.0), -1.0, 1.0).joint_names == ("outer rail", "rail", *NAMES)
    assert rd.with_turntable(PLAIN, np.eye(4), -1.0, 1.0).joint_names == ("turntable", "joint 1", "joint 2", "joint 3")


@pytest.mark.parametrize(
    ("names", "kind", "message"),
    [
        (["a", "b"], rd.ShapeError, "joint_names"),
        (["a", "b", "a"], rd.InvalidValueError, r'joint_names\[2\] is "a"'),
        (["a", " ", "c"], rd.InvalidValueError, r"joint_names\[1\]"),
    ],
)
def test_names_that_are_refused(tmp_path: Path, names: list[str], kind: type[Exception], message: str) -> None:
    with pytest.raises(kind, match=message):
        ARM.with_joint_names(names)
    file = tmp_path / "arm.toml"
    rd.robots.save(ARM, file)
    listed = file.read_text(encoding="utf-8")
    start = listed.index("joint_names = [")
    old = listed[start : listed.index("]", start) + 1]
    file.write_text(listed.replace(old, f"joint_names = {json.dumps(names)}"), encoding="utf-8")
    with pytest.raises(rd.ModelError, match="joint_names"):
        rd.robots.load(file)


def test_names_where_joints_are_shown(tmp_path: Path) -> None:
    names = ["$x", "_hidden", "elbow"]
    robot = PLAIN.with_joint_names(names)
    path = rd.Toolpath(np.linspace([1.5, 1.0, 0.0], [1.0, 1.5, 0.0], 5), np.tile([0.0, 0.0, 1.0], (5, 1)))
    task = rd.Task("free", ("plane", (0.0, 0.0, 1.0)), "base")
    trajectory = rd.follow(rd.OrthogonalSQP(robot, task, rd.ConditionNumber(1.0, rows=[2, 3, 4])), path)
    trajectory.write(tmp_path / "t.json")
    assert json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))["joint_names"] == names
    assert "elbow" not in (tmp_path / "t.json").read_text(encoding="utf-8").split("columns")[1]
    pytest.importorskip("matplotlib")
    figure = rd.plots.joints_against_limits(trajectory)
    shown = [axes.get_ylabel() for axes in figure.axes]
    assert [label.split(" [")[0].strip("\N{ZERO WIDTH SPACE}") for label in shown[:3]] == [r"\$x", "_hidden", "elbow"]
    rd.plots.save(rd.plots.overview(trajectory), tmp_path / "o.svg")


def test_failures_of_plans_name_the_joint() -> None:
    failure = rd.PlanFailure(3, "joint limit", 2, 0.1)
    assert "of joint 3 (elbow), which" in failure.told(PLAIN.with_joint_names(["a", "b", "elbow"]))
    assert failure.told(PLAIN) == str(failure)
    assert rd.PlanFailure(3, "unreachable").told(PLAIN) == str(rd.PlanFailure(3, "unreachable"))


@pytest.mark.parametrize("size", [1e308, -1e308, 1.1e6])
def test_lengths_that_are_mistakes_are_refused(size: float) -> None:
    zero = [0.0, 0.0]
    frame = np.eye(4)
    frame[1, 3] = size
    shown = f"{abs(size):e}".split("e")[0].rstrip("0").rstrip(".")
    attempts: list[tuple[str, Callable[[], object]]] = [
        (r"a\[1\]", lambda: rd.Robot.from_dh([0.0, size], zero, zero, zero)),
        (r"d\[0\]", lambda: rd.Robot.from_dh(zero, [size, 0.0], zero, zero)),
        (r"translation of tool\[1\]", lambda: ARM.with_tool(frame)),
        (r"translation of base\[1\]", lambda: ARM.with_base(frame)),
        (r"translation of tool\[1\]", lambda: rd.Robot.from_dh(zero, zero, zero, zero, tool=frame)),
        (r"translation of links\[0\]\[1\]", lambda: rd.Robot.from_links(frame[None], np.eye(4), "R")),
        (r"translation of flange\[1\]", lambda: rd.Robot.from_links(np.eye(4)[None], frame, "R")),
    ]
    for name, attempt in attempts:
        with pytest.raises(rd.InvalidValueError, match=rf"{name} is -?{shown}.*, expected at most 1e6 m"):
            attempt()
    limit = rd.Robot.from_dh([1e6, -1e6], zero, zero, zero)
    assert np.isfinite(limit.jacobian_second_derivative(zero)).all()
