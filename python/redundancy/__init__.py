"""Resolve the redundancy of serial robots: exact condition-number derivatives, free tool spin, whole toolpaths.

SI units and radians everywhere. Twists are [omega; v], angular part first, at the tool point, in the base frame; so are
the rows of every Jacobian.

Examples
--------
>>> import redundancy as rd
>>> robot = rd.robots.get("fanuc_m710ic50_milling")
>>> best = rd.minimum_condition_posture(robot, starts=8)
>>> round(best.condition_number, 6)
1.041202
"""

from . import plots, robots, weights
from ._core import (
    Body,
    ConditionNumber,
    CustomIndex,
    Elimination,
    GradientProjection,
    Householder,
    JointLimits,
    LimitBarrier,
    Manipulability,
    Objective,
    OrthogonalSQP,
    PosturePull,
    Proximity,
    QuadraticProgram,
    RateSolver,
    ResolvedRate,
    Robot,
    Scene,
    Shape,
    SingularityParameter,
    SmallestSingularValue,
    Task,
    TaskPriority,
    TwistDecomposition,
    VirtualJoint,
    WeightedInverse,
    __version__,
    bodies_from_urdf,
    build_profile,
    capsules_along_links,
    rms_length,
    self_collision_pairs,
    solve_qp,
)
from .design import (
    Convergence,
    PlanarTetrahedron,
    PostureResult,
    characteristic_length,
    minimum_condition_posture,
    planar_tetrahedron,
)
from .errors import (
    InvalidValueError,
    ModelError,
    NonFiniteError,
    RedundancyError,
    ShapeError,
    ToolpathError,
    UnknownRobotError,
)
from .loops import (
    CyclicStart,
    StartSearch,
    Tracking,
    best_start,
    cyclic_start,
    follow,
    stiffness_profile,
    track,
)
from .paths import Toolpath, Trajectory
from .planning import Plan, PlanFailure, RedundancyMap, plan, redundancy_map
from .robots import on_rail, with_turntable

__all__ = [
    "Body",
    "ConditionNumber",
    "Convergence",
    "CustomIndex",
    "CyclicStart",
    "Elimination",
    "GradientProjection",
    "Householder",
    "InvalidValueError",
    "JointLimits",
    "LimitBarrier",
    "Manipulability",
    "ModelError",
    "NonFiniteError",
    "Objective",
    "OrthogonalSQP",
    "Plan",
    "PlanFailure",
    "PlanarTetrahedron",
    "PosturePull",
    "PostureResult",
    "Proximity",
    "QuadraticProgram",
    "RateSolver",
    "RedundancyError",
    "RedundancyMap",
    "ResolvedRate",
    "Robot",
    "Scene",
    "Shape",
    "ShapeError",
    "SingularityParameter",
    "SmallestSingularValue",
    "StartSearch",
    "Task",
    "TaskPriority",
    "Toolpath",
    "ToolpathError",
    "Tracking",
    "Trajectory",
    "TwistDecomposition",
    "UnknownRobotError",
    "VirtualJoint",
    "WeightedInverse",
    "__version__",
    "best_start",
    "bodies_from_urdf",
    "build_profile",
    "capsules_along_links",
    "characteristic_length",
    "cyclic_start",
    "follow",
    "minimum_condition_posture",
    "on_rail",
    "plan",
    "planar_tetrahedron",
    "plots",
    "redundancy_map",
    "rms_length",
    "robots",
    "self_collision_pairs",
    "solve_qp",
    "stiffness_profile",
    "track",
    "weights",
    "with_turntable",
]
