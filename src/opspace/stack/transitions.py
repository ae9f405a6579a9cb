"""What waits to happen to the tasks of a stack, and what is happening to them."""

from __future__ import annotations

import math
from bisect import insort
from collections import deque
from collections.abc import Callable, Iterator
from threading import Lock, RLock

import numpy as np

from opspace.errors import InputError, OpspaceError
from opspace.kernels.quiet_columns import NEXT, NOW
from opspace.stack.changes import Insert, Known, Request
from opspace.stack.course import Course, Happening, Queued
from opspace.stack.members import Member, Place, Variable
from opspace.stack.rehearsal import Foreseen, Outlook, Rehearsal
from opspace.tasks import Task


class Transitions:
    """The tasks of a stack and the requests that wait, safe to use from any thread.

    The controller's thread changes tasks in `begin_tick`; every other one adds to the queue. What
    will come of a request is gone through on copies by the thread that asks; a tick in which that
    happens has only to write it down.

    Attributes:
        times: (2,) time of the last tick, s, NaN before the first; and before which nothing happens
            to the stack, −∞ as soon as something new is asked. A tick before that need not look here.
        ticked: The tasks of the last tick, or those there are at the start; another object after every
            change.
    """

    def __init__(self) -> None:
        self._course = Course({}, [], ())
        self.times = np.array([math.nan, -math.inf])
        self.ticked: tuple[Member, ...] = ()
        self._prepare: Callable[[Task], None] | None = None
        self._foresee: Callable[[Iterator[Outlook]], None] | None = None
        # Outcomes of the events to come, good as long as no other one happens before.
        self._coming: deque[Foreseen] = deque()
        self._happened = 0
        # The first of them, once it is sure to be the next thing to happen.
        self._ripe: Foreseen | None = None
        self._resuming, self._clock = False, 0
        # One request at a time is prepared, which takes long; the other lock is held briefly.
        self._requesting = RLock()
        self._lock = Lock()

    def start_with(self, task: Task, level: float) -> None:
        """Add a task that is in from the start.

        Raises:
            InputError: Another task has its name.
        """
        if task.name in self._course.members:
            raise InputError(
                f"two tasks are named {task.name!r}; give each a name of its own (name=...)"
            )
        self._course.members[task.name] = Member(task, Variable(1.0), (Place(level),))
        self.ticked = tuple(self._course.members.values())

    def levels(self) -> list[tuple[float, Task]]:
        """List the tasks, each with the level where it is or goes."""
        with self._lock:
            return [(member.level, member.task) for member in self._course.members.values()]

    def settled(self) -> bool:
        """Tell whether at the last tick nothing was on its way or due."""
        with self._lock:
            now = self._time_or(-math.inf)
            due = any(queued.start <= now for queued in self._course.queue)
            return not due and all(member.settled(now) for member in self._course.members.values())

    def waiting(self) -> bool:
        """Tell whether requests wait."""
        with self._lock:
            return bool(self._course.queue)

    @property
    def now(self) -> float | None:
        """Time of the last tick, s, or None before the first."""
        now = float(self.times[NOW])
        return None if math.isnan(now) else now

    def _time_or(self, other: float) -> float:
        """Return the time of the last tick, s, or something else before the first."""
        return other if self.now is None else self.now

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
            coming, happened = self._look_ahead(request)
            with self._lock:
                self._add(request)
                self._expect(coming, happened)

    def cancel(self) -> None:
        """Empty the queue."""
        with self._requesting:
            with self._lock:
                self._course.queue.clear()
                self._course.look()
                self._coming.clear()
                self._ripe = None
            coming, happened = self._look_ahead()
            with self._lock:
                self._expect(coming, happened)

    def prepare(self, task: Task) -> None:
        """Get a task ready that no tick is using."""
        with self._requesting:
            with self._lock:
                used = [*(m.task for m in self._course.members.values()), *self._waiting()]
            if self._prepare is not None and all(task is not one for one in used):
                self._prepare(task)

    def attach(self, prepare: Callable[[Task], None]) -> None:
        """Prepare every task that is there or will be, and from now on every new one."""
        with self._requesting:
            with self._lock:
                tasks = [*(m.task for m in self._course.members.values()), *self._waiting()]
            for task in tasks:
                prepare(task)
            self._prepare = prepare

    def foresee(self, foresee: Callable[[Iterator[Outlook]], None]) -> None:
        """Tell now, and before every request is queued, what stacks are to come."""
        with self._requesting:
            self._foresee = foresee
            coming, happened = self._look_ahead()
            with self._lock:
                self._expect(coming, happened)

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
        # Of two that come at once, the one that must not go on without the lock waits for it.
        if not t < self.times[NEXT] and self._lock.acquire(blocking=self._resuming):
            try:
                if self._resuming:
                    self._resume(t)
                self._let_happen(t)
            finally:
                self._lock.release()
        self.times[NOW] = t
        return self.ticked

    def look(self) -> None:
        """Let the next tick look here."""
        with self._lock:
            self.times[NEXT] = -math.inf

    def resume(self) -> None:
        """Let the next tick go on as if no time had passed since the one before."""
        with self._lock:
            self._clock += 1
            self._resuming = True
            self.times[NEXT] = -math.inf

    def _resume(self, t: float) -> None:
        """Move everything that has a time on by the pause, and let tasks find anew what they hold."""
        self._resuming = False
        if self.now is None:
            return
        pause = t - self.now
        self._course.wait(pause, t, self._clock)
        self._coming.clear()  # requests and ramps are others now
        self._ripe = None
        self.times[NOW] = t
        self.ticked = tuple(self._course.members.values())  # another object, for its ramps
        for member in self.ticked:
            member.task.resume(pause)

    def _let_happen(self, t: float) -> None:
        """Go through the events until time ``t`` [s], as foreseen where they are."""
        course, before = self._course, self._time_or(t)
        if self._ripe is not None and course.following <= t < self._ripe.following:
            late = course.starts <= before
            if not late or course.arrives > t:  # else what arrives until then comes first
                self._happen(self._ripe, t if late else course.following)
                self._ripe, self.times[NEXT] = None, -math.inf  # what follows is for the next tick
                return
        course.look()
        at = -math.inf
        while course.following <= t:
            event = course.next_event(t, self.now, at)
            at = event.time
            if self._coming and self._coming[0].fits(event):
                self._happen(self._coming[0], at)
                course.look()
            else:
                self._play(event)
        self.times[NEXT] = course.following
        self._ripe = self._ripening(t)

    def _happen(self, outcome: Foreseen, time: float) -> None:
        """Do what was foreseen."""
        self._happened += 1
        self._coming.popleft()
        outcome.happen(self._course, time)
        self.ticked = outcome.present
        for task in outcome.new:
            task.reset()

    def _play(self, event: Happening) -> None:
        """Do what was not foreseen, after which nothing is any more."""
        self._happened += 1
        self._coming.clear()
        before = self.ticked
        if self._course.play(event):
            self.ticked = tuple(self._course.members.values())
        for member in self.ticked:
            if member not in before:
                member.task.reset()

    def _ripening(self, t: float) -> Foreseen | None:
        """Return the outcome of the next event after time ``t`` [s], if it was foreseen."""
        course = self._course
        if not self._coming or course.following == math.inf:
            return None
        event = course.next_event(max(course.following, math.nextafter(t, math.inf)), t, -math.inf)
        return self._coming[0] if self._coming[0].fits(event) else None

    def _look_ahead(self, request: Request | None = None) -> tuple[list[Foreseen], int]:
        """Go through what is to come on a copy, in the thread that asks.

        Returns:
            The outcomes, and the number of events that had happened.
        """
        if self._foresee is None:
            return [], self._happened
        with self._lock:
            queue, happened = list(self._course.queue), self._happened
            if request is not None:
                insort(queue, self._checked(request), key=lambda queued: queued.order)
            rehearsal = Rehearsal(self._course, queue, self.ticked, self.now)
        self._foresee(rehearsal.outlooks())
        return rehearsal.outcomes, happened

    def _expect(self, coming: list[Foreseen], happened: int) -> None:
        """Follow these outcomes, unless something else has happened meanwhile."""
        self._coming = deque(coming if happened == self._happened else ())
        self._course.look()
        self._ripe = self._ripening(self._time_or(-math.inf))
        self.times[NEXT] = -math.inf

    def _waiting(self) -> list[Task]:
        return [q.request.task for q in self._course.queue if isinstance(q.request, Insert)]

    def _add(self, request: Request) -> None:
        insort(self._course.queue, self._checked(request), key=lambda queued: queued.order)

    def _checked(self, request: Request) -> Queued:
        """Go through everything that is asked, in the order in which it will happen."""
        known = {
            name: Known(member.task, member.level, member.leaving)
            for name, member in self._course.members.items()
        }
        now = self._time_or(-math.inf)
        wanted = request.timing.start_time
        start = -math.inf if wanted is None else wanted
        new = Queued(max(start, now), start, request, self._clock)
        for queued in self._course.queue:
            if queued.order <= new.order:
                queued.request.check(known)
        request.check(known)
        for queued in self._course.queue:
            if queued.order > new.order:
                try:
                    queued.request.check(known)
                except OpspaceError as error:
                    raise InputError(
                        f"this makes a request for t = {queued.order:g} s impossible: {error}"
                    ) from None
        return new
