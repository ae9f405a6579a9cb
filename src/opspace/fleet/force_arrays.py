"""What a force task of a fleet is told and tells, robot by robot, as arrays."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from opspace.fleet.told_arrays import ToldArrays, write_rows
from opspace.fleet.warp_library import robots_of
from opspace.kernels.columns import PRESS
from opspace.law.press_columns import CONFIDENCE, KI, KP, MEASURED, MEMORY_SIZE, PRESS_SIZE, WANTED
from opspace.machine.field_table import Record
from opspace.tasks import ForceTask


class ForceArrays(ToldArrays):
    """One force task of every robot of a fleet, as `TaskArrays` has tasks of motion.

    Write ``wrench`` before every step. Where nothing new has been measured for 10 ms, ``fresh`` being 0,
    the robot goes on as in a controller, with ``Status.WRENCH_STALE``. What `ForceTask` would refuse, as
    a force of zero or a ``ki`` that is not stable on every surface, is a fault of its robot.

    Attributes:
        name: Name of the task.
        task: The task that it was made from; its own attributes are not looked at again.
        wrench: (6,) measured wrench of the robot on the environment, N and N·m, in world axes at the
            point of the task.
        fresh: Whether it has been measured since the last step, 1 or 0; of whole numbers.
        force: (m,) force and moment of every row on the environment, N, N·m; approached at the task's
            ``force_rate``.
        kp: Proportional gain on the force, 1.
        ki: Integral gain, 1/s; at most kv (1 + kp) / 2.
        kv: (m,) damping of every row, 1/s.
        activation: A factor of the task's presence in the stack, 0 to 1.
        error: (m,) missing force and moment at the last step, N, N·m.
        presence: h at the last step, activation included.
        confidence: How sure it is that something is touched, 0 to 1.
        measured: (m,) filtered wrench along the rows, N, N·m.
        told_motion: Whether it is told the three that follow, as `TaskArrays`.
        pose: (7,) position and quaternion wxyz of the point that presses.
        jacobian: (6, n) of that, linear rows first.
        drift: (6,) J̇ q̇ of it.
    """

    presses = True

    def __init__(self, task: ForceTask, count: int, dtype: Any, device: Any) -> None:
        super().__init__(task, count, dtype, device)
        self._memory: Any = None

    def begin(self, tick: Record, i: int, rows: slice, *, given: bool) -> None:
        """See `ToldArrays.begin`."""
        if self._memory is not None:
            return
        super().begin(tick, i, rows, given=given)
        self._memory = self._filled(tick.press[tick.kind[i, PRESS], :MEMORY_SIZE])
        self.wrench, self.fresh = self._filled(np.zeros(6)), self._filled(1)
        self.force = self._filled(self.task.wanted)
        self._contact = self._filled(np.array(self.task._thresholds or (0.0, 0.0), float))
        self.kp, self.ki = (self._filled(np.array(gain)) for gain in (self.task.kp, self.task.ki))
        self.confidence = self._filled(np.zeros(()))
        self.measured = self._filled(np.zeros(self.task.rows))
        self._row = int(tick.kind[i, PRESS])

    def set_force(self, value: ArrayLike, robots: Any = None) -> None:
        """Set force and moment of some robots from Python.

        Args:
            value: For all rows or one each, N, N·m.
            robots: None for all, a mask, or their numbers.

        Raises:
            InputError: A value of another shape or not finite.
        """
        mask = robots_of(robots, self._count)
        write_rows(self.force, self._checked(value, self.force, mask), mask)

    def places(self, i: int, rows: slice) -> Iterator[tuple[str, Any, str, int]]:
        """See `ToldArrays.places`."""
        yield from super().places(i, rows)
        start = self._row * PRESS_SIZE
        yield "in, out", self._memory, "work.press_()", start
        yield "in", self.force, "work.press_()", start + WANTED
        yield "in", self.kp, "work.press_()", start + KP
        yield "in", self.ki, "work.press_()", start + KI
        yield "out", self.confidence, "work.press_()", start + CONFIDENCE
        yield "out", self.measured, "work.press_()", start + MEASURED
        yield "in", self.kv, "work.kv_()", rows.start
        yield "in", self._contact, "robot.contact_()", 2 * i
        yield "in", self.wrench, "robot.wrench_()", 6 * i
        yield "in", self.fresh, "robot.fresh_()", i
