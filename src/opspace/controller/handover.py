"""Starting and stopping without a step: from the torque on the robot, and to the one that follows."""

from __future__ import annotations

import numpy as np

from opspace.errors import InputError
from opspace.law import Profile
from opspace.tasks.validation import positive


class Handover:
    r"""A torque that moves between the controller's and another one's.

    Taking over, with Γ₀ the torque that is on the robot and Γ(t) the controller's,

        Γ(t) + (1 − s(t)) (Γ₀ − Γ(t₀))

    begins at Γ₀ and has all of the controller's feedback from the first tick on. Handing back,

        (1 − s(t)) Γ(t) + s(t) Γ₁

    ends at Γ₁ and stays there. s is the quintic profile in time, so neither torque nor its slope jumps.

    Args:
        tau: (n,) Γ₀ or Γ₁, N·m.
        duration: How long it takes from the first tick on, s.
        back: Whether the controller hands back.

    Raises:
        InputError: A torque or a duration that cannot be used.
    """

    def __init__(self, tau: np.ndarray, duration: float, *, back: bool) -> None:
        duration = positive(duration, "the duration of a handover")
        if not np.all(np.isfinite(tau)):
            raise InputError("the torque of a handover must be finite")
        self.back = back
        self._tau = tau
        self._duration = duration
        self._start: float | None = None
        self._offset = np.zeros(tau.size)
        self._profile = Profile("quintic")
        self.done = False

    def torque(self, t: float, tau: np.ndarray, limit: np.ndarray, added: np.ndarray) -> np.ndarray:
        """Mix the controller's torque with the other one.

        Args:
            t: Time, s.
            tau: (n,) torque of the controller, N·m.
            limit: (n,) what the motors give to both sides of its middle, N·m; what is mixed stays
                inside where both are.
            added: (n,) what the robot adds to either, N·m, and the motors give as well; less the middle
                of what they give.

        Returns:
            (n,) torque for the robot, N·m.
        """
        if self._start is None:
            self._start = t
            self._offset = self._tau - tau
        s = self._profile(min((t - self._start) / self._duration, 1.0)).value
        if self.back:
            return tau + s * (self._tau - tau)
        self.done = s >= 1.0
        inside = np.maximum(limit, np.maximum(np.abs(tau + added), np.abs(self._tau + added)))
        mixed = tau + (1.0 - s) * self._offset + added
        return np.clip(mixed, -inside, inside) - added
