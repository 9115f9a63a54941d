"""Robot models as TOML documents: the one place that knows the keys."""

from typing import Any, Final

import numpy as np

from .._core import Robot
from .._util import F64
from ..errors import RedundancyError
from ..files import Table

LENGTHS: Final = {"m": 1.0, "mm": 1000.0}
CONVENTIONS: Final = ("standard", "modified", "links")
LIMITS: Final = ("q_min", "q_max", "qd_max", "qdd_max")
_OPEN: Final = (("low", -np.inf), ("high", np.inf))
KEYS: Final = (
    *("name", "description", "source", "convention", "joints", "joint_names"),
    *("units", "dh", "links", "limits", "tool", "base", "mimic", "controller"),
)


class Units:
    """The units of a document, from its table [units].

    Parameters
    ----------
    table : Table
        Keys ``length`` ("m" or "mm") and ``angle`` ("rad" or "deg"); SI where absent.
    """

    def __init__(self, table: Table) -> None:
        table.only("length", "angle")
        # A division rounds once: 870 mm is the same number as 0.87 m.
        self._per_metre = LENGTHS[table.text("length", "m", tuple(LENGTHS))]
        self._degrees = table.text("angle", "rad", ("rad", "deg")) == "deg"

    def length(self, values: F64) -> F64:
        """Convert lengths to m."""
        return values / self._per_metre

    def angle(self, values: F64) -> F64:
        """Convert angles to rad."""
        return np.deg2rad(values) if self._degrees else values

    def joint(self, values: F64, joints: str) -> F64:
        """Convert joint coordinates or rates: rad where R, m where P."""
        prismatic = np.array([letter in "Pp" for letter in joints])
        return np.where(prismatic, self.length(values), self.angle(values))


def to_robot(document: Table) -> Robot:
    """Build the robot that a document describes.

    Parameters
    ----------
    document : Table
        The document; its ``fail`` makes the exceptions.

    Returns
    -------
    Robot
        In SI units.

    Raises
    ------
    ModelError
        If a key is missing, unknown or wrong, with its path and what was expected.
    """
    document.only(*KEYS)
    joints = document.text("joints")
    if not joints or set(joints) - set("RrPp"):
        raise document.error("joints", "one letter a joint, R (revolute) or P (prismatic)")
    units = Units(document.table("units"))
    convention: Any = document.text("convention", "standard", CONVENTIONS)
    rest: dict[str, Any] = {key: _frame(document, key, units) for key in ("tool", "base")}
    rest |= {"name": document.text("name"), "joints": joints} | _limits(document.table("limits"), joints, units)
    linked = convention == "links"
    mimic = _mimic(document, joints, units)
    m = len(joints) - _off_chain(document, linked, len(joints)) if mimic else len(joints)
    chain = _links(document, m, units) if linked else _dh(document, m, units)
    rest |= {"mimic": mimic} if mimic else {}
    if "joint_names" in document:
        rest["joint_names"] = _names(document, len(joints) - len(mimic or {}))
    try:
        robot = Robot.from_links(**chain, **rest) if linked else Robot.from_dh(**chain, convention=convention, **rest)
        map_to_controller = _controller(document.table("controller"), robot, units)
        return robot.with_controller(**map_to_controller) if map_to_controller else robot
    except RedundancyError as error:
        raise document.fail(str(error)) from error


def _names(document: Table, n: int) -> list[str]:
    names = document.data["joint_names"]
    if not (isinstance(names, list) and len(names) == n and all(isinstance(name, str) for name in names)):
        raise document.error("joint_names", f"{n} strings, one for each joint")
    return names


def _dh(document: Table, n: int, units: Units) -> dict[str, Any]:
    if "links" in document:
        raise document.error("links", 'the table [dh]; [links] goes with convention = "links"')
    table = document.table("dh")
    table.only("a", "d", "alpha", "theta")
    lengths = {key: units.length(table.array(key, (n,))) for key in ("a", "d")}
    return lengths | {key: units.angle(table.array(key, (n,))) for key in ("alpha", "theta")}


