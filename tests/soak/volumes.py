"""Orientation volumes at length: `python -m tests.soak volumes` prints a table; 1 if a bar was missed.

A kind at a time. A million random orientations, members and orientations beside members of random volumes: membership
by the angles of the definition against the distance. A thousand random orientations: the nearest member is one by its
definition, and neither a dense search nor the best of it polished by scipy finds a nearer one.
"""

import argparse
from time import perf_counter

import numpy as np
from redundancy import quaternion
from scipy.optimize import minimize

from tests.task.volumes import F64, Volume, box, made, members, random_orientations, random_volume, within

KINDS = ["cone", "pyramid", "square", "line_x", "line_y", "product"]

# Angles of the definitions have rounding of their own, which half turns and gimbals magnify.
ROUNDING = 1e-9


def main(arguments: list[str]) -> int:
    """Run it; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak volumes", description=__doc__)
    parser.add_argument("--orientations", type=int, default=1_000_000)
    parser.add_argument("--searches", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    rng, missed = np.random.default_rng(options.seed), 0
    for kind in KINDS:
        begin = perf_counter()
        inside, wrong = memberships(rng, kind, options.orientations)
        met, nearer, worst = searches(rng, kind, options.searches)
        print(
            f"{kind}: {options.orientations} orientations, {inside} members, {wrong} wrong; "
            f"{options.searches} nearest, {met} met by the search, nearer by {max(nearer, 0.0):.1e} at most, "
            f"members by {worst:.1e}; {perf_counter() - begin:.0f} s",
            flush=True,
        )
        missed += wrong + (nearer > 1e-12) + (worst > 1e-9)
    return int(missed > 0)


def memberships(rng: np.random.Generator, kind: str, count: int) -> tuple[int, int]:
    """Return how many are members, and how many the definition and the distance disagree about."""
    inside, wrong, each = 0, 0, 3000
    for _ in range(max(count // (3 * each), 1)):
        volume = random_volume(rng, kind, euler=True)
        drawn = members(rng, volume, each)
        beside = quaternion.product(drawn, quaternion.about(rng.normal(size=(each, 3)), rng.uniform(0.0, 0.1, each)))
        asked = np.concatenate([random_orientations(rng, each), drawn, beside])
        told, distance = volume.contains(asked), volume.distance(asked)
        inside += int(told.sum())
        wrong += int(np.sum(told != (distance <= 1e-12)))
        wrong += int(np.sum(~told & within(volume, asked, -ROUNDING)))
        wrong += int(np.sum((distance == 0.0) & ~within(volume, asked, ROUNDING)))
        wrong += int(np.sum(~told[each : 2 * each]))
    return inside, wrong


def searches(rng: np.random.Generator, kind: str, count: int) -> tuple[int, float, float]:
    """Return how often the search came as near, by how much nearer at most, and how far from members answers are."""
    met, nearer, worst = 0, -np.inf, 0.0
    for _ in range(count):
        volume, q = random_volume(rng, kind), random_orientations(rng, 1)[0]
        found = volume.nearest(q)
        gap = found.distance - searched(rng, volume, q)
        # Beside a member the cost is flat to rounding: the search ends 1e-8 away.
        met, nearer = met + (abs(gap) < (1e-9 if found.distance > 1e-4 else 1e-6)), max(nearer, gap)
        worst = max(worst, float(volume.distance(found.orientation)))
    return met, nearer, worst


def searched(rng: np.random.Generator, volume: Volume, q: F64) -> float:
    """Return the distance of the nearest of many members, the best of them polished."""
    ranges = box(volume)
    bounds = [(low, high) if high - low < 2.0 * np.pi else (-np.inf, np.inf) for low, high in ranges]
    numbers = np.stack([rng.uniform(low, max(high, low), 1000) for low, high in ranges], axis=-1)
    distances = quaternion.angle(made(volume, numbers), q)
    best = float(distances.min())

    k, step = len(ranges), 1e-6

    def cost(x: F64) -> tuple[float, F64]:
        moved = x + step * np.vstack([np.zeros(k), np.eye(k), -np.eye(k)])
        values = 1.0 - (made(volume, moved) @ q) ** 2
        return float(values[0]), (values[1 : k + 1] - values[k + 1 :]) / (2.0 * step)

    for start in numbers[np.argsort(distances)[:2]]:
        end = minimize(cost, start, method="L-BFGS-B", jac=True, bounds=bounds, options={"ftol": 1e-16, "gtol": 1e-10})
        best = min(best, float(quaternion.angle(made(volume, np.clip(end.x, *np.transpose(bounds))[None])[0], q)))
    return best
