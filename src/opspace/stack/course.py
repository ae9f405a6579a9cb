"""The tasks of a stack and the requests that wait, from one event to the next."""

from __future__ import annotations

import math
from typing import NamedTuple

from opspace.stack.changes import Request
from opspace.stack.members import Member, Variable, variables_of


class Queued(NamedTuple):
    """A request that waits, and its place among others, s."""

    order: float
    request: Request

    @property
    def start(self) -> float:
        """When it is to start, s; −inf is the next tick."""
        wanted = self.request.timing.start_time
        return -math.inf if wanted is None else wanted


class Event(NamedTuple):
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
        following: When the next of them arrives or the next request starts, s.
    """

    def __init__(self, members: dict[str, Member], queue: list[Queued]) -> None:
        self.members = members
        self.queue = queue
        self.moving: tuple[Variable, ...] = ()
        self.following = -math.inf

    def next_event(self, t: float, before: float | None, at: float) -> Event | None:
        """Return what happens next until a tick, or None.

        Args:
            t: Time of the tick, s.
            before: Time of the tick before, s, or None. What was to start until then starts with
                this tick: an earlier start would be a step.
            at: Time of the last event in this tick, s; nothing starts before it.
        """
        arrives = min([variable.end for variable in self.moving], default=math.inf)
        starts = self.queue[0].start if self.queue else math.inf
        if starts <= (t if before is None else min(before, t)):
            starts = t
        time = max(min(arrives, starts), at)
        if time > t or (arrives > t and starts > t):
            return None
        due = [queued.request for queued in self.queue if queued.start <= time]
        arrivals = tuple([variable for variable in self.moving if variable.end <= time])
        return Event(time, tuple(due) if starts <= time else (), arrivals)

    def play(self, event: Event) -> bool:
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
        self.drop(event.requests)
        return bool(event.requests or gone or any(tidied))

    def drop(self, started: tuple[Request, ...]) -> None:
        """Take requests that have started from the queue, and find what follows."""
        del self.queue[: len(started)]
        times = [variable.end for variable in self.moving]
        if self.queue:
            times.append(self.queue[0].start)
        self.following = min(times, default=math.inf)
