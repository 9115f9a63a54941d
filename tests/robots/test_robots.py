"""Packaged robots against figures of their makers; files of robots against the robots they came from."""

import pickle
from pathlib import Path

import numpy as np
import pytest
import redundancy as rd
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference.chain import F64, Chain, chains, random_frame
from tests.reference.files import DATA

KINDS = {
    "abb_irb120": "RRRRRR",
    "abb_irb2400": "RRRRRR",
    "baxter_left": "RRRRRRR",
    "fanuc_crx10ia": "RRRRRR",
    "fanuc_crx10ia_l": "RRRRRR",
    "fanuc_m16ib": "RRRRRR",
    "fanuc_m710ic50": "RRRRRR",
    "fanuc_m710ic50_milling": "RRRRRR",
    "kuka_iiwa14": "RRRRRRR",
    "panda": "RRRRRRR",
    "planar_3r": "RRR",
    "planar_4r": "RRRR",
    "puma500": "RRRRRR",
    "stanford_arm": "RRPRRR",
    "ur10e": "RRRRRR",
    "ur5e": "RRRRRR",
}
# Tool point at all joints zero [m], from the drawings: sums of link lengths along the axes.
STRETCHED = {
    "abb_irb2400": (0.100 + 0.755 + 0.085, 0.0, 0.615 + 0.705 + 0.135),
    "abb_irb120": (0.302 + 0.072, 0.0, 0.290 + 0.270 + 0.070),
    "kuka_iiwa14": (0.0, 0.0, 0.360 + 0.420 + 0.400 + 0.126),
    "panda": (0.088, 0.0, 0.333 + 0.316 + 0.384 - 0.107),
    "planar_3r": (3.0, 0.0, 0.0),
    "planar_4r": (19.5, 0.0, 0.0),
    "ur5e": (-0.425 - 0.3922, -0.1333 - 0.0996, 0.1625 - 0.0997),
    "ur10e": (-0.6127 - 0.57155, -0.17415 - 0.11655, 0.1807 - 0.11985),
}
# Limits of single joints in data sheets: lower, upper [deg].
LIMITS = {
    ("abb_irb120", 0): (-165.0, 165.0),
    ("abb_irb120", 2): (-110.0, 70.0),
    ("abb_irb2400", 2): (-60.0, 65.0),
    ("abb_irb2400", 5): (-400.0, 400.0),
    ("kuka_iiwa14", 0): (-170.0, 170.0),
    ("kuka_iiwa14", 6): (-175.0, 175.0),
    ("ur5e", 0): (-360.0, 360.0),
    ("fanuc_crx10ia", 0): (-190.0, 190.0),
    ("fanuc_crx10ia_l", 5): (-225.0, 225.0),
}


def test_every_robot_of_the_list_is_there() -> None:
    assert rd.robots.names() == sorted(KINDS)


@pytest.mark.parametrize("name", KINDS)
def test_kinds_limits_and_sources(name: str) -> None:
    robot = rd.robots.get(name)
    assert robot.name == name
    assert robot.joints == KINDS[name]
    assert np.isfinite(robot.q_min).all()
    assert np.isfinite(robot.q_max).all()
    assert (robot.qd_max > 0).all()
    assert rd.robots.describe(name)
    # Stored in rad: no angular range exceeds two and a half turns.
    assert (robot.q_max - robot.q_min <= 5 * np.pi + 1e-9).all()


@pytest.mark.parametrize("name", STRETCHED)
def test_tool_point_at_zero(name: str) -> None:
    robot = rd.robots.get(name)
    np.testing.assert_allclose(robot.fk(np.zeros(robot.n))[:3, 3], STRETCHED[name], atol=1e-9)


@pytest.mark.parametrize(("name", "joint"), LIMITS)
def test_limits_of_data_sheets(name: str, joint: int) -> None:
    robot = rd.robots.get(name)
    limits = np.rad2deg([robot.q_min[joint], robot.q_max[joint]])
    np.testing.assert_allclose(limits, LIMITS[name, joint], atol=1e-9)


def test_panda_equals_its_urdf() -> None:
    urdf = rd.Robot.from_urdf(DATA / "panda.urdf")
    robot = rd.robots.get("panda")
    for q in np.random.default_rng(0).uniform(-2, 2, (20, 7)):
        np.testing.assert_allclose(robot.jacobian(q), urdf.jacobian(q), atol=1e-12)
    np.testing.assert_allclose(robot.q_min, urdf.q_min, atol=1e-12)
    np.testing.assert_allclose(robot.q_max, urdf.q_max, atol=1e-12)


