"""The contacts of a stack: how far each has come, and what is asked of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from threading import Lock
from typing import NamedTuple

from opspace.contacts import GroundContact
from opspace.errors import InputError, unknown_name
from opspace.law import PROFILES
from opspace.law.blending import MOST_MOVING
from opspace.law.scalars import profile
from opspace.stack.changes import Timing

MOTION_PART = 0.3
"""Part of the progress in which the motion comes; the force has the rest."""
STOP = 2.0
"""A removal that gives up this many times what it may is taken back as fast as it went."""
CALMER = 0.5
"""How much slower a removal becomes when it turns from going on to going back, or the other way."""
CALMEST = 0.02
"""It becomes no slower than this part of its pace."""
RECOVERY = 0.1
"""Time in which one that does not turn becomes e times as fast again, s."""


@dataclass(eq=False)
class ContactMember:
    """A contact in the stack.

    One number says how far it has come, so that it can be turned around at any moment:

        h_m = p(s/0.3),   h_f = p((s − 0.3)/0.7)

    A removal waits where what it gives up is what it may. The tick after tells how much that is, so in
    ticks that are long beside the duration it would jump back and forth about that place; every turn
    halves its pace until it rests there.

    Attributes:
        contact: The contact.
        progress: s, 0 out to 1 in.
        target: Where it goes, 0 or 1.
        duration: From 0 to 1, s.
        profile: Name of the profile p.
        waits: Whether it stays in while the others cannot carry.
        highest: Where a removal began; waiting takes it back no further.
        waiting: Whether it waits now.
        pace: Of the last tick, 1 where nothing hinders it, below 0 on its way back.
        calm: Part of its pace at which it goes.
    """

    contact: GroundContact
    progress: float
    target: float
    duration: float = 0.0
    profile: str = "quintic"
    waits: bool = True
    highest: float = field(default=1.0, repr=False)
    waiting: bool = False
    pace: float = field(default=1.0, repr=False)
    calm: float = field(default=1.0, repr=False)

    def advance(self, dt: float, hindrance: float) -> None:
        """Move on by a tick.

        Args:
            dt: Time since the last one, s.
            hindrance: What was given up then, as a multiple of what may be.
        """
        step = math.inf if self.duration == 0.0 else dt / self.duration
        self.waiting = False
        if self.target > self.progress:
            self.progress = min(self.target, self.progress + step)
        elif self.target < self.progress:
            waits = self.waits and self.duration > 0.0
            pace = 1.0 - min(STOP, hindrance) if waits else 1.0
            self.waiting = pace < 0.5
            turned = pace * self.pace < 0.0
            calm = self.calm * (CALMER if turned else 1.0 + dt / RECOVERY)
            self.calm, self.pace = min(1.0, max(CALMEST, calm)), pace
            moved = self.progress - self.calm * pace * step
            self.progress = min(self.highest, max(self.target, moved))

    def send(self, target: float, timing: Timing, *, waits: bool = True) -> None:
        """Turn it towards 0 or 1."""
        if self.progress in (0.0, 1.0):
            self.profile = timing.profile
        self.target, self.duration, self.waits = target, timing.duration, waits
        self.highest = self.progress
        self.pace = self.calm = 1.0

    def activations(self, own: float) -> tuple[float, float]:
        """Evaluate h_m and h_f.

        Args:
            own: The contact's own activation, which its progress is multiplied with.
        """
        s, code = own * self.progress, PROFILES.index(self.profile)
        motion, force = s / MOTION_PART, (s - MOTION_PART) / (1.0 - MOTION_PART)
        if motion >= 1.0 and force >= 1.0:
            return 1.0, 1.0
        return profile(code, min(1.0, motion)), profile(code, min(1.0, max(0.0, force)))


class _Asked(NamedTuple):
    """A request that waits for its time, by the clock after so many pauses."""

    start: float
    contact: GroundContact
    target: float
    timing: Timing
    waits: bool
    clock: int


class ContactCourse:
    """Contacts and the requests that wait, safe to use from any thread.

    The controller's thread moves them on in `begin_tick`; every other one adds requests.
    """

    def __init__(self) -> None:
        self._members: dict[str, ContactMember] = {}
        self._queue: list[_Asked] = []
        self._present: tuple[ContactMember, ...] = ()
        self._bind: Callable[[GroundContact], None] | None = None
        self._now: float | None = None
        self._hindrance = 0.0
        self._resuming, self._clock = False, 0
        self._lock = Lock()

    def __iter__(self) -> Iterator[GroundContact]:
        """Iterate over the contacts, with those that wait to come."""
        with self._lock:
            known = {m.contact.name: m.contact for m in self._members.values()}
            known.update({a.contact.name: a.contact for a in self._queue if a.target == 1.0})
        return iter(known.values())

    @property
    def present(self) -> tuple[ContactMember, ...]:
        """The contacts of the last tick."""
        return self._present

    def settled(self) -> bool:
        """Tell whether nothing was on its way or due at the last tick."""
        now = -math.inf if self._now is None else self._now
        with self._lock:
            due = any(asked.start <= now for asked in self._queue)
            return not due and all(m.progress == m.target for m in self._members.values())

    def start_with(self, contact: GroundContact) -> None:
        """Add a contact that is in from the start.

        Raises:
            InputError: There are too many.
        """
        self._check_room()
        self._members[contact.name] = ContactMember(contact, 1.0, 1.0)
        self._present = tuple(self._members.values())

    def attach(self, bind: Callable[[GroundContact], None]) -> None:
        """Bind every contact that is there or will be."""
        for contact in self:
            bind(contact)
        self._bind = bind

    def insert(self, contact: GroundContact, timing: Timing) -> None:
        """Let a contact come, or come back.

        Raises:
            InputError: Another contact has its name, or there are too many.
        """
        known = {one.name: one for one in self}
        if known.get(contact.name, contact) is not contact:
            raise InputError(
                f"another contact named {contact.name!r} is in the stack; give this one a name of "
                "its own (name=...)"
            )
        if contact.name not in known:
            self._check_room()
            if self._bind is not None:
                self._bind(contact)
        self._ask(contact, 1.0, timing, waits=True)

    def _check_room(self) -> None:
        if len(list(self)) >= MOST_MOVING:
            raise InputError(f"a stack takes at most {MOST_MOVING} contacts")

    def remove(self, subject: GroundContact | str, timing: Timing, *, wait: bool) -> None:
        """Let a contact go.

        Raises:
            UnknownNameError: It is not there.
        """
        name = subject if isinstance(subject, str) else subject.name
        known = {one.name: one for one in self}
        if name not in known:
            raise unknown_name("contact in the stack", name, known)
        self._ask(known[name], 0.0, timing, waits=wait)

    def _ask(self, contact: GroundContact, target: float, timing: Timing, *, waits: bool) -> None:
        start = -math.inf if timing.start_time is None else timing.start_time
        with self._lock:
            self._queue.append(_Asked(start, contact, target, timing, waits, self._clock))
            self._queue.sort(key=lambda asked: asked.start)

    def cancel(self) -> None:
        """Empty the queue."""
        with self._lock:
            self._queue.clear()

    def resume(self) -> None:
        """Let the next tick go on as if no time had passed since the one before."""
        with self._lock:
            self._clock += 1
            self._resuming = True

    def _resume(self, t: float) -> None:
        """Let what waits for its time wait on, but what was asked in the pause."""
        self._resuming = False
        if self._now is None:
            return
        pause, self._now = t - self._now, t
        clock = self._clock
        queue = [
            asked
            if asked.clock == clock
            else asked._replace(start=asked.start + pause, clock=clock)
            for asked in self._queue
        ]
        self._queue = sorted(queue, key=lambda asked: asked.start)

    def hinder(self, hindrance: float) -> None:
        """Tell what was given up in a tick, as a multiple of what may be."""
        self._hindrance = hindrance

    @property
    def hindrance(self) -> float:
        """What was told last."""
        return self._hindrance

    def begin_tick(self, t: float) -> tuple[ContactMember, ...]:
        """Start what is due at time ``t`` [s], move on what is on its way, drop what has left."""
        if self._resuming:
            with self._lock:
                self._resume(t)
        dt = 0.0 if self._now is None else max(0.0, t - self._now)
        self._now = t
        if not self._members and not self._queue:
            return ()
        with self._lock:
            due = [asked for asked in self._queue if asked.start <= t]
            self._queue = self._queue[len(due) :]
            for member in self._members.values():
                member.advance(dt, self._hindrance)
            for asked in due:
                member = self._members.get(asked.contact.name)
                if member is None and asked.target == 1.0:
                    member = ContactMember(asked.contact, 0.0, 1.0)
                    self._members[asked.contact.name] = member
                if member is not None:
                    member.send(asked.target, asked.timing, waits=asked.waits)
                    member.advance(0.0, 0.0)
            gone = [n for n, m in self._members.items() if m.progress == m.target == 0.0]
            for name in gone:
                del self._members[name]
            self._present = tuple(self._members.values())
        return self._present
