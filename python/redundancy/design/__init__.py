"""Postures chosen for their own sake, and what they tell about a robot."""

from .accuracy import error_bounds
from .isotropy import Isotropy, isotropy
from .manipulability import ManipulabilityResult, maximum_manipulability
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
    "ManipulabilityResult",
    "PlanarTetrahedron",
    "PostureResult",
    "characteristic_length",
    "error_bounds",
    "isotropy",
    "maximum_manipulability",
    "minimum_condition_posture",
    "planar_tetrahedron",
]
