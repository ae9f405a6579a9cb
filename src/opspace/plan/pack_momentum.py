"""A task of angular momentum in the arrays of a plan: it has gains only."""

from __future__ import annotations

import numpy as np

from opspace.kernels.columns import BODY
from opspace.plan.pack_task import Packed
from opspace.robots.adapter import AdapterBase

TURNS = 3
"""First of the coordinates about which a floating base turns."""


class PackedMomentum(Packed):
    """`opspace.AngularMomentumTask` in the arrays of a plan."""

    def _pack_ahead(self) -> None:
        bodies = self._tick.bodies
        base = np.flatnonzero((bodies.first_v == TURNS) & (bodies.width > 0))
        self._tick.kind[self.index, BODY] = base[0]
        self._take_gains()

    @property
    def _changed(self) -> bool:
        return self.task._gains is not self.gains

    @property
    def _packed_ahead(self) -> bool:
        return True

    def _pack(self, robot: AdapterBase, t: float) -> None:
        self._take_gains()

    def _take_gains(self) -> None:
        self.gains = self.task._gains
        self._tick.kv[self.rows] = self.task._gains.kv
