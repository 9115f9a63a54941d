"""Reading of TOML files by people: every fault is named with its file, its key and what was expected."""

import re
import tomllib
from collections.abc import Callable
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from .._util import F64
from .text import Fault, read_text

_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


def parse_toml(file: Path, fail: Fault) -> dict[str, Any]:
    """Parse a TOML file.

    Parameters
    ----------
    file : Path
        The file.
    fail : callable
        Makes the exception for a malformed file from message, line and column.

    Returns
    -------
    dict
        Its content.

    Raises
    ------
    OSError
        If it cannot be opened.
    """
    text = read_text(file, fail)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        message = str(error)
        place = _PLACE.search(message)
        # "at end of document" comes without figures.
        lines = text.split("\n")
        line, column = (int(place[1]), int(place[2])) if place and place[1] else (len(lines), len(lines[-1]) + 1)
        raise fail(_PLACE.sub("", message), line, column) from None
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, brackets thousands deep
        raise fail(str(error), 1, 1) from None


class Table:
    """A TOML table whose entries are checked as they are read.

    Parameters
    ----------
    data : dict
        The table.
    fail : callable
        Makes the exception from a message, which names the key and what was expected.
    path : str
        Dotted key of the table, empty for the document.
    """

    def __init__(self, data: dict[str, Any], fail: Callable[[str], Exception], path: str = "") -> None:
        self.data = data
        self.fail = fail
        self.path = path

    def __contains__(self, key: str) -> bool:
        return key in self.data

    def error(self, key: str, expected: str) -> Exception:
        """Make the exception for a missing or wrong entry."""
        where = f"{self.path}.{key}" if self.path else key
        got = f"{self.data[key]!r}" if key in self.data else "nothing"
        return self.fail(f"{where}: got {got if len(got) < 80 else got[:76] + ' ...'}, expected {expected}")

    def only(self, *known: str) -> None:
        """Refuse keys that are not known, with the nearest that is."""
        for key in self.data:
            if key not in known:
                near = get_close_matches(key, known, n=1)
                hint = f"did you mean {near[0]}?" if near else f"known keys: {', '.join(known)}"
                where = f"{self.path}.{key}" if self.path else key
                raise self.fail(f"{where}: unknown key; {hint}")

    def table(self, key: str) -> "Table":
        """Read a sub-table; an absent one is empty."""
        value = self.data.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, "a table")
        return Table(value, self.fail, f"{self.path}.{key}" if self.path else key)

    def tables(self, key: str) -> "list[Table]":
        """Read an array of tables; an absent one is empty."""
        value = self.data.get(key, [])
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            raise self.error(key, "an array of tables")
        path = f"{self.path}.{key}" if self.path else key
        return [Table(entry, self.fail, f"{path}[{i}]") for i, entry in enumerate(value)]

    def texts(self, key: str) -> list[str]:
        """Read an array of strings."""
        value = self.data.get(key)
        if not isinstance(value, list) or not all(isinstance(entry, str) for entry in value):
            raise self.error(key, "an array of strings")
        return value

    def text(self, key: str, default: str | None = None, choices: tuple[str, ...] = ()) -> str:
        """Read a string, one of ``choices`` if these are given."""
        value = self.data.get(key, default)
        # A NUL would pass for text until it reached a file name.
        if not isinstance(value, str) or "\0" in value or (choices and value not in choices):
            raise self.error(key, " or ".join(f'"{choice}"' for choice in choices) or "a string")
        return value

    def flag(self, key: str, default: bool) -> bool:
        """Read a truth value."""
        value = self.data.get(key, default)
        if not isinstance(value, bool):
            raise self.error(key, "true or false")
        return value

    def integer(self, key: str, default: int | None = None, least: int = 0) -> int:
        """Read an integer of at least ``least``."""
        value = self.data.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool) or value < least:
            raise self.error(key, f"an integer of at least {least}")
        return value

    def number(self, key: str, default: float | None = None) -> float:
        """Read a finite number."""
        value = self.data.get(key, default)
        if not _is_number(value) or not isfinite(value):
            raise self.error(key, "a finite number")
        return float(value)

    def array(self, key: str, shape: tuple[int, ...], infinite: bool = False) -> F64:
        """Read an array of numbers of a given shape, finite unless ``infinite`` allows infinities."""
        expected = f"{' x '.join(map(str, shape))} {'' if infinite else 'finite '}numbers"
        try:
            array = np.array(self.data.get(key), dtype=object)
        except ValueError:
            raise self.error(key, expected) from None
        if array.shape != shape or not all(_is_number(entry) for entry in array.flat):
            raise self.error(key, expected)
        numbers = array.astype(np.float64)
        if np.isnan(numbers).any() or not (infinite or np.isfinite(numbers).all()):
            raise self.error(key, expected)
        return numbers

    def length(self, key: str) -> float | None:
        """Read a length [m] from its key, or in millimetres from ``key_mm``; None if there is neither."""
        return self.either(key, f"{key}_mm", lambda millimetres: millimetres / 1000.0)

    def angle(self, key: str) -> float | None:
        """Read an angle [rad] from its key, or in degrees from ``key_deg``; None if there is neither."""
        return self.either(key, f"{key}_deg", lambda degrees: float(np.deg2rad(degrees)))

    def either(self, key: str, other: str, convert: Callable[[float], float]) -> float | None:
        """Read a number from its key in SI units, or from another one in its unit; None if there is neither."""
        if key in self and other in self:
            raise self.error(other, f"only one of {key} and {other}")
        if key in self:
            return self.number(key)
        return convert(self.number(other)) if other in self else None


def _is_number(value: object) -> TypeGuard[int | float]:
    # TOML integers know no bound, 64-bit floats do.
    return isinstance(value, float) or (isinstance(value, int) and type(value) is not bool and abs(value) < 2**1000)
