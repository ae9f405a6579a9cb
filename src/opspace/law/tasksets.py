"""Task sets as arrays: what the law is asked for, checked once at the door."""

# J, M and R are the paper's matrices, not constants; jaxtyping leaves NumPy's type parameters open.
# pyright: strict, reportConstantRedefinition=false, reportUnknownMemberType=false
# pyright: reportUnknownVariableType=false, reportUnknownArgumentType=false
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from opspace.errors import InputError


@dataclass(frozen=True, init=False, eq=False)
class TaskSet:
    """One task set: J q̈ = f is wanted, at a priority, with an activation.

    Args:
        J: Task Jacobian J_k, shape (m, n). Zero rows and dependent rows are ordinary input.
        f: What the law must realise, f̃_k of Eq. 3: commanded task acceleration minus the drift J̇ q̇
            (plus J A⁻¹(b + g) when the bias is compensated in task space), shape (m,), m/s² or rad/s².
        priority: Level; a lower number is more important, equal numbers have no priority among them.
        activation: h_k in [0, 1]; 0 is the stack without the task set, 1 the stack with it.
        name: Used in error messages and diagnostics only.
        sigma_reference: Typical eigenvalue of J A⁻¹ Jᵀ, 1/kg or 1/(kg·m²), one number or one per row
            (m,). Rows are divided by its square root wherever rows are weighed against each other:
            in the spectrum that singular directions are taken from, and in the least-squares
            compromise of a level that cannot be satisfied. 1 leaves both in SI units, as in the paper.
        unrest: How far the task is from rest at its target: 0 at rest there, 1 and more far away or
            fast. Singular directions of a level at rest fade later, see `opspace.law.SigmaBuffer`.

    Raises:
        InputError: A shape or value cannot be used; the message names the task set.
    """

    J: Float[np.ndarray, "m n"]
    f: Float[np.ndarray, " m"]
    priority: int
    activation: float
    name: str
    sigma_reference: Float[np.ndarray, " m"]
    unrest: float

    def __init__(
        self,
        J: ArrayLike,
        f: ArrayLike,
        priority: int = 0,
        activation: float = 1.0,
        name: str = "",
        sigma_reference: ArrayLike = 1.0,
        unrest: float = 1.0,
    ) -> None:
        who = f"task set {name!r}" if name else "task set"
        J = _array(J, f"{who}: J")
        if J.ndim != 2:
            raise InputError(f"{who}: J must have shape (m, n), got {J.shape}")
        f = _array(f, f"{who}: f")
        if f.shape != (J.shape[0],):
            raise InputError(
                f"{who}: f must have shape ({J.shape[0]},) like J's rows, got {f.shape}"
            )
        if isinstance(priority, bool) or int(priority) != priority:
            raise InputError(f"{who}: priority must be a whole number, got {priority!r}")
        activation = float(activation)
        if not 0.0 <= activation <= 1.0:
            raise InputError(f"{who}: activation must be in [0, 1], got {activation}")
        reference = _array(sigma_reference, f"{who}: sigma_reference")
        if reference.shape not in ((), f.shape) or not np.all(reference > 0.0):
            raise InputError(
                f"{who}: sigma_reference must be positive, one number or shape {f.shape}, "
                f"got {sigma_reference}"
            )
        object.__setattr__(self, "J", J)
        object.__setattr__(self, "f", f)
        object.__setattr__(self, "priority", int(priority))
        object.__setattr__(self, "activation", activation)
        object.__setattr__(self, "name", name)
        unrest = float(unrest)
        if not 0.0 <= unrest < float("inf"):
            raise InputError(f"{who}: unrest must be >= 0 and finite, got {unrest}")
        object.__setattr__(self, "sigma_reference", np.broadcast_to(reference, f.shape))
        object.__setattr__(self, "unrest", unrest)

    def replace(self, *, f: ArrayLike | None = None, activation: float | None = None) -> "TaskSet":
        """Copy this task set with another desired value or activation."""
        return TaskSet(
            self.J,
            self.f if f is None else f,
            self.priority,
            self.activation if activation is None else activation,
            self.name,
            self.sigma_reference,
            self.unrest,
        )


def _array(value: ArrayLike, what: str) -> Float[np.ndarray, "..."]:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{what} is not an array of numbers: {error}") from None
    if not np.all(np.isfinite(array)):
        raise InputError(f"{what} has entries that are not finite")
    return array


def check_inertia(M: ArrayLike) -> tuple[Float[np.ndarray, "n n"], Float[np.ndarray, "n n"]]:
    """Check a joint-space inertia and factor it, A = L Lᵀ.

    Args:
        M: Joint-space inertia A(q) of Eq. 1, shape (n, n).

    Returns:
        The inertia as an array and its lower Cholesky factor L, both (n, n).

    Raises:
        InputError: Not square, not finite, not symmetric or not positive definite.
    """
    M = _array(M, "inertia M")
    if M.ndim != 2 or M.shape[0] != M.shape[1] or M.shape[0] == 0:
        raise InputError(f"inertia M must have shape (n, n) with n >= 1, got {M.shape}")
    if not np.allclose(M, M.T, rtol=1e-8, atol=1e-10 * float(np.max(np.abs(M)))):
        raise InputError("inertia M must be symmetric")
    try:
        L = np.linalg.cholesky(M)
    except np.linalg.LinAlgError:
        smallest = float(np.linalg.eigvalsh(M)[0])
        raise InputError(
            f"inertia M must be positive definite; its smallest eigenvalue is {smallest:.3g}"
        ) from None
    return M, L


def as_list(tasks: Iterable[TaskSet]) -> list[TaskSet]:
    """Collect task sets.

    Raises:
        InputError: It is not a list of anything.
    """
    try:
        return list(tasks)
    except TypeError:
        raise InputError(
            f"task sets come in a list, got a {type(tasks).__name__}: [TaskSet(...), ...]"
        ) from None


def check_tasks(tasks: Sequence[TaskSet], n: int) -> None:
    """Check that every entry is a task set for ``n`` joints.

    Raises:
        InputError: An entry is something else or has the wrong number of columns.
    """
    for index, task in enumerate(tasks):
        if not isinstance(task, TaskSet):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise InputError(f"task set {index} is a {type(task).__name__}, expected a TaskSet")
        if task.J.shape[1] != n:
            who = f"task set {index}" + (f" ({task.name!r})" if task.name else "")
            raise InputError(
                f"{who}: J must have {n} columns like the inertia M, got {task.J.shape[1]}"
            )
