"""The command line: what it prints against the library, what it leaves behind, and one line for every error."""

import dataclasses
import json
import re
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

from tests.cli.jobs import JOB, job, run
from tests.reference.files import read_json


def test_solve(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = run("solve", job(tmp_path, JOB), "--out", out, "--no-pictures")
    assert result.exit_code == 0, result.output
    assert sorted(entry.name for entry in out.iterdir()) == ["trajectory.csv", "trajectory.json", "trajectory.pathx"]
    content = json.loads((out / "trajectory.json").read_text(encoding="utf-8"))
    reference = read_json("leger_fanuc.json")
    # Every fifth of the 101 points.
    wanted = reference["helix"]["pointwise_minimum_kappa"][::5]
    np.testing.assert_allclose(content["columns"]["condition_number"], wanted, atol=1e-6)
    assert f"{max(wanted):.5f}" in result.output
    assert "21 of 21" in result.output


@pytest.mark.parametrize("command", ["solve", "plan"])
def test_output_of_the_flange(tmp_path: Path, command: str) -> None:
    for frame in ("tool", "flange"):
        asked = job(tmp_path, JOB + f'[output]\nframe = "{frame}"\n')
        result = run(command, asked, "--out", tmp_path / frame, "--no-pictures")
        assert result.exit_code == 0, result.output
    robot = rd.robots.get("fanuc_m710ic50_milling")
    for frame, model in (("tool", robot), ("flange", robot.with_tool(np.eye(4)))):
        written = rd.Trajectory.read(tmp_path / frame / "trajectory.json")
        dataclasses.replace(written, robot=model).write(tmp_path / "expected.pathx")
        expected = (tmp_path / "expected.pathx").read_text(encoding="utf-8")
        assert (tmp_path / frame / "trajectory.pathx").read_text(encoding="utf-8") == expected


def test_solve_draws(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    result = run("solve", job(tmp_path, JOB), "--out", out)
    assert result.exit_code == 0, result.output
    names = {entry.name for entry in out.iterdir()}
    assert {f"{name}.{ending}" for name in ("condition", "joints", "spin") for ending in ("png", "svg")} <= names
    for name in names:
        assert (out / name).stat().st_size > 500


def test_solve_with_a_path_of_its_own(tmp_path: Path) -> None:
    rd.Toolpath.helix(0.25, 0.159, 0.0, 1.0, np.pi, (1.3, 1.0, 0.0), 7).write(tmp_path / "path.csv")
    text = JOB[: JOB.index("[path.helix]")] + '[path]\nfile = "path.csv"\n'
    result = run("solve", job(tmp_path, text), "--out", tmp_path / "out", "--no-pictures")
    assert result.exit_code == 0, result.output
    assert "7 of 7" in result.output


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"fanuc_m710ic50_milling"', '"fanuc_m710ic50_miling"', "did you mean 'fanuc_m710ic50_milling'"),
        ('"fanuc_m710ic50_milling"', '"none.toml"', "none.toml"),
        ('"fanuc_m710ic50_milling"', "3", "robot"),
        ("[objective]", "[objective", r"job.toml:\d+:\d+: "),
        ("[objective]", '[output]\nframe = "base"\n[objective]', 'output.frame: .*"tool" or "flange"'),
        ("[objective]", '[output]\nfrom = "tool"\n[objective]', r"output\.from: unknown key; did you mean frame"),
        ("485.5933", "-1.0", "length"),
        ("485.5933", "nan", "length_mm"),
        ("485.5933", '"x"', "length_mm"),
        ("condition_number_squared", "condition_numbr", "did you mean condition_number"),
        ("squared = 1.0", "squared = inf", "condition_number_squared"),
        ("[0, 0, 1]", "[0, 0, 0]", "axis"),
        ("[0, 0, 1]", "[0, 0]", "axis"),
        ('"axisymmetric"', '"spinning"', "kind"),
        ('"axisymmetric"', '"full"', "."),
        ("radius_mm = 250", "radius_mm = 0", "radius"),
        ("radius_mm = 250", "", "radius"),
        ("points = 21", "points = 1", "points"),
        ("points = 21", "point = 21", "did you mean points"),
        ("duration_s = 10", "duration_s = -1", "duration"),
        ("center_mm = [1300, 1000, 0]", "center_mm = [9300, 1000, 0]", "cannot reach 21 of 21"),
        ("[path.helix]", "[paths.helix]", "did you mean path"),
    ],
)
def test_error_is_one_line_and_leaves_nothing(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in JOB
    out = tmp_path / "out"
    result = run("solve", job(tmp_path, JOB.replace(old, new)), "--out", out, "--no-pictures")
    assert result.exit_code == 2
    assert not out.exists()
    assert result.stdout == ""
    assert re.fullmatch(r"error: .*\n", result.stderr)
    assert re.search(message, result.stderr)


def test_errors_on_the_way_leave_the_old_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "trajectory.csv").write_text("before", encoding="utf-8")

    def fail(*_: object) -> str:
        raise OSError(28, "No space left on device", "trajectory.json")

    monkeypatch.setitem(__import__("redundancy.files.trajectories", fromlist=["FORMATS"]).FORMATS, ".json", fail)
    result = run("solve", job(tmp_path, JOB), "--out", out, "--no-pictures")
    assert result.exit_code == 2
    assert "No space left" in result.stderr
    assert [entry.name for entry in out.iterdir()] == ["trajectory.csv"]
    assert (out / "trajectory.csv").read_text(encoding="utf-8") == "before"


