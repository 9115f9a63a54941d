"""Postures chosen for their own sake, and what they tell about a robot."""

from .accuracy import error_bounds
from .isotropy import Isotropy, isotropy
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
    "Isotropy",
    "PlanarTetrahedron",
    "PostureResult",
    "characteristic_length",
    "error_bounds",
    "isotropy",
    "minimum_condition_posture",
    "planar_tetrahedron",
]
