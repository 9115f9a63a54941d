"""The painting speeds of From and Gravdahl: a PUMA 560, three rasters, rules, against recorded speeds."""

from typing import Any

import numpy as np
import pytest
import redundancy as rd
from redundancy.errors import InvalidValueError, NonFiniteError, ShapeError

from evidence.from_gravdahl.cases import CRITERIA, TILT, Cone, Scenario, dynamics, recorded, scenarios, speeds
from tests.reference.chain import F64

pytest.importorskip("pinocchio")

SCENARIOS = scenarios()
RULES = list(SCENARIOS["S1"].rules())


@pytest.fixture(params=["S1", "S2", "S3"])
def scenario(request: pytest.FixtureRequest) -> Scenario:
    return SCENARIOS[request.param]


def test_dynamics_of_the_puma() -> None:
    check = recorded("puma560_dynamics")["check"]
    unloaded, zero = dynamics(payload=False), np.zeros(6)
    np.testing.assert_allclose(unloaded.torque(zero, zero, zero), check["gravity torques at q = 0"], atol=5e-5)
    mass = unloaded.torque(zero, zero, np.eye(6)[0])[0]
    assert mass == pytest.approx(check["mass matrix entry (1,1) at q = 0"], abs=5e-5)


@pytest.mark.parametrize("rule", RULES)
def test_speeds_as_recorded(scenario: Scenario, rule: str) -> None:
    motion = scenario.motion(rule)
    found, expected, constant = speeds(scenario.robot, motion), scenario.results[rule], scenario.results["constant"]
    for criterion in CRITERIA:
        assert found[criterion] == pytest.approx(expected[criterion], rel=1e-4)
    np.testing.assert_allclose(motion.q[0], expected["q_first"], atol=1e-9)
    assert np.ptp(motion.q[:, 0]) == pytest.approx(expected["q1_range"], abs=1e-5)
    frames = scenario.path().rotation
    assert frames is not None
    assert motion.path.rotation is not None
    tilt = np.arccos(np.clip((frames[:, :, 2] * motion.path.axis).sum(axis=1), -1.0, 1.0)).max()
    assert np.degrees(tilt) == pytest.approx(expected["max_tilt_deg"], abs=1e-4)
    if "circle" in rule:
        relative = frames.transpose(0, 2, 1) @ motion.path.rotation
        assert Cone(TILT).signed_distance(relative).max() <= 1e-12
    if scenario.name == "S1" and rule.startswith("spin") and "tilt" not in rule:
        assert found["tau1"] / constant["tau1"] == pytest.approx(1.0, abs=5e-4)


@pytest.mark.parametrize("rule", ["spin -atan2", "spin +atan2 (printed)"])
def test_a_spin_about_joint_6_moves_joint_6_alone(rule: str) -> None:
    aligned = SCENARIOS["S1"]
    change = aligned.motion(rule).q - aligned.motion("constant").q
    assert np.abs(change[:, :5]).max() < 1e-12
    assert np.ptp(change[:, 5]) > 0.5


def test_the_mount_gives_the_sign(scenario: Scenario) -> None:
    mount = rd.PointingRule.of(scenario.robot).mount
    assert mount == ("outside" if scenario.geometry["ex"] > 0.0 else "inside")
    # With the wrist on the robot's side it keeps to the radial plane of the tool point.
    if mount == "inside":
        motion = scenario.motion("spin -atan2")
        wrist = (scenario.robot.fk(motion.q) @ np.linalg.inv(scenario.robot.tool))[:, :3, 3]
        across = wrist[:, 0] * motion.path.position[:, 1] - wrist[:, 1] * motion.path.position[:, 0]
        assert np.abs(across).max() < 1e-12


def placed(rule: rd.SurfaceRule, frame: F64, place: F64) -> F64:
    """Return tool axes in the frame of a surface, for places in its plane."""
    points = np.pad(place, ((0, 0), (0, 1))) @ frame[:3, :3].T + frame[:3, 3]
    axis: F64 = rule.rotation(points, frame[:3, :3] * [-1.0, 1.0, -1.0])[:, :, 2] @ frame[:3, :3]
    return axis


