"""The options that soaks of many random frames share."""

import argparse


def scaled(title: str, what: str, arguments: list[str] | None) -> argparse.Namespace:
    """Read ``--scale`` and ``--seed``; `what` is drawn, and `title` says what for."""
    parser = argparse.ArgumentParser(description=title)
    parser.add_argument("--scale", type=float, default=1.0, help=f"share of the {what}, 1 for the full bars")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    return parser.parse_args(arguments)
