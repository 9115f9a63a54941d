"""Random robots and postures, drawn so that they do not depend on the platform.

Only uniform random numbers and mpmath decide what is drawn and kept: no LAPACK, no libm.
"""

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import mpmath
import numpy as np

from tests.reference.condition.chain import Robot, as_mpf, differentiated, zeros
from tests.reference.condition.index import Reference, inverse_of, kappa_of, reference_exact, rounded, scaled_rows

MAX_JOINTS = 9
"""Width of the padded arrays in the data file."""
SEED = 20140522
"""Seed of the data file."""
MAX_KAPPA = 1.2e7
"""Largest condition number in the data file."""
GENERIC_MAX_KAPPA = 1e5
"""Largest condition number of a posture that was not pushed towards a singularity."""


class Case(NamedTuple):
    """One posture of the data file with its reference values."""

    robot: Robot
    q: tuple[float, ...]
    values: Reference


class _Plan(NamedTuple):
    """What a case must look like; the geometry is redrawn until it does."""

    n: int
    prismatic: int
    right: bool
    kind: str
    rows: tuple[int, ...]
    target: float


def _pick(rng: np.random.Generator, items: Sequence[Any], weights: Sequence[float]) -> Any:
    """Return one of ``items`` with the given weights."""
    total = rng.random() * sum(weights)
    for item, weight in zip(items, weights, strict=True):
        total -= weight
        if total < 0:
            return item
    return items[-1]


def _subset(rng: np.random.Generator, size: int) -> tuple[int, ...]:
    """Return ``size`` random rows in rising order."""
    return tuple(sorted(int(row) for row in rng.permutation(6)[:size]))


