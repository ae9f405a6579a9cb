"""How tasks that move at the same time are blended, and what must be remembered for it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from opspace.errors import unknown_name
from opspace.law import Weighted, combined, corners
from opspace.law.blending import MOST_MOVING

EXACT: Mapping[str, int] = MappingProxyType({"auto": 3, "idv": MOST_MOVING, "chain": 0})
"""How many activations may move at once as intermediate desired values, by name of the blending."""


class Blending:
    """Exact intermediate desired values for the first few activations that move, the chain for others.

    An activation that begins to move joins the exact group if there is room in it, else the chain,
    and stays where it is until it rests at 0 or 1 again. The weights of the two groups multiply
    (`opspace.law.combined`), so that e exact and c other moving activations cost 2^e (c + 1) hard
    torques; a chain of one is exact as well. The torque is continuous: for fixed groups it is a
    continuous function of the activations, and an activation changes its group only at 0 or 1,
    where it takes no part in either.

    Args:
        name: ``"auto"`` for at most 3 exact ones, ``"idv"`` for 16, ``"chain"`` for none.

    Attributes:
        room: How many activations may be in the exact group.
        fades_commands: Whether a task on its way asks for part of its acceleration, its activation
            times f*; here it asks for all of it, in part of the stacks.

    Raises:
        UnknownNameError: There is no such blending.
    """

    fades_commands = False

    def __init__(self, name: str = "auto") -> None:
        if name not in EXACT:
            raise unknown_name("blending", name, EXACT)
        self.name = name
        self.room = EXACT[name]
        self._exact: set[object] = set()
        self._chained: set[object] = set()

    def remember(self, exact: Iterable[object], chained: Iterable[object]) -> None:
        """Go on from where another form of the tick had these activations in each group."""
        self._exact, self._chained = set(exact), set(chained)

    def remembered(self) -> tuple[frozenset[object], frozenset[object]]:
        """Return the activations in the exact group and in the chain."""
        return frozenset(self._exact), frozenset(self._chained)

    def corners(self, variables: Sequence[object], values: Sequence[float]) -> list[Weighted]:
        """List the corners for the activations of this tick.

        Args:
            variables: Who each activation belongs to; the same objects from tick to tick.
            values: The activations.

        Returns:
            Corners with weight > 0, as indices into ``values``.
        """
        moving = [who for who, h in zip(variables, values, strict=True) if 0.0 < h < 1.0]
        self._exact.intersection_update(moving)
        self._chained.intersection_update(moving)
        for who in moving:
            if who in self._exact or who in self._chained:
                continue
            joined = self._exact if len(self._exact) < self.room else self._chained
            joined.add(who)
        if not self._chained:
            return corners(values, "idv")
        chained = [who in self._chained for who in variables]
        return combined(
            corners([0.0 if c else h for c, h in zip(chained, values, strict=True)], "idv"),
            corners([h if c else 0.0 for c, h in zip(chained, values, strict=True)], "chain"),
        )
