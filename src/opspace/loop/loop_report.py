"""What a loop did, counted."""

from __future__ import annotations

from dataclasses import astuple, dataclass, field

import numpy as np

from opspace.command import Status
from opspace.loop.history import Cycles


@dataclass
class Counts:
    """What is counted while a loop runs.

    Attributes:
        cycles: States that were answered.
        missed: Times that no state came within one and a half periods.
        old: States that came again, or after a newer one, and were dropped.
        late: Ticks whose state came too late after the one before.
        stale: Ticks in which a robot that moves was where it had been, to the last bit.
        jumps: Ticks whose time had jumped.
        limited: Commands that were held within the torque rate.
        overruns: Answers that took longer than a period.
    """

    cycles: int = 0
    missed: int = 0
    old: int = 0
    late: int = 0
    stale: int = 0
    jumps: int = 0
    limited: int = 0
    overruns: int = 0

    def __add__(self, other: Counts) -> Counts:
        ours, theirs = astuple(self), astuple(other)
        return Counts(*(a + b for a, b in zip(ours, theirs, strict=True)))


@dataclass(frozen=True)
class LoopReport:
    """How a loop went.

    Attributes:
        completed: Whether it came to the end that was asked for.
        reason: Why it ended; empty where its time was over or it goes on.
        t: Time of the last state, s.
        counts: What was counted.
        seen: Every status that a command had.
        standstill: Whether the robot stood still before its driver was stopped.
        answered: Time from a state to its command, µs: median, 99 % and most of the cycles that are
            remembered.
        notes: What was not permitted, and what could not be checked.
    """

    completed: bool
    reason: str
    t: float
    counts: Counts
    seen: Status
    standstill: bool
    answered: tuple[float, float, float]
    notes: tuple[str, ...] = field(default=())

    def __str__(self) -> str:
        c = self.counts
        ended = self.reason or ("completed" if self.completed else "goes on")
        p50, p99, most = self.answered
        lines = [
            f"{ended}; {c.cycles} cycles until t = {self.t:.3f} s",
            f"answered in {p50:.0f} µs, 99 % {p99:.0f}, most {most:.0f}; {c.overruns} overruns",
            f"{c.missed} missed, {c.old} old, {c.late} late, {c.stale} stale, {c.jumps} jumps; "
            f"{c.limited} held within the torque rate",
        ]
        return "\n".join([*lines, *self.notes])


def answer_times(cycles: Cycles) -> tuple[float, float, float]:
    """Median, 99 % and most of the times to an answer, µs; NaN without any."""
    if cycles.answered.size == 0:
        return (np.nan, np.nan, np.nan)
    p50, p99, most = (1e6 * np.percentile(cycles.answered, [50.0, 99.0, 100.0])).tolist()
    return p50, p99, most
