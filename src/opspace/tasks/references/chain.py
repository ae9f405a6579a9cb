"""References one after the other."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np

from opspace.errors import InputError
from opspace.tasks.references.sample import Reference, Sample
from opspace.tasks.references.start import Started, begun, optional_time
from opspace.tasks.validation import Array, finite

# Rounding of values computed in two ways; a jump that a robot can feel is far larger.
CONTINUITY_TOLERANCE = 1e-6


class Chain(Started):
    """Follows one reference after the other, each from its own time on.

    Out, hold and back again: ``Chain((0.0, MinimumJerk(a, b, 1.0)), (3.0, MinimumJerk(b, a, 1.0)))``.
    Times are counted from where the chain begins. A piece begins when its time has come; one with a
    start time of its own begins then, counted like the times. Before the first time the first one is
    followed.

    Args:
        pieces: Pairs (time in s, reference), times rising.
        start_time: Time at which the chain begins, s; None is the first tick that asks.

    Raises:
        InputError: No piece, times that do not rise, or a jump of value or velocity between two
            pieces.
    """

    def __init__(self, *pieces: tuple[float, Reference], start_time: float | None = None) -> None:
        if not pieces:
            raise InputError("Chain: at least one piece is needed")
        self._times = [finite(time, "Chain: time") for time, _ in pieces]
        self.start_time = optional_time(start_time, "Chain: start_time")
        self._references = [
            begun(reference, time) for (_, reference), time in zip(pieces, self._times, strict=True)
        ]
        if any(b <= a for a, b in zip(self._times, self._times[1:], strict=False)):
            raise InputError(f"Chain: times must rise, not {self._times}")
        _check_joints(self._times, self._references)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        t = self.elapsed(t)
        return self._references[max(bisect_right(self._times, t) - 1, 0)](t)


def _check_joints(times: Sequence[float], references: Sequence[Reference]) -> None:
    for time, before, after in zip(times[1:], references, references[1:], strict=False):
        one, two = before(time), after(time)
        for what, a, b in (("value", one.x, two.x), ("velocity", one.v, two.v)):
            gap = _gap(a, b)
            if gap > CONTINUITY_TOLERANCE:
                raise InputError(f"Chain: the {what} jumps by {gap:.3g} at t = {time:g} s")


def _gap(a: Array, b: Array) -> float:
    """Return the largest difference; no numbers at all are a rest of whatever length."""
    if np.size(a) == 0 or np.size(b) == 0:
        return float(np.abs(np.concatenate((np.ravel(a), np.ravel(b)))).max(initial=0.0))
    return float(np.abs(np.subtract(a, b)).max()) if np.shape(a) == np.shape(b) else np.inf
