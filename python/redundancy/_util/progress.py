"""Progress on the terminal, for work that takes longer than a second."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

PATIENCE = 1.0
"""Seconds after which a bar is worth showing."""


@contextmanager
def progress_bar(total: int, label: str, show: bool = True) -> Iterator[Callable[[int], None]]:
    """Show a progress bar on stderr, once the work has taken a second; never when stderr is not a terminal.

    Parameters
    ----------
    total : int
        Steps altogether.
    label : str
        What is being done.
    show : bool
        False for no bar at all.

    Yields
    ------
    callable
        To be called with the number of steps done since the last call.
    """
    if not (show and sys.stderr.isatty()):
        yield lambda steps: None
        return
    # Imported late: whoever needs no bar does not pay for it.
    from rich.console import Console
    from rich.progress import Progress

    bar = Progress(console=Console(stderr=True), transient=True)
    task = bar.add_task(label, total=total)
    start = monotonic()

    def advance(steps: int) -> None:
        bar.advance(task, steps)
        if not bar.live.is_started and monotonic() - start > PATIENCE:
            bar.start()

    try:
        yield advance
    finally:
        bar.stop()
