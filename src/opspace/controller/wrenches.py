"""Wrenches that are measured, on their way to the tasks that need them."""

from __future__ import annotations

import weakref
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import Any, TypeAlias, cast

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Status
from opspace.errors import InputError
from opspace.law.press_columns import GIVEN, GIVEN_AT
from opspace.robots.protocol import Robot
from opspace.stack import Member
from opspace.tasks import ForceTask
from opspace.tasks.touch_memory import TouchMemory
from opspace.tasks.validation import Array, finite_array

STALE = int(Status.WRENCH_STALE)
TAKEN = slice(GIVEN, GIVEN + 6)
FROZEN = ~(Status.OK | Status.DIRECTION_OFF | Status.LATE)
"""What keeps the integrals of forces where they are."""

_NO_WRENCH = (KeyError, AttributeError, TypeError, ValueError, NotImplementedError)
"""What goes wrong with what is no array of six floats."""

Wrenches: TypeAlias = Mapping[str, ArrayLike | None]
"""Wrench of the robot on the environment, (6,) N and N·m in world axes at the point of the task, by name
of the frame; None where nothing new has been measured since the tick before."""


class WrenchInput:
    """Hands measured wrenches to force tasks, and tells them what has saturated.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._tasks: list[weakref.ref[ForceTask]] = []
        self._known: set[str] = set()
        self._members: Sequence[Member] | None = None
        self._present: list[tuple[ForceTask, str]] = []
        self._away: list[tuple[weakref.ref[ForceTask], str]] = []
        self._only: tuple[str, TouchMemory, Array, Any] | None = None
        self._given: Mapping[str, Array | None] = {}
        self._taken: list[float] | None = None
        # Whether force tasks may keep their memory elsewhere than at the tick before.
        self.moved = True

    @property
    def given(self) -> Mapping[str, Array | None]:
        """What was given in the last tick, by name of the frame."""
        self._settle()
        return self._given

    def add(self, task: ForceTask) -> None:
        """Let a task have its wrench from now on."""
        if not any(one is task for one in self._alive()):
            self._tasks = [ref for ref in self._tasks if ref() is not None] + [weakref.ref(task)]
            self._members = None

    def take(self, t: float, wrenches: Wrenches | None, members: Sequence[Member]) -> int:
        """Check the wrenches of a tick and hand them out.

        Args:
            t: Time, s.
            wrenches: What was measured; None for nothing at all.
            members: The tasks of the tick.

        Returns:
            The number of ``WRENCH_STALE`` where a task of the tick has had no new one for too long,
            or 0.

        Raises:
            InputError: A task of the tick lacks its wrench, or one is no (6,) finite numbers.
            UnknownNameError: There is no frame of this name.
        """
        if members is not self._members:
            self._look_at(members)
        # One task and its wrench, as nearly always: the same checks in a fraction of the time. What
        # does not pass them goes the long way, which says what is wrong.
        if self._only is not None and type(wrenches) is dict and len(wrenches) == 1:
            sensor, memory, row, numbers = self._only
            if memory.row is row:
                try:
                    value: Any = wrenches[sensor]
                    found = value.tolist()
                    a, b, c, d, e, f = found
                    if isfinite(a + b + c + d + e + f):
                        numbers[TAKEN] = value  # refuses other shapes and kinds of numbers
                        numbers[GIVEN_AT] = t
                        self._taken = found
                        return 0
                except _NO_WRENCH:
                    pass
        self._settle()
        self.moved = True
        given = {name: self._checked(name, value) for name, value in (wrenches or {}).items()}
        status = 0
        for task, sensor in self._present:
            if sensor not in given:
                raise InputError(self._missing(task, given))
            if not task.take(t, given[sensor]):
                if not task.measured_once:
                    raise InputError(
                        f"task {task.name!r}: the wrench of {sensor!r} has never been measured"
                    )
                status = STALE
        for ref, sensor in self._away:
            if sensor in given and (away := ref()) is not None:
                away.take(t, given[sensor])
        self._given = given
        self._look_for_one()
        return status

    def _look_at(self, members: Sequence[Member]) -> None:
        """Tell the tasks of a tick from those that are elsewhere but may be asked what they feel."""
        present = {id(member.task) for member in members}
        known = [(task, task.sensor) for task in self._alive()]
        self._present = [one for one in known if id(one[0]) in present]
        self._away = [(weakref.ref(one), name) for one, name in known if id(one) not in present]
        self._members = members
        self._look_for_one()

    def _settle(self) -> None:
        """Make an array of what the short way has taken, which nearly nobody asks for."""
        if self._taken is not None:
            assert self._only is not None
            self._given, self._taken = {self._only[0]: np.array(self._taken)}, None

    def _look_for_one(self) -> None:
        """Find out whether a single task asks for its wrench, and where it keeps it."""
        self._settle()
        self._only = None
        if len(self._present) != 1 or self._away:
            return
        task, sensor = self._present[0]
        if type(task).take is ForceTask.take:
            row = task.memory.row
            view: Any = memoryview(cast(Any, row))
            self._only = sensor, task.memory, row, view

    def after(self, status: Status) -> None:
        """Tell force tasks whether anything saturated, so that their integrals do not wind up."""
        frozen = bool(status & FROZEN)
        for task in self._alive():
            task.freeze(frozen)

    def _alive(self) -> Iterator[ForceTask]:
        return (task for ref in self._tasks if (task := ref()) is not None)

    def _checked(self, name: str, value: ArrayLike | None) -> Array | None:
        if name not in self._known:
            self._robot.frame_id(name)
            self._known.add(name)
        if value is None:
            return None
        found = np.array(value, dtype=float) if type(value) is np.ndarray else None
        if found is None or found.shape != (6,) or not isfinite(sum(found.tolist())):
            return finite_array(value, (6,), f"the wrench of {name!r}")
        return found

    def _missing(self, task: ForceTask, given: Mapping[str, object]) -> str:
        what = f"given: {', '.join(map(repr, sorted(given)))}" if given else "none was given"
        return (
            f"task {task.name!r} needs the wrench of {task.sensor!r}, step(t, q, v, "
            f"wrenches={{{task.sensor!r}: w}}) with w = None where nothing new was measured; {what}"
        )
