"""Rules that turn a tool by its place on a surface, without a look at what comes (From and Gravdahl, S6 to S8)."""

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from .._core import Robot
from .._util import F64, between, checked, checked_pose, turns
from ..errors import InvalidValueError, ShapeError

Mount = Literal["inside", "outside"]

UPRIGHT = 1e-6
"""Cosine to the first joint's axis below which a tool points neither up nor down: half of single precision's digits."""

ON_AXIS = 1e-9
"""Offset of the flange from the tool's axis [m] below which it is on neither side: less than is built."""


class PointingRule:
    """Turn the tool about its own axis, so that the wrist keeps to the radial plane of its point.

    The spin is the azimuth of the tool point about the z axis of ``base`` (joint 1), psi = -atan2(y, x) for a tool that
    points down with the wrist on the robot's side of it ("inside"), psi = +atan2(y, x) for a wrist beyond it
    ("outside"), which then moves less than the tool (eq. 49, printed with the second sign alone). The signs are the
    opposite for a tool that points up. On the axis of joint 1, where there is no azimuth, the spin is 0. With the tool
    on the axis of the last joint the spin moves that joint alone.

    Parameters
    ----------
    mount : {"inside", "outside"}
        Where the wrist is, seen from the tool point.
    base : array_like, shape (4, 4), optional
        Pose of the frame whose z axis is the axis of joint 1; the base frame if not given.

    Raises
    ------
    InvalidValueError
        If the mount is another or the base is no pose.
    """

    def __init__(self, mount: Mount = "inside", base: ArrayLike | None = None) -> None:
        if mount not in ("inside", "outside"):
            raise InvalidValueError(f"mount is {mount!r}, expected 'inside' or 'outside'")
        self.mount = mount
        self.base = np.eye(4) if base is None else checked_pose("base", base)

    def __repr__(self) -> str:
        return f"PointingRule({self.mount!r})"

    @classmethod
    def of(cls, robot: Robot) -> "PointingRule":
        """Return the rule for the mount of a robot's tool.

        Parameters
        ----------
        robot : Robot
            With its tool and its base. The wrist is beyond the tool point where the flange is on the negative side of
            the tool frame's x axis; a flange on neither side counts as "inside".

        Returns
        -------
        PointingRule
            The rule.
        """
        flange = np.linalg.inv(robot.tool)
        return cls("outside" if flange[0, 3] < -ON_AXIS else "inside", robot.base)

    def spin(self, position: ArrayLike, rotation: ArrayLike) -> F64:
        """Return the turn of the tool about its axis.

        Parameters
        ----------
        position : array_like, shape (3,) or (N, 3)
            Tool points in the base frame [m].
        rotation : array_like, shape (3, 3) or (N, 3, 3)
            Orientations of the tool before the turn.

        Returns
        -------
        ndarray, shape () or (N,)
            Angles [rad], from -pi to pi.

        Raises
        ------
        ShapeError, NonFiniteError
            If an array has the wrong shape or holds NaN or infinities.
        InvalidValueError
            If a tool points neither up nor down but across the axis of joint 1.
        """
        points, frames, single = _points_and_frames(position, rotation)
        spin = self._spin(points, frames)
        return spin[0] if single else spin

    def rotation(self, position: ArrayLike, rotation: ArrayLike) -> F64:
        """Return the orientations of the tool after its turn; parameters and errors as for `spin`.

        Returns
        -------
        ndarray, shape (3, 3) or (N, 3, 3)
            Orientations R Rz(psi).
        """
        points, frames, single = _points_and_frames(position, rotation)
        turned = frames @ _about_z(self._spin(points, frames))
        return turned[0] if single else turned

    def _spin(self, points: F64, frames: F64) -> F64:
        upward = frames[:, :, 2] @ self.base[:3, 2]
        across = np.flatnonzero(np.abs(upward) < UPRIGHT)
        if across.size:
            k = int(across[0])
            raise InvalidValueError(
                f"rotation[{k}] has the tool's axis {frames[k, :, 2].tolist()}, expected one that is not across the "
                "axis of joint 1"
            )
        x, y = ((points - self.base[:3, 3]) @ self.base[:3, :2]).T
        sign = np.sign(upward) * (1.0 if self.mount == "inside" else -1.0)
        spin: F64 = sign * np.arctan2(y, x)
        return spin


