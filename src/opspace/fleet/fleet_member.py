"""A task of a fleet: one list of places for all robots, and where each robot has it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from opspace.fleet.fleet_activations import Activations
from opspace.stack.changes import Timing
from opspace.stack.members import Member, Place


@dataclass(frozen=True)
class FleetPlace:
    """A level where a task may be.

    Attributes:
        level: Number of the level.
        on: How far the task has come here from the places before; None for the first place.
    """

    level: float
    on: Activations | None = None


class FleetMember:
    """A task that every robot has or has not, at a level of its own.

    A robot has the task at the last place that is on, as a `Member` has. The places of a `Member` are
    the way that it has gone. Here they are those of all robots; of one of them only some are *here*:
    the last at which it rests, and above it all that are not at rest at 0.

    Args:
        task: The task.
        count: Number of robots.
        level: Number of the level where it begins.
        inside: Whether it is in the stacks.

    Attributes:
        presence: 0 outside, 1 inside, of every robot.
        places: All places.
        inside: At which robots it is when everything that has been asked for has happened.
        level: At which level then, of every robot.
        epoch: How often it has begun, of every robot.
    """

    def __init__(self, task: Any, count: int, level: float, *, inside: bool) -> None:
        self.task = task
        self.name: str = task.name
        self.presence = Activations(count, float(inside))
        self.places = [FleetPlace(level)]
        self.inside = np.full(count, inside)
        self.level = np.full(count, float(level))
        self.epoch = np.zeros(count, np.int64)

    @property
    def member(self) -> Member:
        """The task as a plan takes it."""
        places = tuple(Place(p.level, p.on and p.on.variable) for p in self.places)
        return Member(self.task, self.presence.variable, places)

    @property
    def activations(self) -> list[Activations]:
        """Its presence, then its changes of place."""
        return [self.presence, *(place.on for place in self.places if place.on is not None)]

    def levels(self) -> np.ndarray:
        """Return at which level each robot has the task when all has arrived, (count,)."""
        level = np.full(self.inside.size, float(self.places[0].level))
        for place in self.places[1:]:
            assert place.on is not None
            level[place.on.targets == 1.0] = place.level
        return level

    def here(self, t: float) -> np.ndarray:
        """Tell which places each robot is at or on its way between, (places, count)."""
        found = np.zeros((len(self.places), self.inside.size), bool)
        below = np.ones(
            self.inside.size, bool
        )  # where the place at which the task rests is not found
        for k in reversed(range(len(self.places))):
            on = self.places[k].on
            if on is None:
                found[k] = below
            else:
                found[k] = below & ~on.resting(0.0, t)
                below &= ~on.resting(1.0, t)
        return found

    def make_room(self, level: float) -> bool:
        """Add a place at a level unless there is one that it shares with no other task.

        Returns:
            Whether it was added.
        """
        if any(p.level == level and not (p.on and p.on.shared) for p in self.places):
            return False
        self.places.append(FleetPlace(float(level), Activations(self.inside.size, 0.0)))
        return True

    def put(self, level: float, robots: np.ndarray, t: float) -> bool:
        """Let robots have the task at a level at once, where nobody sees a difference.

        Returns:
            Whether that takes a new place.
        """
        free = np.ones(self.inside.size, bool)  # where no swap that goes on is above
        chosen = np.full(self.inside.size, -1)
        for k in reversed(range(len(self.places))):
            place = self.places[k]
            shared = place.on is not None and place.on.shared
            if place.level == level and not shared:
                chosen[robots & free] = k
            if place.on is not None and shared:
                free &= place.on.resting(0.0, t)
        for k in np.unique(chosen[chosen >= 0]):
            self._only(int(k), robots & (chosen == k))
        rest = robots & (chosen < 0)
        if not rest.any():
            return False
        self.places.append(FleetPlace(level, Activations(self.inside.size, 0.0)))
        self._only(len(self.places) - 1, rest)
        return True

    def _only(self, chosen: int, robots: np.ndarray) -> None:
        for k, place in enumerate(self.places):
            if place.on is not None and not place.on.shared:
                place.on.rest(float(k == chosen), robots)

    def move(self, level: float, robots: np.ndarray, timing: Timing, t: float) -> bool:
        """Send the task to a level, and tell whether that takes a new place.

        It goes back over its own steps where it can, as `opspace.stack.members.Member.move` does.
        """
        waiting, here = robots.copy(), self.here(t)
        for k in reversed(range(len(self.places))):
            if self.places[k].level == level:
                waiting &= ~self._turned(k, waiting & here[k], timing, t)
        self._forget_idle(waiting, t)
        here = self.here(t)
        resting = self._rests(t)
        for k in reversed(range(len(self.places))):
            place = self.places[k]
            if place.level == level and not (place.on and place.on.shared):
                able = waiting & ~here[k]
                above = able & ~here[k + 1 :].any(axis=0)
                if place.on is not None:
                    place.on.send(1.0, above, timing, t)
                    waiting &= ~above
                waiting &= ~self._dropped(k, able & ~above & resting & waiting, timing, t)
        if not waiting.any():
            return False
        on = Activations(robots.size, 0.0)
        on.send(1.0, waiting, timing, t)
        self.places.append(FleetPlace(level, on))
        return True

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

    def _dropped(self, goal: int, robots: np.ndarray, timing: Timing, t: float) -> np.ndarray:
        """Go down to a place from the one at which robots rest, by taking that away.

        Returns:
            Of which robots that was possible.
        """
        able = np.zeros_like(robots)
        base = self.here(t)
        for k in range(goal + 1, len(self.places)):
            on = self.places[k].on
            these = robots & base[k]
            if on is None or on.shared or not these.any():
                continue
            for j in range(goal, k):
                between = self.places[j].on
                if between is not None and between.shared:
                    these = these & between.resting(0.0, t)
            for j in range(goal, k):
                between = self.places[j].on
                if between is not None and not between.shared:
                    between.rest(float(j == goal), these)
            on.send(0.0, these, timing, t)
            able |= these
        return able

    def _rests(self, t: float) -> np.ndarray:
        """Tell which robots have the task at one place only."""
        return self.here(t).sum(axis=0) == 1

    def _forget_idle(self, robots: np.ndarray, t: float) -> None:
        """What has not begun yet, as of several requests between two steps, need not begin."""
        going = robots.copy()
        here = self.here(t)
        for k in reversed(range(len(self.places))):
            on = self.places[k].on
            if on is None:
                return
            idle = going & here[k] & on.idle(t)
            if on.shared:
                idle[:] = False
            on.rest(0.0, idle)
            going &= idle | ~here[k]
