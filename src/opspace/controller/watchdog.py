"""Whether ticks come when they should, with states that are new."""

from __future__ import annotations

import math

import numpy as np

from opspace.command import Status
from opspace.errors import InputError, unknown_name
from opspace.kernels.quiet_columns import LAST

POLICIES = ("report", "hold", "raise")
"""What happens when time runs backwards or jumps: ``report`` goes on and says so, ``hold`` brakes with
joint damping for that tick and goes on as after `opspace.Controller.restart`, ``raise`` raises."""

MISSED = 1.5
"""A tick that comes later than this many periods after the one before has missed one."""
JUMP = 10.0
"""Time that moves by more than this many periods has jumped."""
TIME_JUMP, LATE, STALE = int(Status.TIME_JUMP), int(Status.LATE), int(Status.STALE)


class Watchdog:
    """Watches the time and the state of every tick.

    Attributes:
        watch: (3,) time of the last tick, NaN for none, and between which two nothing is to be said of
            how much has passed since, s; `opspace.kernels.quiet_columns` names
            them.
        last_q: (nq,) configuration then.
        last_v: (n,) velocity then, rad/s.

    Args:
        period: Time between two ticks, s.
        policy: One of `POLICIES`.
        nq: Numbers of a configuration.
        n: Numbers of a velocity.

    Raises:
        InputError: The period is not a time.
        UnknownNameError: There is no such policy.
    """

    def __init__(self, period: float, policy: str, nq: int, n: int) -> None:
        if not (math.isfinite(period) and period > 0.0):
            raise InputError(f"period must be finite and above 0 s, got {period}")
        if policy not in POLICIES:
            raise unknown_name("on_time_jump", policy, POLICIES)
        self.period = float(period)
        self.policy = policy
        # Times are sums of floating-point numbers: a millionth of a period is no time.
        self.watch = np.array([math.nan, 1e-6 * self.period, MISSED * self.period])
        self.last_q, self.last_v = np.zeros(nq), np.zeros(n)

    def forget(self) -> None:
        """Forget the tick before: whatever time and state come next are right."""
        self.watch[LAST] = math.nan

    def check(self, t: float, q: np.ndarray, v: np.ndarray) -> int:
        """Compare a tick with the one before.

        Args:
            t: Time, s.
            q: Configuration, (nq,).
            v: Velocity, (n,), rad/s.

        Returns:
            ``LATE``, ``TIME_JUMP`` and ``STALE`` where they hold, in the numbers of `opspace.Status`.

        Raises:
            InputError: Time ran backwards or jumped, and the policy is to raise.
        """
        # Bytes are compared in a tenth of the time of arrays.
        same = q.tobytes() == self.last_q.tobytes() and v.tobytes() == self.last_v.tobytes()
        before, shortest, longest = self.watch.tolist()
        self.watch[LAST], self.last_q[:], self.last_v[:] = t, q, v
        if math.isnan(before):
            return 0
        bits = 0
        passed = t - before
        if not shortest < passed <= JUMP * self.period:
            bits = TIME_JUMP
            if self.policy == "raise":
                raise InputError(
                    f"time went from {before:.6g} s to {t:.6g} s; a tick every "
                    f"{self.period:g} s was announced"
                )
        elif passed > longest:
            bits = LATE
        # A robot that moves cannot be where it was, to the last bit.
        if same and v.any():
            bits |= STALE
        return bits
