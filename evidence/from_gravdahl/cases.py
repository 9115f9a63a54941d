"""A PUMA 560 that paints three rasters: what From and Gravdahl leave open, fixed.

The source prints no dimension, tool, load or limit. These are those of ``data/puma560_dynamics.json`` (masses, inertias
and torque limits as published by Armstrong and Corke) and of the scenarios of ``data/painting_speeds.json``.
"""

import json
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

F64 = NDArray[np.float64]

DATA = Path(__file__).parent / "data"
TILT = np.deg2rad(10.0)
SPACING = 1e-3
"""Distance of the points of the recorded speeds, about [m]."""

CRITERIA = ("tau1", "tau12", "tau_all", "rate1", "rate_all")


@dataclass(frozen=True)
class Cone:
    """Orientations whose axis is within an angle [rad] of the path's: a volume of free spin in one line."""

    tilt: float

    def signed_distance(self, orientation: F64) -> F64:
        """Return how far orientations, shape (N, 3, 3), are outside [rad]; negative inside."""
        across = np.hypot(orientation[:, 0, 2], orientation[:, 1, 2])
        outside: F64 = np.arctan2(across, orientation[:, 2, 2]) - self.tilt
        return outside


@cache
def recorded(name: str) -> Any:  # noqa: ANN401
    """Return what a file of ``data/`` holds."""
    return json.loads((DATA / f"{name}.json").read_text(encoding="utf-8"))


@cache
def dynamics(payload: bool = True) -> rd.PinocchioDynamics:
    """Return the dynamics of the PUMA 560, with or without the load of 1 kg."""
    return rd.PinocchioDynamics(model(payload), recorded("puma560_dynamics")["torque_limit"])


def model(payload: bool) -> Any:  # noqa: ANN401
    """Return pinocchio's model: standard Denavit-Hartenberg links, motors as armatures."""
    import pinocchio

    data = recorded("puma560_dynamics")
    result = pinocchio.Model()
    joint, placement = 0, pinocchio.SE3.Identity()
    for i, alpha in enumerate(np.deg2rad(data["alpha_deg"])):
        joint = result.addJoint(joint, pinocchio.JointModelRZ(), placement, f"joint_{i + 1}")
        turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(alpha), -np.sin(alpha)], [0.0, np.sin(alpha), np.cos(alpha)]])
        placement = pinocchio.SE3(turn, np.array([data["a"][i], 0.0, data["d"][i]]))
        centre, inertia = (np.array(data[key][i], dtype=float) for key in ("centre_of_mass", "inertia_diagonal"))
        result.appendBodyToJoint(joint, pinocchio.Inertia(data["mass"][i], centre, np.diag(inertia)), placement)
    if payload:
        load = recorded("painting_speeds")["payload"]
        body = pinocchio.Inertia(load["mass"], np.array(load["cog"], dtype=float), np.zeros((3, 3)))
        result.appendBodyToJoint(joint, body, placement)
    result.armature = np.array(data["motor_inertia"]) * np.array(data["gear"]) ** 2
    return result