def _links(document: Table, n: int, units: Units) -> dict[str, Any]:
    if "dh" in document:
        raise document.error("dh", 'the table [links]; [dh] goes with convention = "standard" or "modified"')
    table = document.table("links")
    table.only("matrices", "flange")
    frames = {"links": table.array("matrices", (n, 4, 4)), "flange": table.array("flange", (4, 4))}
    for frame in frames.values():
        frame[..., :3, 3] = units.length(frame[..., :3, 3])
    return frames


def _limits(table: Table, joints: str, units: Units) -> dict[str, Any]:
    table.only(*LIMITS, "coupled")
    n = len(joints)
    limits: dict[str, Any] = {
        key: units.joint(table.array(key, (n,), infinite=True), joints) for key in LIMITS if key in table
    }
    if "coupled" in table:
        limits["coupled"] = _coupled(table, joints, units)
    return limits


def _coupled(table: Table, joints: str, units: Units) -> list[tuple[dict[int, float], float, float]]:
    """Read limits on combinations of joints; what they are of is counted in the unit of their first joint."""
    given, unit, coupled = table.data["coupled"], units.joint(np.ones(len(joints)), joints), []
    if not isinstance(given, list) or not all(isinstance(item, dict) for item in given):
        raise table.error("coupled", "a list of tables with row, low and high")
    for at, item in enumerate(given):
        row = Table(item, table.fail, f"{table.path}.coupled[{at}]")
        row.only("row", "low", "high")
        of_file = row.array("row", (len(joints),))
        used = np.flatnonzero(of_file)
        if len(used) == 0:
            raise row.error("row", "a coefficient other than 0")
        low, high = (row.number(key) if key in row else end for key, end in _OPEN)
        scale = unit[used[0]]
        terms = {int(j): float(of_file[j] * (scale / unit[j])) for j in used}
        coupled.append((terms, float(low * scale), float(high * scale)))
    return coupled


def _off_chain(document: Table, linked: bool, letters: int) -> int:
    """Return how many letters there are beyond the table of the chain."""
    rows = document.table("links").data.get("matrices") if linked else document.table("dh").data.get("a")
    return max(letters - len(rows), 0) if isinstance(rows, list) else 0


def _mimic(document: Table, joints: str, units: Units) -> dict[int, tuple[int, float, float]]:
    """Read the joints that follow others, counted from 0."""
    mimic = {}
    for table in document.tables("mimic"):
        table.only("joint", "driver", "factor", "offset")
        joint, driver = (_joint(table, key, len(joints)) for key in ("joint", "driver"))
        offset = units.joint(np.array([table.number("offset", 0.0)]), joints[joint])
        mimic[joint] = (driver, table.number("factor", 1.0), float(offset[0]))
    return mimic


def _joint(table: Table, key: str, n: int) -> int:
    joint = table.integer(key, least=1)
    if joint > n:
        raise table.error(key, f"a joint from 1 to {n}")
    return joint - 1


def _controller(table: Table, robot: Robot, units: Units) -> dict[str, Any]:
    """Read the arguments of `Robot.with_controller`."""
    table.only("names", "offset", "matrix", "signs", "coupling")
    n, given = robot.n, dict[str, Any]()
    if "names" in table:
        given["names"] = table.texts("names")
    if "offset" in table:
        given["offset"] = units.joint(table.array("offset", (n,)), robot.joints)
    for key, shape in (("matrix", (n, n)), ("signs", (n,))):
        if key in table:
            given[key] = table.array(key, shape)
    if "coupling" in table:
        rows = table.data["coupling"]
        entries = table.array("coupling", (len(rows) if isinstance(rows, list) else 1, 3))
        if not all(float(x).is_integer() and 1 <= x <= n for x in entries[:, :2].ravel()):
            raise table.error("coupling", f"[joint, with, factor] with joints from 1 to {n}")
        given["coupling"] = {(int(i) - 1, int(k) - 1): float(factor) for i, k, factor in entries}
    return given