@pytest.mark.parametrize("seed", range(4))
def test_tilts_in_any_frame(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frame = np.eye(4)
    frame[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    frame[:3, 2] *= np.linalg.det(frame[:3, :3])
    frame[:3, 3] = rng.normal(size=3)
    hx, hy = rng.uniform(0.1, 1.0, 2)
    tilt = rng.uniform(0.01, 0.7)
    place = rng.uniform(-1.0, 1.0, (200, 2)) * [hx, hy]
    square = rd.SurfaceRule(tilt, half_size=(hx, hy), frame=frame, cross_section="square")
    np.testing.assert_allclose(placed(square, frame, place)[:, :2], np.sin(tilt) * place / [hx, hy], atol=1e-12)
    circle = rd.SurfaceRule(tilt, half_size=(hx, hy), frame=frame)
    radius = np.hypot(hx, hy)
    np.testing.assert_allclose(placed(circle, frame, place)[:, :2], np.sin(tilt) * place / radius, atol=1e-12)
    disc = rd.SurfaceRule(tilt, radius=radius, frame=frame)
    np.testing.assert_allclose(placed(disc, frame, place), placed(circle, frame, place), atol=1e-12)
    # Beyond the edge as on it.
    far = placed(disc, frame, 1e4 * place)
    np.testing.assert_allclose(np.hypot(far[:, 0], far[:, 1]), np.sin(tilt), rtol=1e-12)
    # A path at once is its points one by one.
    points = rng.normal(size=(5, 3))
    frames = np.broadcast_to(frame[:3, :3] * [-1.0, 1.0, -1.0], (5, 3, 3))
    together = square.rotation(points, frames)
    np.testing.assert_allclose(
        together.transpose(0, 2, 1) @ together, np.broadcast_to(np.eye(3), (5, 3, 3)), atol=1e-12
    )
    for k in range(5):
        np.testing.assert_allclose(square.rotation(points[k], frames[k]), together[k], atol=1e-15)


def test_spins_by_hand() -> None:
    down, up = np.diag([-1.0, 1.0, -1.0]), np.eye(3)
    point = np.array([1.0, 1.0, 0.3])
    assert rd.PointingRule("inside").spin(point, down) == pytest.approx(-0.25 * np.pi)
    assert rd.PointingRule("outside").spin(point, down) == pytest.approx(0.25 * np.pi)
    assert rd.PointingRule("inside").spin(point, up) == pytest.approx(0.25 * np.pi)
    assert rd.PointingRule().spin(np.zeros(3), down) == 0.0
    # The x axis of the tool, with the wrist on the robot's side of it, looks back at joint 1.
    turned = rd.PointingRule("inside").rotation(point, down)
    np.testing.assert_allclose(turned[:, 0], -np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0), atol=1e-15)
    base = np.eye(4)
    base[:3, 3] = 1.0, 0.0, 0.0
    assert rd.PointingRule("outside", base).spin(point, down) == pytest.approx(0.5 * np.pi)


DOWN = np.diag([-1.0, 1.0, -1.0])


@pytest.mark.parametrize(
    ("make", "error", "told"),
    [
        (lambda: rd.PointingRule("left"), InvalidValueError, "mount is 'left'"),  # type: ignore[arg-type]
        (lambda: rd.PointingRule("inside", np.eye(3)), ShapeError, "base"),
        (lambda: rd.PointingRule().spin(np.zeros(3), np.eye(3)[[1, 2, 0]]), InvalidValueError, "across the axis"),
        (lambda: rd.PointingRule().spin(np.zeros(2), DOWN), ShapeError, "position"),
        (lambda: rd.PointingRule().spin(np.zeros(3), np.zeros((2, 3, 3))), ShapeError, "rotation"),
        (lambda: rd.PointingRule().spin([np.nan, 0.0, 0.0], DOWN), NonFiniteError, "position"),
        (lambda: rd.SurfaceRule(0.1), InvalidValueError, "expected one of them"),
        (lambda: rd.SurfaceRule(0.1, half_size=(1.0, 1.0), radius=1.0), InvalidValueError, "expected one of them"),
        (lambda: rd.SurfaceRule(0.0, radius=1.0), InvalidValueError, "tilt is 0"),
        (lambda: rd.SurfaceRule(1.0, half_size=(1.0, 1.0), cross_section="square"), InvalidValueError, "at most 0.785"),
        (lambda: rd.SurfaceRule(0.1, radius=1.0, cross_section="square"), InvalidValueError, "for a disc"),
        (lambda: rd.SurfaceRule(0.1, radius=-1.0), InvalidValueError, "radius is -1"),
        (lambda: rd.SurfaceRule(0.1, half_size=(1.0, 0.0)), InvalidValueError, "half_size"),
        (lambda: rd.SurfaceRule(np.nan, radius=1.0), NonFiniteError, "tilt"),
        (lambda: rd.SurfaceRule(0.1, radius=1.0).rotation(np.zeros(3), np.eye(3)), InvalidValueError, "against"),
    ],
)
def test_bad_rules(make: Any, error: type[Exception], told: str) -> None:
    with pytest.raises(error, match=told):
        make()


BOUNDS = {"S1": 1.161, "S2": 1.485, "S3": 1.517}
"""What a rule of seven parameters reaches on the torques of joints 1 and 2, over constant orientation."""


def test_plans_beat_every_rule(scenario: Scenario) -> None:
    spacing = 4e-3
    limit = np.where(np.arange(6) < 2, dynamics().limit, np.inf)
    start = [scenario.motion(scenario.best_rule, spacing)]
    found = rd.fastest(
        scenario.robot,
        scenario.path(spacing),
        Cone(TILT),
        torque=dynamics(),
        torque_limit=limit,
        rate=np.full(6, np.inf),
        start=start,
        max_iterations=4,
    )
    rules = [speeds(scenario.robot, scenario.motion(rule, spacing))["tau12"] for rule in RULES]
    ratio = found.speed.speed / speeds(scenario.robot, scenario.motion("constant", spacing))["tau12"]
    assert found.speed.speed > max(rules)
    assert ratio > BOUNDS[scenario.name]
    frames = scenario.path(spacing).rotation
    assert frames is not None
    assert found.trajectory.path.rotation is not None
    assert Cone(TILT).signed_distance(frames.transpose(0, 2, 1) @ found.trajectory.path.rotation).max() <= 1e-9
