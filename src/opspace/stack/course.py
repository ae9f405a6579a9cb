"""The tasks of a stack and the requests that wait, from one event to the next."""

from __future__ import annotations

import math
from typing import NamedTuple

from opspace.stack.changes import Request
from opspace.stack.members import Member, Variable, variables_of


class Queued(NamedTuple):
    """A request that waits.

    Attributes:
        order: Its place among others, s.
        start: When it is to start, s; −inf is the next tick.
        request: The request.
        clock: How many pauses there were before it was made, each of which may begin the time anew.
    """

    order: float
    start: float
    request: Request
    clock: int = 0

    def later(self, pause: float, t: float, clock: int) -> Queued:
        """Return the same by another clock, so much later [s] if it starts at a time of the one before.

        Args:
            pause: How much the clocks differ, s.
            t: Time by the other one, s.
            clock: Its number.
        """
        if self.clock == clock:
            return self._replace(order=max(self.start, t))
        return Queued(self.order + pause, self.start + pause, self.request.later(pause), clock)


class Happening(NamedTuple):
    """Something that happens to a stack.

    Attributes:
        time: When, s: what starts starts then, also between two ticks.
        requests: Those that start.
        arrivals: Activations that have arrived.
    """

    time: float
    requests: tuple[Request, ...]
    arrivals: tuple[Variable, ...]


class Course:
    """Members and a queue, to which one event happens after the other.

    Args:
        members: Tasks by name.
        queue: Requests, in the order in which they will start.

    Attributes:
        moving: The activations that are on their way.
        arrives: When the next of them arrives, s.
        starts: When the next request starts, s.
        following: The earlier of both times.
    """

    def __init__(
        self, members: dict[str, Member], queue: list[Queued], moving: tuple[Variable, ...]
    ) -> None:
        self.members = members
        self.queue = queue
        self.moving = moving
        self.following = -math.inf
        self.arrives = self.starts = math.inf
        self.look()

    def look(self) -> None:
        """Find what follows, after any change."""
        self.starts = self.queue[0].start if self.queue else math.inf
        self.arrives = math.inf
        for variable in self.moving:
            ramp = variable.ramp
            self.arrives = min(self.arrives, ramp.start_time + ramp.duration)
        self.following = min(self.arrives, self.starts)

    def wait(self, pause: float, t: float, clock: int) -> None:
        """Let everything happen so much later, but what was asked in a pause; see `Queued.later`."""
        for variable in variables_of(self.members.values()):
            variable.wait(pause)
        queue = [queued.later(pause, t, clock) for queued in self.queue]
        self.queue = sorted(queue, key=lambda queued: queued.order)
        self.look()

    def next_event(self, t: float, before: float | None, at: float) -> Happening:
        """Return the first event until a tick that comes after `following`.

        Args:
            t: Time of the tick, s.
            before: Time of the tick before, s, or None. What was to start until then starts with
                this tick: an earlier start would be a step.
            at: Time of the last event in this tick, s; nothing starts before it.
        """
        arrives, starts = self.arrives, self.starts
        if starts <= (t if before is None else min(before, t)):
            starts = t
        time = max(min(arrives, starts), at)
        requests: list[Request] = []
        if starts <= time:
            requests = [queued.request for queued in self.queue if queued.start <= time]
        arrivals: list[Variable] = []
        if arrives <= time:
            arrivals = [variable for variable in self.moving if variable.end <= time]
        return Happening(time, tuple(requests), tuple(arrivals))

    def play(self, event: Happening) -> bool:
        """Let an event happen.

        Returns:
            Whether a request has started, or a task or a place of one is gone.
        """
        for request in event.requests:
            request.apply(self.members, event.time)
        tidied = [m.tidy(event.time) for m in self.members.values() if len(m.places) > 1]
        gone = [name for name, member in self.members.items() if member.gone(event.time)]
        for name in gone:
            del self.members[name]
        self.moving = tuple(
            [v for v in variables_of(self.members.values()) if not v.arrived(event.time)]
        )
        del self.queue[: len(event.requests)]
        self.look()
        return bool(event.requests or gone or any(tidied))
