"""A 1 kHz loop around a simulated arm: MuJoCo moves it, a quadratic programme tells it how.

python examples/mujoco_loop.py [--robot panda|baxter_left] [--path line|taught] [--seconds N] [--out DIR]

The hand follows a straight line, or a path that was taught by hand. A ball comes at the forearm, which has to give way
while the hand goes on; then it lies on the goal, so that the hand has to wait in front of it, and leaves again. The
programme gets measured joint positions; its rates are integrated and go to position servos with velocity feed-forward,
one tick later, as over a field bus. The simulation has ten steps a tick, and distances are checked at all of them.

Needs MuJoCo: pip install redundancy[sim]. With --out, pictures (matplotlib) and an animation (Pillow, and OpenGL: try
MUJOCO_GL=egl or osmesa without a display) are written.
"""

import argparse
import gc
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
import redundancy as rd
from numpy.typing import NDArray

try:
    import mujoco
except ImportError:
    sys.exit("this example needs MuJoCo: pip install redundancy[sim] (or pip install mujoco)")

F64 = NDArray[np.float64]

DT, SUBSTEPS = 1e-3, 10
"""Tick of the controller [s], and steps of the simulation in it."""
SECONDS = 12.0
"""Length of a run [s]; a longer one is a slower one."""

SECURITY = 0.020
"""No distance may fall short of this [m], at any step of the simulation."""
CONTROLLED = 0.025
"""The security distance that the controller is given [m]: servos lag behind, and act a tick after the ball is seen."""
INFLUENCE, DAMPING = 0.15, 0.6
"""Distance below which the controller looks at a pair [m], and how fast that distance may fall there [m/s]."""
LIMIT_MARGIN, SPEED_SHARE = 0.01, 0.9
"""The controller's limits of position are narrower by this [rad], those of speed are this share of the robot's."""
FEEDBACK = 15.0
"""Rate at which errors of the hand are closed [1/s]."""
FASTEST = (1.0, 0.25)
"""Largest angular [rad/s] and linear [m/s] speed that feedback asks for."""

STIFFNESS, PULL = 1e6, 0.02
"""Weights of deviations from the path and of the middle of the joints' ranges, beside 1 for the rates."""

BALL = 0.08
"""Radius of the ball [m]."""
DEPTH = 0.05
"""How deep the ball would go into the forearm if the arm did not give way [m]."""

SERVO, ARMATURE, FRICTION = 150.0, 0.1, 0.5
"""Natural frequency of the servos [rad/s], inertia of the rotors [kg m2], viscous friction [N m s/rad]."""
LEAD = 0.01
"""What is sent to the servos is ahead of what is measured by this at most [rad]: they may be at their torque."""
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


def smooth_steps(times: F64, knots: list[tuple[float, F64]]) -> tuple[F64, F64]:
    """Return positions and velocities at some times: from knot to knot along lines, at rest at each, without jerks."""
    at = np.array([knot for knot, _ in knots])
    points = np.array([point for _, point in knots])
    first = np.clip(np.searchsorted(at, times, side="right") - 1, 0, len(at) - 2)
    length = at[first + 1] - at[first]
    s = np.clip((times - at[first]) / length, 0.0, 1.0)
    way = points[first + 1] - points[first]
    share, speed = s**3 * (10.0 + s * (6.0 * s - 15.0)), 30.0 * (s * (1.0 - s)) ** 2 / length
    return points[first] + share[:, None] * way, speed[:, None] * way


