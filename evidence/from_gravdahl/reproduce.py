"""The painting speeds of From and Gravdahl: ``python -m evidence.from_gravdahl.reproduce [--write | --check]``.

Prints the tables of docs/reproduction_from.md, each between two marks. With --write it puts them into the page and
draws its pictures. With --check it tells, by its exit status, whether the page shows all but the plans, whose last
digits depend on the machine.
"""

import sys
from collections.abc import Callable, Sequence

import numpy as np
import redundancy as rd

from evidence.from_gravdahl.cases import CRITERIA, TILT, dynamics, recorded, scenarios
from evidence.from_gravdahl.figures import draw
from evidence.from_gravdahl.runs import PLANNED, by_rule, finer, frames_of, planned, within_cone
from evidence.pages import DOCS, IMAGES, marked, show, stale, table

PAGE = DOCS / "reproduction_from.md"

NAMES = {
    "constant": "constant orientation",
    "spin -atan2": "spin, -atan2",
    "spin +atan2 (printed)": "spin, +atan2 (printed)",
    "tilt square, no spin": "tilt, square",
    "spin - and tilt square": "tilt, square, and spin, -atan2",
    "spin + and tilt square": "tilt, square, and spin, +atan2",
    "spin - and tilt circle": "tilt, circle, and spin, -atan2",
    "spin + and tilt circle": "tilt, circle, and spin, +atan2",
}

HEAD = ("torque of joint 1", "torques of joints 1, 2", "all torques", "rate of joint 1", "all rates")


def puma() -> str:
    """Compare the dynamics of the PUMA 560 at the zero posture, without a load."""
    recorded_weight, recorded_mass = recorded("puma560_dynamics")["check"].values()
    unloaded, zero = dynamics(payload=False), np.zeros(6)
    weight, mass = unloaded.torque(zero, zero, zero), unloaded.torque(zero, zero, np.eye(6)[0])[0]
    rows: list[Sequence[object]] = [
        ("torques of rest [N m]", *(", ".join(f"{t + 0.0:.4f}" for t in found) for found in (recorded_weight, weight))),
        ("inertia about joint 1 [kg m^2]", f"{recorded_mass:.4f}", f"{mass:.4f}"),
    ]
    return table(("at the zero posture, no load", "recorded", "here, by pinocchio"), rows)


def rules(name: str) -> str:
    """Compare all rules by all criteria, with their ratios to constant orientation."""
    results = scenarios()[name].results
    constant = by_rule(name, "constant")[1]
    rows: list[Sequence[object]] = []
    for rule, told in NAMES.items():
        found = by_rule(name, rule)[1]
        cells = [f"{found[c]:.4f} ({found[c] / constant[c]:.3f})" for c in CRITERIA]
        off = max(abs(found[c] / results[rule][c] - 1.0) for c in CRITERIA)
        rows.append((told, f"{results[rule]['max_tilt_deg']:.1f}", *cells, f"{off:.0e}"))
    return table(("rule", "largest tilt [deg]", *HEAD, "off the recorded"), rows)


def aligned() -> str:
    """Return the speeds of S1, by rule and criterion."""
    return rules("S1")


def outside() -> str:
    """Return the speeds of S2, by rule and criterion."""
    return rules("S2")


def inside() -> str:
    """Return the speeds of S3, by rule and criterion."""
    return rules("S3")


def limiting() -> str:
    """Tell which joint limits each rule of S2, and where."""
    rows: list[Sequence[object]] = []
    for rule, told in NAMES.items():
        motion = by_rule("S2", rule)[0]
        found = rd.constant_speed(motion.robot, motion, dynamics())
        cells = []
        for limit in found.criteria.values():
            assert limit.point is not None
            assert limit.joint is not None
            where = motion.path.length * limit.point / (len(motion) - 1)
            cells.append(f"{limit.speed:.3f} m/s, joint {limit.joint + 1}, at {where:.3f} m")
        rows.append((told, *cells))
    return table(("rule, S2", "all rates", "all torques"), rows)


def printed() -> str:
    """Compare the printed speeds with those of S2 by the torque of joint 1."""
    rows: list[Sequence[object]] = []
    values = {"constant": 0.91, "spin +atan2 (printed)": 1.13, "spin + and tilt square": 1.35}
    constant = by_rule("S2", "constant")[1]["tau1"]
    for rule, value in values.items():
        here = by_rule("S2", rule)[1]["tau1"]
        rows.append((NAMES[rule], f"{value:.2f} ({value / 0.91:.3f})", f"{here:.3f} ({here / constant:.3f})"))
    return table(("rule", "printed [m/s]", "here, S2, torque of joint 1 [m/s]"), rows)


