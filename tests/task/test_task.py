"""Tasks: sixteen twist projectors in three frames against numpy, what they count, robots counted by hand, bad input."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]

FANUC = rd.robots.get("fanuc_m710ic50")
ANGULAR, LINEAR = np.array([0.6, -0.48, 0.64]), np.array([-2.0, 1.0, 2.0])
FORMS = ["free", "line", "plane", "full"]
DIMENSION = {"free": 0, "line": 1, "plane": 2, "full": 3}
OPPOSITE = {"free": "full", "line": "plane", "plane": "line", "full": "free"}
FRAMES = ["tool", "base", "part"]


def _part() -> F64:
    """A rotation about (1, 2, 3) by 1 rad, somewhere."""
    x, y, z = np.array([1.0, 2.0, 3.0]) / np.sqrt(14.0)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    frame = np.eye(4)
    frame[:3, :3] += np.sin(1.0) * cross + (1.0 - np.cos(1.0)) * cross @ cross
    frame[:3, 3] = [0.7, -0.2, 0.4]
    return frame


PART = _part()


def argument(form: str, axis: F64) -> Any:
    return (form, axis) if form in ("line", "plane") else form


def build(angular: str, linear: str, frame: str) -> rd.Task:
    return rd.Task(argument(angular, ANGULAR), argument(linear, LINEAR), PART if frame == "part" else frame)


def expected(form: str, axis: F64, turn: F64) -> F64:
    """(3.2), (3.3): e e^T, 1 - e e^T, 0 or 1, with e in the base frame."""
    e = turn @ axis / np.linalg.norm(axis)
    line = np.outer(e, e)
    forms: dict[str, F64] = {"free": np.zeros((3, 3)), "line": line, "plane": np.eye(3) - line, "full": np.eye(3)}
    return forms[form]


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("linear", FORMS)
@pytest.mark.parametrize("angular", FORMS)
def test_projector(angular: str, linear: str, frame: str) -> None:
    task, rest = build(angular, linear, frame), build(OPPOSITE[angular], OPPOSITE[linear], frame)
    for q in np.random.default_rng(1).uniform(-3.0, 3.0, (5, 6)):
        turn = {"tool": FANUC.fk(q)[:3, :3], "base": np.eye(3), "part": PART[:3, :3]}[frame]
        T = task.projector(FANUC, q)
        assert T.shape == (6, 6)
        wanted = np.zeros((6, 6))
        wanted[:3, :3] = expected(angular, ANGULAR, turn)
        wanted[3:, 3:] = expected(linear, LINEAR, turn)
        # Products of unit vectors: a few roundings of numbers up to 1.
        np.testing.assert_allclose(T, wanted, rtol=0, atol=2e-15)
        np.testing.assert_allclose(T, T.T, rtol=0, atol=1e-15)
        np.testing.assert_allclose(T @ T, T, rtol=0, atol=2e-15)
        np.testing.assert_allclose(T + rest.projector(FANUC, q), np.eye(6), rtol=0, atol=2e-15)
        np.testing.assert_allclose(T @ rest.projector(FANUC, q), 0.0, rtol=0, atol=2e-15)
        assert np.linalg.matrix_rank(T, tol=0.5) == task.dimension == round(float(np.trace(T)))
    assert task.dimension == DIMENSION[angular] + DIMENSION[linear]
    assert task.dimension + rest.dimension == 6


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("linear", FORMS)
@pytest.mark.parametrize("angular", FORMS)
def test_kind_and_target(angular: str, linear: str, frame: str) -> None:
    task = build(angular, linear, frame)
    kinds = {("full", "full"): "full", ("free", "full"): "position"}
    spins = (angular, linear, frame) == ("plane", "full", "tool")
    assert task.kind == ("axisymmetric" if spins else kinds.get((angular, linear), "general"))
    assert task.target_size == (6 if spins else 3 if angular == "free" else 12)
    axis = ANGULAR / np.linalg.norm(ANGULAR) if spins else [0.0, 0.0, 1.0]
    np.testing.assert_allclose(task.axis, axis, rtol=0, atol=1e-15)


def test_named_tasks_are_some_of_the_sixteen() -> None:
    assert rd.Task() == rd.Task.full() == rd.Task("full", "full", "tool")
    assert rd.Task("free") == rd.Task.position()
    assert rd.Task(("plane", ANGULAR)) == rd.Task.axisymmetric(ANGULAR)
    assert rd.Task.axisymmetric() == rd.Task(angular=("plane", (0, 0, 1)))
    q = np.linspace(-1.0, 1.0, 6)
    T = rd.Task.axisymmetric(ANGULAR).projector(FANUC, q)
    e = FANUC.fk(q)[:3, :3] @ ANGULAR / np.linalg.norm(ANGULAR)
    # (3.9): no component about the tool's axis.
    np.testing.assert_allclose(T @ np.r_[e, 0, 0, 0], 0.0, atol=2e-15)
    np.testing.assert_allclose(T[3:, 3:], np.eye(3), atol=0)


def test_equality() -> None:
    # 16 tasks in three frames, alike only where there is no direction and the point is the same.
    made = [(angular, linear, frame) for frame in FRAMES for angular in FORMS for linear in FORMS]
    tasks = [build(*what) for what in made]
    for what, task in zip(made, tasks, strict=True):
        without_direction = set(what[:2]) <= {"free", "full"} and what[2] != "part"
        alike = [
            other == what or (without_direction and other[:2] == what[:2] and other[2] != "part") for other in made
        ]
        assert [other == task for other in tasks] == alike
    assert build("plane", "line", "part") == build("plane", "line", "part")
    # An axis may have any length.
    assert rd.Task(("line", (0, 0, 1))) == rd.Task(("line", (0, 0, 1e-200))) == rd.Task(("line", [0, 0, 1e200]))
    assert rd.Task(("line", (0, 0, 1))) != rd.Task(("line", (0, 0, -1)))
    other: object = "Task.full()"
    assert rd.Task.full() != other


@pytest.mark.parametrize(
    ("task", "shown"),
    [
        (rd.Task.full(), "Task.full()"),
        (rd.Task.position(), "Task.position()"),
        (rd.Task.axisymmetric((0, 2, 0)), "Task.axisymmetric((0, 1, 0))"),
        (rd.Task(("line", (0, 0, 1)), "free"), "Task(('line', (0, 0, 1)), 'free', 'tool')"),
        (rd.Task(("plane", (1, 0, 0)), ("line", (0, -1, 0)), "base"), None),
        (rd.Task("full", ("plane", (0, 0, 1)), "base"), "Task('full', ('plane', (0, 0, 1)), 'base')"),
    ],
)
def test_repr_is_how_it_is_made(task: rd.Task, shown: str | None) -> None:
    assert shown is None or repr(task) == shown
    assert eval(repr(task), {"Task": rd.Task}) == task


def test_repr_of_the_frame_of_a_part() -> None:
    assert repr(rd.Task("free", ("line", (0, 0, 1)), PART)) == "Task('free', ('line', (0, 0, 1)), <part>)"


PRRRR = rd.Robot.from_dh(
    # A vertical slide, and four parallel axes of a level arm: three translations and one rotation (Huo 2009, Fig. 1.5).
    a=[0.1, 0.4, 0.3, 0.2, 0.15],
    d=[0.0, 0.1, 0.0, 0.0, 0.05],
    alpha=[0.0] * 5,
    theta=[0.0] * 5,
    joints="PRRRR",
)
SCHOENFLIES = rd.Task(("line", (0, 0, 1)), "full", "base")
LEVEL = rd.Task(("line", (0, 0, 1)), ("plane", (0, 0, 1)), "base")
LEVEL_POSITION = rd.Task("free", ("plane", (0, 0, 1)), "base")
HEIGHT = rd.Task("free", ("line", (0, 0, 1)), "base")
AXIAL, FULL, POSITION = rd.Task.axisymmetric(), rd.Task.full(), rd.Task.position()
NAMED = rd.robots.get


@pytest.mark.parametrize(
    ("robot", "task", "counted"),
    [
        # Six joints, six motions.
        (NAMED("fanuc_m710ic50"), AXIAL, (0, 1, 1)),
        (NAMED("puma500"), AXIAL, (0, 1, 1)),
        (NAMED("stanford_arm"), AXIAL, (0, 1, 1)),
        (NAMED("ur5e"), FULL, (0, 0, 0)),
        (NAMED("ur5e"), POSITION, (0, 3, 3)),
        (NAMED("ur5e"), rd.Task("free", "free"), (0, 6, 6)),
        # Seven joints, six motions.
        (NAMED("panda"), AXIAL, (1, 1, 2)),
        (NAMED("kuka_iiwa14"), AXIAL, (1, 1, 2)),
        (NAMED("kuka_iiwa14"), FULL, (1, 0, 1)),
        (NAMED("panda"), HEIGHT, (1, 5, 6)),
        # Three parallel axes: two translations and a rotation in the plane.
        (NAMED("planar_3r"), LEVEL, (0, 0, 0)),
        (NAMED("planar_3r"), LEVEL_POSITION, (0, 1, 1)),
        (NAMED("planar_3r"), rd.Task("free", ("line", (1, 0, 0)), "base"), (0, 2, 2)),
        (NAMED("planar_3r"), AXIAL, (0, -2, -2)),
        (NAMED("planar_3r"), FULL, (0, -3, -3)),
        # Five joints, four motions.
        (PRRRR, SCHOENFLIES, (1, 0, 1)),
        (PRRRR, POSITION, (1, 1, 2)),
        (PRRRR, LEVEL_POSITION, (1, 2, 3)),
        (PRRRR, FULL, (1, -2, -1)),
    ],
)
def test_redundancy_counted_by_hand(robot: rd.Robot, task: rd.Task, counted: tuple[int, int, int]) -> None:
    assert task.redundancy(robot) == counted
    intrinsic, functional, total = counted
    assert total == intrinsic + functional == robot.n - task.dimension


def test_operational_dimension_is_the_rank_of_the_jacobian() -> None:
    for robot in (PRRRR, NAMED("planar_3r"), NAMED("panda"), NAMED("fanuc_m710ic50")):
        J = robot.jacobian(np.random.default_rng(2).uniform(-1.0, 1.0, robot.n))
        intrinsic, functional, _ = rd.Task.full().redundancy(robot)
        assert robot.n - intrinsic == functional + 6 == np.linalg.matrix_rank(J)


MIRROR = np.diag([1.0, 1.0, -1.0, 1.0])
STRETCHED = np.diag([1.0, 1.0, 1.1, 1.0])
LAST = np.eye(4)
LAST[3, 1] = 0.5
Z = (0.0, 0.0, 1.0)
NAN = np.nan
CHOICE = r'expected "free", "full", \("line", axis\) or \("plane", axis\)'
WRONG: dict[str, tuple[dict[str, Any], type[Exception], str]] = {
    "word": ({"angular": "none"}, rd.InvalidValueError, f"angular is 'none', {CHOICE}"),
    "capitals": ({"linear": "FULL"}, rd.InvalidValueError, f"linear is 'FULL', {CHOICE}"),
    "number": ({"angular": 3}, rd.InvalidValueError, f"angular is 3, {CHOICE}"),
    "line without axis": ({"linear": "line"}, rd.InvalidValueError, f"linear is 'line', {CHOICE}"),
    "short tuple": ({"angular": ("line",)}, rd.InvalidValueError, r"angular is \('line',\)"),
    "long tuple": ({"angular": ("line", Z, 1)}, rd.InvalidValueError, r"angular is \('line', .*1\)"),
    "full with axis": ({"linear": ("full", Z)}, rd.InvalidValueError, r"linear is \('full', "),
    "zero axis": ({"angular": ("plane", (0, 0, 0))}, rd.InvalidValueError, r"is \[0.0, 0.0, 0.0\], expected a vector"),
    "zero line": ({"linear": ("line", (0, -0.0, 0))}, rd.InvalidValueError, r"expected a vector that is not zero"),
    "NaN axis": ({"angular": ("plane", (0, NAN, 1))}, rd.NonFiniteError, r"angular\[1\] is NaN"),
    "infinite axis": ({"linear": ("line", (0, 1, -np.inf))}, rd.NonFiniteError, r"linear\[2\] is -inf"),
    "short axis": ({"angular": ("plane", (0, 1))}, rd.ShapeError, r"angular: got shape \(2,\)"),
    "axes": ({"linear": ("plane", [Z, Z])}, rd.ShapeError, r"linear: got shape \(2, 3\), expected \(3,\)"),
    "named axis": ({"angular": ("plane", "z")}, rd.InvalidValueError, "angular is 'z', expected an array"),
    "complex axis": ({"angular": ("plane", (0, 1j, 0))}, rd.InvalidValueError, "1j"),
    "frame": ({"frame": "world"}, rd.InvalidValueError, 'frame is "world", expected "tool", "base"'),
    "rotation only": ({"frame": np.eye(3)}, rd.ShapeError, r"frame: got shape \(3, 3\), expected \(4, 4\)"),
    "flat frame": ({"frame": np.eye(4).ravel()}, rd.ShapeError, r"frame: got shape \(16,\)"),
    "mirror": ({"frame": MIRROR}, rd.InvalidValueError, "frame is a matrix .* expected an orthogonal rotation"),
    "stretched": ({"frame": STRETCHED}, rd.InvalidValueError, "frame is a matrix .* expected an orthogonal rotation"),
    "last row": ({"frame": LAST}, rd.InvalidValueError, "frame"),
    "NaN frame": ({"frame": np.full((4, 4), NAN)}, rd.NonFiniteError, r"frame\[0\] is NaN"),
    "text in frame": ({"frame": [["a"] * 4] * 4}, rd.InvalidValueError, "frame is .*expected an array"),
}


@pytest.mark.parametrize("case", WRONG)
def test_bad_input(case: str) -> None:
    arguments, kind, message = WRONG[case]
    with pytest.raises(kind, match=message) as caught:
        rd.Task(**arguments)
    assert type(caught.value) is kind


@pytest.mark.parametrize("q", [[0.0] * 5, np.zeros((2, 6)), np.zeros((6, 1)), 0.0])
def test_projector_wants_one_posture(q: Any) -> None:
    with pytest.raises(rd.ShapeError, match=r"q: got shape .*expected \(6,\)"):
        rd.Task.full().projector(FANUC, q)


def test_projector_wants_numbers() -> None:
    with pytest.raises(rd.NonFiniteError, match=r"q\[3\] is inf"):
        rd.Task.full().projector(FANUC, [0.0, 0, 0, np.inf, 0, 0])
    with pytest.raises(rd.InvalidValueError, match="q is 'q'"):
        rd.Task.full().projector(FANUC, "q")
    with pytest.raises(TypeError):
        rd.Task.full().redundancy("robot")  # type: ignore[arg-type]
