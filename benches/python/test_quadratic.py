"""One step towards a target with the tool's spin free, as a quadratic programme: position, axis, rates, conditioning.

Limits of position and speed hold. placo and pink solve what is nearest to it with what they have: their tasks of
manipulability with the kinematics of every step, and limits of position and speed. Their numbers are not compared with
ours, because weights mean different things; every solver has to come nearer to the target.
"""

import importlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from pytest_benchmark.fixture import BenchmarkFixture

from .chains import F64, Chain
from .conftest import label
from .contender import PER_POSTURE

DT = 0.01
TIPS = {"6R": "tool0", "7R": "panda_link8"}
Step = Callable[[F64], F64]


def target(chain: Chain) -> F64:
    """Pose of the tool well within reach."""
    robot = chain.robot()
    middle = 0.5 * (np.maximum(robot.q_min, -np.pi) + np.minimum(robot.q_max, np.pi)) + 0.3
    return robot.fk(middle)


def index(name: str) -> tuple[rd.Objective, float]:
    """The objective and its weight."""
    if name == "manipulability":
        return -1.0 * rd.Manipulability(1.0), 10.0
    return rd.ConditionNumber(0.48, squared=True), 0.1


def ours(chain: Chain, objective: str, whole: bool = True) -> Step:
    """One step of this package; the twist towards the target is part of it unless `whole` is false."""
    robot, pose = chain.robot(), target(chain)
    goal, rates = np.concatenate([pose[:3, 3], pose[:3, 2]]), np.empty(robot.n)
    criterion, weight = index(objective)
    program = rd.QuadraticProgram(robot, rd.Task.axisymmetric(), criterion, weight=weight, dt=DT, length=0.48)
    twist = np.array([0.1, -0.05, 0.02, 0.05, 0.1, -0.1])

    def step(q: F64) -> F64:
        return program.step(q, program.twist_to(q, goal) if whole else twist, out=rates)

    return step


def placo(chain: Chain) -> Step:
    """Position, alignment of an axis, manipulability and regularisation, all soft; kinematics included."""
    library: Any = importlib.import_module("placo")
    arm, pose, tip = (
        library.RobotWrapper(str(chain.urdf), library.Flags.ignore_collisions),
        target(chain),
        TIPS[chain.name],
    )
    arm.set_T_world_frame(chain.base, np.eye(4))
    solver = library.KinematicsSolver(arm)
    solver.mask_fbase(True)
    solver.dt = DT
    solver.enable_velocity_limits(True)
    solver.add_position_task(tip, pose[:3, 3].copy()).configure("position", "soft", 1.0)
    solver.add_axisalign_task(tip, np.array([0.0, 0.0, 1.0]), pose[:3, 2].copy()).configure("axis", "soft", 1.0)
    solver.add_manipulability_task(tip, "both", 1.0).configure("manipulability", "soft", 1e-3)
    solver.add_regularization_task(1e-5)
    first = arm.get_joint_v_offset(next(iter(arm.joint_names())))

    def step(q: F64) -> F64:
        arm.state.q[7:] = q
        arm.update_kinematics()
        motion: F64 = solver.solve(False)
        return motion[first : first + len(q)]

    step.keep = (solver, arm)  # type: ignore[attr-defined]
    return step


def pink(chain: Chain) -> Step:
    """Position and two angles, manipulability and posture, solved by daqp; kinematics included."""
    library: Any = importlib.import_module("pink")
    tasks: Any = importlib.import_module("pink.tasks")
    pin: Any = importlib.import_module("pinocchio")
    model, tip = pin.buildModelFromUrdf(str(chain.urdf)), TIPS[chain.name]
    arm = library.Configuration(model, model.createData(), 0.5 * (model.lowerPositionLimit + model.upperPositionLimit))
    frame = tasks.FrameTask(tip, position_cost=1.0, orientation_cost=[1.0, 1.0, 0.0])
    frame.set_target(pin.SE3(target(chain)))
    rest = tasks.PostureTask(cost=1e-3)
    rest.set_target(arm.q.copy())
    terms = [frame, rest, tasks.ManipulabilityTask(tip, model, cost=0.1)]

    def step(q: F64) -> F64:
        arm.update(q)
        rates: F64 = library.solve_ik(arm, terms, DT, solver="daqp", safety_break=False)
        return rates

    return step


CONTENDERS: dict[str, tuple[str, Callable[[Chain], Step]]] = {
    "redundancy": ("redundancy", lambda chain: ours(chain, "manipulability")),
    "redundancy, condition number": ("redundancy", lambda chain: ours(chain, "condition number")),
    "redundancy, condition number, twist given": ("redundancy", lambda chain: ours(chain, "condition number", False)),
    "placo": ("placo", placo),
    "pink": ("pink", pink),
}


@pytest.fixture(scope="module")
def within(chain: Chain, postures: list[F64]) -> list[F64]:
    """The postures, a little within the limits."""
    robot = chain.robot()
    low, high = np.maximum(robot.q_min, -np.pi) + 1e-3, np.minimum(robot.q_max, np.pi) - 1e-3
    return [np.clip(q, low, high) for q in postures]


def assert_nearer(chain: Chain, step: Step, postures: Sequence[F64]) -> None:
    """Fail unless the step comes nearer to the target from most postures."""
    robot, place, nearer = chain.robot(), target(chain)[:3, 3], 0
    for q in postures:
        motion = step(q)
        moved = q + 1e-4 * motion / np.abs(motion).max()
        nearer += np.linalg.norm(robot.fk(moved)[:3, 3] - place) < np.linalg.norm(robot.fk(q)[:3, 3] - place)
    assert nearer > 0.6 * len(postures), nearer


@pytest.mark.benchmark(**PER_POSTURE)
@pytest.mark.parametrize("name", CONTENDERS)
def test_free_axis_step(benchmark: BenchmarkFixture, chain: Chain, within: list[F64], name: str) -> None:
    module, make = CONTENDERS[name]
    pytest.importorskip(module)
    step = make(chain)

    def sweep() -> None:
        for q in within:
            step(q)

    sweep()
    if not name.endswith("given"):
        assert_nearer(chain, step, within)
    label(benchmark, chain.name, "free-axis step with limits and conditioning, QP", name)
    benchmark(sweep)
