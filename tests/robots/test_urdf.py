"""URDFs as people have them: beside pinocchio, by hand, with faults, mutated, long."""

import re
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import numpy as np
import pytest
import redundancy as rd
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from tests.reference.urdfs import ARM, FILES, LIMIT, TRANSMISSION, joint, links, robot
from tests.soak import urdf as soak

INF = np.inf


@pytest.fixture
def arm(tmp_path: Path) -> Callable[..., rd.Robot]:
    """Writes a text, read as a robot."""

    def read(text: str | bytes, **asked: object) -> rd.Robot:
        file = tmp_path / "arm.urdf"
        file.write_bytes(text.encode() if isinstance(text, str) else text)
        return rd.Robot.from_urdf(file, **asked)  # type: ignore[arg-type]

    return read


@pytest.mark.parametrize("name", FILES)
def test_every_chain_equals_pinocchio(tmp_path: Path, name: str) -> None:
    pytest.importorskip("pinocchio")
    file = tmp_path / "it.urdf"
    file.write_bytes(FILES[name])
    found = soak.Found()
    soak.check(file, found)
    assert found.files["loaded by pinocchio"] == 1
    assert found.chains["agree"] > 0
    assert not found.faults


def test_by_hand(arm: Callable[..., rd.Robot]) -> None:
    text = robot(
        links("a b c"),
        joint("one", "a", "b", '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="2" effort="1"/>'),
        joint(
            "two",
            "b",
            "c",
            '<origin xyz="1 0 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" velocity="0.2" effort="1"/>',
            "prismatic",
        ),
    )
    read = arm(text)
    assert (read.name, read.joints, read.joint_names) == ("it", "RP", ("one", "two"))
    np.testing.assert_allclose(read.fk([np.pi / 2, 0.25])[:3, 3], [0, 1.25, 0], atol=1e-15)
    np.testing.assert_array_equal(read.q_max, [1.0, 0.5])
    np.testing.assert_array_equal(read.qd_max, [2.0, 0.2])
    assert arm(text, tip="b").n == 1
    assert arm(text, base="b").joint_names == ("two",)
    utf16 = text.encode("utf-16")
    assert arm(utf16) == read


LINK = '<link name="b"/>'
TWO = robot(links("a b"), joint("elbow", "a", "b", f'<axis xyz="0 0 1"/>{LIMIT}'))


@pytest.mark.parametrize(
    "inside",
    [
        "<inertial><mass value='1'/></inertial>",
        "<inertial><mass value='heavy'/><origin xyz='1 2'/></inertial>",
        "<visual><geometry><mesh/></geometry></visual>",
        "<visual><geometry/></visual><visual/>",
        '<visual><geometry><box size="1 1 1"/></geometry><material name="m"><color rgba="1 1 1"/></material></visual>',
        '<visual><geometry><sphere/></geometry><material name="m"><texture/></material></visual>',
        '<collision><origin xyz="nan"/><geometry><mesh/></geometry></collision>',
        "<who:knows what='&nothing;'/>Tom &amp; Jerry<![CDATA[<link>]]>",
    ],
)
def test_what_is_no_kinematics_refuses_nothing(arm: Callable[..., rd.Robot], inside: str) -> None:
    plain = arm(TWO)
    assert arm(TWO.replace(LINK, f'<link name="b">{inside}</link>')) == plain
    assert arm(TWO.replace("</robot>", TRANSMISSION + "</robot>")) == plain
    wild = '<dynamics damping="x"/><safety_controller/><calibration rising="?"/>'
    assert arm(TWO.replace("</joint>", wild + "</joint>")) == plain


def test_what_is_beside_the_chain_refuses_nothing(arm: Callable[..., rd.Robot]) -> None:
    beside = links("c d e") + joint("loose", "a", "c", '<origin xyz="1"/>', "floating")
    beside += joint("ball", "a", "d", "<axis/>", "spherical") + joint("odd", "a", "e", '<limit lower="nan"/><mimic/>')
    text = TWO.replace("</robot>", beside + "</robot>")
    assert arm(text, tip="b") == arm(TWO)
    for tip, name in (("c", "loose"), ("d", "ball"), ("e", "odd")):
        with pytest.raises(rd.ModelError, match=rf'arm\.urdf:\d+: joint "{name}"'):
            arm(text, tip=tip)


