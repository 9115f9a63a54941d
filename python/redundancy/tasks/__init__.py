"""What the tool has to do, beside the compiled tasks: rotations as quaternions."""

from . import quaternion

__all__ = ["quaternion"]
