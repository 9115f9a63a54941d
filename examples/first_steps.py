"""First steps: the posture of minimum condition number, and a milled helix with the free spin of the tool optimised."""

import numpy as np
import redundancy as rd

robot = rd.robots.get("fanuc_m710ic50_milling")
best = rd.minimum_condition_posture(robot, np.deg2rad([0, 20, -20, 0, -90, 0]))
print(f"kappa_F {best.condition_number:.6f}, characteristic length {1000 * best.length:.3f} mm")

path = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0, np.pi / 2, offset=np.pi, center=(1.3, 1, 0), duration=10)
solver = rd.OrthogonalSQP(robot, rd.Task.axisymmetric(), rd.ConditionNumber(best.length, squared=True))
trajectory = rd.follow(solver, path)
print(f"kappa_F at most {trajectory.max_condition_number:.3f} at {len(trajectory)} points")
print(f"nearest limit {np.rad2deg(trajectory.limit_margin):.1f} deg, points out of reach {trajectory.unreachable}")