def _plan(rng: np.random.Generator, index: int) -> _Plan:
    """Draw what case ``index`` must look like."""
    n = int(_pick(rng, range(3, MAX_JOINTS + 1), (0.1, 0.1, 0.1, 0.32, 0.2, 0.1, 0.08)))
    prismatic = int(rng.integers(1, min(3, n - 2) + 1)) if rng.random() < 0.5 else 0
    right = bool(rng.random() < (0.45 if n >= 6 else 0.6))
    rows: tuple[int, ...]
    if n >= 6 and rng.random() < 0.75:
        kind, rows = "full", (0, 1, 2, 3, 4, 5)
        if right and n == 6 and rng.random() < 0.4:
            kind = "wrist"
    elif n >= 6:
        kind = _pick(rng, ("subset", "linear", "planar"), (0.6, 0.25, 0.15 if right else 0.0))
        rows = _subset(rng, int(_pick(rng, (5, 4, 3), (0.5, 0.2, 0.3))))
    else:
        kind = _pick(rng, ("subset", "linear", "planar"), (0.35, 0.35, 0.5 if right else 0.0))
        rows = _subset(rng, int(rng.integers(2, n + 1)))
    if kind == "linear":
        rows = (3, 4, 5)
    elif kind == "planar":
        rows = (2, 3, 4) if rng.random() < 0.8 else (3, 4)
        prismatic = min(prismatic, 2, (n - 1) // 2)
    # Only revolute joints turn the tool: one is needed for every angular row.
    prismatic = min(prismatic, n - sum(row < 3 for row in rows))
    target = 0.0
    if index % 10 in (1, 4, 7):
        target = float(rng.uniform(2.0, 7.0))
    return _Plan(n, prismatic, right, kind, rows, target)


def _planar_joints(rng: np.random.Generator, n: int, prismatic: int) -> str:
    """Return joints in random order, none of the prismatic ones first or next to another."""
    places = [
        places
        for places in itertools.combinations(range(1, n), prismatic)
        if all(second - first > 1 for first, second in itertools.pairwise(places))
    ]
    chosen = places[int(rng.integers(len(places)))]
    return "".join("P" if i in chosen else "R" for i in range(n))


def _draw_robot(rng: np.random.Generator, plan: _Plan) -> Robot:
    """Draw a robot of the planned kind; it may be singular everywhere."""
    n = plan.n
    free = n - 3 if plan.kind == "wrist" else n
    letters = ["P"] * min(plan.prismatic, free) + ["R"] * (free - min(plan.prismatic, free))
    joints = "".join(letters[int(i)] for i in rng.permutation(free)) + "R" * (n - free)
    if plan.kind == "planar":
        joints = _planar_joints(rng, n, plan.prismatic)

    a = [float(value) for value in rng.uniform(-0.8, 0.8, n)]
    d = [float(value) for value in rng.uniform(-0.8, 0.8, n)]
    alpha = [float(value) for value in rng.uniform(-math.pi, math.pi, n)]
    theta = [float(value) for value in rng.uniform(-math.pi, math.pi, n)]
    length = float(rng.uniform(0.1, 1.2))
    if plan.right:
        quarter = math.pi / 2
        # A catalogue robot: round figures, some of them zero, and right angles.
        a = [0.0 if rng.random() < 0.4 else round(value, 3) for value in a]
        d = [0.0 if rng.random() < 0.4 else round(value, 3) for value in d]
        turns = ((-1, 0, 1, 2), (0.4, 0.15, 0.4, 0.05))
        alpha = [quarter * _pick(rng, *turns) for _ in range(n)]
        turns = ((-1, 0, 1, 2), (0.15, 0.6, 0.15, 0.1))
        theta = [quarter * _pick(rng, *turns) for _ in range(n)]
        length = round(length, 3)
    if plan.kind == "wrist":
        sign = -1 if rng.random() < 0.5 else 1
        alpha[3:] = [sign * math.pi / 2, -sign * math.pi / 2, 0.0]
        a[3:] = [0.0, 0.0, 0.0]
        d[4] = 0.0
        theta[4] = 0.0
    if plan.kind == "planar":
        # The axis of a prismatic joint lies in the plane: turn into it before and out after.
        a = [float(rng.uniform(0.1, 0.9)) for _ in range(n)]
        alpha = [0.0] * n
        for i in range(n):
            if joints[i] == "P":
                alpha[i - 1], alpha[i], theta[i] = math.pi / 2, -math.pi / 2, 0.0
    return Robot(
        joints,
        tuple(a),
        tuple(d),
        tuple(alpha),
        tuple(theta),
        plan.rows,
        length,
    )


def _draw_posture(rng: np.random.Generator, robot: Robot) -> list[float]:
    """Draw joint variables."""
    return [float(rng.uniform(-math.pi, math.pi) if joint == "R" else rng.uniform(-0.7, 0.7)) for joint in robot.joints]


def _as_floats(robot: Robot, q: Sequence[Any]) -> tuple[float, ...] | None:
    """Return float64 joint variables, angles in (-pi, pi], or None if a prismatic one is large."""
    out = []
    for joint, value in zip(robot.joints, q, strict=True):
        if joint == "R":
            out.append(float(value - 2 * mpmath.pi * mpmath.nint(value / (2 * mpmath.pi))))
        elif abs(value) > 2:
            return None
        else:
            out.append(float(value))
    return tuple(out)


def _singular_posture(robot: Robot, start: Sequence[float]) -> list[Any] | None:
    """Solve ``J_n^T u = 0``, ``|u| = 1`` for a posture and a direction by damped Gauss-Newton.

    The unknowns outnumber the equations, so each step is the one of least norm.
    """
    n, m = len(robot.joints), len(robot.rows)
    length = as_mpf(robot.length)
    q = [as_mpf(value) for value in start]
    scaled = scaled_rows(robot, differentiated(robot, q, 0).jacobian, length)
    try:
        inverse = inverse_of(scaled @ scaled.T)
    except ZeroDivisionError:
        return None
    u = zeros(m)
    u.fill(mpmath.mpf(1))
    for _ in range(8):
        u = inverse @ u
        u = u / mpmath.sqrt(u @ u)

    for _ in range(25):
        chain = differentiated(robot, q, 1)
        scaled = scaled_rows(robot, chain.jacobian, length)
        residual = zeros(n + 1)
        residual[:n] = scaled.T @ u
        residual[n] = (u @ u - 1) / 2
        square = residual @ residual
        if square < mpmath.mpf("1e-44"):
            return q
        slope = zeros(n + 1, n + m)
        for k in range(n):
            slope[:n, k] = scaled_rows(robot, chain.first[k], length).T @ u
        slope[:n, n:] = scaled.T
        slope[n, n:] = u
        normal = slope @ slope.T
        for k in range(n + 1):
            normal[k, k] += square
        try:
            multiplier = inverse_of(normal) @ residual
        except ZeroDivisionError:
            return None
        step = -(slope.T @ multiplier)
        largest = max(abs(value) for value in step)
        if largest > 0.5:
            step = step / (2 * largest)
        q = [value + step[k] for k, value in enumerate(q)]
        u = u + step[n:]
    return None


def _pushed_posture(
    rng: np.random.Generator, robot: Robot, plan: _Plan, start: Sequence[float]
) -> tuple[float, ...] | None:
    """Return a posture next to a singular one, with a condition number near the planned target."""
    n = len(robot.joints)
    if plan.kind == "wrist" and rng.random() < 0.6:
        singular: list[Any] | None = [as_mpf(value) for value in start]
        direction = [mpmath.mpf(0)] * n
        assert singular is not None
        singular[4], direction[4] = mpmath.mpf(0), mpmath.mpf(1)
    else:
        singular = _singular_posture(robot, start)
        direction = [as_mpf(value) for value in rng.uniform(-1.0, 1.0, n)]
    if singular is None:
        return None

    target = mpmath.mpf(10) ** plan.target
    distance = 1 / target
    for _ in range(8):
        moved = [s + distance * e for s, e in zip(singular, direction, strict=True)]
        q = _as_floats(robot, moved)
        if q is None:
            return None
        kappa = kappa_of(robot, [as_mpf(value) for value in q])
        if not mpmath.isfinite(kappa):
            return None
        if target / 1.5 < kappa < target * 1.1 and distance < mpmath.mpf("0.2"):
            return q
        distance = min(distance * kappa / target, mpmath.mpf(1))
    return None


def make_case(index: int) -> Case:
    """Draw case ``index`` of the data file and compute its reference values.

    Parameters
    ----------
    index : int
        Number of the case; it seeds the random numbers, together with ``SEED``.

    Returns
    -------
    Case
        Robot, posture and values.
    """
    rng = np.random.default_rng([SEED, index])
    for attempt in range(2000):
        # Some plans cannot be met: the first axis is z whatever the robot, so that for instance
        # two revolute joints never serve both rows 0 and 1.
        if attempt % 100 == 0:
            plan = _plan(rng, index)
        robot = _draw_robot(rng, plan)
        start = _draw_posture(rng, robot)
        with mpmath.workdps(30):
            kappa = kappa_of(robot, [as_mpf(value) for value in start])
            if not kappa < GENERIC_MAX_KAPPA:
                continue
            q: tuple[float, ...] | None = tuple(start)
            if plan.target:
                q = _pushed_posture(rng, robot, plan, start)
        if q is None:
            continue
        values = rounded(reference_exact(robot, q))
        # A Cartesian robot has a constant index, which would test nothing.
        if values.kappa < MAX_KAPPA and np.abs(values.gradient[:-1]).max() > 1e-6:
            return Case(robot, q, values)
    raise RuntimeError(f"no posture found for case {index}")
