"""Ticks within orientation volumes: how far any of a hundred thousand leaves one, on random arms, volumes and ways."""

import argparse
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import redundancy as rd

from tests.reference.arms import random_arm
from tests.reference.chain import F64
from tests.reference.volumes import KINDS, drawn, frame_about, loop

BAR = 1e-9
"""How far outside a tick may end [rad]."""
TICKS = 100
"""Ticks of one way."""
CONDITION = rd.ConditionNumber(0.4, squared=True)
METHODS: dict[str, Callable[..., Any]] = {
    "QuadraticProgram": partial(rd.QuadraticProgram, weight=30.0),
    "OrthogonalSQP": rd.OrthogonalSQP,
    "TwistDecomposition": rd.TwistDecomposition,
    "GradientProjection": rd.GradientProjection,
}
ARMS = ("ur5e", "kuka_iiwa14", "fanuc_m710ic50_milling", "puma500", "random")


def _swing(amplitude: F64, phase: float, start: float, tick: int) -> F64:
    """Return a velocity to and fro."""
    out: F64 = amplitude * np.cos(phase * tick - start)
    return out


def main(arguments: list[str]) -> int:
    """Drive tools to and fro, up to 2 m/s and 2 rad/s, beyond reach too; print the worst of each method."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak volume_ticks")
    parser.add_argument("--ticks", type=int, default=100_000, help="of all methods together")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    worst, ended, failed = dict.fromkeys(METHODS, -np.inf), Counter[str](), 0
    for k in range(max(1, options.ticks // (TICKS * len(METHODS)))):
        rng = np.random.default_rng([options.seed, k])
        name, kind, dt = ARMS[k % 5], KINDS[k // 5 % len(KINDS)], (1e-3, 4e-3, 1e-2)[k % 3]
        robot = random_arm(rng, "general").robot() if name == "random" else rd.robots.get(name)
        # Accelerations have no limits: with them, a frame that turns may not be followed by any rates.
        robot = robot.with_limits(robot.q_min, robot.q_max, robot.qd_max, np.full(robot.n, np.inf))
        volume, measure = drawn(kind, rng)
        limits = bool(rng.random() < 0.5)
        low, high = np.maximum(robot.q_min, -2.5), np.minimum(robot.q_max, 2.5)
        q = low + (high - low) * rng.uniform(0.1, 0.9, robot.n)
        velocity = rng.normal(size=3) * rng.choice([0.05, 0.3, 2.0])
        omega = rng.normal(size=3) * (0.0 if limits else rng.choice([0.0, 0.3, 2.0]))
        for method, make in METHODS.items():
            out = loop(
                make(robot, rd.Task.within(volume), CONDITION, dt=dt, limits=limits),
                q,
                frame_about(robot, q, volume, k),
                measure,
                partial(_swing, velocity, 20.0 * dt, 0.0),
                partial(_swing, omega, 10.0 * dt, 0.5 * np.pi),
                TICKS,
            )
            ended.update(out.status)
            worst[method] = max(worst[method], out.outside)
            if not (out.outside <= BAR and np.isfinite(out.q).all()):
                failed += 1
                print(f"{method}: {out.outside:.1e} rad outside, way {k} of seed {options.seed}: {name}, {kind}, {dt}")
    for method, outside in worst.items():
        print(f"{method}: at most {outside:.1e} rad outside")
    print(f"{sum(ended.values())} ticks: " + ", ".join(f"{count} {word}" for word, count in ended.most_common()))
    return int(failed > 0)
