"""The tasks of a fleet: one layout for all robots, and activations in time for each of them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from opspace.errors import InputError
from opspace.fleet.task_arrays import TaskArrays
from opspace.kernels.columns import VARIABLE_SIZE
from opspace.law import PROFILES, Ramp
from opspace.stack.changes import Timing
from opspace.stack.members import Member, Place, Variable

CODE, TARGET, START, DURATION = range(4)
"""Columns of an activation in time."""


class Activations:
    """One activation in time of every robot.

    Args:
        count: Number of robots.
        value: 0.0 or 1.0, where it rests.
        profile: Name of the profile.
        shared: Whether it moves two tasks, which none of them may turn alone.

    Attributes:
        ramps: (count, VARIABLE_SIZE), each as `opspace.law.scalars.ramp` takes it.
        variable: What stands for it in a plan.
    """

    def __init__(
        self, count: int, value: float, profile: str = "quintic", *, shared: bool = False
    ) -> None:
        self.ramps = np.tile(_packed(Ramp.resting(value, profile)), (count, 1))
        self.variable = Variable(value, profile)
        self.shared = shared

    @property
    def targets(self) -> np.ndarray:
        """Where it rests or goes, (count,) of 0 and 1."""
        return self.ramps[:, TARGET]

    def resting(self, value: float, t: float) -> np.ndarray:
        """Tell at which robots it rests at this value at time ``t`` [s], (count,)."""
        end = self.ramps[:, START] + self.ramps[:, DURATION]
        return (self.targets == value) & ((self.ramps[:, DURATION] == 0.0) | (t >= end))

    def send(self, target: float, robots: np.ndarray, timing: Timing, t: float) -> None:
        """Turn it towards 0 or 1 at time ``t`` [s], as `opspace.stack.members.Variable.send` does.

        Robots whose activations are alike are gone through once.
        """
        rows, which = np.unique(self.ramps[robots], axis=0, return_inverse=True)
        sent = np.empty_like(rows)
        for row, into in zip(rows, sent, strict=True):
            variable = Variable(0.0)
            variable.ramp = Ramp(PROFILES[int(row[CODE])], *row[1:].tolist())
            variable.send(target, timing.duration, t, timing.profile)
            into[:] = _packed(variable.ramp)
        self.ramps[robots] = sent[which.reshape(-1)]

    def rest(self, value: float, robots: np.ndarray, profile: str) -> None:
        """Let it rest at 0 or 1 at once, where the task is out and nobody sees it."""
        self.ramps[robots] = _packed(Ramp.resting(value, profile))


def _packed(ramp: Ramp) -> np.ndarray:
    found = np.array([PROFILES.index(ramp.profile), *ramp.numbers])
    assert found.size == VARIABLE_SIZE
    return found


@dataclass(frozen=True)
class FleetPlace:
    """A level where a task may be.

    Attributes:
        level: Number of the level.
        on: How far the task has come here from the place before; None for the first place.
        kept: Whether it stays although no robot needs it.
    """

    level: float
    on: Activations | None = None
    kept: bool = False


@dataclass
class FleetMember:
    """A task of a fleet.

    Attributes:
        arrays: What it is told and tells.
        presence: 0 outside, 1 inside, of every robot.
        places: The levels where it may be; it is at the last one that is on.
        inside: At which robots it is, or will be when everything that is asked for has happened.
        level: At which level then, of every robot.
    """

    arrays: TaskArrays
    presence: Activations
    places: list[FleetPlace]
    inside: np.ndarray
    level: np.ndarray

    @property
    def member(self) -> Member:
        """The task as a plan takes it."""
        places = tuple(Place(p.level, p.on and p.on.variable) for p in self.places)
        return Member(self.arrays.task, self.presence.variable, places)

    def insert(self, level: float, robots: np.ndarray, timing: Timing, t: float) -> bool:
        """Send the task in, and tell whether that needs a place which there was not."""
        if not robots.any():
            return self.make_room(level)
        out = robots & self.presence.resting(0.0, t)
        new = self.move(level, out, Timing(0.0, timing.profile), t)
        new |= self.move(level, robots & ~out, timing, t)
        self.presence.rest(0.0, out, timing.profile)
        self.presence.send(1.0, robots, timing, t)
        self.arrays.begin_again(out)
        return new

    def move(self, level: float, robots: np.ndarray, timing: Timing, t: float) -> bool:
        """Send the task to a level, and tell whether it has become a place that there was not.

        It goes back over its own steps where it can, as `opspace.stack.members.Member.move` does.
        """
        waiting = robots.copy()
        for k in reversed(range(len(self.places))):
            if self.places[k].level == level and waiting.any():
                waiting &= ~self._turned(k, waiting, timing, t)
        if not waiting.any():
            return False
        self._add(level, waiting, timing, t)
        return True

    def make_room(self, level: float) -> bool:
        """Keep a place for robots that will come, and tell whether there was none."""
        if any(place.level == level for place in self.places):
            self.places = [
                replace(place, kept=place.kept or place.level == level) for place in self.places
            ]
            return False
        self.places.append(FleetPlace(level, Activations(self.inside.size, 0.0), kept=True))
        return True

    def _add(self, level: float, robots: np.ndarray, timing: Timing, t: float) -> None:
        """Add a place, and send these robots there."""
        on = Activations(robots.size, 0.0, timing.profile)
        on.send(1.0, robots, timing, t)
        self.places.append(FleetPlace(level, on))

    def _turned(self, goal: int, robots: np.ndarray, timing: Timing, t: float) -> np.ndarray:
        """Make a place the goal by turning activations, and tell of which robots that was possible."""
        wanted = [
            (place.on, 1.0 if k == goal else 0.0)
            for k, place in enumerate(self.places)
            if k >= goal and place.on is not None
        ]
        able = robots.copy()
        for on, target in wanted:
            if on.shared:
                able &= on.targets == target
        for on, target in wanted:
            if not on.shared:
                on.send(target, able, timing, t)
        return able

    def go_back(self, level: float, robots: np.ndarray) -> bool:
        """Let the task be at a level at once, and tell whether it has become a place.

        A swap that another task has a part in ends for both.
        """
        for k, place in enumerate(self.places):
            if place.level == level:
                for j, other in enumerate(self.places):
                    if other.on is not None:
                        other.on.rest(float(j == k), robots, "quintic")
                return False
        on = Activations(robots.size, 0.0)
        on.rest(1.0, robots, "quintic")
        self.places.append(FleetPlace(level, on))
        return True

    def tidy(self, t: float) -> None:
        """Forget the places that all robots have left, or that none will come to."""
        left: list[FleetPlace] = []
        for place in self.places:
            if place.on is None or place.kept or not place.on.resting(0.0, t).all():
                everywhere = place.on is not None and place.on.resting(1.0, t).all()
                if everywhere and not any(one.kept for one in left):
                    left = [FleetPlace(place.level)]
                else:
                    left.append(place)
        self.places = left

    def levels(self) -> np.ndarray:
        """Return at which level each robot has the task when everything has arrived, (count,)."""
        level = np.full(self.inside.size, self.places[0].level)
        for place in self.places[1:]:
            assert place.on is not None
            level[place.on.targets == 1.0] = place.level
        return level


def swap(a: FleetMember, b: FleetMember, robots: np.ndarray, timing: Timing, t: float) -> bool:
    """Exchange the levels of two tasks, by one activation for both.

    Robots at which the tasks are at other levels have an activation of their own. For no robot at all
    places are kept for those that will come.

    Returns:
        Whether there are new places.
    """
    last = a.places[-1].on
    if last is not None and last.shared and last is b.places[-1].on:
        targets = last.targets.copy()
        for target in (0.0, 1.0):
            last.send(1.0 - target, robots & (targets == target), timing, t)
        return False
    new, prepared = False, not robots.any()
    x, y = a.levels(), b.levels()
    asked = robots if robots.any() else np.ones(robots.size, bool)
    for first, second in sorted(set(zip(x[asked].tolist(), y[asked].tolist(), strict=True))):
        if first != second:
            on = Activations(robots.size, 0.0, timing.profile, shared=True)
            on.send(1.0, robots & (x == first) & (y == second), timing, t)
            a.places.append(FleetPlace(second, on, prepared))
            b.places.append(FleetPlace(first, on, prepared))
            new = True
    return new


def checked(members: dict[str, FleetMember], name: str, robots: np.ndarray) -> FleetMember:
    """Return a task that all these robots have.

    Raises:
        InputError: Some of them have not.
    """
    found = members[name]
    lacking = robots & ~found.inside
    if lacking.any():
        raise InputError(
            f"{int(lacking.sum())} of these robots have no task {name!r} in their stack, the first is "
            f"number {int(np.argmax(lacking))}"
        )
    return found
