"""What a scenario file can say about tasks that come, go and change rank while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from opspace.law import PROFILES
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


class Event(Entry):
    """One change of the stack: insert, remove, move or swap, with its time.

    A task whose first event is ``insert`` is not in the stack before it.
    """

    at: Annotated[float, Number("s", at_least=0.0)] = Field(description="when it starts [s]")
    insert: str | None = Field(default=None, description="task that comes")
    remove: str | None = Field(default=None, description="task that goes")
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


def check_events(events: Sequence[Event], tasks: Mapping[str, AnyTask]) -> None:
    """Refuse an event about a task that the scenario does not have.

    Args:
        events: The events.
        tasks: The tasks by name.

    Raises:
        PydanticCustomError: There is no such task.
    """
    for k, event in enumerate(events):
        for name in event.tasks:
            if name not in tasks:
                raise problem(f"{event.kind}: unknown task {shown(name)}" + listed(tasks, name), k)


def in_order(events: Sequence[Event]) -> list[tuple[int, Event]]:
    """Sort events by time, each with its place in the file."""
    return sorted(enumerate(events), key=lambda found: found[1].at)


def late_tasks(events: Sequence[Event], tasks: Mapping[str, AnyTask]) -> frozenset[str]:
    """Find the tasks that are not in the stack at the start: they say so, or an event inserts them."""
    first: dict[str, Event] = {}
    for _, event in in_order(events):
        for name in event.tasks:
            first.setdefault(name, event)
    inserted = {name for name, event in first.items() if event.kind == "insert"}
    return frozenset(inserted | {name for name, entry in tasks.items() if not entry.present})


def levels_visited(events: Sequence[Event], tasks: Mapping[str, AnyTask]) -> dict[float, list[str]]:
    """List, by number of the level, the tasks that are ever there, most important first."""
    late = late_tasks(events, tasks)
    level = {name: float(entry.level) for name, entry in tasks.items()}
    visits = [(number, name) for name, number in level.items() if name not in late]
    for _, event in in_order(events):
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
