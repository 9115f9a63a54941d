"""How large the compiled core is: `python -m evidence.machine_code`, a step of `make lint`.

What is compiled costs twice: minutes of everybody's first build, and misses of
the instruction cache in every cold tick.
"""

import sys
from pathlib import Path
from typing import Final

from redundancy import _core

LARGEST: Final = 7_300_000
"""Bytes of the stripped module at most."""


def main() -> int:
    """Print the size of the module that is installed; 1 if it is too large."""
    file = Path(_core.__file__)
    size = file.stat().st_size
    print(f"{file.name}: {size / 1e6:.2f} MB, at most {LARGEST / 1e6:.2f}")
    return int(size > LARGEST)


if __name__ == "__main__":
    sys.exit(main())
