"""Job files whose task is a volume of orientations, or whose criterion is the speed of the tool."""

from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from click.testing import CliRunner
from redundancy.cli import main
from redundancy.cli.job import read_job

JOB = """
robot = "fanuc_m710ic50_milling"

[objective]
length_mm = 485.5933
weights = {{ condition_number = 1.0 }}

[task]
{task}

[path.helix]
radius_mm = 250
pitch_mm_per_rad = 159.155
start_deg = 0
stop_deg = 90
offset_deg = 180
center_mm = [1300, 1000, 0]
points = 9

[plan]
criterion = "{criterion}"
"""
CONE = 'kind = "cone"\ntilt_deg = 10'


def job(folder: Path, task: str, criterion: str = "minimax") -> Path:
    file = folder / "job.toml"
    file.write_text(JOB.format(task=task, criterion=criterion))
    return file


@pytest.mark.parametrize(
    ("task", "volume"),
    [
        (CONE, rd.OrientationVolume.cone(np.deg2rad(10))),
        (CONE + "\nspin_deg = [-30, 45]", rd.OrientationVolume.cone(np.deg2rad(10), spin=(-np.pi / 6, np.pi / 4))),
        ('kind = "pyramid"\ntilt_x_deg = 10\ntilt_y_deg = 5', rd.OrientationVolume.pyramid(*np.deg2rad([10, 5]))),
        ('kind = "square"\ntilt_x_deg = 10\ntilt_y_deg = 5', rd.OrientationVolume.square(*np.deg2rad([10, 5]))),
        ('kind = "line_y"\ntilt_deg = 10', rd.OrientationVolume.line_y(np.deg2rad(10))),
    ],
)
def test_volumes_are_read(tmp_path: Path, task: str, volume: rd.OrientationVolume) -> None:
    assert read_job(job(tmp_path, task)).task == rd.Task.within(volume)


def test_plan_and_map(tmp_path: Path) -> None:
    file = job(tmp_path, CONE)
    result = CliRunner().invoke(main, ["plan", str(file), "--out", str(tmp_path / "out"), "--no-pictures"])
    assert result.exit_code == 0, result.output
    assert "tilt" in result.output
    assert "deg at most" in result.output
    trajectory = rd.Trajectory.read(tmp_path / "out" / "trajectory.csv", rd.robots.get("fanuc_m710ic50_milling"))
    assert len(trajectory) == 9
    result = CliRunner().invoke(main, ["map", str(file), "--out", str(tmp_path / "map"), "--angles", "12"])
    assert result.exit_code == 0, result.output
    with np.load(tmp_path / "map" / "map.npz") as arrays:
        assert arrays["value"].ndim == 4


def test_speed(tmp_path: Path) -> None:
    file = job(tmp_path, CONE, "speed")
    result = CliRunner().invoke(main, ["plan", str(file), "--out", str(tmp_path / "out"), "--no-pictures"])
    assert result.exit_code == 0, result.output
    assert "tool speed" in result.output
    assert "mm/s" in result.output


@pytest.mark.parametrize(
    ("task", "word"),
    [
        ('kind = "cone"', "tilt_deg"),
        ('kind = "cone"\ntilt_deg = -1', "tilt"),
        ('kind = "pyramid"\ntilt_deg = 10', "tilt"),
        (CONE + "\nspin_deg = [30, -30]", "spin"),
        ('kind = "axisymmetric"\ntilt_deg = 10', "tilt_deg"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, task: str, word: str) -> None:
    with pytest.raises(rd.RedundancyError, match=word):
        read_job(job(tmp_path, task))
