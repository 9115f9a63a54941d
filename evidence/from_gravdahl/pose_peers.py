"""Other packages that solve poses, on the same robots: chains as a URDF file or as frames, with the same limits."""

import importlib
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Solve = Callable[[F64, F64], F64 | None]
"""From a pose and a start to a posture, or None."""


def urdf(robot: rd.Robot) -> str:
    """Return the chain of a robot of revolute joints as the text of a URDF file, from "base" to "tip"."""
    root = ElementTree.Element("robot", name=robot.name)
    links = ["base", *(f"link{i + 1}" for i in range(robot.n)), "tip"]
    for name in links:
        ElementTree.SubElement(root, "link", name=name)
    frames = [*robot.links, robot.flange @ robot.tool]
    for i, frame in enumerate(frames):
        kind = "revolute" if i < robot.n else "fixed"
        joint = ElementTree.SubElement(root, "joint", name=f"joint{i + 1}", type=kind)
        r = frame[:3, :3]
        angles = (
            np.arctan2(r[2, 1], r[2, 2]),
            np.arctan2(-r[2, 0], np.hypot(r[0, 0], r[1, 0])),
            np.arctan2(r[1, 0], r[0, 0]),
        )
        words = [" ".join(f"{x:.17g}" for x in numbers) for numbers in (frame[:3, 3], angles)]
        ElementTree.SubElement(joint, "origin", xyz=words[0], rpy=words[1])
        ElementTree.SubElement(joint, "parent", link=links[i])
        ElementTree.SubElement(joint, "child", link=links[i + 1])
        if i < robot.n:
            ElementTree.SubElement(joint, "axis", xyz="0 0 1")
            low, high = (f"{x:.17g}" for x in (robot.q_min[i], robot.q_max[i]))
            ElementTree.SubElement(joint, "limit", lower=low, upper=high, velocity="3", effort="100")
    return ElementTree.tostring(root, encoding="unicode")


def toolbox(robot: rd.Robot) -> Solve:
    """Return the compiled Levenberg-Marquardt of the Robotics Toolbox, up to 100 searches, tolerance 1e-10."""
    toolbox = importlib.import_module("roboticstoolbox")
    parts = []
    for frame, low, high in zip(robot.links, robot.q_min, robot.q_max, strict=True):
        parts += [toolbox.ET.SE3(frame), toolbox.ET.Rz(qlim=[low, high])]
    chain = toolbox.ETS([*parts, toolbox.ET.SE3(robot.flange @ robot.tool)])
    return lambda pose, q0: np.asarray(chain.ik_LM(pose, q0=q0, tol=1e-10)[0])


def optik(robot: rd.Robot) -> Solve:
    """Return optik, one thread, the first answer in 20 ms; by its own tolerance it misses most by more than 1e-4 m."""
    module = importlib.import_module("optik")
    with TemporaryDirectory() as folder:
        path = Path(folder) / "robot.urdf"
        path.write_text(urdf(robot), encoding="utf-8")
        chain = module.Robot.from_urdf_file(str(path), "base", "tip")
    chain.set_parallelism(1)
    config = module.SolverConfig(solution_mode="speed", max_time=0.02, tol_f=1e-11)

    def solve(pose: F64, q0: F64) -> F64 | None:
        found = chain.ik(config, pose, q0)
        return None if found is None else np.array(found[0])

    return solve


def tracik(robot: rd.Robot) -> Solve:
    """Return TRAC-IK through pytracik, the first answer in 5 ms, tolerance 1e-5."""
    module = importlib.import_module("pytracik")
    solver = module.TRAC_IK("base", "tip", urdf(robot), 0.005, 1e-5, module.SolveType.Speed)

    def solve(pose: F64, q0: F64) -> F64 | None:
        found = np.asarray(module.ik(solver, q0, *pose[:3, 3], *quaternion(pose[:3, :3])))
        if found.size == robot.n + 1:
            return found[1:] if found[0] >= 0 else None
        return found if found.size == robot.n else None

    return solve


def quaternion(r: F64) -> F64:
    """Return the quaternion of a rotation, scalar last: an eigenvector (Bar-Itzhack 2000)."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = r
    k = [
        [xx - yy - zz, yx + xy, zx + xz, zy - yz],
        [yx + xy, yy - xx - zz, zy + yz, xz - zx],
        [zx + xz, zy + yz, zz - xx - yy, yx - xy],
        [zy - yz, xz - zx, yx - xy, xx + yy + zz],
    ]
    return np.array(np.linalg.eigh(np.array(k) / 3.0)[1][:, -1])


def peers(robot: rd.Robot) -> Iterator[tuple[str, Solve]]:
    """Yield the peers that are installed and take the robot."""
    for name, make in [("Robotics Toolbox", toolbox), ("optik", optik), ("TRAC-IK (pytracik)", tracik)]:
        try:
            yield name, make(robot)
        except ImportError:
            continue
