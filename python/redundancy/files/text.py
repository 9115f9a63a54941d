"""Text and JSON from files, every fault with its place."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

from ..errors import ToolpathError

Fault: TypeAlias = Callable[[str, int | None, int | None], Exception]
"""Makes the exception for a malformed file from message, line and column."""


def fault_in(file: Path) -> Fault:
    """Return what makes the exceptions for a malformed toolpath, trajectory or job file."""
    return lambda message, line, column: ToolpathError(message, file, line, column)


def read_text(file: Path, fault: Fault, encoding: str = "utf-8") -> str:
    """Read a file of UTF-8 text.

    Parameters
    ----------
    file : Path
        The file.
    fault : callable
        Makes the exception for what is no text from message, line and column.
    encoding : str
        "utf-8-sig" where a byte order mark may come first.

    Raises
    ------
    OSError
        If it cannot be opened.
    """
    data = file.read_bytes()
    try:
        return data.decode(encoding)
    except UnicodeDecodeError as error:
        before = data[: error.start]
        column = error.start - before.rfind(b"\n")
        raise fault("not UTF-8 text", before.count(b"\n") + 1, column) from None


def parse_json(text: str, fault: Fault) -> Any:  # noqa: ANN401  (whatever stands in the file)
    """Parse JSON; the fault of malformed text has its line and column."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise fault(error.msg, error.lineno, error.colno) from None
    except (ValueError, RecursionError) as error:  # a number of thousands of digits, brackets thousands deep
        raise fault(str(error), None, None) from None
