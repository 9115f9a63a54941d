"""Condition number and gradient of many postures in one call."""

import numpy as np
import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from .casadi_peer import Call, compiled
from .chains import Chain
from .conftest import label
from .contender import assert_agree, per

COUNT = 1_000_000
PEER_COUNT = 10_000
BATCH = {"timer": per(COUNT), "min_rounds": 7, "min_time": 0.1 / COUNT, "max_time": 3.0 / COUNT}
PEER_BATCH = {"timer": per(PEER_COUNT), "min_rounds": 7, "min_time": 2e-3 / PEER_COUNT, "max_time": 1.0 / PEER_COUNT}
INDEX = rd.ConditionNumber()


def run(benchmark: BenchmarkFixture, chain: Chain, threads: int) -> None:
    robot, q = chain.robot(), chain.random(COUNT)
    label(benchmark, chain.name, "batch_kappa_gradient", f"redundancy, {threads} thread{'s'[: threads - 1]}")
    values, gradients = benchmark(INDEX.evaluate_many, robot, q, 1, threads)
    for i in range(0, COUNT, COUNT // 10):
        assert_agree(tuple(map(np.asarray, INDEX.evaluate(robot, q[i], 1))), (values[i], gradients[i]))


@pytest.mark.benchmark(**BATCH)
def test_one_thread(benchmark: BenchmarkFixture, chain: Chain) -> None:
    run(benchmark, chain, 1)


@pytest.mark.benchmark(**BATCH)
def test_two_threads(benchmark: BenchmarkFixture, chain: Chain, every_cpu: int) -> None:
    if every_cpu < 2:
        pytest.skip("one processor")
    run(benchmark, chain, 2)


@pytest.mark.benchmark(**PEER_BATCH)
def test_casadi_map(benchmark: BenchmarkFixture, chain: Chain) -> None:
    q = np.resize(np.stack(chain.postures()), (PEER_COUNT, chain.robot().n))
    values, gradients = np.zeros(PEER_COUNT), np.zeros_like(q)
    call = Call(compiled(chain, "kappa_gradient").map(PEER_COUNT, "serial"), q, [values, gradients])
    label(benchmark, chain.name, "batch_kappa_gradient", "CasADi C")
    benchmark(call.evaluate)
    expected = INDEX.evaluate_many(chain.robot(), q, 1, 1)
    assert_agree(expected, (values, gradients))
