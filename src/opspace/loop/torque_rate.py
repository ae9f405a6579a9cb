"""No command further from what the robot has accepted than the robot allows."""

from __future__ import annotations

import numpy as np

from opspace.errors import InputError

MARGIN = 0.99
"""Part of the allowed step that is used; robots round, and compare in their own numbers."""


class TorqueRate:
    """Keeps commands within a step of the last one that the robot has accepted.

    A robot that has lost a command compares with the one before it, so what was sent last is the
    wrong thing to compare with wherever the robot says what it took.

    Attributes:
        step: (n,) the most by which a command differs, N·m; None for any.

    Args:
        rate: N·m/s, a number or one per joint; None for any.
        period: Time between two commands, s.
        n: Number of joints.

    Raises:
        InputError: The rates are not one per joint.
    """

    def __init__(self, rate: float | tuple[float, ...] | None, period: float, n: int) -> None:
        self.step: np.ndarray | None = None
        if rate is not None:
            if np.ndim(rate) and np.shape(rate) != (n,):
                raise InputError(f"torque_rate takes one rate per joint, {n}, not {np.shape(rate)}")
            self.step = np.full(n, MARGIN * period * np.asarray(rate, float))

    def within(self, tau: np.ndarray, accepted: np.ndarray | None) -> np.ndarray:
        """Return the nearest command that the robot takes.

        Args:
            tau: (n,) command, N·m.
            accepted: (n,) the last one that was accepted; None where there was none.

        Returns:
            ``tau`` itself where it is near enough.
        """
        if self.step is None or accepted is None:
            return tau
        low, high = accepted - self.step, accepted + self.step
        if np.all(tau >= low) and np.all(tau <= high):
            return tau
        return np.clip(tau, low, high)
