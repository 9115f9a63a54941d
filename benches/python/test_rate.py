"""One control tick of twist decomposition and of every rival: spin free, an objective of singularity and limits."""

import numpy as np
import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from .chains import F64, Chain
from .conftest import label
from .contender import PER_POSTURE

TWIST = np.array([0.1, -0.05, 0.02, 0.05, 0.1, -0.1])
METHODS = (
    rd.TwistDecomposition,
    rd.VirtualJoint,
    rd.GradientProjection,
    rd.Householder,
    rd.Elimination,
    rd.WeightedInverse,
    rd.TaskPriority,
    rd.ResolvedRate,
)


@pytest.mark.benchmark(**PER_POSTURE)
@pytest.mark.parametrize("method", METHODS, ids=lambda method: method.__name__)
def test_tick(
    benchmark: BenchmarkFixture, chain: Chain, postures: list[F64], method: type[rd.TwistDecomposition]
) -> None:
    robot = chain.robot()
    objective = rd.ConditionNumber(0.48, squared=True) + 0.1 * rd.JointLimits()
    step = method(robot, rd.Task.axisymmetric(), objective)
    rates = np.empty(robot.n)

    def sweep() -> None:
        for q in postures:
            step.step(q, TWIST, out=rates)

    for q in postures:
        step.step(q, TWIST, out=rates)
        if step.status == "regular":
            left_over = robot.jacobian(q) @ rates - TWIST
            left_over[:3] = np.cross(robot.fk(q)[:3, 2], left_over[:3])
            assert np.abs(left_over).max() < 1e-9
    label(benchmark, chain.name, f"tick {method.__name__}", "redundancy")
    benchmark(sweep)