@dataclass(frozen=True, eq=False)
class Scenario:
    """A raster and a mount of the gun: S1, S2 or S3.

    Attributes
    ----------
    name : str
        "S1", "S2" or "S3".
    told : str
        What it is, in words.
    geometry : dict
        Raster and gun [m]: middle ``xc``, half sizes ``hx``, ``hy``, ``rows``, radius of corners ``rho``, direction of
        the lines ``along``, height of the surface ``zs``, length ``d`` and offset ``ex`` of the gun.
    results : dict
        Recorded speeds [m/s] by rule and criterion.
    """

    name: str
    told: str
    geometry: dict[str, Any]
    results: dict[str, Any]

    @cached_property
    def robot(self) -> rd.Robot:
        """The PUMA 560 with the gun; its wrist is the flange, the gun ``d`` along joint 6 and ``ex`` beside it."""
        data, speeds = recorded("puma560_dynamics"), recorded("painting_speeds")
        tool = np.eye(4)
        tool[:3, 3] = self.geometry["ex"], 0.0, self.geometry["d"]
        turn = np.full(6, 4.0 * np.pi)
        return rd.Robot.from_dh(
            data["a"],
            data["d"],
            np.deg2rad(data["alpha_deg"]),
            np.zeros(6),
            tool=tool,
            q_min=-turn,
            q_max=turn,
            qd_max=speeds["rate_limit"],
            name="puma560",
        )

    @cached_property
    def frame(self) -> F64:
        """Pose of the surface."""
        frame = np.eye(4)
        frame[:3, 3] = self.geometry["xc"], 0.0, self.geometry["zs"]
        return frame

    @property
    def half_size(self) -> tuple[float, float]:
        """Half the sides of the surface [m]."""
        return self.geometry["hx"], self.geometry["hy"]

    def path(self, spacing: float = SPACING) -> rd.Toolpath:
        """Return the raster: points at the largest equal distances that are not below the spacing [m]."""
        hx, hy = self.half_size
        shape = ((2.0 * hx, 2.0 * hy), int(self.geometry["rows"]), self.geometry["rho"])
        along, frame = self.geometry["along"], self.frame
        length = rd.Toolpath.raster(*shape, 1.0, along, frame, speed=1.0).duration
        assert length is not None
        return rd.Toolpath.raster(*shape, length / np.floor(length / spacing), along, frame)

    def rules(self) -> dict[str, rd.PointingRule | rd.SurfaceRule | None]:
        """Return the rules by the names of the recorded results."""
        spins = {"-": rd.PointingRule("inside"), "+": rd.PointingRule("outside")}
        rules: dict[str, rd.PointingRule | rd.SurfaceRule | None] = {
            "constant": None,
            "spin -atan2": spins["-"],
            "spin +atan2 (printed)": spins["+"],
            "tilt square, no spin": self._tilt("square", None),
        }
        for shape in ("square", "circle"):
            for sign, spin in spins.items():
                rules[f"spin {sign} and tilt {shape}"] = self._tilt(shape, spin)
        return rules

    def _tilt(self, shape: Any, pointing: rd.PointingRule | None) -> rd.SurfaceRule:  # noqa: ANN401
        return rd.SurfaceRule(TILT, half_size=self.half_size, frame=self.frame, cross_section=shape, pointing=pointing)

    @property
    def best_rule(self) -> str:
        """The rule within the cone of 10 deg, with the sign of the spin that the mount asks for."""
        mount = rd.PointingRule.of(self.robot).mount
        return f"spin {'+' if mount == 'outside' else '-'} and tilt circle"

    def motion(self, rule: str, spacing: float = SPACING) -> rd.Trajectory:
        """Return the robot's motion by a rule, in the recorded branch."""
        path, given = self.path(spacing), self.rules()[rule]
        assert path.rotation is not None
        if given is not None:
            path = path.oriented(given.rotation(path.position, path.rotation))
        return along(self.robot, path, np.array(self.results[rule]["q_first"]))


def scenarios() -> dict[str, Scenario]:
    """Return S1, S2 and S3."""
    found = recorded("painting_speeds")["scenarios"]
    return {name[:2]: Scenario(name[:2], name[3:], s["geometry"], s["results"]) for name, s in found.items()}


def along(robot: rd.Robot, path: rd.Toolpath, near: F64) -> rd.Trajectory:
    """Return the robot's motion through the frames of a path, each posture the one next to that before."""
    assert path.rotation is not None
    pose = np.tile(np.eye(4), (len(path), 1, 1))
    pose[:, :3, :3], pose[:, :3, 3] = path.rotation, path.position
    found, frame = robot.inverse(pose, near=near)
    first = np.searchsorted(frame, np.arange(len(path) + 1))
    q = np.empty((len(path), robot.n))
    for point in range(len(path)):
        postures = found[first[point] : first[point + 1]]
        postures = postures + 2.0 * np.pi * np.round((near - postures) / (2.0 * np.pi))
        near = q[point] = postures[np.abs(postures - near).max(axis=1).argmin()]
    reached = robot.fk(q)
    error = np.linalg.norm(reached[:, :3, 3] - path.position, axis=1)
    angle = np.linalg.norm(reached[:, :3, :3] - path.rotation, axis=(1, 2))
    kappa = rd.ConditionNumber(1.0).evaluate_many(robot, q, 0)[0]
    return rd.Trajectory(robot, path, q, kappa, np.zeros(len(path)), error, angle, ["on target"] * len(path), 1.0)


def speeds(robot: rd.Robot, motion: rd.Trajectory) -> dict[str, float]:
    """Return the largest constant speeds of a motion [m/s] by criterion."""
    found = rd.constant_speed(robot, motion, dynamics())
    torque, rate = (found.criteria[name].joint_speed for name in ("torque", "rate"))
    values = (torque[0], torque[:2].min(), torque.min(), rate[0], rate.min())
    return {**dict(zip(CRITERIA, map(float, values), strict=True)), "all": found.speed}
