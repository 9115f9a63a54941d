"""Postures chosen for their own sake, and what they tell about a robot."""

from .manipulability import ManipulabilityResult, maximum_manipulability
from .posture import (
    PlanarTetrahedron,
    PostureResult,
    characteristic_length,
    minimum_condition_posture,
    planar_tetrahedron,
)

__all__ = [
    "ManipulabilityResult",
    "PlanarTetrahedron",
    "PostureResult",
    "characteristic_length",
    "maximum_manipulability",
    "minimum_condition_posture",
    "planar_tetrahedron",
]
