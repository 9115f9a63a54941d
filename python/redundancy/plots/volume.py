"""Orientation volumes as clouds of points."""

from typing import Any

import numpy as np

from .._core import OrientationVolume, quaternion_conjugate, quaternion_product
from .._util import F64
from .colours import BLUE, GREEN, GREY, ORANGE
from .style import STYLE, Axes3D, Figure, mpl


def orientation_volumes(*volumes: OrientationVolume, points: int = 3000, seed: int = 0) -> Figure:
    """Draw volumes, a row each, by random members (From and Gravdahl 2007, Fig. 1).

    Parameters
    ----------
    *volumes : OrientationVolume
        One or more; each is seen in its own frame.
    points : int
        Members of each.
    seed : int
        Of the random members.

    Returns
    -------
    Figure
        Beside one another: the vector parts of the members, of the two quaternions that with w >= 0; those of the
        visualising quaternions, sin(spin/2) z', which several orientations share; and where the tool's axis z' points,
        which tells the rest with the spin as colour [deg].
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.4, 0.2 + 2.7 * len(volumes)), layout="constrained")
        rows = figure.subplots(len(volumes), 3, subplot_kw={"projection": "3d"}, squeeze=False)
        titles = ("quaternion, vector part", "visualising quaternion, vector part", "tool axis z', spin as colour")
        shown: Any = None
        for row, volume in zip(rows, volumes, strict=True):
            members = volume.sample(points, seed)
            direction, spin = volume.pointing(members)
            own = quaternion_product(quaternion_conjugate(volume.reference), members)
            quaternion = own[:, 1:] * np.where(own[:, :1] < 0.0, -1.0, 1.0)
            clouds = (quaternion, volume.visualising(members)[:, 1:], direction)
            for axes, cloud in zip(row, clouds, strict=True):
                shown = _cloud(axes, cloud, np.rad2deg(spin))
            row[0].text2D(-0.02, 0.5, _name(volume), transform=row[0].transAxes, rotation=90, va="center", ha="right")
        for axes, title in zip(rows[-1], titles, strict=True):
            axes.text2D(0.5, -0.02, title, transform=axes.transAxes, ha="center")
        bar = figure.colorbar(shown, ax=rows, shrink=0.6, aspect=30, pad=0.02, ticks=np.arange(-180, 181, 90))
        bar.set_label("spin [deg]")
    return figure


def _name(volume: OrientationVolume) -> str:
    tilts = ", ".join(f"{np.rad2deg(tilt):.4g}\N{DEGREE SIGN}" for tilt in volume.tilts)
    name = volume.kind.replace("_", " ")
    return f"{name} {tilts}".strip()


def _cloud(axes: Axes3D, points: F64, spin: F64) -> Any:  # noqa: ANN401
    """Draw points in the unit ball, its axes and three great circles; return the points."""
    around = np.linspace(0.0, 2.0 * np.pi, 121)
    circle = np.stack([np.cos(around), np.sin(around), np.zeros_like(around)])
    for shift in range(3):
        axes.plot(*np.roll(circle, shift, axis=0), color=GREY, linewidth=0.4, alpha=0.6)
    for i, (name, color) in enumerate((("x", ORANGE), ("y", GREEN), ("z", BLUE))):
        axes.plot(*np.outer(np.eye(3)[i], [0.0, 1.25]), color=color, linewidth=1.0)
        axes.text(*(1.4 * np.eye(3)[i]), name, color=color, ha="center", va="center")
    axes.set_axis_off()
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=1.3)
    axes.set(xlim=(-1.05, 1.05), ylim=(-1.05, 1.05), zlim=(-1.05, 1.05))
    axes.view_init(elev=22.0, azim=35.0)
    look = {"c": spin, "cmap": "twilight", "vmin": -180.0, "vmax": 180.0, "s": 2.0, "linewidths": 0.0}
    return axes.scatter(*points.T, depthshade=False, rasterized=True, **look)