def _frame(document: Table, key: str, units: Units) -> F64 | None:
    if key not in document:
        return None
    table = document.table(key)
    if "matrix" in table:
        table.only("matrix")
        frame = table.array("matrix", (4, 4))
        frame[:3, 3] = units.length(frame[:3, 3])
        return frame
    table.only("position", "rpy")
    frame = np.eye(4)
    if "rpy" in table:
        frame[:3, :3] = rotation_of_rpy(units.angle(table.array("rpy", (3,))))
    if "position" in table:
        frame[:3, 3] = units.length(table.array("position", (3,)))
    return frame


def rotation_of_rpy(rpy: F64) -> F64:
    """Return the rotation of roll, pitch and yaw.

    Parameters
    ----------
    rpy : ndarray, shape (3,)
        Angles [rad] about the fixed axes x, then y, then z, as in URDF.

    Returns
    -------
    ndarray, shape (3, 3)
        ``Rz(yaw) Ry(pitch) Rx(roll)``; right angles give exact zeros and ones.
    """
    sines, cosines = np.sin(rpy), np.cos(rpy)
    for values in (sines, cosines):
        values[np.abs(values) < 1e-15] = 0.0
    (sr, sp, sy), (cr, cp, cy) = sines, cosines
    roll = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    pitch = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    yaw = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    rotation: F64 = yaw @ pitch @ roll
    return rotation


def to_document(robot: Robot) -> dict[str, Any]:
    """Describe a robot in SI units, exactly: 64-bit numbers survive the decimal form.

    Parameters
    ----------
    robot : Robot
        Any robot.

    Returns
    -------
    dict
        Ready for a TOML writer.
    """
    dh = robot.dh
    document: dict[str, Any] = {
        "name": robot.name,
        "convention": "links" if dh is None else dh["convention"],
        "joints": robot.chain,
        "units": {"length": "m", "angle": "rad"},
    }
    if any(robot.joint_label(i) != f"joint {i + 1}" for i in range(robot.n)):
        document["joint_names"] = list(robot.joint_names)
    if dh is None:
        document["links"] = {"matrices": robot.links.tolist(), "flange": robot.flange.tolist()}
    else:
        document["dh"] = {key: dh[key].tolist() for key in ("a", "d", "alpha", "theta")}
    limits = {key: _by_joint(robot, getattr(robot, key), -np.inf if key == "q_min" else np.inf) for key in LIMITS}
    document["limits"] = {key: values.tolist() for key, values in limits.items() if np.isfinite(values).any()}
    if robot.coupled_limits:
        document["limits"]["coupled"] = [
            {"row": [terms.get(i, 0.0) for i in range(robot.n)]}
            | {key: value for key, value in (("low", low), ("high", high)) if np.isfinite(value)}
            for terms, low, high in robot.coupled_limits
        ]
    for key, frame in (("tool", robot.tool), ("base", robot.base)):
        if not np.array_equal(frame, np.eye(4)):
            document[key] = {"matrix": frame.tolist()}
    document |= _followers(robot) | _map_to_controller(robot)
    return document


def _by_joint(robot: Robot, values: F64, none: float) -> F64:
    """Return values of coordinates as values of all joints; none for those that follow others."""
    wide = np.full(len(robot.chain), none)
    wide[robot.coordinates] = values
    return wide


def _followers(robot: Robot) -> dict[str, Any]:
    keys = ("driver", "factor", "offset")
    rows = [
        {"joint": joint + 1, **dict(zip(keys, (driver + 1, *rest), strict=True))}
        for joint, (driver, *rest) in robot.mimic.items()
    ]
    return {"mimic": rows} if rows else {}


def _map_to_controller(robot: Robot) -> dict[str, Any]:
    controller = robot.controller
    if controller == robot.with_controller().controller:
        return {}
    matrix, offset = controller.matrix.tolist(), controller.offset.tolist()
    return {"controller": {"names": controller.names, "offset": offset, "matrix": matrix}}
