"""Serial chains in float64, differentiated as products of matrices.

No cross product and no formula of the package appears here: the transform of a chain is a product of 4 x 4 matrices,
each joint's matrix is differentiated by itself, and the columns of the Jacobian and their derivatives are read off the
products (see `tests.reference.condition`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, Literal, TypeAlias

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st
from redundancy import Robot

F64: TypeAlias = npt.NDArray[np.float64]


def _eye() -> F64:
    return np.eye(4)


@dataclass(frozen=True)
class Chain:
    """A Denavit-Hartenberg table with base and tool."""

    a: F64
    d: F64
    alpha: F64
    theta: F64
    joints: str
    convention: Literal["standard", "modified"] = "standard"
    base: F64 = field(default_factory=_eye)
    tool: F64 = field(default_factory=_eye)

    @property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joints)

    def robot(self) -> Robot:
        """Return the package's robot of this table."""
        return Robot.from_dh(
            self.a, self.d, self.alpha, self.theta, self.joints, self.convention, base=self.base, tool=self.tool
        )

    def _links(self, q: F64) -> list[list[F64]]:
        links: list[list[F64]] = []
        for i, kind in enumerate(self.joints):
            angle = self.theta[i] + (q[i] if kind == "R" else 0.0)
            slide = self.d[i] + (q[i] if kind == "P" else 0.0)
            moved = [_screw(angle, slide)]
            for order in range(1, 4):
                derivative = np.zeros((4, 4))
                if kind == "R":
                    derivative[:2, :2] = _screw(angle + order * np.pi / 2, 0.0)[:2, :2]
                elif order == 1:
                    derivative[2, 3] = 1.0
                moved.append(derivative)
            fixed = _twist(self.alpha[i], self.a[i])
            links.append([fixed @ m if self.convention == "modified" else m @ fixed for m in moved])
        return links

    def products(self, q: F64, order: int) -> dict[tuple[int, ...], F64]:
        """Return the tool frame and its derivatives; the key is the sorted tuple of the joints to differentiate by."""
        products: dict[tuple[int, ...], F64] = {(): self.base}
        for joint, link in enumerate(self._links(q)):
            products = {
                key + (joint,) * times: matrix @ link[times]
                for key, matrix in products.items()
                for times in range(order - len(key) + 1)
            }
        return {key: matrix @ self.tool for key, matrix in products.items()}

    def fk(self, q: F64) -> F64:
        """Return the tool frame."""
        return self.products(q, 0)[()]

    def derivatives(self, q: F64) -> tuple[F64, F64, F64]:
        """Return J, dJ[:, i, k] and d2J[:, i, k, l]."""
        n = self.n
        products = self.products(q, 3)

        def t(*key: int) -> F64:
            return products[tuple(sorted(key))]

        rotation = t()
        j, j1, j2 = np.zeros((6, n)), np.zeros((6, n, n)), np.zeros((6, n, n, n))
        for i in range(n):
            j[:3, i], j[3:, i] = _vee(t(i), rotation), t(i)[:3, 3]
            for k in range(n):
                j1[:3, i, k] = _vee(t(i, k), rotation) + _vee(t(i), t(k))
                j1[3:, i, k] = t(i, k)[:3, 3]
                for m in range(n):
                    j2[:3, i, k, m] = (
                        _vee(t(i, k, m), rotation) + _vee(t(i, k), t(m)) + _vee(t(i, m), t(k)) + _vee(t(i), t(k, m))
                    )
                    j2[3:, i, k, m] = t(i, k, m)[:3, 3]
        return j, j1, j2


def _screw(angle: float, slide: float) -> F64:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, slide], [0, 0, 0, 1]], dtype=np.float64)


def _twist(alpha: float, a: float) -> F64:
    c, s = np.cos(alpha), np.sin(alpha)
    return np.array([[1, 0, 0, a], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]], dtype=np.float64)


def _vee(left: F64, right: F64) -> F64:
    product = left[:3, :3] @ right[:3, :3].T
    return np.array([product[2, 1], product[0, 2], product[1, 0]])


def random_columns(seed: int, n: int) -> tuple[F64, F64, F64, F64]:
    """Return a, d, alpha and theta between -1 and 1."""
    a, d, alpha, theta = np.random.default_rng(seed).uniform(-1, 1, (4, n))
    return a, d, alpha, theta


def random_frame(rng: np.random.Generator) -> F64:
    """Return a random rigid transform, translations below 0.5 m."""
    rotation, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    if np.linalg.det(rotation) < 0:
        rotation[:, 0] *= -1.0
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = rotation, rng.uniform(-0.5, 0.5, 3)
    return frame


@st.composite
def chains(draw: st.DrawFn, least: int = 1, most: int = 12, kinds: str = "RP") -> tuple[Chain, F64]:
    """Draw a random chain and a posture of it: right angles and zeros are as likely as generic numbers."""
    joints = draw(st.text(alphabet=kinds, min_size=least, max_size=most))
    convention: Literal["standard", "modified"] = draw(st.sampled_from(("standard", "modified")))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = len(joints)
    sizes = [np.where(rng.random(n) < 0.4, 0.0, rng.uniform(-0.5, 0.5, n)) for _ in range(2)]
    right = rng.integers(-1, 3, n) * np.pi / 2
    alpha = np.where(rng.random(n) < 0.5, right, rng.uniform(-np.pi, np.pi, n))
    frames = [random_frame(rng) if draw(st.booleans()) else np.eye(4) for _ in range(2)]
    theta = rng.uniform(-np.pi, np.pi, n)
    q = np.where([kind == "R" for kind in joints], rng.uniform(-np.pi, np.pi, n), rng.uniform(-0.5, 0.5, n))
    return Chain(sizes[0], sizes[1], alpha, theta, joints, convention, *frames), q


RIGHT: Final = np.pi / 2
PUMA = Chain(
    np.array([0.0, 0.43, -0.02, 0.0, 0.0, 0.0]),
    np.array([0.0, 0.15, 0.0, 0.43, 0.0, 0.1]),
    np.array([-RIGHT, 0.0, RIGHT, -RIGHT, RIGHT, 0.0]),
    np.zeros(6),
    "RRRRRR",
)
"""An arm as the PUMA 560, in round figures [m]."""
