"""Twist decomposition, or a quadratic programme, in a loop of its own at 1 kHz: prints what its ticks take.

python examples/control_loop.py [seconds] [decomposition|programme]

The torch of a FANUC M-710iC/50 goes round a circle; its spin, which the seam leaves free, keeps the arm well
conditioned and away from its limits. One call a tick, no allocation; the loop sleeps until shortly before each tick and
spins the rest of the time, as a loop without a real-time kernel has to. What the machine itself adds (interrupts, other
processes, a hypervisor) shows in a wait of a few microseconds that is timed beside every step: rare delays that both
have are not those of the package.
"""

import gc
import os
import sys
import time

import numpy as np
import redundancy as rd

DT = 1e-3
RADIUS, OMEGA = 0.1, 0.8
"""Circle [m] and speed along it [rad/s]."""
FEEDBACK = 20.0
"""Rate at which errors of position and axis are closed [1/s]."""
WAIT = 4000
"""About what a step takes [ns]."""


def main(seconds: float, method: str) -> None:
    """Run the loop."""
    robot = rd.robots.get("fanuc_m710ic50_milling")
    objective = rd.ConditionNumber(0.4855933, squared=True) + 0.1 * rd.LimitBarrier()
    task = rd.Task.axisymmetric()
    step: rd.TwistDecomposition | rd.QuadraticProgram
    if method == "programme":
        step = rd.QuadraticProgram(robot, task, objective, weight=1000.0, stiffness=1e6, dt=DT)
    else:
        step = rd.TwistDecomposition(robot, task, objective, gain=2.0, dt=DT)
    centre, axis = np.array([1.3, 0.0, 0.2]), np.array([0.0, 1.0, 0.0])
    target = np.concatenate([centre, axis])
    target[0] += RADIUS
    q, _, status, _ = rd.OrthogonalSQP(robot, task, objective).solve(target)
    print(f"start: {status}, condition number {rd.ConditionNumber(0.4855933).evaluate(robot, q, order=0):.3f}")

    ticks = int(seconds / DT)
    took, waited = np.zeros(ticks, dtype=np.int64), np.zeros(ticks, dtype=np.int64)
    statuses: dict[str, int] = {}
    twist, rates, pose = np.zeros(6), np.zeros(robot.n), np.zeros((4, 4))
    worst_error = 0.0
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    gc.disable()
    start = time.perf_counter_ns()
    for tick in range(ticks):
        phase = OMEGA * tick * DT
        wanted = centre + RADIUS * np.array([np.cos(phase), np.sin(phase), 0.0])
        robot.fk(q, out=pose)
        twist[:3] = FEEDBACK * np.cross(pose[:3, 2], axis)
        twist[3:] = FEEDBACK * (wanted - pose[:3, 3]) + RADIUS * OMEGA * np.array([-np.sin(phase), np.cos(phase), 0.0])

        before = time.perf_counter_ns()
        step.step(q, twist, out=rates)
        took[tick] = time.perf_counter_ns() - before

        before = time.perf_counter_ns()
        while time.perf_counter_ns() - before < WAIT:
            pass
        waited[tick] = time.perf_counter_ns() - before

        status = step.status
        statuses[status] = statuses.get(status, 0) + 1
        if tick > 1000:
            worst_error = max(worst_error, float(np.linalg.norm(wanted - pose[:3, 3])))
        q += DT * rates
        next_tick = start + int((tick + 1) * DT * 1e9)
        slack = (next_tick - time.perf_counter_ns()) / 1e9
        if slack > 2e-4:
            time.sleep(slack - 2e-4)
        while time.perf_counter_ns() < next_tick:
            pass
    elapsed = (time.perf_counter_ns() - start) / 1e9

    kappa = rd.ConditionNumber(0.4855933).evaluate(robot, q, order=0)
    print(f"{ticks} ticks in {elapsed:.2f} s; statuses {statuses}")
    for what, times in (("a step", took), ("the machine: a wait of 4 us", waited)):
        median, often, rare, worst = np.percentile(times, [50.0, 99.9, 99.99, 100.0]) / 1000.0
        print(f"{what:28s} {median:8.2f} us (median) {often:8.2f} (99.9 %) {rare:8.2f} (99.99 %) {worst:8.2f} (worst)")
    print(f"largest error of position after the first second {1e6 * worst_error:.1f} um")
    print(f"condition number at the end {kappa:.3f}")


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 60.0, sys.argv[2] if len(sys.argv) > 2 else "decomposition")
