"""How far tasks have been from rest at their targets lately, remembered from tick to tick."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from opspace.law.scalars import MOST_UNREST, remembered_unrest
from opspace.stack.members import Member, Variable

NEVER = math.inf
"""Time of a tick that has not been: none has passed since."""


class UnrestMemory:
    """Remembers of every row of the tasks of a stack how far it was from rest, see `remembered_unrest`.

    What comes anew, or is absent, has not been at rest.

    Attributes:
        at: Time of the tick that is remembered, s.
    """

    def __init__(self) -> None:
        self.at = NEVER
        self._kept: Mapping[Variable, np.ndarray] = {}

    def after(
        self, t: float, members: Sequence[Member], h: Sequence[float], now: Sequence[np.ndarray]
    ) -> list[np.ndarray]:
        """Return what is remembered of every task after a tick.

        Args:
            t: Its time, s.
            members: The tasks.
            h: Activation of each.
            now: How far the rows of each are from rest.

        Returns:
            For each task (m,).
        """
        passed, self.at = t - self.at, t
        found: list[np.ndarray] = []
        for member, present, rows in zip(members, h, now, strict=True):
            kept = self.of(member.presence, rows.size)
            if present > 0.0:
                pairs = zip(kept.tolist(), rows.tolist(), strict=True)
                found.append(np.array([remembered_unrest(m, a, passed) for m, a in pairs]))
            else:
                found.append(np.full(rows.size, MOST_UNREST))
        self._kept = {m.presence: rows for m, rows in zip(members, found, strict=True)}
        return found

    def of(self, presence: Variable, rows: int) -> np.ndarray:
        """Return what is known of the task with this presence and so many rows, (m,)."""
        kept = self._kept.get(presence)
        return np.full(rows, MOST_UNREST) if kept is None else kept

    def remember(self, at: float, kept: Mapping[Variable, np.ndarray]) -> None:
        """Go on from what another form of the tick has remembered at time ``at`` [s]."""
        self.at, self._kept = at, dict(kept)

    def forget(self) -> None:
        """Remember nothing."""
        self.remember(NEVER, {})
