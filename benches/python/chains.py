"""The two robots of the comparison, and postures for them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]

DATA = Path(__file__).parents[2] / "tests" / "data"
POSTURES = 256
WORST = 50.0
"""Condition number (length 1 m) up to which a posture is taken: peers that form J J^T lose its square."""


@dataclass(frozen=True)
class Chain:
    """A serial robot of revolute joints between two links of a URDF."""

    name: str
    urdf: Path
    base: str
    tip: str

    def robot(self) -> rd.Robot:
        return rd.Robot.from_urdf(self.urdf, self.base, self.tip)

    def random(self, count: int, seed: int = 0) -> F64:
        """Postures anywhere within the limits and a turn, shape (count, n)."""
        robot = self.robot()
        low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
        return np.random.default_rng(seed).uniform(low, high, (count, robot.n))

    def postures(self) -> list[F64]:
        """The postures that every measurement of single calls goes through in turn."""
        candidates = self.random(4 * POSTURES)
        (kappa,) = rd.ConditionNumber().evaluate_many(self.robot(), candidates, 0)
        return list(candidates[kappa < WORST][:POSTURES])


CHAINS = {
    "6R": Chain("6R", DATA / "ur5.urdf", "base_link", "tool0"),
    "7R": Chain("7R", DATA / "panda.urdf", "panda_link0", "panda_link8"),
}
