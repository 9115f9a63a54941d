"""Pictures: labelled with units, colours that colour-blind readers can tell apart, legible in print.

The figures do not belong to pyplot: they need no display, and `save` or ``figure.savefig`` writes them. They need
matplotlib (``pip install redundancy[plot]``), which the first of them imports; the interactive map needs plotly.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Final

from .map_data import BY_BADNESS, CAUSES, MapData, MapLine, prepared
from .map_page import write_map_html

if TYPE_CHECKING:
    from .map import redundancy_map_figure
    from .path import condition_along_path, joints_against_limits, overview, spin_along_path
    from .posture import planar_tetrahedron, posture_3d
    from .scan import spin_scan
    from .style import save, saved
    from .tracking import tracking_figure
    from .volume import orientation_volumes
    from .weights import search_history, weights_along_path

__all__ = [
    "BY_BADNESS",
    "CAUSES",
    "MapData",
    "MapLine",
    "condition_along_path",
    "joints_against_limits",
    "orientation_volumes",
    "overview",
    "planar_tetrahedron",
    "posture_3d",
    "prepared",
    "redundancy_map_figure",
    "save",
    "saved",
    "search_history",
    "spin_along_path",
    "spin_scan",
    "tracking_figure",
    "weights_along_path",
    "write_map_html",
]

_DRAWN_BY: Final = {
    "condition_along_path": "path",
    "joints_against_limits": "path",
    "orientation_volumes": "volume",
    "overview": "path",
    "planar_tetrahedron": "posture",
    "posture_3d": "posture",
    "redundancy_map_figure": "map",
    "save": "style",
    "saved": "style",
    "search_history": "weights",
    "spin_along_path": "path",
    "spin_scan": "scan",
    "tracking_figure": "tracking",
    "weights_along_path": "weights",
}
"""The files that need matplotlib: imported when a picture is asked for, so that all else works without."""


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in _DRAWN_BY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_DRAWN_BY[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)
