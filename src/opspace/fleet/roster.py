"""The tasks of a fleet, and what is asked of them for some robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.fleet.fleet_activations import Activations
from opspace.fleet.fleet_member import FleetMember, FleetPlace
from opspace.kernels.columns import VARIABLE_SIZE
from opspace.stack.changes import Timing
from opspace.stack.members import Member, Variable


class Roster:
    """The tasks of all robots of a fleet.

    Requests are checked at once against what there will be when all of them have happened, and happen
    with the next step. Every robot goes through what its own `opspace.Stack` would; the layout, in
    which places are those of all robots, only grows. So a robot that rests begins from the first
    place of its level again, and a few places are enough for ever.

    Args:
        count: Number of robots.

    Attributes:
        members: The tasks by name.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self.members: dict[str, FleetMember] = {}
        self._start: dict[str, float] = {}
        self._queue: list[Callable[[float], bool]] = []

    def start_with(self, task: Any, level: float) -> None:
        """Add a task that all robots have from the start."""
        self.members[task.name] = FleetMember(task, self.count, level, inside=True)
        self._start[task.name] = level

    def take_in(self, task: Any, level: float) -> FleetMember:
        """Add a task that no robot has yet."""
        member = FleetMember(task, self.count, level, inside=False)
        self.members[task.name] = member
        self._queue.append(lambda _: True)
        return member

    def find(self, task: Any) -> FleetMember:
        """Return a task, given itself or its name.

        Raises:
            InputError: Another task has its name.
            UnknownNameError: There is none.
        """
        name = task if isinstance(task, str) else task.name
        if name not in self.members:
            raise unknown_name("task of the fleet", name, self.members)
        found = self.members[name]
        if not isinstance(task, str) and task is not found.task:
            raise InputError(
                f"another task named {name!r} is in the fleet; give this one a name of its own "
                "(name=...)"
            )
        return found

    @property
    def asked(self) -> bool:
        """Whether requests wait."""
        return bool(self._queue)

    @property
    def present(self) -> tuple[Member, ...]:
        """The tasks as a plan takes them."""
        return tuple(member.member for member in self.members.values())

    def ramps(self, variables: tuple[Variable, ...]) -> np.ndarray:
        """Return the activations in time, (count, variables, VARIABLE_SIZE), in the order of a plan."""
        known = {on.variable: on for m in self.members.values() for on in m.activations}
        found = np.zeros((self.count, len(variables), VARIABLE_SIZE))
        for k, variable in enumerate(variables):
            found[:, k] = known[variable].ramps
        return found

    def happen(self, t: float) -> bool:
        """Let everything begin at time ``t`` [s] that has been asked for.

        Returns:
            Whether there are new tasks or places.
        """
        waiting, self._queue = self._queue, []
        new = False
        for request in waiting:
            new |= request(t)
        return new

    # --- Requests --------------------------------------------------------------------------------

    def insert(self, task: Any, level: float, robots: np.ndarray, timing: Timing) -> None:
        """Ask for a task, which has been taken in.

        Raises:
            InputError: Some of the robots have it at another level.
        """
        member = self.find(task)
        elsewhere = robots & member.inside & (member.level != level)
        if elsewhere.any():
            first = int(np.argmax(elsewhere))
            raise InputError(
                f"task {member.name!r} is in the stack of robot {first} already, at level "
                f"{member.level[first]:g}; use move({member.name!r}, {level:g})"
            )
        member.inside |= robots
        member.level[robots] = level
        self._ask(self._insert, member, level, robots, timing)

    def remove(self, task: Any, robots: np.ndarray, timing: Timing) -> None:
        """Ask that a task leaves."""
        member = self.find(task)
        member.inside &= ~robots

        def happen(t: float) -> bool:
            member.presence.send(0.0, robots & ~member.presence.resting(0.0, t), timing, t)
            return False

        self._queue.append(happen)

    def move(self, task: Any, level: float, robots: np.ndarray, timing: Timing) -> None:
        """Ask for another level.

        Raises:
            InputError: Some of the robots do not have the task.
        """
        member = self._had(task, robots)
        member.level[robots] = level
        self._ask(self._move, member, level, robots, timing)

    def swap(self, first: Any, second: Any, robots: np.ndarray, timing: Timing) -> None:
        """Ask that two tasks exchange their levels.

        Raises:
            InputError: The same task twice, or some of the robots do not have both.
        """
        a, b = self._had(first, robots), self._had(second, robots)
        if a is b:
            raise InputError(f"swap takes two different tasks, got {a.name!r} twice")
        a.level[robots], b.level[robots] = b.level[robots], a.level[robots]
        self._ask(self._swap, a, b, robots, timing)

    def reset(self, robots: np.ndarray) -> None:
        """Ask that robots have the stacks of the start, at once."""
        for member in self.members.values():
            there = member.name in self._start
            member.inside[robots] = there
            if there:
                member.level[robots] = self._start[member.name]
        self._queue.append(lambda t: self._reset(robots, t))

    def _ask(self, request: Callable[..., bool], *given: Any) -> None:
        self._queue.append(lambda t: request(*given, t))

    def _had(self, task: Any, robots: np.ndarray) -> FleetMember:
        found = self.find(task)
        lacking = robots & ~found.inside
        if lacking.any():
            raise InputError(
                f"{int(lacking.sum())} of these robots have no task {found.name!r} in their stack, "
                f"the first is number {int(np.argmax(lacking))}"
            )
        return found

    # --- What happens ----------------------------------------------------------------------------

    def _insert(
        self, member: FleetMember, level: float, robots: np.ndarray, timing: Timing, t: float
    ) -> bool:
        if not robots.any():
            return member.make_room(level)
        self._settle(robots, t)
        out = robots & member.presence.resting(0.0, t)
        new = member.put(level, out, t)
        back = robots & ~out & (member.levels() != level)
        new |= member.move(level, back, timing, t)
        member.presence.rest(0.0, out)
        member.presence.send(1.0, robots, timing, t)
        member.epoch[out] += 1
        return new

    def _move(
        self, member: FleetMember, level: float, robots: np.ndarray, timing: Timing, t: float
    ) -> bool:
        if not robots.any():
            return member.make_room(level)
        self._settle(robots, t)
        return member.move(level, robots, timing, t)

    def _swap(
        self, a: FleetMember, b: FleetMember, robots: np.ndarray, timing: Timing, t: float
    ) -> bool:
        """Exchange the levels of two tasks, by one activation for both.

        Robots at which the tasks are at other levels have an activation of their own. For no robot
        places are made for those that will come.
        """
        self._settle(robots, t)
        waiting = robots.copy()
        for i, j, on in _common(a, b):
            top = a.here(t)[i] & ~a.here(t)[i + 1 :].any(axis=0)
            top &= b.here(t)[j] & ~b.here(t)[j + 1 :].any(axis=0)
            turning = waiting & top & ~on.arrived(t)
            targets = on.targets.copy()
            for target in (0.0, 1.0):
                on.send(1.0 - target, turning & (targets == target), timing, t)
            waiting &= ~turning
        x, y = a.levels(), b.levels()
        for i, j, on in _common(a, b):
            fits = (x == b.places[j].level) & (y == a.places[i].level) & on.resting(0.0, t)
            fits &= ~a.here(t)[i:].any(axis=0) & ~b.here(t)[j:].any(axis=0)
            on.send(1.0, waiting & fits, timing, t)
            waiting &= ~fits
        there = waiting if robots.any() else np.ones(self.count, bool)
        new = False
        for first, second in sorted(set(zip(x[there].tolist(), y[there].tolist(), strict=True))):
            if first == second or (not robots.any() and _prepared(a, b, first, second)):
                continue
            a.make_room(second)
            b.make_room(first)
            on = Activations(self.count, 0.0, shared=True)
            on.send(1.0, waiting & (x == first) & (y == second), timing, t)
            a.places.append(FleetPlace(second, on))
            b.places.append(FleetPlace(first, on))
            new = True
        return new

    def _reset(self, robots: np.ndarray, t: float) -> bool:
        new = False
        for member in self.members.values():
            for on in member.activations:
                if on.shared:
                    on.rest(0.0, robots)
        for member in self.members.values():
            there = member.name in self._start
            member.presence.rest(float(there), robots)
            member.epoch[robots] += 1
            if there:
                new |= member.put(self._start[member.name], robots, t)
        return new

    def _settle(self, robots: np.ndarray, t: float) -> None:
        """Let robots that rest be at the first place of their levels, which nobody sees."""
        still = robots.copy()
        members = self.members.values()
        for member in members:
            levels = member.levels()
            for on in member.activations[1:]:
                still &= on.arrived(t)
            own = {p.level for p in member.places if not (p.on and p.on.shared)}
            still &= np.isin(levels, list(own))
        if not still.any():
            return
        levels = [member.levels() for member in members]
        for member in members:
            for on in member.activations[1:]:
                if on.shared:
                    on.rest(0.0, still)
        for member, level in zip(members, levels, strict=True):
            for number in np.unique(level[still]):
                member.put(float(number), still & (level == number), t)


def _common(a: FleetMember, b: FleetMember) -> list[tuple[int, int, Activations]]:
    """List the activations that move two tasks, each with its places."""
    return [
        (i, j, place.on)
        for i, place in enumerate(a.places)
        for j, other in enumerate(b.places)
        if place.on is not None and place.on.shared and place.on is other.on
    ]


def _prepared(a: FleetMember, b: FleetMember, first: float, second: float) -> bool:
    return any(
        a.places[i].level == second and b.places[j].level == first for i, j, _ in _common(a, b)
    )
