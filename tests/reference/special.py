"""Arms without a spherical wrist as people own them, and frames that are special against their base."""

from collections.abc import Callable

import numpy as np
import redundancy as rd

from tests.reference.arms import angles, random_arm
from tests.reference.chain import F64

DEGREE = np.pi / 180.0


def product_of_exponentials(axes: F64, points: F64, name: str) -> rd.Robot:
    """Return the arm whose axes have these directions at zero, each through a point given from the one before [m]."""
    links, end = [], np.eye(4)
    for axis, point in zip(axes, points, strict=True):
        z = axis / np.linalg.norm(axis)
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        aligned, shift = np.eye(4), np.eye(4)
        aligned[:3, :3] = np.array([x, np.cross(z, x), z]).T
        shift[:3, 3] = point
        links.append(end @ shift @ aligned)
        end = aligned.T
    return rd.Robot.from_links(np.array(links), end, "R" * 6, name=name)


def _calibrated(robot: rd.Robot, rng: np.random.Generator) -> rd.Robot:
    """Return the arm with every link off by about a tenth of a millimetre and of a milliradian."""
    links = robot.links
    for link in links[1:]:
        off = np.eye(4)
        x, y, z = 1e-4 * rng.standard_normal(3)
        off[:3, :3] = np.linalg.qr(np.array([[1, -z, y], [z, 1, -x], [-y, x, 1]]))[0]
        off[:3, :3] *= np.sign(np.diag(off[:3, :3]))
        off[:3, 3] = 1e-4 * rng.standard_normal(3)
        link[:] = link @ off
    return rd.Robot.from_links(links, robot.flange, robot.joints, name=f"{robot.name}, calibrated")


def crx_10ia() -> rd.Robot:
    """Return the FANUC CRX-10iA, from its published modified Denavit-Hartenberg table."""
    return rd.Robot.from_dh(
        [0, 0, 0.54, 0, 0, 0],
        [0, 0, 0, -0.54, 0.15, -0.16],
        DEGREE * np.array([0, -90, 180, -90, 90, -90]),
        DEGREE * np.array([0, -90, 0, 0, 0, 0]),
        convention="modified",
        tool=np.diag([1.0, -1.0, -1.0, 1.0]),
        name="CRX-10iA",
    )


def real_arms() -> list[rd.Robot]:
    """Return arms like those on the market: lengths from data sheets, rounded; two of them calibrated."""
    x, y, z = np.eye(3)
    rng = np.random.default_rng(7)
    offset = [z, y, -y, -x, -y, -x]
    jaco = 0.0741 / (2.0 * np.cos(30.0 * DEGREE))
    return [
        crx_10ia(),
        product_of_exponentials(
            np.array(offset),
            np.array([[0, 0, 0.245], [0, 0, 0], [0, 0, 0.71], [0, 0, 0], [0.54, -0.15, 0], [0.16, 0, 0]]),
            "CRX-10iA/L",
        ),
        product_of_exponentials(
            np.array([z, y, y, x, y, x]),
            np.array([[0, 0, 0.265], [0, 0, 0], [0, 0, 0.444], [0.096, 0, 0.11], [0.374, 0, 0], [0.101, 0, 0.08]]),
            "like a GoFa",
        ),
        product_of_exponentials(
            np.array(offset),
            np.array([[0, 0, 0.275], [0, 0, 0], [0, 0, 0.7], [0, 0, 0], [0.5, -0.162, 0], [0.13, 0, 0]]),
            "like an HC10",
        ),
        rd.Robot.from_dh(
            [0, 0, 0.28948866, 0.0775, 0, 0.076],
            [0.267, 0, 0, 0.3425, 0, 0.097],
            DEGREE * np.array([0, -90, 0, -90, 90, -90]),
            [0, -1.3849179, 1.3849179, 0, 0, 0],
            convention="modified",
            name="like an xArm6",
        ),
        _calibrated(rd.robots.get("ur10e"), rng),
        _calibrated(rd.robots.get("fanuc_m710ic50"), rng),
        rd.Robot.from_dh(
            [0, 0.41, 0, 0, 0, 0],
            [0.2755, 0, -0.0098, -0.2073 - jaco, -2.0 * jaco, -0.16 - jaco],
            DEGREE * np.array([90, 180, 90, 60, 60, 180]),
            np.zeros(6),
            name="like a Jaco",
        ),
    ]


