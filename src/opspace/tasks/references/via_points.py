"""A smooth curve through points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.references.sample import Sample
from opspace.tasks.references.start import Started, optional_time
from opspace.tasks.validation import finite_array


class ViaPoints(Started):
    """Passes through points at given times, at rest at both ends.

    A spline of degree five: continuous up to the fourth derivative, with zero velocity and
    acceleration at the first and last point. It does not stop at the points between, and may
    swing beyond them; two points give exactly ``MinimumJerk``. To stop on the way, chain several
    references with ``Chain``. Holds the first point before the first time and the last one after
    the last.

    Args:
        times: (p,) rising times since it begins, s; two or more.
        points: (p, k) points.
        start_time: Time at which it begins, s; None is the first tick that asks.

    Raises:
        InputError: Times that do not rise, another number of points, or values not finite.
    """

    def __init__(
        self, times: ArrayLike, points: ArrayLike, start_time: float | None = None
    ) -> None:
        from scipy.interpolate import make_interp_spline  # noqa: PLC0415 - slow to import

        self.times = finite_array(times, (None,), "ViaPoints: times")
        if len(self.times) < 2 or (np.diff(self.times) <= 0.0).any():
            raise InputError("ViaPoints: times must be two or more rising numbers")
        self.start_time = optional_time(start_time, "ViaPoints: start_time")
        self.points = finite_array(points, (len(self.times), None), "ViaPoints: points")
        at_rest = [(order, np.zeros(self.points.shape[1])) for order in (1, 2)]
        spline = make_interp_spline(self.times, self.points, k=5, bc_type=(at_rest, at_rest))
        self._curves = (spline, spline.derivative(1), spline.derivative(2))
        self._rest = np.zeros(self.points.shape[1])

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        t = self.elapsed(t)
        if t <= self.times[0]:
            return Sample(self.points[0], self._rest, self._rest)
        if t >= self.times[-1]:
            return Sample(self.points[-1], self._rest, self._rest)
        x, v, a = (curve(t) for curve in self._curves)
        return Sample(x, v, a)