def test_reach_of_the_fanuc() -> None:
    # FANUC: 2050 mm to the wrist centre; Huo's and Leger's table reaches it with the forearm stretched.
    table = rd.robots.get("fanuc_m710ic50").dh
    assert table is not None
    upper, elbow, forearm = table["a"][1], table["a"][2], table["d"][3]
    assert table["a"][0] + upper + np.hypot(elbow, forearm) == pytest.approx(2.050, abs=1e-3)


@settings(max_examples=40)
@given(drawn=chains(), seed=st.integers(0, 2**32 - 1))
def test_saved_robot_loads_bit_for_bit(
    tmp_path_factory: pytest.TempPathFactory, drawn: tuple[Chain, F64], seed: int
) -> None:
    chain, q = drawn
    rng = np.random.default_rng(seed)
    n = chain.n
    lower = np.where(rng.random(n) < 0.3, -np.inf, rng.uniform(-3, 0, n))
    upper = np.where(rng.random(n) < 0.3, np.inf, rng.uniform(0.1, 3, n))
    robot = chain.robot().with_limits(lower, upper, rng.uniform(0.1, 5, n)).with_name('Ä "quoted" \\ name\n#')
    links = rd.Robot.from_links(np.stack([random_frame(rng) for _ in range(n)]), random_frame(rng), chain.joints)
    for each in (robot, links.with_tool(random_frame(rng)).with_base(random_frame(rng))):
        file = tmp_path_factory.mktemp("robot") / "robot.toml"
        rd.robots.save(each, file)
        again = rd.robots.load(file)
        np.testing.assert_array_equal(again.fk(q), each.fk(q))
        for key in ("q_min", "q_max", "qd_max", "qdd_max", "tool", "base", "links", "flange"):
            np.testing.assert_array_equal(getattr(again, key), getattr(each, key))
        assert again == each
        assert pickle.loads(pickle.dumps(each)) == each
        assert list(file.parent.iterdir()) == [file]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('joints = "RR"', 'joints = "RX"'), "joints"),
        (('joints = "RR"', ""), "joints"),
        (("a = [1.0, 0.5]", "a = [1.0]"), r"dh\.a"),
        (("a = [1.0, 0.5]", "a = [1.0, nan]"), r"dh\.a"),
        (("a = [1.0, 0.5]", 'a = [1.0, "x"]'), r"dh\.a"),
        (("a = [1.0, 0.5]", "aa = [1.0, 0.5]"), "did you mean a"),
        (("[units]", "[unit]"), "did you mean units"),
        (('length = "mm"', 'length = "inch"'), "units.length.*inch"),
        (("q_min = [-90, -90]", "q_min = [-90, 95]"), r"q_min\[1\]"),
        (("[dh]", "dh = 3\n[other]"), "dh"),
        (("[dh]", "[dh"), r":\d+:\d+: "),
        (('name = "two"', "name = 'two"), r":\d+:\d+: "),
        (('name = "two"', 'name = "two"\nname = "three"'), r":2:\d+: "),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else None,
)
def test_malformed_file_is_named_with_its_place(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    text = """name = "two"
joints = "RR"
[units]
length = "mm"
angle = "deg"
[dh]
a = [1.0, 0.5]
d = [0, 0]
alpha = [0, 90]
theta = [0, 0]
[limits]
q_min = [-90, -90]
q_max = [90, 90]
"""
    file = tmp_path / "two.toml"
    file.write_text(text, encoding="utf-8")
    robot = rd.robots.load(file)
    np.testing.assert_array_equal(robot.q_max, [np.pi / 2] * 2)
    assert robot.dh is not None
    np.testing.assert_array_equal(robot.dh["a"], [0.001, 0.0005])
    file.write_text(text.replace(*change), encoding="utf-8")
    with pytest.raises(rd.ModelError, match=message) as caught:
        rd.robots.load(file)
    assert str(file) in str(caught.value)


def test_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        rd.robots.load(tmp_path / "none.toml")
    with pytest.raises(FileNotFoundError):
        rd.robots.save(rd.robots.get("panda"), tmp_path / "none" / "robot.toml")


@pytest.mark.parametrize(
    ("name", "nearest"), [("pandda", "panda"), ("UR5E", "ur5e"), ("kuka", "kuka_iiwa14"), ("fanuc_m16", "fanuc_m16ib")]
)
def test_unknown_name_proposes_the_nearest(name: str, nearest: str) -> None:
    with pytest.raises(rd.UnknownRobotError, match=f"'{nearest}'"):
        rd.robots.get(name)
