"""Postures chosen for their own sake, and what they tell about a robot."""

from .posture import (
    Convergence,
    PlanarTetrahedron,
    PostureResult,
    characteristic_length,
    minimum_condition_posture,
    planar_tetrahedron,
)

__all__ = [
    "Convergence",
    "PlanarTetrahedron",
    "PostureResult",
    "characteristic_length",
    "minimum_condition_posture",
    "planar_tetrahedron",
]
