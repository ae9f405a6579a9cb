"""What waits to happen to the tasks of a stack, and what is happening to them."""

from __future__ import annotations

import math
from bisect import insort
from collections.abc import Callable, Iterator
from copy import deepcopy
from threading import Lock, RLock
from typing import NamedTuple

from opspace.errors import InputError, OpspaceError
from opspace.stack.changes import Insert, Known, Request
from opspace.stack.members import Member, Place, Variable
from opspace.tasks import Task

AHEAD = 32
"""Changes of the stack that are foreseen."""


class _Queued(NamedTuple):
    order: float
    request: Request


class Transitions:
    """The tasks of a stack and the requests that wait, safe to use from any thread.

    The controller's thread changes tasks in `begin_tick`; every other one adds to the queue.
    """

    def __init__(self) -> None:
        self._members: dict[str, Member] = {}
        self._queue: list[_Queued] = []
        self._now: float | None = None
        self._ticked: tuple[Member, ...] = ()
        self._prepare: Callable[[Task], None] | None = None
        self._foresee: Callable[[Iterator[tuple[Member, ...]]], None] | None = None
        self._period = 0.0
        # Nothing happens to the stack before this time, unless something new is asked.
        self._next = -math.inf
        self._asked = False
        self._resuming = False
        # One request at a time is prepared, which takes long; the other lock is held briefly.
        self._requesting = RLock()
        self._lock = Lock()

    def start_with(self, task: Task, level: float) -> None:
        """Add a task that is in from the start.

        Raises:
            InputError: Another task has its name.
        """
        if task.name in self._members:
            raise InputError(
                f"two tasks are named {task.name!r}; give each a name of its own (name=...)"
            )
        self._members[task.name] = Member(task, Variable(1.0), [Place(level)])
        self._ticked = tuple(self._members.values())

    def levels(self) -> list[tuple[float, Task]]:
        """List the tasks, each with the level where it is or goes."""
        with self._lock:
            return [(member.level, member.task) for member in self._members.values()]

    def settled(self) -> bool:
        """Tell whether at the last tick nothing was on its way or due."""
        with self._lock:
            now = -math.inf if self._now is None else self._now
            due = any(_is_due(queued.request, now) for queued in self._queue)
            return not due and all(member.settled(now) for member in self._members.values())

    def present(self) -> tuple[Member, ...]:
        """Return the tasks of the last tick, or those there are at the start."""
        return self._ticked

    @property
    def now(self) -> float | None:
        """Time of the last tick, s, or None before the first."""
        return self._now

    def ask(self, request: Request) -> None:
        """Queue a request.

        Raises:
            InputError: It cannot be fulfilled, or not together with those that wait.
            UnknownNameError: It names a task that is not there.
        """
        with self._requesting:
            if isinstance(request, Insert):
                with self._lock:
                    self._checked(request)
                self.prepare(request.task)
            self._look_ahead(request)
            with self._lock:
                self._add(request)
                self._asked = True

    def cancel(self) -> None:
        """Empty the queue."""
        with self._requesting:
            with self._lock:
                self._queue.clear()
                self._asked = True
            self._look_ahead()

    def prepare(self, task: Task) -> None:
        """Get a task ready that no tick is using."""
        with self._requesting:
            with self._lock:
                used = [*(m.task for m in self._members.values()), *self._waiting()]
            if self._prepare is not None and all(task is not one for one in used):
                self._prepare(task)

    def attach(self, prepare: Callable[[Task], None]) -> None:
        """Prepare every task that is there or will be, and from now on every new one."""
        with self._requesting:
            with self._lock:
                tasks = [*(m.task for m in self._members.values()), *self._waiting()]
            for task in tasks:
                prepare(task)
            self._prepare = prepare

    def foresee(self, foresee: Callable[[Iterator[tuple[Member, ...]]], None]) -> None:
        """Tell now, and before every request is queued, what stacks are to come."""
        with self._requesting:
            self._foresee = foresee
            self._look_ahead()

    def begin_tick(self, t: float) -> tuple[Member, ...]:
        """Start what is due, and drop what has left.

        Requests that are being made in another thread at this very moment wait for the next tick,
        so that a tick never waits for them.

        Args:
            t: Time of the tick, s.

        Returns:
            The tasks of this tick, which only the thread of the controller changes: the same
            object as at the tick before if nothing has begun, and no task or place gone, since.
        """
        if t < self._next and not self._asked:
            self._now = t
            return self._ticked
        if self._lock.acquire(blocking=self._resuming):  # which no tick can go on without
            try:
                self._asked = False
                if self._resuming:
                    self._resume(t)
                elif self._now is not None:
                    self._period = t - self._now
                started = bool(self._queue) and self._start_due(t)
                if self._settle(t) or started:
                    self._change()
            finally:
                self._lock.release()
        self._now = t
        return self._ticked

    def resume(self) -> None:
        """Let the next tick go on as if no time had passed since the one before."""
        self._resuming = self._asked = True

    def _resume(self, t: float) -> None:
        """Move everything that has a time on by the pause, and let tasks find anew what they hold."""
        self._resuming = False
        if self._now is None:
            return
        pause = t - self._now
        variables = {id(v): v for m in self._members.values() for v in m.variables}
        for variable in variables.values():
            variable.wait(pause)
        self._queue = [_Queued(q.order + pause, q.request.later(pause)) for q in self._queue]
        self._now = t
        self._ticked = tuple(self._members.values())  # another object: its ramps have changed
        for member in self._ticked:
            member.task.resume(pause)

    def _change(self) -> None:
        members = tuple(self._members.values())
        for member in members:
            if member not in self._ticked:
                member.task.reset()
        self._ticked = members

    def _look_ahead(self, request: Request | None = None) -> None:
        """Go through what is to come on a copy, in the thread that asks."""
        if self._foresee is None:
            return
        copy = Transitions()
        with self._lock:
            tasks = {id(member.task): member.task for member in self._members.values()}
            copy._members = deepcopy(self._members, tasks)
            copy._queue = list(self._queue)
            copy._now, copy._period = self._now, self._period
        if request is not None:
            copy._add(request)
        self._foresee(copy._to_come())

    def _to_come(self) -> Iterator[tuple[Member, ...]]:
        """Go from event to event; each answer holds until the next one is asked for."""
        t = (self._now or 0.0) + self._period
        for _ in range(AHEAD):
            self._start_due(t)
            self._settle(t)
            yield tuple(self._members.values())
            self._now, t = t, self._next
            if t == math.inf:
                return

    def _start_due(self, t: float) -> bool:
        before = self._now
        start = -math.inf
        waiting: list[_Queued] = []
        for queued in self._queue:
            request = queued.request
            if not _is_due(request, t):
                waiting.append(queued)
                continue
            wanted = request.timing.start_time
            # Between two ticks it starts on time; what is in the past would be a step.
            on_time = wanted is not None and before is not None and wanted > before
            start = max(start, wanted if wanted is not None and on_time else t)
            request.apply(self._members, start)
        started = len(waiting) < len(self._queue)
        self._queue = waiting
        return started

    def _settle(self, t: float) -> bool:
        """Drop what has left, and find when the next request is due or the next ramp arrives.

        One pass, for the tick that does it has other work to do.

        Returns:
            Whether a task or a place of one is gone.
        """
        gone: list[str] = []
        tidied = False
        following = math.inf
        for name, member in self._members.items():
            ramp = member.presence.ramp
            end = ramp.start_time + ramp.duration
            if t < end and ramp.duration != 0.0:
                following = min(following, end)
            elif ramp.target == 0.0:
                gone.append(name)
                continue
            if len(member.places) > 1:
                tidied = member.tidy(t) or tidied
                for place in member.places[1:]:
                    assert place.arrival is not None
                    ramp = place.arrival.ramp
                    following = min(following, ramp.start_time + ramp.duration)
        for name in gone:
            del self._members[name]
        for queued in self._queue:
            start = queued.request.timing.start_time
            following = min(following, -math.inf if start is None else start)
        self._next = following
        return tidied or bool(gone)

    def _waiting(self) -> list[Task]:
        return [q.request.task for q in self._queue if isinstance(q.request, Insert)]

    def _add(self, request: Request) -> None:
        insort(self._queue, self._checked(request), key=lambda queued: queued.order)

    def _checked(self, request: Request) -> _Queued:
        """Go through everything that is asked, in the order in which it will happen."""
        known = {
            name: Known(member.task, member.level, member.leaving)
            for name, member in self._members.items()
        }
        now = -math.inf if self._now is None else self._now
        wanted = request.timing.start_time
        new = _Queued(now if wanted is None else max(wanted, now), request)
        for queued in self._queue:
            if queued.order <= new.order:
                queued.request.check(known)
        request.check(known)
        for queued in self._queue:
            if queued.order > new.order:
                try:
                    queued.request.check(known)
                except OpspaceError as error:
                    raise InputError(
                        f"this makes a request for t = {queued.order:g} s impossible: {error}"
                    ) from None
        return new


def _is_due(request: Request, t: float) -> bool:
    wanted = request.timing.start_time
    return wanted is None or wanted <= t
