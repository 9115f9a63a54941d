"""Plans within random volumes of orientations: `python -m tests.soak volume_plans [--count 200] [--seed 1]`.

Arms of six joints with random tools, motions of the joints as paths, cones, pyramids and squares with free or bounded
spin, every criterion. Bars: every posture of a whole plan within the volume to 1e-9 rad, by the volume's own distance;
no plan worse than that of the spin alone, nor none where that is whole; no bound above the plan's worst value.
"""

import argparse
import sys

import numpy as np
import redundancy as rd

ARMS = ("fanuc_m710ic50_milling", "ur5e", "abb_irb2400", "puma500")
CRITERIA = ("minimax", "integral", "motion", "speed")
POINTS = 20
WORSE = 1e-6
OUTSIDE = 1e-9


def main(arguments: list[str]) -> int:
    """Plan random paths; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="python -m tests.soak volume_plans")
    parser.add_argument("--count", type=int, default=200, help="plans")
    parser.add_argument("--seed", type=int, default=1, help="of the random paths")
    options = parser.parse_args(arguments)
    faults = [fault for number in range(options.count) if (fault := fault_of(options.seed, number)) is not None]
    sys.stdout.write("".join(f"{fault}\n" for fault in faults) + f"{options.count} plans, {len(faults)} faults\n")
    return int(bool(faults))


def fault_of(seed: int, number: int) -> str | None:
    """Return what is wrong with a plan; None if nothing is."""
    rng = np.random.default_rng([seed, number])
    name = ARMS[rng.integers(len(ARMS))]
    tool = np.eye(4)
    tool[:3, 3] = 0.1 * rng.normal(), 0.0, 0.15
    robot = rd.robots.get(name).with_tool(tool)
    start = rng.uniform(-1.5, 1.5, robot.n)
    frames = robot.fk(np.linspace(start, start + rng.uniform(-0.8, 0.8, robot.n), POINTS))
    path = rd.Toolpath(frames[:, :3, 3], frames[:, :3, 2], frames[:, :3, :3])
    volume = random_volume(rng)
    criterion = CRITERIA[rng.integers(len(CRITERIA) - int(not np.isfinite(robot.qd_max).any()))]
    kappa, task = rd.ConditionNumber(0.5), rd.Task.within(volume)
    alone = rd.plan(robot, path, None, kappa, criterion, spin_range=volume.spin, progress=False)
    plan = rd.plan(robot, path, task, kappa, criterion, progress=False)
    told = f"{number}, {name}, {criterion}, {volume!r}: "
    if plan.failure is not None:
        return None if alone.failure is not None else f"{told}{plan.failure}, but the spin alone leads on"
    turned = np.swapaxes(frames[:, :3, :3], 1, 2) @ robot.fk(plan.q)[:, :3, :3]
    outside = float(np.max(volume.signed_distance(turned)))
    if outside > OUTSIDE:
        return f"{told}{outside:.1e} rad outside the volume"
    if alone.failure is None and plan.cost > alone.cost + WORSE * abs(alone.cost):
        return f"{told}{plan.cost}, with the spin alone {alone.cost}"
    if plan.bound > float(np.max(plan.value)) * (1.0 + OUTSIDE):
        return f"{told}a bound of {plan.bound} above {np.max(plan.value)}"
    return None


def random_volume(rng: np.random.Generator) -> rd.OrientationVolume:
    """Return a cone, a pyramid or a square, its spin free or bounded."""
    spin = None if rng.random() < 0.5 else (float(rng.uniform(-2.0, -0.1)), float(rng.uniform(0.1, 2.0)))
    x, y = np.deg2rad(rng.uniform(2.0, 30.0, 2))
    kind = rng.integers(3)
    if kind == 0:
        return rd.OrientationVolume.cone(2.0 * x, spin=spin)
    make = rd.OrientationVolume.pyramid if kind == 1 else rd.OrientationVolume.square
    return make(x, y, spin=spin)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
