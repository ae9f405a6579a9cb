"""Motion on an arc of a circle, from rest to rest."""

from __future__ import annotations

import numpy as np

from opspace.tasks import MinimumJerk, Sample
from opspace.tasks.rotation import cross, exp_rotation
from opspace.tasks.validation import Array


class Arc:
    """Turns a point about an axis with the least jerk: x = c + R(θ(t)) (start − c).

    Args:
        start: (3,) first point, m.
        center: (3,) a point on the axis c, m.
        axis: (3,) direction of the axis, of any length above zero.
        angle: Angle of the way out, rad, counter-clockwise about the axis.
        reference: Way as a fraction of that angle over time.
    """

    def __init__(
        self, start: Array, center: Array, axis: Array, angle: float, reference: MinimumJerk
    ) -> None:
        self._center = center
        self._arm = start - center
        self._turn = angle / float(np.linalg.norm(axis)) * axis
        self._reference = reference

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        way = self._reference(t)
        s, rate, curvature = float(way.x), float(way.v), float(way.a)
        arm = exp_rotation(s * self._turn) @ self._arm
        along = cross(self._turn, arm)
        inward = cross(self._turn, along)
        return Sample(self._center + arm, rate * along, curvature * along + rate**2 * inward)
