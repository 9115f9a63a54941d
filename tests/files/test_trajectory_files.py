"""Files of trajectories: every format parsed back, nothing written by half."""

import csv
import dataclasses
import json
import re
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
import redundancy as rd
from scipy.spatial.transform import Rotation

from tests.reference.chain import F64
from tests.reference.helix import PATH, ROBOT


def test_csv(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    file = tmp_path / "t.csv"
    trajectory.write(file)
    with file.open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 11
    q = np.array([[float(row[f"q{i + 1}_rad"]) for i in range(6)] for row in rows])
    np.testing.assert_array_equal(q, trajectory.q)
    np.testing.assert_array_equal([float(row["condition_number"]) for row in rows], trajectory.condition_number)
    np.testing.assert_array_equal([float(row["t_s"]) for row in rows], PATH.time)
    np.testing.assert_array_equal([[float(row[f"{c}_m"]) for c in "xyz"] for row in rows], PATH.position)
    assert [row["status"] for row in rows] == trajectory.status


def test_json(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    file = tmp_path / "t.json"
    trajectory.write(file)
    content = json.loads(file.read_text(encoding="utf-8"))
    q = np.array([content["columns"][f"q{i + 1}_rad"] for i in range(6)]).T
    np.testing.assert_array_equal(q, trajectory.q)
    assert content["max_condition_number"] == trajectory.max_condition_number
    assert content["status"] == trajectory.status
    assert content["robot"] == "fanuc_m710ic50_milling"


def test_pathx(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    file = tmp_path / "t.pathx"
    trajectory.write(file)
    lines = file.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "<pathData>"
    assert lines[-1] == "</pathData>"
    moves = [line for line in lines if line.startswith("<m>")]
    number = r"-?\d+\.\d{6}"
    pattern = re.compile(rf"<m>(jc|lc)((?: {number}){{6}}) 0 (\d+\.\d{{3}})</m>")
    parsed = [pattern.fullmatch(move) for move in moves]
    assert len(parsed) == 11
    tools = ROBOT.fk(trajectory.q)
    for point, match in enumerate(parsed):
        assert match is not None
        assert match[1] == ("lc" if point else "jc")
        x, y, z, *angles = (float(word) for word in match[2].split())
        np.testing.assert_allclose([x, y, z], 1000 * PATH.position[point], atol=1e-6)
        a, b, c = np.deg2rad(angles)
        np.testing.assert_allclose(_rx(a) @ _ry(b) @ _rz(c), tools[point, :3, :3], atol=1e-7)
        speed = 1000 * np.hypot(0.25, 0.5 / np.pi) * np.pi / 2 / 10
        assert float(match[3]) == pytest.approx(speed, rel=1e-2)


def poses(file: Path) -> tuple[F64, F64]:
    """Positions [m] and rotations of a file, by an XML parser and scipy's rotations."""
    moves = [move.text or "" for move in ElementTree.parse(file).iterfind("./operation[@id='1']/m")]
    numbers = np.array([[float(word) for word in move.split()[1:7]] for move in moves])
    return numbers[:, :3] / 1000.0, Rotation.from_euler("XYZ", numbers[:, 3:], degrees=True).as_matrix()


@pytest.mark.parametrize("lever", [0.0, 0.3])
def test_pathx_of_the_flange(trajectory: rd.Trajectory, tmp_path: Path, lever: float) -> None:
    tool = ROBOT.tool.copy()
    tool[:3, 3] = [0.1 * lever, -lever, lever]
    longer = dataclasses.replace(trajectory, robot=ROBOT.with_tool(tool))
    for frame in ("tool", "flange"):
        longer.write(tmp_path / f"{frame}.pathx", frame)
    position, rotation = poses(tmp_path / "flange.pathx")
    # The last frame of the chain, from the DH table alone.
    dh = ROBOT.dh
    assert dh is not None
    bare = rd.Robot.from_dh(dh["a"], dh["d"], dh["alpha"], dh["theta"]).fk(trajectory.q)
    np.testing.assert_allclose(position, bare[:, :3, 3], atol=1e-9)
    np.testing.assert_allclose(rotation, bare[:, :3, :3], atol=1e-7)
    # With the tool on it, it is the tool frame.
    tip, turned = poses(tmp_path / "tool.pathx")
    np.testing.assert_allclose(position + rotation @ tool[:3, 3], tip, atol=1e-7)
    np.testing.assert_allclose(rotation @ tool[:3, :3], turned, atol=1e-7)
    if lever == 0.0:
        # As in appendix A: the tip, turned as the last frame of the table; the milling axis leans by 120 degrees there.
        np.testing.assert_allclose(position, PATH.position, atol=1e-8)
        np.testing.assert_allclose(rotation @ [np.sqrt(0.75), 0.0, -0.5], PATH.axis, atol=1e-7)


def test_frames_that_a_file_does_not_have(trajectory: rd.Trajectory, tmp_path: Path) -> None:
    for ending in ("csv", "json"):
        with pytest.raises(rd.InvalidValueError, match=rf"frame is 'flange', expected 'tool' for a \.{ending} file"):
            trajectory.write(tmp_path / f"t.{ending}", "flange")
    with pytest.raises(rd.InvalidValueError, match="frame is 'base', expected 'tool' or 'flange'"):
        trajectory.write(tmp_path / "t.pathx", "base")  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def _rx(t: float) -> F64:
    return np.array([[1, 0, 0], [0, np.cos(t), -np.sin(t)], [0, np.sin(t), np.cos(t)]])


def _ry(t: float) -> F64:
    return np.array([[np.cos(t), 0, np.sin(t)], [0, 1, 0], [-np.sin(t), 0, np.cos(t)]])


def _rz(t: float) -> F64:
    return np.array([[np.cos(t), -np.sin(t), 0], [np.sin(t), np.cos(t), 0], [0, 0, 1]])


def test_numbers_that_are_not_finite_survive_the_files(tmp_path: Path) -> None:
    path = rd.Toolpath([[9.0, 0, 0]], [[1.0, 0, 0]])
    solver = rd.OrthogonalSQP(ROBOT, rd.Task.axisymmetric(), rd.LimitBarrier())
    trajectory = rd.follow(solver, path, ROBOT.q_max)
    assert trajectory.status == ["unreachable"]
    assert trajectory.max_joint_speed is None
    for ending in ("csv", "json", "pathx"):
        trajectory.write(tmp_path / f"t.{ending}")
    content = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"), parse_constant=pytest.fail)
    assert content["status"] == ["unreachable"]


def test_nothing_is_written_half(trajectory: rd.Trajectory, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(rd.InvalidValueError, match="txt"):
        trajectory.write(tmp_path / "t.txt")
    file = tmp_path / "t.csv"
    file.write_text("before", encoding="utf-8")

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="No space left"):
        trajectory.write(file)
    assert file.read_text(encoding="utf-8") == "before"
    assert [entry.name for entry in tmp_path.iterdir()] == ["t.csv"]
