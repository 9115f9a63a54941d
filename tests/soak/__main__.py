"""The soaks: `python -m tests.soak` runs all of them, `python -m tests.soak inverse [options]` one."""

import sys
from collections.abc import Callable

from tests.reference.condition import __main__ as condition
from tests.soak import (
    descent,
    frames,
    inverse,
    one_joint,
    plans,
    poses,
    projectors,
    qp,
    rest,
    urdf,
    volume_plans,
    volume_ticks,
    volumes,
)

SOAKS: dict[str, Callable[[list[str]], int]] = {
    "inverse": inverse.main,
    "descent": descent.main,
    "frames": frames.main,
    "one_joint": one_joint.main,
    "plans": plans.main,
    "poses": poses.main,
    "projectors": projectors.main,
    "qp": qp.main,
    "rest": rest.main,
    "urdf": urdf.main,
    "volumes": volumes.main,
    "volume_plans": volume_plans.main,
    "volume_ticks": volume_ticks.main,
    "condition": lambda arguments: condition.main(["--check", *arguments]),
}


def main(arguments: list[str]) -> int:
    """Run the soak that is named first, with the options that follow, or all; return 1 if a bar was missed."""
    if not arguments:
        return max(run([]) for run in SOAKS.values())
    name, *options = arguments
    if name not in SOAKS:
        sys.stderr.write(f"no soak {name}: {', '.join(SOAKS)}\n")
        return 2
    return SOAKS[name](options)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
