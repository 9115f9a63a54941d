"""Bodies, obstacles and their distances: scipy, differences, obstacles that move, URDF files, wrong arguments."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import redundancy as rd
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from tests.reference.chain import F64, random_frame
from tests.reference.differences import difference

PANDA, UR5E = rd.robots.get("panda"), rd.robots.get("ur5e")
Q = np.array([0.1, 0.2, -0.3, -1.4, 0.2, 1.6, 0.4])
POINTS = np.random.default_rng(0).uniform(-0.2, 0.2, (14, 3))
SHAPES = {
    "sphere": rd.Shape.sphere(0.12),
    "capsule": rd.Shape.capsule(0.06, 0.3),
    "cuboid": rd.Shape.cuboid([0.1, 0.2, 0.3]),
    "hull": rd.Shape.hull(POINTS),
    "rounded": rd.Shape.cuboid([0.1, 0.2, 0.3]).grown(0.05),
}
FIXED = rd.Robot.from_dh([0.0], [0.0], [0.0], [0.0], name="axis")
"""One joint about z: its link is the world at zero."""


def pair(first: rd.Shape, pose: F64, second: rd.Shape, other: F64) -> rd.Proximity:
    scene = rd.Scene(FIXED, [rd.Body("link", 0, first, pose)], {"obstacle": (second, other)})
    (found,) = scene.near([0.0])
    return found


def core(shape: rd.Shape) -> F64:
    """Corners of what is grown by the radius."""
    if shape.size is None:
        return shape.vertices
    signs = np.array(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5])).reshape(3, -1).T
    corners: F64 = np.unique(signs * np.array(shape.size), axis=0)
    return corners


def reference(first: rd.Shape, pose: F64, second: rd.Shape, other: F64) -> float:
    """The distance of two hulls of corners by convex combinations, less the radii; for shapes apart only."""
    a, b = (core(shape) @ frame[:3, :3].T + frame[:3, 3] for shape, frame in ((first, pose), (second, other)))
    n, m = len(a), len(b)
    one = np.r_[np.ones(n), np.zeros(m)], np.r_[np.zeros(n), np.ones(m)]

    def cost(w: F64) -> tuple[float, F64]:
        apart = w[:n] @ a - w[n:] @ b
        return float(0.5 * apart @ apart), np.r_[a @ apart, -b @ apart]

    found = minimize(
        cost,
        np.r_[np.full(n, 1.0 / n), np.full(m, 1.0 / m)],
        jac=True,
        bounds=[(0.0, 1.0)] * (n + m),
        constraints=[{"type": "eq", "fun": lambda w, e=e: e @ w - 1.0, "jac": lambda w, e=e: e} for e in one],
        method="SLSQP",
        options={"ftol": 1e-15, "maxiter": 500},
    )
    return float(np.sqrt(2.0 * found.fun)) - first.radius - second.radius


def place(at: F64, seed: int) -> F64:
    frame = random_frame(np.random.default_rng(seed))
    frame[:3, 3] = at
    return frame


@pytest.mark.parametrize("second", SHAPES)
@pytest.mark.parametrize("first", SHAPES)
def test_distances_of_shapes_apart(first: str, second: str) -> None:
    rng = np.random.default_rng(1)
    for seed in range(5):
        way = rng.standard_normal(3)
        pose, other = place(np.zeros(3), seed), place(way / np.linalg.norm(way) * rng.uniform(0.75, 1.5), 50 + seed)
        found = pair(SHAPES[first], pose, SHAPES[second], other)
        assert found.names == ("link", "obstacle")
        assert found.distance == pytest.approx(reference(SHAPES[first], pose, SHAPES[second], other), abs=1e-6)
        p, q = found.points
        assert np.linalg.norm(q - p) == pytest.approx(found.distance, abs=1e-9)
        np.testing.assert_allclose(found.normal * found.distance, q - p, rtol=0, atol=1e-9)
        # The other way round it is the same.
        turned = pair(SHAPES[second], other, SHAPES[first], pose)
        assert turned.distance == pytest.approx(found.distance, abs=1e-9)
        # A supporting plane: nothing of either is nearer along the normal.
        for shape, frame, point, sign in ((first, pose, p, 1.0), (second, other, q, -1.0)):
            corners = core(SHAPES[shape]) @ frame[:3, :3].T + frame[:3, 3]
            beyond = sign * (corners - point) @ found.normal + SHAPES[shape].radius
            assert beyond.max() < 1e-7


def test_depths() -> None:
    eye = np.eye(4)
    for depth in (1e-9, 0.01, 0.15, 0.2):
        assert pair(SHAPES["sphere"], eye, SHAPES["sphere"], place(np.array([0.24 - depth, 0.0, 0.0]), 0)).distance == (
            pytest.approx(-depth, abs=1e-12)
        )
    # A sphere on a box: by the nearest face.
    other = np.eye(4)
    for x in (0.16, 0.1, 0.04, 0.02):
        other[0, 3] = x
        assert pair(SHAPES["cuboid"], eye, SHAPES["sphere"], other).distance == pytest.approx(x - 0.05 - 0.12, abs=1e-9)
    # Boxes, and hulls of their corners, overlap by the same.
    box, hull = SHAPES["cuboid"], rd.Shape.hull(core(SHAPES["cuboid"]))
    for seed in range(10):
        pose, other = place(np.zeros(3), seed), place(np.random.default_rng(seed).uniform(-0.08, 0.08, 3), 99 - seed)
        first, second = pair(box, pose, box, other), pair(hull, pose, hull, other)
        assert first.distance < 0.0
        assert first.distance == pytest.approx(second.distance, abs=1e-6)
        # Moved by its depth along the normal the pair just touches.
        other[:3, 3] += (1e-4 - first.distance) * first.normal
        assert pair(box, pose, box, other).distance > 0.0
    same = pair(SHAPES["sphere"], eye, SHAPES["sphere"], eye)
    assert same.distance == pytest.approx(-0.24)
    assert np.linalg.norm(same.normal) == pytest.approx(1.0)


def robot_scene(second: str) -> rd.Scene:
    bodies = [
        *rd.capsules_along_links(PANDA, 0.05),
        rd.Body("hand", "tool", SHAPES["cuboid"], place(np.full(3, 0.02), 3)),
    ]
    return rd.Scene(
        PANDA, bodies, {second: (SHAPES[second], place(np.array([0.5, -0.5, 0.4]), 4))}, [(0, 5), (0, 6), (1, 6)]
    )


@pytest.mark.parametrize("second", SHAPES)
def test_gradients(second: str) -> None:
    scene, rng, compared = robot_scene(second), np.random.default_rng(5), 0
    for _ in range(4):
        q = Q + rng.uniform(-0.4, 0.4, 7)
        for found in scene.near(q, 0.8):

            def distance(x: F64, names: tuple[str, str] = found.names) -> float:
                return next(pair.distance for pair in scene.near(x) if pair.names == names)

            # Where the nearest points jump there is no gradient to compare with.
            wanted, finer = difference(distance, q, 1e-4), difference(distance, q, 2e-5)
            if found.distance > 1e-3 and np.abs(wanted - finer).max() < 1e-7:
                np.testing.assert_allclose(found.gradient, wanted, rtol=0, atol=2e-6)
                compared += 1
    assert compared >= 8


def test_what_moves_adds_a_drift() -> None:
    scene, pose = robot_scene("cuboid"), place(np.array([0.6, -0.4, 0.4]), 8)
    velocity, h = np.array([0.3, -0.5, 0.2, 0.1, 0.4, -0.3]), 1e-5

    def moved(t: float) -> F64:
        frame = pose.copy()
        frame[:3, :3] = Rotation.from_rotvec(t * velocity[:3]).as_matrix() @ pose[:3, :3]
        frame[:3, 3] += t * velocity[3:]
        return frame

    scene.place("cuboid", pose, velocity)
    np.testing.assert_allclose(scene.pose_of("cuboid"), pose, atol=1e-15)
    drifts = {pair.names: pair.drift for pair in scene.near(Q)}
    sides = []
    for t in (h, -h):
        scene.place("cuboid", moved(t))
        sides.append({pair.names: pair.distance for pair in scene.near(Q)})
        assert all(pair.drift == 0.0 for pair in scene.near(Q))
    assert len(drifts) > 4
    for names, drift in drifts.items():
        assert drift == pytest.approx((sides[0][names] - sides[1][names]) / (2 * h), abs=1e-5), names
        assert drift == 0.0 or "cuboid" in names


def test_near_is_sorted_and_bounded() -> None:
    scene = robot_scene("sphere")
    every = scene.near(Q)
    # The body on the base is looked at beside bodies only.
    assert len(every) == 9
    distances = [found.distance for found in every]
    assert distances == sorted(distances)
    assert [found.distance for found in scene.near(Q, distances[3])] in (distances[:3], distances[:4])
    assert scene.near(Q, distances[0] - 1e-3) == []
    assert scene.distance(Q) == distances[0]
    assert rd.Scene(PANDA, []).distance(Q) == np.inf
    assert repr(every[0]).startswith(f'Proximity("{every[0].names[0]}"')


def test_attributes() -> None:
    scene = robot_scene("hull")
    assert scene.robot is PANDA
    assert [body.name for body in scene.bodies][-1] == "hand"
    assert scene.obstacles == ["hull"]
    assert scene.self_pairs == [(0, 5), (0, 6), (1, 6)]
    assert len(scene.shape_of("hull").vertices) <= 14
    assert scene.shape_of("hull").size is None
    hand = scene.bodies[-1]
    assert (hand.link, scene.bodies[0].link, scene.bodies[1].link) == ("tool", "base", 1)
    np.testing.assert_allclose(hand.pose, place(np.full(3, 0.02), 3), atol=1e-15)
    assert (SHAPES["capsule"].radius, SHAPES["capsule"].size) == (0.06, [0.0, 0.0, 0.3])
    assert (SHAPES["rounded"].radius, SHAPES["rounded"].size) == (0.05, [0.1, 0.2, 0.3])
    assert SHAPES["sphere"].size == [0.0, 0.0, 0.0]
    assert SHAPES["sphere"].vertices.shape == (0, 3)
    assert repr(SHAPES["capsule"]) == "Shape.capsule(0.06, 0.3)"
    scene.place("hull", [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(scene.pose_of("hull"), [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]])


def test_pairs_of_bodies() -> None:
    bodies = rd.capsules_along_links(PANDA, 0.05)
    pairs = rd.self_collision_pairs(PANDA, bodies, Q)
    scene = rd.Scene(PANDA, bodies, self_pairs=pairs)
    assert scene.distance(Q) >= 0.02
    link = {"base": -1} | {k: k for k in range(7)} | {"tool": 7}
    for first, second in pairs:
        assert abs(link[bodies[second].link] - link[bodies[first].link]) >= 2
    assert len(rd.self_collision_pairs(PANDA, bodies, Q, 0.3)) < len(pairs)
    assert len(rd.capsules_along_links(UR5E, 0.05)) >= 4
    frames = PANDA.link_frames(Q)
    # The capsules join the origins of the frames.
    for body in bodies:
        if isinstance(body.link, int) and body.link < 6:
            assert body.shape.size is not None
            ends = (
                frames[body.link] @ body.pose @ np.array([[0, 0, s * 0.5 * body.shape.size[2], 1] for s in (-1, 1)]).T
            ).T
            origins = frames[body.link : body.link + 2, :3, 3]
            assert min(np.abs(ends[:, :3] - o).max() for o in (origins, origins[::-1])) < 1e-12


def sphere(**change: Any) -> rd.Scene:
    given: dict[str, Any] = {"bodies": [rd.Body("ball", 6, SHAPES["sphere"])], "obstacles": {"x": SHAPES["sphere"]}}
    return rd.Scene(PANDA, **(given | change))


BAD: list[tuple[Callable[[], object], type[Exception], str]] = [
    (lambda: rd.Shape.sphere(0.0), rd.InvalidValueError, "radius"),
    (lambda: rd.Shape.sphere(np.nan), rd.InvalidValueError, "radius"),
    (lambda: rd.Shape.capsule(0.1, -1.0), rd.InvalidValueError, "length"),
    (lambda: rd.Shape.cuboid([1.0, 2.0]), rd.ShapeError, "size"),
    (lambda: rd.Shape.cuboid([0.0, 1.0, 1.0]), rd.InvalidValueError, "above 0"),
    (lambda: rd.Shape.cuboid([1.0, np.nan, 1.0]), rd.NonFiniteError, "size"),
    (lambda: rd.Shape.hull(np.eye(3)), rd.InvalidValueError, "at least 4"),
    (lambda: rd.Shape.hull(np.c_[POINTS[:, :2], POINTS[:, :2].sum(1)]), rd.InvalidValueError, "plane"),
    (lambda: rd.Shape.hull(np.ones((4, 2))), rd.ShapeError, "points"),
    (lambda: rd.Shape.hull(np.full((4, 3), np.nan)), rd.NonFiniteError, "points"),
    (lambda: SHAPES["sphere"].grown(-0.1), rd.InvalidValueError, "margin"),
    (lambda: rd.Body("a", "elbow", SHAPES["sphere"]), rd.InvalidValueError, "link is 'elbow'"),
    (lambda: rd.Body("a", -1, SHAPES["sphere"]), rd.InvalidValueError, "link"),
    (lambda: rd.Body("a", 0, SHAPES["sphere"], np.zeros((4, 4))), rd.InvalidValueError, "pose"),
    (lambda: rd.Body("a", 0, SHAPES["sphere"], np.eye(3)), rd.ShapeError, "pose"),
    (lambda: sphere(bodies=[rd.Body("ball", 7, SHAPES["sphere"])]), rd.InvalidValueError, 'body "ball" is 7'),
    (lambda: sphere(self_pairs=[(0, 1)]), rd.InvalidValueError, "self_pairs"),
    (lambda: sphere(self_pairs=[(0, 0)]), rd.InvalidValueError, "self_pairs"),
    (lambda: sphere(obstacles={"x": (SHAPES["sphere"], np.zeros((4, 4)))}), rd.InvalidValueError, 'pose of "x"'),
    (lambda: sphere(obstacles={"x": 3}), TypeError, "tuple"),
    (lambda: sphere().place("y", np.eye(4)), rd.InvalidValueError, "one of the obstacles: x"),
    (lambda: sphere().place("x", np.zeros(2)), rd.ShapeError, "pose"),
    (lambda: sphere().place("x", np.zeros(3), np.zeros(3)), rd.ShapeError, "velocity"),
    (lambda: sphere().place("x", np.zeros(3), np.full(6, np.nan)), rd.NonFiniteError, "velocity"),
    (lambda: sphere().pose_of("y"), rd.InvalidValueError, "name"),
    (lambda: sphere().near(Q[:6]), rd.ShapeError, "q"),
    (lambda: sphere().near(Q * np.nan), rd.NonFiniteError, "q"),
    (lambda: sphere().near(Q, np.nan), rd.InvalidValueError, "influence"),
    (lambda: rd.capsules_along_links(PANDA, 0.0), rd.InvalidValueError, "radius"),
    (lambda: rd.self_collision_pairs(PANDA, [], Q[:6]), rd.ShapeError, "reference"),
    (lambda: rd.bodies_from_urdf("nowhere.urdf"), rd.ModelError, "nowhere.urdf"),
    (lambda: rd.QuadraticProgram(UR5E, rd.Task.full(), scene=sphere()), rd.InvalidValueError, "scene"),
    (
        lambda: rd.QuadraticProgram(PANDA, rd.Task.full(), scene=sphere(), influence=0.01),
        rd.InvalidValueError,
        "influence",
    ),
]


@pytest.mark.parametrize(("call", "error", "message"), BAD)
def test_wrong_arguments(call: Callable[[], object], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        call()


def test_a_position_that_is_not_finite() -> None:
    with pytest.raises(rd.NonFiniteError, match="pose"):
        sphere().place("x", [np.nan, 0.0, 0.0])


def test_the_scene_of_another_robot() -> None:
    with pytest.raises(rd.InvalidValueError, match="another robot"):
        rd.QuadraticProgram(rd.robots.get("kuka_iiwa14"), rd.Task.full(), scene=sphere())


URDF = """<robot name="two">
<link name="base"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.2 0.3 0.2"/></geometry></collision></link>
<link name="upper">
<collision name="tube"><origin xyz="0.25 0 0" rpy="0 1.5707963267948966 0"/>
<geometry><cylinder radius="0.05" length="0.5"/></geometry></collision>
<collision><geometry><sphere radius="0.07"/></geometry></collision>
</link>
<link name="lower"><collision><origin xyz="0.1 0 0"/>
<geometry><mesh filename="part.stl" scale="2 1 1"/></geometry></collision></link>
<joint name="one" type="revolute"><parent link="base"/><child link="upper"/><origin xyz="0 0 0.3"/><axis xyz="0 0 1"/>
<limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
<joint name="two" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" velocity="1" effort="1"/></joint>
</robot>
"""
CORNERS = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])


def write_stl(path: Path) -> None:
    lines = ["solid part"]
    for face in ((0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)):
        lines += ["facet normal 0 0 0", "outer loop", *(f"vertex {x} {y} {z}" for x, y, z in CORNERS[list(face)])]
        lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid part", ""]))


def test_urdf(tmp_path: Path) -> None:
    file = tmp_path / "two.urdf"
    file.write_text(URDF)
    write_stl(tmp_path / "part.stl")
    robot, bodies = rd.Robot.from_urdf(file), rd.bodies_from_urdf(file)
    assert len(bodies) == 4
    base, tube, ball, part = bodies
    assert [base.link, tube.link, ball.link] == ["base", 0, 0]
    assert base.shape.size == pytest.approx([0.2, 0.3, 0.2])
    assert tube.shape.size is not None
    # The capsule holds the cylinder.
    assert tube.shape.radius >= 0.05
    assert tube.shape.size[2] + 2.0 * tube.shape.radius >= 0.5
    assert ball.shape.radius == pytest.approx(0.07)
    np.testing.assert_allclose(
        np.sort(part.shape.vertices, axis=0), np.sort(CORNERS * [2.0, 1.0, 1.0], axis=0), atol=1e-7
    )
    # Where the file puts them: at zero the chain is straight along x.
    scene = rd.Scene(robot, bodies, {"point": rd.Shape.sphere(0.01)})
    scene.place("point", [0.6, 0.0, 1.3])
    found = {pair.names[0]: pair for pair in scene.near([0.0, 0.0])}
    assert set(found) == {body.name for body in (tube, ball, part)}
    assert found[ball.name].distance == pytest.approx(np.hypot(0.6, 1.0) - 0.08, abs=1e-9)
    assert found[part.name].distance == pytest.approx(0.9 - 0.01, abs=1e-7)
    scene.place("point", [0.25, 0.0, 1.3])
    assert scene.near([0.0, 0.0])[0].distance == pytest.approx(1.0 - tube.shape.radius - 0.01, abs=1e-9)


def test_broken_urdfs(tmp_path: Path) -> None:
    file = tmp_path / "two.urdf"
    file.write_text(URDF)
    with pytest.raises(rd.ModelError, match=r"part\.stl"):
        rd.bodies_from_urdf(file)
    write_stl(tmp_path / "part.stl")
    for text, other in (('radius="0.07"', 'radius="-1"'), ("0.2 0.3 0.2", "0.2 0.3"), ("part.stl", "part.step")):
        file.write_text(URDF.replace(text, other))
        with pytest.raises((rd.ModelError, rd.InvalidValueError)):
            rd.bodies_from_urdf(file)
    (tmp_path / "part.stl").write_text("solid part\nfacet normal 0 0 0\nouter loop\nvertex 0 0\n")
    file.write_text(URDF)
    with pytest.raises(rd.ModelError):
        rd.bodies_from_urdf(file)
