"""The last cycles of a loop, in memory that is there before the first one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from opspace.errors import InputError
from opspace.kernels.cycle_columns import RING, WHOLES


class Cycles(NamedTuple):
    """Cycles of a loop, the oldest first.

    Attributes:
        t: (k,) time of the state, s.
        q: (k, nq) configuration.
        v: (k, n) velocity, rad/s.
        tau: (k, n) what was commanded, N·m.
        status: (k,) status of the command, see `opspace.Status`; 0 while the loop only holds or brakes.
        answered: (k,) time from the state to its command, s.
    """

    t: np.ndarray
    q: np.ndarray
    v: np.ndarray
    tau: np.ndarray
    status: np.ndarray
    answered: np.ndarray


def width_of(nq: int, n: int) -> int:
    """Count the numbers of a cycle."""
    return 3 + nq + 2 * n


class History:
    """A ring of cycles.

    Attributes:
        rows: t, q, v, tau, status and time to the answer of each, in any order.
        whole: Whole numbers of compiled cycles, see `opspace.kernels.cycle_columns`.

    Args:
        rows: How many are remembered.
        nq: Coordinates of a configuration.
        n: Number of joints.

    Raises:
        InputError: There is no cycle to remember.
    """

    def __init__(self, rows: int, nq: int, n: int) -> None:
        if rows < 1:
            raise InputError(f"a history has at least one cycle, not {rows}")
        self.rows = np.full((rows, width_of(nq, n)), np.nan)
        self.whole = np.zeros(WHOLES, np.int64)
        self._ends = np.cumsum([1, nq, n, n, 1])

    @property
    def seen(self) -> int:
        """How many cycles there have been."""
        return int(self.whole[RING])

    def end(self, how: str, reason: str) -> None:
        """Say that there will be no more of them, to whoever else looks.

        Args:
            how: ``completed``, ``stopped`` or ``crashed``.
            reason: Why.
        """

    def add(
        self,
        t: float,
        q: np.ndarray,
        v: np.ndarray,
        tau: np.ndarray,
        status: int,
        answered: float,
    ) -> None:
        """Remember a cycle in the place of the oldest one."""
        row, ends = self.rows[self.seen % len(self.rows)], self._ends
        row[0] = t
        row[1 : ends[1]] = q
        row[ends[1] : ends[2]] = v
        row[ends[2] : ends[3]] = tau
        row[-2] = status
        row[-1] = answered
        self.whole[RING] += 1

    def cycles(self) -> Cycles:
        """Copy what is remembered; from any thread, where the row being written may be a mixture."""
        seen, size = self.seen, len(self.rows)
        rows = self.rows[:seen] if seen <= size else np.roll(self.rows, -(seen % size), axis=0)
        t, q, v, tau, status, answered = np.split(rows.copy(), self._ends, axis=1)
        return Cycles(t[:, 0], q, v, tau, status[:, 0].astype(np.int64), answered[:, 0])
