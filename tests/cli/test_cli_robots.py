"""Links of URDF files and robots of few joints on the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

from tests.cli.jobs import job, run
from tests.reference.chain import F64
from tests.reference.urdfs import LIMIT, joint, links, robot

ENDS = robot(
    links("base_link l1 l2 l3 base tool0 ee_link"),
    joint("pan", "base_link", "l1", f'<origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>{LIMIT}'),
    joint("lift", "l1", "l2", f'<origin xyz="0.1 0 0"/><axis xyz="0 1 0"/>{LIMIT}'),
    joint("elbow", "l2", "l3", f'<origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>{LIMIT}'),
    joint("mount", "base_link", "base", '<origin rpy="0 0 3.14"/>', "fixed"),
    joint("flange", "l3", "tool0", '<origin xyz="0.2 0 0.1"/>', "fixed"),
    joint("end", "l3", "ee_link", '<origin xyz="0.2 0 0"/>', "fixed"),
)
CUT = '[objective]\nlength = 0.5\n[task]\nkind = "position"\n[path]\nfile = "path.csv"\n'


def write_path(folder: Path, model: rd.Robot, start: F64, step: F64) -> None:
    """Write a path of eleven points that a robot reaches."""
    tools = model.fk(start + step * np.linspace(0.0, 1.0, 11)[:, None])
    rd.Toolpath(tools[:, :3, 3], tools[:, :3, 2]).write(folder / "path.csv")


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A URDF with three end links, and a path that its tool reaches."""
    file = tmp_path / "arm.urdf"
    file.write_text(ENDS, encoding="utf-8")
    write_path(tmp_path, rd.Robot.from_urdf(file, tip="tool0"), np.array([0.1, -0.6, 0.9]), np.array([0.3, 0.1, 0.1]))
    return file


@pytest.mark.parametrize("command", ["posture", "length"])
def test_tip_and_base(arm: Path, command: str) -> None:
    result = run(command, arm)
    assert result.exit_code == 2
    assert "3 end links (base, tool0, ee_link)" in result.stderr
    assert "--tip" in result.stderr
    result = run(command, arm, "--tip", "tool0")
    assert result.exit_code == 0, result.output
    assert "pan, lift, elbow" in result.output
    result = run(command, arm, "--tip", "tool0", "--base", "l1")
    assert "pan" not in result.output
    assert "lift, elbow" in result.output
    for wrong in (("--tip", "tool"), ("--tip", "tool0", "--base", "lone")):
        result = run(command, arm, *wrong)
        assert result.exit_code == 2
        assert "expected one of the links" in result.stderr
    result = run(command, "panda", "--tip", "tool0")
    assert result.exit_code == 2
    assert "panda is no .urdf file" in result.stderr


@pytest.mark.parametrize(
    ("head", "options"),
    [
        ('robot = "arm.urdf"\ntip = "tool0"\n', []),
        ('robot = { file = "arm.urdf", tip = "tool0" }\n', []),
        ('robot = { file = "arm.urdf", tip = "tool0", limits = { elbow = [-3.0, 3.0] } }\n', []),
        ('robot = "arm.urdf"\n', ["--tip", "tool0"]),
        ('robot = "arm.urdf"\ntip = "ee_link"\n', ["--tip", "tool0", "--base", "base_link"]),
    ],
)
def test_tip_and_base_in_jobs(arm: Path, head: str, options: list[str]) -> None:
    out = arm.parent / "out"
    result = run("solve", job(arm.parent, head + CUT), "--out", out, "--no-pictures", *options)
    assert result.exit_code == 0, result.output
    assert "11 of 11" in result.output
    content = json.loads((out / "trajectory.json").read_text(encoding="utf-8"))
    assert content["joint_names"] == ["pan", "lift", "elbow"]
    assert any(f"({name})" in result.output for name in ("pan", "lift", "elbow"))


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ('robot = "arm.urdf"\n', "3 end links"),
        ('robot = "arm.urdf"\ntip = 3\n', "tip: got 3"),
        ('robot = "arm.urdf"\ntip = "tol0"\n', 'job.toml: tip is "tol0"'),
        ('robot = "panda"\ntip = "tool0"\n', "no .urdf file"),
        ('robot = { fil = "arm.urdf" }\n', "robot.fil: unknown key; did you mean file"),
        ('robot = { file = "arm.urdf" }\ntip = "tool0"\n', "none beside a table robot"),
        ('robot = { file = "arm.urdf", tip = "tool0", limits = { elbo = [0, 1] } }\n', 'perhaps "elbow"'),
    ],
)
def test_links_in_jobs_that_are_wrong(arm: Path, head: str, message: str) -> None:
    result = run("solve", job(arm.parent, head + CUT), "--out", arm.parent / "out")
    assert result.exit_code == 2
    assert message in result.stderr
    assert "arm.urdf" in result.stderr or "job.toml" in result.stderr


