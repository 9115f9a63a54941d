"""The command line: ``redundancy solve | plan | map | robots | length | posture | info``."""

import os
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter
from typing import Any, Final, NoReturn

import click
import numpy as np
from rich.console import Console
from rich.table import Table

from .. import robots
from .._core import (
    ConditionNumber,
    Manipulability,
    Robot,
    SingularityParameter,
    SmallestSingularValue,
    Task,
    __version__,
    build_profile,
    characteristic_length,
)
from .._util import F64, Joints, coordinates_of, kinds_of
from ..design import minimum_condition_posture
from ..errors import InvalidValueError, RedundancyError
from ..loops import follow, follow_without_spin
from ..paths import Trajectory
from .freedom import judged, mixed, rows_for
from .job import Job, read_job
from .plan_report import map_job, map_table, plan_job, plan_table, write_map, write_plan
from .plan_table import CRITERIA
from .results import results_table, write_results

_ANGLES: Final = 360
"""Spins of a map."""


class _Group(click.Group):
    """A group that ends every error of the user in one line on stderr and exit status 2."""

    def main(self, *args: Any, **options: Any) -> NoReturn:  # noqa: ANN401
        try:
            code = super().main(*args, **(options | {"standalone_mode": False}))
        except click.Abort:
            _fail("interrupted")
        except click.ClickException as error:
            _fail(error.format_message())
        except OSError as error:
            _fail(f"{error.filename}: {error.strerror}" if error.filename else str(error))
        except RedundancyError as error:
            _fail(str(error))
        sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str, status: int = 2) -> NoReturn:
    click.echo(f"error: {' '.join(message.split())}", err=True)
    sys.exit(status)


