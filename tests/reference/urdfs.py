"""Small URDFs with what is found in files of robots: all of them load in pinocchio, chain by chain."""


def joint(name: str, parent: str, child: str, rest: str, kind: str = "revolute") -> str:
    """Return a joint element."""
    return f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{rest}</joint>\n'


def links(names: str) -> str:
    """Return empty links."""
    return "".join(f'<link name="{name}"/>' for name in names.split()) + "\n"


def robot(*parts: str) -> str:
    """Return a document."""
    return f'<?xml version="1.0"?>\n<robot name="it">\n{"".join(parts)}</robot>\n'


LIMIT = '<limit lower="-2" upper="1.5" velocity="2" effort="10"/>'
SEEN = """<link name="b"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
</inertial><visual><geometry><mesh filename="package://no/b.dae"/></geometry><material name="grey"/></visual></link>"""
ARM = robot(
    links("a c d e"),
    SEEN,
    joint("one", "a", "b", f'<origin xyz="0 0 0.3" rpy="0 0.1 0"/><axis xyz="0 0 1"/>{LIMIT}'),
    joint("two", "b", "c", f'<origin xyz="0.4 0 0" rpy="1.5707963 0 0.2"/><axis xyz="0.6 0 0.8"/>{LIMIT}', "prismatic"),
    joint("three", "c", "d", '<origin rpy="0 0 3"/><axis xyz="0 -1 0"/>', "continuous"),
    joint("end", "d", "e", '<origin xyz="0 0.1 0"/>', "fixed"),
)
FINGERS = (
    links("palm thumb middle index last"),
    joint("thumb", "palm", "thumb", f'<origin xyz="0 0 0.1"/><axis xyz="0 1 0"/>{LIMIT}'),
    joint(
        "middle",
        "thumb",
        "middle",
        f'<origin xyz="0.1 0 0"/><mimic joint="thumb" multiplier="-0.8" offset="0.1"/>{LIMIT}',
    ),
    joint("index", "palm", "index", f'<axis xyz="0 1 0"/><mimic joint="thumb" multiplier="2"/>{LIMIT}', "prismatic"),
    joint(
        "last",
        "index",
        "last",
        f'<origin xyz="0 0 0.2"/><axis xyz="1 0 0"/><mimic joint="thumb" offset="-0.3"/>{LIMIT}',
    ),
)
TRANSMISSION = """<transmission name="t"><type>Simple</type><joint name="one"><hardwareInterface>x</hardwareInterface>
</joint><actuator name="m"><mechanicalReduction>1</mechanicalReduction></actuator></transmission>
<gazebo reference="b"><plugin:thing speed="fast" speed_2=''/><link name="b"/></gazebo>
<material name="grey"><color rgba="1 1 1 1"/></material>"""

FILES: dict[str, bytes] = {
    "arm": ARM.encode(),
    "much beside": ARM.replace("</robot>", TRANSMISSION + "</robot>").encode(),
    "comments": ARM.replace("<joint", "<!-- <joint name='x'> -- --><joint").replace(" -- -->", " -->").encode(),
    "windows": b"\xef\xbb\xbf" + ARM.replace("\n", "\r\n").encode(),
    "latin 1": ARM.replace("\n<robot", "\n<!-- von M\xfcller -->\n<robot").encode("latin-1"),
    "declared late": b"\n\n" + ARM.encode(),
    "doctype": ARM.replace("<robot", "<!DOCTYPE robot>\n<robot", 1).encode(),
    "axes": robot(
        links("a b c d"),
        joint("none", "a", "b", f'<origin xyz="0 0 1"/>{LIMIT}'),
        joint("long", "b", "c", f'<origin xyz=" 1  0 0"/><axis xyz="0 3e2 -4e2"/>{LIMIT}'),
        joint("slide", "c", "d", f'<axis xyz="1e-3 1e-3 0"/>{LIMIT}', "prismatic"),
    ).encode(),
    "locked": robot(
        links("a b c"),
        joint("held", "a", "b", '<axis xyz="0 1 0"/><limit lower="0.3" upper="0.3" velocity="1" effort="1"/>'),
        joint("free", "b", "c", f'<origin xyz="0 0 1"/><axis xyz="1 0 0"/>{LIMIT}'),
    ).encode(),
    "one side": robot(
        links("a b c"),
        joint("up", "a", "b", '<axis xyz="0 1 0"/><limit upper="1" velocity="0" effort="0"/>'),
        joint("down", "b", "c", '<axis xyz="0 1 0"/><limit lower="-1" velocity="1" effort="1"/>'),
    ).encode(),
    "three ends": robot(
        links("a b c d base tool"),
        joint("one", "a", "b", f'<axis xyz="0 0 1"/>{LIMIT}'),
        joint("two", "b", "c", f'<origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>{LIMIT}'),
        joint("three", "b", "d", f'<origin xyz="0 0.5 0"/><axis xyz="0 1 0"/>{LIMIT}'),
        joint("base", "a", "base", '<origin rpy="0 0 3.14159265"/>', "fixed"),
        joint("tool", "c", "tool", "", "fixed"),
    ).encode(),
    "floating beside": robot(
        links("a b c"),
        joint("one", "a", "b", f'<axis xyz="0 0 1"/>{LIMIT}'),
        joint("loose", "a", "c", "", "floating"),
    ).encode(),
    "fingers": robot(*FINGERS).encode(),
    "mimics of mimics": robot(
        links("a b c d e"),
        joint("one", "a", "b", f'<axis xyz="0 1 0"/><mimic joint="two" multiplier="-2" offset="0.1"/>{LIMIT}'),
        joint("two", "b", "c", f'<origin xyz="0 0 1"/><mimic joint="four" multiplier="0.5"/>{LIMIT}'),
        joint("three", "c", "d", f'<origin xyz="0 0 1"/><axis xyz="0 0 1"/>{LIMIT}'),
        joint("four", "a", "e", f'<axis xyz="1 0 0"/>{LIMIT}', "prismatic"),
    ).encode(),
}
