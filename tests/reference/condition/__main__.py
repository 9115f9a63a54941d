"""The command line of the reference.

``python -m tests.reference.condition`` with ``--check``, ``--oracle tests/data/condition_number.json`` or
``--write tests/data/condition_random.npz``.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

from tests.reference.condition.checks import check, oracle_check
from tests.reference.condition.file import CASES, write


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments : sequence of str, optional
        Command-line arguments, by default those of the process.

    Returns
    -------
    int
        Exit status, 1 if a check failed.
    """
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--write", type=Path, metavar="NPZ", help="regenerate the data file")
    parser.add_argument("--count", type=int, default=CASES, help="number of postures to write")
    parser.add_argument("--workers", type=int, default=2, help="number of processes")
    parser.add_argument("--check", action="store_true", help="compare with central differences")
    parser.add_argument("--oracle", type=Path, metavar="JSON", help="compare with oracle cases")
    options = parser.parse_args(arguments)
    failed = False
    if options.check:
        worst = check()
        print(f"central differences: worst deviation {worst:.1e}")
        failed |= worst > 1e-15
    if options.oracle is not None:
        rows = oracle_check(options.oracle)
        for name, *deviations in rows:
            print(name, " ".join(f"{value:.1e}" for value in deviations))
        worst = max(max(deviations[:3]) for _, *deviations in rows)
        print(f"oracle: worst deviation {worst:.1e} of the largest entry")
        failed |= worst > 1e-12
    if options.write is not None:
        write(options.write, options.count, options.workers)
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())
