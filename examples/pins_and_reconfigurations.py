"""A line that is dragged in a redundancy map, and a path that has to be left on its way and entered again."""

import numpy as np
import redundancy as rd


def dragged() -> None:
    """Hold the spin of a milling tool where somebody wants it."""
    robot = rd.robots.get("fanuc_m710ic50_milling")
    path = rd.Toolpath.helix(0.25, 0.159, 0.0, 1.57, offset=3.14159, center=(1.3, 1.0, 0.0))
    kappa = rd.ConditionNumber(0.4856)
    chart = rd.redundancy_map(robot, path, objective=kappa, n_angles=72)
    free = rd.plan(robot, path, objective=kappa, criterion="integral")
    spin = chart.spin_of(free)
    for by in (0.0, 0.2, 0.4):
        plan = rd.plan(robot, path, objective=kappa, criterion="integral", start=free.q[0], pins={50: spin[50] + by})
        mean = plan.mean_condition_number
        print(f"spin of point 50 moved by {np.rad2deg(by):.0f} deg: mean condition number {mean:.4f}, {plan.failure}")


def carried_round() -> None:
    """Carry a blade round twice: no wrist turns that far."""
    t = np.linspace(0.0, 4.0 * np.pi, 161)
    along = np.stack([-np.sin(t), np.cos(t), 0.0 * t], axis=1)
    down = np.tile([0.0, 0.0, -1.0], (len(t), 1))
    edge = np.stack([0.5 + 0.1 * np.cos(t), 0.1 * np.sin(t), 0.3 + 0.0 * t], axis=1)
    blade = rd.Toolpath(edge, down, np.stack([along, np.cross(down, along), down], axis=2))
    half = np.full(6, np.pi)
    robot = rd.robots.get("ur5e").with_limits(q_min=-half, q_max=half)
    plan = rd.plan(
        robot, blade, rd.Task.full(), criterion="motion", max_step=0.25, reconfigurations=True, lift_off=0.05
    )
    print(plan)
    for number, (first, last) in enumerate(plan.segments):
        print(f"points {first} to {last}: {len(plan.segment(number))} postures")
        if number < len(plan.transfers):
            way = plan.transfers[number]
            print(f"  off by {1000 * way.lift[0]:.0f} mm, {len(way)} postures, {way.duration:.1f} s at least")


if __name__ == "__main__":
    dragged()
    carried_round()
