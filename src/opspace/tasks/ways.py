"""Ways from what a task follows now to a goal, within limits of speed, acceleration and jerk."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from opspace.law.swift_motion import swift_at, swift_motion, swift_time
from opspace.tasks.references import PoseReference, Sample
from opspace.tasks.rotation import exp_rotation, log_rotation, turning_rates
from opspace.tasks.validation import Array

JERK_TIME = 0.1
"""Time in which a way reaches its largest acceleration, s."""


class Pace(NamedTuple):
    """How fast a way may be.

    Attributes:
        speed: Largest speed, m/s or rad/s.
        acceleration: Largest acceleration, m/s² or rad/s².
    """

    speed: float
    acceleration: float


class Way(Protocol):
    """A reference that arrives.

    Attributes:
        end: Time from which on it stays, s.
    """

    end: float

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        ...


class SwiftWay:
    """The way from nowhere to a vector, each coordinate as fast as the limits allow.

    The first coordinate is along the vector, the others across it; these only come to rest.

    Args:
        way: (k,) where it goes.
        velocity: (k,) at its beginning.
        acceleration: (k,) at its beginning.
        pace: Its limits.

    Attributes:
        duration: How long it takes, s.
    """

    def __init__(self, way: Array, velocity: Array, acceleration: Array, pace: Pace) -> None:
        self._axes = _axes_along(way)
        self._limits = most, jerk = pace.acceleration, pace.acceleration / JERK_TIME
        self._parts: list[tuple[float, float, float, float, float]] = []
        self._ends: list[tuple[float, float]] = []
        for d, v, a in (np.stack((way, velocity, acceleration), axis=1).T @ self._axes).T.tolist():
            plan = swift_motion(d, v, a, pace.speed, most, jerk)
            self._parts.append((*plan, v, a))
            self._ends.append((swift_time(*plan, v, a, most, jerk), d))
        self.duration = max(end for end, _ in self._ends)

    def __call__(self, elapsed: float) -> Sample:
        """Return position, velocity and acceleration a time after its beginning, s."""
        found = [
            swift_at(elapsed, *parts, *self._limits) if elapsed < end else (d, 0.0, 0.0)
            for parts, (end, d) in zip(self._parts, self._ends, strict=True)
        ]
        return Sample(*(self._axes @ np.array(found)).T)


class VectorWay:
    """Goes to a value, with the limits along the straight way and across it.

    Args:
        now: What is followed at its beginning, (k,) each.
        goal: (k,) where it goes.
        t: Time at which it begins, s.
        pace: Its limits.
    """

    def __init__(self, now: Sample, goal: Array, t: float, pace: Pace) -> None:
        self._start, self.goal, self._begin = now.x, goal, t
        self._motion = SwiftWay(goal - now.x, now.v, now.a, pace)
        self.end = t + self._motion.duration

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        if t >= self.end:
            return Sample(self.goal, np.zeros(self.goal.size), np.zeros(self.goal.size))
        x, v, a = self._motion(t - self._begin)
        return Sample(self._start + x, v, a)


class RotationWay:
    """Turns to an orientation the short way: R = exp([φ(t)]×) R_now, with φ on a `SwiftWay`.

    Args:
        now: What is followed at its beginning: (3, 3) rotation matrix, (3,) and (3,) rates.
        goal: (3, 3) where it turns to.
        t: Time at which it begins, s.
        pace: Its limits.
    """

    def __init__(self, now: Sample, goal: Array, t: float, pace: Pace) -> None:
        self._start, self.goal, self._begin = now.x, goal, t
        self._turn = SwiftWay(log_rotation(goal @ now.x.T), now.v, now.a, pace)
        self.end = t + self._turn.duration

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        if t >= self.end:
            return Sample(self.goal, np.zeros(3), np.zeros(3))
        phi, rate, curvature = self._turn(t - self._begin)
        omega, alpha = turning_rates(phi, rate, curvature)
        return Sample(exp_rotation(phi) @ self._start, omega, alpha)


class PoseWay(PoseReference):
    """Goes to a pose: its position and its orientation each on a way of its own.

    Args:
        now: What is followed at its beginning: (4, 4) pose, (6,) and (6,) rates.
        goal: (4, 4) where it goes.
        t: Time at which it begins, s.
        linear: Limits of the position.
        angular: Limits of the orientation.
    """

    def __init__(self, now: Sample, goal: Array, t: float, linear: Pace, angular: Pace) -> None:
        place = Sample(now.x[:3, 3], now.v[:3], now.a[:3])
        turn = Sample(now.x[:3, :3], now.v[3:], now.a[3:])
        position = VectorWay(place, goal[:3, 3], t, linear)
        orientation = RotationWay(turn, goal[:3, :3], t, angular)
        super().__init__(position, orientation)
        self.goal = goal
        self.end = max(position.end, orientation.end)


def _axes_along(way: Array) -> Array:
    """Return a rotation (k, k) whose first column points along a vector (k,)."""
    axes = np.eye(way.size)
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return axes
    normal = way / length - axes[0]
    square = float(normal @ normal)
    if square < 1e-30:
        return axes
    axes -= 2.0 / square * np.outer(normal, normal)
    if way.size > 1:
        axes[:, -1] *= -1.0  # a reflection otherwise
    return axes
