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
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import redundancy as rd
from mujoco_pictures import animate, draw
from mujoco_plant import BALL, CELLS, DT, F64, SECURITY, SUBSTEPS, Cell, Plant, Run, mjcf, mujoco

SECONDS = 12.0
"""Length of a run [s]; a longer one is a slower one."""

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

DEPTH = 0.05
"""How deep the ball would go into the forearm if the arm did not give way [m]."""
LEAD = 0.01
"""What is sent to the servos is ahead of what is measured by this at most [rad]: they may be at their torque."""


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


@dataclass(frozen=True)
class Setup:
    """A robot, the way of its hand, and what makes it follow."""

    robot: rd.Robot
    cell: Cell
    bodies: list[rd.Body]
    check: rd.Scene
    """For the distances of the true posture."""
    scene: rd.Scene
    """The one that the programme looks at."""
    program: rd.QuadraticProgram
    slower: float
    """Length of the run over `SECONDS`."""
    times: F64
    """Of the ticks, and the end [s]."""
    toolpath: rd.Toolpath
    feed: F64
    """Twist of the hand along the path, at every tick."""
    unaware: F64
    """Postures of an arm that follows the path without looking, at every tick and after the last."""


def set_up(name: str, path: str, seconds: float) -> Setup:
    """Make the programme and its scenes, and lay the path."""
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
    times = DT * np.arange(round(seconds / DT) + 1)
    toolpath, feed = hand_path(robot, cell, path, times, 0.5 * slower, 8.5 * slower)
    blind = rd.QuadraticProgram(narrower, rd.Task.full(), objective, **settings)
    unaware = rd.track(blind, toolpath, q0, progress=False).q
    return Setup(robot, cell, bodies, check, scene, program, slower, times, toolpath, feed, unaware)


def ball_path(setup: Setup) -> tuple[F64, F64]:
    """Return where the ball is at every step of the simulation, and how fast.

    It goes to the forearm, up and away, beyond the goal, onto it, and away again.
    """
    robot, cell, toolpath, slower = setup.robot, setup.cell, setup.toolpath, setup.slower
    posture = setup.unaware[round(3.2 * slower / DT)]
    swivel = np.linalg.svd(robot.jacobian(posture))[2][-1]
    body = next(body for body in setup.bodies if body.name == cell.forearm)

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
    fine = DT / SUBSTEPS * np.arange((len(setup.times) - 1) * SUBSTEPS + 1)
    return smooth_steps(fine, [(slower * at, point) for at, point in knots])


@dataclass
class Record:
    """What the loop writes down; `Run` says what each is."""

    q: F64
    qd: F64
    distance: F64
    rates: F64
    status: list[str]
    took: F64
    errors: F64
    """Of position [m] and of angle [rad], at every tick (N, 2)."""
    torque: float

    @classmethod
    def empty(cls, ticks: int, n: int) -> "Record":
        """Return one for so many ticks and joints."""
        steps = ticks * SUBSTEPS + 1
        return cls(
            np.empty((steps, n)), np.zeros((steps, n)), np.empty(steps),
            np.zeros((ticks, n)), [], np.empty((ticks, 2)), np.empty((ticks, 2)), 0.0,
        )  # fmt: skip


def close_loop(setup: Setup, plant: Plant, ball: F64, velocity: F64) -> Record:
    """Let the programme move the plant, tick by tick."""
    scene, check, program = setup.scene, setup.check, setup.program
    ticks, n = len(setup.times) - 1, setup.robot.n
    targets = setup.toolpath.targets(program.task)
    record = Record.empty(ticks, n)
    record.q[0] = setup.cell.q0
    check.place("ball", ball[0])
    record.distance[0] = check.distance(record.q[0])
    wanted, in_force, moving = np.array(setup.cell.q0), np.zeros(n), np.zeros(6)
    gc.disable()
    for k in range(ticks):
        i = SUBSTEPS * k
        measured = record.q[i]

        before = np.array([time.perf_counter(), time.thread_time()])
        moving[3:] = velocity[i]
        scene.place("ball", ball[i], moving)
        error = DT * program.twist_to(measured, targets[k])
        size = np.array([np.linalg.norm(error[:3]), np.linalg.norm(error[3:])])
        gain = np.minimum(FEEDBACK, np.array(FASTEST) / np.maximum(size, 1e-9))
        program.step(measured, setup.feed[k] + np.repeat(gain, 3) * error, record.rates[k])
        record.took[k] = np.array([time.perf_counter(), time.thread_time()]) - before

        record.status.append(program.status)
        record.errors[k] = size[::-1]
        # The rates of the tick before are in force during this one: drives interpolate what they are sent.
        for s in range(1, SUBSTEPS + 1):
            plant.step(wanted + s * DT / SUBSTEPS * in_force, in_force, ball[i + s])
            record.q[i + s], record.qd[i + s] = plant.data.qpos, plant.data.qvel
            check.place("ball", ball[i + s])
            record.distance[i + s] = check.distance(record.q[i + s])
            record.torque = max(record.torque, float(np.abs(plant.data.qfrc_actuator / setup.cell.torque).max()))
        wanted = np.clip(wanted + DT * in_force, plant.data.qpos - LEAD, plant.data.qpos + LEAD)
        in_force = record.rates[k]
    gc.enable()
    return record


def simulate(name: str, path: str, seconds: float = SECONDS) -> Run:
    """Run the loop."""
    setup = set_up(name, path, seconds)
    robot, cell, times, toolpath = setup.robot, setup.cell, setup.times, setup.toolpath
    ball, velocity = ball_path(setup)
    from_target = np.linalg.norm(ball[::SUBSTEPS] - toolpath.position, axis=1)
    tracking = np.cumsum(from_target < BALL + cell.radius + INFLUENCE + 0.03) == 0
    blocked = (times > 8.7 * setup.slower) & (times <= 9.3 * setup.slower)
    unavoided = np.empty(len(times))
    for k in range(len(times)):
        setup.check.place("ball", ball[SUBSTEPS * k])
        unavoided[k] = setup.check.distance(setup.unaware[k])

    dots = toolpath.position[:: (len(times) - 1) // 60]
    model = mjcf(robot, setup.bodies, cell.torque, cell.floor, dots)
    record = close_loop(setup, Plant(model, np.array(cell.q0)), ball, velocity)
    return Run(
        robot=robot, name=name, path=path, toolpath=toolpath, time=times[:-1],
        q=record.q, qd=record.qd, ball=ball, distance=record.distance, unavoided=unavoided,
        rates=record.rates, status=record.status, took=record.took,
        position_error=record.errors[:, 0], angle_error=record.errors[:, 1],
        tracking=tracking[:-1], blocked=blocked[:-1], nearest=BALL + cell.radius + CONTROLLED,
        torque=record.torque, model=model,
    )  # fmt: skip


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
