"""An activation in time of every robot of a fleet."""

from __future__ import annotations

import numpy as np

from opspace.kernels.columns import VARIABLE_SIZE
from opspace.law import PROFILES, Ramp
from opspace.stack.changes import Timing
from opspace.stack.members import Variable

CODE, TARGET, START, DURATION, PHASE = range(5)
"""Columns of an activation in time."""


class Activations:
    """One activation in time of every robot.

    Args:
        count: Number of robots.
        value: 0.0 or 1.0, where it rests.
        shared: Whether it moves two tasks, which none of them may turn alone.

    Attributes:
        ramps: (count, VARIABLE_SIZE), each as `opspace.law.scalars.ramp` takes it.
        variable: What stands for it in a plan.
    """

    def __init__(self, count: int, value: float, *, shared: bool = False) -> None:
        self.ramps = np.tile(_packed(Ramp.resting(value)), (count, 1))
        self.variable = Variable(value)
        self.shared = shared

    @property
    def targets(self) -> np.ndarray:
        """Where it rests or goes, (count,) of 0 and 1."""
        return self.ramps[:, TARGET]

    def arrived(self, t: float) -> np.ndarray:
        """Tell at which robots it rests at its target at time ``t`` [s], (count,)."""
        duration = self.ramps[:, DURATION]
        return (duration == 0.0) | (t >= self.ramps[:, START] + duration)

    def resting(self, value: float, t: float) -> np.ndarray:
        """Tell at which robots it rests at this value at time ``t`` [s], (count,)."""
        return (self.targets == value) & self.arrived(t)

    def idle(self, t: float) -> np.ndarray:
        """Tell at which robots it only begins at time ``t`` [s] and has had no effect, (count,)."""
        begins = (t <= self.ramps[:, START]) & ~self.arrived(t)
        return begins & (self.ramps[:, PHASE] <= 0.0)

    def send(self, target: float, robots: np.ndarray, timing: Timing, t: float) -> None:
        """Turn it towards 0 or 1 at time ``t`` [s], as `opspace.stack.members.Variable.send` does.

        Robots whose activations are alike are gone through once.
        """
        if not robots.any():
            return
        rows, which = np.unique(self.ramps[robots], axis=0, return_inverse=True)
        sent = np.empty_like(rows)
        for row, into in zip(rows, sent, strict=True):
            variable = Variable(0.0)
            variable.ramp = Ramp(PROFILES[int(row[CODE])], *row[1:].tolist())
            variable.send(target, timing.duration, t, timing.profile)
            into[:] = _packed(variable.ramp)
        self.ramps[robots] = sent[which.reshape(-1)]

    def rest(self, value: float, robots: np.ndarray) -> None:
        """Let it rest at 0 or 1 at once, where nobody sees a difference."""
        self.ramps[robots] = _packed(Ramp.resting(value))


def _packed(ramp: Ramp) -> np.ndarray:
    found = np.array([PROFILES.index(ramp.profile), *ramp.numbers])
    assert found.size == VARIABLE_SIZE
    return found
