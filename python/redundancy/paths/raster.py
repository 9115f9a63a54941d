"""Rasters: parallel lines over a rectangle, one after the other, with rounded corners."""

from typing import NamedTuple

import numpy as np

from .._util import F64
from ..errors import InvalidValueError

_ROUNDING = 1e-12
"""Share of a length by which rounding may leave a fillet too large, as where half circles join the lines."""

_MOST = 10_000_000
"""Points of a raster at most: more are a slip of the unit, and would fill the memory."""


class Pieces(NamedTuple):
    """Straight lines and arcs in the plane, end to end: arrays of M, but for the starts, shape (M, 2)."""

    start: F64
    heading: F64
    length: F64
    curvature: F64


def raster_corners(size: tuple[float, float], rows: int) -> F64:
    """Return the corners of a raster of lines along x about the origin, from the corner of least x and y.

    Parameters
    ----------
    size : tuple of float
        Sides of the rectangle along x and along y [m].
    rows : int
        Number of lines; a single one is in the middle.

    Returns
    -------
    ndarray, shape (2 rows, 2)
        The ends of the lines.
    """
    x = 0.5 * size[0] * np.where(np.arange(2 * rows + 1)[1:] // 2 % 2, 1.0, -1.0)
    y = np.linspace(-0.5, 0.5, rows) * size[1] if rows > 1 else np.zeros(1)
    return np.stack([x, np.repeat(y, 2)], axis=1)


def rounded(corners: F64, fillet: float) -> Pieces:
    """Return a polygonal line with rounded corners.

    Parameters
    ----------
    corners : ndarray, shape (K, 2)
        Where it begins, bends and ends; a bend is less than a half turn.
    fillet : float
        Radius of the arcs [m].

    Returns
    -------
    Pieces
        Lines and arcs; those of no length are left out.

    Raises
    ------
    InvalidValueError
        If the arcs do not fit between the corners.
    """
    edge = np.diff(corners, axis=0)
    length = np.linalg.norm(edge, axis=1)
    heading = np.arctan2(edge[:, 1], edge[:, 0])
    bend = np.remainder(np.diff(heading) + np.pi, 2.0 * np.pi) - np.pi
    setback = np.concatenate([[0.0], fillet * np.tan(0.5 * np.abs(bend)), [0.0]])
    straight = length - setback[:-1] - setback[1:]
    short = np.flatnonzero(straight < -_ROUNDING * length)
    if short.size:
        k = int(short[0])
        most = fillet * length[k] / (setback[k] + setback[k + 1])
        raise InvalidValueError(
            f"fillet is {fillet} m, expected at most {most:.6g} m for a line of {length[k]:.6g} m (line {k})"
        )
    direction = edge / length[:, None]
    lines = Pieces(corners[:-1] + setback[:-1, None] * direction, heading, straight, np.zeros(len(edge)))
    if fillet == 0.0:
        return lines
    ends = corners[1:-1] - setback[1:-1, None] * direction[:-1]
    arcs = Pieces(ends, heading[:-1], fillet * np.abs(bend), np.sign(bend) / fillet)
    order = np.argsort(np.concatenate([np.arange(len(edge)), np.arange(len(bend)) + 0.5]), kind="stable")
    pieces = Pieces(*(np.concatenate(pair)[order] for pair in zip(lines, arcs, strict=True)))
    kept = pieces.length > _ROUNDING * length.sum()
    return Pieces(*(part[kept] for part in pieces))


def points_along(pieces: Pieces, spacing: float) -> tuple[F64, F64]:
    """Return points at equal distances along pieces.

    Parameters
    ----------
    pieces : Pieces
        Lines and arcs.
    spacing : float
        Largest distance from a point to the next along the path [m].

    Returns
    -------
    points : ndarray, shape (N, 2)
        The points, the first and the last of the path among them.
    length : ndarray, shape (N,)
        Exact lengths of the path to them [m].
    """
    ends = np.cumsum(pieces.length)
    if ends[-1] > _MOST * spacing:
        raise InvalidValueError(f"spacing is {spacing} m, expected at most {_MOST} points along {ends[-1]:.4g} m")
    count = int(np.ceil(ends[-1] / spacing * (1.0 - _ROUNDING)))
    s = np.linspace(0.0, ends[-1], count + 1)
    at = np.minimum(np.searchsorted(ends, s, side="right"), len(ends) - 1)
    inside = s - (ends - pieces.length)[at]
    half = 0.5 * inside * pieces.curvature[at]
    # The chord of an arc goes into the mean of its directions.
    chord, direction = inside * np.sinc(half / np.pi), pieces.heading[at] + half
    return pieces.start[at] + chord[:, None] * np.stack([np.cos(direction), np.sin(direction)], axis=1), s
