"""Rotations as unit quaternions [w, x, y, z]: scalar first, Hamilton's product, active.

These are the conventions of From and Gravdahl 2007, eq. 2 to 4. q and -q are the same rotation, and
``matrix(product(a, b)) == matrix(a) @ matrix(b)``. Arrays have any leading shape; of two
arguments either may be a single one.

Examples
--------
>>> import numpy as np
>>> import redundancy as rd
>>> turn = rd.quaternion.about([0, 0, 1], np.pi / 2)
>>> rd.quaternion.rotate(turn, [1.0, 0.0, 0.0]).round(12)
array([0., 1., 0.])
"""

from .._core import quaternion_about as about
from .._core import quaternion_angle as angle
from .._core import quaternion_axis_angle as axis_angle
from .._core import quaternion_conjugate as conjugate
from .._core import quaternion_from_matrix as from_matrix
from .._core import quaternion_matrix as matrix
from .._core import quaternion_product as product
from .._core import quaternion_rotate as rotate

__all__ = ["about", "angle", "axis_angle", "conjugate", "from_matrix", "matrix", "product", "rotate"]
