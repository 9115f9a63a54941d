"""The plant of `mujoco_loop.py`: two arms as MuJoCo simulates them, with their servos, and the record of a run."""

import sys
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

# The other files of the example take the module from here, so that this message comes first.
try:
    import mujoco
except ImportError:
    sys.exit("this example needs MuJoCo: pip install redundancy[sim] (or pip install mujoco)")

F64 = NDArray[np.float64]

DT, SUBSTEPS = 1e-3, 10
"""Tick of the controller [s], and steps of the simulation in it."""
SECURITY = 0.020
"""No distance may fall short of this [m], at any step of the simulation."""
BALL = 0.08
"""Radius of the ball [m]."""
SERVO, ARMATURE, FRICTION = 150.0, 0.1, 0.5
"""Natural frequency of the servos [rad/s], inertia of the rotors [kg m2], viscous friction [N m s/rad]."""
DENSITY = 1000.0
"""Of the capsules [kg/m3]; with it the Panda has about its 18 kg."""


@dataclass(frozen=True)
class Cell:
    """What is particular to a robot."""

    q0: tuple[float, ...]
    """Start [rad]."""
    line: tuple[float, float, float]
    """The straight line, from the hand at the start [m]."""
    taught: tuple[tuple[float, ...], ...]
    """Postures after the start that were recorded while the arm was led by hand [rad]."""
    forearm: str
    """The body that the ball comes at."""
    side: float
    """From which side of the arm it comes."""
    torque: tuple[float, ...]
    """Largest torque of the drives [N m]."""
    acceleration: tuple[float, ...] | None
    """Largest acceleration [rad/s2] where the robot's file has none."""
    floor: float
    """Height of the floor in the base frame [m]."""
    camera: tuple[float, float, float, float, float, float]
    """What the camera looks at (3) [m], its distance [m], azimuth and elevation [deg]."""
    radius: float = 0.06
    """Radius of the capsules [m]."""


CELLS: Final = {
    # Torques: Franka Control Interface documentation, Robot and interface specifications.
    "panda": Cell(
        q0=(-0.45, -0.25, 0.0, -2.15, 0.0, 1.9, 0.35),
        line=(0.05, 0.50, 0.05),
        taught=(
            (-0.30, -0.20, 0.05, -2.25, 0.05, 2.0, 0.45),
            (0.00, 0.00, 0.05, -2.10, 0.15, 2.05, 0.70),
            (0.30, 0.10, 0.0, -1.90, 0.25, 2.05, 0.95),
            (0.55, 0.00, 0.05, -2.05, 0.15, 2.1, 1.15),
        ),
        forearm="link 3",
        side=1.0,
        torque=(87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0),
        acceleration=None,
        floor=0.0,
        camera=(0.25, 0.05, 0.40, 1.65, 205.0, -30.0),
    ),
    # Torques: Rethink Robotics, Baxter Hardware Specifications, which give no accelerations: these are chosen.
    "baxter_left": Cell(
        q0=(-0.5, -0.45, 0.0, 1.15, 0.0, 0.85, 0.0),
        line=(0.05, 0.50, 0.05),
        taught=(
            (-0.30, -0.25, 0.05, 0.95, 0.05, 0.90, 0.10),
            (-0.05, -0.15, 0.10, 0.80, 0.05, 0.95, 0.15),
            (0.20, -0.30, 0.10, 0.95, 0.0, 0.95, 0.10),
            (0.40, -0.50, 0.05, 1.20, 0.0, 0.90, 0.05),
        ),
        forearm="link 4",
        side=1.0,
        torque=(50.0, 50.0, 50.0, 50.0, 15.0, 15.0, 15.0),
        acceleration=(8.0, 8.0, 8.0, 8.0, 15.0, 15.0, 15.0),
        floor=-0.6,
        camera=(0.45, 0.05, 0.10, 1.9, 205.0, -30.0),
    ),
}


