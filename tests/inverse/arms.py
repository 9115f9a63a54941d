"""Robots of the package and postures of theirs that the tests of inverse kinematics share."""

import numpy as np
import redundancy as rd

SIX = [name for name in rd.robots.names() if rd.robots.get(name).joints == "RRRRRR"]
CLOSED = [name for name in SIX if rd.robots.get(name).structure != "general"]
IRB120, UR5E, KUKA = (rd.robots.get(name) for name in ("abb_irb120", "ur5e", "kuka_iiwa14"))
Q = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6])
Q7 = np.array([0.1, 0.2, -0.3, 0.4, -1.0, 0.6, 0.7])
POSE, POSE7 = IRB120.fk(Q), KUKA.fk(Q7)