@pytest.mark.parametrize(
    ("limit", "low", "high", "speed"),
    [
        ("", -INF, INF, INF),
        ('<limit effort="1" velocity="3"/>', -INF, INF, 3.0),
        ("<limit/>", -INF, INF, INF),
        ('<limit upper="1.5" velocity="0"/>', 0.0, 1.5, INF),
        ('<limit lower="-1.5" effort="?"/>', -1.5, 0.0, INF),
        ('<limit lower="-inf" upper="inf" velocity="inf"/>', -INF, INF, INF),
        ('<limit lower="0" upper="0.0" effort="0" velocity="0"/>', -INF, INF, INF),
        ('<limit lower=" -1 " upper="+.5e1"/>', -1.0, 5.0, INF),
    ],
)
def test_limits(arm: Callable[..., rd.Robot], limit: str, low: float, high: float, speed: float) -> None:
    read = arm(TWO.replace(LIMIT, limit))
    assert (read.q_min[0], read.q_max[0], read.qd_max[0]) == (low, high, speed)
    turning = arm(TWO.replace(LIMIT, limit).replace("revolute", "continuous"))
    assert (turning.q_min[0], turning.q_max[0], turning.qd_max[0]) == (-INF, INF, speed)


def test_limits_in_place_of_those_of_the_file(arm: Callable[..., rd.Robot]) -> None:
    read = arm(ARM, limits={"one": (-1, 2), "two": {"velocity": 0.1}, "three": {"low": -3.0}})
    np.testing.assert_array_equal(read.q_min, [-1, -2, -3])
    np.testing.assert_array_equal(read.q_max, [2, 1.5, INF])
    np.testing.assert_array_equal(read.qd_max, [2, 0.1, INF])
    assert arm(ARM, limits={"one": np.array([-1, 2])}) == arm(ARM, limits={"one": [-1.0, 2.0]})
    # None leaves what the file says; a joint beside the chain may be named.
    assert arm(ARM, tip="b", limits={"one": (None, None), "three": (0, 1)}) == arm(ARM, tip="b")


def test_a_joint_whose_limits_are_equal_is_fixed_there(arm: Callable[..., rd.Robot]) -> None:
    held = arm(ARM, limits={"two": (0.25, 0.25)})
    assert held.joint_names == ("one", "three")
    free = arm(ARM)
    np.testing.assert_allclose(held.fk([0.3, -0.4]), free.fk([0.3, 0.25, -0.4]), atol=1e-15)
    np.testing.assert_allclose(held.fk([0.3, -0.4]), free.with_fixed({1: 0.25}).fk([0.3, -0.4]), atol=1e-15)
    locked = FILES["locked"]
    assert arm(locked).joint_names == ("free",)
    assert arm(locked, limits={"held": (-1, 1)}).joint_names == ("held", "free")
    with pytest.raises(rd.ModelError, match=r'arm\.urdf:\d+: .*"a" to "b" has no joint that moves.*hold elbow'):
        arm(TWO, limits={"elbow": (1, 1)})


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ({"elbo": (0, 1)}, 'limits is for "elbo", expected names of joints, perhaps "elbow"'),
        ({"elbow": (1, 0)}, 'joint "elbow": limits 1 and 0'),
        ({"elbow": (float("nan"), 0)}, 'joint "elbow": limits NaN and 0'),
        ({"elbow": (INF, INF)}, 'joint "elbow": limits inf and inf'),
        ({"elbow": {"velocity": -1.0}}, 'joint "elbow": a limit of velocity of -1'),
        ({"elbow": {"speed": 1.0}}, "velocity"),
        ({"elbow": (1, 2, 3)}, "low, high"),
        ({"elbow": "wide"}, "low, high"),
        ({3: (0, 1)}, "names of joints"),
    ],
)
def test_limits_that_are_refused(arm: Callable[..., rd.Robot], limits: dict[str, object], message: str) -> None:
    with pytest.raises(rd.RedundancyError, match=re.escape(message)):
        arm(TWO, limits=limits)


