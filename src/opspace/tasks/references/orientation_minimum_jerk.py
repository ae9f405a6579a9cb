"""Rotation about a fixed axis from rest to rest."""

from __future__ import annotations

from numpy.typing import ArrayLike

from opspace.tasks.references.phase import minimum_jerk_phase
from opspace.tasks.references.sample import Sample
from opspace.tasks.references.start import Started, optional_time
from opspace.tasks.rotation import as_rotation, exp_rotation, log_rotation
from opspace.tasks.validation import positive


class OrientationMinimumJerk(Started):
    """Turns from start to goal the short way about one axis: R = exp([s(t) φ]×) R_start.

    φ = log(R_goal R_startᵀ) is in world axes and fixed, so that the angular velocity is ṡ φ and
    the angular acceleration s̈ φ, both in world axes.

    Args:
        start: First orientation, (3, 3) rotation matrix or quaternion wxyz.
        goal: Last orientation, in either form.
        duration: Time of the motion, s.
        start_time: Time at which it begins, s; None is the first tick that asks.

    Raises:
        InputError: An orientation that is not a rotation, or a duration not above zero.
    """

    def __init__(
        self,
        start: ArrayLike,
        goal: ArrayLike,
        duration: float,
        start_time: float | None = None,
    ) -> None:
        self.start = as_rotation(start, "OrientationMinimumJerk: start")
        self.goal = as_rotation(goal, "OrientationMinimumJerk: goal")
        self.duration = positive(duration, "OrientationMinimumJerk: duration")
        self.start_time = optional_time(start_time, "OrientationMinimumJerk: start_time")
        self._way = log_rotation(self.goal @ self.start.T)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired rotation matrix, angular velocity and acceleration at time t, s."""
        s, rate, curvature = minimum_jerk_phase(self.elapsed(t), 0.0, self.duration)
        R = self.goal if s == 1.0 else exp_rotation(s * self._way) @ self.start
        return Sample(R, rate * self._way, curvature * self._way)
