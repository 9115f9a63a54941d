"""Mesh files that URDFs name: whole ones, and ones that are not what they say."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd

from tests.reference.urdfs import LIMIT, joint, links, robot

CORNERS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]


def stl(count: int = 4, header: bytes = b"solid") -> bytes:
    """A tetrahedron as a binary STL that counts its triangles."""
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *CORNERS[list(face)].ravel(), 0) for face in FACES)
    return header.ljust(80) + struct.pack("<I", count) + body


def text_stl() -> str:
    """The same as text."""
    facets = [
        "facet normal 0 0 0\nouter loop\n"
        + "".join(f"  vertex {x:e} {y:e} {z:e}\n" for x, y, z in CORNERS[list(face)])
        + "endloop\nendfacet\n"
        for face in FACES
    ]
    return "solid it\n" + "".join(facets) + "endsolid it\n"


def obj(faces: str) -> bytes:
    """The same as OBJ, with a corner far away that no face has."""
    vertices = "".join(f"v {x} {y} {z} 1.0\n" for x, y, z in [*CORNERS.tolist(), (9.0, 9.0, 9.0)])
    return ("mtllib none.mtl\n" + vertices + "vn 0 0 1\n" + faces).encode()


GOOD = "f 1 3 2\nf 1/1/1 2/2/1 4/3/1\nf 2//1 3//1 4//1\nf -3 -5 -2\n"


@pytest.fixture
def hull(tmp_path: Path) -> Callable[[str, bytes], np.ndarray]:
    """The corners of the hull that a robot has of a mesh file."""
    body = '<link name="b"><collision><geometry><mesh filename="{}"/></geometry></collision></link>'

    def read(name: str, content: bytes) -> np.ndarray:
        (tmp_path / name).write_bytes(content)
        file = tmp_path / "it.urdf"
        file.write_text(robot(links("a"), body.format(name), joint("j", "a", "b", LIMIT)), encoding="utf-8")
        (part,) = rd.bodies_from_urdf(file)
        return part.shape.vertices

    return read


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("m.stl", stl()),
        ("m.STL", stl(header=b"CAD")),
        ("m.stl", stl() + b"\r\n"),
        ("m.stl", text_stl().encode()),
        ("m.stl", b"\n " + text_stl().replace("\n", "\r\n").upper().encode()),
        ("m.obj", obj(GOOD)),
    ],
)
def test_whole_meshes(hull: Callable[[str, bytes], np.ndarray], name: str, content: bytes) -> None:
    found = hull(name, content)
    np.testing.assert_allclose(found[np.lexsort(found.T)], CORNERS[np.lexsort(CORNERS.T)], atol=1e-7)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("m.stl", stl(4_000_000_000), "284 bytes that counts 4000000000 triangles, for which 200000000084 bytes"),
        ("m.stl", stl(5), "284 bytes that counts 5 triangles, for which 334 bytes"),
        ("m.stl", stl(3), "284 bytes that counts 3 triangles, for which 234 bytes"),
        ("m.stl", stl()[:-1], "283 bytes"),
        ("m.stl", b"", "0 bytes"),
        ("m.stl", b"solid", "5 bytes"),
        ("m.stl", text_stl().encode()[:-20], "bytes"),
        ("m.stl", text_stl().replace("vertex 0.0", "vertex zero", 1).encode(), "line 4"),
        ("m.stl", text_stl().replace("  vertex", "  point", 1).encode(), "11 vertices"),
        ("m.stl", stl().replace(struct.pack("<f", 1.0), struct.pack("<f", np.nan)), "finite"),
        ("m.obj", obj("f 1 2 99\n"), "a face of vertex 99, expected at most the 5"),
        ("m.obj", obj("f 1 2 0\n"), 'line 8: "0"'),
        ("m.obj", obj("f 1 2 -6\n"), 'line 8: "-6"'),
        ("m.obj", obj("f 1 x 3\n"), 'line 8: "x"'),
        ("m.obj", b"v 1 2\n", "line 1"),
        ("m.obj", obj("f 1 2 3\n"), "."),
        ("m.dae", b"<COLLADA/>", "expected a mesh in a file .stl or .obj"),
    ],
)
def test_meshes_that_are_not_what_they_say(
    hull: Callable[[str, bytes], np.ndarray], name: str, content: bytes, message: str
) -> None:
    with pytest.raises(rd.ModelError, match=rf'it\.urdf:\d+: collision "b": .*{message}') as caught:
        hull(name, content)
    assert message == "." or name in str(caught.value)


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<collision/>", "no box, cylinder, capsule, sphere or mesh"),
        ("<collision><geometry/></collision>", "no box, cylinder, capsule, sphere or mesh"),
        ("<collision><geometry><mesh/></geometry></collision>", "no filename in <mesh>"),
        ("<collision><geometry><sphere/></geometry></collision>", "no radius in <sphere>"),
        ('<collision><geometry><sphere radius="-1"/></geometry></collision>', "radius is -1"),
        ('<collision><geometry><box size="1 1"/></geometry></collision>', 'size of <box> is "1 1"'),
        ('<collision><origin xyz="1e9 0 0"/><geometry><box size="1 1 1"/></geometry></collision>', "at most 1e6 m"),
    ],
)
def test_collisions_are_told_by_name_and_line(tmp_path: Path, inside: str, message: str) -> None:
    file = tmp_path / "it.urdf"
    link = f'<link name="b">\n{inside}</link>'
    file.write_text(robot(links("a"), link, joint("j", "a", "b", LIMIT)), encoding="utf-8")
    assert rd.Robot.from_urdf(file).n == 1
    with pytest.raises(rd.ModelError, match=rf'it\.urdf:5: collision "b": .*{message}'):
        rd.bodies_from_urdf(file)


def test_bodies_of_joints_that_limits_fix(tmp_path: Path) -> None:
    ball = '<link name="{}"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>'
    text = robot(
        links("a"),
        ball.format("b"),
        ball.format("c"),
        joint("one", "a", "b", f'<axis xyz="0 0 1"/>{LIMIT}'),
        joint("two", "b", "c", f'<origin xyz="1 0 0"/><axis xyz="0 0 1"/>{LIMIT}'),
    )
    file = tmp_path / "it.urdf"
    file.write_text(text, encoding="utf-8")
    limits = {"one": (0.5, 0.5)}
    assert [body.link for body in rd.bodies_from_urdf(file)] == [0, 1]
    bodies = rd.bodies_from_urdf(file, limits=limits)
    assert [body.link for body in bodies] == ["base", 0]
    scene = rd.Scene(rd.Robot.from_urdf(file, limits=limits), bodies, {"point": rd.Shape.sphere(0.01)})
    scene.place("point", [np.cos(0.5), np.sin(0.5), 0.5])
    near = {pair.names[0]: pair.distance for pair in scene.near([0.0])}
    assert near["c"] == pytest.approx(0.5 - 0.11, abs=1e-12)
