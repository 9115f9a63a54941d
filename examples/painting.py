"""Paint a panel with a UR5e: orientation held, a rule by the place on the surface, the fastest within 10 degrees."""

import numpy as np
import redundancy as rd

TILT = np.deg2rad(10.0)
ACCELERATION = np.full(6, 15.0)
"""Largest accelerations of the joints [rad/s^2]."""

# A gun of 0.25 m on the flange, and a panel of 0.3 by 0.4 m below it.
tool, frame = np.eye(4), np.eye(4)
tool[2, 3] = 0.25
frame[:3, 3] = 0.5, 0.0, -0.1
robot = rd.robots.get("ur5e").with_tool(tool)
path = rd.Toolpath.raster((0.3, 0.4), rows=4, fillet=0.05, spacing=0.005, along="y", frame=frame)

rule = rd.SurfaceRule(TILT, half_size=(0.15, 0.2), frame=frame, pointing=rd.PointingRule.of(robot))
leaning = path.oriented(rule.rotation(path.position, path.rotation))
motions = {
    "orientation held": rd.plan(robot, path, rd.Task.full(), criterion="motion"),
    "rule": rd.plan(robot, leaning, rd.Task.full(), criterion="motion"),
}
cone = rd.OrientationVolume.cone(TILT)
best = rd.fastest(robot, path, cone, acceleration=ACCELERATION, start=list(motions.values()), max_iterations=30)
motions["fastest within 10 deg"] = best.trajectory

print("                         speed   limited by                 rates alone   time")
for name, motion in motions.items():
    found = rd.constant_speed(robot, motion, acceleration=ACCELERATION)
    timed = motion.timed(found.speed)
    limit = f"{found.criterion} of joint {found.joint + 1}, point {found.point}"
    rates = found.criteria["rate"].speed
    print(f"{name:22} {found.speed:6.3f} m/s   {limit:30} {rates:6.3f} m/s   {timed.path.duration:.2f} s")