CHILD = '<child link="c"/>'
FAULTS: list[tuple[str, str, str]] = [
    ("</robot>", "", r":2: <robot> is not closed"),
    ("<robot", "<robut", r":2: .*<robut>"),
    ('<robot name="it">', '<robot name="it"><link name="z"></joint></link>', r":2: .*XML"),
    ("</robot>\n", "</robot><robot/>", r":9: a second root element <robot>"),
    ('xyz="0 0 1"', 'xyz="0 0 0"', r':5: joint "one": xyz of <axis> is "0 0 0"'),
    ('xyz="0 0 1"', 'xyz="0 zero 1"', r':5: joint "one": xyz of <axis> is "0 zero 1"'),
    ('xyz="0 0 1"', 'xyz="0 0 inf"', r':5: joint "one": xyz of <axis>'),
    ('<axis xyz="0 0 1"/>', "<axis/>", r':5: joint "one": xyz of <axis> is missing'),
    ('xyz="0.4 0 0"', 'xyz="nan 0 0"', r':6: joint "two": xyz of <origin>'),
    ('xyz="0.4 0 0"', 'xyz="0.4 0"', r':6: joint "two": xyz of <origin>'),
    ('xyz="0.4 0 0"', 'xyz="0.4 1e308 0"', r':6: joint "two": .*1e308, expected at most 1e6 m'),
    ('xyz="0.4 0 0"', 'xyz="${length} 0 0"', r':6: joint "two": xyz of <origin> .*xacro first'),
    ('rpy="0 0 3"', 'rpy="0 0 3 4"', r':7: joint "three": rpy of <origin>'),
    ('lower="-2"', 'lower="nan"', r':5: joint "one": lower of <limit> is "nan"'),
    ('upper="1.5"', 'upper="far"', r':5: joint "one": upper of <limit> is "far"'),
    ('upper="1.5"', 'upper="-3"', r':5: joint "one": limits -2 and -3'),
    ('velocity="2"', 'velocity="nan"', r':5: joint "one": velocity of <limit> is "nan"'),
    ('velocity="2"', 'velocity="-2"', r':5: joint "one": a limit of velocity of -2'),
    ('type="prismatic"', 'type="floating"', r':6: joint "two": its type is floating'),
    ('type="prismatic"', 'type="planar"', r':6: joint "two": its type is planar'),
    ('type="prismatic"', 'type="spring"', r':6: joint "two": its type is spring'),
    (' type="prismatic"', "", r':6: joint "two": its type is missing'),
    ('name="two" ', "", r":6: a joint without a name"),
    ('<link name="d"/>', "<link/>", r":3: a link without a name"),
    ('<link name="d"/>', '<link name="c"/>', r':3: a second link "c"; the first is on line 3'),
    ('name="two"', 'name="one"', r':6: a second joint "one"; the first is on line 5'),
    (CHILD, '<child link="b"/>', r':6: link "b" is the child of two joints, "one" \(line 5\) and "two"'),
    (CHILD, '<child link="bb"/>', r':6: joint "two": its child link "bb" does not exist'),
    (CHILD, "<child/>", r':6: joint "two": no <child link'),
    ('<parent link="b"/>', "", r':6: joint "two": no <parent link'),
    ('<parent link="a"/>', '<parent link="d"/>', r":\d+: the joints form a loop through the links [bcd, ]+"),
    ('<parent link="a"/>', '<parent link="b"/>', r":\d+: the joints form a loop through the links b$"),
    ('<link name="d"/>', '<link name="d"/><link name="x"/>', r":3: several links are no joint's child \(a, x\)"),
    ('<link name="d"/>', '<link name="d"/><xacro:leg side="left"/>', r":3: <xacro:leg> is a macro.*xacro first"),
    ("<axis", '<mimic joint="tree"/><axis', r':5: joint "one": it mimics "tree", .*perhaps "three"'),
    ("<axis", '<mimic joint="end"/><axis', r':5: joint "one": it mimics joint "end", which does not move'),
    ("<axis", '<mimic joint="one"/><axis', r':5: joint "one": it mimics itself'),
    ("<axis", '<mimic joint="two" multiplier="x"/><axis', r':5: joint "one": multiplier of <mimic> is "x"'),
]


@pytest.mark.parametrize(("old", "new", "message"), FAULTS)
def test_faults_are_told_by_file_line_and_name(arm: Callable[..., rd.Robot], old: str, new: str, message: str) -> None:
    assert arm(ARM).n == 3
    with pytest.raises(rd.ModelError, match=r"arm\.urdf" + message):
        arm(ARM.replace(old, new, 1))


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"tip": "tol"}, 'tip is "tol", expected one of the links, perhaps "tool": a, b, c, d, base, tool'),
        ({"base": "zzz"}, 'base is "zzz", expected one of the links: a, b, c, d, base, tool'),
        ({"base": "d", "tip": "tool"}, "a link on the way from the root"),
        ({}, "3 end links (d, base, tool): name one as tip (tip=, --tip)"),
        ({"base": "b"}, "2 end links (d, tool)"),
    ],
)
def test_links_that_are_asked_for(arm: Callable[..., rd.Robot], asked: dict[str, str], message: str) -> None:
    with pytest.raises(rd.RedundancyError, match=re.escape(message)):
        arm(FILES["three ends"], **asked)


def test_the_only_end_below_a_base(arm: Callable[..., rd.Robot]) -> None:
    text = (
        FILES["three ends"].decode().replace("</robot>", links("hand") + joint("grip", "d", "hand", LIMIT) + "</robot>")
    )
    assert arm(text, base="d").joint_names == ("grip",)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(rd.ModelError, match=r"none\.urdf"):
        rd.Robot.from_urdf(tmp_path / "none.urdf")
    for content in (b"", b"\x00\x01", b"<", b"robot", b"\xff\xfe", b"<!-- -->"):
        file = tmp_path / "bad.urdf"
        file.write_bytes(content)
        with pytest.raises(rd.ModelError, match=r"bad\.urdf:1"):
            rd.Robot.from_urdf(file)


