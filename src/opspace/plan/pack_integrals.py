"""Integral action of the tasks of a plan, in compiled code."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from opspace.machine.record import Handle
from opspace.plan.entries import KERNELS
from opspace.plan.integral_records import INTEGRALS
from opspace.plan.pack_task import Packed
from opspace.tasks.tracking import TrackingTask


class PackedIntegrals:
    """The integrals of tasks, which remember them from one plan to the next.

    Attributes:
        record: The numbers, a `INTEGRALS`.
        handle: Their handle.

    Args:
        packed: All tasks of a plan.
        tick: Handle of its arrays.
    """

    def __init__(self, packed: Sequence[Packed], tick: Handle) -> None:
        sizes = {"tasks": len(packed), "rows": packed[-1].rows.stop}
        self.record = INTEGRALS.make(sizes)
        self.handle = self.record.handle()
        self._tick = tick
        self._places: list[tuple[TrackingTask, np.ndarray]] = []
        for one in packed:
            if _integrates(one):
                self.record.ki[one.index] = one.task.ki
                self.record.max_integral[one.index] = one.task._max_integral
                self._places.append((one.task, self._place(one)))

    @classmethod
    def of(cls, packed: Sequence[Packed], tick: Handle) -> PackedIntegrals | None:
        """Make them where tasks have some; None where none has, or compiled code does not know one."""
        found = [one for one in packed if _integrates(one)]
        return cls(packed, tick) if found and not any(one.own_kind for one in found) else None

    def learn(self, dt: float, status: int) -> None:
        """Have the tasks learn from the errors of a tick.

        Args:
            dt: Time since the tick before, s.
            status: What happened, in the numbers of `opspace.Status`.
        """
        for task, place in self._places:
            place[:] = task.integral
        self.record.since[0] = dt
        KERNELS["learn"](self._tick.address, self.handle.address, status)
        for task, place in self._places:
            task.remember_integral(place)

    def _place(self, one: Packed) -> np.ndarray:
        """Return where the integral of a task is."""
        if one.joints:
            return self.record.joint_integral[one.rows]
        return self.record.integral[one.index, : one.task.integral.size]


def _integrates(one: Packed) -> bool:
    return isinstance(one.task, TrackingTask) and one.task.ki is not None
