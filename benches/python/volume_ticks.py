"""A tick within a cone over the same tick without.

`python -m benches.python.volume_ticks` prints the table of docs/control.md.

Ticks of a loop within the cone are recorded; each tick of a round is then answered by three solvers that differ in the
task alone, in turn, so that what else the machine does meets all of them.
"""

import time
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import redundancy as rd

F64 = np.ndarray[Any, np.dtype[np.float64]]
Solver: TypeAlias = rd.QuadraticProgram | rd.OrthogonalSQP | rd.RateSolver
TICKS, ROUNDS, DT, TILT = 2000, 9, 1e-3, np.deg2rad(5.0)
ARMS = {
    "ur5e": [0.3, -1.2, 1.4, 0.2, 1.1, 0.3],
    "kuka_iiwa14": [0.1, 0.5, 0.2, -1.2, 0.3, 0.8, 0.1],
    "fanuc_m710ic50_milling": [0.2, 0.4, -0.3, 0.5, -0.9, 0.4],
}
INDEX = rd.ConditionNumber(0.4, squared=True)
METHODS: dict[str, Callable[[rd.Robot, rd.Task], Solver]] = {
    "`QuadraticProgram`, no objective": lambda robot, task: rd.QuadraticProgram(robot, task, dt=DT),
    "`QuadraticProgram`": lambda robot, task: rd.QuadraticProgram(robot, task, INDEX, weight=300.0, dt=DT),
    "`OrthogonalSQP`": lambda robot, task: rd.OrthogonalSQP(robot, task, INDEX, dt=DT),
    "`TwistDecomposition`": lambda robot, task: rd.TwistDecomposition(robot, task, INDEX, dt=DT),
}


def recorded(solver: Solver, robot: rd.Robot, q: F64) -> tuple[list[F64], list[F64], list[F64], float]:
    """Postures, twists and frames of a loop, and the share of its ticks at the bound."""
    target, volume = robot.fk(q), rd.OrientationVolume.cone(TILT)
    postures, twists, frames, bound = [], [], [], 0
    for k in range(TICKS):
        target = target.copy()
        target[:3, 3] += DT * np.array([0.05, 0.03, 0.02]) * np.cos(6.0 * k * DT)
        twists.append(solver.twist_to(q, target))
        postures.append(q)
        frames.append(target[:3, :3].copy())
        q = q + DT * solver.step(q, twists[-1], frame=frames[-1])
        bound += abs(volume.signed_distance(frames[-1].T @ robot.fk(q)[:3, :3])) < 1e-8
    return postures, twists, frames, bound / TICKS


def seconds(solver: Solver, postures: list[F64], twists: list[F64], frames: list[F64] | None) -> float:
    """CPU seconds of a tick."""
    rates = np.empty(len(postures[0]))
    start = time.process_time()
    if frames is None:
        for q, twist in zip(postures, twists, strict=True):
            solver.step(q, twist, rates)
    else:
        for q, twist, frame in zip(postures, twists, frames, strict=True):
            solver.step(q, twist, rates, frame=frame)
    return (time.process_time() - start) / len(postures)


def main() -> None:
    """Print the table."""
    cone = rd.Task.within(rd.OrientationVolume.cone(TILT))
    print("| method | arm | ticks at the bound | tick | over `Task.position()` | over `Task.axisymmetric()` |")
    print("|---|---|---|---|---|---|")
    for method, make in METHODS.items():
        for name, posture in ARMS.items():
            robot = rd.robots.get(name)
            postures, twists, frames, bound = recorded(make(robot, cone), robot, np.array(posture))
            rounds = np.array(
                [
                    [
                        seconds(make(robot, cone), postures, twists, frames),
                        seconds(make(robot, rd.Task.position()), postures, twists, None),
                        seconds(make(robot, rd.Task.axisymmetric()), postures, twists, None),
                    ]
                    for _ in range(ROUNDS)
                ]
            )
            one, position, axis = np.median(rounds, axis=0)
            ratios = f"{one / position:.2f} | {one / axis:.2f}"
            print(f"| {method} | `{name}` | {100.0 * bound:.0f} % | {1e6 * one:.1f} µs | {ratios} |")


if __name__ == "__main__":
    main()
