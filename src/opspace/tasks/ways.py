"""Ways from what a task follows now to a goal, within limits of speed, acceleration and jerk."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

import numpy as np

from opspace.law.swift_motion import JERK_SHARE, swift_at, swift_motion, swift_time
from opspace.law.way_columns import (
    ACCELERATION,
    AWAY,
    BEGAN,
    END,
    MIRROR,
    NO_MIRROR,
    PUSH,
    SPEED,
    STAY,
    TOP,
    WAY_SIZE,
)
from opspace.tasks.references import PoseReference, Sample
from opspace.tasks.rotation import exp_rotation, homogeneous, log_rotation, turning_rates
from opspace.tasks.validation import Array

JERK_TIME = 1.0 / JERK_SHARE
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
        rows: (k, WAY_SIZE) what is planned for each, see `opspace.law.way_columns`; compiled code keeps
            the same.
        most: Its largest acceleration.

    Attributes:
        rows: The same.
        most: The same.
        duration: How long it takes, s.
    """

    def __init__(self, rows: Array, most: float) -> None:
        self.rows, self.most = rows, most
        normal = rows[:, MIRROR]
        self._axes = np.eye(len(rows)) - np.outer(normal, normal)
        if normal.any() and len(rows) > 1:
            self._axes[:, -1] *= -1.0  # a reflection otherwise
        self._parts: list[list[float]] = rows.tolist()
        self.duration = max(part[END] for part in self._parts)

    @classmethod
    def planned(cls, way: Array, velocity: Array, acceleration: Array, pace: Pace) -> SwiftWay:
        """Plan a way.

        Args:
            way: (k,) where it goes.
            velocity: (k,) at its beginning.
            acceleration: (k,) at its beginning.
            pace: Its limits.
        """
        rows = np.zeros((way.size, WAY_SIZE))
        rows[:, MIRROR] = _mirror_to(way)
        axes = cls(rows, pace.acceleration)._axes
        for column, x in ((AWAY, way), (SPEED, velocity), (ACCELERATION, acceleration)):
            rows[:, column] = x @ axes
        limits = pace.acceleration, JERK_SHARE * pace.acceleration
        for row in rows:
            d, v, a = row[[AWAY, SPEED, ACCELERATION]].tolist()
            plan = swift_motion(d, v, a, pace.speed, *limits)
            row[[PUSH, TOP, STAY]] = plan
            row[END] = swift_time(*plan, v, a, *limits)
        return cls(rows, pace.acceleration)

    def __call__(self, elapsed: float) -> Sample:
        """Return position, velocity and acceleration a time after its beginning, s."""
        limits = self.most, JERK_SHARE * self.most
        found = [
            swift_at(
                elapsed, row[PUSH], row[TOP], row[STAY], row[SPEED], row[ACCELERATION], *limits
            )
            if elapsed < row[END]
            else (row[AWAY], 0.0, 0.0)
            for row in self._parts
        ]
        return Sample(*(self._axes @ np.array(found)).T)


class VectorWay:
    """Goes to a value, with the limits along the straight way and across it.

    Args:
        motion: How it goes, with what is followed at its beginning.
        goal: (k,) where it goes.
        begin: Time at which it begins, s.
    """

    def __init__(self, motion: SwiftWay, goal: Array, begin: float) -> None:
        self.motion, self.goal, self.begin = motion, goal, begin
        self._start = motion.rows[:, BEGAN].copy()
        self.end = begin + motion.duration

    @classmethod
    def to(cls, now: Sample, goal: Array, t: float, pace: Pace) -> VectorWay:
        """Plan the way from what is followed at time t [s], (k,) each, to a goal (k,)."""
        motion = SwiftWay.planned(goal - now.x, now.v, now.a, pace)
        motion.rows[:, BEGAN] = now.x
        return cls(motion, goal, t)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        if t >= self.end:
            return Sample(self.goal, np.zeros(self.goal.size), np.zeros(self.goal.size))
        x, v, a = self.motion(t - self.begin)
        return Sample(self._start + x, v, a)


class RotationWay:
    """Turns to an orientation the short way: R = exp([φ(t)]×) R_start, with φ on a `SwiftWay`.

    Args:
        motion: How it turns.
        start: (3, 3) orientation at its beginning.
        goal: (3, 3) where it turns to.
        begin: Time at which it begins, s.
    """

    def __init__(self, motion: SwiftWay, start: Array, goal: Array, begin: float) -> None:
        self.motion, self.start, self.goal, self.begin = motion, start, goal, begin
        self.end = begin + motion.duration

    @classmethod
    def to(cls, now: Sample, goal: Array, t: float, pace: Pace) -> RotationWay:
        """Plan the turn from what is followed at time t [s], (3, 3) and (3,) rates, to a goal (3, 3)."""
        motion = SwiftWay.planned(log_rotation(goal @ now.x.T), now.v, now.a, pace)
        return cls(motion, now.x, goal, t)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        if t >= self.end:
            return Sample(self.goal, np.zeros(3), np.zeros(3))
        phi, rate, curvature = self.motion(t - self.begin)
        omega, alpha = turning_rates(phi, rate, curvature)
        return Sample(exp_rotation(phi) @ self.start, omega, alpha)


class PoseWay(PoseReference):
    """Goes to a pose: its position and its orientation each on a way of its own.

    Args:
        place: The way of the position.
        turn: That of the orientation.
    """

    def __init__(self, place: VectorWay, turn: RotationWay) -> None:
        super().__init__(place, turn)
        self.place, self.turn = place, turn
        self.goal = homogeneous(place.goal, turn.goal)
        self.end = max(place.end, turn.end)

    @classmethod
    def to(cls, now: Sample, goal: Array, t: float, linear: Pace, angular: Pace) -> PoseWay:
        """Plan both ways from what is followed at time t [s], (4, 4) and rates, to a goal (4, 4)."""
        place = Sample(now.x[:3, 3], now.v[:3], now.a[:3])
        turn = Sample(now.x[:3, :3], now.v[3:], now.a[3:])
        return cls(
            VectorWay.to(place, goal[:3, 3], t, linear),
            RotationWay.to(turn, goal[:3, :3], t, angular),
        )


def _mirror_to(way: Array) -> Array:
    """Return the normal, of length √2 or none, of the mirror from the first axis to a vector (k,)."""
    length = float(np.linalg.norm(way))
    if length == 0.0:
        return np.zeros(way.size)
    normal = way / length
    normal[0] -= 1.0
    square = float(normal @ normal)
    return np.zeros(way.size) if square < NO_MIRROR else normal * math.sqrt(2.0 / square)
