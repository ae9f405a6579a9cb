"""A payload that comes and goes without a step in the torque."""

from __future__ import annotations

from opspace.law import Profile
from opspace.robots.adapter import AdapterBase
from opspace.robots.payload import Payload, mixed
from opspace.tasks.validation import positive


class Loading:
    """Moves what a robot carries from what it is to a payload.

    Mass, first moment and inertia are mixed, (1 − s) of what was there and s of the payload, and the
    model is linear in them: half way it is the model that carries half. s is the quintic profile in
    time, so neither torque nor its slope jumps.

    Args:
        robot: The robot.
        payload: What it carries in the end; None is nothing.
        duration: How long it takes from the first tick on, s; 0 is at once.

    Raises:
        InputError: The robot cannot carry the payload, or the duration is none.
        UnknownNameError: The robot has no frame of the payload's.
    """

    def __init__(self, robot: AdapterBase, payload: Payload | None, duration: float) -> None:
        self._robot, self._payload = robot, payload
        self._after = robot.loads_of(payload)
        if duration != 0.0:
            duration = positive(duration, "the duration in which a payload changes")
        self._duration = duration
        self._before = dict(robot.loads)
        self._last: float | None = None
        self._passed = 0.0
        self._profile = Profile("quintic")

    def tick(self, t: float) -> bool:
        """Change what the robot carries; tell whether it carries the payload.

        Args:
            t: Time, s.
        """
        if self._last is None and self._passed == 0.0:
            self._before = dict(self._robot.loads)
        elif self._last is not None:
            self._passed += max(t - self._last, 0.0)
        self._last = t
        done = self._passed >= self._duration
        share = 1.0 if done else self._profile(self._passed / self._duration).value
        self._robot.carry(self._payload, mixed(self._before, self._after, share))
        return done

    def resume(self) -> None:
        """Go on at the next tick as if no time had passed since the last."""
        self._last = None
