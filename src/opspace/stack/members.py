"""A task in a stack: its presence, and the places between which it moves."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from opspace.law import PROFILES, Ramp
from opspace.law.scalars import ramp
from opspace.tasks import Task


class Variable:
    """An activation in time; two tasks that swap places share one.

    Args:
        value: 0.0 or 1.0, where it rests.
        profile: Name of the profile.
    """

    def __init__(self, value: float, profile: str = "quintic") -> None:
        self.ramp = Ramp.resting(value, profile)

    @property
    def target(self) -> float:
        """Where it rests or goes, 0 or 1."""
        return self.ramp.target

    @property
    def end(self) -> float:
        """When it has arrived or will arrive, s."""
        return self.ramp.start_time + self.ramp.duration

    def arrived(self, t: float) -> bool:
        """Tell whether it rests at its target at time ``t`` [s]."""
        return self.ramp.finished(t)

    def value(self, t: float) -> float:
        """Evaluate it at time ``t`` [s]."""
        if t >= self.end:
            return self.target
        name, *numbers = self.ramp
        return ramp(t, PROFILES.index(name), *numbers)

    def wait(self, pause: float) -> None:
        """Stand still for so long, s."""
        self.ramp = self.ramp._replace(start_time=self.ramp.start_time + pause)

    def idle(self, t: float) -> bool:
        """Tell whether it only begins at time ``t`` [s], has had no effect and may be forgotten."""
        return t <= self.ramp.start_time and self.value(t) == 0.0

    def send(self, target: float, duration: float, t: float, profile: str) -> None:
        """Turn it towards 0 or 1 at time ``t`` [s], to arrive ``duration`` [s] later.

        On its way it keeps the profile it has: another one would give another value to the phase
        that it is in.
        """
        ramp = self.ramp
        if self.arrived(t):
            if ramp.target == target:
                return
            if ramp.duration != 0.0 or ramp.profile != profile:
                ramp = Ramp.resting(ramp.target, profile)
        self.ramp = ramp.towards(target, duration, t)


class Place(NamedTuple):
    """A level at which a task is, or to which it is on its way.

    Attributes:
        level: Number of the level.
        arrival: How far the task has come here from the place before; None for the first place.
    """

    level: float
    arrival: Variable | None = None


@dataclass(eq=False)
class Member:
    """A task in the stack.

    A task is at the last of its places whose ``arrival`` is on. One variable decides between two
    places, so that the task is never in neither of them or in both.

    Attributes:
        task: The task.
        presence: 0 outside, 1 inside.
        places: Where it is, and where it goes.
    """

    task: Task
    presence: Variable
    places: tuple[Place, ...]

    @property
    def leaving(self) -> bool:
        """Whether it is on its way out."""
        return self.presence.target == 0.0

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The activations in time that it depends on; a swap has one for both tasks."""
        return (self.presence, *(p.arrival for p in self.places if p.arrival is not None))

    @property
    def goal(self) -> int:
        """Index of the place where it will be when everything has arrived."""
        on = [k for k, p in enumerate(self.places) if p.arrival is None or p.arrival.target == 1.0]
        return on[-1]

    @property
    def level(self) -> float:
        """Number of the level where it will be when everything has arrived."""
        return self.places[self.goal].level

    def gone(self, t: float) -> bool:
        """Tell whether it is out at time ``t`` [s]."""
        return self.leaving and self.presence.arrived(t)

    def settled(self, t: float) -> bool:
        """Tell whether nothing about it changes from time ``t`` [s] on."""
        return len(self.places) == 1 and self.presence.arrived(t)

    def tidy(self, t: float) -> bool:
        """Forget the places that it has left or will not come to, and tell whether there were any."""
        kept: list[Place] = []
        for place in self.places:
            if place.arrival is None or not place.arrival.arrived(t):
                kept.append(place)
            elif place.arrival.target == 1.0:
                kept = [Place(place.level)]
        if len(kept) == len(self.places):
            return False
        self.places = tuple(kept)
        return True

    def move(self, level: float, duration: float, t: float, profile: str) -> None:
        """Send it to a level, back over its own steps where it has just come from there."""
        for k in reversed(range(len(self.places))):
            if self.places[k].level == level and self._turn(k, duration, t, profile):
                return
        # What has not begun yet, as of several requests between two ticks, need not begin.
        kept = self.places
        while (last := kept[-1].arrival) is not None and last.idle(t):
            kept = kept[:-1]
        arrival = Variable(0.0, profile)
        arrival.send(1.0, duration, t, profile)
        self.places = (*kept, Place(level, arrival))

    def _turn(self, goal: int, duration: float, t: float, profile: str) -> bool:
        """Make a place the goal by turning variables, unless another task depends on them."""
        wanted = [
            (place.arrival, 1.0 if k == goal else 0.0)
            for k, place in enumerate(self.places)
            if k >= goal and place.arrival is not None
        ]
        if any(isinstance(v, SharedVariable) and v.target != target for v, target in wanted):
            return False
        for variable, target in wanted:
            if not isinstance(variable, SharedVariable):
                variable.send(target, duration, t, profile)
        return True


class SharedVariable(Variable):
    """The activation of a swap: it moves two tasks, so neither of them may turn it alone."""

    def idle(self, t: float) -> bool:
        """Tell whether one of the tasks may forget it: never, the other one still needs it."""
        return False


def swap(a: Member, b: Member, duration: float, t: float, profile: str) -> None:
    """Exchange the levels of two tasks, by one activation for both.

    Args:
        a: One task.
        b: The other.
        duration: Time it takes, s.
        t: When it starts, s.
        profile: Name of the profile.
    """
    arrival = a.places[-1].arrival
    if isinstance(arrival, SharedVariable) and arrival is b.places[-1].arrival:
        arrival.send(1.0 - arrival.target, duration, t, profile)
        return
    levels = a.level, b.level
    if levels[0] == levels[1]:
        return
    arrival = SharedVariable(0.0, profile)
    arrival.send(1.0, duration, t, profile)
    a.places = (*a.places, Place(levels[1], arrival))
    b.places = (*b.places, Place(levels[0], arrival))


def presences(members: Iterable[Member], t: float) -> list[float]:
    """Evaluate at time ``t`` [s] how far each task is in its stack, 0 to 1."""
    return [member.presence.value(t) for member in members]


def variables_of(members: Iterable[Member]) -> tuple[Variable, ...]:
    """List the activations of tasks, each once: their presences, then their changes of place."""
    members = tuple(members)
    found = [member.presence for member in members]
    for member in members:
        for place in member.places[1:]:  # the first place has none
            assert place.arrival is not None
            if place.arrival not in found:
                found.append(place.arrival)
    return tuple(found)
