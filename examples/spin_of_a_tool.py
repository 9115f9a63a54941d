"""Hold a milling tool on a point in a 1 kHz loop while its free spin leaves for a better posture."""

import numpy as np
import redundancy as rd

DT = 1e-3
"""Control tick [s]."""
FEEDBACK = 50.0
"""Rate at which an error of the tool dies out [1/s]."""

robot = rd.robots.get("fanuc_m710ic50_milling")
task = rd.Task.axisymmetric()
kappa = rd.ConditionNumber(0.4855933)
solver = rd.OrthogonalSQP(robot, task, rd.ConditionNumber(0.4855933, squared=True), gain=5.0, dt=DT)

# The first point of the helix: position [m] and direction of the tool's axis.
target = np.array([1.05, 1.0, 0.0, 1.0, 0.0, 0.0])

# A start on the target with the joints near the middle of their ranges, and the best posture near it.
q, *_ = rd.OrthogonalSQP(robot, task, rd.JointLimits()).solve(target)
best, *_ = solver.solve(target, q)

rates = np.empty(robot.n)
print("  time    kappa_F    largest rate   error of the tool   step")
for tick in range(2001):
    error = solver.error(q, target)
    solver.step(q, FEEDBACK * error, out=rates)
    if tick % 250 == 0:
        value, fastest = kappa.evaluate(robot, q, order=0), np.abs(rates).max()
        size, status = np.linalg.norm(error), solver.status
        print(f"{tick * DT:5.2f} s   {value:.6f}   {fastest:6.3f} rad/s   {size:.0e}               {status}")
    q = q + DT * rates
print(f"solve, from the same start: kappa_F {kappa.evaluate(robot, best, order=0):.6f}")
