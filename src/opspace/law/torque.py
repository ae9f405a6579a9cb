"""The law in joint space: torques and intermediate desired values from inertia and task sets."""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, overload

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from opspace.errors import InputError, unknown_name
from opspace.law.blending import BLENDINGS, Weighted, corners
from opspace.law.hierarchy import hard_law, levels_of, whiten
from opspace.law.recursion import Recursion, law_recursion
from opspace.law.singular_directions import SigmaBuffer
from opspace.law.tasksets import TaskSet, as_list, check_inertia, check_tasks
from opspace.law.tree import LevelReport, Motors, Walk

COUPLINGS = ("compensated", "as-printed")
"""``compensated``: lower levels know what higher ones do. ``as-printed``: Eq. 15-23 to the letter."""


@dataclass(frozen=True)
class LawInfo:
    """What one evaluation of the law cost and found.

    Attributes:
        hard_solves: Hard torques that entered the blend (2^k or k + 1 for k moving task sets).
        level_solves: Levels factored; less than hard_solves times levels, because corners share.
        levels: Per level, most important first: members, and the directions with their σ and
            activation where a sigma buffer was given.
    """

    hard_solves: int
    level_solves: int
    levels: tuple[LevelReport, ...]


@overload
def task_torque(
    M: ArrayLike,
    tasks: Sequence[TaskSet],
    blending: str = "idv",
    *,
    coupling: str = "compensated",
    singular: SigmaBuffer | None = None,
    info: Literal[False] = False,
) -> Float[np.ndarray, " n"]: ...


@overload
def task_torque(
    M: ArrayLike,
    tasks: Sequence[TaskSet],
    blending: str = "idv",
    *,
    coupling: str = "compensated",
    singular: SigmaBuffer | None = None,
    info: Literal[True],
) -> tuple[Float[np.ndarray, " n"], LawInfo]: ...


def task_torque(
    M: ArrayLike,
    tasks: Sequence[TaskSet],
    blending: str = "idv",
    *,
    coupling: str = "compensated",
    singular: SigmaBuffer | None = None,
    info: bool = False,
) -> Float[np.ndarray, " n"] | tuple[Float[np.ndarray, " n"], LawInfo]:
    r"""Compute the torque of a stack of task sets with activations, the bias not included.

    Eq. 19-23 for any number of task sets at any priorities. By the theorem of docs/theory.md the
    recursion of intermediate desired values equals the blend

        Γ(h) = Σ_T Π_{k∈T} h_k Π_{k∉T} (1 − h_k) H(T; f̃)            blending="idv"

    of hard torques H, which is how it is evaluated. ``blending="chain"`` adds the k + 1 hard torques
    of the i most active task sets with weights h_(i) − h_(i+1) instead; both agree wherever at
    most one task set is moving.

    Args:
        M: Joint-space inertia A(q), shape (n, n), symmetric positive definite.
        tasks: Task sets in any order; an empty stack gives zero torque.
        blending: ``"idv"`` (2^k hard torques for k task sets with 0 < h < 1) or ``"chain"`` (k + 1).
        coupling: ``"compensated"``, or ``"as-printed"`` for Eq. 15-23 to the letter, which lack the
            term that subtracts what higher levels do to a lower one and are therefore not
            continuous; for comparison only.
        singular: Fade directions with small σ, at every level. None is the plain law, in which only
            exact rank deficiency is removed.
        info: Return the cost and the directions as well.

    Returns:
        Torque Γ, shape (n,), N·m; with ``info`` also a `LawInfo`.

    Raises:
        InputError: An array cannot be used, or options exclude each other.
        UnknownNameError: There is no such blending or coupling.

    References:
        "A Continuous Task Transition Algorithm for Operational Space Control Framework", Eq. 8-23.
    """
    M, L = check_inertia(M)
    tasks = as_list(tasks)
    check_tasks(tasks, M.shape[0])
    if coupling not in COUPLINGS:
        raise unknown_name("coupling", coupling, COUPLINGS)
    if coupling == "as-printed":
        tau, found = _as_printed(tasks, L, blending, singular)
        return (tau, found) if info else tau
    # Left out before any arithmetic, so that "out" is the same stack to the last bit.
    where = [k for k, task in enumerate(tasks) if task.activation > 0.0]
    present = [tasks[k] for k in where]
    blend = corners([task.activation for task in present], blending)
    tau, found = blended_torque(L, present, blend, singular, want_spectra=info)
    if not info:
        return tau
    levels = tuple(
        LevelReport(r.priority, tuple(where[k] for k in r.members), r.weight, r.spectrum)
        for r in found.levels
    )
    return tau, LawInfo(found.hard_solves, found.level_solves, levels)


