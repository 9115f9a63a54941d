"""Writing of files that are either whole or not there."""

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory


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


@contextmanager
def whole_files(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """Write files that replace those of a folder at the end, all or none.

    Parameters
    ----------
    folder : Path
        Made if it is not there.

    Yields
    ------
    Path
        Where to write them.
    list of str
        Their names, at the end.

    Raises
    ------
    OSError
        If the folder cannot be written to.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names: list[str] = []
    # All is made in a folder of its own first: an error on the way leaves the old files as they were.
    with TemporaryDirectory(dir=folder, prefix=".redundancy-") as temporary:
        yield Path(temporary), names
        names += sorted(os.listdir(temporary))
        for name in names:
            os.replace(Path(temporary, name), folder / name)