def test_entities_are_not_expanded(arm: Callable[..., rd.Robot]) -> None:
    laughs = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 30))
    head = f'<!DOCTYPE robot [<!ENTITY l0 "0">{laughs}]>\n<robot'
    text = ARM.replace("<robot", head, 1)
    assert arm(text) == arm(ARM)
    with pytest.raises(rd.ModelError, match="l29"):
        arm(text.replace('xyz="0.4 0 0"', 'xyz="&l29; 0 0"'))
    assert arm(ARM.replace('xyz="0.4 0 0"', 'xyz="&#48;.4 0 0"')) == arm(ARM)


def test_more_joints_than_a_robot_has(arm: Callable[..., rd.Robot]) -> None:
    names = [f"l{i}" for i in range(18)]
    ways = "".join(joint(f"j{i}", names[i], names[i + 1], LIMIT) for i in range(17))
    text = robot(links(" ".join(names)), ways)
    assert arm(text, tip="l16").n == 16
    with pytest.raises(rd.ModelError, match=r'"l0" to "l17" has 17 joints that move .*j0, j1.*expected 1 to 16'):
        arm(text)


def test_fifty_thousand_links_and_deep_nesting(arm: Callable[..., rd.Robot]) -> None:
    def text(n: int) -> str:
        names = links(" ".join(f"link{i}" for i in range(n)))
        ways = "".join(joint(f"j{i}", f"link{i}", f"link{i + 1}", "", "fixed") for i in range(n - 2))
        return robot(names, ways, joint("last", f"link{n - 2}", f"link{n - 1}", LIMIT))

    large = text(50_000)
    start = perf_counter()
    assert arm(large).n == 1
    # A second on any machine; a pass over all joints for each of them takes minutes.
    assert perf_counter() - start < 20.0
    with pytest.raises(rd.InvalidValueError, match="perhaps"):
        arm(large, tip="link5000x")
    loop = large.replace('<parent link="link0"/>', '<parent link="link49999"/>')
    with pytest.raises(rd.ModelError, match=r"loop through the links .*\(4\d+ in all\)"):
        arm(loop)
    deep = "<g>" * 300_000 + "</g>" * 300_000
    assert arm(TWO.replace(LINK, f'<link name="b"><visual>{deep}</visual></link>')).n == 1
    with pytest.raises(rd.ModelError, match="not closed"):
        arm('<robot><link name="a"><visual>' + "<g>" * 300_000)


WORDS = [
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-320",
    "0",
    "-1",
    "1,5",
    "x",
    "",
    "0 0",
    "0 0 0",
    "1 1 1 1",
    "ü",
    "&amp;",
]
BASES = [FILES[name].decode() for name in ("arm", "axes", "locked", "three ends", "fingers")]


@st.composite
def mutants(draw: st.DrawFn) -> str:
    """Draw a small URDF with some attributes or elements changed, gone or doubled."""
    text = draw(st.sampled_from(BASES))
    for _ in range(draw(st.integers(1, 3))):
        kind = draw(st.sampled_from(["value", "value", "gone", "element gone", "element twice", "cut"]))
        pattern = r' [a-z]+="[^"]*"' if kind in ("value", "gone") else r"<[a-z]+ [^<>]*/>" if kind != "cut" else r"."
        places = list(re.finditer(pattern, text))
        assume(places)
        place = draw(st.sampled_from(places))
        found = place.group()
        word = found.split('"')[0] + '"' + draw(st.sampled_from(WORDS)) + '"'
        new = {"value": word, "gone": "", "element gone": "", "element twice": 2 * found}.get(kind)
        text = text[: place.start()] + (new + text[place.end() :] if new is not None else "")
    return text


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(text=mutants())
def test_mutants_are_what_pinocchio_reads_or_told_by_name(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    pytest.importorskip("pinocchio")
    file = tmp_path_factory.getbasetemp() / "mutant.urdf"
    file.write_text(text, encoding="utf-8")
    names = set(re.findall(r' (?:name|link)="([^"]+)"', text))
    other = soak.peer(file)
    tips = other.tree.ends if other else [None]
    for tip in tips:
        try:
            read = rd.Robot.from_urdf(file, tip=tip)
        except rd.RedundancyError as error:
            message = str(error)
            assert "mutant.urdf" in message or tip in message if tip else "mutant.urdf" in message
            if other is not None:
                assert any(name in message for name in names)
            continue
        assert np.isfinite(read.fk(read.middle)).all()
        if other is not None and tip is not None:
            assert other.compare(read, tip, 0) <= soak.BAR