class SurfaceRule:
    """Lean the tool outwards by its place on a surface, so that the wrist moves on a smaller path.

    In the frame of the surface, whose z axis is its outward normal, the part of the tool's axis along the surface is
    sin(tilt) (x / hx, y / hy) on a rectangle with the cross-section "square", and sin(tilt) (x, y) / R with the
    cross-section "circle", R the radius of the disc or half a diagonal of the rectangle. A circle keeps to the cone of
    that tilt; a square allows more at its corners, 14.2 deg for 10 (S8 of the source calls both 10 deg). With the tool
    length d above a plane surface the wrist's path shrinks by the share d sin(tilt) / h about the middle.

    The tool turns from its orientation on the path by the smallest rotation to the axis so found; then, with a pointing
    rule, about that axis. Beyond the edge of the surface the tool leans as on the edge. Each point is for itself: what
    a control loop pays for a tick does not depend on the path.

    Parameters
    ----------
    tilt : float
        Largest tilt of a circle, or along either axis of a square [rad]: above 0, at most pi/2, pi/4 for a square.
    half_size : tuple of float, optional
        Half the sides of a rectangle along the frame's x and y [m].
    radius : float, optional
        Radius of a disc [m]; either this or ``half_size``.
    frame : array_like, shape (4, 4), optional
        Pose of the surface: its middle, and its outward normal as z axis; the base frame if not given.
    cross_section : {"circle", "square"}
        Bound of the tilt; a disc has a circle.
    pointing : PointingRule, optional
        How the tool turns about its axis; it does not if not given.

    Raises
    ------
    ShapeError, NonFiniteError
        If an argument has the wrong shape or is not finite.
    InvalidValueError
        If a number is out of its domain, both or none of the extents are given, a disc is to have a square, or the
        frame is no pose.
    """

    def __init__(
        self,
        tilt: float,
        *,
        half_size: tuple[float, float] | None = None,
        radius: float | None = None,
        frame: ArrayLike | None = None,
        cross_section: Literal["circle", "square"] = "circle",
        pointing: PointingRule | None = None,
    ) -> None:
        given = (("half_size", half_size, (2,)), ("radius", radius, ()))
        extents = [checked(name, value, shape) for name, value, shape in given if value is not None]
        if len(extents) != 1:
            raise InvalidValueError("half_size and radius: expected one of them")
        if cross_section not in ("circle", "square"):
            raise InvalidValueError(f"cross_section is {cross_section!r}, expected 'circle' or 'square'")
        if cross_section == "square" and half_size is None:
            raise InvalidValueError("cross_section is 'square' for a disc, expected 'circle'")
        most = 0.25 * np.pi if cross_section == "square" else 0.5 * np.pi
        if not 0.0 < float(checked("tilt", tilt, ())) <= most:
            raise InvalidValueError(f"tilt is {tilt}, expected a number above 0 and at most {most:.6g}")
        extent = extents[0]
        if not (extent > 0.0).all():
            raise InvalidValueError(f"{'half_size' if radius is None else 'radius'} is {extent}, expected more than 0")
        self.tilt = float(tilt)
        self.cross_section = cross_section
        self.frame = np.eye(4) if frame is None else checked_pose("frame", frame)
        self.pointing = pointing
        # A circle has one length for both directions.
        self._extent = np.atleast_1d(np.linalg.norm(extent) if cross_section == "circle" else extent)

    def __repr__(self) -> str:
        return f"SurfaceRule({np.degrees(self.tilt):.4g} deg, {self.cross_section!r}, pointing={self.pointing!r})"

    def rotation(self, position: ArrayLike, rotation: ArrayLike) -> F64:
        """Return the orientations of the tool at points of the surface.

        Parameters
        ----------
        position : array_like, shape (3,) or (N, 3)
            Tool points in the base frame [m].
        rotation : array_like, shape (3, 3) or (N, 3, 3)
            Orientations of the tool by the path, its axis against the surface's normal.

        Returns
        -------
        ndarray, shape (3, 3) or (N, 3, 3)
            Orientations in the base frame: members of the cone or the square about those of the path.

        Raises
        ------
        ShapeError, NonFiniteError
            If an array has the wrong shape or holds NaN or infinities.
        InvalidValueError
            If the tool's axis on the path is not against the surface's normal, to 1e-6 rad, or the pointing rule has no
            spin for it.
        """
        points, frames, single = _points_and_frames(position, rotation)
        normal = self.frame[:3, 2]
        off = np.linalg.norm(frames[:, :, 2] + normal, axis=1)
        if (off > UPRIGHT).any():
            k = int(np.argmax(off > UPRIGHT))
            raise InvalidValueError(
                f"rotation[{k}] has the tool's axis {frames[k, :, 2].tolist()}, expected {(-normal).tolist()}, against "
                "the normal of the surface"
            )
        place = (points - self.frame[:3, 3]) @ self.frame[:3, :2] / self._extent
        beyond = np.linalg.norm(place, axis=1, keepdims=True) if self.cross_section == "circle" else np.abs(place)
        lean = np.sin(self.tilt) * place / np.maximum(beyond, 1.0)
        down = np.sqrt(1.0 - (lean**2).sum(axis=1, keepdims=True))
        axis = lean @ self.frame[:3, :2].T - down * normal
        tilted = turns(*between(frames[:, :, 2], axis)) @ frames
        if self.pointing is not None:
            # The azimuth is that of the place; which way up the tool is does not change in a tilt.
            tilted = tilted @ _about_z(self.pointing.spin(points, frames))
        return tilted[0] if single else tilted


def _points_and_frames(position: ArrayLike, rotation: ArrayLike) -> tuple[F64, F64, bool]:
    """Return tool points (N, 3), orientations (N, 3, 3), and whether a single point was given."""
    single = np.ndim(position) == 1
    points = checked("position", position, (3,) if single else (None, 3)).reshape(-1, 3)
    if np.ndim(rotation) == 2:
        frames = np.broadcast_to(checked("rotation", rotation, (3, 3)), (len(points), 3, 3))
    elif single:
        raise ShapeError(f"rotation: got shape {np.shape(rotation)}, expected (3, 3)")
    else:
        frames = checked("rotation", rotation, (len(points), 3, 3))
    return points, frames, single


def _about_z(angle: F64) -> F64:
    return turns(np.array([0.0, 0.0, 1.0]), angle)
