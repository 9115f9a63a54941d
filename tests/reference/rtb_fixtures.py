"""Write `data/rtb.json`: kinematics by the Robotics Toolbox for Python 1.5.0, for tests that then need no Toolbox.

Run where ``roboticstoolbox-python==1.5.0`` is installed::

    python tests/reference/rtb_fixtures.py tests/data/rtb.json

Rows are permuted to [omega; v], the Hessian, which the Toolbox returns as ``H[k] = dJ/dq_k`` (n, 6, n), to
``[:, i, k]``.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np

POSTURES = 6
SEED = 150
ANGULAR_FIRST = [3, 4, 5, 0, 1, 2]


def _random_robot(rtb: Any, rng: np.random.Generator) -> Any:
    links = []
    for kind in "RRPRRPR":
        a, alpha, fixed = rng.uniform(-0.5, 0.5), rng.uniform(-np.pi, np.pi), rng.uniform(-0.5, 0.5)
        if kind == "R":
            links.append(rtb.RevoluteDH(a=a, alpha=alpha, d=fixed))
        else:
            links.append(rtb.PrismaticDH(a=a, alpha=alpha, theta=fixed))
    return rtb.DHRobot(links, name="random_rrprrpr")


def _describe(robot: Any) -> dict[str, Any]:
    links = robot.links
    modified = {bool(link.mdh) for link in links}
    if len(modified) != 1:
        raise ValueError(f"{robot.name} mixes conventions")
    offset = [float(link.offset) for link in links]
    prismatic = [bool(link.sigma) for link in links]
    return {
        "name": robot.name,
        "convention": "modified" if modified.pop() else "standard",
        "joints": "".join("P" if p else "R" for p in prismatic),
        "a": [float(link.a) for link in links],
        "alpha": [float(link.alpha) for link in links],
        "d": [float(link.d) + (o if p else 0.0) for link, o, p in zip(links, offset, prismatic, strict=True)],
        "theta": [float(link.theta) + (0.0 if p else o) for link, o, p in zip(links, offset, prismatic, strict=True)],
        "base": np.asarray(robot.base.A).tolist(),
        "tool": np.asarray(robot.tool.A).tolist(),
    }


def _posture(robot: Any, q: Any) -> dict[str, Any]:
    jacobian = np.asarray(robot.jacob0(q))[ANGULAR_FIRST]
    hessian = np.asarray(robot.hessian0(q))[:, ANGULAR_FIRST, :].transpose(1, 2, 0)
    return {
        "q": q.tolist(),
        "fk": np.asarray(robot.fkine(q).A).tolist(),
        "jacobian": jacobian.tolist(),
        "derivative": hessian.tolist(),
        "manipulability": float(robot.manipulability(q)),
        "gradient": np.asarray(robot.jacobm(q)).ravel().tolist(),
    }


def main(file: str) -> None:
    """Write the fixtures.

    Parameters
    ----------
    file : str
        The JSON file.
    """
    import roboticstoolbox as rtb

    rng = np.random.default_rng(SEED)
    robots = []
    for robot in (rtb.models.DH.Puma560(), rtb.models.DH.Panda(), _random_robot(rtb, rng)):
        postures = [_posture(robot, rng.uniform(-2.5, 2.5, robot.n)) for _ in range(POSTURES)]
        robots.append(_describe(robot) | {"postures": postures})
    document = {"made_with": f"roboticstoolbox-python {rtb.__version__}", "robots": robots}
    Path(file).write_text(json.dumps(document) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1])
