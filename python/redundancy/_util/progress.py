"""Progress on the terminal, for work that takes longer than a second."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic

PATIENCE = 1.0
"""Seconds after which a bar is worth showing."""


@contextmanager
def progress_bar(total: float, label: str, show: bool = True) -> Iterator[Callable[[float], None]]:
    """Show a progress bar on stderr, once the work has taken a second; never when stderr is not a terminal.

    Parameters
    ----------
    total : float
        Steps altogether; 1 where shares of the work are told.
    label : str
        What is being done.
    show : bool
        False for no bar at all.

    Yields
    ------
    callable
        To be called with the number of steps, or the share of the work, done since the last call.
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

    def advance(steps: float) -> None:
        bar.advance(task, steps)
        if not bar.live.is_started and monotonic() - start > PATIENCE:
            bar.start()

    try:
        yield advance
    finally:
        bar.stop()
