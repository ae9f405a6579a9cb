"""The fastest motion within limits of velocity, acceleration and jerk."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.tasks.references.phase import minimum_jerk_phase
from opspace.tasks.references.sample import Sample
from opspace.tasks.references.start import Started, optional_time
from opspace.tasks.validation import Array, finite_array

ROUNDING = 1e-12
"""Part of a unit by which a motion may end beside its goal: it is no step, and on a way as short as this
there is no jerk to make good for it."""


class JerkLimited(Started):
    """Moves to rest at the goal as fast as velocity, acceleration and jerk limits allow.

    All coordinates arrive at the same time where that can be planned, and the path is not straight
    in general (Ruckig, Berscheid and Kröger 2021). The motion is computed once, when the reference
    is built. Holds the start before it begins and the goal after the motion. A motion on its way
    gets another goal without a step by a new reference that begins with its value, velocity and
    acceleration.

    Args:
        start: (k,) first value.
        goal: (k,) last value.
        max_velocity: Limit of each coordinate, a number or (k,), unit/s.
        max_acceleration: Limit, a number or (k,), unit/s².
        max_jerk: Limit, a number or (k,), unit/s³.
        start_time: Time at which it begins, s; None is the first tick that asks.
        start_velocity: (k,) velocity at that time, unit/s; None is rest. It may be above the limit.
        start_acceleration: (k,) acceleration at that time, unit/s²; None is none.

    Attributes:
        duration: Time of the motion, s.

    Raises:
        InputError: Shapes that differ, values that are not finite, or a limit not above zero.
    """

    def __init__(
        self,
        start: ArrayLike,
        goal: ArrayLike,
        *,
        max_velocity: ArrayLike,
        max_acceleration: ArrayLike,
        max_jerk: ArrayLike,
        start_time: float | None = None,
        start_velocity: ArrayLike | None = None,
        start_acceleration: ArrayLike | None = None,
    ) -> None:
        from ruckig import InputParameter, Trajectory  # noqa: PLC0415 - lazy

        self.start = finite_array(start, (None,), "JerkLimited: start")
        self.goal = finite_array(goal, self.start.shape, "JerkLimited: goal")
        self.start_time = optional_time(start_time, "JerkLimited: start_time")
        size = len(self.start)
        self._rest = np.zeros(size)
        velocity = _rate(start_velocity, size, "start_velocity")
        acceleration = _rate(start_acceleration, size, "start_acceleration")
        self._first = Sample(self.start, velocity, acceleration)
        motion = InputParameter(size)
        motion.current_position = self.start.tolist()
        motion.current_velocity = velocity.tolist()
        motion.current_acceleration = acceleration.tolist()
        motion.target_position = self.goal.tolist()
        motion.max_velocity = _limits(max_velocity, size, "max_velocity").tolist()
        motion.max_acceleration = _limits(max_acceleration, size, "max_acceleration").tolist()
        motion.max_jerk = _limits(max_jerk, size, "max_jerk").tolist()
        self._trajectory = Trajectory(size)
        _calculate(motion, self._trajectory, size)
        self.duration: float = self._trajectory.duration
        # The plan ends beside the goal by up to 1e-8, which would be a step there.
        beside = self.goal - np.array(self._trajectory.at_time(self.duration)[0])
        self._beside = np.where(np.abs(beside) > ROUNDING, beside, 0.0)

    def __call__(self, t: float, /) -> Sample:
        """Return the desired motion at time t, s."""
        elapsed = self.elapsed(t)
        if elapsed < 0.0:
            return Sample(self.start, self._rest, self._rest)
        if elapsed == 0.0:
            return self._first
        if elapsed >= self.duration:
            return Sample(self.goal, self._rest, self._rest)
        planned = zip(
            self._trajectory.at_time(elapsed),
            minimum_jerk_phase(elapsed, 0.0, self.duration),
            strict=True,
        )
        return Sample(*(np.array(part) + share * self._beside for part, share in planned))


def _calculate(motion: Any, trajectory: Any, size: int) -> None:
    """Plan the motion; where its coordinates cannot be made to arrive together, let each be fast."""
    from ruckig import Result, Ruckig, RuckigError, Synchronization  # noqa: PLC0415 - lazy

    reason = ""
    for synchronization in (Synchronization.Time, Synchronization.No):
        motion.synchronization = synchronization
        try:
            result = Ruckig(size).calculate(motion, trajectory)
        except (RuckigError, ValueError) as error:
            # Some results are raised, and some have no name that Python knows.
            reason = " ".join(str(error).split())
            continue
        if result in (Result.Working, Result.Finished):
            return
        reason = result.name
    raise InputError(f"JerkLimited: no motion within these limits ({reason})")


def _limits(value: ArrayLike, size: int, what: str) -> Array:
    limits = finite_array(value, (size,) if np.ndim(value) else (), f"JerkLimited: {what}")
    if (limits <= 0.0).any():
        raise InputError(f"JerkLimited: {what} must be above zero, not {limits.tolist()}")
    return np.broadcast_to(limits, (size,))


def _rate(value: ArrayLike | None, size: int, what: str) -> Array:
    return np.zeros(size) if value is None else finite_array(value, (size,), f"JerkLimited: {what}")
