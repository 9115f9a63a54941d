"""Quadratic programmes at length: `python -m tests.soak qp` prints a table and fails if a bar is missed.

A hundred thousand random strictly convex programmes (`tests.reference.programmes` states the generator) beside daqp,
proxqp and clarabel (dependency group qp; those that are not installed are left out).

Bars: every answer of ours is proved by the numbers of the problem alone. A minimiser is proved by solving the
optimality conditions for its multipliers anew with 192 bits, which bounds the distance of the result to the true
minimiser by 1e-8; ours is within 1e-8 of it (both in the metric of H, relative to max(1, |x|_H)). Infeasibility is
proved by a certificate that excludes every x below 1e6. Peers are measured against what is proved: how many of their
answers are farther than 1e-8 from it or say the opposite, and how many of these miss the optimality conditions by more
than 1e-9 with their own multipliers.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any

import numpy as np
import redundancy as rd
from redundancy._util import progress_bar as progress

from tests.reference.chain import F64
from tests.reference.programmes import KINDS, Programme, Proof, out_of_reach, prove, random_programme, residual

AGREE = 1e-8
RESIDUAL = 1e-9
EXCLUDED = 1e6
"""Certificates exclude every x up to this."""
TIGHT = 1e-12
"""What peers are asked for."""
LISTED = 20

Answer = tuple[str, F64, F64]
"""solved, infeasible or another word; x; multipliers, bounds first, positive at lower limits."""
Peer = Callable[[Programme], Answer]


def daqp() -> Peer:
    """Dual active set."""
    library: Any = importlib.import_module("daqp")

    def solve(programme: Programme) -> Answer:
        _, lower, upper = programme.stacked()
        sense = np.where(lower == upper, 5, 0).astype(np.intc)
        limits = np.minimum(upper, 1e30), np.maximum(lower, -1e30)
        options = {"primal_tol": 1e-11, "dual_tol": TIGHT, "iter_limit": 10000}
        x, _, flag, info = library.solve(programme.h, programme.g, programme.rows, *limits, sense, **options)
        return {1: "solved", -1: "infeasible"}.get(flag, f"flag {flag}"), np.array(x), -np.array(info["lam"])

    return solve


def proxqp() -> Peer:
    """Augmented Lagrangian."""
    library: Any = importlib.import_module("proxsuite").proxqp
    words = {
        library.QPSolverOutput.PROXQP_SOLVED: "solved",
        library.QPSolverOutput.PROXQP_PRIMAL_INFEASIBLE: "infeasible",
    }

    def solve(programme: Programme) -> Answer:
        normals, lower, upper = programme.stacked()
        equal = lower == upper
        qp = library.dense.QP(programme.n, int(equal.sum()), int((~equal).sum()))
        qp.settings.eps_abs, qp.settings.eps_rel, qp.settings.max_iter = 1e-11, 0.0, 100
        qp.settings.eps_primal_inf, qp.settings.max_iter_in = 1e-8, 200
        rest = normals[~equal], np.maximum(lower[~equal], -1e20), np.minimum(upper[~equal], 1e20)
        qp.init(programme.h, programme.g, normals[equal], lower[equal], *rest)
        qp.solve()
        multipliers = np.empty(len(lower))
        multipliers[equal], multipliers[~equal] = -np.array(qp.results.y), -np.array(qp.results.z)
        return words.get(qp.results.info.status, str(qp.results.info.status)), np.array(qp.results.x), multipliers

    return solve


def clarabel() -> Peer:
    """Interior point."""
    library: Any = importlib.import_module("clarabel")
    sparse: Any = importlib.import_module("scipy.sparse")
    settings = library.DefaultSettings()
    settings.verbose, settings.max_iter, settings.max_threads = False, 300, 1
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = TIGHT
    # What misses that by little is judged like any other.
    words = {"Solved": "solved", "AlmostSolved": "solved", "PrimalInfeasible": "infeasible"}

    def solve(programme: Programme) -> Answer:
        normals, lower, upper = programme.stacked()
        equal = np.flatnonzero(lower == upper)
        below = np.flatnonzero(np.isfinite(lower) & (lower != upper))
        above = np.flatnonzero(np.isfinite(upper) & (lower != upper))
        matrix = np.vstack([normals[equal], -normals[below], normals[above]])
        right = np.r_[upper[equal], -lower[below], upper[above]]
        cones = [library.ZeroConeT(len(equal)), library.NonnegativeConeT(len(below) + len(above))]
        h = sparse.csc_matrix(np.triu(programme.h))
        found = library.DefaultSolver(h, programme.g, sparse.csc_matrix(matrix), right, cones, settings).solve()
        z, multipliers = np.array(found.z), np.zeros(len(lower))
        multipliers[equal] = -z[: len(equal)]
        # Infinite in some answers that are no minimisers.
        with np.errstate(invalid="ignore"):
            multipliers[below] += z[len(equal) : len(equal) + len(below)]
            multipliers[above] -= z[len(equal) + len(below) :]
        return words.get(str(found.status), str(found.status)), np.array(found.x), multipliers

    return solve


def ours(programme: Programme) -> tuple[Answer, int]:
    """Return this package's answer, and how often the working set changed."""
    x, status, bounds, rows, changes = rd.solve_qp(**programme.arguments())
    return (status, x, np.r_[bounds, rows]), changes


