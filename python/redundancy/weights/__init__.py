"""Weights of posture pulls that tune themselves, after W. Huo's thesis of 2009, chapters 5 and 6.

`self_adapt` finds weights that stay the same along a path, `dynamic_adapt` weights that vary from point to point.
"""

from .criteria import Criteria, Failure
from .displacements import Displacements, displacements
from .dynamic_adaptation import DynamicAdaptation, Round, dynamic_adapt
from .dynamic_weights import WeightFunctions
from .performance import Performance, better, improvement, limit_distances
from .search import SearchResult, SearchStep, direct_search
from .self_adaptation import WeightRecord, WeightSearch, self_adapt
from .sensitivity import Sensitivity, axis_cosines, sensitivity

__all__ = [
    "Criteria",
    "Displacements",
    "DynamicAdaptation",
    "Failure",
    "Performance",
    "Round",
    "SearchResult",
    "SearchStep",
    "Sensitivity",
    "WeightFunctions",
    "WeightRecord",
    "WeightSearch",
    "axis_cosines",
    "better",
    "direct_search",
    "displacements",
    "dynamic_adapt",
    "improvement",
    "limit_distances",
    "self_adapt",
    "sensitivity",
]
