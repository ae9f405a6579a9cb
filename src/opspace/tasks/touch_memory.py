"""What a force task remembers from tick to tick."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from opspace.law import press_columns as at
from opspace.tasks.validation import Array


class Touch(NamedTuple):
    """What a force task knows of its contact in one tick.

    Attributes:
        confidence: c, how sure it is that something is touched, 0 to 1.
        measured: (m,) wrench on the environment along the rows, filtered, N and N·m.
        commanded: (m,) wrench that is commanded there, N and N·m.
        sigma: J A⁻¹ Jᵀ along the force, one over the mass that moves, 1/kg.
        speed: Speed of the approach along the force, m/s.
        direction: (3,) where the force points, in world axes.
        travel: How far the point is along it, m.
    """

    confidence: float
    measured: Array
    commanded: Array
    sigma: float
    speed: float
    direction: Array
    travel: float


class TouchMemory:
    """One row of numbers, as `opspace.law.press_columns` has them.

    Whoever evaluates the task writes it. Compiled code does so in its own arrays, so the memory moves
    into them: there is one row at a time, and either form goes on where the other one was.

    Args:
        rows: m, rows of the task.
    """

    def __init__(self, rows: int) -> None:
        self.rows = rows
        self.row = np.zeros(at.MEMORY_SIZE)
        self.row[at.GIVEN_AT] = -math.inf
        self.forget()

    def move(self, row: Array) -> None:
        """Go on in another row of `MEMORY_SIZE` numbers."""
        if row is not self.row:
            row[:] = self.row
            self.row = row

    def forget(self) -> None:
        """Begin without contact; what was measured stays measured."""
        self.row[at.BEGUN] = self.row[at.CONFIDENCE] = 0.0
        self.row[at.FLOOR] = math.inf

    def wait(self, pause: float) -> None:
        """Let a pause [s] be no time."""
        self.row[[at.WHEN, at.GIVEN_AT]] += pause

    def take(self, t: float, wrench: Array) -> None:
        """Keep the wrench (6,) that was measured at time ``t`` [s]."""
        self.row[at.GIVEN : at.GIVEN + 6] = wrench
        self.row[at.GIVEN_AT] = t

    def __getitem__(self, column: int) -> float:
        """Read one number."""
        return float(self.row[column])

    def __setitem__(self, column: int, value: float) -> None:
        """Write one number."""
        self.row[column] = value

    def part(self, column: int, size: int | None = None) -> Array:
        """Return some numbers in a row, to be read and written; as many as the task has rows."""
        return self.row[column : column + (self.rows if size is None else size)]

    @property
    def touch(self) -> Touch | None:
        """What was known in the last tick; None before the first."""
        if not self.row[at.BEGUN]:
            return None
        return Touch(
            self[at.CONFIDENCE],
            self.part(at.MEASURED).copy(),
            self.part(at.COMMANDED).copy(),
            self[at.SIGMA],
            self[at.SPEED],
            self.part(at.AHEAD, 3).copy(),
            self[at.TRAVEL],
        )

    def asked_since(self, t: float) -> bool:
        """Whether a tick at time ``t`` [s] or later has been learnt from."""
        return self.row[at.BEGUN] != 0.0 and bool(self.row[at.WHEN] >= t)

    def before(self, t: float) -> tuple[float, float, Array] | None:
        """Confidence, travel [m] and direction (3,) in the last tick before time ``t`` [s], if any."""
        if not self.row[at.BEGUN]:
            return None
        if self.row[at.WHEN] < t:
            return self[at.CONFIDENCE], self[at.TRAVEL], self.part(at.AHEAD, 3).copy()
        return self[at.EARLIER], self[at.EARLIER_TRAVEL], self.part(at.EARLIER_AHEAD, 3).copy()
