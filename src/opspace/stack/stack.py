"""The ordered tasks of a controller, which may come, go and change rank while it runs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import overload

from opspace.contacts import GroundContact
from opspace.errors import InputError, unknown_name
from opspace.stack.changes import (
    Insert,
    Move,
    Remove,
    Swap,
    Timing,
    checked_level,
    checked_task,
)
from opspace.stack.contact_course import ContactCourse, ContactMember
from opspace.stack.members import Member
from opspace.stack.rehearsal import Outlook
from opspace.stack.transitions import Transitions
from opspace.tasks import JointLimits, Task


class Stack:
    """Tasks in order of priority, most important first.

    Every entry of the list is a level of its own; an entry that is itself a list holds several
    tasks at one level, which have no priority among them. Joint limits may stand anywhere in the
    list and are always above everything else.

    The levels of the list have the numbers 0, 1, 2, ...; joint limits and empty lists take none.
    Later a task may be put at any number: an existing one to share that level, 0.5 to be
    between 0 and 1, −1 to be above them all.

    `insert`, `remove`, `move` and `swap` may be called at any time and from any thread. They are
    checked at once and start with the controller's next tick, or with the first tick at or after
    ``start_time``. Transitions may overlap in any number, and any of them may be turned around
    or retimed on its way: what is asked last holds, and nothing steps. A transition on its way
    that gets a new goal keeps its profile.

    A stack belongs to one controller. ``stack["name"]`` is the task of that name.

    Args:
        levels: Tasks, lists of tasks, and at most one `JointLimits`; or a mapping from the number
            of each level to its task or tasks.
        limits: The joint limits, where they do not stand in the list.
        contacts: What a robot with a floating base touches from the start. Contacts have no level:
            they are physics, above everything else.

    Raises:
        InputError: An entry that is no task, a name used twice, or more than one `JointLimits`.
    """

    def __init__(
        self,
        levels: Sequence[Task | JointLimits | Sequence[Task]]
        | Mapping[float, Task | Sequence[Task]],
        limits: JointLimits | None = None,
        contacts: Sequence[GroundContact] = (),
    ) -> None:
        if isinstance(levels, Task | JointLimits):
            raise InputError(f"a stack takes a list of tasks: Stack([{levels!r}])")
        self._transitions = Transitions()
        if isinstance(levels, Mapping):
            numbered, listed = dict(levels), []
        else:
            numbered, listed = _numbered(levels)
        given = [*listed, *([] if limits is None else [limits])]
        if len(given) > 1:
            raise InputError("a stack takes one JointLimits, which covers every joint")
        self.limits: JointLimits | None = given[0] if given else None
        for number, entry in sorted(
            ((checked_level(n), entry) for n, entry in numbered.items()), key=lambda found: found[0]
        ):
            for task in (entry,) if isinstance(entry, Task) else _as_level(entry):
                self._transitions.start_with(task, number)
        self._contacts = ContactCourse()
        for contact in contacts:
            self._contacts.start_with(self._new_contact(contact))

    def __iter__(self) -> Iterator[Task]:
        """Iterate over the tasks, most important first."""
        return (task for level in self.levels for task in level)

    def __len__(self) -> int:
        """Count the tasks; those that are leaving are still among them."""
        return len(list(iter(self)))

    def __contains__(self, task: object) -> bool:
        """Tell whether a task, or one of this name, is among them."""
        return any(task is one or task == one.name for one in self)

    def __getitem__(self, name: str) -> Task:
        """Return the task of a name.

        Raises:
            UnknownNameError: There is none.
        """
        named = {task.name: task for task in self}
        if name not in named:
            raise unknown_name("task in the stack", str(name), named)
        return named[name]

    def __repr__(self) -> str:
        when = "" if self.time is None else f" at t = {self.time:g} s"
        lines = [f"Stack of {len(self.members)} tasks{when}"]
        if self.limits is not None:
            lines.append(f"  above all: {self.limits!r}")
        for number in sorted({member.level for member in self.members}):
            there = (self._told(member) for member in self.members if member.level == number)
            lines.append(f"  level {number:g}: {', '.join(there)}")
        touching = [
            one.contact.name
            if one.progress == 1.0
            else f"{one.contact.name} ({one.progress:.2g} present)"
            for one in self._contacts.present
        ]
        if touching:
            lines.insert(1, f"  contacts: {', '.join(touching)}")
        return "\n".join(lines)

    def _told(self, member: Member) -> str:
        presence = 1.0 if self.time is None else member.presence.value(self.time)
        return (
            member.task.name if presence == 1.0 else f"{member.task.name} ({presence:.2g} present)"
        )

    @property
    def levels(self) -> tuple[tuple[Task, ...], ...]:
        """Tasks by level, most important first, each at the level where it is or goes.

        Tasks that are leaving are still among them, those that wait for their time not yet.
        """
        return tuple(self.levels_by_number.values())

    @property
    def levels_by_number(self) -> dict[float, tuple[Task, ...]]:
        """The same by the number of the level."""
        found = self._transitions.levels()
        return {
            number: tuple(task for level, task in found if level == number)
            for number in sorted({level for level, _ in found})
        }

    @property
    def settled(self) -> bool:
        """Whether no transition was on its way or due at the last tick; later ones may wait."""
        return self._transitions.settled() and self._contacts.settled()

    @property
    def waiting(self) -> bool:
        """Whether requests wait that have not begun."""
        return self._transitions.waiting()

    @property
    def time(self) -> float | None:
        """Time of the controller's last tick, s, or None before the first."""
        return self._transitions.now

    @property
    def transitions(self) -> Transitions:
        """What happens to the tasks, for whoever ticks."""
        return self._transitions

    @property
    def members(self) -> tuple[Member, ...]:
        """The tasks of the last tick with their places, or those there are at the start."""
        return self._transitions.ticked

    @property
    def contacts(self) -> Mapping[str, GroundContact]:
        """The contacts by name; those that are leaving or wait for their time are among them."""
        return {contact.name: contact for contact in self._contacts}

    @overload
    def insert(
        self,
        task: Task,
        level: float,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        start_time: float | None = None,
    ) -> None: ...

    @overload
    def insert(
        self,
        task: GroundContact,
        duration: float = 0.5,
        /,
        *,
        profile: str = "quintic",
        start_time: float | None = None,
    ) -> None: ...

    @overload
    def insert(
        self,
        task: GroundContact,
        *,
        duration: float,
        profile: str = "quintic",
        start_time: float | None = None,
    ) -> None: ...

    def insert(
        self,
        task: Task | GroundContact,
        level: float | None = None,
        duration: float | None = None,
        *,
        profile: str = "quintic",
        start_time: float | None = None,
    ) -> None:
        """Insert a task or a contact; one that is leaving comes back, one that is coming is retimed.

        Preparing a task that the controller has not seen takes some 20 ms, here and not in the
        tick; `prepare` does it beforehand.

        A contact has no level: ``insert(contact, duration)``. Its motion comes first, in 0.3 of the
        duration, then its force; the robot must touch when it is inserted.

        Args:
            task: The task. Without a target it holds what it finds when it starts. Or a contact.
            level: Number of its level; lower is more important.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            start_time: When it starts, in the time of the controller, s; None is the next tick.

        Raises:
            InputError: No task, a name that another task has, a task that is at another level, or
                a number that cannot be used.
            UnknownNameError: A frame or joint that the robot does not have, or an unknown profile.
        """
        if isinstance(task, GroundContact):
            if level is not None and duration is not None:
                raise InputError(f"a contact has no level: insert({task.name!r}, duration)")
            found = next((one for one in (duration, level) if one is not None), 0.5)
            timing = Timing(found, profile, start_time)
            self._contacts.insert(self._new_contact(task), timing)
            return
        if level is None:
            raise InputError("a task needs a level: insert(task, level)")
        timing = Timing(0.5 if duration is None else duration, profile, start_time)
        if checked_task(task).name in self.contacts:
            raise InputError(
                f"{task.name!r} is the name of a contact; give the task another (name=...)"
            )
        self._transitions.ask(Insert(timing, task, checked_level(level)))

    def _new_contact(self, contact: object) -> GroundContact:
        """Check that something is a contact with a name that no task has.

        Raises:
            InputError: It is not.
        """
        if not isinstance(contact, GroundContact):
            raise InputError(
                "contacts are SoleContact, EdgeContact or PointContact, "
                f"not {type(contact).__name__}"
            )
        known = self.contacts.get(contact.name, contact)
        if known is not contact or contact.name in [task.name for task in self]:
            raise InputError(
                f"{contact.name!r} is the name of another member; give the contact another (name=...)"
            )
        return contact

    def remove(
        self,
        task: Task | GroundContact | str,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        start_time: float | None = None,
        wait: bool | None = None,
    ) -> None:
        """Remove a task or a contact; one that is coming turns around, one that is leaving is retimed.

        Args:
            task: The task or the contact, or its name.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            start_time: When it starts, in the time of the controller, s; None is the next tick.
            wait: Of a contact: let it go no faster than the others can carry (True, which None is
                as well), or whatever falls. A hard switch waits for nothing.

        Raises:
            InputError: A number that cannot be used, or ``wait`` for a task.
            UnknownNameError: No such task in the stack, or an unknown profile.
        """
        timing = Timing(duration, profile, start_time)
        name = task if isinstance(task, str) else getattr(task, "name", None)
        if isinstance(task, GroundContact) or (name in self.contacts and isinstance(task, str)):
            self._contacts.remove(task, timing, wait=wait is not False)
            return
        if wait is not None:
            raise InputError(f"only contacts wait, and {name!r} is not one")
        self._transitions.ask(Remove(timing, task))

    def move(
        self,
        task: Task | str,
        level: float,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        start_time: float | None = None,
    ) -> None:
        """Move a task to another level; it is never absent on the way.

        Args:
            task: The task or its name.
            level: Number of the level; lower is more important.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            start_time: When it starts, in the time of the controller, s; None is the next tick.

        Raises:
            InputError: A number that cannot be used.
            UnknownNameError: No such task in the stack, or it is leaving; an unknown profile.
        """
        timing = Timing(duration, profile, start_time)
        self._transitions.ask(Move(timing, task, checked_level(level)))

    def swap(
        self,
        first: Task | str,
        second: Task | str,
        duration: float = 0.5,
        *,
        profile: str = "quintic",
        start_time: float | None = None,
    ) -> None:
        """Exchange the levels of two tasks; asked again on the way, it is turned around.

        Args:
            first: One task or its name.
            second: The other.
            duration: How long it takes, s; 0 is a hard switch.
            profile: Name of the activation profile.
            start_time: When it starts, in the time of the controller, s; None is the next tick.

        Raises:
            InputError: The same task twice, or a number that cannot be used.
            UnknownNameError: No such task in the stack, or it is leaving; an unknown profile.
        """
        self._transitions.ask(Swap(Timing(duration, profile, start_time), first, second))

    def cancel_scheduled(self) -> None:
        """Forget every request that has not started."""
        self._transitions.cancel()
        self._contacts.cancel()

    def prepare(self, task: Task) -> None:
        """Do beforehand what `insert` would do with a new task: look up names and calibrate.

        Args:
            task: A task.

        Raises:
            InputError: No task, or one that does not fit the robot.
            UnknownNameError: A frame or joint that the robot does not have.
        """
        self._transitions.prepare(checked_task(task))

    def attach(self, prepare: Callable[[Task], None]) -> None:
        """Let a controller prepare every task that is in the stack or will be.

        Args:
            prepare: Gets a task ready for the controller's ticks.
        """
        self._transitions.attach(prepare)

    def foresee(self, foresee: Callable[[Iterator[Outlook]], None]) -> None:
        """Let a controller lay out what is to come, in the thread that asks for it.

        Args:
            foresee: Called now and at every request with the tasks as they are, then after each
                event to come. Ticks take up ready what it has looked at.
        """
        self._transitions.foresee(foresee)

    def resume(self) -> None:
        """Let the next tick go on as if there had been no pause; see `opspace.Controller.restart`."""
        self._transitions.resume()
        self._contacts.resume()

    def attach_contacts(self, bind: Callable[[GroundContact], None]) -> None:
        """Let a controller bind every contact that is in the stack or will be.

        Args:
            bind: Looks up the contact's frame, or refuses it.
        """
        self._contacts.attach(bind)

    def begin_contacts(self, t: float) -> tuple[ContactMember, ...]:
        """Move contacts on to time ``t`` [s] and return those there are, as `begin_tick` does."""
        return self._contacts.begin_tick(t)

    @property
    def touching(self) -> tuple[ContactMember, ...]:
        """The contacts of the last `begin_contacts`."""
        return self._contacts.present

    def hinder(self, hindrance: float) -> None:
        """Tell the contacts that are to go what the last tick gave up, see `ContactMember.advance`."""
        self._contacts.hinder(hindrance)

    @property
    def hindrance(self) -> float:
        """What the contacts were told last, see `hinder`."""
        return self._contacts.hindrance

    def begin_tick(self, t: float) -> tuple[Member, ...]:
        """Start what is due at time ``t`` [s], drop what has left, and return the tasks there are.

        For the controller's thread, once per tick.
        """
        return self._transitions.begin_tick(t)


def _numbered(
    levels: Sequence[Task | JointLimits | Sequence[Task]],
) -> tuple[dict[float, tuple[Task, ...]], list[JointLimits]]:
    """Number the levels of a list, and take the joint limits out of it."""
    limits = [entry for entry in levels if isinstance(entry, JointLimits)]
    rest = [entry for entry in levels if not isinstance(entry, JointLimits)]
    tasks = [(entry,) if isinstance(entry, Task) else _as_level(entry) for entry in rest]
    return {float(k): level for k, level in enumerate(filter(None, tasks))}, limits


def _as_level(entry: object) -> tuple[Task, ...]:
    if isinstance(entry, Sequence) and all(isinstance(task, Task) for task in entry):
        return tuple(entry)
    raise InputError(
        f"a stack holds tasks, lists of tasks and JointLimits, not {type(entry).__name__}"
    )
