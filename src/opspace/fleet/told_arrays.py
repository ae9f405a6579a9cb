"""Arrays that one task of a fleet is told and tells, one row per robot."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.errors import InputError
from opspace.fleet.warp_library import warp
from opspace.machine.field_table import Record
from opspace.tasks import Task
from opspace.tasks.validation import numbers


class ToldArrays:
    """What tasks of all kinds are told and tell.

    Attributes:
        name: Name of the task.
        task: The task that it was made from.
        kv: (m,) damping of every row, 1/s.
        activation: A factor of the task's presence in the stack, 0 to 1.
        error: (m,) error of every row at the last step.
        presence: h at the last step, activation included.
        told_motion: Whether it is told the three that follow: a task on a frame in a fleet that is given
            the dynamics.
        pose: (7,) position and quaternion wxyz of what the task controls.
        jacobian: (6, n) of that, linear rows first.
        drift: (6,) J̇ q̇ of it.
        integrates: Whether it has a ``ki`` on its error.
        is_paced: Whether it goes to new targets on ways.
        begun: When the way of each robot began, s.
        presses: Whether it needs a wrench.
        rests: Whether it may be at rest at its target.
    """

    integrates = is_paced = presses = rests = told_motion = False

    def __init__(self, task: Task, count: int, dtype: Any, device: Any) -> None:
        self.task: Any = task
        self.name = task.name
        self.begun: Any = None
        self._count, self._dtype, self._device = count, dtype, device

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r} of {self._count} robots on {self._device})"

    def begin(self, tick: Record, i: int, rows: slice, *, given: bool) -> None:
        """Take what the task is told from the arrays of a plan in which it is the task ``i``.

        Args:
            tick: The arrays.
            i: Number of the task.
            rows: Its rows.
            given: Whether its motion is given.
        """
        del i
        if given:
            self.told_motion = True
            self.pose = self._filled(np.eye(7)[3])
            self.jacobian = self._filled(np.zeros((6, tick.v.size)))
            self.drift = self._filled(np.zeros(6))
        one = np.ones(())
        self.kv = self._filled(tick.kv[rows])
        self.activation, self.presence = self._filled(one), self._filled(one)
        self.error = self._filled(np.zeros(rows.stop - rows.start))
        if tick.row_near[rows].any():
            self.rests, self._unrest = True, self._filled(tick.row_unrest[rows])
        self._epoch, self._seen = self._filled(0), self._filled(-1)

    def begin_again(self, epoch: np.ndarray) -> None:
        """Tell how often the task has begun with each robot, (count,)."""
        self._epoch.assign(epoch)

    @property
    def paces(self) -> list[float]:
        """Speed and acceleration of the task's ways, those of a turn after those of a position; or 0."""
        return [0.0] * 4

    def places(self, i: int, rows: slice) -> Iterator[tuple[str, Any, str, int]]:
        """List the arrays, which way each goes, and where it is: in which array of one robot's tick."""
        first = rows.start
        for name in ("pose", "jacobian", "drift") if self.told_motion else ():
            array = getattr(self, name)
            yield "in", array, f"robot.{name}_()", i * int(np.prod(array.shape[1:]))
        yield "in", self.activation, "work.own_()", i
        yield "out", self.presence, "work.h_()", i
        yield "out", self.error, "work.error_()", first
        if self.rests:
            yield "in, out", self._unrest, "work.row_unrest_()", first
        yield "in", self._epoch, "robot.epoch_()", i
        yield "in, out", self._seen, "robot.seen_()", i

    def _filled(self, row: ArrayLike, real: Any = None) -> Any:
        """Make an array with the same row for every robot, of the fleet's numbers or of others."""
        wp = warp()
        found = np.asarray(row)
        whole = np.broadcast_to(found, (self._count, *found.shape))
        dtype = wp.int64 if found.dtype.kind == "i" else real or self._dtype
        return wp.array(whole, dtype=dtype, device=self._device)

    def _checked(self, value: ArrayLike, array: Any, mask: np.ndarray) -> np.ndarray:
        what = f"task {self.name!r}: {value!r}"
        found = numbers(value, what)
        shape = (int(mask.sum()), *array.shape[1:])
        try:
            found = np.broadcast_to(found, shape)
        except ValueError:
            raise InputError(f"{what} has shape {found.shape}, not {shape}") from None
        if not np.isfinite(found).all():
            raise InputError(f"{what} must be finite")
        return found


def write_rows(array: Any, rows: ArrayLike, mask: np.ndarray) -> None:
    """Write the rows of some robots into an array on the device."""
    whole = array.numpy().copy()
    whole[mask] = rows
    array.assign(whole)
