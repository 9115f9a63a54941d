"""Named robots, and robots in TOML files.

A robot file holds ``name``, ``joints`` (one letter each, R or P), ``joint_names`` if they have any, ``convention``
("standard" or "modified" Denavit-Hartenberg, or "links"), and the tables

- ``[units]``: ``length`` "m" or "mm", ``angle`` "rad" or "deg"; SI where absent;
- ``[dh]``: ``a``, ``d``, ``alpha``, ``theta``, one number a joint; or, for "links", ``[links]``: ``matrices``
  (n x 4 x 4, the fixed transform ahead of each joint, which moves about or along z) and ``flange`` (4 x 4, the one
  after the last joint);
- ``[limits]``: ``q_min``, ``q_max``, ``qd_max``, ``qdd_max``; ``inf`` where a joint has none, and no key where no joint
  has one; ``coupled``: limits on combinations of joints, ``[{row = [0, 1, 1, 0, 0, 0], low = -10.0, high = 150.0}]``,
  one number a joint, in the unit of the first joint that counts; ``low`` or ``high`` may be left out;
- ``[tool]``, ``[base]``: ``position`` and ``rpy`` (about the fixed axes x, y, z, in this order), or ``matrix`` (4 x 4);
- ``[[mimic]]``, one for each joint that follows another: ``joint``, ``driver`` (counted from 1 along ``joints``),
  ``factor`` (in SI units: rad or m of the joint a rad or m of the driver) and ``offset``. Letters of ``joints`` beyond
  the table are joints off the chain that only drive; limits are one a letter;
- ``[controller]``, joints as the robot's controller has them, ``p = matrix q + offset`` (see `Robot.with_controller`):
  ``names``, ``offset``, and ``matrix`` (n x n, in SI units) or ``signs`` and ``coupling``, which holds
  ``[joint, with, factor]``: joint (of the controller, counted from 1) moves with joint ``with`` of the robot, too.

Strings ``description`` and ``source`` are for people.
"""

import tomllib
from importlib.resources import files
from pathlib import Path

import tomli_w

from .._core import Robot
from ..errors import InvalidValueError, ModelError, UnknownRobotError
from ..files import Table, parse_toml, write_atomically
from .cells import on_rail, with_turntable
from .document import to_document, to_robot
from .dynamics import Derivatives, Dynamics, PinocchioDynamics, TorqueFunction, checked_limit, torques_of

__all__ = [
    "Derivatives",
    "Dynamics",
    "PinocchioDynamics",
    "TorqueFunction",
    "checked_limit",
    "describe",
    "find",
    "get",
    "load",
    "names",
    "on_rail",
    "save",
    "torques_of",
    "with_turntable",
]


def names() -> list[str]:
    """Return the names of the packaged robots, sorted."""
    found = (entry.name for entry in files(__name__).iterdir())
    return sorted(name.removesuffix(".toml") for name in found if name.endswith(".toml"))


def get(name: str) -> Robot:
    """Return a packaged robot.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    Robot
        With its limits, in SI units.

    Raises
    ------
    UnknownRobotError
        If there is none of this name; the message proposes the nearest.

    Examples
    --------
    >>> import redundancy as rd
    >>> rd.robots.get("panda").n
    7
    """
    return load(_packaged(name))


def describe(name: str) -> str:
    """Return the one-line description of a packaged robot.

    Parameters
    ----------
    name : str
        One of `names`.

    Raises
    ------
    UnknownRobotError
        If there is none of this name.
    """
    return str(tomllib.loads(_packaged(name).read_text(encoding="utf-8")).get("description", ""))


def _packaged(name: str) -> Path:
    # Compared with the list rather than tried as a file: a name must not lead out of the folder.
    known = names()
    if name not in known:
        raise UnknownRobotError(name, known)
    return Path(str(files(__name__).joinpath(f"{name}.toml")))


def load(path: str | Path) -> Robot:
    """Read a robot from a TOML file.

    Parameters
    ----------
    path : path-like
        The file; its keys are those of this module's docstring.

    Returns
    -------
    Robot
        In SI units.

    Raises
    ------
    OSError
        If the file cannot be opened.
    ModelError
        If it is malformed (``file:line:column: ...``), or a key is missing, unknown or wrong (``file: key: ...``).
    """
    file = Path(path)
    content = parse_toml(file, lambda message, line, column: ModelError(f"{file}:{line}:{column}: {message}"))
    return to_robot(Table(content, lambda message: ModelError(f"{file}: {message}")))


def save(robot: Robot, path: str | Path) -> None:
    """Write a robot to a TOML file, in SI units; `load` gives back the same robot, bit for bit.

    Parameters
    ----------
    robot : Robot
        The robot.
    path : path-like
        The file. It is replaced as a whole or not at all.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_atomically(path, tomli_w.dumps(to_document(robot)))


def find(text: str, folder: str | Path = ".", base: str | None = None, tip: str | None = None) -> Robot:
    """Return the robot that a job file or a command line names.

    Parameters
    ----------
    text : str
        A packaged name, or a file that ends in ``.toml`` or ``.urdf``.
    folder : path-like
        What a relative file is relative to.
    base, tip : str, optional
        The first and last link of a ``.urdf`` file, as for `Robot.from_urdf`.

    Returns
    -------
    Robot
        The robot.

    Raises
    ------
    UnknownRobotError, ModelError, OSError
        As `get`, `load` and `Robot.from_urdf`.
    InvalidValueError
        If a link of another robot is named, or one that the file has not.
    """
    file = Path(folder, text)
    if file.suffix.lower() == ".urdf":
        return Robot.from_urdf(file, base, tip)
    for name, link in (("base", base), ("tip", tip)):
        if link is not None:
            raise InvalidValueError(f"{name} is {link!r}, expected none: {text} is no .urdf file, whose links it names")
    return load(file) if file.suffix == ".toml" else get(text)