def taught_postures(waypoints: F64, share: F64) -> F64:
    """Return smooth postures at shares of a path that was led by hand.

    The recording: ten samples a waypoint and more, an unsteady hand. The smooth one has the least sum of squared
    distances to the samples and squared third differences (Whittaker 1923), and starts where the recording does.
    """
    count = 40 * (len(waypoints) - 1) + 1
    known = np.linspace(0.0, 1.0, len(waypoints))
    samples = np.linspace(0.0, 1.0, count)
    recorded = np.stack([np.interp(samples, known, column) for column in waypoints.T], axis=1)
    recorded += np.random.default_rng(0).normal(scale=0.003, size=recorded.shape)
    third = np.diff(np.eye(count), 3, axis=0)
    trust = np.ones(count)
    trust[0] = 1e9
    recorded[0] = waypoints[0]
    smoothed = np.linalg.solve(np.diag(trust) + 3e3 * third.T @ third, trust[:, None] * recorded)
    # A natural cubic spline through the smoothed samples.
    second = np.zeros_like(smoothed)
    band = 4.0 * np.eye(count - 2) + np.eye(count - 2, k=1) + np.eye(count - 2, k=-1)
    second[1:-1] = np.linalg.solve(band, 6.0 * np.diff(smoothed, 2, axis=0))
    place = np.clip(share, 0.0, 1.0) * (count - 1)
    k = np.minimum(place.astype(np.intp), count - 2)
    b = (place - k)[:, None]
    a = 1.0 - b
    return a * smoothed[k] + b * smoothed[k + 1] + ((a**3 - a) * second[k] + (b**3 - b) * second[k + 1]) / 6.0


def hand_path(robot: rd.Robot, cell: Cell, path: str, times: F64, start: float, stop: float) -> tuple[rd.Toolpath, F64]:
    """Return where the hand has to be at some times, and with which twist."""
    q0 = np.array(cell.q0)
    share = smooth_steps(times, [(start, np.zeros(1)), (stop, np.ones(1))])[0][:, 0]
    if path == "line":
        pose = robot.fk(q0)
        position = pose[:3, 3] + share[:, None] * np.array(cell.line)
        rotation = np.broadcast_to(pose[:3, :3], (len(times), 3, 3))
    else:
        poses = robot.fk(taught_postures(np.array([cell.q0, *cell.taught]), share))
        position, rotation = poses[:, :3, 3], poses[:, :3, :3]
    twist = np.zeros((len(times), 6))
    turn = rotation[1:] @ rotation[:-1].transpose(0, 2, 1)
    # Turns within a tick are small: the rotation vector is the skew part.
    skew = 0.5 * (turn - turn.transpose(0, 2, 1))
    twist[:-1, :3] = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1) / DT
    twist[:-1, 3:] = np.diff(position, axis=0) / DT
    return rd.Toolpath(position, rotation[:, :, 2], rotation), twist


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


