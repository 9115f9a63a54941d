"""Every chain of every URDF below a folder, beside pinocchio: `python -m tests.soak urdf --folder DIR`.

Bars: tool frame and Jacobian agree to 1e-12 (of the largest entry where that is above 1) at random postures; no chain
is refused of a file that pinocchio loads, save those with floating or planar joints, more than 16 joints or none, a
lower limit above the upper one, or a joint that mimics one that is not there: these are told by name. Nothing is
downloaded: `docs/robot.md` names the packages whose figures it shows.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import redundancy as rd

from tests.reference.chain import F64

BAR = 1e-12
POSTURES = 3
LONGEST = 16
MOVING = ("revolute", "continuous", "prismatic")
EXPECTED = {"floating": "floating or planar", "planar": "floating or planar"}


@dataclass
class Tree:
    """A URDF by another reader: which joint carries a link, and what it is."""

    joints: dict[str, ElementTree.Element]
    above: dict[str, ElementTree.Element]
    ends: list[str]

    @classmethod
    def read(cls, file: Path) -> Tree:
        """Read a file."""
        data = file.read_bytes()
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
        # This reader is stricter: about what may stand ahead of a declaration, and prefixes that none declares.
        text = re.sub(r"(</?|\s)([A-Za-z]\w*):(?=\w+[\s=/>])", r"\1\2_", re.sub(r"<\?.*?\?>", "", text))
        root = ElementTree.fromstring(text)
        joints = {joint.attrib["name"]: joint for joint in root.findall("joint")}
        above = {_link(joint, "child"): joint for joint in joints.values()}
        parents = {_link(joint, "parent") for joint in joints.values()}
        links = [link.attrib["name"] for link in root.findall("link")]
        return cls(joints, above, [link for link in links if link not in parents])

    def driver(self, name: str) -> tuple[str, float, float]:
        """Return the joint that one follows at the end, itself if it follows none, and by which factor and offset."""
        factor, offset = 1.0, 0.0
        while (mimic := self.joints[name].find("mimic")) is not None and mimic.attrib["joint"] in self.joints:
            name = mimic.attrib["joint"]
            offset += factor * float(mimic.get("offset", 0.0))
            factor *= float(mimic.get("multiplier", 1.0))
        return name, factor, offset

    def chain(self, tip: str) -> list[ElementTree.Element]:
        """Return the joints that lead to a link, last to first."""
        joints = []
        while tip in self.above:
            joints.append(self.above[tip])
            tip = _link(joints[-1], "parent")
        return joints


def _link(joint: ElementTree.Element, end: str) -> str:
    found = joint.find(end)
    return "" if found is None else found.attrib["link"]


def locked(joint: ElementTree.Element) -> float | None:
    """Return where a joint is fixed by its limits, if it is."""
    limit = joint.find("limit")
    if joint.attrib.get("type") not in ("revolute", "prismatic") or limit is None:
        return None
    low, high = limit.get("lower"), limit.get("upper")
    unset = all(float(limit.get(key, 1.0)) == 0.0 for key in ("lower", "upper", "velocity", "effort"))
    if unset or (low is None and high is None):
        return None
    ends = float(low or 0.0), float(high or 0.0)
    return ends[0] if ends[0] == ends[1] else None


@dataclass
class Peer:
    """A file as pinocchio has it."""

    pin: Any
    model: Any
    data: Any
    tree: Tree
    coupled: bool
    """Whether joints that mimic others are no coordinates of their own."""

    def posture(self, seed: int) -> dict[str, float]:
        """Return where the joints stand that do not follow others: random, or where their limits hold them."""
        rng = np.random.default_rng(seed)
        values = {}
        for name, joint in self.tree.joints.items():
            value = rng.uniform(-1.5, 1.5)
            held = locked(joint)
            values[name] = value if held is None else held
        return values

    def compare(self, robot: rd.Robot, tip: str, seed: int) -> float:
        """Return the largest difference of frames and Jacobians at a posture."""
        values, q = self.posture(seed), self.pin.neutral(self.model)
        # What each joint of the model adds to each of the robot's coordinates.
        adds = np.zeros((self.model.nv, robot.n))
        for name in filter(self.model.existJointName, values):
            driver, factor, offset = self.tree.driver(name)
            joint = self.model.joints[self.model.getJointId(name)]
            if self.coupled and driver != name:
                continue
            value = factor * values[driver] + offset
            if joint.nq == 2 and joint.nv == 1:
                q[joint.idx_q : joint.idx_q + 2] = np.cos(value), np.sin(value)
            elif joint.nq == 1:
                q[joint.idx_q] = value
            if driver in robot.joint_names:
                adds[joint.idx_v, robot.joint_names.index(driver)] = factor
        frame = self.model.getFrameId(tip, self.pin.FrameType.BODY)
        self.pin.computeJointJacobians(self.model, self.data, q)
        self.pin.updateFramePlacements(self.model, self.data)
        theirs = self.pin.getFrameJacobian(self.model, self.data, frame, self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        ours = [values[name] for name in robot.joint_names]
        return max(
            _difference(robot.fk(ours), self.data.oMf[frame].homogeneous),
            _difference(robot.jacobian(ours), theirs.reshape(6, -1)[[3, 4, 5, 0, 1, 2]] @ adds),
        )


def _difference(a: F64, b: F64) -> float:
    return float(np.abs(a - b).max() / max(1.0, np.abs(b).max()))


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep what pinocchio's reader prints to itself."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 2)
    try:
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


def peer(file: Path) -> Peer | None:
    """Return a file as pinocchio has it, None if it refuses it."""
    import pinocchio as pin

    with _quiet():
        for mimic in (True, False):
            # It refuses mimics of mimics, and of joints that it has not met yet: what the file says of these counts.
            try:
                model = pin.buildModelFromUrdf(str(file), mimic=mimic)
            except Exception:
                continue
            return Peer(pin, model, model.createData(), Tree.read(file), mimic)
    return None


@dataclass
class Found:
    """What is counted."""

    files: Counter[str] = field(default_factory=Counter)
    chains: Counter[str] = field(default_factory=Counter)
    worst: float = 0.0
    faults: list[str] = field(default_factory=list)


def expected_refusal(chain: list[ElementTree.Element], known: Collection[str]) -> str | None:
    """Return why a chain is no robot of ours, if it is none."""
    for joint in chain:
        if joint.attrib["type"] in EXPECTED:
            return EXPECTED[joint.attrib["type"]]
        mimic, limit = joint.find("mimic"), joint.find("limit")
        if mimic is not None and mimic.attrib["joint"] not in known:
            return "mimics a joint that is not there"
        if limit is not None and float(limit.get("lower", 0.0)) > float(limit.get("upper", 0.0)):
            return "lower limit above the upper one"
    moving = [joint for joint in chain if joint.attrib["type"] in MOVING and locked(joint) is None]
    return "nothing moves" if not moving else f"more than {LONGEST} joints" if len(moving) > LONGEST else None


def check(file: Path, found: Found) -> None:
    """Compare every chain of a file."""
    other = peer(file)
    if other is None:
        found.files["refused by pinocchio"] += 1
        return
    found.files["loaded by pinocchio"] += 1
    for tip in other.tree.ends:
        refusal = expected_refusal(other.tree.chain(tip), other.tree.joints)
        try:
            robot = rd.Robot.from_urdf(file, tip=tip)
        except rd.RedundancyError as error:
            found.chains[refusal or "refused"] += 1
            named = any(name in str(error) for name in (tip, *other.tree.joints))
            if refusal is None or not named:
                found.faults.append(f"{file}: {tip}: {error}")
            continue
        difference = max(other.compare(robot, tip, seed) for seed in range(POSTURES))
        found.worst = max(found.worst, difference)
        found.chains["agree" if difference <= BAR else "differ"] += 1
        if refusal is not None or difference > BAR:
            found.faults.append(
                f"{file}: {tip}: differs by {difference:.1e}" if refusal is None else f"{file}: {tip}: read"
            )


def main(arguments: list[str]) -> int:
    """Compare what is below a folder; return 1 if a bar was missed."""
    parser = argparse.ArgumentParser(prog="tests.soak urdf")
    parser.add_argument("--folder", type=Path, default=Path("tests/data"), help="where the URDFs are, at any depth")
    folder = parser.parse_args(arguments).folder
    files = sorted(folder.rglob("*.urdf"))
    found = Found()
    for file in files:
        check(file, found)
    lines = [f"{len(files)} files", *(f"{count:6d} {what}" for what, count in found.files.most_common())]
    lines += [
        f"{sum(found.chains.values())} chains",
        *(f"{count:6d} {what}" for what, count in found.chains.most_common()),
    ]
    lines += [f"largest difference {found.worst:.1e}", *found.faults]
    sys.stdout.write("\n".join(lines) + "\n")
    return 1 if found.faults else 0
