"""What levels leave of a joint's last way to its limit to those above them."""

# P and W are the paper's kind of matrices, not constants; jaxtyping leaves NumPy's parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportMissingTypeStubs=false
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from opspace.law.blending import Weighted
from opspace.law.hierarchy import Level, WhitenedTask
from opspace.law.nearest import cleaned
from opspace.law.scalars import (
    BROKEN,
    LEFT,
    ROOM_CLEANINGS,
    ROOM_SOFT,
    UNBOUNDED,
    UNSEEN,
    level_weight,
)


class Stacks(NamedTuple):
    """Stacks that are mixed, without the damping of what no task uses.

    Attributes:
        whitened: Every task set.
        levels: Their levels, most important first.
        corners: Weights and members of the stacks, as indices into ``whitened``.
        damped: Whether what no task uses is damped.
    """

    whitened: Sequence[WhitenedTask]
    levels: Sequence[Level]
    corners: Sequence[Weighted]
    damped: bool


class RoomLeft(NamedTuple):
    """An acceleration whose lower levels left room, and what that took from each joint.

    Attributes:
        acceleration: (n,) q̈, rad/s².
        upper: (n,) by how much each upper bound lowers its joint's, rad/s².
        lower: (n,) the same of each lower bound.
    """

    acceleration: Float[np.ndarray, " n"]
    upper: Float[np.ndarray, " n"]
    lower: Float[np.ndarray, " n"]


def motions_left(stacks: Stacks, first: int, n: int, *, weighed: bool) -> Float[np.ndarray, "n n"]:
    """Project on the motions that the first levels do not see, smoothly.

        P_l = Σ_T w_T (I + κ Σ_{k in T, l(k) <= l} Ĵ_kᵀ Ĵ_k + Σ_{k in T, l(k) > l} ω_k Ĵ_kᵀ Ĵ_k)⁻¹

    Of each stack T the rows of the levels up to l count κ = 10⁵ times. Without weights ω = 0; with
    them ω is that of `task_metric` in T: of the motions that are left, those that levels below see
    count more the higher they are.

    Args:
        stacks: What is mixed.
        first: Number of levels up to l.
        n: Number of joints.
        weighed: Whether levels below count.

    Returns:
        P_l, (n, n).
    """
    P = np.zeros((n, n))
    for weight, present in stacks.corners:
        S = np.eye(n)
        below = 0
        for place, level in reversed(list(enumerate(stacks.levels))):
            here = level.members & present
            factor = UNSEEN if place < first else level_weight(below) if weighed else 0.0
            if factor > 0.0:
                for row in (row for k in sorted(here) for row in stacks.whitened[k].J):
                    S = narrowed(S, row, factor)
            below += bool(here)
        P += weight * S @ S.T
    return P


def narrowed(
    S: Float[np.ndarray, "n n"], row: Float[np.ndarray, " n"], weight: float
) -> Float[np.ndarray, "n n"]:
    """Count a row in, in a root of the inverse of what has been counted.

        S Sᵀ = P   becomes   (P⁻¹ + w rowᵀ row)⁻¹,
        S (I − f fᵀ / (‖f‖² + 1/w + √(1/w (‖f‖² + 1/w)))),   f = Sᵀ rowᵀ

    A root has half as many digits to keep as P or its inverse, whose numbers differ w times.

    Args:
        S: (n, n) a root of P.
        row: (n,) what is counted.
        weight: w, above 0.

    References:
        Potter's update of the root of a covariance: Kaminski, Bryson and Schmidt, "Discrete square root
        filtering: a survey of current techniques", IEEE Transactions on Automatic Control 16(6), 1971.
    """
    f = S.T @ row
    total = f @ f + 1.0 / weight
    return S - np.outer(S @ f, f) / (total + np.sqrt(total / weight))


def wants_more(
    acceleration: Float[np.ndarray, " n"],
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
) -> bool:
    """Tell whether a joint does more than what is left of its limits to levels below others.

    Args:
        acceleration: (n,) q̈, rad/s².
        lower: (n,) least accelerations, -inf where there is none.
        upper: (n,) largest accelerations, inf where there is none.
    """
    most = _most_below(lower, upper)
    over = np.concatenate([acceleration, -acceleration]) - most
    return bool(np.any(over > BROKEN * np.maximum(1.0, most)))


def _most_below(
    lower: Float[np.ndarray, " n"], upper: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " k"]:
    return LEFT * np.maximum(np.concatenate([upper, -lower]), 0.0)


def leave_room(
    L: Float[np.ndarray, "n n"],
    stacks: Stacks,
    acceleration: Float[np.ndarray, " n"],
    lower: Float[np.ndarray, " n"],
    upper: Float[np.ndarray, " n"],
) -> RoomLeft:
    """Let levels drive no joint to its limit at the cost of those above them.

    From the last level up, with x = Lᵀ q̈ and what the levels up to l want, x_l = x − P_l x
    (`motions_left`), the nearest x' in the metric of what is left with

        q̈_j <= c max(upper_j, 0) + max(q̈_j of x_l, 0)

    and the same on the other side, as far as anything of level l is there: levels below l may use half
    of what a limit leaves, c = ½, and what those above do not use. At a limit, where nothing is left,
    the levels below press no longer, as far as they move the joint (`ROOM_SOFT`), and those above have
    next to nothing to give way to at rest. Nothing changes unless `wants_more`. P_l has next to
    nothing of what upper levels see; it is asked for products, never for its inverse.

    Args:
        L: (n, n) Cholesky factor of the inertia.
        stacks: What is mixed.
        acceleration: (n,) q̈, rad/s².
        lower: (n,) least accelerations, -inf where there is none.
        upper: (n,) largest accelerations, inf where there is none.

    Returns:
        q̈ and what was taken from each joint.
    """
    n = acceleration.size
    taken = np.zeros(2 * n)
    most = _most_below(lower, upper)
    here = most < UNBOUNDED
    joints = np.linalg.inv(L).T
    rows = np.concatenate([joints, -joints])[here]
    size = np.linalg.norm(rows, axis=1)
    rows, most = rows / size[:, None], most[here] / size
    softness = np.full(most.size, ROOM_SOFT)
    x = L.T @ acceleration
    for first in range(len(stacks.levels) - (not stacks.damped), 0, -1):
        members = stacks.levels[first - 1].members
        share = sum(weight for weight, present in stacks.corners if present & members)
        if not np.any(rows @ x > most):
            continue
        above = x - motions_left(stacks, first, n, weighed=False) @ x
        ways = rows @ motions_left(stacks, first, n, weighed=True)
        bounds = most + np.maximum(rows @ above, 0.0)
        y, multipliers = cleaned(x, rows, bounds, softness, ROOM_CLEANINGS, ways)
        taken[here] += share * multipliers * np.sum(rows * ways, axis=1) * size
        x = x + share * (y - x)
    return RoomLeft(np.linalg.solve(L.T, x), taken[:n], taken[n:])
