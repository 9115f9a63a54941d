"""Postures chosen for their own sake, and what they tell about a robot."""

from .posture import (
    PlanarTetrahedron,
    PostureResult,
    centred_turns,
    characteristic_length,
    middle_posture,
    minimum_condition_posture,
    planar_tetrahedron,
)

__all__ = [
    "PlanarTetrahedron",
    "PostureResult",
    "centred_turns",
    "characteristic_length",
    "middle_posture",
    "minimum_condition_posture",
    "planar_tetrahedron",
]
