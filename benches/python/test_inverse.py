"""Every posture of one pose: a six-joint arm with a spherical wrist, ABB IRB 120, one pose a call."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from .chains import F64, POSTURES
from .conftest import label
from .contender import PER_POSTURE

ROBOT = "abb_irb120"
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Inverse:
    """`solve` is timed, what gives its argument and reads its answer is not."""

    solve: Callable[[Any], Any]
    """One pose; the answer holds every posture, in whatever form the library has."""
    pose: Callable[[F64], Any] = np.ascontiguousarray
    """A matrix as the library wants it."""

    def postures(self, matrix: F64) -> F64:
        """Solve for one pose, shape (k, 6)."""
        return np.array(self.solve(self.pose(matrix)), dtype=np.float64).reshape(-1, 6)


def ours(robot: rd.Robot) -> Inverse:
    return Inverse(robot.inverse)


def eaik(robot: rd.Robot) -> Inverse:
    """EAIK from the frames of the joints at zero; reading `Q` copies the postures into an array and is timed too."""
    frames, frame = [], robot.base
    for link in robot.links:
        frame = frame @ link
        frames.append(frame)
    frames.append(frame @ robot.flange @ robot.tool)
    peer = pytest.importorskip("eaik.IK_Homogeneous").HomogeneousRobot(np.array(frames))
    assert peer.hasKnownDecomposition()
    return Inverse(lambda matrix: peer.IK(matrix).Q)


def opw(robot: rd.Robot) -> Inverse:
    """py-opw-kinematics, whose seven lengths are those of the DH table; it takes poses as SciPy's, made ahead."""
    library, transform = pytest.importorskip("py_opw_kinematics"), pytest.importorskip("scipy.spatial.transform")
    table = robot.dh
    assert table is not None
    a, d = table["a"], table["d"]
    lengths = {"a1": a[0], "a2": -a[2], "b": d[1] + d[2], "c1": d[0], "c2": a[1], "c3": d[3], "c4": d[5]}
    model = library.KinematicModel(**lengths, offsets=(0.0, 0.0, -np.pi / 2, 0.0, 0.0, 0.0))
    return Inverse(library.Robot(model, degrees=False).inverse, transform.RigidTransform.from_matrix)


LIBRARIES: dict[str, Callable[[rd.Robot], Inverse]] = {"redundancy": ours, "EAIK": eaik, "py-opw-kinematics": opw}


def sample(robot: rd.Robot) -> F64:
    """Postures within the limits, the same for every library."""
    return np.random.default_rng(0).uniform(robot.q_min, robot.q_max, (POSTURES, robot.n))


def check(robot: rd.Robot, q: F64, found: F64) -> None:
    """Fail unless all that was found has the pose of q, and q is among it but for whole turns."""
    assert len(found)
    for each in found:
        assert np.abs(robot.fk(each) - robot.fk(q)).max() <= TOLERANCE
    turn = np.remainder(found - q + np.pi, 2 * np.pi) - np.pi
    assert np.abs(turn).max(axis=1).min() <= TOLERANCE


@pytest.mark.benchmark(**PER_POSTURE)
@pytest.mark.parametrize("library", LIBRARIES)
def test_inverse(benchmark: BenchmarkFixture, library: str) -> None:
    robot = rd.robots.get(ROBOT)
    inverse, count = LIBRARIES[library](robot), 0
    poses = []
    for q in sample(robot):
        pose = robot.fk(q)
        found = inverse.postures(pose)
        check(robot, q, found)
        count += len(found)
        poses.append(inverse.pose(pose))
    solve = inverse.solve

    def sweep() -> None:
        for pose in poses:
            solve(pose)

    label(benchmark, "IRB 120", "inverse", library)
    benchmark.extra_info["postures a pose"] = count / len(poses)
    benchmark(sweep)
