"""Own forward kinematics of any robot, and motions of its joints that follow frames: numpy alone, from the links."""

import numpy as np
import redundancy as rd

from tests.reference.chain import F64

ROUNDS = 12
"""Newton steps at a point of a path at most."""
FOLLOWED = 1e-12
"""Error of the tool that ends them [rad, m]."""
LONGEST = 0.3
"""Longest Newton step of a joint [rad, m]."""
RANK = 1e-7
"""Singular values below this part of the largest are none."""


def frames_of(robot: rd.Robot, q: F64) -> F64:
    """Return the tool frames of postures (N, n), as products of links and joints."""
    return _chain(robot, q)[-1]


def jacobians_of(robot: rd.Robot, q: F64) -> F64:
    """Return the Jacobians of postures, angular rows first, at the tool point: the joints' axes (Whitney 1972)."""
    *joints, tool = _chain(robot, q)
    columns = []
    for letter, frame in zip(robot.chain, joints, strict=True):
        axis = frame[:, :3, 2]
        arm = tool[:, :3, 3] - frame[:, :3, 3]
        turns = letter == "R"
        columns.append(np.hstack([axis, np.cross(axis, arm)] if turns else [np.zeros_like(axis), axis]))
    return np.stack(columns, axis=2)


def _chain(robot: rd.Robot, q: F64) -> list[F64]:
    """Return the frames whose z axes are those of the joints, and the tool's."""
    frame = np.tile(robot.base, (len(q), 1, 1))
    frames = []
    for letter, link, x in zip(robot.chain, robot.links, q.T, strict=True):
        frame = frame @ link
        frames.append(frame)
        moved = np.tile(np.eye(4), (len(q), 1, 1))
        if letter == "R":
            moved[:, 0, 0] = moved[:, 1, 1] = np.cos(x)
            moved[:, 1, 0] = np.sin(x)
            moved[:, 0, 1] = -moved[:, 1, 0]
        else:
            moved[:, 2, 3] = x
        frame = frame @ moved
    return [*frames, frame @ robot.flange @ robot.tool]


def rotation_vectors(turn: F64) -> F64:
    """Return the rotation vectors of rotations (N, 3, 3), below half a turn."""
    odd = np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=1
    )
    sine = 0.5 * np.linalg.norm(odd, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0))
    factor = 0.5 * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)
    return np.asarray(odd * factor[:, None])


def twist_errors(have: F64, wanted: F64, axis: F64 | None = None) -> F64:
    """Return what turns and moves frames onto others (N, 6); with an axis of the tool, its direction alone."""
    if axis is None:
        turn = rotation_vectors(wanted[:, :3, :3] @ have[:, :3, :3].transpose(0, 2, 1))
    else:
        now, then = have[:, :3, :3] @ axis, wanted[:, :3, :3] @ axis
        across = np.cross(now, then)
        sine = np.linalg.norm(across, axis=1)
        angle = np.arctan2(sine, (now * then).sum(axis=1))
        turn = across * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-300), 1.0)[:, None]
    return np.hstack([turn, wanted[:, :3, 3] - have[:, :3, 3]])


def carried(robot: rd.Robot, q: F64, wanted: F64, kind: str, axis: F64, rounds: int = ROUNDS) -> tuple[F64, F64]:
    """Bring postures (N, n) to frames (N, 4, 4) by Newton steps of least norm.

    `kind` is "full", "axisymmetric" or "position". Returns postures, and the errors that are left (N,).
    """
    q = q.copy()
    left = np.full(len(q), np.inf)
    for _ in range(rounds):
        have = frames_of(robot, q)
        error = twist_errors(have, wanted, axis if kind == "axisymmetric" else None)
        jacobian = jacobians_of(robot, q)
        if kind == "position":
            error, jacobian = error[:, 3:], jacobian[:, 3:]
        elif kind == "axisymmetric":
            now = have[:, :3, :3] @ axis
            across = np.tile(np.eye(6), (len(q), 1, 1))
            across[:, :3, :3] -= now[:, :, None] * now[:, None, :]
            jacobian = across @ jacobian
        left = np.abs(error).max(axis=1)
        if (left < FOLLOWED).all():
            break
        step = (np.linalg.pinv(jacobian, rcond=RANK) @ error[:, :, None])[:, :, 0]
        q += step * np.minimum(1.0, LONGEST / np.maximum(np.abs(step).max(axis=1), 1e-300))[:, None]
    return q, left


def followed(robot: rd.Robot, q0: F64, wanted: F64, kind: str, axis: F64) -> F64 | None:
    """Return a motion along frames from a posture, each from the one before; None where one is not reached."""
    q = np.empty((len(wanted), robot.n))
    now = q0[None]
    for i, frame in enumerate(wanted):
        now, left = carried(robot, now, frame[None], kind, axis)
        if left[0] >= 10.0 * FOLLOWED:
            return None
        q[i] = now[0]
    return q
