"""Writing of files that are either whole or not there."""

import os
import secrets
from pathlib import Path


def write_atomically(file: str | Path, text: str) -> None:
    """Write a file through a temporary one beside it, so that a reader never sees half of it.

    Parameters
    ----------
    file : path-like
        Its folder has to exist.
    text : str
        Written as UTF-8, newlines as they are.

    Raises
    ------
    OSError
        If the folder cannot be written to; the file is then what it was before.
    """
    target = Path(file)
    temporary = target.with_name(f".{target.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("x", encoding="utf-8", newline="") as stream:
            stream.write(text)
        os.replace(temporary, target)
    except OSError as error:
        # The caller knows nothing of the temporary name.
        raise OSError(error.errno, error.strerror, str(target)) from None
    finally:
        temporary.unlink(missing_ok=True)
