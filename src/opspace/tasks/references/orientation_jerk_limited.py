"""The fastest turn within limits of velocity, acceleration and jerk."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.tasks.references.jerk_limited import JerkLimited
from opspace.tasks.references.sample import Sample
from opspace.tasks.references.start import Started, optional_time
from opspace.tasks.rotation import as_rotation, exp_rotation, log_rotation, turning_rates


class OrientationJerkLimited(Started):
    """Turns from start to rest at the goal the short way: R = exp([φ(t)]×) R_start.

    φ is a `JerkLimited` motion in R³ from 0 to log(R_goal R_startᵀ), in world axes. With V the left
    Jacobian of SO(3), ω = V(φ) φ̇ and ω̇ = V(φ) φ̈ + V̇ φ̇; at φ = 0 these are φ̇ and φ̈, so that
    a turn on its way gets another goal without a step.

    Args:
        start: First orientation, (3, 3) rotation matrix or quaternion wxyz.
        goal: Last orientation, in either form.
        max_velocity: Limit of each coordinate of φ, rad/s.
        max_acceleration: Limit, rad/s².
        max_jerk: Limit, rad/s³.
        start_time: Time at which it begins, s; None is the first tick that asks.
        start_velocity: (3,) angular velocity at that time in world axes, rad/s; None is rest.
        start_acceleration: (3,) angular acceleration at that time, rad/s²; None is none.

    Attributes:
        duration: Time of the turn, s.

    Raises:
        InputError: An orientation that is not a rotation, or a limit not above zero.
    """

    def __init__(
        self,
        start: ArrayLike,
        goal: ArrayLike,
        *,
        max_velocity: float,
        max_acceleration: float,
        max_jerk: float,
        start_time: float | None = None,
        start_velocity: ArrayLike | None = None,
        start_acceleration: ArrayLike | None = None,
    ) -> None:
        self.start = as_rotation(start, "OrientationJerkLimited: start")
        self.goal = as_rotation(goal, "OrientationJerkLimited: goal")
        self.start_time = optional_time(start_time, "OrientationJerkLimited: start_time")
        self._turn = JerkLimited(
            np.zeros(3),
            log_rotation(self.goal @ self.start.T),
            max_velocity=max_velocity,
            max_acceleration=max_acceleration,
            max_jerk=max_jerk,
            start_time=0.0,
            start_velocity=start_velocity,
            start_acceleration=start_acceleration,
        )
        self.duration = self._turn.duration

    def __call__(self, t: float, /) -> Sample:
        """Return the desired rotation matrix, angular velocity and acceleration at time t, s."""
        elapsed = self.elapsed(t)
        phi, rate, curvature = self._turn(elapsed)
        omega, alpha = turning_rates(phi, rate, curvature)
        R = self.goal if elapsed >= self.duration else exp_rotation(phi) @ self.start
        return Sample(R, omega, alpha)