Q = np.pi / 2.0
FEW = {
    "5R": (
        rd.Robot.from_dh([0, 0.5, 0.4, 0, 0], [0.3, 0, 0, 0, 0.2], [Q, 0, 0, Q, 0], [0, Q, 0, 0, 0]),
        [0.3, -0.4, -0.9, -0.7, 0.2],
        None,
    ),
    "PPPRR": (
        rd.Robot.from_dh([0] * 5, [0, 0, 0, 0, 0.2], [Q, Q, 0, Q, 0], [Q, Q, 0, 0, 0], joints="PPPRR"),
        [0.5, 0.4, 0.3, 0.3, 2.6],
        None,
    ),
    "planar": (rd.robots.get("planar_3r"), [0.3, 0.4, 0.5], [2, 3, 4]),
    "scara": (
        rd.Robot.from_dh([0.3, 0.2, 0, 0], [0.4, 0, 0, 0], [0, np.pi, 0, 0], [0] * 4, joints="RRPR"),
        [0.3, 0.4, 0.1, 0.2],
        [2, 3, 4, 5],
    ),
}


@pytest.mark.parametrize("name", FEW)
def test_robots_of_few_joints(tmp_path: Path, name: str) -> None:
    model, start, rows = FEW[name]
    rd.robots.save(model.with_name(name), tmp_path / "few.toml")
    moved = np.zeros(model.n)
    moved[:2] = 0.1
    write_path(tmp_path, model, np.array(start), moved)
    asked = 'robot = "few.toml"\n[objective]\nlength = 0.5\n[path]\nfile = "path.csv"\n'
    out = tmp_path / "out"
    result = run("solve", job(tmp_path, asked), "--out", out)
    assert result.exit_code == 0, result.output
    assert "11 of 11" in result.output
    content = json.loads((out / "trajectory.json").read_text(encoding="utf-8"))["columns"]
    q = np.stack([content[key] for key in content if key.startswith("q")], axis=1)
    path = rd.Toolpath.read(tmp_path / "path.csv")
    tools = model.fk(q)
    np.testing.assert_allclose(tools[:, :3, 3], path.position, atol=1e-9)
    np.testing.assert_allclose(tools[:, :3, 2], path.axis, atol=1e-9)
    if rows is None:
        # All but that of the spin.
        rows = np.delete(np.arange(6), np.abs(path.axis.mean(axis=0)).argmax()).tolist()
    # kappa_F of the rows that are found, by numpy.
    jacobian = model.jacobian(q)[:, rows] * np.where(np.array(rows) < 3, 0.5, 1.0)[:, None]
    kappa = np.linalg.norm(jacobian, axis=(1, 2)) * np.linalg.norm(np.linalg.pinv(jacobian), axis=(1, 2)) / len(rows)
    np.testing.assert_allclose(content["condition_number"], kappa, rtol=1e-9)
    degrees = np.where([kind == "P" for kind in model.joints], 1000.0 * np.array(start), np.rad2deg(start))
    joints = ",".join(map(repr, degrees.tolist()))
    shown = ", ".join(map(str, rows))
    for arguments in (("posture", "--q", joints), ("length", "--starts", 3)):
        result = run(arguments[0], tmp_path / "few.toml", *arguments[1:])
        assert result.exit_code == 0, result.output
        if arguments[0] == "posture":
            assert (f" {shown} " in result.output) == (rows != model.rows_in_use())
        result = run(arguments[0], tmp_path / "few.toml", *arguments[1:], "--rows", "3,4")
        assert result.exit_code == 0, result.output
        assert " 3, 4 " in result.output


@pytest.mark.parametrize("rows", ["0,1,2,3,4,5,6", "5,4", "1,1", "x", "", "0,1,2,3"])
def test_rows_that_are_wrong(rows: str) -> None:
    result = run("posture", "planar_3r", "--rows", rows)
    assert result.exit_code == 2
    assert "expected" in result.stderr


def test_what_joints_cannot_change_is_told(tmp_path: Path) -> None:
    model, start, _ = FEW["scara"]
    rd.robots.save(model.with_name("scara"), tmp_path / "few.toml")
    write_path(tmp_path, model, np.array(start), np.zeros(4))
    asked = 'robot = "few.toml"\n[objective]\nlength = 0.5\n[path]\nfile = "path.csv"\n'
    path = rd.Toolpath.read(tmp_path / "path.csv")
    rd.Toolpath(path.position, path.axis + np.array([0.0, 0.1, 0.0])).write(tmp_path / "path.csv")
    result = run("solve", job(tmp_path, asked), "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "cannot reach 11 of 11 points; the first is point 0, by" in result.stderr
    assert "and 5.71 deg" in result.stderr
