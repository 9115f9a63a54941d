"""What the tool has to do, beside the compiled tasks: rotations as quaternions, rules that turn it on a surface."""

from . import quaternion
from .rules import PointingRule, SurfaceRule

__all__ = ["PointingRule", "SurfaceRule", "quaternion"]
