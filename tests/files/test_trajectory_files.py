"""Files of trajectories: every format parsed back, nothing written by half."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

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
