"""The hard law: strict priorities, each level compensating what the levels above already do.

Everything here happens in whitened coordinates. With A = L Lᵀ, Ĵ = J L⁻ᵀ and û = L⁻¹ Γ, the task
acceleration that a torque causes is J A⁻¹ Γ = Ĵ û, the dynamically consistent inverse becomes the
Moore-Penrose inverse of Ĵ, and the dynamically consistent null-space projector becomes orthogonal.
A level is therefore a minimum-norm least-squares problem in the space that the levels above left free.
"""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from opspace.law.scalars import RANK_TOLERANCE
from opspace.law.tasksets import TaskSet


@dataclass(frozen=True)
class WhitenedTask:
    """A task set in whitened coordinates, its rows divided by the square root of their reference.

    Attributes:
        J: Ĵ_k = W J_k L⁻ᵀ with W = diag(sigma_reference)^(−1/2), shape (m, n).
        f: W f̃_k, shape (m,).
        unrest: How far it is from rest at its target.
    """

    J: Float[np.ndarray, "m n"]
    f: Float[np.ndarray, " m"]
    unrest: float = 1.0


@dataclass(frozen=True)
class Level:
    """Indices of the task sets that share a priority."""

    priority: int
    members: frozenset[int]


class Partial(NamedTuple):
    """What the levels above have decided.

    Attributes:
        u: Whitened torque û so far, shape (n,).
        Z: Orthonormal basis of the motions still free, shape (n, r); N = Z Zᵀ.
    """

    u: Float[np.ndarray, " n"]
    Z: Float[np.ndarray, "n r"]


def whiten(tasks: Sequence[TaskSet], L: Float[np.ndarray, "n n"]) -> list[WhitenedTask]:
    """Express task sets in the coordinates in which the kinetic energy is ½‖·‖².

    Args:
        tasks: Task sets with n columns.
        L: Lower Cholesky factor of the inertia, shape (n, n).

    Returns:
        The same task sets as (W J L⁻ᵀ, W f).
    """
    if not tasks:
        return []
    stacked = np.linalg.solve(L, np.concatenate([task.J for task in tasks]).T).T
    whitened: list[WhitenedTask] = []
    row = 0
    for task in tasks:
        weight = 1.0 / np.sqrt(task.sigma_reference)
        rows = stacked[row : row + weight.size]
        whitened.append(WhitenedTask(weight[:, None] * rows, weight * task.f, task.unrest))
        row += weight.size
    return whitened


def levels_of(tasks: Sequence[TaskSet]) -> list[Level]:
    """Group task sets by priority, most important first."""
    priorities = sorted({task.priority for task in tasks})
    return [
        Level(p, frozenset(k for k, task in enumerate(tasks) if task.priority == p))
        for p in priorities
    ]


def stack_rows(
    whitened: Sequence[WhitenedTask], members: Iterable[int]
) -> tuple[Float[np.ndarray, "m n"], Float[np.ndarray, " m"]]:
    """Stack the rows of the task sets of one level, in the order of their indices."""
    order = sorted(members)
    J = np.concatenate([whitened[k].J for k in order])
    f = np.concatenate([whitened[k].f for k in order])
    return J, f


def start(n: int) -> Partial:
    """Nothing decided, everything free: û₀ = 0, N₀ = I."""
    return Partial(np.zeros(n), np.eye(n))


def solve_level(
    J: Float[np.ndarray, "m n"],
    f: Float[np.ndarray, " m"],
    above: Partial,
    *,
    compensate: bool = True,
) -> Partial:
    """Add one level below those already decided (Eq. 10, 15-16 and 22, with the compensation term).

    û_l = û_{l−1} + (Ĵ_l N_{l−1})⁺ (f_l − Ĵ_l û_{l−1}),   N_l = N_{l−1} − (Ĵ_l N_{l−1})⁺ Ĵ_l N_{l−1}

    Args:
        J: Whitened Jacobian of the level, shape (m, n).
        f: Desired value of the level, shape (m,).
        above: Result of the levels above.
        compensate: Subtract what the levels above already do to this one. False is Eq. 15-23 to
            the letter, which is not continuous.

    Returns:
        The torque with this level and the motions that it leaves free.
    """
    JN = J @ above.Z
    U, s, Vt = np.linalg.svd(JN)
    rank = int(np.sum(s > RANK_TOLERANCE * np.linalg.norm(J, 2))) if J.size and s.size else 0
    residual = f - J @ above.u if compensate else f
    step = Vt[:rank].T @ ((U[:, :rank].T @ residual) / s[:rank])
    return Partial(above.u + above.Z @ step, above.Z @ Vt[rank:].T)


def hard_law(
    whitened: Sequence[WhitenedTask],
    levels: Sequence[Level],
    present: frozenset[int],
    n: int,
    *,
    compensate: bool = True,
) -> Float[np.ndarray, " n"]:
    """Solve the hierarchy of the task sets that are present, û = H(S; f).

    Args:
        whitened: Every task set; their ``f`` may be intermediate desired values.
        levels: Every level, most important first.
        present: Indices of the task sets in the stack; the others do not exist.
        n: Number of joints.
        compensate: See `solve_level`.

    Returns:
        Whitened torque û, shape (n,); zero for an empty stack.
    """
    partial = start(n)
    for level in levels:
        members = level.members & present
        if members and partial.Z.shape[1]:
            J, f = stack_rows(whitened, members)
            partial = solve_level(J, f, partial, compensate=compensate)
    return partial.u
