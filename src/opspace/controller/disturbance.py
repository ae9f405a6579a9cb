"""What joints do beside what the model says: wrong masses, friction, pushes."""

from __future__ import annotations

import math

import numpy as np

from opspace.law.scalars import LONGEST_LESSON


class DisturbanceObserver:
    r"""Learns the acceleration that comes on top of the commanded one.

    With q̈ₖ the acceleration that the model gives for the torque of tick k,

        dₖ = (vₖ₊₁ − vₖ)/Δt − q̈ₖ,        δ ← δ + min(1, Δt/T) (dₖ − δ)

    The torque is assumed to have been on the joints between the two ticks.

    Args:
        n: Number of joints.
        time: T, s.
    """

    def __init__(self, n: int, time: float) -> None:
        self.acceleration = np.zeros(n)
        self._time = time
        self._t = math.nan
        self._v = np.zeros(n)
        self._commanded = np.zeros(n)

    def observe(self, t: float, v: np.ndarray) -> None:
        """See the velocity that came of the last torque.

        Args:
            t: Time, s.
            v: (n,) joint velocity, rad/s.
        """
        dt = t - self._t
        if 0.0 < dt <= LONGEST_LESSON:
            found = (v - self._v) / dt - self._commanded
            if np.all(np.isfinite(found)):
                self.acceleration += min(1.0, dt / self._time) * (found - self.acceleration)

    def remember(self, t: float, v: np.ndarray, commanded: np.ndarray) -> None:
        """Keep what has just been commanded.

        Args:
            t: Time, s.
            v: (n,) joint velocity, rad/s.
            commanded: (n,) acceleration that the model gives for the torque, rad/s².
        """
        self._t = t
        self._v[:] = v
        self._commanded[:] = commanded

    def forget_last(self) -> None:
        """Learn nothing from the tick that comes next: what this one commands is not known."""
        self._t = math.nan
