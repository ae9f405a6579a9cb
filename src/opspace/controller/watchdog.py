"""Whether ticks come when they should, with states that are new."""

from __future__ import annotations

import math

import numpy as np

from opspace.command import Status
from opspace.errors import InputError, unknown_name

POLICIES = ("report", "hold", "raise")
"""What happens when time runs backwards or jumps: ``report`` goes on and says so, ``hold`` brakes with
joint damping for that tick and goes on as after `opspace.Controller.restart`, ``raise`` raises."""

MISSED = 1.5
"""A tick that comes later than this many periods after the one before has missed one."""
JUMP = 10.0
"""Time that moves by more than this many periods has jumped."""


class Watchdog:
    """Watches the time and the state of every tick.

    Args:
        period: Time between two ticks, s.
        policy: One of `POLICIES`.

    Raises:
        InputError: The period is not a time.
        UnknownNameError: There is no such policy.
    """

    def __init__(self, period: float, policy: str = "report") -> None:
        if not (math.isfinite(period) and period > 0.0):
            raise InputError(f"period must be finite and above 0 s, got {period}")
        if policy not in POLICIES:
            raise unknown_name("on_time_jump", policy, POLICIES)
        self.period = float(period)
        self.policy = policy
        self._before: tuple[float, np.ndarray, np.ndarray] | None = None

    def forget(self) -> None:
        """Forget the tick before: whatever time and state come next are right."""
        self._before = None

    def check(self, t: float, q: np.ndarray, v: np.ndarray) -> Status:
        """Compare a tick with the one before.

        Args:
            t: Time, s.
            q: Configuration, (nq,).
            v: Velocity, (n,), rad/s.

        Returns:
            ``LATE``, ``TIME_JUMP`` and ``STALE`` where they hold.

        Raises:
            InputError: Time ran backwards or jumped, and the policy is to raise.
        """
        before, self._before = self._before, (t, np.array(q), np.array(v))
        if before is None:
            return Status.OK
        status = Status.OK
        passed = t - before[0]
        # Times are sums of floating-point numbers: a millionth of a period is no time.
        if not 1e-6 * self.period < passed <= JUMP * self.period:
            status |= Status.TIME_JUMP
            if self.policy == "raise":
                raise InputError(
                    f"time went from {before[0]:.6g} s to {t:.6g} s; a tick every "
                    f"{self.period:g} s was announced"
                )
        elif passed > MISSED * self.period:
            status |= Status.LATE
        # A robot that moves cannot be where it was, to the last bit.
        if np.any(v) and np.array_equal(q, before[1]) and np.array_equal(v, before[2]):
            status |= Status.STALE
        return status
