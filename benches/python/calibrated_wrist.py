"""What calibration costs: every posture of arms whose wrist is ideal and of the same arms as calibrated, in pairs.

Run ``python benches/python/calibrated_wrist.py``. Each link of the calibrated arm is off by about a tenth of a
millimetre and of a milliradian. Frames are those of random postures, the same for both; one pose a call, on one core.
"""

import time

import numpy as np
import redundancy as rd
from redundancy._util import F64

ARMS = ("fanuc_m710ic50", "abb_irb2400", "abb_irb120")
FRAMES = 4000
OFF = 1e-4


def calibrated(robot: rd.Robot, rng: np.random.Generator) -> rd.Robot:
    """Return the arm with every link a little off."""
    links = robot.links
    for link in links[1:]:
        x, y, z = OFF * rng.standard_normal(3)
        q, r = np.linalg.qr(np.array([[1, -z, y], [z, 1, -x], [-y, x, 1]]))
        link[:3, 3] += OFF * rng.standard_normal(3)
        link[:3, :3] @= q * np.sign(np.diag(r))
    return rd.Robot.from_links(links, robot.flange, robot.joints)


def times(robot: rd.Robot, q: F64) -> F64:
    """Return the time of each call [us], the shorter of two."""
    out = []
    for pose in robot.fk(q):
        both = []
        for _ in range(2):
            begin = time.perf_counter_ns()
            robot.inverse(pose)
            both.append(time.perf_counter_ns() - begin)
        out.append(min(both) / 1e3)
    return np.array(out)


def main() -> None:
    """Print a table."""
    rng = np.random.default_rng(0)
    print(
        "| arm | ideal: median, mean [us] | calibrated: median, 90 %, mean [us] | ratio of medians | by continuation |"
    )
    print("|---|---|---|--:|--:|")
    for name in ARMS:
        ideal = rd.robots.get(name)
        q = rng.uniform(-np.pi, np.pi, (FRAMES, 6))
        a, b = times(ideal, q), times(calibrated(ideal, rng), q)
        print(
            f"| {name} | {np.median(a):.2f}, {a.mean():.2f} | {np.median(b):.2f}, {np.percentile(b, 90):.2f},"
            f" {b.mean():.1f} | {np.median(b) / np.median(a):.2f} | {(b > 50.0).mean():.1%} |"
        )


if __name__ == "__main__":
    main()
