"""Which way round an error of angles went, remembered while the target goes on from where it was."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod

import numpy as np

from opspace.law.scalars import LARGEST_STEP, SIGNS, without_turns
from opspace.tasks.validation import Array

Remembered = tuple[float, float, float, float]


class WayRound(ABC):
    """Memory of an error of angles.

    Attributes:
        previous: What was chosen last, four numbers as compiled code keeps them; None without a past.
        goal: What was desired then.
    """

    def __init__(self) -> None:
        self.previous: Remembered | None = None
        self.goal: Array | None = None

    def follow(self, goal: Array) -> None:
        """Forget the past where the target does not go on from where it was."""
        before, self.goal = self.goal, goal
        if before is not None and before is not goal and self.jumps(before, goal):
            self.previous = None

    def reset(self) -> None:
        """Forget the past: the next error takes the short way."""
        self.previous = self.goal = None

    @staticmethod
    @abstractmethod
    def jumps(before: Array, goal: Array) -> bool:
        """Tell whether a target is another one than the target of the tick before."""


class JointTurns(WayRound):
    """Leaves whole turns out of the errors of joints that turn without end.

    An encoder that wraps, and a target beyond half a turn, make no difference. The error is the short
    way; where it grows past half a turn it goes on in the same direction up to π + ``BRANCH_HOLD``, so
    that noise there does not reverse it.
    """

    def __call__(self, error: Array, endless: Array) -> Array:
        """Return the errors without whole turns.

        Args:
            error: (m,) x_d − x, rad or m.
            endless: (m,) which of the joints turn without end.

        Returns:
            (m,) errors.
        """
        signs = [int(word) for word in self.previous or (0.0,) * 4]
        found, now = error.copy(), [0] * len(signs)
        for k in np.flatnonzero(endless).tolist():
            word, sign = k // SIGNS, 1 << (k % SIGNS)
            negative = signs[word] & sign != 0
            found[k] = without_turns(float(error[k]), self.previous is not None, negative)
            if found[k] < 0.0:
                now[word] |= sign
        self.previous = (float(now[0]), float(now[1]), float(now[2]), float(now[3]))
        return found

    @staticmethod
    def jumps(before: Array, goal: Array) -> bool:
        """Tell whether a joint's target moved by more than `LARGEST_STEP`, whole turns left out."""
        moved = goal - before
        moved = moved - 2.0 * math.pi * np.round(moved / (2.0 * math.pi))
        return bool(np.abs(moved).max(initial=0.0) > LARGEST_STEP)


def rotation_jumps(before: Array, goal: Array) -> bool:
    """Tell whether rotation matrices, of one shape, are more than `LARGEST_STEP` apart."""
    trace = float(before.ravel() @ goal.ravel())
    return 0.5 * (trace - 1.0) < math.cos(LARGEST_STEP)
