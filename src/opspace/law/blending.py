"""Which stacks a partly active stack is a mixture of, and with what weights."""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from collections.abc import Sequence
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from opspace.errors import InputError, unknown_name
from opspace.law.scalars import spread


class Weighted(NamedTuple):
    """One corner of a blend: the task sets that are present in it, and its weight."""

    weight: float
    present: frozenset[int]


MOST_MOVING = 16
"""More task sets than this cannot move at once with ``idv``: 2^16 hard torques take seconds."""

BLENDINGS = ("idv", "chain")
"""``idv``: intermediate desired values, 2^k corners. ``chain``: k + 1 corners."""


def corners(activations: Sequence[float], blending: str) -> list[Weighted]:
    """List the hard stacks that a blend is made of.

    Task sets with activation 0 are in none, those with activation 1 in all; only the k in between
    branch. The weights are not negative, sum to 1, and those of the corners that contain task set k
    sum to h_k.

    Args:
        activations: h_k of every task set.
        blending: ``"idv"`` or ``"chain"``.

    Returns:
        The corners with weight > 0.

    Raises:
        UnknownNameError: There is no such blending.
        InputError: More than `MOST_MOVING` task sets move with ``"idv"``.
    """
    if blending not in BLENDINGS:
        raise unknown_name("blending", blending, BLENDINGS)
    always = frozenset(k for k, h in enumerate(activations) if h == 1.0)
    moving = [k for k, h in enumerate(activations) if 0.0 < h < 1.0]
    if blending == "idv":
        if len(moving) > MOST_MOVING:
            raise InputError(
                f"{len(moving)} task sets have an activation between 0 and 1; blending='idv' would "
                f"take 2^{len(moving)} hard torques, use blending='chain' (at most {MOST_MOVING})"
            )
        return _idv_corners(activations, always, moving)
    return _chain_corners(activations, always, moving)


def combined(first: Sequence[Weighted], second: Sequence[Weighted]) -> list[Weighted]:
    """Combine the blends of two disjoint groups of task sets, each blended in its own way.

    The weights multiply, as if the groups were independent; continuity and the marginals of either
    are kept, and so are the values at the corners.
    """
    return [Weighted(a.weight * b.weight, a.present | b.present) for a in first for b in second]


def _idv_corners(h: Sequence[float], always: frozenset[int], moving: list[int]) -> list[Weighted]:
    """Multilinear interpolation: Π_{k∈T} h_k Π_{k∉T} (1 − h_k) for every subset T."""
    result: list[Weighted] = []
    for size in range(len(moving) + 1):
        for chosen in combinations(moving, size):
            weight = float(np.prod([h[k] if k in chosen else 1.0 - h[k] for k in moving]))
            if weight > 0.0:
                result.append(Weighted(weight, always | frozenset(chosen)))
    return result


def _chain_corners(h: Sequence[float], always: frozenset[int], moving: list[int]) -> list[Weighted]:
    """Lovász extension: h_(i) − h_(i+1) for the i most active task sets, i = 0 … k."""
    return _along(h, [0.0] * len(h), always, moving)


def leaning_chain(activations: Sequence[float], leans: Sequence[float]) -> list[Weighted]:
    """Average the chains of h + x a over x from −1 to 1, with the density ¾ (1 − x²).

    The average of the activations is h again, so the marginals are kept. Where two activations
    cross, the chain has a kink at one x only, and the average has none: it is continuously
    differentiable wherever the members that meet lean differently. On the way from x = −1 to 1 some
    neighbours in the order change places; each change adds a corner to the k + 1 of the chain.

    Args:
        activations: h_k of every task set.
        leans: a_k, such that h_k ± a_k stays in [0, 1].

    Returns:
        The corners with weight > 0.
    """
    low = [h - a for h, a in zip(activations, leans, strict=True)]
    always = frozenset(k for k, h in enumerate(activations) if h == 1.0)
    moving = [k for k, h in enumerate(activations) if 0.0 < h < 1.0]
    return _along(low, [2.0 * a for a in leans], always, moving)


def _along(
    low: Sequence[float], width: Sequence[float], always: frozenset[int], moving: list[int]
) -> list[Weighted]:
    """Average the chains of low + y width over y from 0 to 1, with the density 6 y (1 − y)."""
    order = sorted(moving, key=lambda k: -low[k])
    first = [always | frozenset(order[:i]) for i in range(len(order) + 1)]
    share = [0.0] * len(first)
    result: list[Weighted] = []
    y, where = 0.0, 0
    while where >= 0:
        meet, where = _next_meeting(order, low, width)
        begin, y = spread(y), max(meet, y)
        part, moment = (after - before for before, after in zip(begin, spread(y), strict=True))
        lows = [1.0, *(low[k] for k in order), 0.0]
        widths = [0.0, *(width[k] for k in order), 0.0]
        for i in range(len(first)):
            share[i] += (lows[i] - lows[i + 1]) * part + (widths[i] - widths[i + 1]) * moment
        if where >= 0:
            result.append(Weighted(share[where + 1], first[where + 1]))
            order[where], order[where + 1] = order[where + 1], order[where]
            first[where + 1], share[where + 1] = first[where] | {order[where]}, 0.0
    result += map(Weighted, share, first)
    return [corner for corner in result if corner.weight > 0.0]


def _next_meeting(
    order: Sequence[int], low: Sequence[float], width: Sequence[float]
) -> tuple[float, int]:
    """Where on the way from 0 to 1 the next neighbours meet, and which: 1 and none at the end."""
    meet, where = 1.0, -1
    for i, (a, b) in enumerate(pairwise(order)):
        closing, gap = width[b] - width[a], low[a] - low[b]
        if closing > 0.0 and gap < closing * meet:
            meet, where = gap / closing, i
    return meet, where
