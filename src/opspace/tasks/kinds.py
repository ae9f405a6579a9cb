"""What the rest of the library needs to know about a kind of task."""

from __future__ import annotations

from typing import Literal, NamedTuple

from opspace.tasks.task import Task


class TaskKind(NamedTuple):
    """A kind of task; keys and defaults in a scenario are those of the constructor.

    Attributes:
        task: Its class.
        controls: What a target is a value of; it says which targets a scenario can give, in which
            unit speeds are, and how many rows there are. Forces and momentum have no target.
        sprung: Whether it has gains of its own in place of kp and kv.
    """

    task: type[Task]
    controls: Literal["position", "orientation", "pose", "joint", "joints", "force", "momentum"]
    sprung: bool = False
