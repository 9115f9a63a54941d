"""Exceptions of the package: what a caller can do wrong.

A numerical outcome (an unreachable target, a singular posture) is no exception: it is a status beside the best result.
"""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path


class RedundancyError(Exception):
    """Base class of every exception that this package raises on purpose."""


class ShapeError(RedundancyError, ValueError):
    """An array has the wrong shape."""


class NonFiniteError(RedundancyError, ValueError):
    """A number is NaN or infinite where a finite one is needed."""


class InvalidValueError(RedundancyError, ValueError):
    """A value is outside its domain, or a job file asks for something that does not exist."""


class ModelError(RedundancyError, ValueError):
    """A robot file is malformed, or the model in it is inconsistent."""


class ToolpathError(RedundancyError, ValueError):
    """A toolpath or job file cannot be read.

    Parameters
    ----------
    message : str
        What is wrong and what was expected.
    file : path-like, optional
        The file; the error reads ``file:line:column: message``, as far as these are known.
    line, column : int, optional
        Where, both counted from 1.
    """

    def __init__(
        self, message: str, file: str | Path | None = None, line: int | None = None, column: int | None = None
    ) -> None:
        place = ":".join(str(part) for part in (file, line, column) if part is not None)
        super().__init__(f"{place}: {message}" if place else message)
        self.file = file
        self.line = line
        self.column = column


class UnknownRobotError(RedundancyError, KeyError):
    """There is no packaged robot of this name.

    Parameters
    ----------
    name : str
        The name asked for.
    known : iterable of str
        The names that exist.
    """

    def __init__(self, name: str, known: Iterable[str] = ()) -> None:
        self.name = name
        self.known = tuple(known)
        # Both arguments, so that the exception survives pickling.
        super().__init__(name, self.known)

    def __str__(self) -> str:
        # KeyError would show the repr of its arguments.
        nearest = get_close_matches(self.name.lower(), self.known, n=1, cutoff=0.4)
        hint = f"did you mean {nearest[0]!r}?" if nearest else f"known robots: {', '.join(self.known)}"
        return f"unknown robot {self.name!r}; {hint}"
