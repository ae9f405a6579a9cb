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
from opspace.law.nearest import cleaned, levels_below
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
        tasks: Which task each set is: the same one at two levels while a task moves.
        damped: Whether what no task uses is damped.
    """

    whitened: Sequence[WhitenedTask]
    levels: Sequence[Level]
    corners: Sequence[Weighted]
    tasks: Sequence[str]
    damped: bool

    def shares(self) -> list[float]:
        """Tell how much of each task set is there, h_k; those of all stacks are 1 exactly."""
        missing = [
            sum(weight for weight, present in self.corners if k not in present)
            for k in range(len(self.whitened))
        ]
        return [max(1.0 - part, 0.0) for part in missing]


class Seen(NamedTuple):
    """Rows that count, as far as something is there.

    Attributes:
        share: How much of it is there.
        weight: How often they count.
        J: (m, n) the rows.
    """

    share: float
    weight: float
    J: Float[np.ndarray, "m n"]


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

        P_l = ∫₀¹ (I + κ Σ_{h_k >= θ} Ĵ_kᵀ Ĵ_k + Σ_{h_k < θ <= g_k} ω_k Ĵ_kᵀ Ĵ_k)⁻¹ dθ

    with h_k how much of task k is at the levels up to l, and g_k how much at any. Rows of the levels
    up to l count κ = 10⁵ times. Without weights ω = 0; with them it is the `level_weight` of
    `levels_below`, in the mean where k is on its way between such levels: of the motions that are
    left, those that levels below see count more the higher they are.

    The integral is a sum over as many stacks as there are different h and g, one more with each, so
    every row is counted in once however many tasks are on their way. P_l changes by no more than h
    and g do, and where they are 0 or 1 it is that of the stack.

    Args:
        stacks: What is mixed.
        first: Number of levels up to l.
        n: Number of joints.
        weighed: Whether levels below count.

    Returns:
        P_l, (n, n).
    """
    P, S, before = np.zeros((n, n)), np.eye(n), 1.0
    for share, weight, J in _seen(stacks, first, weighed):
        P += (before - share) * S @ S.T
        for row in J:
            S = narrowed(S, row, weight)
        before = share
    return P + before * S @ S.T


def _seen(stacks: Stacks, first: int, weighed: bool) -> list[Seen]:
    """What counts for the first levels, with the largest share first."""
    shares, found = stacks.shares(), list[Seen]()
    above: dict[str, list[float]] = {task: [] for task in stacks.tasks}
    below: dict[str, list[tuple[float, float]]] = {task: [] for task in stacks.tasks}
    for place, count in enumerate(levels_below(stacks.levels, shares)):
        for k in stacks.levels[place].members:
            if place < first:
                above[stacks.tasks[k]].append(shares[k])
            else:
                below[stacks.tasks[k]].append((shares[k], count))
    for task, J in zip(stacks.tasks, (one.J for one in stacks.whitened), strict=True):
        here, there = min(sum(above.pop(task, ())), 1.0), below.pop(task, ())
        others, weight = sum(share for share, _ in there), 0.0
        if weighed and others > 0.0:
            weight = level_weight(sum(share * count for share, count in there) / others)
            found.append(Seen(min(here + others, 1.0), weight, J))
        if here > 0.0:
            found.append(Seen(here, UNSEEN - weight, J))
    return sorted(found, key=lambda seen: -seen.share)


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
