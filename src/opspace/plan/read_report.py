"""What a compiled tick tells, worked out when somebody asks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from opspace.command import ContactStatus, Distance, Found, LevelStatus, TaskStatus
from opspace.errors import ByName
from opspace.kernels.columns import slot_bit
from opspace.plan.memory import Reported
from opspace.plan.pack_contacts import ContactTick

if TYPE_CHECKING:
    from opspace.plan.plan import Plan


class Written(NamedTuple):
    """What one tick left for a report.

    Attributes:
        plan: The plan of the tick.
        memory: The bytes of the block that the tick wrote.
        footing: The contacts of the tick.
    """

    plan: Plan
    memory: bytes
    footing: tuple[ContactTick, ...] = ()


class CompiledReport(Written):
    """Tasks, levels and limits of one tick."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Be copied as what is told: the plan is of this controller, and its memory of this process."""
        return Found, (
            ByName(self.tasks),
            self.levels,
            dict(self.limits),
            ByName(self.distances),
            ByName(self.contacts),
        )

    @cached_property
    def tasks(self) -> Mapping[str, TaskStatus]:
        """Status of each task by name."""
        return self._task_status()

    @cached_property
    def levels(self) -> tuple[LevelStatus, ...]:
        """Status of each level where there is a task, most important first."""
        return self._level_status()

    @property
    def limits(self) -> Mapping[str, float]:
        """Activation of the joint limits that take part, by name."""
        limits = self.plan.limits
        if limits is None:
            return {}
        found = self._found.numbers("limit_h")
        return {side.name: h for side, h in zip(limits.sides, found, strict=True) if h > 0.0}

    @property
    def contacts(self) -> Mapping[str, ContactStatus]:
        """Status of each contact by name."""
        if not self.footing:
            return ByName()
        found = self._found
        told = found["contact_force"], found["contact_axes"], found.numbers("contact_use")
        return ByName(
            (footing.contact.name, footing.status(force, axes, use))
            for footing, force, axes, use in zip(self.footing, *told, strict=False)
        )

    @property
    def distances(self) -> Mapping[str, Distance]:
        """Pairs of bodies that are kept apart, by name, the nearest first."""
        distances = self.plan.distances
        if distances is None:
            return ByName()
        found = self._found
        return distances.layout.status(found["distance"], found["distance_taken"])

    def _task_status(self) -> dict[str, TaskStatus]:
        plan, found = self.plan, self._found
        shares: list[dict[float, float]] = [{} for _ in plan.members]
        for (level, i, _), share in zip(plan.places, found.numbers("share"), strict=True):
            if share > 0.0:
                shares[i][level] = shares[i].get(level, 0.0) + share
        status: ByName[TaskStatus] = ByName()
        errors = found["error"]
        for packed, levels, h in zip(plan.packed, shares, found.numbers("h"), strict=True):
            error = errors[packed.rows].copy()
            norm = math.sqrt(error @ error)
            status[packed.task.name] = TaskStatus(h, tuple(sorted(levels.items())), error, norm)
        return status

    def _level_status(self) -> tuple[LevelStatus, ...]:
        plan, found = self.plan, self._found
        shares = found.numbers("share")
        there = {place[0] for place, share in zip(plan.places, shares, strict=True) if share > 0.0}
        solved = zip(
            *map(found.numbers, ("scale", "top", "chosen", "width", "unrest_there")), strict=True
        )
        next(solved)  # joint limits are no level
        kept = found["kept"]
        return tuple(
            self._level(shares, kept, depth, level, *one)
            for depth, (level, one) in enumerate(zip(plan.levels, solved, strict=False), 1)
            if level in there
        )

    @cached_property
    def _found(self) -> Reported:
        return Reported(self.plan.size, self.memory)

    def _level(
        self,
        shares: tuple[float, ...],
        kept: np.ndarray,
        depth: int,
        level: float,
        scale: float,
        top: float,
        chosen: float,
        width: float,
        unrest: float,
    ) -> LevelStatus:
        plan = self.plan
        here = [s for s, place in enumerate(plan.places) if place[0] == level]
        if top <= 0.0:
            shown = [s for s in here if shares[s] > 0.0]
            members = [plan.members[plan.places[s][1]] for s in shown]
            rows = sum(member.task.rows for member in members)
            empty = np.zeros(0)
            names = tuple(member.task.name for member in members)
            return LevelStatus(level, names, empty, empty, empty, np.zeros((rows, 0)), scale)
        present = [s for s in here if int(chosen) & slot_bit(s)]
        packed = [plan.packed[plan.places[s][1]] for s in present]
        first, rows = int(plan.first_kept[depth]), sum(p.task.rows for p in packed)
        directions = plan.spectra.of(kept[first : first + rows, : int(width)], unrest)
        return LevelStatus(level, tuple(p.task.name for p in packed), *directions, scale)
