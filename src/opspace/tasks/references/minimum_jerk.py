"""Straight motion from rest to rest with the least jerk."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.tasks.references.phase import minimum_jerk_phase
from opspace.tasks.references.sample import Sample
from opspace.tasks.references.start import Started, optional_time
from opspace.tasks.validation import finite_array, positive


class MinimumJerk(Started):
    """Moves straight from start to goal: x = start + s(t) (goal − start), s quintic.

    Holds the start before it begins and the goal after the motion (Flash and Hogan 1985).

    Args:
        start: (k,) first value, or a number.
        goal: Last value, of the same shape.
        duration: Time of the motion, s.
        start_time: Time at which it begins, s; None is the first tick that asks.

    Raises:
        InputError: Shapes that differ, values that are not finite, or a duration not above zero.
    """

    def __init__(
        self,
        start: ArrayLike,
        goal: ArrayLike,
        duration: float,
        start_time: float | None = None,
    ) -> None:
        self.start = finite_array(start, None, "MinimumJerk: start")
        self.goal = finite_array(goal, self.start.shape, "MinimumJerk: goal")
        self.duration = positive(duration, "MinimumJerk: duration")
        self.start_time = optional_time(start_time, "MinimumJerk: start_time")
        self._way = self.goal - self.start

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        s, rate, curvature = minimum_jerk_phase(self.elapsed(t), 0.0, self.duration)
        # start + 1.0 * (goal − start) may miss the goal by a rounding error.
        x = self.goal if s == 1.0 else self.start + s * self._way
        return Sample(x, rate * self._way, curvature * self._way)
