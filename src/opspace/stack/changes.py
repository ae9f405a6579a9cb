"""Requests to a stack: what each may be asked for, and what it does when its time has come."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from numbers import Real
from typing import NamedTuple

from opspace.errors import InputError, unknown_name
from opspace.law import Profile
from opspace.stack.members import Member, Place, Variable, swap
from opspace.tasks import JointLimits, Task


class Known(NamedTuple):
    """What a request has to know of a task: the task, where it will be, whether it is leaving."""

    task: Task
    level: float
    leaving: bool


@dataclass(frozen=True)
class Timing:
    """When a transition happens.

    Args:
        duration: s; 0 is a hard switch.
        profile: Name of the profile.
        start_time: s; None is the next tick.

    Raises:
        InputError: A number that cannot be used.
        UnknownNameError: There is no such profile.
    """

    duration: float
    profile: str = "quintic"
    start_time: float | None = None

    def __post_init__(self) -> None:
        if not _is_finite(self.duration) or self.duration < 0.0:
            raise InputError(f"the duration must be finite and >= 0 s, got {self.duration!r}")
        if self.start_time is not None and not _is_finite(self.start_time):
            raise InputError(f"the start time must be finite, in s, got {self.start_time!r}")
        Profile(self.profile)


@dataclass(frozen=True)
class Request(ABC):
    """Something asked of a stack."""

    timing: Timing

    def later(self, pause: float) -> Request:
        """Return the same, so much later [s] if it has a time at which it starts."""
        start = self.timing.start_time
        if start is None:
            return self
        return replace(self, timing=replace(self.timing, start_time=start + pause))

    @abstractmethod
    def check(self, known: dict[str, Known]) -> None:
        """Do to names what the request will do to tasks.

        Args:
            known: Tasks by name at the time of the request; changed in place.

        Raises:
            InputError: The request cannot be fulfilled.
            UnknownNameError: There is no such task.
        """

    @abstractmethod
    def apply(self, members: dict[str, Member], t: float) -> None:
        """Start the transition at time ``t`` [s]; ``members`` is changed in place, no task is."""


@dataclass(frozen=True)
class Insert(Request):
    """Insert a task at a level, or call back one that is leaving."""

    task: Task
    level: float

    def check(self, known: dict[str, Known]) -> None:
        """See `Request`."""
        name = self.task.name
        found = known.get(name)
        if found is not None and found.task is not self.task:
            state = "still leaving" if found.leaving else "in the stack"
            raise InputError(
                f"another task named {name!r} is {state}; give this one a name of its own (name=...)"
            )
        if found is not None and not found.leaving and found.level != self.level:
            raise InputError(
                f"task {name!r} is in the stack already, at level {found.level:g}; use "
                f"move({name!r}, {self.level:g})"
            )
        known[name] = Known(self.task, self.level, False)

    def apply(self, members: dict[str, Member], t: float) -> None:
        """See `Request`."""
        timing = self.timing
        member = members.get(self.task.name)
        if member is None or member.gone(t):
            presence = Variable(0.0, timing.profile)
            member = members[self.task.name] = Member(self.task, presence, (Place(self.level),))
        elif member.level != self.level:
            member.move(self.level, timing.duration, t, timing.profile)
        member.presence.send(1.0, timing.duration, t, timing.profile)


@dataclass(frozen=True)
class Remove(Request):
    """Remove a task, or hurry one that is leaving."""

    subject: Task | str

    def check(self, known: dict[str, Known]) -> None:
        """See `Request`."""
        name = _name(self.subject, known, leaving_too=True)
        known[name] = known[name]._replace(leaving=True)

    def apply(self, members: dict[str, Member], t: float) -> None:
        """See `Request`."""
        member = members.get(_name_of(self.subject))
        # It may have left meanwhile, if it was leaving when the request was made.
        if member is not None:
            member.presence.send(0.0, self.timing.duration, t, self.timing.profile)


@dataclass(frozen=True)
class Move(Request):
    """Move a task to another level."""

    subject: Task | str
    level: float

    def check(self, known: dict[str, Known]) -> None:
        """See `Request`."""
        name = _name(self.subject, known)
        known[name] = known[name]._replace(level=self.level)

    def apply(self, members: dict[str, Member], t: float) -> None:
        """See `Request`."""
        timing = self.timing
        member = members[_name_of(self.subject)]
        member.move(self.level, timing.duration, t, timing.profile)


@dataclass(frozen=True)
class Swap(Request):
    """Exchange the levels of two tasks."""

    first: Task | str
    second: Task | str

    def check(self, known: dict[str, Known]) -> None:
        """See `Request`."""
        a, b = _name(self.first, known), _name(self.second, known)
        if a == b:
            raise InputError(f"swap takes two different tasks, got {a!r} twice")
        known[a], known[b] = (
            known[a]._replace(level=known[b].level),
            known[b]._replace(level=known[a].level),
        )

    def apply(self, members: dict[str, Member], t: float) -> None:
        """See `Request`."""
        a, b = members[_name_of(self.first)], members[_name_of(self.second)]
        swap(a, b, self.timing.duration, t, self.timing.profile)


def checked_task(task: object) -> Task:
    """Return a task that can be inserted.

    Raises:
        InputError: It is something else.
    """
    if isinstance(task, JointLimits):
        raise InputError(
            "joint limits are always above everything: give them to Stack([...]) at the start"
        )
    if not isinstance(task, Task):
        raise InputError(f"insert takes a task, not {type(task).__name__}")
    return task


def checked_level(level: object) -> float:
    """Return the number of a level.

    Raises:
        InputError: It is not a finite number.
    """
    if not _is_finite(level):
        raise InputError(f"the level must be a finite number, got {level!r}")
    return float(level)  # pyright: ignore[reportArgumentType]


def _name(subject: object, known: dict[str, Known], *, leaving_too: bool = False) -> str:
    """Return the name of a task that is there."""
    if not isinstance(subject, Task | str):
        raise InputError(f"a task or its name is needed, not {type(subject).__name__}")
    name = _name_of(subject)
    found = known.get(name)
    if found is None or (found.leaving and not leaving_too):
        choices = [n for n, other in known.items() if leaving_too or not other.leaving]
        raise unknown_name("task in the stack", name, choices)
    if isinstance(subject, Task) and found.task is not subject:
        raise InputError(f"the task named {name!r} in the stack is another one than the task given")
    return name


def _name_of(subject: Task | str) -> str:
    return subject.name if isinstance(subject, Task) else subject


def _is_finite(value: object) -> bool:
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        return False
