"""A job that the tests of the command line share, how it is written, and how a command is run."""

from pathlib import Path

from click.testing import CliRunner, Result
from redundancy.cli import main

JOB = """robot = "fanuc_m710ic50_milling"
[objective]
length_mm = 485.5933
weights = { condition_number_squared = 1.0 }
[task]
kind = "axisymmetric"
axis = [0, 0, 1]
[path.helix]
radius_mm = 250
pitch_mm_per_rad = 159.15494309189535
start_deg = 0
stop_deg = 90
offset_deg = 180
center_mm = [1300, 1000, 0]
points = 21
duration_s = 10
"""
"""The helix of the thesis, every fifth point."""


def run(*arguments: object) -> Result:
    """Run a command."""
    return CliRunner().invoke(main, [str(argument) for argument in arguments], env={"COLUMNS": "200"})


def job(folder: Path, text: str) -> Path:
    """Write a job into a folder."""
    file = folder / "job.toml"
    file.write_text(text, encoding="utf-8")
    return file
