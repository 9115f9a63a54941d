"""A release build, one processor, and the race itself."""

import os
from collections.abc import Callable, Iterator
from importlib import metadata

import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from . import casadi_peer, ours, pinocchio_peer
from .chains import CHAINS, F64, Chain
from .contender import Contender, assert_agree

LIBRARIES: dict[str, Callable[[Chain, str], Contender]] = {
    "redundancy": ours.contender,
    "pinocchio": pinocchio_peer.contender,
    "CasADi C": casadi_peer.contender,
}


@pytest.fixture(scope="session", autouse=True)
def guard() -> None:
    """Refuse to time a debug build."""
    if rd.build_profile != "release":
        pytest.exit(f"benches need a release build, this one is {rd.build_profile!r}: make bench", returncode=4)


@pytest.fixture(autouse=True)
def one_cpu() -> Iterator[set[int]]:
    """Keep to one processor for the length of a test; what there was is the fixture's value."""
    if not hasattr(os, "sched_setaffinity"):
        yield set(range(os.cpu_count() or 1))
        return
    every = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(every)})
    yield every
    os.sched_setaffinity(0, every)


@pytest.fixture
def every_cpu(one_cpu: set[int]) -> int:
    """Undo `one_cpu`; the value is the number of processors."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, one_cpu)
    return len(one_cpu)


@pytest.fixture(scope="session", params=CHAINS)
def chain(request: pytest.FixtureRequest) -> Chain:
    return CHAINS[str(request.param)]


@pytest.fixture(scope="session")
def postures(chain: Chain) -> list[F64]:
    return chain.postures()


def label(benchmark: BenchmarkFixture, robot: str, quantity: str, library: str) -> None:
    """Put contenders for the same thing side by side."""
    benchmark.group = f"{robot} {quantity}"
    benchmark.extra_info.update(robot=robot, quantity=quantity, library=library)


@pytest.fixture
def race(benchmark: BenchmarkFixture, chain: Chain, postures: list[F64]) -> Callable[[str, str], None]:
    """Check a library's results against ours, then time its sweep through the postures."""

    def run(quantity: str, library: str) -> None:
        reference, contender = ours.contender(chain, quantity), LIBRARIES[library](chain, quantity)
        for q in postures:
            assert_agree(reference.value(q), contender.value(q))
        label(benchmark, chain.name, quantity, library)
        benchmark(contender.sweep, postures)

    return run


def pytest_benchmark_update_machine_info(config: pytest.Config, machine_info: dict[str, object]) -> None:
    """Say which versions raced, and how busy the machine was."""
    installed = {d.metadata["Name"]: d.version for d in metadata.distributions()}
    packages = {name: installed[name] for name in ("pin", "casadi", "numpy") if name in installed}
    machine_info["packages"] = packages | {"redundancy": rd.__version__}
    machine_info["load"] = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
