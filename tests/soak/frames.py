"""Postures of arms without an ideal wrist: `python -m tests.soak frames` prints a table and fails if a bar is missed.

Half of the frames are special against the base: tool straight down, in one plane with axis 1, on axis 1, along
coordinate planes, and next to all of these by 1e-12 to 1e-3. Bars: the posture that made the frame is found; the number
of regular postures is even; `complete` holds for 99.9 % of the frames whose postures all have a smallest singular value
above 1e-4, and a thousand Newton searches never refute it; "singular" is never said of a posture above 1e-6. An arm
whose Jacobian lacks a direction everywhere has a continuum of postures: some have to come, flagged, and never
"complete".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import process_time

import numpy as np
import redundancy as rd
from redundancy._util import progress_bar as progress

from tests.reference.arms import angles, distance, search, smallest_singular_value
from tests.reference.chain import F64
from tests.reference.special import general_arm, paired_arm, real_arms, special_postures
from tests.soak.options import scaled

FOUND, REGULAR, CLEAR, SHARE = 1e-6, 1e-6, 1e-4, 0.999
ROUNDING = 3e-15
STARTS = 1000


@dataclass
class Row:
    """What is counted of one arm, or of several."""

    name: str
    arms: int = 0
    frames: int = 0
    seconds: float = 0.0
    missed: int = 0
    """Frames whose own posture did not come, though rounding of the frame does not explain it."""
    odd: int = 0
    clear: int = 0
    """Frames all of whose postures are far from singular."""
    complete: int = 0
    """Of these, those whose answer is complete."""
    checked: int = 0
    refuted: int = 0
    called_singular: int = 0
    """Regular postures that were called singular."""
    continuum: int = 0
    """Frames of arms that are singular everywhere."""
    continuum_wrong: int = 0
    """Of these, those without a posture, with one that is not flagged, or called complete."""

    @property
    def passed(self) -> bool:
        """Whether every bar is met."""
        bad = self.missed + self.odd + self.refuted + self.called_singular + self.continuum_wrong
        return bad == 0 and self.complete >= SHARE * self.clear

    def add(
        self, robot: rd.Robot, q: F64, rng: np.random.Generator, checks: int, advance: Callable[[int], None]
    ) -> None:
        """Count the frames of one arm; some of them are searched by Newton, too."""
        self.arms += 1
        everywhere = bool((_sigma(robot, angles(rng, 20, 6)) < REGULAR).all())
        poses = robot.fk(q)
        to_check = []
        for index, (posture, pose) in enumerate(zip(q, poses, strict=True)):
            begin = process_time()
            found, singular, complete = robot.inverse(pose, report=True)
            self.seconds += process_time() - begin
            self.frames += 1
            if everywhere:
                self.continuum += 1
                self.continuum_wrong += not (len(found) and singular.all() and not complete)
                continue
            sigma = _sigma(robot, found) if len(found) else np.empty(0)
            own = float(_sigma(robot, posture[None])[0])
            near = float(distance(found, posture).min(initial=np.inf))
            explained = near * own <= ROUNDING or own < REGULAR
            self.missed += near > FOUND and not explained
            self.odd += int((~singular).sum()) % 2
            self.called_singular += int((singular & (sigma > REGULAR)).sum())
            if min(own, sigma.min(initial=np.inf)) > CLEAR:
                self.clear += 1
                self.complete += complete
                if complete:
                    to_check.append((index, found))
        advance(len(q))
        for start in range(0, min(checks, len(to_check)), 20):
            part = to_check[start : start + 20]
            starts = angles(rng, len(part), STARTS, 6)
            for (_, found), others in zip(part, search(robot, poses[[i for i, _ in part]], starts), strict=True):
                self.checked += 1
                self.refuted += any(distance(found, other).min(initial=np.inf) > 1e-5 for other in others)


def _sigma(robot: rd.Robot, q: F64) -> F64:
    return smallest_singular_value(robot, q)


def rows(scale: float, seed: int, advance: Callable[[int], None]) -> Iterator[Row]:
    """Count every family, at a share of the full number of frames."""
    rng = np.random.default_rng(seed)
    frames, checks = max(12, round(20_000 * scale)), round(200 * scale)
    for robot in real_arms():
        row = Row(robot.name)
        row.add(robot, special_postures(robot, frames, rng), rng, checks, advance)
        yield row
    for name, make in (("any six axes", general_arm), ("pairs of axes parallel, meeting or one", paired_arm)):
        row, arms = Row(name), max(2, round(50 * min(1.0, 10.0 * scale)))
        for _ in range(arms):
            robot = make(rng)
            row.add(robot, special_postures(robot, max(12, frames // arms), rng), rng, max(1, checks // arms), advance)
        yield row


def table(counted: list[Row]) -> Iterator[str]:
    """Print the rows."""
    yield (
        "| arm | arms | frames | missed | odd | clear | complete of these | searched | refuted | called singular"
        " | continuum, wrong | us a frame | |"
    )
    yield "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|"
    for row in counted:
        share = row.complete / row.clear if row.clear else 1.0
        yield (
            f"| {row.name} | {row.arms} | {row.frames} | {row.missed} | {row.odd} | {row.clear} | {share:.3%}"
            f" | {row.checked} | {row.refuted} | {row.called_singular} | {row.continuum}, {row.continuum_wrong}"
            f" | {1e6 * row.seconds / max(row.frames, 1):.0f} | {'pass' if row.passed else '**missed**'} |"
        )


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
    options = scaled((__doc__ or "").splitlines()[0], "frames", arguments)
    with progress(round(200_000 * options.scale), "frames") as advance:
        counted = list(rows(options.scale, options.seed, advance))
    print("\n".join(table(counted)))
    return 0 if all(row.passed for row in counted) else 1