def blended_torque(
    L: Float[np.ndarray, "n n"],
    tasks: Sequence[TaskSet],
    blend: Sequence[Weighted],
    singular: SigmaBuffer | None = None,
    *,
    want_spectra: bool = False,
    motors: Motors | None = None,
    motion: Float[np.ndarray, " n"] | None = None,
) -> tuple[Float[np.ndarray, " n"], LawInfo]:
    """Compute Σ_T w_T H(T; f̃) for corners T that the caller has chosen.

    Args:
        L: Lower Cholesky factor of the inertia, shape (n, n).
        tasks: Every task set that is in some corner; their activations are not looked at.
        blend: Corners, as indices into ``tasks``, with weights that sum to 1.
        singular: Buffer for singular directions, or None.
        want_spectra: Report the directions of every level.
        motors: Torque limits to stay inside of, the lowest level giving way first.
        motion: Whitened velocity Lᵀ q̇, shape (n,), which a buffer with damping needs; None is at rest.

    Returns:
        Torque Γ, shape (n,), N·m, and what it took.
    """
    walk = Walk(
        whiten(tasks, L),
        levels_of(tasks),
        buffer=singular,
        want_spectra=want_spectra,
        motors=motors,
        motion=motion,
    )
    tau = L @ walk.torque(blend, L.shape[0])
    got = {p: min(total / weight, 1.0) for p, (total, weight) in walk.report.got.items()}
    levels = tuple(
        replace(walk.report.levels[p], scale=got.get(p, 1.0)) for p in sorted(walk.report.levels)
    )
    return tau, LawInfo(walk.report.hard_solves, walk.report.level_solves, levels)


def _as_printed(
    tasks: Sequence[TaskSet],
    L: Float[np.ndarray, "n n"],
    blending: str,
    singular: SigmaBuffer | None,
) -> tuple[Float[np.ndarray, " n"], LawInfo]:
    if blending not in BLENDINGS:
        raise unknown_name("blending", blending, BLENDINGS)
    if blending != "idv" or singular is not None:
        raise InputError(
            "coupling='as-printed' is the paper's recursion to the letter: it goes with "
            "blending='idv' and without a sigma buffer"
        )
    levels = levels_of(tasks)
    recursion = law_recursion(
        whiten(tasks, L), levels, [task.activation for task in tasks], L.shape[0], compensate=False
    )
    u = recursion.command(frozenset(range(len(tasks))))
    return L @ u, LawInfo(recursion.solves, recursion.solves * len(levels), ())


Controller = Callable[[Sequence[TaskSet]], ArrayLike]
"""Any controller as a function: task sets, all with activation 1, to a joint torque (n,)."""


