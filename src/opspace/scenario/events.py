"""What a scenario file can say about tasks that come, go and change rank while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from opspace.law import PROFILES
from opspace.scenario.contact_entries import AnyContact
from opspace.scenario.fields import Checked, Entry, Number, listed, problem, shown
from opspace.scenario.task_entries import AnyTask

if TYPE_CHECKING:
    from typing_extensions import Self

    ProfileName = str
else:  # whatever there is, without a second list
    ProfileName = Literal[PROFILES]
"""``step`` is the hard switch that all of this avoids, for comparisons."""

Kind = Literal["insert", "remove", "move", "swap"]
KINDS: tuple[Kind, ...] = ("insert", "remove", "move", "swap")


def _pair(value: Any) -> tuple[str, str]:
    """Read the names of two tasks."""
    if (
        not isinstance(value, list | tuple)
        or len(value) != 2
        or not all(isinstance(name, str) for name in value)
        or value[0] == value[1]
    ):
        raise problem(f"must be a list of two different tasks, not {shown(value)}")
    return value[0], value[1]


class WhenEntry(Entry):
    """What must be felt for an event to start; it starts once."""

    contact: str = Field(description="contact whose measured normal force is watched")
    force_above: Annotated[float, Number("N", at_least=0.0)] | None = Field(
        default=None, description="it touches: the force is above this [N]"
    )
    force_below: Annotated[float, Number("N", above=0.0)] | None = Field(
        default=None,
        description="it is lost: the contact is fully in and the force below this [N]",
    )
    lasting: Annotated[float, Number("s", at_least=0.0)] = Field(
        default=0.0, description="how long that must have lasted [s]"
    )

    @model_validator(mode="after")
    def _one_sign(self) -> Self:
        if (self.force_above is None) == (self.force_below is None):
            raise problem("needs either the key 'force_above' or the key 'force_below'")
        return self

    def holds(self, force: float, present: float) -> bool:
        """Tell whether it is felt now.

        Args:
            force: Measured normal force, N.
            present: Progress of the contact, 0 where it is not in the stack.
        """
        if self.force_above is not None:
            return force > self.force_above
        assert self.force_below is not None
        return present == 1.0 and force < self.force_below


class Event(Entry):
    """One change of the stack: insert, remove, move or swap, with its time.

    A task or a contact whose first event is ``insert`` is not in the stack before it.
    """

    at: Annotated[float, Number("s", at_least=0.0)] = Field(
        description="when it starts [s]; with when the earliest time"
    )
    when: WhenEntry | None = Field(
        default=None, description="what must be felt for it to start; null is nothing"
    )
    insert: str | None = Field(default=None, description="task or contact that comes")
    remove: str | None = Field(default=None, description="task or contact that goes")
    move: str | None = Field(default=None, description="task that gets another level")
    swap: Annotated[tuple[str, str], Checked(_pair)] | None = Field(
        default=None, description="two tasks that exchange their levels"
    )
    level: Annotated[float, Number("1")] | None = Field(
        default=None,
        description="number of the level, for insert (null: the task's own) and move; "
        "0.5 lies between 0 and 1",
    )
    duration: Annotated[float, Number("s", at_least=0.0)] = Field(
        default=0.5, description="how long it takes [s]; 0 is a hard switch"
    )
    profile: ProfileName = Field(default="quintic", description="shape of the activation in time")
    wait: bool | None = Field(
        default=None,
        description="of a contact that goes: no faster than the others can carry (true, which null "
        "is as well), or whatever falls",
    )

    @model_validator(mode="after")
    def _check_kind(self) -> Self:
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) != 1:
            found = " and ".join(given) or "none"
            raise problem(f"must say exactly one of {', '.join(KINDS)}, not {found}")
        if self.kind == "move" and self.level is None:
            raise problem("is missing (number of the level that the task moves to)", "level")
        if self.kind in {"remove", "swap"} and self.level is not None:
            raise problem(f"{self.kind} takes no level", "level")
        if self.kind != "remove" and self.wait is not None:
            raise problem(f"{self.kind} takes no wait", "wait")
        return self

    @property
    def kind(self) -> Kind:
        """What happens."""
        return next(kind for kind in KINDS if getattr(self, kind) is not None)

    @property
    def tasks(self) -> tuple[str, ...]:
        """Names of the tasks that it happens to."""
        named = getattr(self, self.kind)
        return named if isinstance(named, tuple) else (named,)

    @property
    def end(self) -> float:
        """When it is over [s], unless another event turns it around."""
        return self.at + self.duration


def check_events(
    events: Sequence[Event],
    tasks: Mapping[str, AnyTask],
    contacts: Mapping[str, AnyContact],
) -> None:
    """Refuse an event about what the scenario does not have, or that its subject cannot do.

    Args:
        events: The events.
        tasks: The tasks by name.
        contacts: The contacts by name.

    Raises:
        PydanticCustomError: There is no such task or contact, or it has no levels.
    """
    known = {**tasks, **contacts}
    for k, event in enumerate(events):
        what = "task or contact" if contacts else "task"
        for name in event.tasks:
            if name not in known:
                raise problem(
                    f"{event.kind}: unknown {what} {shown(name)}" + listed(known, name), k
                )
            if name in contacts and (event.kind in ("move", "swap") or event.level is not None):
                raise problem(f"{event.kind}: {shown(name)} is a contact and has no level", k)
            if name in tasks and event.wait is not None:
                raise problem(f"only contacts wait, and {shown(name)} is a task", k)
        if event.when is not None and event.when.contact not in contacts:
            name = event.when.contact
            raise problem(f"when: unknown contact {shown(name)}" + listed(contacts, name), k)


def in_order(events: Sequence[Event]) -> list[tuple[int, Event]]:
    """Sort events by time, each with its place in the file."""
    return sorted(enumerate(events), key=lambda found: found[1].at)


def depending(events: Sequence[Event]) -> frozenset[str]:
    """Find the tasks and contacts whose events no stack can be told of before the run.

    Whether they are there when another event comes depends on what is felt.
    """
    return frozenset(name for e in events if e.when is not None for name in e.tasks)


def late_tasks(
    events: Sequence[Event], tasks: Mapping[str, AnyTask] | Mapping[str, AnyContact]
) -> frozenset[str]:
    """Find what is not in the stack at the start: it says so, or an event inserts it.

    Args:
        events: The events.
        tasks: Tasks, or contacts, by name.
    """
    first: dict[str, Event] = {}
    for _, event in in_order(events):
        for name in event.tasks:
            first.setdefault(name, event)
    inserted = {n for n, event in first.items() if event.kind == "insert" and n in tasks}
    return frozenset(inserted | {name for name, entry in tasks.items() if not entry.present})


def levels_visited(events: Sequence[Event], tasks: Mapping[str, AnyTask]) -> dict[float, list[str]]:
    """List, by number of the level, the tasks that are ever there, most important first."""
    late = late_tasks(events, tasks)
    level = {name: float(entry.level) for name, entry in tasks.items()}
    visits = [(number, name) for name, number in level.items() if name not in late]
    for _, event in in_order(events):
        if not set(event.tasks) <= set(tasks):
            continue
        if event.kind == "swap":
            a, b = event.tasks
            level[a], level[b] = level[b], level[a]
        elif event.kind == "insert":
            # Called back or inserted again, without a level of its own it comes to its first one.
            level[event.tasks[0]] = insertion_level(event, tasks)
        elif event.level is not None:
            level[event.tasks[0]] = event.level
        if event.kind != "remove":
            visits += [(level[name], name) for name in event.tasks]
    found: dict[float, list[str]] = {}
    for number, name in sorted(visits, key=lambda visit: visit[0]):
        if name not in found.setdefault(number, []):
            found[number].append(name)
    return found


def insertion_level(event: Event, tasks: Mapping[str, AnyTask]) -> float:
    """Level at which an event inserts its task."""
    return float(tasks[event.tasks[0]].level) if event.level is None else event.level
