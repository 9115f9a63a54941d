"""The commands plan and map: what they print against the library, what they leave behind, and their errors."""

import json
import re
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from redundancy.cli import commands as cli
from redundancy.cli import read_job

from tests.cli.jobs import JOB, job, run
from tests.reference.files import EXAMPLES

SHORT = (
    JOB.replace("weights = { condition_number_squared = 1.0 }\n", "")
    .replace("axis = [0, 0, 1]\n", "")
    .replace("points = 21", "points = 15")
)
"""The job with 15 points, and what a job need not say left out."""
PLAN = SHORT + "[plan]\n"


def line(folder: Path, stop: float, points: int = 20, **path: float) -> Path:
    """Return the job of a straight line away from an arm, 0.9 m from its base to `stop`."""
    share = np.linspace(0.0, 1.0, points)
    position = np.stack([0.9 + (stop - 0.9) * share, 0.0 * share, 0.0 * share + 0.8], axis=1)
    time = share * path["duration"] if path else None
    rd.Toolpath(position, np.tile([0.0, 0.0, -1.0], (points, 1)), time=time).write(folder / "path.csv")
    return job(folder, 'robot = "abb_irb2400"\n[objective]\nlength = 0.4\n[path]\nfile = "path.csv"\n')


def numbers(file: Path) -> tuple[dict[str, list[float]], list[str]]:
    header, *rows = [row.split(",") for row in file.read_text(encoding="utf-8").splitlines()]
    columns = {name: [float(row[i]) for row in rows] for i, name in enumerate(header[:-1])}
    return columns, [row[-1] for row in rows]


@pytest.mark.parametrize("criterion", ["minimax", "integral", "motion"])
def test_plan(tmp_path: Path, criterion: str) -> None:
    out, file = tmp_path / "out", job(tmp_path, SHORT)
    result = run("plan", file, "--out", out, "--no-pictures", "--criterion", criterion)
    assert result.exit_code == 0, result.output
    assert sorted(entry.name for entry in out.iterdir()) == ["trajectory.csv", "trajectory.json", "trajectory.pathx"]
    asked = read_job(file)
    best = rd.plan(asked.robot, asked.path, asked.task, asked.objective, criterion)
    columns, status = numbers(out / "trajectory.csv")
    np.testing.assert_allclose(columns["condition_number"], best.condition_number, atol=1e-9)
    assert status == best.status
    assert "15 of 15" in result.output
    assert f"{best.motion:.5f} rad^2" in result.output
    assert f"{best.max_condition_number:.5f}" in result.output
    if criterion == "minimax":
        assert f"{best.bound:.5f}" in result.output
        assert f"{best.value.max():.5f}" in result.output
    assert ("lower bound" in result.output) == (criterion != "motion")


