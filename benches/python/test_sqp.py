"""Orthogonal SQP: one control tick, and the milling helix of Leger (2014)."""

import numpy as np
import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from .chains import F64, Chain
from .conftest import label
from .contender import PER_POSTURE

TWIST = np.array([0.1, -0.05, 0.02, 0.05, 0.1, -0.1])
LENGTH = 0.4855933
MAX_KAPPA = 2.54226
"""Largest of the pointwise minima along the helix."""


@pytest.mark.benchmark(**PER_POSTURE)
def test_step(benchmark: BenchmarkFixture, chain: Chain, postures: list[F64]) -> None:
    robot = chain.robot()
    step = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(squared=True))
    rates = np.empty(robot.n)

    def sweep() -> None:
        for q in postures:
            step.step(q, TWIST, out=rates)

    regular = 0
    for q in postures:
        step.step(q, TWIST, out=rates)
        if step.status == "regular":
            regular += 1
            left_over = robot.jacobian(q) @ rates - TWIST
            left_over[:3] = np.cross(robot.fk(q)[:3, 2], left_over[:3])
            assert np.abs(left_over).max() < 1e-10
    label(benchmark, chain.name, "step", "redundancy")
    benchmark.extra_info["regular"] = f"{regular} of {len(postures)}"
    benchmark(sweep)


def helix() -> rd.Toolpath:
    phi = np.linspace(0.0, np.pi / 2, 101)
    cos, sin = np.cos(np.pi - phi), np.sin(np.pi - phi)
    position = np.stack([0.25 * cos + 1.3, 0.5 / np.pi * phi + 1.0, 0.25 * sin], axis=1)
    return rd.Toolpath(position, -np.stack([cos, 0.0 * phi, sin], axis=1))


def milling() -> rd.OrthogonalSQP:
    half = np.sqrt(0.75)
    tool = np.array([[-0.5, 0.0, half, 0.0], [0.0, 1.0, 0.0, 0.0], [-half, 0.0, -0.5, 0.0], [0.0, 0.0, 0.0, 1.0]])
    robot = rd.Robot.from_dh(
        a=[0.15, 0.87, 0.17, 0.0, 0.0, -0.287692],
        d=[0.0, 0.0, 0.0, -1.016, 0.0, -0.607777],
        alpha=np.radians([-90.0, 180.0, -90.0, 90.0, -90.0, 180.0]),
        theta=np.radians([0.0, -90.0, 0.0, 0.0, 0.0, 0.0]),
        tool=tool,
        q_min=np.radians([-180.0, -60.0, -131.8, -360.0, -125.0, -360.0]),
        q_max=np.radians([180.0, 75.0, 230.0, 360.0, 125.0, 360.0]),
    )
    return rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(LENGTH, squared=True))


def test_helix_chunk(benchmark: BenchmarkFixture) -> None:
    """The kernel alone, from the best posture at the first point."""
    step, path = milling(), helix()
    targets = path.targets(step.task)
    q0 = step.solve(targets[0])[0]
    label(benchmark, "FANUC", "helix_follow_chunk", "redundancy")
    _, value, position_error, axis_error, statuses, iterations = benchmark(step.follow_chunk, targets, q0)
    benchmark.extra_info["iterations"] = iterations
    assert set(statuses) == {"converged"}
    assert np.sqrt(value.max()) <= MAX_KAPPA
    assert max(position_error.max(), axis_error.max()) < 1e-9


@pytest.mark.parametrize("start", ["given", "sought"])
def test_helix_follow(benchmark: BenchmarkFixture, start: str) -> None:
    """What a user calls, with and without the search for the best posture at the first point."""
    step, path = milling(), helix()
    q0 = step.solve(path.targets(step.task)[0])[0] if start == "given" else None
    label(benchmark, "FANUC", f"helix_follow_{start}", "redundancy")
    trajectory = benchmark(rd.follow, step, path, q0)
    assert trajectory.condition_number.max() <= MAX_KAPPA
