"""A path as a whole: plans and redundancy maps."""

from .._core import PlanFailure, PlanSettings
from .map import Predicate, RedundancyMap, redundancy_map
from .numbers import core_path
from .plan import plan, plan_by
from .result import Plan, Way
from .speed import Fastest, fastest
from .tolerance import tilt_and_spin, tilted
from .transfer import Transfer

__all__ = [
    "Fastest",
    "Plan",
    "PlanFailure",
    "PlanSettings",
    "Predicate",
    "RedundancyMap",
    "Transfer",
    "Way",
    "core_path",
    "fastest",
    "plan",
    "plan_by",
    "redundancy_map",
    "tilt_and_spin",
    "tilted",
]
