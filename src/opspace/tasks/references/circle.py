"""Motion on a circle."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.references.phase import minimum_jerk_phase
from opspace.tasks.references.sample import Sample
from opspace.tasks.references.start import Started, optional_time
from opspace.tasks.rotation import cross
from opspace.tasks.validation import finite_array, positive


class Circle(Started):
    """Moves on a circle, x = c + r (cos θ e₁ + sin θ e₂), from rest up to one turn per period.

    The rate θ̇ rises from 0 to 2π/period along the minimum-jerk phase, so that the acceleration
    is continuous from the start on; then it stays. Before it begins it holds ``start``.

    Args:
        center: (3,) c, m.
        radius: r, m.
        period: Time of one turn at full speed, s.
        normal: (3,) axis of the circle; the motion is counter-clockwise about it. e₁ is the world
            axis that is most nearly perpendicular to it, made perpendicular; e₂ = normal × e₁.
        start_time: Time at which it begins, s; None is the first tick that asks.
        ramp: Time to reach full speed, s; None is one period.

    Attributes:
        start: (3,) first point c + r e₁, m.

    Raises:
        InputError: A radius, period or ramp not above zero, or a normal of length zero.
    """

    def __init__(
        self,
        center: ArrayLike,
        radius: float,
        period: float,
        *,
        normal: ArrayLike = (0.0, 0.0, 1.0),
        start_time: float | None = None,
        ramp: float | None = None,
    ) -> None:
        self.center = finite_array(center, (3,), "Circle: center")
        self.radius = positive(radius, "Circle: radius")
        self.period = positive(period, "Circle: period")
        self.start_time = optional_time(start_time, "Circle: start_time")
        self.ramp = self.period if ramp is None else positive(ramp, "Circle: ramp")
        axis = finite_array(normal, (3,), "Circle: normal")
        length = math.hypot(*axis)
        if length == 0.0:
            raise InputError("Circle: normal must not be zero")
        axis = axis / length
        e1 = np.eye(3)[int(np.argmin(np.abs(axis)))]
        e1 = e1 - (axis @ e1) * axis
        e1 /= math.hypot(*e1)
        self._e1, self._e2 = self.radius * e1, self.radius * cross(axis, e1)
        self.start = self.center + self._e1

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        theta, rate, acceleration = self._angle(self.elapsed(t))
        outward = math.cos(theta) * self._e1 + math.sin(theta) * self._e2
        along = math.cos(theta) * self._e2 - math.sin(theta) * self._e1
        return Sample(self.center + outward, rate * along, acceleration * along - rate**2 * outward)

    def _angle(self, elapsed: float) -> tuple[float, float, float]:
        full = 2.0 * math.pi / self.period
        s, slope, _ = minimum_jerk_phase(elapsed, 0.0, self.ramp)
        u = min(max(elapsed / self.ramp, 0.0), 1.0)
        # The integral of the phase over the ramp, 5/2 u⁴ − 3 u⁵ + u⁶, then full speed.
        ramped = self.ramp * u**4 * (2.5 - 3.0 * u + u * u)
        after = max(elapsed - self.ramp, 0.0)
        return full * (ramped + after), full * s, full * slope
