"""How Newton's method and BFGS go to the posture of Table 4-2, evaluation by evaluation."""

from itertools import zip_longest
from typing import Literal

import redundancy as rd

from evidence import pages
from evidence.leger.cases import FANUC, START, START_LENGTH, bound

METHODS: tuple[Literal["newton", "bfgs"], ...] = ("newton", "bfgs")


def history(method: Literal["newton", "bfgs"], eliminate: bool) -> rd.Convergence:
    """Return the way of a method from (4.3), (4.4), the length in closed form or one more variable."""
    return rd.minimum_condition_posture(FANUC, START, length0=START_LENGTH, method=method, eliminate=eliminate).history


def convergence() -> str:
    """Return kappa_F and the gradient of its square after every evaluation, as a Markdown table."""
    found = [history(method, eliminate=True) for method in METHODS]
    least = min(way.condition_number[-1] for way in found)
    columns = []
    for way in found:
        above = [bound(value - least, digits=1) for value in way.condition_number]
        slope = [bound(value, digits=1) for value in way.gradient]
        columns.append([*zip(map(int, way.evaluations), above, slope, strict=True)])
    head = (
        "evaluations, Newton",
        "kappa_F above the least",
        "gradient",
        "evaluations, BFGS",
        "kappa_F above",
        "gradient",
    )
    nothing = ("", "", "")
    return pages.table(head, [(*left, *right) for left, right in zip_longest(*columns, fillvalue=nothing)])
