"""What the pictures of a redundancy map have in common: its checks, the best branch, colours and lines."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .._util import F64, checked
from ..errors import InvalidValueError, ShapeError
from .colours import BLACK, ORANGE, PALE, PURPLE

U8: TypeAlias = NDArray[np.uint8]
Int: TypeAlias = NDArray[np.intp]

CAUSES: Final = ("feasible", "unreachable", "joint limit", "singular", "predicate")
SINGULAR: Final = CAUSES.index("singular")

# The causes from the one that came closest to being feasible to the worst, and the place of each code in that order.
BY_BADNESS: Final = (0, 4, 2, 3, 1)
_BADNESS: Final = np.argsort(BY_BADNESS).astype(np.uint8)

# None of them is in the colour map, and next to its dark end, the worst values, black is what it tends to.
CAUSE_COLORS: Final = ("", PALE, ORANGE, BLACK, PURPLE)

# Branches that differ by a flip of the wrist have equal values: rounding must not choose between them.
_TIE: Final = 1e-6


@dataclass(frozen=True)
class MapLine:
    """A spin along the path to draw over a redundancy map.

    Parameters
    ----------
    spin : array_like, shape (N,)
        Spin at every point [rad], wrapped or not; NaN where there is none.
    branch : array_like of int, shape (N,), optional
        Branch at every point; negative where there is none.
    label : str
        Its name in the legend.
    """

    spin: ArrayLike
    branch: ArrayLike | None = None
    label: str = "chosen spin"


@dataclass(frozen=True, eq=False)
class Polyline:
    """A line over the map that ends at -180 and 180 deg and goes on at the other side.

    Attributes
    ----------
    x, y : ndarray
        Vertices [unit of the distance, deg]; y is NaN where the line breaks.
    branch : ndarray
        Branch at every vertex, -1 where there is none.
    changes : ndarray
        Vertices where one branch ends and another begins; the line breaks between them.
    label : str
        Its name.
    """

    x: F64
    y: F64
    branch: Int
    changes: Int
    label: str


@dataclass(frozen=True, eq=False)
class MapData:
    """A redundancy map that was checked.

    Attributes
    ----------
    value : ndarray, shape (N, A, B)
        The objective; without meaning where the cause is not 0.
    cause : ndarray, shape (N, A, B)
        Index into `CAUSES`.
    degrees : ndarray, shape (A,)
        Angles from -180 deg on, ascending: value and cause were sorted with them.
    x : ndarray, shape (N,)
        Distance along the path, or numbers of the points.
    x_label : str
        What x is.
    numbered : bool
        Whether x are the numbers of the points.
    pick : ndarray, shape (N, A)
        The branch with the least value, or where none is feasible the one that came closest.
    lines : tuple of Polyline
        What to draw over the map.
    angle_name : str
        What the angles are: "spin", or a joint.
    """

    value: F64
    cause: U8
    degrees: F64
    x: F64
    x_label: str
    numbered: bool
    pick: Int
    lines: tuple[Polyline, ...]
    angle_name: str = "spin"

    @property
    def branches(self) -> int:
        """Number of branches."""
        return int(self.value.shape[2])

    def layer(self, branch: int | None) -> tuple[F64, U8]:
        """Return value (NaN where infeasible) and cause of one branch, or of the best at every cell; shape (N, A)."""
        pick = self.pick if branch is None else np.full(self.pick.shape, branch, dtype=np.intp)
        value = np.take_along_axis(self.value, pick[:, :, None], axis=2)[:, :, 0]
        cause = np.take_along_axis(self.cause, pick[:, :, None], axis=2)[:, :, 0]
        return np.where(cause == 0, value, np.nan), cause

    def limits(self) -> tuple[float, float] | None:
        """Return limits for the colours that leave extreme tails of the best values out; None where none is feasible.

        Returns
        -------
        tuple of float or None
            Low and high, apart; ``high > low``.
        """
        best = self.layer(None)[0]
        best = best[np.isfinite(best)]
        if not best.size:
            return None
        low, below, above, high = (float(v) for v in np.quantile(best, (0.0, 0.02, 0.98, 1.0)))
        tail = 0.1 * (above - below)
        low, high = (below if low < below - tail else low), (above if high > above + tail else high)
        if high - low <= 1e-9 * abs(low):
            spread = 0.05 * abs(low) or 1.0
            low, high = low - spread, high + spread
        return low, high


def prepared(
    value: ArrayLike,
    cause: ArrayLike,
    angles: ArrayLike,
    distance: ArrayLike | None,
    lines: Sequence[MapLine],
    x_label: str | None,
    angle_name: str = "spin",
) -> MapData:
    """Check a redundancy map, sort its angles and choose the best branch at every cell.

    Parameters
    ----------
    value, cause : array_like, shape (N, A, B)
        As for ``redundancy_map_figure``.
    angles : array_like, shape (A,)
        Spin [rad].
    distance : array_like, shape (N,), optional
        Place along the path.
    lines : sequence of MapLine
        What to draw over the map.
    x_label : str, optional
        What the distance is.
    angle_name : str
        What the angles are.

    Returns
    -------
    MapData
        The map.

    Raises
    ------
    ShapeError
        If the arrays do not fit together.
    InvalidValueError
        If a cause is unknown, the angles are not different ones, or the path goes back.
    NonFiniteError
        If an angle or a distance is not finite.
    """
    values = np.asarray(value, dtype=np.float64)
    if values.ndim != 3 or 0 in values.shape:
        raise ShapeError(f"value: got shape {values.shape}, expected (N, A, B), each at least 1")
    n, a, _ = values.shape
    codes = np.asarray(cause)
    if codes.shape != values.shape:
        raise ShapeError(f"cause: got shape {codes.shape}, expected that of value, {values.shape}")
    if codes.dtype.kind not in "iu" or codes.min() < 0 or codes.max() >= len(CAUSES):
        raise InvalidValueError(f"cause: expected integers from 0 to {len(CAUSES) - 1}")
    turn = np.rad2deg(checked("angles", angles, (a,)))
    # What rounding left a hair below -180 deg is -180 deg.
    degrees = np.mod(turn + 180.0 + 1e-9, 360.0) - 180.0 - 1e-9
    order = np.argsort(degrees, kind="stable")
    degrees = degrees[order]
    if (np.diff(degrees) < 1e-6).any():
        raise InvalidValueError("angles: expected different ones within one turn")
    if distance is None:
        x, label = np.arange(n, dtype=np.float64), "point of the path"
    else:
        x, label = checked("distance", distance, (n,)), "distance along the path [m]"
    if (np.diff(x) < 0.0).any():
        raise InvalidValueError("distance: expected a path that does not go back")
    values, codes = values[:, order], codes.astype(np.uint8)[:, order]
    codes[(codes == 0) & ~np.isfinite(values)] = SINGULAR
    drawn = tuple(_polyline(line, x, values.shape[2]) for line in lines)
    return MapData(
        values, codes, degrees, x, x_label or label, distance is None, _pick(values, codes), drawn, angle_name
    )


def _pick(value: F64, cause: U8) -> Int:
    score = np.where(cause == 0, value, np.inf)
    least = score.min(axis=2, keepdims=True)
    feasible = np.isfinite(least)
    bound = np.where(feasible, least + _TIE * np.abs(least), -np.inf)
    pick: Int = np.where(feasible[:, :, 0], (score <= bound).argmax(axis=2), _BADNESS[cause].argmin(axis=2))
    return pick


def _polyline(line: MapLine, x: F64, branches: int) -> Polyline:
    spin = np.asarray(line.spin, dtype=np.float64)
    if spin.shape != x.shape:
        raise ShapeError(f"spin of {line.label!r}: got shape {spin.shape}, expected ({len(x)},)")
    branch = np.full(len(x), -1, dtype=np.intp) if line.branch is None else np.asarray(line.branch)
    if branch.shape != x.shape:
        raise ShapeError(f"branch of {line.label!r}: got shape {branch.shape}, expected ({len(x)},)")
    if branch.dtype.kind not in "iu" or branch.max() >= branches:
        raise InvalidValueError(f"branch of {line.label!r}: expected integers below {branches}")
    branch = np.maximum(branch.astype(np.intp), -1)
    y = np.mod(np.rad2deg(spin) + 180.0, 360.0) - 180.0
    rows: list[tuple[float, float, int]] = []
    changes: list[int] = []
    for i in range(len(x)):
        if i > 0 and branch[i - 1] != branch[i]:
            changes += [len(rows) - 1, len(rows) + 1]
            rows.append((float(x[i]), np.nan, -1))
        elif i > 0 and abs(y[i] - y[i - 1]) > 180.0:
            # The short way from one angle to the next leads over the edge, out at one side and in at the other.
            edge = 180.0 if y[i - 1] > 0.0 else -180.0
            share = (edge - y[i - 1]) / (y[i] + 2.0 * edge - y[i - 1])
            there = float(x[i - 1] + share * (x[i] - x[i - 1]))
            rows += [(there, edge, int(branch[i])), (there, np.nan, -1), (there, -edge, int(branch[i]))]
        rows.append((float(x[i]), float(y[i]), int(branch[i])))
    vertices = np.array(rows, dtype=np.float64)
    kept = vertices[:, 2].astype(np.intp)
    return Polyline(vertices[:, 0], vertices[:, 1], kept, np.array(changes, dtype=np.intp), line.label)


def is_log(limits: tuple[float, float]) -> bool:
    """Tell whether colours between these limits are better spread by the logarithm."""
    low, high = limits
    return high > 4.0 * low > 0.0


def log_ticks(limits: tuple[float, float]) -> list[float]:
    """Return round numbers between two positive limits, about evenly spread in the logarithm."""
    low, high = limits
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    found: list[float] = []
    for steps in ((1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0), (1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        found = [float(f"{s}e{d}") for d in decades for s in steps if low <= s * 10.0**d <= high]
        if len(found) <= 9:
            break
    return found


def round_ticks(limits: tuple[float, float]) -> list[float]:
    """Return round numbers between two limits, evenly spread."""
    low, high = limits
    coarse = 10.0 ** np.floor(np.log10(high - low))
    step = next(s * coarse for s in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if (high - low) <= 8.0 * s * coarse)
    return [float(f"{k * step:.12g}") for k in range(int(np.ceil(low / step)), int(np.floor(high / step)) + 1)]


def edges_of(centres: F64) -> F64:
    """Return the borders of cells around ascending centres: half-way between them, and as far beyond the ends."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    middle = 0.5 * (centres[1:] + centres[:-1])
    ends = 2.0 * centres[[0, -1]] - middle[[0, -1]]
    return np.concatenate([ends[:1], middle, ends[1:]])