def simulate(name: str, path: str, seconds: float = SECONDS) -> Run:
    """Run the loop."""
    cell, robot = CELLS[name], rd.robots.get(name)
    if cell.acceleration is not None:
        robot = robot.with_limits(qdd_max=cell.acceleration)
    narrower = robot.with_limits(
        q_min=robot.q_min + LIMIT_MARGIN, q_max=robot.q_max - LIMIT_MARGIN, qd_max=SPEED_SHARE * robot.qd_max
    )
    q0 = np.array(cell.q0)
    bodies = rd.capsules_along_links(robot, cell.radius)
    pairs = rd.self_collision_pairs(robot, bodies, q0, clearance=0.05)
    obstacles = {"ball": rd.Shape.sphere(BALL)}
    check = rd.Scene(robot, bodies, obstacles, pairs)
    scene = rd.Scene(narrower, bodies, obstacles, pairs)
    settings: dict[str, Any] = {"weight": PULL, "stiffness": STIFFNESS, "dt": DT, "tolerance": 0.01}
    objective = rd.JointLimits()
    program = rd.QuadraticProgram(
        narrower, rd.Task.full(), objective, **settings,
        scene=scene, influence=INFLUENCE, security=CONTROLLED, damping=DAMPING,
    )  # fmt: skip

    slower = seconds / SECONDS
    ticks = round(seconds / DT)
    times = DT * np.arange(ticks + 1)
    toolpath, feed = hand_path(robot, cell, path, times, 0.5 * slower, 8.5 * slower)
    targets = toolpath.targets(program.task)
    unaware = rd.track(
        rd.QuadraticProgram(narrower, rd.Task.full(), objective, **settings), toolpath, q0, progress=False
    )

    # The ball: to the forearm, up and away, beyond the goal, onto it, and away again.
    met = round(3.2 * slower / DT)
    posture = unaware.q[met]
    swivel = np.linalg.svd(robot.jacobian(posture))[2][-1]
    body = next(body for body in bodies if body.name == cell.forearm)

    assert body.shape.size is not None
    below_elbow = np.array([0.0, 0.0, -0.2 * body.shape.size[2], 1.0])

    def met_at(q: F64) -> F64:
        return np.asarray(robot.link_frames(q)[int(body.link)] @ body.pose @ below_elbow)[:3]

    sideways = met_at(posture + 1e-4 * swivel) - met_at(posture)
    sideways *= cell.side * np.sign(sideways[1]) / np.linalg.norm(sideways)
    goal, up = toolpath.position[-1], np.array([0.0, 0.0, 1.0])
    onward = goal - toolpath.position[round(6.0 * slower / DT)]
    onward /= np.linalg.norm(onward)
    near = met_at(posture) + (BALL + cell.radius - DEPTH) * sideways
    off, beyond = near + 0.45 * up + 0.1 * sideways, goal + 0.35 * onward + 0.15 * up
    knots = [(0.2, near + 0.30 * sideways), (3.2, near), (3.4, near), (4.6, off), (5.6, beyond), (7.4, goal),
             (9.3, goal), (10.5, beyond)]  # fmt: skip
    fine = DT / SUBSTEPS * np.arange(ticks * SUBSTEPS + 1)
    ball, velocity = smooth_steps(fine, [(slower * at, point) for at, point in knots])
    from_target = np.linalg.norm(ball[::SUBSTEPS] - toolpath.position, axis=1)
    tracking = np.cumsum(from_target < BALL + cell.radius + INFLUENCE + 0.03) == 0
    blocked = (times > 8.7 * slower) & (times <= 9.3 * slower)

    unavoided = np.empty(ticks + 1)
    for k in range(ticks + 1):
        check.place("ball", ball[SUBSTEPS * k])
        unavoided[k] = check.distance(unaware.q[k])

    model = mjcf(robot, bodies, cell.torque, cell.floor, toolpath.position[:: ticks // 60])
    plant = Plant(model, q0)
    n = robot.n
    q, qd, distance = np.empty((len(fine), n)), np.zeros((len(fine), n)), np.empty(len(fine))
    q[0] = q0
    check.place("ball", ball[0])
    distance[0] = check.distance(q0)
    rates, took, status = np.zeros((ticks, n)), np.empty((ticks, 2)), []
    errors = np.empty((ticks, 2))
    wanted, in_force, moving = q0.copy(), np.zeros(n), np.zeros(6)
    torque = 0.0
    gc.disable()
    for k in range(ticks):
        i = SUBSTEPS * k
        measured = q[i]

        before = np.array([time.perf_counter(), time.thread_time()])
        moving[3:] = velocity[i]
        scene.place("ball", ball[i], moving)
        error = DT * program.twist_to(measured, targets[k])
        size = np.array([np.linalg.norm(error[:3]), np.linalg.norm(error[3:])])
        gain = np.minimum(FEEDBACK, np.array(FASTEST) / np.maximum(size, 1e-9))
        program.step(measured, feed[k] + np.repeat(gain, 3) * error, rates[k])
        took[k] = np.array([time.perf_counter(), time.thread_time()]) - before

        status.append(program.status)
        errors[k] = size[::-1]
        # The rates of the tick before are in force during this one: drives interpolate what they are sent.
        for s in range(1, SUBSTEPS + 1):
            plant.step(wanted + s * DT / SUBSTEPS * in_force, in_force, ball[i + s])
            q[i + s], qd[i + s] = plant.data.qpos, plant.data.qvel
            check.place("ball", ball[i + s])
            distance[i + s] = check.distance(q[i + s])
            torque = max(torque, float(np.abs(plant.data.qfrc_actuator / cell.torque).max()))
        wanted = np.clip(wanted + DT * in_force, plant.data.qpos - LEAD, plant.data.qpos + LEAD)
        in_force = rates[k]
    gc.enable()
    return Run(
        robot, name, path, toolpath, times[:-1], q, qd, ball, distance, unavoided, rates, status, took,
        errors[:, 0], errors[:, 1], tracking[:-1], blocked[:-1], BALL + cell.radius + CONTROLLED, torque, model,
    )  # fmt: skip


def draw(run: Run, file: Path) -> None:
    """Draw distance, errors, rates and statuses over time."""
    from redundancy import plots
    from redundancy._plot_style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, STYLE, Figure, mpl

    fine = np.linspace(0.0, run.time[-1] + DT, len(run.distance))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(6.5, 6.0), layout="constrained")
        apart, error, rate, strip = figure.subplots(4, 1, sharex=True, height_ratios=[1.3, 1.0, 1.0, 0.12])
        right = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "fontsize": "small"}
        apart.plot(fine, 1e3 * run.distance, color=BLUE, label="simulated")
        apart.plot(run.time, 1e3 * run.unavoided[:-1], color=GREY, linestyle="--", linewidth=1.2, label="not avoiding")
        apart.axhline(1e3 * SECURITY, color=BLACK, linewidth=1.0, linestyle=":", label="security")
        apart.set(ylabel="distance [mm]", title=f"{run.name}, {run.path}")
        apart.legend(**right)
        error.semilogy(run.time, 1e3 * run.position_error, color=BLUE, label="position [mm]")
        error.semilogy(run.time, 1e3 * run.angle_error, color=ORANGE, label="angle [mrad]")
        error.set(ylabel="error of the hand", ylim=(1e-4, 1e3), yticks=[1e-4, 1e-2, 1e0, 1e2])
        error.legend(**right)
        shades = mpl.colormaps["viridis"](np.linspace(0.0, 0.9, run.robot.n))
        for i, column in enumerate((run.qd / run.robot.qd_max)[::SUBSTEPS].T):
            rate.plot(fine[::SUBSTEPS], column, color=shades[i], linewidth=1.0, label=f"$\\dot q_{{{i + 1}}}$")
        rate.set(ylabel="rate / its limit", ylim=(-1.05, 1.05), yticks=[-1.0, -0.5, 0.0, 0.5, 1.0])
        rate.legend(**right)
        status = np.array(run.status)
        colors = {"solved": GREEN, "relaxed": ORANGE, "limited": PURPLE, "infeasible": BLACK, "not convex": GREY}
        for name in (name for name in colors if name in run.status):
            strip.fill_between(
                run.time, 0.0, 1.0, where=status == name, step="post", color=colors[name], label=name, linewidth=0
            )
        strip.set(xlabel="time [s]", yticks=[], ylim=(0.0, 1.0), xlim=(0.0, fine[-1]))
        strip.legend(**right)
        figure.align_ylabels()
    plots.save(figure, file)


