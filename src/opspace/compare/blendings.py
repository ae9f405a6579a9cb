"""Which stacks a method mixes while activations move, where it is not the library's own rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from opspace.law import Weighted
from opspace.stack import Blending


class Present(Blending):
    """One stack: whatever is there at all is there fully, and a move has arrived when it begins.

    A task takes its directions at once; only the acceleration that it asks for fades.
    """

    fades_commands = True

    def corners(self, variables: Sequence[object], values: Sequence[float]) -> list[Weighted]:
        """See `opspace.stack.Blending`."""
        del variables
        return [Weighted(1.0, frozenset(k for k, h in enumerate(values) if h > 0.0))]


@dataclass(frozen=True)
class _Fade:
    """One change on its way: what drives it, from which value to which, and what is on after it."""

    driver: object
    start: float
    goal: float
    on: frozenset[object]

    def progress(self, values: dict[object, float]) -> float:
        """How far it has come, 0 to 1; one whose driver is forgotten is over."""
        now = values.get(self.driver, self.goal)
        return 1.0 if now == self.goal else (now - self.start) / (self.goal - self.start)


class CrossFade(Blending):
    """Cross-fade to the hard torque of the stack after each change, from what the torque was before.

    With s_i the progress of change i, in the order in which they began, the torque is
    Γ_i = (1 − s_i) Γ_{i−1} + s_i H(T_i), T_i the stack after change i. It is continuous as long as
    each change is completed or followed by others; k changes cost k + 1 hard torques.
    """

    def __init__(self, name: str = "cross-fade") -> None:
        super().__init__("chain")
        self.name = name
        self._last: dict[object, float] = {}
        self._settled: frozenset[object] = frozenset()
        self._fades: list[_Fade] = []

    def corners(self, variables: Sequence[object], values: Sequence[float]) -> list[Weighted]:
        """See `opspace.stack.Blending`."""
        now = dict(zip(variables, values, strict=True))
        goals = self._fades[-1].on if self._fades else self._settled
        for who, h in now.items():
            before = self._last.get(who, 1.0 if not self._last and h == 1.0 else 0.0)
            if not self._last and h == 1.0:
                goals = self._settled = goals | {who}
            elif h != before and (h > before) != (who in goals):
                goals = goals | {who} if h > before else goals - {who}
                self._fades.append(_Fade(who, before, 1.0 if h > before else 0.0, goals))
        self._last = now
        weights = [1.0]
        for fade in self._fades:
            s = min(max(fade.progress(now), 0.0), 1.0)
            weights = [*((1.0 - s) * w for w in weights), s]
        stacks = [self._settled, *(fade.on for fade in self._fades)]
        while self._fades and weights[0] == 0.0:
            self._settled = self._fades.pop(0).on
            weights, stacks = weights[1:], stacks[1:]
        found: dict[frozenset[int], float] = {}
        for weight, stack in zip(weights, stacks, strict=True):
            present = frozenset(k for k, who in enumerate(variables) if who in stack)
            found[present] = found.get(present, 0.0) + weight
        return [Weighted(w, present) for present, w in found.items() if w > 0.0]
