"""How every picture looks, and how it is saved."""

from pathlib import Path
from typing import Any, Final

import numpy as np

try:
    import matplotlib as mpl
    import matplotlib.ticker
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
except ImportError as error:  # pragma: no cover
    raise ImportError("pictures need matplotlib: pip install redundancy[plot]") from error

from .._util import F64
from .colours import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY

__all__ = ["BLACK", "BLUE", "GREEN", "GREY", "ORANGE", "PURPLE", "SKY", "STYLE"]
__all__ += ["Axes", "Axes3D", "Figure", "Poly3DCollection", "mpl"]
__all__ += ["legend_beside", "log_if_long", "marker", "plain", "save", "saved"]

STYLE: Final[dict[Any, Any]] = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "axes.axisbelow": True,
    "lines.linewidth": 1.5,
    "legend.edgecolor": "none",
    "legend.framealpha": 1.0,
    "legend.borderaxespad": 0.8,
    # Without random names in it, an equal picture is an equal file.
    "svg.hashsalt": "redundancy",
}


def marker(x: F64) -> str:
    """Return the marker of a curve over x: one point alone would not show without."""
    return "o" if len(x) == 1 else ""


def plain(name: str) -> str:
    """Return a name that is shown as it is: matplotlib reads formulas between dollars, and hides what begins with _."""
    return f"\N{ZERO WIDTH SPACE}{name}".replace("$", r"\$") if name.startswith("_") else name.replace("$", r"\$")


def log_if_long(axes: Axes, values: F64) -> None:
    """Take a logarithmic scale where the values span more than a decade and none is 0."""
    finite = values[np.isfinite(values)]
    if finite.size and finite.max() > 10.0 * finite.min() > 0.0:
        axes.set_yscale("log")


def legend_beside(axes: Axes, **look: Any) -> None:  # noqa: ANN401
    """Put the legend to the right of the panel, where it covers nothing."""
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), **look)


def save(figure: Figure, *files: str | Path) -> None:
    """Save a picture, 300 dots per inch where it is made of dots.

    Parameters
    ----------
    figure : Figure
        The picture.
    *files : path-like
        Files; their endings (``.png``, ``.svg``, ``.pdf``) tell the format.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    # Nor a date.
    undated = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    for file in files:
        with mpl.rc_context(STYLE):
            figure.savefig(file, dpi=300, metadata=undated.get(Path(file).suffix.lower()))


def saved(figure: Figure, path: str | Path | None) -> Figure:
    """Save a picture, if there is a file to save it to, and return it."""
    if path is not None:
        save(figure, path)
    return figure