def animate(run: Run, file: Path, every: float = 0.1, size: tuple[int, int] = (480, 400)) -> None:
    """Write an animation, a frame every so many seconds."""
    from PIL import Image, ImageDraw, ImageFont

    model = mujoco.MjModel.from_xml_string(run.model)
    data = mujoco.MjData(model)
    renderer = mujoco.Renderer(model, 2 * size[1], 2 * size[0])
    camera = mujoco.MjvCamera()
    x, y, z, camera.distance, camera.azimuth, camera.elevation = CELLS[run.name].camera
    camera.lookat[:] = x, y, z
    font = ImageFont.load_default(16)
    frames = []
    for k in range(0, len(run.time), round(every / DT)):
        data.qpos[:] = run.q[SUBSTEPS * k]
        data.mocap_pos[0] = run.ball[SUBSTEPS * k]
        mujoco.mj_forward(model, data)
        renderer.update_scene(data, camera)
        frame = Image.fromarray(renderer.render()).resize(size, Image.Resampling.LANCZOS)
        label = f"{run.time[k]:4.1f} s    distance {1e3 * run.distance[SUBSTEPS * k]:3.0f} mm    {run.status[k]}"
        ImageDraw.Draw(frame).text((12, 10), label, fill="black", font=font)
        frames.append(frame)
    renderer.close()
    # One palette for all frames, without dithering: what stands still costs nothing.
    sample = Image.new("RGB", (size[0], 4 * size[1]))
    for i in range(4):
        sample.paste(frames[i * (len(frames) - 1) // 3], (0, i * size[1]))
    sample.paste((0, 158, 115), (0, 0, 60, 60))
    palette = sample.quantize(160, dither=Image.Dither.NONE)
    few = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    few[0].save(file, save_all=True, append_images=few[1:], duration=round(1e3 * every), loop=0, optimize=True)


def report(run: Run) -> None:
    """Print what came of a run."""
    robot = run.robot

    def size(error: F64, unit: str) -> str:
        seen = 1e3 * error[run.tracking]
        return f"{np.sqrt(np.mean(seen**2)):.3f} {unit} rms, {seen.max():.3f} {unit} at most"

    def times(took: F64) -> str:
        median, often, rare = 1e6 * np.percentile(took, [50.0, 99.0, 99.99])
        return f"{median:.1f} us median, {often:.1f} us (99 %), {rare:.1f} us (99.99 %)"

    apart, below = 1e3 * run.distance.min(), int((run.distance < SECURITY).sum())
    forearm, goal = 1e3 * run.unavoided[:-1][run.tracking].min(), 1e3 * run.unavoided.min()
    waits, final = 1e3 * run.position_error[run.blocked].max(), 1e3 * run.position_error[-1]
    margin = np.minimum(run.q - robot.q_min, robot.q_max - run.q).min()
    until = f"until {run.time[run.tracking][-1]:.1f} s"
    rows = {
        f"position, {until}": size(run.position_error, "mm"),
        f"orientation, {until}": size(run.angle_error, "mrad"),
        "smallest distance, every step": f"{apart:.3f} mm; {below} steps below {1e3 * SECURITY:.0f} mm",
        "security distance of the controller": f"{1e3 * CONTROLLED:.0f} mm",
        "smallest distance without avoidance": f"{forearm:.1f} mm at the forearm, {goal:.1f} mm at the goal",
        "ball on the goal: the hand waits": f"{waits:.2f} mm off; no safe pose is within {1e3 * run.nearest:.2f} mm",
        "error at the end": f"{final:.4f} mm, {1e3 * run.angle_error[-1]:.4f} mrad",
        "nearest to a limit of position": f"{margin:.3f} rad",
        "largest rate over its limit": f"{np.abs(run.qd / robot.qd_max).max():.3f}",
        "largest torque over its limit": f"{run.torque:.3f}",
        "statuses": ", ".join(f"{count} {name}" for name, count in Counter(run.status).most_common()),
        "controller, by the clock": times(run.took[:, 0]),
        "controller, time of the processor": times(run.took[:, 1]),
    }
    print(f"{run.name}, {run.path}: {len(run.time)} ticks, {len(run.distance) - 1} steps of the simulation")
    for what, value in rows.items():
        print(f"  {what:36s} {value}")


def main(arguments: list[str] | None = None) -> int:
    """Run the loop, report, draw."""
    parser = argparse.ArgumentParser(description="A 1 kHz loop around a simulated arm.")
    parser.add_argument("--robot", choices=sorted(CELLS), default="panda")
    parser.add_argument("--path", choices=["line", "taught"], default="line")
    parser.add_argument("--seconds", type=float, default=SECONDS, help=f"length of the run, {SECONDS:g} if left out")
    parser.add_argument("--out", type=Path, help="folder for a picture and an animation")
    given = parser.parse_args(arguments)
    run = simulate(given.robot, given.path, given.seconds)
    report(run)
    if given.out is not None:
        given.out.mkdir(parents=True, exist_ok=True)
        file = given.out / f"mujoco_{run.name}_{run.path}.png"
        draw(run, file)
        print(f"  {'written':36s} {file}")
        try:
            animate(run, file.with_suffix(".gif"))
        except (mujoco.FatalError, RuntimeError, AttributeError, ImportError) as error:
            print(f"no animation: {error}. It needs Pillow and OpenGL; without a display try MUJOCO_GL=egl or osmesa")
        else:
            print(f"  {'written':36s} {file.with_suffix('.gif')}")
    return 0 if run.distance.min() >= SECURITY else 1


if __name__ == "__main__":
    sys.exit(main())
