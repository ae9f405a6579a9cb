"""What a tick tells about tasks and levels."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from opspace.command import LevelStatus, TaskStatus
from opspace.errors import ByName
from opspace.law import LawInfo
from opspace.stack import Member, Mixture
from opspace.tasks import TaskTerms


def task_status(
    members: Sequence[Member],
    activations: Sequence[float],
    terms: Sequence[TaskTerms],
    mixed: Mixture,
) -> dict[str, TaskStatus]:
    """Tell about every task: how much of it there is, at which levels, and its error."""
    return ByName(
        (
            member.task.name,
            TaskStatus(h, levels, term.error, math.sqrt(float(term.error @ term.error))),
        )
        for member, h, term, levels in zip(members, activations, terms, mixed.shares, strict=True)
    )


def level_status(
    members: Sequence[Member], mixed: Mixture, info: LawInfo, first: int
) -> tuple[LevelStatus, ...]:
    """Tell about every level: its tasks and its directions.

    Args:
        members: The tasks.
        mixed: Where they are.
        info: What the law found, with levels by their rank.
        first: Index of the first slot among the law's task sets.

    Returns:
        Levels, most important first.
    """
    found = {report.priority: report for report in info.levels}
    result: list[LevelStatus] = []
    for rank, level in enumerate(mixed.levels):
        report = found.get(rank)
        if report is None or report.spectrum is None:
            here = [m for m, s in zip(members, mixed.shares, strict=True) if level in dict(s)]
            rows = sum(member.task.rows for member in here)
            names = tuple(member.task.name for member in here)
            empty = np.zeros(0)
            none = np.zeros((rows, 0))
            scale = 1.0 if report is None else report.scale
            result.append(LevelStatus(level, names, empty, empty, empty, none, scale))
        else:
            slots = [mixed.slots[k - first] for k in report.members]
            names = tuple(members[slot.member].task.name for slot in slots)
            s = report.spectrum
            result.append(
                LevelStatus(
                    level, names, s.sigma, s.activation, s.response, s.directions, report.scale
                )
            )
    return tuple(result)
