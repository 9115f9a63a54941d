"""Weights as functions of the posture (Huo 2009, section 6.2.3, equations 6.1 to 6.14)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .._util import F64, checked
from ..errors import InvalidValueError
from .sensitivity import WRIST
from .setting import DEFAULT_WEIGHT

SMALLEST_DISTANCE = 0.01
"""Distances to a limit (6.1) below this share of the range count as this much: at 0, (6.9) would be infinite."""


@dataclass(frozen=True)
class WeightFunctions:
    """The functions a, b, f and g of (6.9) to (6.12), put together as w = a + c_joint f and k = b + c_sing g.

    Parameters
    ----------
    q : float
        Size of a [rad], at least 0.
    m : float
        Size of b, at least 0.
    l, s : float
        Sizes of f and g, at least 0.
    beta_threshold : float
        Angle beta_th between joint and tool beyond which a weight stays 0.01 [rad], above 0, at most pi/2. The thesis
        prints no number. Below pi/2 the weights jump where a joint passes it, k from 0 to 0.01; at pi/2 they do not, as
        a joint perpendicular to the tool spins nothing whatever its weight.

    Raises
    ------
    InvalidValueError
        If a parameter is outside its domain.
    """

    q: float = 0.01
    m: float = 0.25
    l: float = 1.0  # noqa: E741 - the name in (6.11)
    s: float = 1.0
    beta_threshold: float = 0.5 * np.pi

    def __post_init__(self) -> None:
        for name in ("q", "m", "l", "s"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise InvalidValueError(f"{name} is {value}, expected a finite number of at least 0")
        if not 0.0 < self.beta_threshold <= 0.5 * np.pi:
            raise InvalidValueError(f"beta_threshold is {self.beta_threshold}, expected an angle above 0, at most pi/2")

    def weights(
        self,
        cosines: ArrayLike,
        limit_distances: ArrayLike,
        manipulability: float,
        c_joint: float = 0.0,
        c_sing: float = 0.0,
    ) -> tuple[F64, F64]:
        """Return the weights at a posture.

        Parameters
        ----------
        cosines : array_like, shape (n,)
            |e_i . e_t|, see `axis_cosines`.
        limit_distances : array_like, shape (n,)
            Distances beyond the limits, see `limit_distances`: negative within; -inf (none) counts as -0.5.
        manipulability : float
            Manipulability with length 1, at least 0.
        c_joint, c_sing : float
            Damping scalars (6.7), (6.8).

        Returns
        -------
        w, k : ndarray, shape (n,)
            0.01 for all but the last three joints. Never negative: where a negative damping scalar would make one so,
            it is 0, as the pull would become a push. With m = 0.25 and s = 1 the printed c_sing = -0.5 is such a one.

        Raises
        ------
        ShapeError, NonFiniteError
            If an array has the wrong shape or holds a number that it must not.
        InvalidValueError
            If the manipulability is negative or NaN.

        Notes
        -----
        The distances of (6.1) are taken as absolute, as (6.9) and (6.11) need them, and 0 beyond a limit. Where a joint
        before the last three is nearer to its limit than one of these, its distance stands for that one's: (6.4) and
        (6.5), without the jump that they make where it becomes the nearest of all.
        """
        cosine = checked("cosines", cosines, (None,))
        beyond = checked("limit_distances", np.maximum(limit_distances, -0.5), (len(cosine),))
        if not manipulability >= 0.0:
            raise InvalidValueError(f"manipulability is {manipulability}, expected at least 0")
        wrist = slice(len(cosine) - WRIST, None)
        delta = np.maximum(-beyond, SMALLEST_DISTANCE)
        delta = np.minimum(delta, delta[: wrist.start].min(initial=np.inf))
        ratio = (np.arccos(np.minimum(cosine, 1.0)) / self.beta_threshold) ** 2
        away = np.exp(-2.0 * manipulability)
        a = self.q * (2.0 - ratio) / (2.0 * delta)
        b = self.m * (1.0 - ratio) * away
        f = self.l * (1.0 - ratio) * np.exp(-2.0 * delta)
        g = self.s * (1.0 - ratio) * away
        w, k = np.full((2, len(cosine)), DEFAULT_WEIGHT)
        # A rounding of pi/2 counts as pi/2.
        active = ratio[wrist] <= 1.0 + 1e-12
        w[wrist] = np.where(active, (a + c_joint * f)[wrist], DEFAULT_WEIGHT)
        k[wrist] = np.where(active, (b + c_sing * g)[wrist], DEFAULT_WEIGHT)
        return np.maximum(w, 0.0), np.maximum(k, 0.0)