@pytest.mark.parametrize(
    "arguments",
    [
        ("solve",),
        ("solve", "/no/such/job.toml"),
        ("solve", "."),
        ("nothing",),
        ("length", "pandda"),
        ("length", "panda", "--starts", "0"),
        ("posture", "panda", "--q", "1,2"),
        ("posture", "panda", "--q", "1,2,3,4,5,6,x"),
        ("posture", "panda", "--q", "1,2,3,4,5,6,nan"),
        ("posture", "panda", "--length", "-3"),
        ("posture", "none.urdf"),
        ("robots", "--what"),
    ],
    ids=" ".join,
)
def test_wrong_arguments_are_one_line(arguments: tuple[str, ...]) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert re.fullmatch(r"error: .+\n", result.stderr)
    assert result.stdout == ""


def test_robots_lists_them_all() -> None:
    result = run("robots")
    assert result.exit_code == 0
    for name in rd.robots.names():
        assert name in result.output


def test_length_is_that_of_the_thesis() -> None:
    result = run("length", "fanuc_m710ic50_milling")
    assert result.exit_code == 0
    assert "485.152206 mm" in result.output
    assert "1.041201692" in result.output


def test_posture_is_that_of_the_library() -> None:
    degrees = [29.9052, 23.2777, 0.9907, -56.6009, -83.3305, 102.7566]
    result = run("posture", "fanuc_m710ic50_milling", "--q", ",".join(map(str, degrees)), "--length", "485.5933")
    assert result.exit_code == 0
    robot = rd.robots.get("fanuc_m710ic50_milling")
    sigma = np.linalg.svd(
        np.repeat([0.4855933, 1.0], 3)[:, None] * robot.jacobian(np.deg2rad(degrees)), compute_uv=False
    )
    kappa = np.sqrt(np.sum(sigma**2) * np.sum(sigma**-2.0)) / 6
    assert f"{kappa:.9g}" in result.output
    assert f"{sigma[0] / sigma[-1]:.9g}" in result.output
    # (4.36): the first point of the helix.
    assert "1050.000, 1000.00" in result.output


@pytest.mark.parametrize("name", rd.robots.names())
def test_posture_of_every_robot(name: str) -> None:
    result = run("posture", name)
    assert result.exit_code == 0, result.output


def test_info() -> None:
    result = run("info")
    assert result.exit_code == 0
    assert rd.__version__ in result.output
    assert rd.build_profile in result.output
    assert run("--version").output.strip().endswith(rd.__version__)
    assert run("--help").exit_code == 0
