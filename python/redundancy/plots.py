"""Pictures: labelled with units, colours that colour-blind readers can tell apart, legible in print.

The figures do not belong to pyplot: they need no display, and `save` or ``figure.savefig`` writes them. This module
needs matplotlib (``pip install redundancy[plot]``).
"""

from ._map_data import MapLine
from ._plot_map import redundancy_map_figure
from ._plot_path import condition_along_path, joints_against_limits, overview, spin_along_path
from ._plot_posture import planar_tetrahedron, posture_3d
from ._plot_spin_scan import spin_scan
from ._plot_style import save

__all__ = [
    "MapLine",
    "condition_along_path",
    "joints_against_limits",
    "overview",
    "planar_tetrahedron",
    "posture_3d",
    "redundancy_map_figure",
    "save",
    "spin_along_path",
    "spin_scan",
]
