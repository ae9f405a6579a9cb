"""How tasks that move at the same time are blended, and what must be remembered for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import count
from types import MappingProxyType
from typing import NamedTuple

from opspace.errors import unknown_name
from opspace.law import Weighted, combined, corners, leaning_chain
from opspace.law.blending import MOST_MOVING
from opspace.law.scalars import CHAINED, EXACT, NO_GROUP, REACH, leaning


class Rule(NamedTuple):
    """What the name of a blending stands for.

    Attributes:
        room: How many activations may be blended exactly at once, by intermediate desired values.
        reach: How far the members of the chain lean, see `opspace.law.leaning_chain`.
    """

    room: int
    reach: float


RULES: Mapping[str, Rule] = MappingProxyType(
    {
        "auto": Rule(3, 0.0),
        "idv": Rule(MOST_MOVING, 0.0),
        "chain": Rule(0, 0.0),
        "smooth-chain": Rule(0, REACH),
    }
)
"""The blendings by name."""


class Blending:
    """Exact intermediate desired values for the first few activations that move, the chain for others.

    An activation that begins to move joins the exact group if there is room in it, else the chain,
    and stays where it is until it rests at 0 or 1 again. The weights of the two groups multiply
    (`opspace.law.combined`), so that e exact and c other moving activations cost 2^e (c + 1) hard
    torques; a chain of one is exact as well. The torque is continuous: for fixed groups it is a
    continuous function of the activations, and an activation changes its group only at 0 or 1,
    where it takes no part in either. It is as smooth as the activations while the chain has at most
    one member; with more its slope has a kink where two members cross. The smooth chain has none:
    its members lean apart, each in a direction that it keeps while it moves, and every pair that is
    near a crossing costs one hard torque more.

    Args:
        name: ``"auto"`` for at most 3 exact ones, ``"idv"`` for 16, ``"chain"`` and
            ``"smooth-chain"`` for none.

    Attributes:
        room: How many activations may be in the exact group.
        reach: How far the members of the chain lean.
        fades_commands: Whether a task on its way asks for part of its acceleration, its activation
            times f*; here it asks for all of it, in part of the stacks.

    Raises:
        UnknownNameError: There is no such blending.
    """

    fades_commands = False

    def __init__(self, name: str = "auto") -> None:
        if name not in RULES:
            raise unknown_name("blending", name, RULES)
        self.name = name
        self.room, self.reach = RULES[name]
        self._groups: dict[object, int] = {}

    def remember(self, groups: Mapping[object, int]) -> None:
        """Go on from where another form of the tick had each activation."""
        self._groups = {who: group for who, group in groups.items() if group != NO_GROUP}

    def remembered(self) -> Mapping[object, int]:
        """Return the group of every activation that was on its way, see `opspace.law.scalars`."""
        return MappingProxyType(self._groups)

    def most_corners(self, variables: int) -> int:
        """Count the corners that there can be if so many activations move at once."""
        exact = min(variables, self.room)
        chained = variables - exact
        meetings = chained * (chained - 1) // 2 if self.reach > 0.0 else 0
        return 2**exact * (chained + 1 + meetings)

    def corners(self, variables: Sequence[object], values: Sequence[float]) -> list[Weighted]:
        """List the corners for the activations of this tick.

        Args:
            variables: Who each activation belongs to; the same objects from tick to tick.
            values: The activations.

        Returns:
            Corners with weight > 0, as indices into ``values``.
        """
        groups = self._grouped([w for w, h in zip(variables, values, strict=True) if 0.0 < h < 1.0])
        chained = [groups.get(who, NO_GROUP) >= CHAINED for who in variables]
        if not any(chained):
            return corners(values, "idv")
        chain = [h if c else 0.0 for c, h in zip(chained, values, strict=True)]
        leans = [
            leaning(h, groups[who] - CHAINED, self.reach) if c else 0.0
            for who, c, h in zip(variables, chained, values, strict=True)
        ]
        return combined(
            corners([0.0 if c else h for c, h in zip(chained, values, strict=True)], "idv"),
            leaning_chain(chain, leans),
        )

    def _grouped(self, moving: Sequence[object]) -> dict[object, int]:
        """Give everyone that begins to move a group, and forget those that have arrived."""
        here = set(moving)
        groups = {who: group for who, group in self._groups.items() if who in here}
        exact = sum(group == EXACT for group in groups.values())
        for who in moving:
            if who in groups:
                continue
            if exact < self.room:
                groups[who] = EXACT
                exact += 1
            else:
                taken = set(groups.values())
                groups[who] = next(rank for rank in count(CHAINED) if rank not in taken)
        self._groups = groups
        return groups
