"""Ways from what a task follows now to a goal, within limits of speed, acceleration and jerk."""

from __future__ import annotations

from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from opspace.errors import InputError
from opspace.tasks.references import (
    JerkLimited,
    OrientationJerkLimited,
    PoseReference,
    Sample,
)
from opspace.tasks.rotation import log_rotation
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

    def limits(self) -> dict[str, float]:
        """Return them as `JerkLimited` takes them."""
        return {
            "max_velocity": self.speed,
            "max_acceleration": self.acceleration,
            "max_jerk": self.acceleration / JERK_TIME,
        }


class Way(Protocol):
    """A reference that arrives.

    Attributes:
        end: Time from which on it stays, s.
    """

    end: float

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        ...


class VectorWay:
    """Goes to a value, with the limits along the straight way and across it.

    Args:
        now: What is followed at its beginning, (k,) each.
        goal: (k,) where it goes.
        t: Time at which it begins, s.
        pace: Its limits.
    """

    def __init__(self, now: Sample, goal: Array, t: float, pace: Pace) -> None:
        self._start, self.goal = now.x, goal
        self._axes = _axes_along(goal - now.x)
        back = self._axes.T
        way, rates = back @ (goal - now.x), (back @ now.v, back @ now.a)
        self._motion = _begun_gently(JerkLimited, np.zeros(goal.size), way, rates, t, pace)
        self.end = t + self._motion.duration

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        y, v, a = self._motion(t)
        x = self.goal if t >= self.end else self._start + self._axes @ y
        return Sample(x, self._axes @ v, self._axes @ a)


class RotationWay:
    """Turns to an orientation the short way, with the limits about the axis of the turn and across it.

    Args:
        now: What is followed at its beginning: (3, 3) rotation matrix, (3,) and (3,) rates.
        goal: (3, 3) where it turns to.
        t: Time at which it begins, s.
        pace: Its limits.
    """

    def __init__(self, now: Sample, goal: Array, t: float, pace: Pace) -> None:
        self.goal = goal
        W = self._axes = _axes_along(log_rotation(goal @ now.x.T))
        start, end = W.T @ now.x @ W, W.T @ goal @ W
        rates = (W.T @ now.v, W.T @ now.a)
        self._motion = _begun_gently(OrientationJerkLimited, start, end, rates, t, pace)
        self.end = t + self._motion.duration

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        W, (R, omega, alpha) = self._axes, self._motion(t)
        return Sample(self.goal if t >= self.end else W @ R @ W.T, W @ omega, W @ alpha)


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


Motion = TypeVar("Motion", JerkLimited, OrientationJerkLimited)


def _begun_gently(
    kind: type[Motion], start: Array, goal: Array, rates: tuple[Array, Array], t: float, pace: Pace
) -> Motion:
    """Make a motion that begins with these rates, or from rest where none within the limits does."""
    try:
        return kind(
            start,
            goal,
            **pace.limits(),
            start_time=t,
            start_velocity=rates[0],
            start_acceleration=rates[1],
        )
    except InputError:
        return kind(start, goal, **pace.limits(), start_time=t)


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
