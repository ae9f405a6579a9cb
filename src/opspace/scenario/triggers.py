"""Events that wait for something to be felt: a foot that touches, a foot that is lost."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from opspace.command import Command
from opspace.contacts import GroundContact, SurfaceContact
from opspace.scenario.events import Event

Ask = Callable[["float | None"], None]
"""Asks the stack for an event, to start at a time [s]; None is the next tick."""
Felt = Callable[[], Mapping[str, np.ndarray]]
"""Tells the force on each contact, (3,) N on the robot in world axes."""
UP = np.array([0.0, 0.0, 1.0])
UNKNOWN = np.full(3, np.nan)
"""Force on what measures none: nothing is above or below it."""
SOON = 1e-9
"""Sums of ticks miss a time by less, s."""


@dataclass
class Waiting:
    """An event that has not started.

    Attributes:
        event: The event.
        ask: Starts it.
        since: Since when that has been felt, s.
    """

    event: Event
    ask: Ask
    since: float | None = None

    def due(self, t: float, felt: Callable[[str], tuple[float, float]]) -> bool:
        """Tell whether it starts now.

        Args:
            t: Time, s.
            felt: Tells normal force, N, and progress of a contact.
        """
        when = self.event.when
        if t < self.event.at - SOON:
            return False
        if when is None:
            return True
        if not when.holds(*felt(when.contact)):
            self.since = None
            return False
        if self.since is None:
            self.since = t
        return t - self.since >= when.lasting - SOON


class Triggers:
    """The observer that starts events when what they wait for is felt.

    Events without a condition, about what such an event brings or takes, wait here for their time:
    the stack does not know yet whether it will be there. One that removes what has not come does
    nothing.

    What starts takes effect with the next tick, as whatever is asked for between two ticks.

    Args:
        feel: Tells the forces on the contacts. A replay gives those that were recorded.
        contacts: The contacts by name.

    Attributes:
        feel: The same; may be replaced.
    """

    def __init__(self, feel: Felt, contacts: Mapping[str, GroundContact]) -> None:
        self.feel = feel
        self._contacts = contacts
        self._waiting: list[Waiting] = []

    def wait(self, event: Event, ask: Ask) -> None:
        """Let an event wait."""
        self._waiting.append(Waiting(event, ask))

    def observe(self, q: np.ndarray, v: np.ndarray, command: Command) -> None:
        """Start what is due."""
        del q, v
        if not self._waiting:
            return
        forces, told = self.feel(), command.contacts

        def felt(name: str) -> tuple[float, float]:
            present = told[name].progress if name in told else 0.0
            force = forces.get(name, UNKNOWN)
            return normal_force(self._contacts[name], force), present

        due = [waiting for waiting in self._waiting if waiting.due(command.t, felt)]
        for waiting in due:
            self._waiting.remove(waiting)
            waiting.ask(None)


def normal_force(contact: GroundContact, force: np.ndarray) -> float:
    """Take the part of a force along the normal of a contact, N; a sole is taken to be level.

    Args:
        contact: The contact.
        force: (3,) N in world axes.
    """
    normal = contact.normal if isinstance(contact, SurfaceContact) else UP
    return float(normal @ force)
