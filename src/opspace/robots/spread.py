"""From the joints that are controlled to all that move with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from opspace.robots.joint_roles import Coupling


@dataclass(frozen=True)
class Spread:
    """All moving joints of a model, driven by some of them: q_all = G q + offset, v_all = G v.

    Attributes:
        G: (all, n) ratios.
        offset: (all,) rad or m.
        leaders: (n,) place of each controlled joint among all.
    """

    G: np.ndarray
    offset: np.ndarray
    leaders: np.ndarray

    @classmethod
    def of(cls, names: Sequence[str], couplings: Sequence[Coupling]) -> Spread:
        """Arrange joints of one coordinate each, some of which follow others."""
        followers = {coupling.follower: coupling for coupling in couplings}
        leaders = [i for i, name in enumerate(names) if name not in followers]
        place = {names[i]: k for k, i in enumerate(leaders)}
        G, offset = np.zeros((len(names), len(leaders))), np.zeros(len(names))
        for i, name in enumerate(names):
            coupling = followers.get(name)
            G[i, place[name if coupling is None else coupling.leader]] = (
                1.0 if coupling is None else coupling.ratio
            )
            offset[i] = 0.0 if coupling is None else coupling.offset
        return cls(G, offset, np.array(leaders, dtype=int))

    def positions(self, q: np.ndarray) -> np.ndarray:
        """Return where all joints are."""
        return self.G @ q + self.offset
