"""The data file of random postures: its arrays, and how it is made."""

import multiprocessing
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.reference.condition.cases import MAX_JOINTS, Case, make_case

CASES = 1000
"""Number of postures in the data file."""


def pack(cases: Sequence[Case]) -> dict[str, npt.NDArray[Any]]:
    """Return the padded arrays of the data file.

    Parameters
    ----------
    cases : sequence of Case
        The postures, N of them.

    Returns
    -------
    dict of ndarray
        ``n``, ``m`` (N,) int64; ``rows`` (N, 6) bool; ``joints`` (N, 9) one letter, empty beyond
        n; ``a``, ``d``, ``alpha``, ``theta``, ``q`` (N, 9), NaN beyond n; ``length``, ``kappa``
        (N,); ``gradient`` (N, 10) and ``hessian`` (N, 10, 10) of ``kappa**2``, entries 0..n-1
        over q, entry n over the length, NaN beyond.
    """
    count, width = len(cases), MAX_JOINTS
    out: dict[str, npt.NDArray[Any]] = {
        "n": np.array([len(case.robot.joints) for case in cases], dtype=np.int64),
        "m": np.array([len(case.robot.rows) for case in cases], dtype=np.int64),
        "rows": np.zeros((count, 6), dtype=np.bool_),
        "joints": np.zeros((count, width), dtype="<U1"),
    }
    for name in ("a", "d", "alpha", "theta", "q"):
        out[name] = np.full((count, width), np.nan)
    out["length"] = np.array([float(case.robot.length) for case in cases])
    out["kappa"] = np.array([case.values.kappa for case in cases])
    out["gradient"] = np.full((count, width + 1), np.nan)
    out["hessian"] = np.full((count, width + 1, width + 1), np.nan)
    for i, (robot, q, values) in enumerate(cases):
        n = len(robot.joints)
        out["rows"][i, list(robot.rows)] = True
        out["joints"][i, :n] = list(robot.joints)
        for name, numbers in zip(
            ("a", "d", "alpha", "theta", "q"),
            (robot.a, robot.d, robot.alpha, robot.theta, q),
            strict=True,
        ):
            out[name][i, :n] = numbers
        out["gradient"][i, : n + 1] = values.gradient
        out["hessian"][i, : n + 1, : n + 1] = values.hessian
    return out


def write(path: Path, count: int = CASES, workers: int = 2) -> None:
    """Compute the random postures and write the data file.

    Parameters
    ----------
    path : Path
        The ``.npz`` file.
    count : int, default 1000
        Number of postures.
    workers : int, default 2
        Number of processes.
    """
    start = time.monotonic()
    cases: list[Case] = []
    with multiprocessing.Pool(workers) as pool:
        for case in pool.imap(make_case, range(count), chunksize=4):
            cases.append(case)
            if len(cases) % 50 == 0 or len(cases) == count:
                print(f"{len(cases)} of {count}, {time.monotonic() - start:.0f} s", flush=True)
    np.savez_compressed(path, **pack(cases))  # type: ignore[arg-type]
    kappa = np.array([case.values.kappa for case in cases])
    prismatic = np.mean(["P" in case.robot.joints for case in cases])
    print(f"{path}: {path.stat().st_size} bytes, {prismatic:.0%} of the robots prismatic")
    print(f"kappa {kappa.min():.3g} to {kappa.max():.3g}, median {np.median(kappa):.3g}")
