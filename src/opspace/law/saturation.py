"""Torque limits that keep priority: lower levels give way first, each scaled before it is distorted."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

SHARE = 0.95
"""Part of the torque that is left which a level may use. The rest is for the levels below: without it
a level below would be all there or not at all as its torque at a saturated joint changes sign."""


def room_for(
    part: Float[np.ndarray, " n"], torque: Float[np.ndarray, " n"], limit: Float[np.ndarray, " n"]
) -> float:
    """Largest s in [0, 1] with which every joint stays inside its share of what is left.

        s = min(1, min_j SHARE (limit_j ∓ Γ_j) / |γ_j|),   the room in the direction of γ_j

    s is continuous in Γ and γ as long as there is room, and s γ leaves at least 1 − SHARE of it; so a
    chain of levels is continuous wherever the torque that it starts from is inside the limits. A level
    that adds nothing takes nothing, whence levels may come and go.

    Args:
        part: (n,) torque γ that a level adds, N·m.
        torque: (n,) torque Γ before it, inside the limits, N·m.
        limit: (n,) largest torque of each joint, N·m; inf where there is none.

    Returns:
        s.
    """
    s = 1.0
    for j in range(part.shape[0]):
        if part[j] >= 0.0:
            room, asked = SHARE * (limit[j] - torque[j]), part[j]
        else:
            room, asked = SHARE * (limit[j] + torque[j]), -part[j]
        if asked > room:
            s = min(s, room / asked)
    return s
