"""Checks of the arrays that a caller hands in."""

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InvalidValueError, NonFiniteError, ShapeError

F64: TypeAlias = NDArray[np.float64]


def checked(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> F64:
    """Copy an array-like into a finite float64 array of a given shape.

    Parameters
    ----------
    name : str
        Name for the error message.
    value : array_like
        The numbers.
    shape : tuple
        Sizes; None stands for any.

    Returns
    -------
    ndarray
        C-contiguous and read-only.

    Raises
    ------
    InvalidValueError
        If these are no real numbers.
    ShapeError
        If the shape is another.
    NonFiniteError
        If a number is NaN or infinite.
    """
    try:
        given = np.asarray(value)
        if given.dtype.kind == "c":  # numpy would only warn while it drops the imaginary part
            raise TypeError
        array = np.array(given, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InvalidValueError(f"{name} is no array of real numbers") from None
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        expected = ", ".join("N" if size is None else str(size) for size in shape)
        raise ShapeError(f"{name}: got shape {array.shape}, expected ({expected}{',' if len(shape) == 1 else ''})")
    if not np.isfinite(array).all():
        index = [int(i) for i in np.argwhere(~np.isfinite(array))[0]]
        raise NonFiniteError(f"{name}{index or ''} is {array[tuple(index)]}, expected a finite number")
    array.setflags(write=False)
    return array