def paired_arm(rng: np.random.Generator) -> rd.Robot:
    """Return an arm some of whose neighbouring axes are parallel, meet or are one, exactly or to rounding."""
    a, d = rng.uniform(-0.5, 0.5, (2, 6))
    alpha = rng.uniform(-np.pi, np.pi, 6)
    kinds = rng.choice(["any", "parallel", "meeting", "square", "coaxial"], 6, p=[0.3, 0.2, 0.25, 0.2, 0.05])

    def rounding() -> float:
        return 0.0 if rng.random() < 0.5 else float(rng.choice([1e-17, 1e-16, 1e-15]) * rng.standard_normal())

    for i, kind in enumerate(kinds[:5]):
        if kind in ("parallel", "coaxial"):
            alpha[i] = rng.choice([0.0, np.pi]) + rounding()
        if kind in ("meeting", "coaxial"):
            a[i] = rounding()
        if kind == "square":
            alpha[i] = rng.choice([-0.5, 0.5]) * np.pi
            a[i] = rng.choice([0.0, a[i]])
        if rng.random() < 0.4:
            d[i] = rounding()
    return rd.Robot.from_dh(a, d, alpha, np.zeros(6), name="pairs: " + ", ".join(kinds[:5]))


def general_arm(rng: np.random.Generator) -> rd.Robot:
    """Return any arm."""
    return random_arm(rng, "general").robot()


def _straight_down(pose: F64) -> F64:
    return pose[:, :2, 2]


def _in_plane_with_first(pose: F64) -> F64:
    return (pose[:, 0, 2] * pose[:, 1, 3] - pose[:, 1, 2] * pose[:, 0, 3])[:, None]


def _on_first_axis(pose: F64) -> F64:
    return pose[:, :2, 3]


def _square_to_first(pose: F64) -> F64:
    return pose[:, 2:3, 2]


def _in_coordinate_plane(pose: F64) -> F64:
    return np.stack([pose[:, 1, 3], pose[:, 1, 2]], 1)


def _along_coordinates(pose: F64) -> F64:
    """Off-diagonal products that vanish where the frame's axes are along those of the base."""
    x, z = pose[:, :3, 0], pose[:, :3, 2]
    return np.stack([x[:, 0] * x[:, 1], x[:, 1] * x[:, 2], x[:, 0] * x[:, 2], z[:, 0] * z[:, 1], z[:, 1] * z[:, 2]], 1)


SPECIAL: dict[str, Callable[[F64], F64]] = {
    "straight down": _straight_down,
    "in plane with axis 1": _in_plane_with_first,
    "on axis 1": _on_first_axis,
    "square to axis 1": _square_to_first,
    "in a coordinate plane": _in_coordinate_plane,
    "along coordinates": _along_coordinates,
}


def special_postures(robot: rd.Robot, count: int, rng: np.random.Generator) -> F64:
    """Return postures, half of them any, half with frames that are special, exactly or by 1e-12 to 1e-3 rad."""
    base = robot.with_base(np.eye(4))
    found = [angles(rng, count - count // 2, 6)]
    missing = count // 2
    for index, residual in enumerate(SPECIAL.values()):
        wanted = missing // (len(SPECIAL) - index)
        q = _solved(base, residual, wanted, rng)
        missing -= wanted
        off = np.where(rng.random(len(q)) < 0.4, 0.0, 10.0 ** rng.uniform(-12, -3, len(q)))
        found.append(q + off[:, None] * rng.standard_normal(q.shape) / np.sqrt(6.0))
    return np.concatenate(found)


def _solved(robot: rd.Robot, residual: Callable[[F64], F64], count: int, rng: np.random.Generator) -> F64:
    """Return postures at which a residual of the flange frame vanishes, as many as are found in a few rounds."""
    flange = robot.with_tool(np.eye(4))
    kept: list[F64] = []
    for _ in range(6):
        q = angles(rng, 2 * count + 8, 6)
        for _ in range(30):
            value = residual(flange.fk(q))
            slope = np.stack(
                [(residual(flange.fk(q + 1e-6 * e)) - residual(flange.fk(q - 1e-6 * e))) / 2e-6 for e in np.eye(6)], 2
            )
            step = np.linalg.pinv(slope, rcond=1e-8) @ value[:, :, None]
            q = q - step[:, :, 0] * np.minimum(1.0, 0.5 / np.maximum(np.abs(step[:, :, 0]).max(1), 1e-300))[:, None]
        kept.extend(q[np.abs(residual(flange.fk(q))).max(1) < 1e-15])
        if len(kept) >= count:
            break
    return np.array(kept[:count]).reshape(-1, 6)
