"""Postures chosen for their own sake, and what they tell about a robot."""

from .posture import (
    PlanarTetrahedron,
    PostureResult,
    characteristic_length,
    minimum_condition_posture,
    planar_tetrahedron,
)

__all__ = [
    "PlanarTetrahedron",
    "PostureResult",
    "characteristic_length",
    "minimum_condition_posture",
    "planar_tetrahedron",
]
