"""The milled helix of the thesis, 11 points in 10 s, and the robot that mills it."""

import numpy as np
import redundancy as rd

ROBOT = rd.robots.get("fanuc_m710ic50_milling")
PATH = rd.Toolpath.helix(0.25, 0.5 / np.pi, 0.0, np.pi / 2, np.pi, (1.3, 1.0, 0.0), 11, duration=10.0)