@dataclass
class Row:
    """What is counted of one solver on one kind of programme."""

    solver: str
    kind: str
    programmes: int = 0
    said: Counter[str] = field(default_factory=Counter)
    unproved: int = 0
    """Answers of ours that are not proved."""
    far: int = 0
    """Minimisers farther than the bar from the proved one, and opposite verdicts."""
    far_by_itself: int = 0
    """Those among them that miss the optimality conditions as well."""
    worst: float = 0.0
    """Largest distance from the proved minimiser that is within the bar."""
    farthest: float = 0.0
    """Largest distance of all."""
    residual: float = 0.0
    """Largest violation of the optimality conditions."""
    changes: int = 0
    seconds: float = 0.0
    notes: list[str] = field(default_factory=list)

    def measure(self, programme: Programme, answer: Answer, proof: Proof | None, label: str) -> None:
        """Count an answer beside what is proved; without a minimiser the programme is proved infeasible."""
        status, x, multipliers = answer
        if status not in ("solved", "infeasible"):
            return
        if status == "infeasible" or proof is None:
            if (status == "infeasible") != (proof is None):
                self.far += 1
                self.far_by_itself += status == "solved" and residual(programme, x, multipliers) > RESIDUAL
                self.notes.append(f"{label}: {self.solver} {status}, against what is proved")
            return
        distance, own = proof.distance(programme, x), residual(programme, x, multipliers)
        self.residual, self.farthest = max(self.residual, own), max(self.farthest, distance)
        if distance <= AGREE:
            self.worst = max(self.worst, distance)
        else:
            self.far += 1
            self.far_by_itself += own > RESIDUAL
            if own <= RESIDUAL or self.solver == "ours":
                self.notes.append(f"{label}: {self.solver} is {distance:.1e} away, residual {own:.1e}")


def run(count: int, seed: int, advance: Callable[[int], None]) -> list[Row]:
    """Solve the programmes with everything there is."""
    peers: dict[str, Peer] = {}
    for make in (daqp, proxqp, clarabel):
        try:
            peers[make.__name__] = make()
        except ImportError:
            print(f"{make.__name__} is not installed", file=sys.stderr)
    rows = {(solver, kind): Row(solver, kind) for kind in KINDS for solver in ("ours", *peers)}
    for index in range(count):
        programme = random_programme(np.random.default_rng([seed, index]))
        label = f"random_programme(default_rng({[seed, index]}))"
        row = rows["ours", programme.kind]
        begin = perf_counter()
        answer, changes = ours(programme)
        row.seconds += perf_counter() - begin
        row.programmes += 1
        row.said[answer[0]] += 1
        row.changes = max(row.changes, changes)
        proof = prove(programme, answer[2]) if answer[0] == "solved" else None
        if answer[0] == "solved" and proof is not None:
            proved = proof.error <= AGREE
        else:
            proved = answer[0] == "infeasible" and out_of_reach(programme, answer[2]) >= EXCLUDED
        others = [(name, *_timed(peer, programme)) for name, peer in peers.items()]
        if proved:
            row.measure(programme, answer, proof, label)
        else:
            row.unproved += 1
            said = ", ".join(f"{name} {other[0]}" for name, other, _ in others)
            error = "" if proof is None else f" (bound {proof.error:.1e})"
            row.notes.append(f"{label}: {programme.kind}, ours {answer[0]} is not proved{error}; {said}")
        for name, other, seconds in others:
            row = rows[name, programme.kind]
            row.programmes += 1
            row.seconds += seconds
            row.said[other[0]] += 1
            if proved:
                row.measure(programme, other, proof, label)
        advance(1)
    return list(rows.values())


def _timed(peer: Peer, programme: Programme) -> tuple[Answer, float]:
    begin = perf_counter()
    answer = peer(programme)
    return answer, perf_counter() - begin


def _tables(rows: list[Row]) -> Iterator[str]:
    yield (
        "| programmes | solver | number | solved | infeasible | other | not proved | off by more than 1e-8, or opposite"
        " | of them off by their own residual | largest distance within | farthest | largest residual | most changes"
        " | us each |"
    )
    yield "|---|---|--:|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|"
    for row in rows:
        known = ("solved", "infeasible")
        other = ", ".join(f"{word}: {number}" for word, number in row.said.most_common() if word not in known) or "-"
        own = row.solver == "ours"
        mean = 1e6 * row.seconds / max(row.programmes, 1)
        cells = (row.kind, row.solver, row.programmes, row.said["solved"], row.said["infeasible"], other)
        found = (row.far, row.far_by_itself, f"{row.worst:.1e}", f"{row.farthest:.1e}", f"{row.residual:.1e}")
        last = (row.changes if own else "", f"{mean:.0f}")
        yield f"| {' | '.join(map(str, (*cells, row.unproved if own else '', *found, *last)))} |"
    for own in (True, False):
        notes = [note for row in rows for note in row.notes if (row.solver == "ours") == own]
        if notes:
            yield f"\n{min(LISTED, len(notes))} of {len(notes)} {'answers of ours' if own else 'of peers'}:\n"
            yield from (f"- {note}" for note in notes[:LISTED])


def main(arguments: list[str] | None = None) -> int:
    """Run the soak.

    Parameters
    ----------
    arguments : list of str, optional
        Command-line arguments, by default those of the process.

    Returns
    -------
    int
        Exit status, 1 if a bar was missed.
    """
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=100_000, help="number of programmes")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    options = parser.parse_args(arguments)
    with progress(options.count, "programmes") as advance:
        rows = run(options.count, options.seed, advance)
    print("\n".join(_tables(rows)))
    return 1 if any(row.solver == "ours" and (row.far or row.unproved) for row in rows) else 0