def test_json_equals_csv(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run("plan", job(tmp_path, SHORT), "--out", out, "--no-pictures").exit_code == 0
    columns, status = numbers(out / "trajectory.csv")
    content = json.loads((out / "trajectory.json").read_text(encoding="utf-8"))
    del columns["point"]
    assert content["columns"] == columns
    assert content["status"] == status


def test_plan_draws(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    out = tmp_path / "out"
    result = run("plan", job(tmp_path, SHORT), "--out", out)
    assert result.exit_code == 0, result.output
    names = {entry.name for entry in out.iterdir()}
    pictures = {f"{name}.{end}" for name in ("condition", "joints", "spin", "map") for end in ("png", "svg")}
    assert names == pictures | {f"trajectory.{end}" for end in ("csv", "json", "pathx")}
    drawn = (out / "map.svg").read_text(encoding="utf-8")
    assert "chosen spin" in drawn
    assert "condition number squared" in drawn
    assert "indices" not in drawn


@pytest.mark.parametrize(("angles", "places"), [("n_angles", "n_spare"), ("angles", "spare_values")])
def test_settings_reach_the_planner(tmp_path: Path, angles: str, places: str) -> None:
    text = f"""criterion = "integral"
smoothness = 0.5
{angles} = 30
layers = 7
effort = 2
spin_range_deg = [-200, 100]
spare = [3]
{places} = 5
closed = true
limits = false
branch_changes = true
branches = [0, 2]
max_spin_step_deg = 45
max_step = 0.25
max_iterations = 90
bound = false
warm_start = "before.json"
"""
    table = read_job(job(tmp_path, PLAN.replace("fanuc_m710ic50_milling", "panda") + text)).plan
    settings = table.settings
    assert (settings.criterion, settings.smoothness, settings.n_angles, settings.layers) == ("integral", 0.5, 30, 7)
    assert settings.effort == 2
    assert settings.spin_range == pytest.approx((np.deg2rad(-200.0), np.deg2rad(100.0)), abs=1e-15)
    # Joints are counted from 1 in files.
    assert (settings.spare, settings.n_spare) == ((2,), 5)
    assert (settings.closed, settings.limits, settings.branch_changes) == (True, False, True)
    assert (settings.branches, settings.max_step, settings.max_iterations) == ((0, 2), 0.25, 90)
    assert settings.max_spin_step == pytest.approx(np.pi / 4.0)
    assert settings.bound is False
    assert table.warm_start == tmp_path / "before.json"


def test_an_old_name_beside_the_new_one_is_refused(tmp_path: Path) -> None:
    result = run("plan", job(tmp_path, PLAN + "angles = 30\nn_angles = 40"), "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "plan.angles: got 30, expected n_angles alone" in result.stderr


def test_a_whole_turn_is_one(tmp_path: Path) -> None:
    result = run(
        *("plan", job(tmp_path, PLAN + "spin_range_deg = [-190.1, 169.9]"), "--out", tmp_path / "out", "--no-pictures"),
    )
    assert result.exit_code == 0, result.output


def test_plan_of_a_robot_with_a_spare_joint(tmp_path: Path) -> None:
    rd.Toolpath([[0.5, -0.1, 0.3], [0.5, 0.0, 0.3], [0.5, 0.1, 0.3]], [[0.0, 0.0, -1.0]] * 3).write(
        tmp_path / "path.csv"
    )
    settings = "[plan]\nspare = [3]\nspare_values = 6\nangles = 12\n"
    file = job(tmp_path, f'robot = "panda"\n[objective]\nlength = 0.4\n[path]\nfile = "path.csv"\n{settings}')
    result = run("plan", file, "--out", tmp_path / "out", "--no-pictures")
    assert result.exit_code == 0, result.output
    assert "3 of 3" in result.output
    result = run("map", file, "--out", tmp_path / "out", "--angles", 12)
    assert result.exit_code == 0, result.output
    with np.load(tmp_path / "out" / "map.npz") as arrays:
        assert arrays["spare"].tolist() == [3]
        assert arrays["value"].shape[:3] == (3, 6, 12)
    assert re.search(r"spare joints .* 3 .* 6 places", result.output)


@pytest.mark.parametrize("command", ["plan", "map", "solve"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('criterion = "minmax"', r'plan\.criterion: got \'minmax\', expected "minimax" or "integral" or "motion"'),
        ("criterium = 1", r"plan\.criterium: unknown key; did you mean criterion"),
        ("smoothness = -1", r"plan\.smoothness: got -1, expected a number of at least 0"),
        ("smoothness = nan", r"plan\.smoothness: got nan, expected a finite number"),
        ("angles = 0", r"plan\.angles: got 0, expected an integer of at least 1"),
        ("effort = 0", r"plan\.effort: got 0, expected an integer"),
        ("layers = 1.5", r"plan\.layers: got 1\.5, expected an integer"),
        ("spare_values = true", r"plan\.spare_values: got True, expected an integer"),
        ("spin_range_deg = [10, -10]", r"plan\.spin_range_deg: got \[10, -10\], expected two increasing angles"),
        ("spin_range_deg = [0, 361]", r"plan\.spin_range_deg: .* at most 360 deg apart"),
        ("spin_range_deg = 90", r"plan\.spin_range_deg: got 90, expected 2 finite numbers"),
        ("spare = [1]", r"plan\.spare: got \[1\], expected joints of RRRRRR, counted from 1"),
        ("spare = [0]", r"plan\.spare: got \[0\]"),
        ("spare = 7", r"plan\.spare: got 7"),
        ('spare = ["x"]', r"plan\.spare"),
        ("closed = 1", r"plan\.closed: got 1, expected true or false"),
        ('limits = "no"', r"plan\.limits: got 'no', expected true or false"),
        ("branch_changes = 0", r"plan\.branch_changes: got 0, expected true or false"),
        ('warm_start = "before.pathx"', r"plan\.warm_start: got 'before\.pathx', expected a \.csv or \.json file"),
        ("warm_start = 3", r"plan\.warm_start: got 3, expected a string"),
    ],
    ids=lambda value: value if "=" in value else "",
)
def test_bad_settings_name_file_and_key(tmp_path: Path, command: str, text: str, message: str) -> None:
    file, out = job(tmp_path, PLAN + text), tmp_path / "out"
    result = run(command, file, "--out", out)
    assert result.exit_code == 2
    assert result.stdout == ""
    assert re.fullmatch(rf"error: {re.escape(str(file))}: {message}.*\n", result.stderr)
    assert not out.exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[path.helix]", "[plan]\nclosed = true\n[path.helix]", "the last point of the path is not the first"),
    ],
)
def test_what_cannot_be_planned_names_the_file(tmp_path: Path, old: str, new: str, message: str) -> None:
    file = job(tmp_path, SHORT.replace(old, new))
    result = run("plan", file, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert re.fullmatch(rf"error: {re.escape(str(file))}: .*{message}.*\n", result.stderr)
    assert not (tmp_path / "out").exists()


def test_unreachable_stretch_names_point_and_cause(tmp_path: Path) -> None:
    # Enough points for joints that move fast where the arm is nearly stretched.
    file, out = line(tmp_path, 2.9, points=100), tmp_path / "out"
    asked = read_job(file)
    open_points = rd.redundancy_map(asked.robot, asked.path, n_angles=8).feasible.any(axis=(1, 2))
    first = int(np.argmin(open_points))
    assert 0 < first < len(asked.path)
    result = run("plan", file, "--out", out)
    assert result.exit_code == 1
    assert f"{first} of 100" in result.stdout
    assert "bound" not in result.stdout
    assert f"the whole path; point {first}: " in result.stderr
    assert re.fullmatch(
        r"error: .*: (unreachable|joint limit of joint 3, .* [\d.]+ deg beyond it); .*\n", result.stderr
    )
    assert not out.exists()


def test_a_way_through_a_singularity_is_told(tmp_path: Path) -> None:
    pose = rd.robots.get("abb_irb2400").fk([0.0, 0.3, 0.2, 0.0, 0.0, 0.0])
    position = pose[:3, 3] + np.outer(np.linspace(-0.25, 0.25, 51), [0.0, 1.0, 0.0])
    rd.Toolpath(position, np.tile(pose[:3, 2], (51, 1))).write(tmp_path / "path.csv")
    words = (
        'robot = "abb_irb2400"\n[objective]\nlength = 0.4\n[path]\nfile = "path.csv"\n[plan]\nbranch_changes = true\n'
    )
    result = run("plan", job(tmp_path, words), "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    printed = " ".join(result.stdout.split())
    assert "passes through a singularity at point 25, where the value is infinite" in printed
    assert "does not depend on the spin of the tool" in printed
    assert re.search(r"worst condition number squared . inf", printed)
    assert re.search(r"largest step . 0\.\d+ deg of joint \d", printed)
    saved = json.loads((tmp_path / "out" / "trajectory.json").read_text(encoding="utf-8"))
    assert 0.0 < saved["largest_step"] < 0.02
    assert saved["columns"]["condition_number"][25] is None


def test_no_point_at_all(tmp_path: Path) -> None:
    file = job(tmp_path, SHORT.replace("[1300, 1000, 0]", "[9300, 1000, 0]"))
    result = run("plan", file, "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "0 of 15" in result.stdout
    assert "point 0: unreachable; the whole path is at least 9.11 m away, and the robot reaches" in result.stderr
    result = run("map", file, "--out", tmp_path / "out", "--angles", 12)
    assert result.exit_code == 0, result.output
    assert "0 of 15" in result.stdout
    assert re.search(r"unreachable .* 100\.00 % .* 100\.00 %", result.stdout)


def test_too_fast_a_path_names_joint_and_speed(tmp_path: Path) -> None:
    result = run("plan", line(tmp_path, 1.1, duration=0.05), "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert re.search(r"point \d+: speed limit of joint \d, [\d.]+ times it would be needed", result.stderr)
    assert "of its limit" in result.stdout


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_warm_start(tmp_path: Path, ending: str) -> None:
    assert run("plan", job(tmp_path, SHORT), "--out", tmp_path / "out", "--no-pictures").exit_code == 0
    before = (tmp_path / "out" / f"trajectory.{ending}").rename(tmp_path / f"before.{ending}")
    asked = read_job(job(tmp_path, PLAN + f'warm_start = "before.{ending}"\n'))
    earlier = rd.Trajectory.read(before, asked.robot)
    copy = tmp_path / f"copy.{ending}"
    earlier.write(copy)
    if ending == "csv":
        assert copy.read_bytes() == before.read_bytes()
    else:
        assert json.loads(copy.read_text())["columns"] == json.loads(before.read_text())["columns"]
    result = run("plan", asked.file, "--out", tmp_path / "again", "--no-pictures")
    assert result.exit_code == 0, result.output
    columns, _ = numbers(tmp_path / "again" / "trajectory.csv")
    q = np.stack([columns[f"q{i}_rad"] for i in range(1, 7)], axis=1)
    np.testing.assert_allclose(q, earlier.q, atol=1e-4)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        ("before.csv", "q6_rad", "q7_rad", "expected q1_rad"),
        ("before.csv", "x_m", "x", "'x_m' is missing"),
        ("before.csv", "\n0,", "\nzero,", r"before\.csv:2: .*zero"),
        ("before.csv", "\n0,", "\n0,0.0,", r"before\.csv:2: 20 fields, expected 19"),
        ("before.csv", "point,", "number,", r"before\.csv:1: no trajectory"),
        ("before.json", '"columns"', '"rows"', "no trajectory"),
        ("before.json", '"q6_rad"', '"q6"', "expected q1_rad"),
        ("before.json", '"q6_rad": [', '"q6_rad": [1.0, ', "equally many"),
        ("before.json", '"q6_rad": [', '"q6_rad": [null, ', "equally many"),
        ("before.json", '"converged"', "converged", r"before\.json:\d+:\d+: "),
    ],
)
def test_bad_warm_start_names_the_file(tmp_path: Path, name: str, old: str, new: str, message: str) -> None:
    assert run("plan", job(tmp_path, SHORT), "--out", tmp_path / "out", "--no-pictures").exit_code == 0
    text = (tmp_path / "out" / name.replace("before", "trajectory")).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / name).write_text(text.replace(old, new, 1), encoding="utf-8")
    result = run("plan", job(tmp_path, PLAN + f'warm_start = "{name}"\n'), "--out", tmp_path / "new")
    assert result.exit_code == 2
    assert re.fullmatch(r"error: .*before.*\n", result.stderr)
    assert re.search(message, result.stderr)
    assert not (tmp_path / "new").exists()


def test_missing_warm_start(tmp_path: Path) -> None:
    result = run("plan", job(tmp_path, PLAN + 'warm_start = "none.csv"\n'), "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert re.fullmatch(r"error: .*none\.csv: No such file or directory\n", result.stderr)


def test_map(tmp_path: Path) -> None:
    out, file = tmp_path / "out", job(tmp_path, SHORT)
    result = run("map", file, "--out", out, "--angles", 24)
    assert result.exit_code == 0, result.output
    asked = read_job(file)
    chart = rd.redundancy_map(asked.robot, asked.path, asked.task, asked.objective, 24)
    with np.load(out / "map.npz") as arrays:
        np.testing.assert_array_equal(arrays["value"], chart.value)
        np.testing.assert_array_equal(arrays["cause"], chart.cause)
        np.testing.assert_array_equal(arrays["angles"], chart.angles)
        assert arrays["causes"].tolist() == list(chart.CAUSES)
    best = np.nanmin(chart.best, axis=1)
    assert f"{best.min():.5f}" in result.output
    assert f"{best.max():.5f}" in result.output
    assert f"point {best.argmax()}, spin" in result.output
    share = 100.0 * chart.feasible.any(axis=2).mean()
    assert re.search(rf"feasible .* {share:.2f} % .* {100.0 * chart.feasible.mean():.2f} %", result.output)
    assert not (out / "map.html").exists()
    if find_spec("matplotlib") is not None:
        assert (out / "map.png").stat().st_size > 5000
        assert (out / "map.svg").stat().st_size > 5000


def test_map_page(tmp_path: Path) -> None:
    pytest.importorskip("plotly")
    out = tmp_path / "out"
    result = run("map", job(tmp_path, SHORT), "--out", out, "--angles", 12, "--html")
    assert result.exit_code == 0, result.output
    page = (out / "map.html").read_text(encoding="utf-8")
    assert "condition number squared" in page
    assert "<title>fanuc_m710ic50_milling</title>" in page


def test_map_page_without_plotly_tells_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "find_spec", lambda name: None)
    result = run("map", job(tmp_path, SHORT), "--out", tmp_path / "out", "--html")
    assert result.exit_code == 2
    assert result.stderr == "error: no page without plotly: pip install redundancy[html]\n"
    assert not (tmp_path / "out").exists()


def test_map_without_matplotlib(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "find_spec", lambda name: None)
    result = run("map", job(tmp_path, SHORT), "--out", tmp_path / "out", "--angles", 12)
    assert result.exit_code == 0
    assert "pip install redundancy[plot]" in result.stderr
    assert [entry.name for entry in (tmp_path / "out").iterdir()] == ["map.npz"]


def test_map_of_a_task_without_free_spin_has_no_picture(tmp_path: Path) -> None:
    rotation = np.tile(np.diag([1.0, -1.0, -1.0]), (2, 1, 1))
    path = rd.Toolpath([[0.9, 0.0, 0.8], [0.9, 0.1, 0.8]], [[0.0, 0.0, -1.0]] * 2, rotation)
    path.write(tmp_path / "path.csv")
    file = job(tmp_path, 'robot = "abb_irb2400"\n[task]\nkind = "full"\n[path]\nfile = "path.csv"\n')
    result = run("map", file, "--out", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert "neither a spin nor one joint alone free" in result.stderr
    assert [entry.name for entry in (tmp_path / "out").iterdir()] == ["map.npz"]
    result = run("plan", file, "--out", tmp_path / "plan", "--no-pictures")
    assert result.exit_code == 0, result.output


@pytest.mark.parametrize(
    "arguments",
    [("plan",), ("plan", "/no/such/job.toml"), ("map", "."), ("map", "x.toml", "--angles", "0")],
    ids=" ".join,
)
def test_wrong_arguments_are_one_line(arguments: tuple[str, ...]) -> None:
    result = run(*arguments)
    assert result.exit_code == 2
    assert re.fullmatch(r"error: .+\n", result.stderr)
    assert result.stdout == ""


def test_unknown_criterion(tmp_path: Path) -> None:
    result = run("plan", job(tmp_path, SHORT), "--criterion", "maximin")
    assert result.exit_code == 2
    assert "minimax" in result.stderr


def test_example(tmp_path: Path) -> None:
    share = np.linspace(0.0, 1.0, 50)
    position = np.stack([0.85 + 0.05 * np.sin(6.0 * share), -0.4 + 0.8 * share, np.full(50, 0.8)], axis=1)
    path = rd.Toolpath.read(EXAMPLES / "line_and_wave.csv")
    np.testing.assert_allclose(path.position, position, atol=1e-15)
    result = run("plan", EXAMPLES / "line_and_wave.toml", "--out", tmp_path / "out", "--no-pictures")
    assert result.exit_code == 0, result.output
    assert "50 of 50" in result.output
    assert re.search(r"motion .* 1\.09118 rad\^2", result.output)


def figures(row: str) -> list[float]:
    """Return the numbers of a row of a table."""
    return [float(word) for word in re.findall(r"\d+\.\d+", row)]


@pytest.mark.parametrize("command", ["plan", "map"])
def test_page_shows_what_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: str) -> None:
    page = (EXAMPLES.parent / "docs" / "command_line.md").read_text(encoding="utf-8")
    shown = re.search(rf"`redundancy {command} examples/helix_milling.toml.*?```text\n(.*?)```", page, re.DOTALL)
    assert shown is not None
    monkeypatch.setattr(cli, "_can_draw", lambda: False)
    result = run(command, EXAMPLES / "helix_milling.toml", "--out", tmp_path / "out")
    printed = [row.rstrip() for row in result.stdout.splitlines()]
    # Rounding is another from machine to machine.
    rows = [row for row in shown[1].splitlines() if not re.search("gap|error", row)]
    assert len(rows) > 10
    # The mean is what the worst value leaves over: a plan for that has it to the refinement's tolerance.
    means = [row for row in rows if "mean" in row]
    for row in set(rows) - set(means):
        assert row in printed
    for row, now in zip(means, [row for row in printed if "mean" in row], strict=True):
        assert figures(now) == pytest.approx(figures(row), rel=1e-5)