@click.group(cls=_Group, invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="redundancy")
@click.pass_context
def main(context: click.Context) -> None:
    """Resolve the redundancy of serial robots."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


_job = click.argument("job", type=click.Path(path_type=Path))
_out = click.option(
    "--out", default="out", show_default=True, type=click.Path(path_type=Path), help="Folder for the results."
)
_base = click.option("--base", metavar="LINK", help="First link of a .urdf file; its root if left out.")
_tip = click.option("--tip", metavar="LINK", help="Last link of a .urdf file; the only one at an end if left out.")
_rows = click.option(
    "--rows",
    metavar="R1,R2,...",
    help="Rows of the Jacobian that count, 0 to 2 angular, 3 to 5 linear; found if left out.",
)
_pictures = click.option(
    "--pictures/--no-pictures", default=True, show_default=True, help="Whether to draw (needs matplotlib)."
)


@main.command()
@_job
@_out
@_pictures
@_base
@_tip
def solve(job: Path, out: Path, pictures: bool, base: str | None, tip: str | None) -> None:
    """Follow the path of a JOB file; write trajectory and pictures."""
    asked = read_job(job, base, tip)
    start = perf_counter()
    solver = asked.solver()
    optimised = follow(solver, asked.path)
    middle = perf_counter()
    if solver.task != asked.task or asked.rows != asked.robot.rows_in_use():
        optimised = judged(optimised, asked.task, asked.rows)
    _check_reached(job, optimised)
    # A tool that may not spin has six components to follow.
    spins = solver.task.kind == "axisymmetric" and asked.robot.n >= Task.full().dimension
    fixed = follow_without_spin(optimised, asked.objective) if spins else None
    seconds = (middle - start, perf_counter() - middle)
    files = write_results(out, optimised, fixed, asked.frame, pictures and _can_draw(), asked.joints)
    _print(results_table(optimised, fixed, seconds))
    click.echo(f"written to {out}: {', '.join(files)}")


@main.command("plan")
@_job
@_out
@click.option("--criterion", type=click.Choice(CRITERIA), help="What is minimised, instead of what the file says.")
@_pictures
@_base
@_tip
def plan_path(job: Path, out: Path, criterion: str | None, pictures: bool, base: str | None, tip: str | None) -> None:
    """Plan a whole path at once.

    Chooses the spin of the tool, and spare joints, along the path of a JOB file; writes trajectory and pictures.

    The exit status is 1 where the path cannot be followed as a whole; nothing is written then.
    """
    asked = read_job(job, base, tip)
    earlier = asked.plan.warm_start
    warm_start = None if earlier is None else Trajectory.read(earlier, asked.robot)
    start = perf_counter()
    with _naming(asked):
        planned = plan_job(asked, criterion, warm_start)
    seconds = perf_counter() - start
    failure = planned.failure
    files = []
    if failure is None:
        pictures = pictures and _can_draw()
        # Every place of a spare joint is a map of its own.
        angles = _ANGLES if asked.robot.n == 6 else _ANGLES // 5
        chart = map_job(asked, angles) if pictures and asked.task.kind == "axisymmetric" else None
        files = write_plan(out, planned, chart, asked, pictures)
    _print(plan_table(planned, asked.objective_name, seconds))
    if failure is not None:
        _fail(
            f"{job}: {planned.robot.name} cannot follow the whole path; {failure.told(planned.robot)}; nothing written",
            1,
        )
    click.echo(f"written to {out}: {', '.join(files)}")


@main.command("map")
@_job
@_out
@click.option("--angles", default=_ANGLES, show_default=True, type=click.IntRange(1), help="Spins in a turn.")
@click.option("--html", "page", is_flag=True, help="Whether to write a page for browsers, too (needs plotly).")
@_base
@_tip
def map_path(job: Path, out: Path, angles: int, page: bool, base: str | None, tip: str | None) -> None:
    """Map what every spin of the tool is worth.

    Says at every point of the path of a JOB file what each spin is worth, or why it is not possible; writes arrays,
    pictures and a page.
    """
    if page and find_spec("plotly") is None:
        raise click.ClickException("no page without plotly: pip install redundancy[html]")
    asked = read_job(job, base, tip)
    with _naming(asked):
        chart = map_job(asked, angles)
    drawn = chart.has_angles
    if not drawn:
        click.echo("note: no pictures of a task that leaves neither a spin nor one joint alone free", err=True)
    files = write_map(out, chart, asked.objective_name, drawn and _can_draw(), drawn and page)
    _print(map_table(chart, asked.objective_name))
    click.echo(f"written to {out}: {', '.join(files)}")


@contextmanager
def _naming(job: Job) -> Iterator[None]:
    """Name the job file in what does not fit together in it."""
    try:
        yield
    except InvalidValueError as error:
        raise InvalidValueError(f"{job.file}: {error}") from error


def _can_draw() -> bool:
    if find_spec("matplotlib") is not None:
        return True
    click.echo("note: no pictures without matplotlib: pip install redundancy[plot]", err=True)
    return False


def _check_reached(job: Path, trajectory: Trajectory) -> None:
    lost = trajectory.unreachable
    if lost:
        distance, angle = 1000.0 * trajectory.position_error[lost[0]], np.rad2deg(trajectory.axis_error[lost[0]])
        raise InvalidValueError(
            f"{job}: {trajectory.robot.name} cannot reach {len(lost)} of {len(trajectory)} points; the first is point"
            f" {lost[0]}, by {distance:.3g} mm and {angle:.3g} deg; nothing written"
        )


@main.command("robots")
def list_robots() -> None:
    """List the packaged robots."""
    table = Table("name", "joints", "description")
    for name in robots.names():
        table.add_row(name, robots.get(name).joints, robots.describe(name))
    _print(table)


@main.command()
@click.argument("robot")
@click.option("--starts", default=32, show_default=True, type=click.IntRange(1), help="Starts of the minimisation.")
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0), help="Seed of the random starts.")
@_rows
@_base
@_tip
def length(robot: str, starts: int, seed: int, rows: str | None, base: str | None, tip: str | None) -> None:
    """Find the characteristic length of ROBOT (a name, or a .toml or .urdf file), and the posture it belongs to."""
    model = robots.find(robot, base=base, tip=tip)
    chosen = rows_for(model, model.fk(model.middle)[:3, 2], _parse_rows(rows))
    # Rows of one unit have nothing that a length would make comparable.
    fixed = None if mixed(chosen) else 1.0
    found = minimum_condition_posture(model, length=fixed, starts=starts, rows=chosen, seed=seed, progress=True)
    _print_pairs(
        model.name,
        {
            "characteristic length": f"{1000.0 * found.length:.6f} mm" if fixed is None else "none: rows of one unit",
            "condition number kappa_F": f"{found.condition_number:.9f}",
            **_told(model, chosen),
            "posture": _readable(model, found.q),
            "within limits": "yes" if found.within_limits else "no",
            "status": f"{found.status} after {found.iterations} iterations, best of {starts} starts",
        },
    )


@main.command()
@click.argument("robot")
@click.option("--q", "joints", metavar="Q1,Q2,...", help="Joints [deg; mm where prismatic]; the middle if left out.")
@click.option("--length", "millimetres", type=float, help="Length [mm]; that of least kappa_F if left out.")
@click.option("--controller", is_flag=True, help="Whether joints are those of the robot's controller, given and told.")
@_rows
@_base
@_tip
def posture(
    robot: str,
    joints: str | None,
    millimetres: float | None,
    rows: str | None,
    base: str | None,
    tip: str | None,
    controller: bool,
) -> None:
    """Tell what a posture of ROBOT (a name, or a .toml or .urdf file) is worth."""
    model = robots.find(robot, base=base, tip=tip)
    whose: Joints = "controller" if controller else "robot"
    q = model.middle if joints is None else _parse_joints(model, joints, whose)
    chosen = rows_for(model, model.fk(q)[:3, 2], _parse_rows(rows))
    best = characteristic_length(model, q, chosen)
    length = millimetres / 1000.0 if millimetres is not None else best if np.isfinite(best) else 1.0
    condition = ConditionNumber(length, rows=chosen)
    spectral = ConditionNumber(length, "spectral", chosen)
    position = 1000.0 * model.fk(q)[:3, 3]
    _print_pairs(
        model.name,
        {
            "posture": _readable(model, q, whose),
            "tool point": f"{position[0]:.3f}, {position[1]:.3f}, {position[2]:.3f} mm",
            **_told(model, chosen),
            "within limits": _verdict(model, q),
            "length": f"{1000.0 * length:.4f} mm",
            "length of least kappa_F here": f"{1000.0 * best:.4f} mm" if np.isfinite(best) else "none, singular",
            "condition number kappa_F": f"{condition.evaluate(model, q, 0):.9g}",
            "condition number kappa_2": f"{spectral.evaluate(model, q, 0):.9g}",
            "smallest singular value": f"{SmallestSingularValue(length, chosen).evaluate(model, q, 0):.9g} m",
            "manipulability (length 1 m)": f"{Manipulability(1.0, chosen).evaluate(model, q, 0):.9g}",
            "singularity parameter (length 1 m)": f"{SingularityParameter(1.0, chosen).evaluate(model, q, 0):.9g}",
            "status": condition.status(model, q),
        },
    )


@main.command()
def info() -> None:
    """Tell versions, build and machine."""
    _print_pairs(
        "redundancy",
        {
            "version": __version__,
            "build profile": build_profile,
            "python": f"{platform.python_implementation()} {platform.python_version()}",
            "numpy": np.__version__,
            "platform": platform.platform(),
            "cores": str(os.cpu_count()),
        },
    )


def _print_pairs(title: str, pairs: dict[str, str]) -> None:
    table = Table(title=title, title_justify="left", show_header=False)
    for label, value in pairs.items():
        table.add_row(label, value)
    _print(table)


def _print(table: Table) -> None:
    # Without markup: a robot may be called [anything].
    Console(markup=False, highlight=False).print(table)


def _readable(robot: Robot, q: F64, joints: Joints = "robot") -> str:
    """Return joint coordinates as people read them: degrees, millimetres."""
    kinds, q = kinds_of(robot, joints), coordinates_of(robot, q, joints)
    if "P" not in kinds:
        return ", ".join(f"{x:.4f}" for x in np.rad2deg(q).tolist()) + " deg"
    values = zip(kinds, q.tolist(), strict=True)
    return ", ".join(f"{1000.0 * x:.3f} mm" if kind == "P" else f"{np.rad2deg(x):.4f} deg" for kind, x in values)


def _verdict(model: Robot, q: F64) -> str:
    if model.within_limits(q):
        return "yes"
    if model.with_limits(coupled=[]).within_limits(q):
        return "no, a combination of joints is beyond"
    return f"no, {model.joint_label(int(np.argmin(np.minimum(q - model.q_min, model.q_max - q))))} is beyond"


def _told(model: Robot, rows: list[int]) -> dict[str, str]:
    """Say which rows count where these are not all that the robot moves in; name joints that have names."""
    told = {} if rows == model.rows_in_use() else {"rows": ", ".join(map(str, rows))}
    named = any(model.joint_label(i) != f"joint {i + 1}" for i in range(model.n))
    return told | ({"joints": ", ".join(model.joint_names)} if named else {})


def _parse_rows(text: str | None) -> list[int] | None:
    """Read rows as people write them: numbers, commas or blanks between."""
    try:
        return None if text is None else [int(word) for word in text.replace(",", " ").split()]
    except ValueError:
        raise click.BadParameter(f"{text!r}, expected numbers from 0 to 5", param_hint="--rows") from None


def _parse_joints(robot: Robot, text: str, joints: Joints = "robot") -> F64:
    """Read joint coordinates as people write them: degrees, millimetres, commas or blanks between."""
    try:
        numbers = np.array([float(word) for word in text.replace(",", " ").split()])
    except ValueError:
        raise click.BadParameter(f"{text!r}, expected numbers separated by commas", param_hint="--q") from None
    if len(numbers) != robot.n or not np.isfinite(numbers).all():
        raise click.BadParameter(f"{text!r}, expected {robot.n} finite numbers", param_hint="--q")
    given = np.where([kind == "P" for kind in kinds_of(robot, joints)], numbers / 1000.0, np.deg2rad(numbers))
    return given if joints == "robot" else np.asarray(robot.controller.to_robot(given))