def grids() -> str:
    """Tell what the distance of the points does to the speeds by the torques of joints 1 and 2."""
    rows: list[Sequence[object]] = []
    for name, scenario in scenarios().items():
        for rule in ("constant", scenario.best_rule):
            cells = [f"{_by_torque(scenario.motion(rule, spacing)):.4f}" for spacing in (2e-3, 1e-3, 5e-4, 1e-4)]
            rows.append((f"{name}, {NAMES[rule]}", *cells))
    return table(("torques of joints 1 and 2 [m/s]", "2 mm", "1 mm", "0.5 mm", "0.1 mm"), rows)


def _by_torque(motion: rd.Trajectory) -> float:
    found = rd.constant_speed(motion.robot, motion, dynamics()).criteria["torque"].joint_speed
    return float(found[:2].min())


def optimal_times() -> str:
    """Compare the time of each rule at its constant speed with the least time, all torques and rates kept."""
    rows: list[Sequence[object]] = []
    for name, scenario in scenarios().items():
        for rule in ("constant", scenario.best_rule):
            motion = by_rule(name, rule)[0]
            speed = rd.constant_speed(scenario.robot, motion, dynamics()).speed
            ends = {"start_speed": 0.99 * speed, "end_speed": 0.99 * speed}
            best = motion.timed(method="toppra", torque=dynamics(), **ends)
            rest = motion.timed(method="toppra", torque=dynamics())
            times = [motion.path.length / speed, best.path.duration, rest.path.duration]
            rows.append((f"{name}, {NAMES[rule]}", *(f"{t:.2f}" for t in times if t is not None)))
    return table(
        ("times [s]", "constant speed", "least, from and to 0.99 of that speed", "least, from and to rest"), rows
    )


def plans() -> str:
    """Compare the fastest motion within the cone of 10 deg with the best rule in it."""
    rows: list[Sequence[object]] = []
    for name, scenario in scenarios().items():
        constant = by_rule(name, "constant")[1]
        for told, criterion in PLANNED.items():
            found, close = planned(name, told), finer(name, told)
            best = max(by_rule(name, rule)[1][criterion] for rule in within_cone(scenario))
            seven = f"{scenario.results['optimised rule for tau12']['tau12']:.3f}" if criterion == "tau12" else ""
            speeds = (constant[criterion], best, found.speed.speed, close[criterion])
            ratio = f"{close[criterion] / constant[criterion]:.3f}"
            margin = TILT - tilt(name, found.trajectory)
            rows.append(
                (f"{name}, {told}", *(f"{v:.3f}" for v in speeds[:2]), seven, *(f"{v:.3f}" for v in speeds[2:]))
            )
            rows[-1] = (*rows[-1], ratio, "yes" if margin > -1e-9 else "no")
    head = (
        "criterion [m/s]",
        "constant",
        "best rule",
        "rule of 7 parameters",
        "plan",
        "at 0.125 mm",
        "ratio to constant",
    )
    return table((*head, "within 10 deg to 1e-9"), rows)


def tilt(name: str, motion: rd.Trajectory) -> float:
    """Return the largest tilt of a motion [rad]."""
    across = np.linalg.norm(np.cross(frames_of(name)[0, :, 2], motion.path.axis), axis=1)
    return float(np.arctan2(across, motion.path.axis @ frames_of(name)[0, :, 2]).max())


UNCHECKED: tuple[Callable[[], str], ...] = (plans, optimal_times)
SECTIONS: tuple[Callable[[], str], ...]
SECTIONS = (puma, printed, aligned, outside, inside, limiting, grids, optimal_times, plans)


def main(arguments: list[str]) -> int:
    """Print the tables; with --write or --check, put them into the page or compare them with it."""
    if "--check" in arguments:
        return 1 if stale((PAGE, marked(f.__name__, f())) for f in SECTIONS if f not in UNCHECKED) else 0
    write = "--write" in arguments
    show(PAGE, ((section.__name__, section()) for section in SECTIONS), write)
    if write:
        draw(IMAGES)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