def intermediate_values(
    M_or_solve: ArrayLike | Controller,
    tasks: Sequence[TaskSet],
    M: ArrayLike | None = None,
    *,
    blending: str = "idv",
) -> list[Float[np.ndarray, " _"]]:
    r"""Compute the intermediate desired values that make a stack's controller continuous.

    f_k^i = h_k f̃_k + (1 − h_k) J_k A⁻¹ Γ*_k (Eq. 9, Eq. 12, Eq. 13, Eq. 18, Eq. 20, Eq. 23), where
    Γ*_k is the torque of the stack without task set k, itself with intermediate desired values. A
    controller that treats every task set as fully present and is fed f^i instead of f̃ is continuous
    in the activations.

    For ``blending="chain"``, and for any blend with weights w_T, the same reads
    f_k^i = h_k f̃_k + Σ_{T∌k} w_T J_k A⁻¹ H(T; f̃).

    Args:
        M_or_solve: The joint-space inertia (n, n), for the library's own law; or a function
            ``solve(task_sets) -> torque`` for a controller of your own, which is called with task
            sets of activation 1 and intermediate values as ``f``; the list may be empty.
        tasks: Task sets with their activations.
        M: The inertia (n, n) when the first argument is a function: a torque says what it does to a
            task only through the inertia. For a controller that returns joint accelerations, or
            joint velocities in kinematic control, it is the identity.
        blending: ``"idv"`` (the recursion, 2^k − 1 calls for k moving task sets) or ``"chain"``
            (at most k + 1).

    Returns:
        f_k^i for every task set in the order given, shapes (m_k,).

    Raises:
        InputError: An array cannot be used, the inertia is missing, or ``solve`` returned something
            that is not a torque.
        UnknownNameError: There is no such blending.
    """
    tasks = as_list(tasks)
    activations = [task.activation for task in tasks]
    if callable(M_or_solve):
        if M is None:
            raise InputError(
                "intermediate_values(solve, tasks, M): the inertia M is needed to know what a "
                "torque does to a task (the identity if solve returns joint accelerations)"
            )
        inertia, _ = check_inertia(M)
        n = inertia.shape[0]
        check_tasks(tasks, n)
        return _values_for_controller(M_or_solve, tasks, inertia, activations, blending)
    if M is not None:
        raise InputError("intermediate_values(M, tasks) takes the inertia once")
    inertia, L = check_inertia(M_or_solve)
    n = inertia.shape[0]
    check_tasks(tasks, n)
    whitened = whiten(tasks, L)
    levels = levels_of(tasks)

    def law(present: frozenset[int]) -> Float[np.ndarray, " n"]:
        return hard_law(whitened, levels, present, n)

    def outcome(k: int, u: Float[np.ndarray, " n"]) -> Float[np.ndarray, " m"]:
        return np.sqrt(tasks[k].sigma_reference) * (whitened[k].J @ u)

    # By the theorem the blend of the corners without k is the recursion's Γ*_k.
    return _values_of_blend(tasks, corners(activations, blending), law, outcome)


def _values_of_blend(
    tasks: Sequence[TaskSet],
    blend: Sequence[Weighted],
    law: Callable[[frozenset[int]], Float[np.ndarray, " n"]],
    outcome: Callable[[int, Float[np.ndarray, " n"]], Float[np.ndarray, " m"]],
) -> list[Float[np.ndarray, " _"]]:
    """f_k^i = h_k f̃_k + Σ_{T∌k} w_T J_k A⁻¹ H(T; f̃)."""
    values = [task.activation * task.f for task in tasks]
    for weight, present in blend:
        absent = [k for k in range(len(tasks)) if k not in present]
        if absent:
            command = law(present)
            for k in absent:
                values[k] = values[k] + weight * outcome(k, command)
    return values


def _values_for_controller(
    solve: Controller,
    tasks: Sequence[TaskSet],
    M: Float[np.ndarray, "n n"],
    activations: Sequence[float],
    blending: str,
) -> list[Float[np.ndarray, " _"]]:
    def command(
        present: frozenset[int], values: Sequence[Float[np.ndarray, " _"]]
    ) -> Float[np.ndarray, " n"]:
        fed = [tasks[k].replace(f=values[k], activation=1.0) for k in sorted(present)]
        tau = np.asarray(solve(fed), dtype=np.float64)
        if tau.shape != (M.shape[0],) or not np.all(np.isfinite(tau)):
            raise InputError(
                f"solve must return a finite torque of shape ({M.shape[0]},), got shape {tau.shape}"
                f"{'' if np.all(np.isfinite(tau)) else ' with entries that are not finite'}"
            )
        return tau

    def outcome(k: int, tau: Float[np.ndarray, " n"]) -> Float[np.ndarray, " m"]:
        return tasks[k].J @ np.linalg.solve(M, tau)

    desired = [task.f for task in tasks]
    blend = corners(activations, blending)
    if blending == "chain":
        return _values_of_blend(tasks, blend, lambda present: command(present, desired), outcome)
    recursion = Recursion(desired, activations, command, outcome)
    everything = frozenset(range(len(tasks)))
    return [recursion.intermediate(k, everything) for k in range(len(tasks))]
