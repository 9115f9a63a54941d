"""Types of the compiled core. Shapes are in the docstrings of the classes themselves."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
from typing_extensions import disjoint_base

_F64: TypeAlias = NDArray[np.float64]
_IndexCallable: TypeAlias = Callable[[_F64], Any]

__all__ = [
    "Body",
    "ConditionNumber",
    "Constraint",
    "Controller",
    "CoordinateDescent",
    "CustomIndex",
    "DescentResult",
    "DescentTrace",
    "Elimination",
    "FrameTask",
    "GradientProjection",
    "Householder",
    "JointLimits",
    "Lattice",
    "LimitBarrier",
    "Manipulability",
    "NearestOrientation",
    "Objective",
    "OneJointMinimum",
    "OrientationVolume",
    "OrthogonalSQP",
    "PathData",
    "PathSolution",
    "PathTransfer",
    "PlanFailure",
    "PlanSettings",
    "PlannedPath",
    "PosturePull",
    "PostureTask",
    "Proximity",
    "QPSolution",
    "QuadraticProgram",
    "RateSolver",
    "ResolvedRate",
    "Robot",
    "Scene",
    "Shape",
    "Singularity",
    "SingularityParameter",
    "SmallestSingularValue",
    "Solution",
    "SolveHistory",
    "Task",
    "TaskPriority",
    "TwistDecomposition",
    "VirtualJoint",
    "WeightedInverse",
    "__version__",
    "angle_grid",
    "bodies_from_urdf",
    "build_profile",
    "capsules_along_links",
    "characteristic_length",
    "minimum_condition_posture",
    "one_joint_minimum",
    "perpendicular",
    "plan_path",
    "planar_tetrahedron",
    "quaternion_about",
    "quaternion_angle",
    "quaternion_axis_angle",
    "quaternion_conjugate",
    "quaternion_from_matrix",
    "quaternion_matrix",
    "quaternion_product",
    "quaternion_rotate",
    "rms_length",
    "self_collision_pairs",
    "solve_qp",
    "spare_grid",
    "transport",
]

__version__: str
build_profile: str

class Solution(NamedTuple):
    q: _F64
    value: float
    status: str
    iterations: int

class PathSolution(NamedTuple):
    q: _F64
    value: _F64
    position_error: _F64
    axis_error: _F64
    status: list[str]
    iterations: int

class Constraint(NamedTuple):
    h: _F64
    jacobian: _F64
    null: _F64

class SolveHistory(NamedTuple):
    q: _F64
    value: _F64
    gradient: _F64
    step: _F64
    evaluations: NDArray[np.int64]

class QPSolution(NamedTuple):
    x: _F64
    status: str
    bound_multipliers: _F64
    row_multipliers: _F64
    changes: int

class Singularity(NamedTuple):
    kind: str
    value: float
    twist: _F64 | None
    joints: _F64 | None

class OneJointMinimum(NamedTuple):
    change: float
    value: float

class DescentTrace(NamedTuple):
    cost: _F64
    q: _F64
    picks: NDArray[np.int64]

class DescentResult(NamedTuple):
    q: _F64
    status: str
    position_error: float
    orientation_error: float
    iterations: int
    cost: float
    costs: _F64

class NearestOrientation(NamedTuple):
    orientation: _F64
    distance: Any
    unique: Any

@final
class Controller:
    @property
    def matrix(self) -> _F64: ...
    @property
    def offset(self) -> _F64: ...
    @property
    def names(self) -> list[str]: ...
    def from_robot(self, q: ArrayLike) -> _F64: ...
    def to_robot(self, p: ArrayLike) -> _F64: ...
    def rates_from_robot(self, qd: ArrayLike) -> _F64: ...
    def rates_to_robot(self, pd: ArrayLike) -> _F64: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class Robot:
    @staticmethod
    def from_dh(
        a: ArrayLike,
        d: ArrayLike,
        alpha: ArrayLike,
        theta: ArrayLike,
        joints: str | None = None,
        convention: Literal["standard", "modified"] = "standard",
        tool: ArrayLike | None = None,
        base: ArrayLike | None = None,
        q_min: ArrayLike | None = None,
        q_max: ArrayLike | None = None,
        qd_max: ArrayLike | None = None,
        qdd_max: ArrayLike | None = None,
        name: str = "robot",
        coupled: Iterable[tuple[dict[int, float], float, float]] | None = None,
        joint_names: Sequence[str] | None = None,
        mimic: Mapping[int, tuple[int, float, float]] | None = None,
    ) -> Robot: ...
    @staticmethod
    def from_urdf(
        path: str | Path,
        base: str | None = None,
        tip: str | None = None,
        tool: ArrayLike | None = None,
        limits: Mapping[str, Any] | None = None,
    ) -> Robot: ...
    @staticmethod
    def from_links(
        links: ArrayLike,
        flange: ArrayLike,
        joints: str,
        tool: ArrayLike | None = None,
        base: ArrayLike | None = None,
        q_min: ArrayLike | None = None,
        q_max: ArrayLike | None = None,
        qd_max: ArrayLike | None = None,
        qdd_max: ArrayLike | None = None,
        name: str = "robot",
        coupled: Iterable[tuple[dict[int, float], float, float]] | None = None,
        joint_names: Sequence[str] | None = None,
        mimic: Mapping[int, tuple[int, float, float]] | None = None,
    ) -> Robot: ...
    @property
    def n(self) -> int: ...
    @property
    def name(self) -> str: ...
    @property
    def joints(self) -> str: ...
    @property
    def joint_names(self) -> tuple[str, ...]: ...
    def joint_label(self, joint: int) -> str: ...
    @property
    def chain(self) -> str: ...
    @property
    def mimic(self) -> dict[int, tuple[int, float, float]]: ...
    @property
    def coordinates(self) -> list[int]: ...
    @property
    def periodic(self) -> NDArray[np.bool_]: ...
    @property
    def controller(self) -> Controller: ...
    def with_controller(
        self,
        matrix: ArrayLike | None = None,
        offset: ArrayLike | None = None,
        signs: ArrayLike | None = None,
        coupling: Mapping[tuple[int, int], float] | None = None,
        names: Sequence[str] | None = None,
    ) -> Robot: ...
    @property
    def q_min(self) -> _F64: ...
    @property
    def q_max(self) -> _F64: ...
    @property
    def qd_max(self) -> _F64: ...
    @property
    def qdd_max(self) -> _F64: ...
    @property
    def tool(self) -> _F64: ...
    @property
    def base(self) -> _F64: ...
    @property
    def flange(self) -> _F64: ...
    @property
    def links(self) -> _F64: ...
    @property
    def dh(self) -> dict[str, Any] | None: ...
    def fk(self, q: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def jacobian(self, q: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def jacobian_derivative(self, q: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def jacobian_second_derivative(self, q: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def jacobian_rate(self, q: ArrayLike, qd: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def link_frames(self, q: ArrayLike) -> _F64: ...
    def with_tool(self, tool: ArrayLike) -> Robot: ...
    def with_base(self, base: ArrayLike) -> Robot: ...
    def with_limits(
        self,
        q_min: ArrayLike | None = None,
        q_max: ArrayLike | None = None,
        qd_max: ArrayLike | None = None,
        qdd_max: ArrayLike | None = None,
        coupled: Iterable[tuple[dict[int, float], float, float]] | None = None,
    ) -> Robot: ...
    @property
    def coupled_limits(self) -> list[tuple[dict[int, float], float, float]]: ...
    def within_limits(self, q: ArrayLike) -> NDArray[np.bool_]: ...
    def limit_margin(self, q: ArrayLike) -> _F64: ...
    def with_name(self, name: str) -> Robot: ...
    def with_joint_names(self, names: Sequence[str]) -> Robot: ...
    def with_fixed(self, fixed: dict[int, float]) -> Robot: ...
    @property
    def middle(self) -> _F64: ...
    def turned(self, q: ArrayLike) -> _F64: ...
    def random_postures(self, count: int, seed: int = 0) -> _F64: ...
    @property
    def structure(self) -> Literal["wrist", "parallel", "general", "sliding", "search", "none"]: ...
    @overload
    def inverse(
        self,
        pose: ArrayLike,
        *,
        task: Task | None = None,
        near: ArrayLike | None = None,
        fixed: dict[int, float] | None = None,
        arm_angle: float | None = None,
        samples: int | None = None,
        limits: bool = False,
        turns: bool = False,
        report: Literal[False] = False,
    ) -> _F64: ...
    @overload
    def inverse(
        self,
        pose: ArrayLike,
        *,
        task: Task | None = None,
        near: ArrayLike | None = None,
        fixed: dict[int, float] | None = None,
        arm_angle: float | None = None,
        samples: int | None = None,
        limits: bool = False,
        turns: bool = False,
        report: Literal[True],
    ) -> tuple[Any, ...]: ...
    def branch(self, q: ArrayLike) -> str: ...
    def singularity(self, q: ArrayLike, tolerance: float = 1e-6) -> Singularity: ...
    def arm_angle(self, q: ArrayLike) -> float: ...
    def rows_in_use(self) -> list[int]: ...
    def __eq__(self, other: object, /) -> bool: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@disjoint_base
class Objective:
    @overload
    def evaluate(self, robot: Robot, q: ArrayLike, order: Literal[0], with_length: bool = False) -> float: ...
    @overload
    def evaluate(
        self, robot: Robot, q: ArrayLike, order: Literal[1], with_length: bool = False
    ) -> tuple[float, _F64]: ...
    @overload
    def evaluate(
        self, robot: Robot, q: ArrayLike, order: Literal[2] = 2, with_length: bool = False
    ) -> tuple[float, _F64, _F64]: ...
    def evaluate_many(
        self, robot: Robot, q: ArrayLike, order: int = 2, threads: int | None = None
    ) -> tuple[_F64, ...]: ...
    def status(self, robot: Robot, q: ArrayLike) -> str: ...
    @staticmethod
    def kinds() -> dict[str, bool]: ...
    @staticmethod
    def named(
        name: str, length: float = 1.0, rows: Sequence[int] | None = None, squared: bool = False
    ) -> Objective: ...
    @property
    def name(self) -> str: ...
    @property
    def length(self) -> float | None: ...
    def with_length(self, length: float) -> Objective: ...
    def __add__(self, other: Objective | _IndexCallable, /) -> Objective: ...
    def __radd__(self, other: Objective | _IndexCallable, /) -> Objective: ...
    def __mul__(self, weight: float, /) -> Objective: ...
    def __rmul__(self, weight: float, /) -> Objective: ...

@final
class ConditionNumber(Objective):
    def __new__(
        cls,
        length: float = 1.0,
        norm: Literal["frobenius", "spectral"] = "frobenius",
        rows: Sequence[int] | None = None,
        squared: bool = False,
    ) -> Self: ...

@final
class Manipulability(Objective):
    def __new__(cls, length: float = 1.0, rows: Sequence[int] | None = None, squared: bool = False) -> Self: ...

@final
class SmallestSingularValue(Objective):
    def __new__(cls, length: float = 1.0, rows: Sequence[int] | None = None, squared: bool = False) -> Self: ...

@final
class SingularityParameter(Objective):
    def __new__(cls, length: float = 1.0, rows: Sequence[int] | None = None, squared: bool = False) -> Self: ...

@final
class JointLimits(Objective):
    def __new__(cls, weights: ArrayLike | None = None) -> Self: ...

@final
class LimitBarrier(Objective):
    def __new__(cls, weights: ArrayLike | None = None) -> Self: ...

@final
class CustomIndex(Objective):
    def __new__(cls, function: _IndexCallable) -> Self: ...

_Projector = Literal["free", "full"] | tuple[Literal["line", "plane"], ArrayLike]

_Spin: TypeAlias = float | tuple[float, float] | ArrayLike | None

@final
class Task:
    def __new__(
        cls,
        angular: _Projector = "full",
        linear: _Projector = "full",
        frame: Literal["tool", "base"] | ArrayLike = "tool",
    ) -> Self: ...
    @staticmethod
    def axisymmetric(axis: ArrayLike = (0.0, 0.0, 1.0)) -> Task: ...
    @staticmethod
    def full() -> Task: ...
    @staticmethod
    def position() -> Task: ...
    @staticmethod
    def within(volume: OrientationVolume) -> Task: ...
    @property
    def kind(self) -> str: ...
    @property
    def volume(self) -> OrientationVolume | None: ...
    @property
    def axis(self) -> _F64: ...
    @property
    def dimension(self) -> int: ...
    @property
    def target_size(self) -> int: ...
    def projector(self, robot: Robot, q: ArrayLike) -> _F64: ...
    def redundancy(self, robot: Robot) -> tuple[int, int, int]: ...

@final
class CoordinateDescent:
    def __new__(
        cls,
        robot: Robot,
        target: ArrayLike,
        task: Task | None = None,
        algorithm: int = 1,
        *,
        order: str = "end_to_base",
        w_p: float | None = None,
        w_o: float | None = None,
        orientation_metric: str = "frobenius",
        weights: ArrayLike | None = None,
        step: float | None = None,
        rule: str = "search",
        limits: bool = True,
        points: Iterable[tuple[int, ArrayLike, ArrayLike, float]] | None = None,
        centring: ArrayLike | None = None,
        middle: ArrayLike | None = None,
    ) -> CoordinateDescent: ...
    @property
    def algorithm(self) -> int: ...
    @property
    def monotone(self) -> bool: ...
    @property
    def robot(self) -> Robot: ...
    @property
    def w_p(self) -> float: ...
    @property
    def w_o(self) -> float: ...
    def cost(self, q: ArrayLike) -> float: ...
    def gradient(self, q: ArrayLike) -> _F64: ...
    def sweep(self, q: ArrayLike) -> tuple[_F64, float]: ...
    def trace(self, q0: ArrayLike, sweeps: int = 10) -> DescentTrace: ...
    def solve(
        self,
        q0: ArrayLike,
        sweeps: int = 100,
        *,
        position_tolerance: float = 1e-4,
        orientation_tolerance: float = 1e-3,
        gradient_tolerance: float = 1e-12,
    ) -> DescentResult: ...

@final
class OrientationVolume:
    @staticmethod
    def cone(tilt: float, spin: _Spin = None) -> OrientationVolume: ...
    @staticmethod
    def pyramid(tilt_x: float, tilt_y: float, spin: _Spin = None) -> OrientationVolume: ...
    @staticmethod
    def square(tilt_x: float, tilt_y: float, spin: _Spin = None) -> OrientationVolume: ...
    @staticmethod
    def line_x(tilt: float, spin: _Spin = None) -> OrientationVolume: ...
    @staticmethod
    def line_y(tilt: float, spin: _Spin = None) -> OrientationVolume: ...
    @staticmethod
    def product(factors: Iterable[tuple[ArrayLike, float, float]]) -> OrientationVolume: ...
    def reoriented(self, P: ArrayLike) -> OrientationVolume: ...
    # Of one orientation a bool or a float, of many an array.
    def contains(self, R: ArrayLike, tolerance: float = 1e-12) -> Any: ...  # noqa: ANN401
    def nearest(self, R: ArrayLike) -> NearestOrientation: ...
    def distance(self, R: ArrayLike) -> Any: ...  # noqa: ANN401
    @overload
    def signed_distance(self, R: ArrayLike, gradient: Literal[False] = False) -> Any: ...  # noqa: ANN401
    @overload
    def signed_distance(self, R: ArrayLike, gradient: Literal[True]) -> tuple[Any, _F64]: ...
    def pointing(self, R: ArrayLike) -> tuple[_F64, Any]: ...
    def visualising(self, R: ArrayLike) -> _F64: ...
    def sample(self, n: int, seed: int = 0) -> _F64: ...
    def grid(self, tilts: int, headings: int, spins: int) -> _F64: ...
    def plot(self, path: str | Path | None = None) -> Any: ...  # noqa: ANN401
    @property
    def kind(self) -> Literal["cone", "pyramid", "square", "line_x", "line_y", "product"]: ...
    @property
    def tilts(self) -> tuple[float, ...]: ...
    @property
    def spin(self) -> tuple[float, float] | None: ...
    @property
    def factors(self) -> list[tuple[list[float], float, float]]: ...
    @property
    def reference(self) -> _F64: ...
    @property
    def freedoms(self) -> int: ...
    @property
    def share(self) -> float: ...
    @staticmethod
    def _restore(kind: str, parts: tuple[Any, ...], reference: Sequence[float]) -> OrientationVolume: ...

@final
class PosturePull:
    def __new__(
        cls,
        w: ArrayLike,
        k: ArrayLike | None = None,
        middle: ArrayLike | None = None,
        threshold: float = 5.0,
        length: float = 1.0,
    ) -> Self: ...
    @property
    def w(self) -> _F64: ...
    @property
    def k(self) -> _F64 | None: ...
    @property
    def threshold(self) -> float: ...
    @property
    def length(self) -> float: ...

@final
class Shape:
    @staticmethod
    def sphere(radius: float) -> Shape: ...
    @staticmethod
    def capsule(radius: float, length: float) -> Shape: ...
    @staticmethod
    def cuboid(size: ArrayLike) -> Shape: ...
    @staticmethod
    def hull(points: ArrayLike) -> Shape: ...
    def grown(self, margin: float) -> Shape: ...
    @property
    def radius(self) -> float: ...
    @property
    def size(self) -> list[float] | None: ...
    @property
    def vertices(self) -> _F64: ...

@final
class Body:
    def __new__(cls, name: str, link: int | str, shape: Shape, pose: ArrayLike | None = None) -> Self: ...
    @property
    def name(self) -> str: ...
    @property
    def link(self) -> int | str: ...
    @property
    def shape(self) -> Shape: ...
    @property
    def pose(self) -> _F64: ...

@final
class Proximity:
    @property
    def names(self) -> tuple[str, str]: ...
    @property
    def distance(self) -> float: ...
    @property
    def points(self) -> _F64: ...
    @property
    def normal(self) -> _F64: ...
    @property
    def gradient(self) -> _F64: ...
    @property
    def drift(self) -> float: ...

@final
class Scene:
    def __new__(
        cls,
        robot: Robot,
        bodies: Sequence[Body],
        obstacles: Mapping[str, Shape | tuple[Shape, ArrayLike]] | None = None,
        self_pairs: Sequence[tuple[int, int]] = ...,
    ) -> Self: ...
    @property
    def robot(self) -> Robot: ...
    @property
    def bodies(self) -> list[Body]: ...
    @property
    def obstacles(self) -> list[str]: ...
    @property
    def self_pairs(self) -> list[tuple[int, int]]: ...
    def shape_of(self, name: str) -> Shape: ...
    def pose_of(self, name: str) -> _F64: ...
    def place(self, name: str, pose: ArrayLike, velocity: ArrayLike | None = None) -> None: ...
    def near(self, q: ArrayLike, influence: float = ...) -> list[Proximity]: ...
    def distance(self, q: ArrayLike) -> float: ...

@final
class PostureTask:
    def __new__(cls, posture: ArrayLike, weight: ArrayLike = 1.0, gain: float = 1.0) -> Self: ...

@final
class FrameTask:
    def __new__(cls, link: int, task: Task, frame: ArrayLike | None = None, weight: float = 100.0) -> Self: ...

@final
class QuadraticProgram:
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | None = None,
        *,
        weight: float = 1.0,
        form: Literal["curvature", "equality", "printed"] = "curvature",
        derivatives: Literal["exact", "bfgs", "differences"] = "exact",
        step: float | None = None,
        rate_weights: ArrayLike | None = None,
        stiffness: ArrayLike | None = None,
        largest_deviation: ArrayLike | None = None,
        jerk: ArrayLike | None = None,
        length: float = 1.0,
        dt: float = 1e-3,
        limits: bool = True,
        scene: Scene | None = None,
        influence: float = 0.1,
        security: float = 0.02,
        damping: float = 0.5,
        tolerance: float = 1e-3,
        beside: Sequence[PostureTask | FrameTask] | None = None,
    ) -> Self: ...
    @property
    def robot(self) -> Robot: ...
    @property
    def task(self) -> Task: ...
    @property
    def objective(self) -> Objective | None: ...
    @property
    def scene(self) -> Scene | None: ...
    @property
    def length(self) -> float: ...
    @property
    def dt(self) -> float: ...
    def step(
        self,
        q: ArrayLike,
        twist: ArrayLike,
        out: _F64 | None = None,
        *,
        stiffness: float | None = None,
        rates: ArrayLike | None = None,
        rows: ArrayLike | None = None,
        lower: ArrayLike | None = None,
        upper: ArrayLike | None = None,
        twists: ArrayLike | None = None,
    ) -> _F64: ...
    def step_along(
        self,
        q: ArrayLike,
        now: ArrayLike,
        next: ArrayLike,
        out: _F64 | None = None,
        *,
        share: float = 1.0,
        stiffness: float | None = None,
        rates: ArrayLike | None = None,
    ) -> _F64: ...
    def error(self, q: ArrayLike, target: ArrayLike) -> _F64: ...
    def twist_to(self, q: ArrayLike, target: ArrayLike, beside: int | None = None) -> _F64: ...
    @property
    def status(self) -> str: ...
    @property
    def deviation(self) -> _F64: ...
    @property
    def deviations(self) -> list[_F64]: ...
    @property
    def failed(self) -> list[str]: ...
    @property
    def distance(self) -> float: ...
    @property
    def conditioned(self) -> bool: ...
    @property
    def changes(self) -> int: ...
    def reset(self) -> None: ...
    def solve(self, target: ArrayLike, q0: ArrayLike | None = None, starts: int = 24, seed: int = 0) -> Solution: ...
    def follow_chunk(self, targets: ArrayLike, q0: ArrayLike) -> PathSolution: ...

@disjoint_base
class RateSolver:
    @property
    def robot(self) -> Robot: ...
    @property
    def task(self) -> Task: ...
    @property
    def objective(self) -> Objective | PosturePull | None: ...
    @property
    def length(self) -> float: ...
    @property
    def dt(self) -> float: ...
    def step(self, q: ArrayLike, twist: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def step_along(
        self, q: ArrayLike, now: ArrayLike, next: ArrayLike, out: _F64 | None = None, *, share: float = 1.0
    ) -> _F64: ...
    @property
    def status(self) -> str: ...
    @property
    def deviation(self) -> _F64: ...
    @property
    def step_status(self) -> str: ...
    def reset(self) -> None: ...
    def error(self, q: ArrayLike, target: ArrayLike) -> _F64: ...
    def twist_to(self, q: ArrayLike, target: ArrayLike) -> _F64: ...
    def solve(self, target: ArrayLike, q0: ArrayLike | None = None, starts: int = 24, seed: int = 0) -> Solution: ...
    def follow_chunk(self, targets: ArrayLike, q0: ArrayLike) -> PathSolution: ...
    def with_objective(self, objective: Objective | PosturePull | None = None) -> RateSolver: ...

@final
class TwistDecomposition(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class ResolvedRate(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class GradientProjection(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class WeightedInverse(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class TaskPriority(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class Householder(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class Elimination(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class VirtualJoint(RateSolver):
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective | PosturePull | None = None,
        *,
        scaling: Literal["gradient", "newton"] = "gradient",
        gain: float = 1.0,
        relaxation: float = 1.0,
        length: float | None = None,
        damping: float = 1e-3,
        dt: float = 1e-3,
        limits: bool = True,
        iterations: int = 20,
        stop: float = 0.0,
        correct: bool = True,
        tolerance: float = 1e-12,
        weights: ArrayLike | None = None,
    ) -> Self: ...

@final
class OrthogonalSQP:
    def __new__(
        cls,
        robot: Robot,
        task: Task,
        objective: Objective,
        *,
        length: float | None = None,
        hessian: Literal["exact", "bfgs"] = "exact",
        gain: float = 10.0,
        dt: float = 1e-3,
        limits: bool = True,
        tolerance: float = 1e-12,
        max_iterations: int = 100,
    ) -> Self: ...
    @property
    def robot(self) -> Robot: ...
    @property
    def task(self) -> Task: ...
    @property
    def objective(self) -> Objective: ...
    @property
    def length(self) -> float: ...
    @property
    def dt(self) -> float: ...
    def step(self, q: ArrayLike, twist: ArrayLike, out: _F64 | None = None) -> _F64: ...
    def step_along(
        self, q: ArrayLike, now: ArrayLike, next: ArrayLike, out: _F64 | None = None, *, share: float = 1.0
    ) -> _F64: ...
    @property
    def status(self) -> str: ...
    @property
    def deviation(self) -> _F64: ...
    @property
    def step_status(self) -> str: ...
    def reset(self) -> None: ...
    def error(self, q: ArrayLike, target: ArrayLike) -> _F64: ...
    def constraint(self, q: ArrayLike, target: ArrayLike) -> Constraint: ...
    def history(self, target: ArrayLike, q0: ArrayLike) -> SolveHistory: ...
    def twist_to(self, q: ArrayLike, target: ArrayLike) -> _F64: ...
    def solve(self, target: ArrayLike, q0: ArrayLike | None = None, starts: int = 24, seed: int = 0) -> Solution: ...
    def follow_chunk(self, targets: ArrayLike, q0: ArrayLike) -> PathSolution: ...

def minimum_condition_posture(
    robot: Robot,
    q0: ArrayLike,
    length: float | None,
    length0: float | None,
    method: Literal["newton", "bfgs"],
    eliminate: bool,
    rows: Sequence[int] | None,
    tolerance: float,
    max_iterations: int,
) -> tuple[_F64, float, float, int, int, str, _F64]: ...
def characteristic_length(robot: Robot, q: ArrayLike, rows: Sequence[int] | None = None) -> float: ...
def rms_length(robot: Robot, q: ArrayLike) -> float: ...
def planar_tetrahedron(robot: Robot, q: ArrayLike, length: float) -> dict[str, Any]: ...

@final
class Lattice:
    def __new__(
        cls,
        robot: Robot,
        frames: ArrayLike,
        task: Task,
        angles: ArrayLike,
        spare: Sequence[int],
        values: ArrayLike,
        objective: Objective | None = None,
        limits: bool = True,
    ) -> Self: ...
    @property
    def shape(self) -> tuple[int, int, int]: ...
    @property
    def named(self) -> bool: ...
    def postures(self, first: int, count: int) -> tuple[_F64, _F64, NDArray[np.uint8]]: ...
    def survey(
        self, first: int, count: int, feasible: Callable[[_F64], ArrayLike] | None = None
    ) -> tuple[_F64, NDArray[np.uint8]]: ...

@final
class PathData:
    def __new__(
        cls, position: ArrayLike, axis: ArrayLike, rotation: ArrayLike | None = None, time: ArrayLike | None = None
    ) -> Self: ...
    def __len__(self) -> int: ...
    @property
    def shares(self) -> _F64: ...
    @property
    def weights(self) -> _F64: ...
    def frames(self, task: Task, closed: bool = False) -> _F64: ...
    def spins(self, robot: Robot, task: Task, q: ArrayLike) -> _F64: ...
    def spin_along(self, robot: Robot, q: ArrayLike) -> _F64: ...
    def transport(self) -> _F64: ...

@final
class PlanSettings:
    def __new__(
        cls,
        criterion: str | None = None,
        limits: bool | None = None,
        *,
        smoothness: float | None = None,
        joint_weights: ArrayLike | None = None,
        n_angles: int | None = None,
        layers: int | None = None,
        spin_range: tuple[float, float] | None = None,
        max_spin_step: float | None = None,
        max_step: float | None = None,
        spare: Sequence[int] | None = None,
        n_spare: int | None = None,
        branches: Sequence[int] | None = None,
        branch_changes: bool | None = None,
        closed: bool | None = None,
        bound: bool | None = None,
        effort: int | None = None,
        max_iterations: int | None = None,
        start: ArrayLike | None = None,
        end: ArrayLike | None = None,
        pins: Mapping[int, float | ArrayLike] | None = None,
        reconfigurations: bool | None = None,
        lift_off: float | None = None,
    ) -> Self: ...
    def with_criterion(self, criterion: str) -> PlanSettings: ...
    @property
    def criterion(self) -> str: ...
    @property
    def limits(self) -> bool: ...
    @property
    def smoothness(self) -> float | None: ...
    @property
    def joint_weights(self) -> list[float] | None: ...
    @property
    def n_angles(self) -> int: ...
    @property
    def layers(self) -> int: ...
    @property
    def spin_range(self) -> tuple[float, float] | None: ...
    @property
    def max_spin_step(self) -> float: ...
    @property
    def max_step(self) -> float | None: ...
    @property
    def spare(self) -> tuple[int, ...] | None: ...
    @property
    def n_spare(self) -> int | None: ...
    @property
    def branches(self) -> tuple[int, ...] | None: ...
    @property
    def branch_changes(self) -> bool: ...
    @property
    def closed(self) -> bool: ...
    @property
    def bound(self) -> bool | None: ...
    @property
    def effort(self) -> int | None: ...
    @property
    def max_iterations(self) -> int: ...
    @property
    def start(self) -> _F64 | None: ...
    @property
    def end(self) -> _F64 | None: ...
    @property
    def pins(self) -> dict[int, float | _F64] | None: ...
    @property
    def reconfigurations(self) -> bool: ...
    @property
    def lift_off(self) -> float: ...

@final
class PlanFailure:
    def __new__(
        cls,
        point: int,
        cause: str,
        joint: int | None = None,
        excess: float = ...,
        slides: bool = False,
        combination: str | None = None,
        hint: str | None = None,
        pins: Sequence[int] | None = None,
    ) -> Self: ...
    @property
    def point(self) -> int: ...
    @property
    def cause(self) -> str: ...
    @property
    def joint(self) -> int | None: ...
    @property
    def combination(self) -> str | None: ...
    @property
    def excess(self) -> float: ...
    @property
    def hint(self) -> str | None: ...
    @property
    def pins(self) -> tuple[int, ...]: ...
    def told(self, robot: Robot) -> str: ...

@final
class PathTransfer:
    @property
    def points(self) -> tuple[int, int]: ...
    @property
    def q(self) -> _F64: ...
    @property
    def lift(self) -> tuple[float, float]: ...
    @property
    def allowed(self) -> bool: ...

@final
class PlannedPath:
    @property
    def segments(self) -> list[tuple[int, int]]: ...
    @property
    def transfers(self) -> list[PathTransfer]: ...
    @property
    def q(self) -> _F64: ...
    @property
    def value(self) -> _F64: ...
    @property
    def position_error(self) -> _F64: ...
    @property
    def axis_error(self) -> _F64: ...
    @property
    def status(self) -> list[str]: ...
    @property
    def length(self) -> float: ...
    @property
    def smoothness(self) -> float: ...
    @property
    def cost(self) -> float: ...
    @property
    def motion(self) -> float: ...
    @property
    def edge_cost(self) -> float: ...
    @property
    def bound(self) -> float: ...
    @property
    def residual(self) -> float: ...
    @property
    def refined(self) -> bool: ...
    @property
    def failure(self) -> PlanFailure | None: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def ways(self) -> list[tuple[float, float, float, bool]]: ...

def plan_path(
    robot: Robot,
    path: PathData,
    task: Task,
    objective: Objective | None,
    settings: PlanSettings,
    feasible: Callable[[_F64], ArrayLike] | None = None,
    edge_cost: Callable[[_F64, _F64], ArrayLike] | None = None,
    warm_start: tuple[PathData, ArrayLike] | None = None,
    progress: Callable[[float], None] | None = None,
) -> PlannedPath: ...
def transport(axis: ArrayLike) -> _F64: ...
def perpendicular(vector: ArrayLike) -> _F64: ...
def angle_grid(spins: bool, n_angles: int, spin_range: tuple[float, float] | None) -> _F64: ...
def spare_grid(
    robot: Robot, task: Task, spare: Sequence[int] | None, n_spare: int | None
) -> tuple[list[int], _F64, bool]: ...
def quaternion_about(axis: ArrayLike, angle: ArrayLike) -> _F64: ...
def quaternion_angle(a: ArrayLike, b: ArrayLike) -> Any: ...  # noqa: ANN401
def quaternion_axis_angle(q: ArrayLike) -> tuple[_F64, Any]: ...
def quaternion_conjugate(q: ArrayLike) -> _F64: ...
def quaternion_from_matrix(R: ArrayLike) -> _F64: ...
def quaternion_matrix(q: ArrayLike) -> _F64: ...
def quaternion_product(a: ArrayLike, b: ArrayLike) -> _F64: ...
def quaternion_rotate(q: ArrayLike, v: ArrayLike) -> _F64: ...
def one_joint_minimum(
    joint: str,
    axis: ArrayLike,
    origin: ArrayLike,
    *,
    current_position: ArrayLike | None = None,
    desired_position: ArrayLike | None = None,
    current_orientation: ArrayLike | None = None,
    desired_orientation: ArrayLike | None = None,
    w_p: float = 1.0,
    w_o: float = 1.0,
    orientation_metric: str = "frobenius",
    change_min: float | None = None,
    change_max: float | None = None,
    current_axis: ArrayLike | None = None,
    desired_axis: ArrayLike | None = None,
    points: Iterable[tuple[ArrayLike, ArrayLike, float]] | None = None,
    centring: tuple[float, float] | None = None,
) -> OneJointMinimum: ...
def solve_qp(
    h: ArrayLike,
    g: ArrayLike,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    rows: ArrayLike | None = None,
    row_lower: ArrayLike | None = None,
    row_upper: ArrayLike | None = None,
) -> QPSolution: ...
def bodies_from_urdf(
    path: str | Path,
    base: str | None = None,
    tip: str | None = None,
    search: Sequence[str | Path] = ...,
    limits: Mapping[str, Any] | None = None,
) -> list[Body]: ...
def capsules_along_links(robot: Robot, radius: float) -> list[Body]: ...
def self_collision_pairs(
    robot: Robot, bodies: Sequence[Body], reference: ArrayLike, clearance: float = 0.02
) -> list[tuple[int, int]]: ...