def mjcf(robot: rd.Robot, bodies: list[rd.Body], torque: tuple[float, ...], floor: float, dots: F64) -> str:
    """Return a model of an arm: its joints, limits and capsules, a servo a joint, a ball, and dots along a path.

    Nothing in it collides: what keeps the arm away from the ball is the controller alone.
    """

    def place(frame: F64) -> str:
        numbers = [" ".join(f"{x:.17g}" for x in part) for part in (frame[:3, 3], np.r_[frame[:3, 0], frame[:3, 1]])]
        return f'pos="{numbers[0]}" xyaxes="{numbers[1]}"'

    def geoms(link: int | str, frame: F64, color: str) -> str:
        return "".join(
            f'<geom type="capsule" size="{body.shape.radius} {0.5 * body.shape.size[2]}" {place(frame @ body.pose)} '
            f'rgba="{color}"/>'
            for body in bodies
            if body.link == link and body.shape.size is not None
        )

    chain, closing = "", ""
    for k, (link, kind) in enumerate(zip(robot.links, robot.joints, strict=True)):
        # The round ends at a joint coincide: a ball larger by a hair hides that. It is all of a link without a capsule.
        own = geoms(k, np.eye(4), "0.72 0.76 0.82 1")
        own += f'<geom type="sphere" size="{1.03 * bodies[0].shape.radius}" rgba="0.36 0.48 0.62 1"/>'
        if k == robot.n - 1:
            own += geoms("tool", robot.flange @ robot.tool, "0.72 0.76 0.82 1")
            own += f'<site name="hand" size="0.012" rgba="0.1 0.1 0.1 1" {place(robot.flange @ robot.tool)}/>'
        chain += f"""<body name="link {k}" gravcomp="1" {place(robot.base @ link if k == 0 else link)}>
          <joint name="q{k}" type="{"hinge" if kind == "R" else "slide"}" axis="0 0 1" limited="true"
                 range="{robot.q_min[k]} {robot.q_max[k]}" armature="{ARMATURE}" damping="{FRICTION}"
                 actuatorfrcrange="{-torque[k]} {torque[k]}"/>{own}"""
        closing += "</body>"
    joints = range(robot.n)
    marks = "".join(f'<site size="0.009" pos="{x:.6f} {y:.6f} {z:.6f}" rgba="0 0.62 0.45 1"/>' for x, y, z in dots)
    return f"""<mujoco model="{robot.name}">
      <compiler angle="radian" autolimits="true"/>
      <option timestep="{DT / SUBSTEPS}" integrator="implicitfast"/>
      <visual>
        <global offwidth="1280" offheight="960"/><quality shadowsize="4096"/>
        <headlight ambient="0.45 0.45 0.45" diffuse="0.35 0.35 0.35" specular="0.1 0.1 0.1"/>
      </visual>
      <asset>
        <texture type="skybox" builtin="flat" rgb1="1 1 1" rgb2="1 1 1" width="32" height="192"/>
        <texture name="tiles" type="2d" builtin="checker" rgb1="0.93 0.93 0.93" rgb2="0.86 0.86 0.86"
                 width="200" height="200"/>
        <material name="floor" texture="tiles" texrepeat="8 8"/>
      </asset>
      <default><geom contype="0" conaffinity="0" density="{DENSITY}"/></default>
      <worldbody>
        <light pos="0.5 -1 2.5" dir="-0.1 0.4 -1" directional="true" diffuse="0.45 0.45 0.45"/>
        <geom type="plane" size="2 2 0.1" pos="0 0 {floor}" material="floor"/>
        <geom type="cylinder" size="0.09" fromto="0 0 {floor} 0 0 {floor + 0.02 if floor == 0.0 else 0.0}"
              rgba="0.3 0.3 0.3 1"/>
        {geoms("base", robot.base, "0.3 0.3 0.3 1")}{marks}
        <body name="ball" mocap="true"><geom type="sphere" size="{BALL}" rgba="0.84 0.37 0 1"/></body>
        {chain}{closing}
      </worldbody>
      <actuator>
        {"".join(f'<position joint="q{k}" kp="1"/>' for k in joints)}
        {"".join(f'<velocity joint="q{k}" kv="1"/>' for k in joints)}
      </actuator>
    </mujoco>"""


class Plant:
    """The simulated arm with its servos: torque = kp (q wanted - q) + kv (rates wanted - rates)."""

    def __init__(self, model: str, q0: F64) -> None:
        """Start at rest, servos tuned to the inertia that each joint sees there."""
        self.model = mujoco.MjModel.from_xml_string(model)
        self.data = mujoco.MjData(self.model)
        self.n = len(q0)
        self.data.qpos[:] = q0
        mujoco.mj_forward(self.model, self.data)
        inertia, column = np.empty(self.n), np.empty(self.n)
        for k, unit in enumerate(np.eye(self.n)):
            mujoco.mj_mulM(self.model, self.data, column, unit)
            inertia[k] = column[k]
        kp, kv = SERVO**2 * inertia, 2.0 * SERVO * inertia
        gain, bias = self.model.actuator_gainprm, self.model.actuator_biasprm
        gain[: self.n, 0], bias[: self.n, 1] = kp, -kp
        gain[self.n :, 0], bias[self.n :, 2] = kv, -kv

    def step(self, wanted: F64, rates: F64, ball: F64) -> None:
        """Advance by one step of the simulation."""
        self.data.ctrl[: self.n] = wanted
        self.data.ctrl[self.n :] = rates
        self.data.mocap_pos[0] = ball
        mujoco.mj_step(self.model, self.data)


@dataclass
class Run:
    """What came of a run, tick by tick and step by step of the simulation."""

    robot: rd.Robot = field(repr=False)
    name: str
    path: str
    toolpath: rd.Toolpath = field(repr=False)
    time: F64 = field(repr=False)
    """Of the ticks [s]."""
    q: F64 = field(repr=False)
    """True postures, at every step (N * SUBSTEPS + 1, n)."""
    qd: F64 = field(repr=False)
    """True rates, at every step."""
    ball: F64 = field(repr=False)
    """Where the ball is, at every step."""
    distance: F64 = field(repr=False)
    """Smallest distance of the true posture from the ball and of bodies from each other, at every step [m]."""
    unavoided: F64 = field(repr=False)
    """The same for an arm that followed the path without looking, at every tick."""
    rates: F64 = field(repr=False)
    """What the controller answered (N, n)."""
    status: list[str] = field(repr=False)
    took: F64 = field(repr=False)
    """Time of the controller, and of the processor in it, which does not count other processes (N, 2) [s]."""
    position_error: F64 = field(repr=False)
    """At every tick [m]."""
    angle_error: F64 = field(repr=False)
    """At every tick [rad]."""
    tracking: NDArray[np.bool_] = field(repr=False)
    """Ticks before the ball comes near the goal."""
    blocked: NDArray[np.bool_] = field(repr=False)
    """Ticks while it lies on the goal."""
    nearest: float
    """The least distance from the goal that a safe pose can have meanwhile [m]."""
    torque: float
    """Largest torque over its limit."""
    model: str = field(repr=False)
