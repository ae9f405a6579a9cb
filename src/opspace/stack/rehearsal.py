"""What will happen to the tasks of a stack, gone through on copies before it happens."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from copy import copy
from typing import Any, NamedTuple, TypeVar

from opspace.law import Ramp
from opspace.stack.changes import Request
from opspace.stack.course import Course, Happening, Queued
from opspace.stack.members import Member, Place, Variable, variables_of
from opspace.tasks import Task

AHEAD = 32
"""Events that are foreseen."""

T = TypeVar("T", Member, Variable)


class Outlook(NamedTuple):
    """The tasks of a stack as they will be.

    Attributes:
        members: The tasks, the very object that the tick will return.
        variables: Their activations, as `variables_of` will list them.
        copies: Copies of the tasks as they will be, until the next outlook is taken.
    """

    members: tuple[Member, ...]
    variables: tuple[Variable, ...]
    copies: tuple[Member, ...]


class Foreseen(NamedTuple):
    """What an event will have done to a stack.

    Attributes:
        requests: Those that start in it.
        arrivals: The activations that arrive in it.
        members: The tasks by name after it.
        present: The tasks as the tick returns them.
        new: Those that come with it.
        starts: Ramps that will be the same whenever the event happens, but for their start.
        turns: Ramps that leave another one on its way, wherever that will be then.
        places: Where tasks are, if that changes.
        moving: The activations that are on their way after it.
        following: When the next event comes at the earliest, s.
    """

    requests: tuple[Request, ...]
    arrivals: tuple[Variable, ...]
    members: dict[str, Member]
    present: tuple[Member, ...]
    new: tuple[Task, ...]
    starts: tuple[tuple[Variable, Ramp], ...]
    turns: tuple[tuple[Variable, Ramp], ...]
    places: tuple[tuple[Member, tuple[Place, ...]], ...]
    moving: tuple[Variable, ...]
    following: float

    def fits(self, event: Happening) -> bool:
        """Tell whether this is the event that was foreseen, whenever it happens."""
        return event.requests == self.requests and event.arrivals == self.arrivals

    def happen(self, course: Course, time: float) -> None:
        """Do to a stack what `Course.play` would do at this time [s], but look for what follows."""
        for variable, ramp in self.starts:
            variable.ramp = ramp.starting(time)  # the very same one where the time was known
        for variable, ramp in self.turns:
            variable.send(ramp.target, ramp.duration, time, ramp.profile)
        for member, places in self.places:
            member.places = places
        course.members, course.moving = self.members, self.moving
        del course.queue[: len(self.requests)]


class Rehearsal:
    """Goes from event to event on copies of the tasks of a stack.

    Args:
        course: The tasks; nothing changes them while they are copied.
        queue: The requests that wait.
        present: The tasks as the last tick has returned them.
        now: Time of the last tick, s; None before the first.
    """

    def __init__(
        self,
        course: Course,
        queue: list[Queued],
        present: tuple[Member, ...],
        now: float | None,
    ) -> None:
        self._originals: dict[Any, Any] = {}
        copies: dict[Any, Any] = {}

        def copied(one: Variable) -> Variable:
            if one not in copies:
                copies[one] = copy(one)
                self._originals[copies[one]] = one
            return copies[one]

        members = {name: copy(member) for name, member in course.members.items()}
        for name, member in members.items():
            member.presence = copied(member.presence)
            member.places = _places(member, copied)
            self._originals[member] = course.members[name]
        self._course = Course(members, queue, tuple(copies[v] for v in course.moving))
        self._present = present
        self._now = now
        self.outcomes: list[Foreseen] = []

    def outlooks(self) -> Iterator[Outlook]:
        """Give the tasks as they are, then as they are after each event."""
        # The next tick is later than the last one: what began there is on its way.
        course, time = self._course, math.nextafter(self._now or 0.0, math.inf)
        yield self._outlook()
        while course.following < math.inf and len(self.outcomes) < AHEAD:
            event = course.next_event(max(course.following, time), time, time)
            time = event.time
            self.outcomes.append(self._played(event))
            yield self._outlook()

    def _outlook(self) -> Outlook:
        copies = tuple(self._course.members.values())
        variables = tuple(self._original(v) for v in variables_of(copies))
        return Outlook(self._present, variables, copies)

    def _played(self, event: Happening) -> Foreseen:
        """Let an event happen to the copies, and say what it does to the originals."""
        course = self._course
        ramps = {v: v.ramp for v in variables_of(course.members.values())}
        places = {m: m.places for m in course.members.values()}
        changed = course.play(event)
        starts: list[tuple[Variable, Ramp]] = []
        turns: list[tuple[Variable, Ramp]] = []
        for variable in variables_of(course.members.values()):
            before, ramp = ramps.get(variable), variable.ramp
            if ramp is not before:
                turned = (
                    before is not None
                    and not before.finished(event.time)
                    and before.towards(ramp.target, ramp.duration, event.time) == ramp
                )
                (turns if turned else starts).append((self._original(variable), ramp))
        members = {name: self._original(m) for name, m in course.members.items()}
        if changed:
            self._present = tuple(members.values())
        return Foreseen(
            event.requests,
            tuple(self._original(v) for v in event.arrivals),
            members,
            self._present,
            tuple(m.task for m in course.members.values() if m not in places),
            tuple(starts),
            tuple(turns),
            tuple(
                (self._original(m), _places(m, self._original))
                for m in course.members.values()
                if m.places is not places.get(m)
            ),
            tuple(self._original(v) for v in course.moving),
            course.following,
        )

    def _original(self, one: T) -> T:
        """Return what this is a copy of; of what comes into being here, a copy is the original."""
        if one not in self._originals:
            found = self._originals[one] = copy(one)
            if isinstance(found, Member):
                found.presence = self._original(found.presence)
                found.places = _places(found, self._original)
        return self._originals[one]


def _places(member: Member, known: Callable[[Variable], Variable]) -> tuple[Place, ...]:
    """Give the places of a member with these activations instead of its own."""
    return tuple(
        Place(place.level, None if place.arrival is None else known(place.arrival))
        for place in member.places
    )
