"""One tick with cold caches, as in a control loop that sleeps between ticks, for several trees of the package in turn.

Between ticks a block of twice the last-level cache is walked through, so that code and data have to come from memory.

    python -m benches.python.cold old=/path/to/another/checkout/python new=python

Each tree is a folder with `redundancy` in it and has a process of its own; the processes take turns, tick by tick.
"""

import statistics
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter_ns

TICKS = 60
ROWS = ("nothing", "twist decomposition", "programme")


def cache_size() -> int:
    """Bytes of the largest cache; 32 MB where the system does not tell."""
    units = {"K": 2**10, "M": 2**20}
    sizes = [file.read_text().strip() for file in Path("/sys/devices/system/cpu/cpu0/cache").glob("index*/size")]
    return max([int(size[:-1]) * units[size[-1]] for size in sizes if size[-1] in units], default=2**25)


def serve() -> None:
    """Answer every line `chain row` on standard input with the nanoseconds of one cold tick."""
    import numpy as np

    block = np.zeros(2 * cache_size() // 8)
    calls: dict[str, Iterator[Callable[[], object]]] = {}
    for line in sys.stdin:
        name = line.strip()
        if name not in calls:
            calls[name] = ticks(*name.split(" ", 1))
        call = next(calls[name])
        block[::8] += 1.0
        start = perf_counter_ns()
        call()
        print(perf_counter_ns() - start, flush=True)


def ticks(chain: str, row: str) -> Iterator[Callable[[], object]]:
    """Steps from one posture after the other."""
    import numpy as np
    import redundancy as rd

    from .chains import CHAINS

    robot, task = CHAINS[chain].robot(), rd.Task.axisymmetric()
    low, high = np.maximum(robot.q_min, -np.pi) + 1e-3, np.minimum(robot.q_max, np.pi) - 1e-3
    postures = [np.clip(q, low, high) for q in CHAINS[chain].postures()]
    twist, rates = np.array([0.1, -0.05, 0.02, 0.05, 0.1, -0.1]), np.empty(robot.n)
    condition = rd.ConditionNumber(0.48, squared=True)
    rate = rd.TwistDecomposition(robot, task, condition + 0.1 * rd.JointLimits())
    program = rd.QuadraticProgram(robot, task, condition, weight=0.1, dt=0.01, length=0.48)
    while True:
        for q in postures:
            if row == "nothing":
                yield lambda: None
            elif row == "twist decomposition":
                yield lambda q=q: rate.step(q, twist, out=rates)  # type: ignore[misc]
            else:
                yield lambda q=q: program.step(q, twist, out=rates)  # type: ignore[misc]


class Workers:
    """A process for each tree, which answers lines of a module of this folder; asked one after the other."""

    def __init__(self, trees: dict[str, str], module: str) -> None:
        root = Path(__file__).parents[2]
        path = f"import sys; sys.path[:0] = [sys.argv[1], {str(root)!r}]"
        code = f"{path}; from benches.python.{module} import serve; serve()"
        pipe = subprocess.PIPE
        self._workers = [
            subprocess.Popen([sys.executable, "-c", code, tree], stdin=pipe, stdout=pipe, text=True, bufsize=1)
            for tree in trees.values()
        ]

    def ask(self, line: str) -> list[int]:
        """Return what each tree answers to a line."""
        return [self._answer(worker, line) for worker in self._workers]

    @staticmethod
    def _answer(worker: "subprocess.Popen[str]", line: str) -> int:
        assert worker.stdin
        assert worker.stdout
        print(line, file=worker.stdin, flush=True)
        return int(worker.stdout.readline())

    def stop(self) -> None:
        """End the processes."""
        for worker in self._workers:
            worker.kill()
            worker.wait()


def main(trees: dict[str, str]) -> None:
    """Print the medians in microseconds and their ratio to the first tree's."""
    workers = Workers(trees, "cold")
    for chain in ("6R", "7R"):
        for row in ROWS:
            times = [workers.ask(f"{chain} {row}") for _ in range(TICKS + 5)][5:]
            medians = [statistics.median(column) / 1e3 for column in zip(*times, strict=True)]
            parts = [f"{n} {m:7.2f} us ({m / medians[0]:.2f})" for n, m in zip(trees, medians, strict=True)]
            print(f"{chain} {row:20}", *parts, sep="  ", flush=True)
    workers.stop()


if __name__ == "__main__":
    here = {"here": str(Path(__file__).parents[2] / "python")}
    main(dict(argument.split("=", 1) for argument in sys.argv[1:]) or here)
