"""What a tool may do: rules that turn it on a surface."""

from .rules import PointingRule, SurfaceRule

__all__ = ["PointingRule", "SurfaceRule"]
