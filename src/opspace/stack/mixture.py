"""The stacks that a stack in transition is a mixture of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from opspace.law import Weighted
from opspace.stack.groups import Blending
from opspace.stack.members import Member, Variable, variables_of


class Slot(NamedTuple):
    """A task at a level.

    Attributes:
        member: Index of the task's member.
        level: Number of the level.
    """

    member: int
    level: float


Share = tuple[float, float]
"""A level and how much of a task is there."""


@dataclass(frozen=True)
class Mixture:
    """Hard stacks and their weights.

    Attributes:
        slots: Every task at every level where some of the stacks have it, most important first.
        levels: Numbers of the levels, most important first.
        corners: The stacks, as indices into ``slots``; weights sum to 1.
        shares: Per member the levels where it is, with weights that sum to 1.
    """

    slots: tuple[Slot, ...]
    levels: tuple[float, ...]
    corners: tuple[Weighted, ...]
    shares: tuple[tuple[Share, ...], ...]


def mixture(
    members: Sequence[Member], activations: Sequence[float], t: float, blending: Blending
) -> Mixture:
    """Blend the stacks between which the tasks of a stack are on their way.

    The activation of every task is one variable of the blend, every move or swap another. A corner
    of the blend says of each whether it is on, hence which tasks are there and at which levels:
    it is an ordinary stack, in which every task is at most once.

    Args:
        members: The tasks.
        activations: Activation of each.
        t: Time, s.
        blending: How they are blended; it remembers which activations are on their way.

    Returns:
        The stacks with weight > 0; those that are the same are one.
    """
    variables = variables_of(members)
    values = [*activations, *(v.value(t) for v in variables[len(members) :])]
    index = {variable: i for i, variable in enumerate(variables)}
    weights: dict[frozenset[Slot], float] = {}
    shares: list[dict[float, float]] = [{} for _ in members]
    for weight, on in blending.corners(variables, values):
        levels = [_level(member, index, on) for member in members]
        for found, level in zip(shares, levels, strict=True):
            found[level] = found.get(level, 0.0) + weight
        stack = frozenset(Slot(i, level) for i, level in enumerate(levels) if i in on)
        weights[stack] = weights.get(stack, 0.0) + weight
    slots = sorted(frozenset().union(*weights), key=lambda slot: (slot.level, slot.member))
    where = {slot: k for k, slot in enumerate(slots)}
    return Mixture(
        tuple(slots),
        tuple(sorted({level for found in shares for level in found})),
        tuple(Weighted(w, frozenset(where[s] for s in stack)) for stack, w in weights.items()),
        tuple(tuple(sorted(found.items())) for found in shares),
    )


def _level(member: Member, index: dict[Variable, int], on: frozenset[int]) -> float:
    """Level of a task in one corner: the last of its places that it has arrived at."""
    for place in reversed(member.places):
        if place.arrival is None or index[place.arrival] in on:
            return place.level
    raise AssertionError("the first place of a task has no arrival")
