"""What the rest of the library needs to know about a kind of task."""

from __future__ import annotations

from typing import Literal, NamedTuple

from opspace.tasks.task import Task


class TaskKind(NamedTuple):
    """A kind of task; keys and defaults in a scenario are those of the constructor.

    Attributes:
        task: Its class.
        controls: What a target is a value of; it says which targets a scenario can give, in which
            unit speeds are, and how many rows there are; "momentum" has no target.
    """

    task: type[Task]
    controls: Literal["position", "orientation", "pose", "joint", "joints", "momentum"]
