"""Turn pytest-benchmark's JSON into tables: python benches/python/report.py results.json > table.md.

A second argument, min, takes the quickest round of each benchmark instead of the median: for a machine that others use.
"""

import json
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

Times = Mapping[tuple[str, str, str], float]
"""Seconds a call, by quantity, robot and library."""

ROBOTS = ("6R", "7R")
LIBRARIES = ("redundancy", "pinocchio", "CasADi C")
RACES = {
    "fk": "forward kinematics, `out=`",
    "jacobian": "Jacobian, `out=`",
    "jacobian_derivative": "dJ/dq, `out=`",
    "manipulability": "manipulability",
    "manipulability_gradient": "manipulability, gradient",
    "kappa": "kappa_F",
    "kappa_gradient": "kappa_F, gradient",
    "kappa_hessian": "kappa_F, gradient, Hessian",
}
HELICES = {
    "helix_follow_chunk": "`OrthogonalSQP.follow_chunk`",
    "helix_follow_given": "`follow`, first posture given",
    "helix_follow_sought": "`follow`, first posture sought",
}


def main(arguments: list[str]) -> int:
    """Print the report."""
    file, statistic = (*arguments, "median")[:2] if arguments else ("", "")
    if len(arguments) > 2 or statistic not in ("median", "min"):
        print(__doc__, file=sys.stderr)
        return 2
    results: dict[str, Any] = json.loads(Path(file).read_text(encoding="utf-8"))
    times = {
        (i["quantity"], i["robot"], i["library"]): float(b["stats"][statistic])
        for b in results["benchmarks"]
        if "quantity" in (i := b["extra_info"])
    }
    print(
        "\n\n".join(
            [
                "\n".join(part)
                for part in (machine(results, statistic), races(times), batches(times), sqp(times), rates(times))
            ]
        )
    )
    return 0


def machine(results: Mapping[str, Any], statistic: str) -> Iterator[str]:
    """Where and with what."""
    info = results["machine_info"]
    packages = ", ".join(f"{name} {version}" for name, version in sorted(info.get("packages", {}).items()))
    cpu = info.get("cpu", {}).get("brand_raw", info.get("machine", "unknown processor"))
    yield f"{cpu}, Python {info['python_version']}, {packages}."
    yield f"{results['datetime'][:10]}, {statistic} of rounds, load {figure(info.get('load'))}."


def races(times: Times) -> Iterator[str]:
    """Single calls beside peers."""
    yield "| us per Python call, 6R / 7R | ours | pinocchio | CasADi C | ratio (best peer/ours) |"
    yield "|---|---|---|---|---|"
    for quantity, title in RACES.items():
        calls = {k: [times.get((quantity, robot, k)) for robot in ROBOTS] for k in LIBRARIES}
        ours, *peers = calls.values()
        best = [min(filter(None, column), default=None) for column in zip(*peers, strict=True)]
        ratios = [b / a if a and b else None for a, b in zip(ours, best, strict=True)]
        yield row(title, *(pair(calls[k], 1e6) for k in LIBRARIES), pair(ratios))


def batches(times: Times) -> Iterator[str]:
    """Postures per second."""
    yield "| kappa_F with gradient, million postures/s | one thread | two threads | scaling | CasADi C, serial map |"
    yield "|---|---|---|---|---|"
    for robot in ROBOTS:
        calls = [
            times.get(("batch_kappa_gradient", robot, library))
            for library in ("redundancy, 1 thread", "redundancy, 2 threads", "CasADi C")
        ]
        one, two, peer = (1e-6 / t if t else None for t in calls)
        yield row(robot, figure(one), figure(two), figure(two / one if one and two else None), figure(peer))


def sqp(times: Times) -> Iterator[str]:
    """Orthogonal SQP: no peer does the same."""
    yield "| orthogonal SQP | time |"
    yield "|---|---|"
    ticks = [times.get(("step", robot, "redundancy")) for robot in ROBOTS]
    yield row("`step`, tool spin free, limits, 6R / 7R", pair(ticks, 1e6) + " us")
    for quantity, title in HELICES.items():
        time = times.get((quantity, "FANUC", "redundancy"))
        yield row(f"helix, 101 points, {title}", figure(time and time * 1e3) + " ms")


def rates(times: Times) -> Iterator[str]:
    """Ticks of the methods of the rate level."""
    yield "| one tick, spin free, singularity and limits, us, 6R / 7R | time | over twist decomposition |"
    yield "|---|---|---|"
    ticks = {quantity: [times.get((quantity, robot, "redundancy")) for robot in ROBOTS] for quantity, _, _ in times}
    own = ticks.get("tick TwistDecomposition", [None, None])
    for quantity, calls in ticks.items():
        if quantity.startswith("tick "):
            ratios = [a / b if a and b else None for a, b in zip(calls, own, strict=True)]
            yield row(f"`{quantity[5:]}`", pair(calls, 1e6), pair(ratios))


def row(*cells: str) -> str:
    """One line of a table."""
    return f"| {' | '.join(cells)} |"


def pair(values: list[float | None], scale: float = 1.0) -> str:
    """Both robots, or a dash where neither was timed."""
    return " / ".join(figure(v and v * scale) for v in values) if any(values) else "-"


def figure(value: float | None) -> str:
    """Three digits."""
    if not value:
        return "-"
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
