"""Wrenches that are measured, on their way to the tasks that need them."""

from __future__ import annotations

import weakref
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from opspace.command import Status
from opspace.errors import InputError
from opspace.robots.protocol import Robot
from opspace.stack import Member
from opspace.tasks import ForceTask
from opspace.tasks.validation import Array, finite_array

FROZEN = ~(Status.OK | Status.DIRECTION_OFF | Status.LATE)
"""What keeps the integrals of forces where they are."""

Wrenches: TypeAlias = Mapping[str, ArrayLike | None]
"""Wrench of the robot on the environment, (6,) N and N·m in world axes at the point of the task, by name
of the frame; None where nothing new has been measured since the tick before."""


class WrenchInput:
    """Hands measured wrenches to force tasks, and tells them what has saturated.

    Attributes:
        given: What was given in the last tick, by name of the frame.

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
        self.given: Mapping[str, Array | None] = {}

    def add(self, task: ForceTask) -> None:
        """Let a task have its wrench from now on."""
        if not any(one is task for one in self._alive()):
            self._tasks = [ref for ref in self._tasks if ref() is not None] + [weakref.ref(task)]
            self._members = None

    def take(self, t: float, wrenches: Wrenches | None, members: Sequence[Member]) -> Status:
        """Check the wrenches of a tick and hand them out.

        Args:
            t: Time, s.
            wrenches: What was measured; None for nothing at all.
            members: The tasks of the tick.

        Returns:
            ``WRENCH_STALE`` where a task of the tick has had no new one for too long.

        Raises:
            InputError: A task of the tick lacks its wrench, or one is no (6,) finite numbers.
            UnknownNameError: There is no frame of this name.
        """
        given = {name: self._checked(name, value) for name, value in (wrenches or {}).items()}
        if members is not self._members:
            self._look_at(members)
        status = Status.OK
        for task, sensor in self._present:
            if sensor not in given:
                raise InputError(self._missing(task, given))
            if not task.take(t, given[sensor]):
                if not task.measured_once:
                    raise InputError(
                        f"task {task.name!r}: the wrench of {sensor!r} has never been measured"
                    )
                status = Status.WRENCH_STALE
        for ref, sensor in self._away:
            if sensor in given and (away := ref()) is not None:
                away.take(t, given[sensor])
        self.given = given
        return status

    def _look_at(self, members: Sequence[Member]) -> None:
        """Tell the tasks of a tick from those that are elsewhere but may be asked what they feel."""
        present = {id(member.task) for member in members}
        known = [(task, task.sensor) for task in self._alive()]
        self._present = [one for one in known if id(one[0]) in present]
        self._away = [(weakref.ref(one), name) for one, name in known if id(one) not in present]
        self._members = members

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
