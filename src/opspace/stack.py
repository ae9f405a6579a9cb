"""The ordered tasks of a controller."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from opspace.errors import InputError
from opspace.tasks import JointLimits, Task


class Stack:
    """Tasks in order of priority, most important first.

    Every entry of the list is a level of its own; an entry that is itself a list holds several
    tasks at one level, which have no priority among them. Joint limits may stand anywhere in the
    list and are always above everything else.

    Args:
        levels: Tasks, lists of tasks, and at most one `JointLimits`.

    Raises:
        InputError: An entry that is no task, a name used twice, or more than one `JointLimits`.
    """

    def __init__(self, levels: Sequence[Task | JointLimits | Sequence[Task]]) -> None:
        self.limits: JointLimits | None = None
        found: list[tuple[Task, ...]] = []
        for entry in levels:
            if isinstance(entry, JointLimits):
                if self.limits is not None:
                    raise InputError("a stack takes one JointLimits, which covers every joint")
                self.limits = entry
                continue
            level = (entry,) if isinstance(entry, Task) else _as_level(entry)
            if level:
                found.append(level)
        self.levels = tuple(found)
        names = [task.name for task in self]
        for name in names:
            if names.count(name) > 1:
                raise InputError(
                    f"two tasks are named {name!r}; give each a name of its own (name=...)"
                )

    def __iter__(self) -> Iterator[Task]:
        """Iterate over the tasks, most important first."""
        return (task for level in self.levels for task in level)


def _as_level(entry: object) -> tuple[Task, ...]:
    if isinstance(entry, Sequence) and all(isinstance(task, Task) for task in entry):
        return tuple(entry)
    raise InputError(
        f"a stack holds tasks, lists of tasks and JointLimits, not {type(entry).__name__}"
    )
